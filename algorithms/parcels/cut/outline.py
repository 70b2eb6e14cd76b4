"""The outline of a block as sides between corners, each open to a street or closed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from ..types import Block
from .line import Floats, Line, steps_of

#: The outline is simplified by this before its sides are read (metres).
DETAIL = 0.3
#: A turn by more makes a corner (degrees).
CORNER = 28.0
#: Sides that turn by more in all are split in the middle, ovals for one (degrees).
ARC = 110.0
#: Shorter sides are the rounding or cutting off of a corner (metres).
ROUNDING = 9.0
#: So is an arc to the left that turns by more (degrees) within that length (metres).
SHARP, WINDOW = 55.0, 26.0
#: Vertices of an arc that turn by less do not belong to it (degrees).
GENTLE = 4.0
#: How near the closed lines lie to the rings (metres).
NEAR = 0.02


@dataclass(frozen=True)
class Side:
    """A stretch of a ring between two corners.

    Attributes
    ----------
    xy
        Its vertices, shape (n, 2), metres; the block lies to the left.
    open
        Whether it runs along a street.
    before, after
        Indices of the sides that meet its two ends, roundings of corners left out.
    turn
        By how much the outline turns to the left at its end, degrees; negative where the block
        has a reflex corner.
    rounding
        Whether it only rounds or cuts off a corner.
    """

    xy: Floats
    open: bool
    before: int = -1
    after: int = -1
    turn: float = 0.0
    rounding: bool = False

    @cached_property
    def line(self) -> Line:
        """Its vertices with the distances along them."""
        return Line(self.xy)

    @property
    def length(self) -> float:
        """Length, metres."""
        return self.line.length


def direction(xy: Floats, end: int, reach: float = 8.0) -> Floats:
    """Return the direction of a line at its start (`end` 0) or end (-1), along the line.

    Parameters
    ----------
    xy
        Vertices, shape (n, 2), metres.
    end
        0 or -1.
    reach
        Over how much of its length the direction is taken, metres.
    """
    one = 1 if end == 0 else -1
    x, y = begin = xy[end].tolist()
    left = reach
    # asked for at every corner: two edges in plain numbers take less than arrays would
    for k in range(end + one, one * len(xy) + end, one):
        to_x, to_y = xy[k].tolist()
        long = math.hypot(to_x - x, to_y - y)
        if long > left:
            x, y = x + (to_x - x) * left / long, y + (to_y - y) * left / long
            break
        x, y, left = to_x, to_y, left - long
    way_x, way_y = one * (x - begin[0]), one * (y - begin[1])
    whole = max(math.hypot(way_x, way_y), 1e-9)
    return np.array([way_x / whole, way_y / whole])


def angle_between(first: Floats, second: Floats) -> float:
    """Return the turn to the left from one direction to another, degrees in (-180, 180]."""
    cross = first[0] * second[1] - first[1] * second[0]
    return float(np.degrees(np.arctan2(cross, first @ second)))


def sides(block: Block) -> list[Side]:
    """Read the sides of a block: outer ring first, then its holes.

    Parameters
    ----------
    block
        The block; the side of a hole is open where it is not in `block.closed`.
    """
    polygon = orient(block.polygon)
    found: list[Side] = []
    for ring in (polygon.exterior, *(x for x in polygon.interiors if x.length > ROUNDING)):
        found += _sides_of_ring(shapely.get_coordinates(ring)[:-1], block, len(found))
    return found


def _sides_of_ring(xy: Floats, block: Block, first: int) -> list[Side]:
    chains = [
        piece
        for line, is_open in _chains(xy, block)
        for piece in ((part, is_open) for part in _at_corners(line))
    ]
    if len(chains) > 1 and chains[0][1] == chains[-1][1]:
        # the ring was opened at any vertex: that is no corner yet
        start, end = chains[0][0], chains[-1][0]
        if abs(angle_between(direction(end, -1), direction(start, 0))) < CORNER:
            whole = np.vstack([end[:-1], start])
            chains = [*chains[1:-1], *((x, chains[0][1]) for x in _halves(whole))]
    if len(chains) == 1:
        line, is_open = chains[0]
        middle = _halving_vertex(line)
        chains = [(line[: middle + 1], is_open), (line[middle:], is_open)]
    return _joined(chains, first)


def _joined(chains: list[tuple[Floats, bool]], first: int) -> list[Side]:
    """Link the sides of one ring to their neighbours."""
    rounding = [_is_rounding(x) for x, _ in chains]
    if all(rounding):
        rounding = [False] * len(chains)
    long = [k for k, short in enumerate(rounding) if not short]
    found = []
    for k, (line, is_open) in enumerate(chains):
        after = next((j for j in long if j > k), long[0])
        before = next((j for j in reversed(long) if j < k), long[-1])
        turn = angle_between(direction(line, -1), direction(chains[after][0], 0))
        found.append(Side(line, is_open, first + before, first + after, turn, rounding[k]))
    return found


def _is_rounding(xy: Floats) -> bool:
    length = Line(xy).length
    return length < ROUNDING or (length <= WINDOW and float(_turns(xy).sum()) > SHARP / 2)


def _chains(xy: Floats, block: Block) -> list[tuple[Floats, bool]]:
    """Cut a ring where it changes between open and closed; simplify the pieces."""
    if block.closed.is_empty:
        return [(_simple(np.vstack([xy, xy[:1]])), True)]
    xy = _with_ends(xy, block)
    nxt = np.roll(xy, -1, axis=0)
    is_open = shapely.distance(shapely.points((xy + nxt) / 2), block.closed) > NEAR
    change = np.flatnonzero(is_open != np.roll(is_open, 1))
    if len(change) == 0:
        return [(_simple(np.vstack([xy, xy[:1]])), bool(is_open[0]))]
    found = []
    for a, z in zip(change, [*change[1:], change[0] + len(xy)]):
        found.append((_simple(xy[np.arange(a, z + 1) % len(xy)]), bool(is_open[a])))
    return found


def _with_ends(xy: Floats, block: Block) -> Floats:
    """Insert the ends of the closed lines into a ring."""
    ends = shapely.get_coordinates(shapely.boundary(shapely.line_merge(block.closed)))
    nxt = np.roll(xy, -1, axis=0)
    edge = nxt - xy
    square = np.maximum((edge**2).sum(axis=1), 1e-12)
    extra: list[tuple[int, float, Floats]] = []
    for end in ends:
        t = np.clip(((end - xy) * edge).sum(axis=1) / square, 0.0, 1.0)
        gap = np.hypot(*(xy + edge * t[:, None] - end).T)
        k = int(np.argmin(gap))
        length = float(np.sqrt(square[k]))
        if gap[k] < NEAR and NEAR < t[k] * length < length - NEAR:
            extra.append((k, float(t[k]), xy[k] + edge[k] * t[k]))
    if not extra:
        return xy
    extra.sort(key=lambda x: (x[0], x[1]))
    return np.asarray(np.insert(xy, [k + 1 for k, _, _ in extra], [p for _, _, p in extra], 0))


def _simple(xy: Floats) -> Floats:
    found = np.asarray(shapely.get_coordinates(shapely.simplify(shapely.linestrings(xy), DETAIL)))
    # a thin ring would collapse to a line there and back
    return xy if np.array_equal(xy[0], xy[-1]) and len(found) < 4 else found


def _turns(xy: Floats) -> Floats:
    """Turn to the left at each inner vertex, degrees."""
    step = xy[1:] - xy[:-1]
    back, on = step[:-1], step[1:]
    cross = back[:, 0] * on[:, 1] - back[:, 1] * on[:, 0]
    return np.asarray(np.degrees(np.arctan2(cross, (back * on).sum(axis=1))))


def _at_corners(xy: Floats) -> list[Floats]:
    """Cut a line at its corners, at sharp arcs, and where it turns too far in all."""
    cuts = [0, *(np.flatnonzero(np.abs(_turns(xy)) > CORNER) + 1).tolist(), len(xy) - 1]
    return [
        part
        for a, z in zip(cuts, cuts[1:])
        for piece in _at_arcs(xy[a : z + 1])
        for part in _halves(piece)
    ]


def _at_arcs(xy: Floats) -> list[Floats]:
    """Cut an arc that turns sharply to the left out of a line."""
    turns = _turns(xy)
    if len(xy) < 4 or float(np.clip(turns, 0, None).sum()) < SHARP:
        return [xy]
    place = steps_of(xy)
    total = np.append(0.0, np.cumsum(turns))  # turned up to and at each vertex but the last
    last = np.searchsorted(place, place + WINDOW, side="right") - 1
    last = np.minimum(last, len(xy) - 2)
    gain = total[last] - np.append(0.0, total)[: len(xy)]
    gain[-1] = 0.0
    i = int(np.argmax(gain))
    j = int(last[i])
    if gain[i] < SHARP:
        return [xy]
    # the arc begins and ends where it turns
    while j - i > 1 and (i == 0 or turns[i - 1] < GENTLE):
        i += 1
    while j - i > 1 and turns[j - 1] < GENTLE:
        j -= 1
    parts = [xy[i : j + 1]]
    if i > 0:
        parts = [*_at_arcs(xy[: i + 1]), *parts]
    return [*parts, *_at_arcs(xy[j:])] if j < len(xy) - 1 else parts


def _halves(xy: Floats) -> list[Floats]:
    if len(xy) < 4 or abs(_turns(xy).sum()) < ARC:
        return [xy]
    middle = _halving_vertex(xy)
    return [*_halves(xy[: middle + 1]), *_halves(xy[middle:])]


def _halving_vertex(xy: Floats) -> int:
    """Return the vertex, none of the ends, nearest to half of the length."""
    along = steps_of(xy)
    return int(np.argmin(np.abs(along[1:-1] - along[-1] / 2))) + 1


def usable(polygon: Polygon) -> bool:
    """Tell whether a polygon can be worked on at all."""
    return polygon.geom_type == "Polygon" and not polygon.is_empty and bool(polygon.is_valid)
