"""Where ways begin: the path along the entrances of a row, or the step out of one building.

RZ section 4.2: paths in a group connect its entrances with each other.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..types import Floats
from .exitcheck import step_out
from .lane import Lane

#: A path along a row likes to be so far from its façades, metres.
FRONT_M = 5.0
#: Furthest that it may be, and the step in which it is tried, metres.
FURTHEST_M, STEP_M = 9.0, 0.5
#: Neighbours in a row: gap between them and difference of their entrances across it, metres.
ROW_GAP_M, ROW_SHIFT_M = 13.0, 4.0
#: Rows whose entrances face each other this close share a path in the middle, metres.
COURT_M = 24.0
#: With the street this close before them, entrances lead straight to it, metres.
STREET_M = 8.0
#: How far one steps out of a single building before anything else, over half a path, metres,
#: where there is room, else less.
STEP_OUT_M = (0.5, 0.25, 0.02)
#: Tests of room begin so far beyond the clearance of the own façade, metres.
JUST = 0.02


@dataclass(eq=False)
class Terminal:
    """What must be connected to street space: one building or a row of them.

    Attributes
    ----------
    members
        Indices of the buildings within the lane.
    stubs
        Lines from entrances to the path along the row, or the first step, shape (2, 2) each.
    spine
        The path along the row, shape (2, 2), or None for a single building.
    outward
        Unit vector out of the entrances.
    out
        Where a single building steps straight into the street, else None.
    """

    members: list[int]
    stubs: list[Floats]
    outward: Floats
    spine: Floats | None = None
    out: Floats | None = None

    @property
    def square(self) -> bool:
        """Tell whether the building stands square in the frame."""
        return bool(np.abs(self.outward).max() > 1 - 1e-9)

    @property
    def tips(self) -> list[Floats]:
        """Points from which a loop may go on: ends of the spine, or of the step out."""
        return [self.stubs[0][1]] if self.spine is None else [self.spine[0], self.spine[1]]


@dataclass
class _Row:
    """Buildings in a row, in order along it."""

    members: list[int]
    along: Floats
    outward: Floats
    place: Floats = field(default_factory=lambda: np.zeros(0))
    front: Floats = field(default_factory=lambda: np.zeros(0))


def terminals_of(lane: Lane) -> list[Terminal]:
    """Give the rows and single buildings of a patch.

    Parameters
    ----------
    lane
        The patch with its buildings.
    """
    found: list[Terminal] = []
    for row in _rows(lane):
        found.extend(_with_spines(lane, row, found))
    return found


def _rows(lane: Lane) -> list[_Row]:
    """Join buildings whose entrances look the same way, beside each other."""
    n = len(lane)
    out = lane.outward
    along = np.column_stack([out[:, 1], -out[:, 0]])
    parallel = out @ out.T > np.cos(np.radians(1.0))
    # Every pair is measured in the axes of its first building.
    step = lane.entrance[None, :, :] - lane.entrance[:, None, :]
    shift = np.abs(np.einsum("ijk,ik->ij", step, out))
    apart = np.abs(np.einsum("ijk,ik->ij", step, along))
    gap = apart - lane.half[:, :1] - lane.half[None, :, 0]
    near = parallel & (shift <= ROW_SHIFT_M) & (gap <= ROW_GAP_M) & ~np.eye(n, dtype=bool)
    i, j = np.nonzero(near)
    _, label = connected_components(
        coo_matrix((np.ones(len(i)), (i, j)), shape=(n, n)), directed=False
    )
    rows = []
    for k in range(int(label.max()) + 1):
        members = np.flatnonzero(label == k)
        u, o = along[members[0]], out[members[0]]
        place, front = lane.entrance[members] @ u, lane.entrance[members] @ o
        order = np.argsort(place, kind="stable")
        rows.append(
            _Row([int(m) for m in members[order]], u, o, place[order], front[order])
        )  # fmt: skip
    # Long rows choose first where their path runs.
    return sorted(rows, key=lambda r: (-len(r.members), r.members[0]))


def _with_spines(lane: Lane, row: _Row, others: list[Terminal]) -> list[Terminal]:
    """Give a row its path, or several where something stands in between."""
    base = float(row.front.max())
    wish, at_street = _wish(lane, row, base, others)
    if len(row.members) < 2 or at_street:
        return [_single(lane, m) for m in row.members]
    offsets = np.arange(lane.clearance_m + 0.05, FURTHEST_M, STEP_M)
    offsets = np.r_[wish, offsets[np.argsort(np.abs(offsets - wish), kind="stable")]]
    best: tuple[int, list[list[int]], float] | None = None
    for offset in offsets:
        runs = _runs(lane, row, base + offset)
        joined = sum(len(run) - 1 for run in runs)
        if best is None or joined > best[0]:
            best = joined, runs, base + offset
        if joined == len(row.members) - 1:
            break
    made = []
    for run in best[1] if best is not None else []:
        if len(run) == 1:
            made.append(_single(lane, row.members[run[0]]))
            continue
        level = best[2] if best is not None else base
        feet = [_foot(row, k, level) for k in run]
        stubs = [
            np.array([lane.entrance[row.members[k]], foot]) for k, foot in zip(run, feet)
        ]  # fmt: skip
        made.append(
            Terminal(
                [row.members[k] for k in run], stubs, row.outward, np.array([feet[0], feet[-1]])
            )
        )
    return made


def _foot(row: _Row, k: int, level: float) -> Floats:
    """Give the point of the path before the k-th entrance of a row."""
    return np.asarray(row.place[k] * row.along + level * row.outward)


def _runs(lane: Lane, row: _Row, level: float) -> list[list[int]]:
    """Split a row where its path at a level would not pass."""
    runs: list[list[int]] = []
    for k in range(len(row.members)):
        joins = (
            k > 0
            and lane.allows(np.array([_foot(row, k - 1, level), _foot(row, k, level)]))
            and _stands(lane, row, k, level)
            and _stands(lane, row, k - 1, level)
        )
        if joins:
            runs[-1].append(k)
        else:
            runs.append([k])
    return runs


def _stands(lane: Lane, row: _Row, k: int, level: float) -> bool:
    """Tell whether the k-th entrance sees its point of the path."""
    foot = _foot(row, k, level)
    start = foot + (row.front[k] + lane.clearance_m + JUST - level) * row.outward
    return lane.allows(np.array([start, foot]))


def _wish(lane: Lane, row: _Row, base: float, others: list[Terminal]) -> tuple[float, bool]:
    """Give how far before its façades a row likes its path, and whether it stands at the street.

    In the middle where there is little room or another row's entrances are opposite, else at
    `FRONT_M`. Where a path runs before these façades already, it is taken.
    """
    ends = np.array([row.place[0], row.place[-1]])
    if len(row.members) == 1:
        ends = ends + np.array([-1.0, 1.0])
    for other in others:
        level = _level(row, other, ends)
        if level is not None and lane.clearance_m < level - base <= COURT_M / 2 + 0.5:
            return level - base, False
    deep = 2 * COURT_M
    strip = shapely.polygons(
        [
            ends[0] * row.along + (base + 0.1) * row.outward,
            ends[1] * row.along + (base + 0.1) * row.outward,
            ends[1] * row.along + (base + deep) * row.outward,
            ends[0] * row.along + (base + deep) * row.outward,
        ]
    )
    depth, street = deep, False
    for shape, is_street in (
        (lane.built, False),
        (lane.walls, False),
        (lane.access, True),
    ):
        hit = shapely.get_coordinates(shape.intersection(strip))
        if len(hit) and (hit @ row.outward).min() - base < depth:
            depth, street = float((hit @ row.outward).min()) - base, is_street
    if street and depth <= STREET_M:
        return depth, True
    opposite = (lane.outward @ row.outward < -0.99) & (
        np.abs(lane.entrance @ row.outward - base - depth) < 1.0
    )
    if opposite.any() and depth <= COURT_M:
        return depth / 2, False
    return min(FRONT_M, depth / 2), False


def _level(row: _Row, other: Terminal, ends: Floats) -> float | None:
    """Give the level of another row's path, if it is parallel and before this row."""
    if other.spine is None:
        return None
    place, level = other.spine @ row.along, other.spine @ row.outward
    if abs(level[1] - level[0]) > 0.1 or place.max() < ends[0] or place.min() > ends[1]:
        return None
    return float(level[0])


def _single(lane: Lane, member: int) -> Terminal:
    """Give the step out of one building."""
    point, out = lane.entrance[member], lane.outward[member]
    street = step_out(point, out, lane.access, lane.walls, STREET_M)
    if street is not None:
        rest = np.array([point + out * min(lane.clearance_m + JUST, _far(point, street)), street])
        if not lane.allows(rest):
            street = None
    if street is not None:
        return Terminal([member], [np.array([point, street])], out, None, street)
    ends = [point + out * (lane.clearance_m + more) for more in STEP_OUT_M]
    end = next((e for e in ends if lane.free.covers(shapely.Point(e))), ends[0])
    return Terminal([member], [np.array([point, end])], out)


def _far(a: Floats, b: Floats) -> float:
    return float(np.hypot(*(a - b)))
