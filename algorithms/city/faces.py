"""Lines noded into one plane graph, the faces between them, and cuts of what is too large."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Polygon

from .roads import CityRoads, Lines

#: Coordinates are rounded to this before lines are noded (metres).
GRID = 0.01
#: What lies this near to a line is on it (metres).
ON = 0.03
#: A face of which an opening keeps less than this share is street space.
KEPT = 0.35
#: Where a large piece of ground may be cut, as shares of its longer side.
CUTS = (0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65)


@dataclass(frozen=True, eq=False)
class RoadEdges:
    """Pieces of the dividing roads between the places where they meet.

    Attributes
    ----------
    lines
        Shape (n,). Courses, metres.
    names, kinds
        Shape (n,). Of the road that each is part of.
    closed
        Shape (n,). Whether nobody enters the ground beside it from there.
    """

    lines: Lines
    names: npt.NDArray[Any]
    kinds: npt.NDArray[Any]
    closed: npt.NDArray[np.bool_]

    def tree(self) -> shapely.STRtree:
        """Return an index of the lines."""
        return shapely.STRtree(self.lines)


def noded(roads: CityRoads, city: Sequence[Polygon]) -> RoadEdges:
    """Cut roads where they meet each other and the edge of the city, and keep what is inside.

    Parameters
    ----------
    roads
        The roads that divide.
    city
        Polygons of the city, metres.
    """
    ground = shapely.union_all(np.array(city, dtype=object))
    rings = [shapely.boundary(polygon) for polygon in city]
    plane = shapely.union_all(np.array([*roads.major, *rings], dtype=object), grid_size=GRID)
    pieces = shapely.get_parts(plane)
    pieces = pieces[shapely.length(pieces) > 0]
    tree = shapely.STRtree(roads.major)
    middles = shapely.line_interpolate_point(pieces, 0.5, normalized=True)
    # rounding moves a line by less than the grid
    piece, road = tree.query(middles, predicate="dwithin", distance=3 * GRID)
    inside = shapely.covers(shapely.buffer(ground, ON), pieces)
    first: dict[int, int] = {}
    for p, r in sorted(zip(piece.tolist(), road.tolist())):
        # where roads coincide the one that may be entered counts
        if p not in first or (roads.closed[first[p]] and not roads.closed[r]):
            first[p] = r
    kept = np.array([p for p in sorted(first) if inside[p]], dtype=np.intp)
    own = np.array([first[int(p)] for p in kept], dtype=np.intp)
    return RoadEdges(pieces[kept], roads.names[own], roads.kinds[own], roads.closed[own])


def faces_of(edges: RoadEdges, city: Sequence[Polygon]) -> list[Polygon]:
    """Return the faces into which roads cut the city, from north to south and west to east.

    Parameters
    ----------
    edges
        The roads, noded.
    city
        Polygons of the city, metres.
    """
    rings = [shapely.boundary(polygon) for polygon in city]
    plane = shapely.union_all(np.array([*edges.lines, *rings], dtype=object), grid_size=GRID)
    found = shapely.get_parts(shapely.polygonize(shapely.get_parts(plane)))
    ground = shapely.union_all(np.array(city, dtype=object))
    shapely.prepare(ground)
    inside = shapely.intersects(ground, shapely.point_on_surface(found))
    return in_order([shapely.geometry.polygon.orient(face) for face in found[inside]])


def in_order(polygons: Sequence[Polygon]) -> list[Polygon]:
    """Sort polygons from north to south, then west to east: no number depends on a layer's order.

    Examples
    --------
    >>> from shapely.geometry import box
    >>> [p.bounds[1] for p in in_order([box(0, 0, 1, 1), box(0, 2, 1, 3)])]
    [2.0, 0.0]
    """

    def key(polygon: Polygon) -> tuple[float, ...]:
        x0, y0, x1, y1 = (round(v, 1) for v in polygon.bounds)
        return (-y1, x0, -y0, x1, round(float(polygon.area), 1))

    return sorted(polygons, key=key)


def is_street_space(face: Polygon, thin: float) -> bool:
    """Tell whether ground between roads belongs to them: a median, a roundabout, ramps.

    Parameters
    ----------
    face
        The ground.
    thin
        A disc of this radius must fit into most of the ground that is not street space, metres.
    """
    opened = shapely.buffer(shapely.buffer(face, -thin), thin)
    return bool(shapely.area(opened) < KEPT * face.area)


def without_obstacles(face: Polygon, obstacles: shapely.Geometry) -> list[Polygon]:
    """Return the ground that large obstacles leave of a face, in parts.

    Parameters
    ----------
    face
        The ground.
    obstacles
        Water, parks, railways: what cuts the ground.
    """
    if obstacles.is_empty or not obstacles.intersects(face):
        return [face]
    left = shapely.difference(face, obstacles, grid_size=GRID)
    parts = [p for p in shapely.get_parts(left) if p.geom_type == "Polygon"]
    return in_order([shapely.geometry.polygon.orient(p) for p in parts if p.area > 1.0])


def cut(ground: Polygon, most: float, least: float) -> tuple[list[Polygon], list[LineString]]:
    """Cut ground that is too large, across its longer side, until no part is.

    Parameters
    ----------
    ground
        The ground, metres.
    most
        Greatest area of a part, square metres.
    least
        Least area of a part where one can be had, square metres.

    Returns
    -------
    tuple of list
        The parts, and the lines along which they were cut.
    """
    if ground.area <= most:
        return [ground], []
    best: tuple[float, list[Polygon], shapely.Geometry] | None = None
    for line in _across(ground):
        plane = shapely.union_all(np.array([ground.boundary, line], dtype=object), grid_size=GRID)
        whole = shapely.get_parts(shapely.polygonize(shapely.get_parts(plane)))
        shapely.prepare(ground)
        parts = [p for p in whole if ground.contains(p.representative_point())]
        if len(parts) < 2:
            continue
        areas = sorted(p.area for p in parts)
        # halves are best, scraps are worst
        score = areas[-1] / ground.area + (1.0 if areas[0] < least else 0.0)
        if best is None or score < best[0] - 1e-9:
            best = (score, parts, shapely.intersection(line, ground, grid_size=GRID))
    if best is None:
        return [ground], []
    found: list[Polygon] = []
    lines = [p for p in shapely.get_parts(best[2]) if p.geom_type == "LineString"]
    for part in in_order([shapely.geometry.polygon.orient(p) for p in best[1]]):
        smaller, more = cut(part, most, least)
        found += smaller
        lines += more
    return found, lines


def _across(ground: Polygon) -> list[LineString]:
    """Return lines across the longer side of ground, the one in its middle first."""
    frame = shapely.get_coordinates(shapely.minimum_rotated_rectangle(ground))[:4]
    sides = [(frame[0], frame[1], frame[3], frame[2]), (frame[1], frame[2], frame[0], frame[3])]
    a, b, c, d = max(sides, key=lambda s: float(np.hypot(*(s[1] - s[0]))))
    found = []
    for share in CUTS:
        line = np.array([a + share * (b - a), c + share * (d - c)])
        longer = 0.01 * (line[1] - line[0])
        found.append(LineString([line[0] - longer, line[1] + longer]))
    return found
