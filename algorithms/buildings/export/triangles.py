"""Polygons with holes cut into triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from ..types import Floats, Ints

#: Where the library has no constrained triangulation, sides are halved so many times at most.
ROUNDS = 12


def triangulate(polygon: Polygon) -> tuple[Floats, Ints]:
    """Cut a polygon into triangles.

    Parameters
    ----------
    polygon
        Valid, with any holes.

    Returns
    -------
    points : numpy.ndarray
        Shape (n, 2).
    triangles : numpy.ndarray
        Shape (m, 3), indices of points, counter-clockwise.
    """
    if hasattr(shapely, "constrained_delaunay_triangles"):
        found = shapely.constrained_delaunay_triangles(polygon)
    else:
        found = _conforming(polygon)
    pieces = shapely.get_parts(found)
    if not len(pieces):
        return np.zeros((0, 2)), np.zeros((0, 3), dtype=np.int64)
    corners = shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turn = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    corners[turn < 0] = corners[turn < 0][:, ::-1]
    points, index = np.unique(corners[np.abs(turn) > 0].reshape(-1, 2), axis=0, return_inverse=True)
    return points, index.reshape(-1, 3).astype(np.int64)


def _conforming(polygon: Polygon) -> shapely.Geometry:
    """Give Delaunay triangles inside a polygon whose sides are halved until all are edges.

    Shapely before 2.1 has no constrained triangulation.
    """
    rings = [shapely.get_coordinates(ring)[:-1] for ring in (polygon.exterior, *polygon.interiors)]
    for _ in range(ROUNDS):
        made = shapely.delaunay_triangles(shapely.multipoints(np.concatenate(rings)))
        edges = _edges(shapely.get_coordinates(shapely.get_parts(made)).reshape(-1, 4, 2))
        split = [_halved(ring, edges) for ring in rings]
        if sum(map(len, split)) == sum(map(len, rings)):
            break
        rings = split
    pieces = shapely.get_parts(made)
    inside = shapely.intersects(polygon, shapely.point_on_surface(pieces))
    return shapely.geometrycollections(pieces[inside])


def _edges(triangles: Floats) -> set[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Give the edges of triangles, both ways."""
    pairs = np.concatenate([triangles[:, [k, k + 1]] for k in range(3)])
    both = np.concatenate([pairs, pairs[:, ::-1]])
    return {(tuple(a), tuple(b)) for a, b in both.tolist()}


def _halved(
    ring: npt.NDArray[np.float64], edges: set[tuple[tuple[float, ...], tuple[float, ...]]]
) -> Floats:
    """Give a ring with a new point in the middle of each side that is no edge."""
    points: list[list[float]] = []
    for one, other in zip(ring, np.roll(ring, -1, axis=0)):
        points.append(one.tolist())
        if (tuple(one.tolist()), tuple(other.tolist())) not in edges:
            points.append(((one + other) / 2).tolist())
    return np.array(points)
