"""Where along a control line a building has room on the bare ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..shape import corners
from ..types import BuildingType, Floats, Ints, Placements
from ..zone import ControlLine
from .columns import Bools
from .ways import Ways

#: Distance of the places that are looked at along a line, metres. Whatever stands in the way of a
#: building blocks at least its length, so that nothing is missed between two places.
SAMPLE = 1.0
#: Ways are reckoned at places this far apart, metres.
FEWER = 4.0
#: Halvings that find the ends of a stretch (to 2 mm).
HALVINGS = 9
#: Outlines are this much smaller when they are held against the ground, metres.
TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Stretches:
    """Stretches of control lines, for the centre of one building of one type each.

    Attributes
    ----------
    line, type
        Of each stretch, shape (s,).
    low, high
        First and last place of the centre, metres from the start of the line, shape (s,).
    at, way
        Places (metres from the start of the line) and what the way of one building there costs,
        in the unit of W; one pair of arrays per stretch.
    """

    line: Ints
    type: Ints
    low: Floats
    high: Floats
    at: tuple[Floats, ...]
    way: tuple[Floats, ...]


def stand(
    line: ControlLine, number: int, type_: int, at: Floats, facing: float | None = None
) -> Placements:
    """Put buildings of a type on places of a line, metres from its start, shape (n,)."""
    start = np.array(line.start)
    way = (np.array(line.end) - start) / max(line.length, 1e-9)
    n = len(at)
    return Placements(
        np.full(n, type_, dtype=np.int64), start + at[:, None] * way,
        np.full(n, line.facing_deg if facing is None else facing),
        np.full(n, line.patch, dtype=np.int64), np.full(n, number, dtype=np.int64),
    )  # fmt: skip


def stretches_of(
    types: Sequence[BuildingType],
    lines: Sequence[ControlLine],
    ground: Sequence[BaseGeometry],
    ways: Ways,
) -> Stretches:
    """Find where the centre of a building of each type may stand on each line.

    Parameters
    ----------
    types, lines
        What may stand where.
    ground
        What footprints may cover, per patch.
    ways
        Reckons ways.

    Returns
    -------
    Stretches
        By line, type and place.
    """
    found: list[tuple[int, int, float, float]] = []
    for patch, room in enumerate(ground):
        here = [n for n, line in enumerate(lines) if line.patch == patch and line.leaf]
        if here and not room.is_empty:
            shapely.prepare(room)
            found += _in_patch(types, lines, here, room)
    return _reckoned(lines, ways, sorted(found))


def _in_patch(
    types: Sequence[BuildingType], lines: Sequence[ControlLine], here: list[int], room: BaseGeometry
) -> list[tuple[int, int, float, float]]:
    """Find the stretches of the lines of a patch: line, type, first and last place."""
    pairs = [(n, k) for n in here for k, t in enumerate(types) if t.use == lines[n].use]
    at = [
        np.linspace(0.0, lines[n].length, max(1, int(np.ceil(lines[n].length / SAMPLE))) + 1)
        for n, _ in pairs
    ]
    of = np.repeat(np.arange(len(pairs)), [len(places) for places in at])
    place = np.concatenate(at) if at else np.zeros(0)
    stands = [stand(lines[n], n, k, places) for (n, k), places in zip(pairs, at)]
    free = _free(types, _joined(stands), room)
    # a stretch begins where a free place follows a blocked one or another line
    same = np.append(False, of[1:] == of[:-1])
    before, after = np.append(False, free[:-1]) & same, np.append(free[1:], False)
    after &= np.append(same[1:], False)
    first, last = np.flatnonzero(free & ~before), np.flatnonzero(free & ~after)
    low, high = place[first].copy(), place[last].copy()
    inner = np.flatnonzero(same[first])
    low[inner] = _edges(types, lines, pairs, of[first[inner]], room, place[first[inner] - 1],
                        low[inner])  # fmt: skip
    inner = np.flatnonzero(np.append(same[1:], False)[last])
    high[inner] = _edges(types, lines, pairs, of[last[inner]], room, place[last[inner] + 1],
                         high[inner])  # fmt: skip
    return [(*pairs[p], float(a), float(b)) for p, a, b in zip(of[first], low, high)]


def _free(types: Sequence[BuildingType], placed: Placements, room: BaseGeometry) -> Bools:
    """Tell which buildings stand on the ground, shape (n,)."""
    ring = corners(types, placed)
    ring += (placed.xy[:, None] - ring) * TOLERANCE / 10.0
    outlines = shapely.polygons(np.concatenate([ring, ring[:, :1]], axis=1))
    free: Bools = shapely.covers(room, outlines)
    return free


def _edges(
    types: Sequence[BuildingType],
    lines: Sequence[ControlLine],
    pairs: list[tuple[int, int]],
    of: Ints,
    room: BaseGeometry,
    blocked: Floats,
    free: Floats,
) -> Floats:
    """Find the last free places between blocked and free ones, shape (n,)."""
    if not len(of):
        return free
    for _ in range(HALVINGS):
        middle = (blocked + free) / 2
        tried = [
            stand(lines[pairs[p][0]], pairs[p][0], pairs[p][1], middle[i : i + 1])
            for i, p in enumerate(of)
        ]
        good = _free(types, _joined(tried), room)
        free, blocked = np.where(good, middle, free), np.where(good, blocked, middle)
    return free


def _joined(parts: list[Placements]) -> Placements:
    """Join many placements."""
    if not parts:
        return Placements.empty()
    names = ("type", "xy", "facing", "patch", "line")
    return Placements(*[np.concatenate([getattr(p, name) for p in parts]) for name in names])


def _reckoned(
    lines: Sequence[ControlLine], ways: Ways, found: list[tuple[int, int, float, float]]
) -> Stretches:
    """Add the ways of single buildings along the stretches."""
    at, parts = [], []
    for number, kind, low, high in found:
        at.append(np.linspace(low, high, max(2, int(np.ceil((high - low) / FEWER)) + 1)))
        parts.append(stand(lines[number], number, kind, at[-1]))
    placed = _joined(parts)
    ends = np.cumsum([len(places) for places in at])
    table = np.array(found, dtype=np.float64).reshape(-1, 4)
    return Stretches(
        table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2], table[:, 3],
        tuple(at), tuple(np.split(ways.reckon(placed), ends[:-1])) if at else (),
    )  # fmt: skip
