"""How many squares fit between the walls of a footprint: whole numbers along one axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_matrix, hstack

from ...mesh.quadmesh import FloatArray, IntArray
from .rings import WallRing

SAME = 0.02
"""Walls closer than this many modules lie on one line."""
JOG = 0.4
"""A jog of less than this many modules needs no row of squares of its own."""
BAND = 0.05
"""Strips thinner than this many modules are not looked across."""
OUTSIDE = 0.1
"""Weight of distances across a courtyard or a notch; those across rooms weigh up to 1."""
EVEN = 0.05
"""Weight of the distance between neighbouring lines."""


@dataclass(frozen=True)
class _Span:
    """A distance between two lines that should be as many squares long as it is modules."""

    low: int
    high: int
    least: int
    weight: float


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of walls along one axis.

    Attributes
    ----------
    at
        Shape (k,). Their places, ascending, metres.
    of
        For each ring, the line of each wall, -1 for walls along the other axis.
    """

    at: FloatArray
    of: tuple[IntArray, ...]


def wall_lines(rings: Sequence[WallRing], parity: int, module: float) -> Lines:
    """Return the lines of the walls whose direction has a parity (0 first, 1 second axis)."""
    chosen = [ring.direction % 2 == parity for ring in rings]
    offsets = np.concatenate([ring.offset[own] for ring, own in zip(rings, chosen)])
    order = np.argsort(offsets, kind="stable")
    fresh = np.diff(offsets[order], prepend=-np.inf) > SAME * module
    group = np.empty(len(order), dtype=np.int64)
    group[order] = np.cumsum(fresh) - 1
    at = np.bincount(group, offsets) / np.bincount(group)
    of, first = [], 0
    for own in chosen:
        line = np.full(len(own), -1, dtype=np.int64)
        line[own] = group[first : first + int(own.sum())]
        first += int(own.sum())
        of.append(line)
    return Lines(at, tuple(of))


def whole_steps(
    rings: Sequence[WallRing], across: Lines, along: Lines, parity: int, module: float
) -> IntArray | None:
    """Give every line a whole coordinate, so that squares between walls have about one module.

    Parameters
    ----------
    rings
        The walls.
    across
        Lines of the walls with the parity, whose coordinates are sought.
    along
        Lines of the other walls.
    parity
        0 for walls along the first axis, 1 for the second.
    module
        Side of a square, metres.

    Returns
    -------
    ndarray or None
        Shape (k,), ascending from 0; lines between which no square fits share a coordinate.
        None where the walls fit no grid.
    """
    spans = [*_wall_spans(rings, across, parity, module), *_facing(across, along, module)]
    if len(across.at) < 2 or any(s.low == s.high and s.least for s in spans):
        return None
    every = len(across.at) - 1
    spans = [s for s in spans if s.low < s.high]
    spans += [_Span(k, k + 1, 0, EVEN) for k in range(every)]
    wanted = np.array([across.at[s.high] - across.at[s.low] for s in spans]) / module
    # between n and n + 1 squares the change comes where both are off by the same factor
    whole = np.maximum(np.floor(wanted), 1.0)
    wanted += np.where(wanted > 1.0, whole + 0.5 - np.sqrt(whole * (whole + 1)), 0.0)
    weight = np.array([s.weight for s in spans]) / np.sqrt(np.maximum(1.0, wanted))
    row = np.repeat(np.arange(len(spans)), [s.high - s.low for s in spans])
    column = np.concatenate([np.arange(s.low, s.high) for s in spans])
    total = coo_matrix((np.ones(len(row)), (row, column)), shape=(len(spans), every)).tocsr()
    miss = coo_matrix((np.ones(len(spans)), (np.arange(len(spans)),) * 2)).tocsr()
    least = np.array([s.least for s in spans], dtype=float)
    result = milp(
        np.concatenate([np.zeros(every), weight]),
        integrality=np.concatenate([np.ones(every), np.zeros(len(spans))]),
        bounds=Bounds(0, np.inf),
        constraints=[
            LinearConstraint(_beside(total, miss), lb=wanted),
            LinearConstraint(_beside(total, -miss), ub=wanted),
            LinearConstraint(_beside(total, 0 * miss), lb=least),
        ],
        options={"time_limit": 5.0},
    )
    if result.x is None:
        return None
    steps = np.rint(result.x[:every]).astype(np.int64)
    places: IntArray = np.concatenate([[0], np.cumsum(steps)]).astype(np.int64)
    return places


def _beside(left: coo_matrix, right: coo_matrix) -> coo_matrix:
    """Put two sparse matrices side by side."""
    return hstack([left, right]).tocsr()


def _wall_spans(
    rings: Sequence[WallRing], across: Lines, parity: int, module: float
) -> list[_Span]:
    """Return the lengths of the walls that join two lines."""
    found = []
    for ring, line in zip(rings, across.of):
        for i in np.flatnonzero(ring.direction % 2 != parity).tolist():
            before, after = i - 1, (i + 1) % len(line)
            low, high = sorted((int(line[before]), int(line[after])))
            end = ring.direction[before] != ring.direction[after]
            long = across.at[high] - across.at[low] >= JOG * module
            found.append(_Span(low, high, int(end or long), 1.0))
    return found


def _facing(across: Lines, along: Lines, module: float) -> list[_Span]:
    """Return the distances between walls that see each other, across rooms or outside."""
    begin, end, line = [], [], []
    for own, other in zip(across.of, along.of):
        walls = np.flatnonzero(own >= 0)
        begin.append(other[walls - 1])
        end.append(other[(walls + 1) % len(own)])
        line.append(own[walls])
    low = np.minimum(np.concatenate(begin), np.concatenate(end))
    high = np.maximum(np.concatenate(begin), np.concatenate(end))
    lines = np.concatenate(line)
    seen: dict[tuple[int, int, bool], float] = {}
    for k, height in enumerate(np.diff(along.at).tolist()):
        if height < BAND * module:
            continue
        met = np.sort(lines[(low <= k) & (high > k)])
        for i, (a, b) in enumerate(zip(met[:-1].tolist(), met[1:].tolist())):
            key = (a, b, i % 2 == 0)
            seen[key] = seen.get(key, 0.0) + height / module
    return [
        _Span(a, b, 1, min(1.0, 0.2 + seen[a, b, inside] / 2) if inside else OUTSIDE)
        for a, b, inside in seen
    ]
