"""What says how paths run in a patch: the lines of the tree that carry no buildings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from ..types import CIRCLE, ENDING, SYMMETRICAL, Floats
from .draft import Draft, pair
from .need import Need
from .sides import middle_of, sides_of
from .symmetrical import axis_of

#: A way ends on street space if it is this near to it, metres.
TOUCH = 1.0
#: Of the half depth of the patch, so far inside runs a loop inside.
INSIDE = 0.5
#: Corners of a loop are cut by so much, metres, and its pieces are at least so long.
CUT, LEAST = 3.0, 5.0


def spine_lines(need: Need, leaves: Sequence[Draft]) -> list[Draft]:
    """Draw the path structure of a patch (RZ Table 3, path pattern); the first is the root.

    - Direct connection: a spine from the street through the middle, along the axis of a
      symmetrical pattern. With direction 1 ("same") it begins on the side of the balconies where
      both its ends are by a street, with 0 at the back.
    - Circle connection: the sides of a loop and a way from it to the street; with direction 1
      ("inside") half way to the middle, with 0 along the edge of the patch.
    - Ending connection: a spine, and a branch along each main row: with direction 1 in front of
      the balconies, with 0 behind.

    Parameters
    ----------
    need
        The patch and what is asked of it.
    leaves
        Lines with buildings.

    Returns
    -------
    list of Draft
        One at least, inside the patch.
    """
    if need.patch.paths == CIRCLE:
        loop = _loop(need)
        if loop:
            return loop
    spine = _spine(need)
    return [spine, *(_branches(need, leaves) if need.patch.paths == ENDING else [])]


def _draft(need: Need, xy: Floats) -> Draft:
    """Make a draft of the ends of a line."""
    return Draft(pair(xy[0]), pair(xy[-1]), need.facing_deg)


def _spine(need: Need) -> Draft:
    """Draw the way from the street through the middle of the patch."""
    room, polygon = need.room, need.patch.polygon
    shape = shapely.get_coordinates(polygon.exterior)
    low, high = room.local(shape).min(axis=0) - 1.0, room.local(shape).max(axis=0) + 1.0
    middle = room.local(shapely.get_coordinates(need.parts[0].centroid))[0]
    symmetric = need.patch.residences == SYMMETRICAL
    axis = axis_of(need) if symmetric else None
    tried = []
    for across in (True, False):
        at = middle[0 if across else 1]
        if axis is not None and axis.across == across:
            at = axis.at
        ends = np.array([[at, low[1]], [at, high[1]]] if across else [[low[0], at], [high[0], at]])
        pieces = shapely.get_parts(LineString(room.world(ends)).intersection(polygon))
        pieces = [piece for piece in pieces if piece.length > 0]
        if not pieces:
            continue
        piece = max(pieces, key=lambda shape: shape.length)
        xy = shapely.get_coordinates(piece)[[0, -1]]
        touches = [need.patch.access.distance(shapely.Point(p)) < TOUCH for p in xy]
        second = touches[1] and (not touches[0] or need.patch.path_direction == 0)
        wished = axis is not None and axis.across == across
        xy = xy[::-1] if second else xy
        tried.append(((wished, any(touches), across), _draft(need, xy)))
    if not tried:
        point = shapely.get_coordinates(polygon.representative_point())[0]
        near = shapely.get_coordinates(polygon.exterior)[0]
        return _draft(need, np.array([near, point]))
    return max(tried, key=lambda item: item[0])[1]


def _loop(need: Need) -> list[Draft]:
    """Draw the sides of a loop, and the way from it to the street."""
    polygon, access = need.patch.polygon, need.patch.access
    _, radius = middle_of(polygon)
    inside = need.patch.path_direction != 0
    depth = INSIDE * radius if inside else min(need.rules.setback_m / 2, radius / 4)
    inner = shapely.get_parts(Polygon(polygon.exterior).buffer(-depth, join_style="mitre"))
    if not len(inner):
        return []
    ring = max(inner, key=lambda part: part.area).exterior
    sides = [_clipped(side, polygon) for side in sides_of(ring, CUT)]
    drafts = [_draft(need, side) for side in sides if side is not None]
    if access.is_empty:
        return drafts
    order = sorted(drafts, key=lambda line: LineString([line.start, line.end]).distance(access))
    for line in order:
        middle = LineString([line.start, line.end]).interpolate(0.5, normalized=True)
        way = shapely.shortest_line(access, middle)
        if way.length > 0 and way.within(polygon.buffer(TOUCH / 100)):
            return [*order, _draft(need, shapely.get_coordinates(way))]
    return order


def _branches(need: Need, leaves: Sequence[Draft]) -> list[Draft]:
    """Draw a way along each main row."""
    side = 1.0 if need.patch.path_direction == 0 else -1.0
    away = side * ((need.deepest + need.rules.path_m) / 2 + 1.0)
    found = []
    for leaf in leaves:
        if leaf.rank == 0:
            room = need.turned(leaf.facing_deg)
            uv = room.local(np.array([leaf.start, leaf.end]))
            way = _clipped(room.world(uv + np.array([0.0, away])), need.patch.polygon)
            if way is not None:
                found.append(_draft(need, way))
    return found


def _clipped(ends: Floats, polygon: Polygon) -> Floats | None:
    """Give the longest piece of a line inside a polygon, None for none."""
    pieces = shapely.get_parts(LineString(ends).intersection(polygon))
    pieces = [piece for piece in pieces if piece.length >= LEAST]
    if not pieces:
        return None
    xy: Floats = shapely.get_coordinates(max(pieces, key=lambda shape: shape.length))
    return xy[[0, -1]]
