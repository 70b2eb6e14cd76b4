"""A conforming Delaunay triangulation of a polygon: edges sampled, a hexagonal grid inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import Delaunay, QhullError
from shapely.geometry import Polygon

from .outline import Floats, Ints, NearestEdge, Outline, outline, pieces_of_edges

#: Inner points keep this share of the size off the boundary. More than half of it, so that the
#: circles over pieces of the boundary hold none of them, and the pieces are in the triangulation.
CLEAR = 0.55
#: How often the pieces of the boundary that are not in it are halved.
ROUNDS = 6
#: Shorter pieces than this share of the size are not halved: in a hairline slit that has no end.
SHORT = 1 / 16


@dataclass(frozen=True)
class Triangulation:
    """Triangles that fill a polygon.

    Attributes
    ----------
    outline
        The edges of the polygon.
    points
        Vertices, those on the boundary first, shape (n, 2), metres.
    triangles
        Their vertices, counter-clockwise, shape (t, 3).
    pieces
        The pieces of the boundary, along its rings, as pairs of vertices, shape (b, 2).
    edge
        Number of the edge of the polygon that each piece is of, shape (b,).
    size
        Length of an edge that was asked for, metres.
    conforming
        Whether every piece is an edge of triangles. Not so only where rings touch, or nearly.
    """

    outline: Outline
    points: Floats
    triangles: Ints
    pieces: Ints
    edge: Ints
    size: float
    conforming: bool

    @property
    def inner(self) -> Ints:
        """Numbers of the vertices that are not on the boundary."""
        return np.arange(self.pieces.max(initial=-1) + 1, len(self.points))


def triangulate(polygon: Polygon, size: float) -> Triangulation:
    """Fill a polygon with triangles.

    A boundary piece is in the Delaunay triangulation unless other points come too close; such
    pieces are halved until all are in it.

    Parameters
    ----------
    polygon
        Valid; holes and slits are respected. Metres.
    size
        Length of the edges inside and greatest length of those on the boundary, metres,
        greater than 0.

    Returns
    -------
    triangulation
        Without any triangle where the polygon is too thin for one.
    """
    edges = outline(polygon)
    owner, t = pieces_of_edges(edges.length, size)
    inner = _hexagons(polygon, edges, size)
    for step in range(ROUNDS):
        points, pieces = _boundary(edges, owner, t)
        points = np.concatenate([points, inner])
        triangles = _delaunay(points)
        missing = _missing(pieces, triangles, len(points))
        on = np.r_[t[1:], 1.0]
        on[np.r_[owner[1:] != owner[:-1], True]] = 1.0
        cut = missing & ((on - t) * edges.length[owner] > SHORT * size)
        if not cut.any() or step == ROUNDS - 1:
            break
        halves = 0.5 * (t + on)[cut]
        order = np.lexsort((np.r_[t, halves], np.r_[owner, owner[cut]]))
        t = np.r_[t, halves][order]
        owner = np.r_[owner, owner[cut]][order]
    shapely.prepare(polygon)
    if len(triangles):
        middle = points[triangles].mean(axis=1)
        corner = points[triangles]
        a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        triangles = np.where((twice < 0)[:, None], triangles[:, ::-1], triangles)
        longest = np.maximum((a * a).sum(-1), (b * b).sum(-1))
        solid = np.abs(twice) > 1e-6 * longest
        triangles = triangles[solid & shapely.contains_xy(polygon, middle[:, 0], middle[:, 1])]
    return Triangulation(edges, points, triangles, pieces, owner, size, not missing.any())


def _hexagons(polygon: Polygon, edges: Outline, size: float) -> Floats:
    """Points of a hexagonal grid inside, well off the boundary."""
    x0, y0, x1, y1 = polygon.bounds
    x, y = np.meshgrid(np.arange(x0, x1 + size, size), np.arange(y0, y1, size * np.sqrt(0.75)))
    x[1::2] -= 0.5 * size
    points = np.c_[x.ravel(), y.ravel()]
    shapely.prepare(polygon)
    points = points[shapely.contains_xy(polygon, points[:, 0], points[:, 1])]
    distance, _ = NearestEdge(edges, 0.5 * size).within(points, 2 * CLEAR * size)
    return np.asarray(points[distance > CLEAR * size])


def _boundary(edges: Outline, owner: Ints, t: Floats) -> tuple[Floats, Ints]:
    """Points on the boundary, equal ones once, and the pieces between them."""
    points = edges.start[owner] + t[:, None] * (edges.end - edges.start)[owner]
    on = np.arange(1, len(points) + 1)
    ring = edges.ring[owner]
    last = np.flatnonzero(np.r_[ring[1:] != ring[:-1], True])
    on[last] = np.r_[0, last[:-1] + 1]
    key = np.round(points * 1e6).astype(np.int64)
    _, first, same = np.unique(
        key[:, 0] * 4_000_037 + key[:, 1], return_index=True, return_inverse=True
    )
    if len(first) < len(points):
        # rings that touch in a point, or edges without length
        rank = np.argsort(np.argsort(first))
        number = rank[same.ravel()]
        return points[np.sort(first)], np.c_[number, number[on]]
    return points, np.c_[np.arange(len(points)), on]


def _delaunay(points: Floats) -> Ints:
    """Delaunay triangles of points; none where they are all on a line."""
    if len(points) < 3:
        return np.zeros((0, 3), np.int64)
    try:
        # Qhull loses digits far from the origin
        return np.asarray(Delaunay(points - points.mean(axis=0)).simplices, np.int64)
    except QhullError:
        return np.zeros((0, 3), np.int64)


def _missing(pieces: Ints, triangles: Ints, count: int) -> npt.NDArray[np.bool_]:
    """Which pieces are no edges of triangles."""
    a, b = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    there = np.unique(np.minimum(a, b) * count + np.maximum(a, b))
    low, high = pieces.min(axis=1), pieces.max(axis=1)
    key = low * count + high
    if not len(there):
        return np.ones(len(pieces), bool)
    at = np.minimum(np.searchsorted(there, key), len(there) - 1)
    return np.asarray((there[at] != key) & (low != high))
