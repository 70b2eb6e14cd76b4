"""Lines of public facilities: by the street, in the middle, or at the head of the axis."""

from __future__ import annotations

import numpy as np
import shapely

from ..types import CENTRIC, DOTTED, ENCLOSED, SYMMETRICAL, Floats
from .draft import Draft, pair
from .need import Need
from .sides import beside, middle_of, outward_azimuth, sides_of
from .symmetrical import AVENUE, axis_of

#: Places that are offered by the street: corners by importance.
PLACES = 3
#: A place is so many times as long as the longest facility.
ROOM = 1.25
#: A side is by the street if this much of it is within the setback and this distance, metres.
NEAR = 2.0
#: Types that are so much less deep than others have a line of their own, metres.
FLAT = 6.0
#: Shorter lines are none, metres.
SHORT = 0.1
#: Streets within this distance of a corner make it important, metres.
CORNER = 15.0


def facility_lines(need: Need) -> list[Draft]:
    """Draw the lines of facilities of a patch (RZ Table 3).

    Facilities need no sun. In the enclosed pattern they may stand all along the streets, in the
    centric one in the middle, in the symmetrical one beside the head of the axis, in the others at
    the ends of the sides by the street: corners of important streets first, so that they do not
    block whole rows of residences. They face the street.

    Parameters
    ----------
    need
        The patch and what is asked of it.

    Returns
    -------
    list of Draft
        The best place first.
    """
    pattern = need.patch.facilities
    drafts: list[Draft] = []
    if pattern == CENTRIC:
        drafts = _in_the_middle(need)
    sides = street_sides(need)
    if pattern == ENCLOSED:
        drafts = [line for k, side in enumerate(sides) for line in _by(need, side, k)]
    if pattern == SYMMETRICAL:
        drafts = _at_the_head(need, sides)
    return drafts or _at_corners(need, sides, PLACES + (pattern == DOTTED))


def street_sides(need: Need) -> list[Floats]:
    """Give the straight sides of the ground by the street, the most important street first."""
    access = need.patch.access
    found: list[tuple[int, int, Floats]] = []
    for part in need.parts:
        for side in sides_of(part.exterior):
            length = float(np.hypot(*(side[1] - side[0])))
            if length < need.shortest:
                continue
            line = shapely.LineString(side)
            reach = access.buffer(need.rules.setback_m + NEAR)
            if access.is_empty or line.intersection(reach).length > length / 2:
                worth = importance(need, shapely.get_coordinates(line.centroid)[0])
                found.append((-worth, len(found), side))
    return [side for *_, side in sorted(found, key=lambda item: item[:2])]


def importance(need: Need, xy: Floats) -> int:
    """Add up the streets around a point: 4 for the highest level to 1, and 1 at the edge."""
    point = shapely.Point(xy)
    return sum(
        max(1, 5 - corridor.level) + corridor.edge
        for corridor in need.zone.corridors
        if corridor.line.distance(point)
        <= corridor.width_m / 2 + need.rules.setback_m * 1.5 + CORNER
    )


def _by(need: Need, side: Floats, rank: int) -> list[Draft]:
    """Draw lines beside a street, façades to it: one for the deepest type, one for flat ones."""
    deep, flat = need.deepest, float(need.sizes[:, 1].min())
    found = beside(need, side, outward_azimuth(side), rank, deep / 2)
    if deep - flat > FLAT:
        found += beside(need, side, outward_azimuth(side), rank, flat / 2)
    return found


def _at_corners(need: Need, sides: list[Floats], places: int) -> list[Draft]:
    """Draw short lines at the ends of sides by the street, the most important corners first."""
    length = ROOM * need.longest
    spots = []
    for number, side in enumerate(sides):
        for line in _by(need, side, 0):
            ends = np.array([line.start, line.end])
            for k in (0, 1):
                spots.append((-importance(need, ends[k]), number, k, line))
    chosen: list[Draft] = []
    for _, _, k, line in sorted(spots, key=lambda spot: spot[:3]):
        piece = _end_piece(line, k, length, len(chosen))
        middle = shapely.LineString([piece.start, piece.end])
        if len(chosen) < places and all(
            middle.distance(shapely.LineString([other.start, other.end])) > need.longest
            for other in chosen
        ):
            chosen.append(piece)
    return chosen


def _end_piece(line: Draft, end: int, length: float, rank: int) -> Draft:
    """Cut a line to a length, from one of its ends."""
    piece = min(length, line.length)
    return (
        _cut(line, 0.0, piece, rank)
        if end == 0
        else _cut(line, line.length - piece, line.length, rank)
    )


def _in_the_middle(need: Need) -> list[Draft]:
    """Draw a line through the middle of the patch."""
    centre, _ = middle_of(need.parts[0])
    u, v = need.room.local(centre[None])[0]
    return _around(need, float(u), float(v))


def _around(need: Need, u: float, v: float) -> list[Draft]:
    """Draw a short line that faces like rows around a place, moved where it has no room."""
    free = need.room.standing(need.sizes)
    if free.is_empty:
        return []
    here = shapely.Point(need.room.world(np.array([[u, v]]))[0])
    place = shapely.get_coordinates(shapely.shortest_line(here, free))[-1]
    u, v = need.room.local(place[None])[0]
    ends = need.room.world(np.array([[u - need.longest / 8, v], [u + need.longest / 8, v]]))
    pieces = shapely.LineString(ends).intersection(free)
    return [
        Draft(pair(xy[0]), pair(xy[-1]), need.facing_deg)
        for piece in shapely.get_parts(pieces)
        if piece.length > SHORT
        for xy in [shapely.get_coordinates(piece)]
    ]


def _at_the_head(need: Need, sides: list[Floats]) -> list[Draft]:
    """Draw short lines by the street on both sides of the axis, which stays open."""
    axis = axis_of(need)
    clear = AVENUE / 2 + need.rules.path_m + need.longest / 2
    for side in sides:
        for line in _by(need, side, 0):
            uv = need.room.local(np.array([line.start, line.end]))
            at = uv[:, 0 if axis.across else 1]
            if abs(at[1] - at[0]) < 1e-6 or not at.min() < axis.at < at.max():
                continue
            slope = (at[1] - at[0]) / line.length
            t, off = (axis.at - at[0]) / slope, clear / abs(slope)
            more = (ROOM - 1) * need.longest
            pieces = [
                (t + off, min(line.length, t + off + more)),
                (max(0.0, t - off - more), t - off),
            ]
            found = [_cut(line, low, high) for low, high in pieces if high - low > SHORT]
            if found:
                return found
    return []


def _cut(line: Draft, low: float, high: float, rank: int = 0) -> Draft:
    """Cut a piece out of a line, between two distances from its start."""
    a, b = np.array(line.start), np.array(line.end)
    way = (b - a) / line.length
    return Draft(pair(a + way * low), pair(a + way * high), line.facing_deg, rank)
