"""Catmull-Clark topology: every quad becomes four, nothing that exists moves."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Polygon

from .foreign import foreign_edges
from .quadmesh import BoolArray, FloatArray, IntArray, QuadMesh


def subdivide(mesh: QuadMesh, site_polygon: Polygon | None = None) -> QuadMesh:
    """Split every quad of a mesh into four (CND section 5.1; topology of Catmull and Clark).

    Old vertices stay first, in place and in order; then follows one vertex for each edge, in
    the middle of its boundary arc or chord, then one for each face, at its centroid.

    Parameters
    ----------
    mesh
        The coarse mesh.
    site_polygon
        The site, metres. Where given, edges inside old faces are flagged foreign by their
        own course; where not, by the old edges between which they lie.

    Returns
    -------
    QuadMesh
        4 m faces, ``edge_length`` halved. ``parent_edges`` names the old edge of which an
        edge is one half, ``parent_vertices`` the old vertices; arcs, fixed, attracted and
        foreign flags are carried on.

    Examples
    --------
    >>> from platwright.mesh.grids import grid
    >>> fine = subdivide(grid(2, 1))
    >>> len(fine.faces), len(fine.vertices), fine.parent_edges.tolist().count(0)
    (8, 15, 2)
    """
    n, e = len(mesh.vertices), len(mesh.edges)
    middles = mesh.vertices[mesh.edges].mean(axis=1)
    halves = {i: split_in_half(arc) for i, arc in mesh.boundary_arcs.items()}
    for i, (first, _) in halves.items():
        middles[i] = first[-1]
    vertices = np.vstack([mesh.vertices, middles, mesh.vertices[mesh.faces].mean(axis=1)])
    centre = np.broadcast_to(np.arange(len(mesh.faces))[:, None] + n + e, mesh.faces.shape)
    after, before = mesh.face_edges + n, np.roll(mesh.face_edges, 1, axis=1) + n
    faces = np.stack([mesh.faces, after, centre, before], axis=-1).reshape(-1, 4)
    fine = QuadMesh(vertices, faces, mesh.edge_length / 2)
    parents = _parents(fine.edges, n, e)
    arcs: dict[int, FloatArray] = {}
    for i, parts in halves.items():
        for end, part in zip(mesh.edges[i].tolist(), (parts[0], parts[1][::-1])):
            # old vertices have the lower index, so arcs run from them to the new middle
            arcs[fine.edge_between(end, n + i)] = part
    return QuadMesh(
        vertices,
        faces,
        mesh.edge_length / 2,
        boundary_arcs=arcs,
        fixed=np.concatenate([mesh.fixed, np.zeros(len(vertices) - n, dtype=bool)]),
        foreign=_carried_foreign(mesh, fine, parents, site_polygon),
        parent_edges=parents,
        parent_vertices=np.where(np.arange(len(vertices)) < n, np.arange(len(vertices)), -1),
        attracted=mesh.attracted,
    )


def split_in_half(arc: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut a polyline (k, 2) at half its length; both parts contain the cut point.

    Examples
    --------
    >>> split_in_half(np.array([[0.0, 0], [1, 0], [1, 3]]))[1].tolist()
    [[1.0, 1.0], [1.0, 3.0]]
    """
    steps = np.hypot(*np.diff(arc, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    half = along[-1] / 2
    middle = np.array([[np.interp(half, along, arc[:, d]) for d in (0, 1)]])
    slack = 1e-9 * max(along[-1], 1e-300)
    first, second = arc[along < half - slack], arc[along > half + slack]
    return np.vstack([first, middle]), np.vstack([middle, second])


def _parents(edges: IntArray, n: int, e: int) -> IntArray:
    """Return the old edge of which every new edge is one half, -1 for the others."""
    is_half = (edges[:, 0] < n) & (edges[:, 1] < n + e)
    return np.where(is_half, edges[:, 1] - n, -1)


def _carried_foreign(
    mesh: QuadMesh, fine: QuadMesh, parents: IntArray, site: Polygon | None
) -> BoolArray:
    """Return the flags of the halves, then of the new edges inside the old faces."""
    inner = parents < 0
    flags = np.where(inner, False, mesh.foreign[np.maximum(parents, 0)])
    if site is not None:
        flags[inner] = foreign_edges(fine, site)[inner]
        return flags
    n, e = len(mesh.vertices), len(mesh.edges)
    ends = fine.edges[inner]
    face, middle = ends[:, 1] - n - e, ends[:, 0] - n
    side = np.argmax(mesh.face_edges[face] == middle[:, None], axis=1)
    # the new edge lies between the two sides next to the one it leaves from
    rows = np.arange(len(face))
    left = mesh.foreign[mesh.face_edges[face, (side + 1) % 4][rows]]
    right = mesh.foreign[mesh.face_edges[face, (side + 3) % 4][rows]]
    flags[inner] = left & right
    return flags
