"""Rings of numbered vertices: their edges, areas, and the faces that directed edges enclose."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt
import shapely

Floats = npt.NDArray[np.float64]
Edge = tuple[int, int]
Loop = list[int]
Face = list[Loop]
#: Places of vertices by number, metres.
Places = list[tuple[float, float]]


def trace(xy: Places, edges: Iterable[Edge]) -> list[Face]:
    """Return the faces on the left of directed edges; none if they are no mosaic."""
    onwards: dict[int, list[int]] = {}
    for start, end in edges:
        onwards.setdefault(start, []).append(end)
    left = {(start, end) for start, ends in onwards.items() for end in ends}
    loops: list[Loop] = []
    while left:
        first = edge = next(iter(left))
        loop: Loop = []
        while True:
            left.discard(edge)
            loop.append(edge[0])
            ends = onwards.get(edge[1], [])
            if not ends:
                return []
            edge = (edge[1], ends[0] if len(ends) == 1 else _sharpest(xy, edge, ends))
            if edge == first:
                break
            if edge not in left:
                return []
        loops.append(loop)
    return _nest(xy, loops)


def _sharpest(xy: Places, edge: Edge, ends: Sequence[int]) -> int:
    """Choose the edge that turns most to the left, which keeps the face on the left."""
    x, y = xy[edge[1]]
    back = math.atan2(xy[edge[0]][1] - y, xy[edge[0]][0] - x)

    def clockwise(end: int) -> float:
        if end == edge[0]:
            return 2 * math.pi
        angle = (back - math.atan2(xy[end][1] - y, xy[end][0] - x)) % (2 * math.pi)
        return angle or 2 * math.pi

    return min(ends, key=clockwise)


def _nest(xy: Places, loops: list[Loop]) -> list[Face]:
    """Give each clockwise loop to the counter-clockwise one around it."""
    areas = [loop_area(xy, loop) for loop in loops]
    if any(abs(area) < 1e-9 for area in areas):
        return []
    outer = [i for i, area in enumerate(areas) if area > 0]
    faces = {i: [loops[i]] for i in outer}
    holes = [i for i, area in enumerate(areas) if area < 0]
    if holes:
        places = [np.array([xy[v] for v in loop]) for loop in loops]
    for hole in holes:
        around = [i for i in outer if areas[i] > -areas[hole] and encloses(places[i], places[hole])]
        if not around:
            return []
        faces[min(around, key=lambda i: areas[i])].append(loops[hole])
    return list(faces.values())


def loop_area(xy: Places, loop: Loop) -> float:
    """Return the signed area of a ring of vertices, square metres."""
    # plain arithmetic: rings are short, and arrays cost more than they save
    ox, oy = xy[loop[0]]
    total = 0.0
    bx, by = xy[loop[-1]]
    bx, by = bx - ox, by - oy
    for vertex in loop:
        x, y = xy[vertex]
        x, y = x - ox, y - oy
        total += bx * y - x * by
        bx, by = x, y
    return 0.5 * total


def pairs(loop: Sequence[int]) -> list[Edge]:
    """Return the edges of a ring of vertices.

    Examples
    --------
    >>> pairs([3, 5, 4])
    [(3, 5), (5, 4), (4, 3)]
    """
    return list(zip(loop, [*loop[1:], *loop[:1]]))


def area_of(xy: Floats) -> float:
    """Return the signed area of a ring, shape (n, 2), not closed; positive counter-clockwise.

    Examples
    --------
    >>> area_of(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 3.0), (0.0, 3.0)]))
    6.0
    """
    # relative to a vertex, for the sake of digits far from the origin
    x, y = (xy - xy[0]).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def encloses(outer: Floats, inner: Floats) -> bool:
    """Tell whether a ring lies in another that it does not cross.

    Parameters
    ----------
    outer, inner
        Vertices, shapes (n, 2) and (m, 2), not closed. They may share vertices.
    """
    ring = shapely.polygons(shapely.linearrings(outer))
    shapely.prepare(ring)
    middles = (inner + np.roll(inner, -1, axis=0)) / 2
    return bool(shapely.contains_xy(ring, middles).mean() > 0.5)
