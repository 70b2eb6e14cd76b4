"""How far it is along corridors to the nearest way out."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from ...mesh.quadmesh import BoolArray, FloatArray, IntArray, QuadMesh


def vertex_distances(mesh: QuadMesh, active: BoolArray, sinks: BoolArray) -> FloatArray:
    """Return the distance of each vertex to the nearest sink along corridors.

    Parameters
    ----------
    mesh
        Mesh of n vertices and e edges, metres.
    active
        Shape (e,). Edges of corridors.
    sinks
        Shape (n,). Ways out.

    Returns
    -------
    FloatArray
        Shape (n,), metres; infinite off the corridors and where no sink is reached.
    """
    size = len(mesh.vertices)
    on = np.zeros(size, dtype=np.bool_)
    on[mesh.edges[active].ravel()] = True
    far = np.full(size, np.inf)
    starts = np.flatnonzero(on & sinks)
    if len(starts):
        u, v = mesh.edges[active].T
        graph = coo_matrix((mesh.lengths[active], (u, v)), shape=(size, size)).tocsr()
        far = np.asarray(dijkstra(graph, directed=False, indices=starts, min_only=True))
    return far


def edge_distances(mesh: QuadMesh, far: FloatArray) -> FloatArray:
    """Return the distance of the middle of each edge to the nearest sink, shape (e,), metres."""
    middle: FloatArray = far[mesh.edges].min(axis=1) + mesh.lengths / 2
    return middle


def point_distances(
    mesh: QuadMesh, far: FloatArray, points: FloatArray, edges: IntArray
) -> FloatArray:
    """Return the distance to the nearest sink of the places on edges that are nearest to points.

    The way from the point to the centre line does not count.

    Parameters
    ----------
    mesh
        Mesh, metres.
    far
        Shape (n,). From `vertex_distances`.
    points
        Shape (k, 2), metres.
    edges
        Shape (j,), j > 0. Edges of corridors that the points may lie at.

    Returns
    -------
    FloatArray
        Shape (k,), metres.
    """
    lines = np.array([shapely.linestrings(mesh.edge_line(int(e))) for e in edges])
    at = shapely.points(points)
    nearest = shapely.distance(at[:, None], lines[None, :]).argmin(axis=1)
    along = shapely.line_locate_point(lines[nearest], at)
    chosen = edges[nearest]
    u, v = mesh.edges[chosen].T
    walked: FloatArray = np.minimum(far[u] + along, far[v] + mesh.lengths[chosen] - along)
    return walked
