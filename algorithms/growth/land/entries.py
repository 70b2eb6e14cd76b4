"""Where growth begins when no street arrives: on the streets along the ground, or in its middle."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass

import numpy as np
import shapely

from ...levels import COLLECTOR
from ..grammar import Grammar
from ..types import FloatArray
from .given import GivenNetwork
from .legs import Sight
from .starts import ENTRY, Place, leads_into_block

#: Entries from one long street are this many streets of the grammar apart.
APART = 4
#: Further entries keep this far from what lies beside them, in usual streets of the grammar.
BESIDE = 0.75
#: Spacing of the places along streets that are looked at: at least so many metres, and at most
#: so many for each length of open ground that an entry needs.
SAMPLE, ROOM_SAMPLES = 10.0, 8.0
#: Most entries from one street.
MOST = 50
#: Streets this near to the ground border it (metres).
NEAR = 0.5
#: Entries go in the same direction where they differ by less than this (degrees).
ALIKE = 20.0


def entries(
    net: GivenNetwork,
    part: shapely.Geometry | None,
    grammar: Grammar,
    sight: Sight,
    *,
    scale: float,
    room: float,
    shift: float = 0.0,
    again: int = 0,
) -> list[Place]:
    """Find places along streets from which growth enters ground that no street leads to.

    The first lies across from the middle of the ground, at the nearest street, square to it. A long
    straight street gets more, `APART` streets of the grammar from each other, so that a grid grown
    from them fits together. From the first the highest street of the grammar grows, from the others
    collectors.

    Parameters
    ----------
    net
        The streets.
    part
        A polygon of the domain, or None for everywhere.
    grammar
        The grammar.
    sight
        Measures open ground.
    scale
        Metres per unit of the grammar.
    room
        Open ground that an entry needs ahead, metres.
    shift
        How much nearer to the first the others are, as a share of their distance from each other.
    again
        How often nothing came of it before: the first is as many places further on.

    Returns
    -------
    list of Place
        Empty where no street borders the ground.
    """
    found = _along(net, part, sight, room)
    if found is None:
        return []
    toward = found.middle - found.xy
    size = np.hypot(toward[:, 0], toward[:, 1])
    facing = (toward * found.way).sum(axis=1) >= 0.7 * size
    order = np.lexsort((np.round(size, 3), ~facing))
    for _ in range(again):
        order = order[np.hypot(*(found.xy[order] - found.xy[order[0]]).T) > room]
        if not len(order):
            return []
    first = int(order[0])
    spot, way = found.xy[first], found.way[first]
    places = [_place(spot, way, -1)]
    alike = (found.way @ way) > math.cos(math.radians(ALIKE))
    apart = APART * scale * usual_length(grammar)
    across = np.array([-way[1], way[0]])
    for sign in (1.0, -1.0):
        for step in range(1, MOST // 2):
            wanted = spot + sign * (step - shift) * apart * across
            gap = np.where(alike, np.hypot(*(found.xy - wanted).T), np.inf)
            k = int(np.argmin(gap))
            if gap[k] > apart / 4:
                break
            slid = found.slid(k, wanted)
            inside = sight.domain is None or sight.domain.covers(shapely.Point(slid))
            place = _place(slid if inside else found.xy[k], found.way[k], COLLECTOR)
            if _beside(place, sight) > BESIDE * scale * usual_length(grammar):
                places.append(place)
    return places


@dataclass(frozen=True, eq=False)
class _Along:
    """Places along streets with open ground ahead: positions, ways, pieces; and the middle."""

    xy: FloatArray
    way: FloatArray
    ends: FloatArray
    middle: FloatArray

    def slid(self, k: int, wanted: FloatArray) -> FloatArray:
        """Move a place along its piece to where it is nearest to another one."""
        start, end = self.ends[k]
        along = end - start
        share = float((wanted - start) @ along) / float(along @ along)
        # a hair inside the piece, so that it stays where the domain was looked at
        least = min(0.5, 0.01 / float(np.hypot(*along)))
        return np.asarray(start + min(max(share, least), 1 - least) * along)


def middle_entry(part: shapely.Geometry, way: tuple[float, float] | None) -> Place:
    """Begin in the middle of ground without streets.

    Parameters
    ----------
    part
        A polygon of the domain.
    way
        Direction, or None for that of the ground's longest axis, in which a grid lies well.
    """
    x, y = _middle(part)
    return Place((float(x), float(y)), way or longest_axis(part), 0, ENTRY, on_street=False)


def longest_axis(area: shapely.Geometry) -> tuple[float, float]:
    """Give the direction of the longer side of the least rectangle around an area.

    Parameters
    ----------
    area
        Polygon or MultiPolygon.

    Returns
    -------
    tuple of float
        Unit vector, to the north rather than to the south.

    Examples
    --------
    >>> longest_axis(shapely.box(0, 0, 30, 10))
    (1.0, 0.0)
    """
    ring = shapely.get_coordinates(shapely.minimum_rotated_rectangle(area))
    sides = np.diff(ring[:3], axis=0) if len(ring) > 3 else np.diff(ring[:2], axis=0)
    size = np.hypot(sides[:, 0], sides[:, 1])
    k = int(np.argmax(np.round(size, 6)))
    if not len(size) or size[k] == 0:
        return 0.0, 1.0
    x, y = (sides[k] / size[k]).tolist()
    flip = -1.0 if y < -1e-12 or (abs(y) <= 1e-12 and x < 0) else 1.0
    return flip * x + 0.0, flip * y + 0.0


def usual_length(grammar: Grammar) -> float:
    """Median length of the streets of a grammar, in its unit.

    Parameters
    ----------
    grammar
        The grammar.
    """
    lengths = [
        sum(child.length) / 2
        for rules in grammar.rules.values()
        for rule in rules
        for child in rule.children
    ]
    return statistics.median(lengths) if lengths else 1.0


def _along(
    net: GivenNetwork, part: shapely.Geometry | None, sight: Sight, room: float
) -> _Along | None:
    """Give places along streets with open ground ahead, None where there is none."""
    pieces = np.arange(len(net.ends)) if part is None else sight.pieces_near(part, NEAR)
    if not len(pieces):
        return None
    ends = net.nodes[net.ends[pieces]]
    lines = np.asarray(shapely.linestrings(ends), dtype=object)
    if part is not None:
        middle = _middle(part)
    else:
        longest = int(np.argmax(np.round(shapely.length(lines), 3)))
        middle = ends[longest].mean(axis=0)
    apart = max(SAMPLE, room / ROOM_SAMPLES)
    count = np.maximum(1, np.ceil(shapely.length(lines) / apart)).astype(np.int64)
    own = np.repeat(np.arange(len(lines)), count)
    place = np.arange(len(own)) - np.repeat(np.cumsum(count) - count, count)
    share = (place + 0.5) / count[own]
    xy = ends[own, 0] + share[:, None] * (ends[own, 1] - ends[own, 0])
    nearest = int(shapely.distance(lines, shapely.Point(middle)).argmin())
    foot = shapely.line_interpolate_point(
        lines[nearest], shapely.line_locate_point(lines[nearest], shapely.Point(middle))
    )
    xy = np.vstack([xy, shapely.get_coordinates(foot)])
    own = np.r_[own, nearest]
    tangent = ends[own, 1] - ends[own, 0]
    tangent = tangent / np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    xy, way = np.vstack([xy, xy]), np.vstack([normal, -normal])
    open_ = sight.from_places(xy, way) >= room
    if part is None:
        land = open_ & ~leads_into_block(xy, way, net)
        open_ = land if land.any() else open_
    else:
        ahead = xy + way
        open_ &= shapely.contains_xy(part, ahead[:, 0], ahead[:, 1])
        # what is prepared comes first
        open_ &= shapely.dwithin(sight.domain, shapely.points(xy), 0.0)
    if not open_.any():
        return None
    ends = np.concatenate([ends[own], ends[own]])
    return _Along(xy[open_], way[open_], ends[open_], middle)


def _beside(place: Place, sight: Sight) -> float:
    """Measure how far it is from a place to what lies to the left and right of the way."""
    (x, y), (u, v) = place.xy, place.way
    ahead = np.array([(x + SAMPLE / 2 * u, y + SAMPLE / 2 * v)] * 2)
    return float(sight.from_places(ahead, np.array([(-v, u), (v, -u)])).min())


def _middle(part: shapely.Geometry) -> FloatArray:
    """Find the place furthest from the edges of a polygon, to a fiftieth of its size."""
    tolerance = max(0.1, math.sqrt(part.area) / 50)
    circle = shapely.maximum_inscribed_circle(part, tolerance=tolerance)
    return np.asarray(shapely.get_coordinates(circle)[0], dtype=float)


def _place(xy: FloatArray, way: FloatArray, level: int) -> Place:
    (x, y), (u, v) = xy.tolist(), way.tolist()
    return Place((x, y), (u, v), level, ENTRY)
