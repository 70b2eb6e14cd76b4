"""Faces of a drawing as one mesh: shared vertices, the outline, its corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

Ints = npt.NDArray[np.int64]
Points = npt.NDArray[np.complex128]

#: Vertices drawn nearer than this to each other are one (metres).
MERGE = 0.01
#: Vertices of the outline where it turns by more are corners (degrees).
CORNER = 30.0


@dataclass(frozen=True)
class Topology:
    """Faces that share their vertices.

    Attributes
    ----------
    points
        Vertices, shape (v,), x + iy in metres.
    rings
        Vertices of each face, counter-clockwise; those of neighbours on its edges are among them.
    outline
        Vertices of the boundary of all faces, counter-clockwise.
    owner, place
        Face of the edge from `outline[i]` to the next, and place of the first in its ring.
    """

    points: Points
    rings: tuple[Ints, ...]
    outline: Ints
    owner: Ints
    place: Ints


class TopologyError(ValueError):
    """Faces do not form one region without holes.

    Attributes
    ----------
    face
        Index of a face that is to blame.
    where
        Where that is seen, metres.
    """

    def __init__(self, text: str, face: int, where: complex) -> None:
        super().__init__(text)
        self.face = face
        self.where = where


def coordinates(polygon: Polygon) -> Points:
    """Give the outline of a polygon counter-clockwise as complex numbers, the last not repeated.

    Parameters
    ----------
    polygon
        The polygon.
    """
    xy = shapely.get_coordinates(polygon.exterior)[:-1]
    z: Points = xy[:, 0] + 1j * xy[:, 1]
    return z[::-1].copy() if signed_area(z) < 0 else z


def signed_area(z: Points) -> float:
    """Give the area of a closed outline, positive where it runs counter-clockwise.

    Parameters
    ----------
    z
        Its vertices, shape (n,).
    """
    return float((z.conj() * ahead(z)).imag.sum() / 2.0)


def topology(polygons: Sequence[Polygon]) -> Topology:
    """Join faces to a mesh.

    Parameters
    ----------
    polygons
        The faces, metres.

    Raises
    ------
    TopologyError
        If the faces overlap, leave gaps, or fall apart.
    """
    loops = [coordinates(polygon) for polygon in polygons]
    every = np.concatenate(loops)
    xy = np.stack([every.real, every.imag], axis=1)
    pairs = cKDTree(xy).query_pairs(MERGE, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (len(every),) * 2)
    count, label = connected_components(links, directed=False)
    first = np.full(count, -1)
    first[label[::-1]] = np.arange(len(every))[::-1]
    points = every[first]
    bounds = np.cumsum([0, *map(len, loops)])
    rings = []
    for face, (a, b) in enumerate(zip(bounds[:-1], bounds[1:])):
        ring = label[a:b]
        ring = ring[ring != np.roll(ring, 1)]
        if len(ring) < 3:
            raise TopologyError("is smaller than a centimetre", face, points[label[a]])
        rings.append(with_vertices(ring, points))
    outline, owner, place = boundary(rings, points)
    inside = sum(signed_area(points[ring]) for ring in rings)
    around = signed_area(points[outline])
    if abs(inside - around) > 1e-6 * around + MERGE:
        raise TopologyError("overlaps another face or leaves a gap", 0, points[outline[0]])
    return Topology(points, tuple(rings), outline, owner, place)


def with_vertices(ring: Ints, points: Points) -> Ints:
    """Insert the vertices that lie on the edges of a ring.

    Parameters
    ----------
    ring
        Vertices of a face, shape (n,).
    points
        All vertices, shape (v,).
    """
    a, b = points[ring], points[ahead(ring)]
    length = np.abs(b - a)[:, None]
    local = (points - a[:, None]) * ((b - a).conj() / np.abs(b - a))[:, None]
    on = np.abs(local.imag) < MERGE
    on &= (local.real > MERGE) & (local.real < length - MERGE)
    edge, vertex = np.nonzero(on)
    if not len(edge):
        return ring
    order = np.lexsort((local.real[edge, vertex], edge))
    return np.insert(ring, edge[order] + 1, vertex[order])


def ahead(a: Any) -> Any:
    """Give the next of each in a closed sequence.

    Parameters
    ----------
    a
        The sequence, shape (n,).
    """
    return np.concatenate([a[1:], a[:1]])


def boundary(rings: Sequence[Ints], points: Points) -> tuple[Ints, Ints, Ints]:
    """Find the edges that belong to one face, as one ring.

    Parameters
    ----------
    rings
        Vertices of the faces, counter-clockwise.
    points
        All vertices.

    Returns
    -------
    outline, owner, place
        See `Topology`.

    Raises
    ------
    TopologyError
        If an edge belongs twice to faces on one side, or the edges are no single ring.
    """
    edges: dict[tuple[int, int], tuple[int, int]] = {}
    for face, ring in enumerate(rings):
        for place, (a, b) in enumerate(zip(ring.tolist(), ahead(ring).tolist())):
            if (a, b) in edges:
                raise TopologyError("overlaps another face", face, points[a])
            edges[a, b] = (face, place)
    following: dict[int, tuple[int, int, int]] = {}
    for (a, b), (face, place) in edges.items():
        if (b, a) in edges:
            continue
        if a in following:
            raise TopologyError("touches another face in a point only", face, points[a])
        following[a] = (b, face, place)
    start = min(following, key=lambda v: (points[v].imag, points[v].real))
    outline, owner, places = [], [], []
    at = start
    while True:
        on, face, place = following.pop(at)
        outline.append(at)
        owner.append(face)
        places.append(place)
        at = on
        if at == start:
            break
        if at not in following:
            raise TopologyError("overlaps another face or leaves a gap", face, points[at])
    if following:
        vertex, (_, face, _) = next(iter(following.items()))
        text = "does not touch the others along an edge, or there is a gap beside it"
        raise TopologyError(text, face, points[vertex])
    return np.asarray(outline), np.asarray(owner), np.asarray(places)


def turns(z: Points) -> npt.NDArray[np.float64]:
    """Give the angle by which a closed outline turns at each vertex, degrees, shape (n,).

    Parameters
    ----------
    z
        Its vertices, shape (n,).
    """
    to: Any = ahead(z) - z
    before = np.concatenate([to[-1:], to[:-1]])
    return np.asarray(np.degrees(np.angle(to * before.conj())))


def corner_signs(
    z: Points, marks: Sequence[tuple[complex, str]] = (), threshold: float = CORNER
) -> Ints:
    """Classify the vertices of an outline: 1 convex, -1 concave, 0 regular; shape (n,).

    Parameters
    ----------
    z
        The vertices, counter-clockwise, shape (n,).
    marks
        Places of vertices and what they are to be, whatever their angle.
    threshold
        Turn above which a vertex is a corner, degrees.

    Examples
    --------
    >>> corner_signs(np.array([0, 10, 10 + 10j, 10j]), [(10, "regular")]).tolist()
    [1, 0, 1, 1]
    """
    turn = turns(z)
    signs = np.where(np.abs(turn) > threshold, np.sign(turn), 0).astype(np.int64)
    for where, kind in marks:
        at = int(np.argmin(np.abs(z - where)))
        if abs(z[at] - where) <= 2 * MERGE:
            signs[at] = {"convex": 1, "concave": -1}.get(kind, 0)
    return signs
