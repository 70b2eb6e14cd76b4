"""Existing streets inside a mesh become mesh lines: kept inner roads, and roads in slots.

Parcels are often drawn without the streets that end among them: the site then has slots with
an existing street in each. A mesh runs across such slots. The mesh line nearest to such a
street is pulled onto it and counts as an existing street, so that new streets meet it instead
of running beside it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import networkx as nx
import numpy as np
import scipy.sparse as sparse
import shapely
from scipy.sparse.linalg import splu
from shapely.geometry import LineString

from ..mesh import QuadMesh
from ..network.problem import BoolArray, FloatArray
from ..site.types import Site

#: A street must lie this deep in the mesh to be adopted (mesh edge lengths).
DEPTH = 0.35
#: Mesh vertices are pulled at most this far onto a street (mesh edge lengths).
PULL = 0.5
#: Half the width of ground that belongs to an existing street (metres).
RIGHT_OF_WAY = 15.0
#: Quads may not become worse than this (least sine of a corner) by being pulled.
LEAST_SINE = 0.35


def adopt_streets(
    mesh: QuadMesh, site: Site, wished: Sequence[LineString] = ()
) -> tuple[QuadMesh, BoolArray]:
    """Pull mesh lines onto existing streets inside the mesh.

    Parameters
    ----------
    mesh
        The candidate mesh.
    site
        The site with its boundary streets and kept inner streets.
    wished
        Lines along which a new street must run: mesh lines are pulled onto them, too.

    Returns
    -------
    mesh : QuadMesh
        The mesh, some vertices moved.
    adopted : numpy.ndarray
        Shape (e,). Edges that now are existing streets.
    """
    adopted = np.zeros(len(mesh.edges), dtype=np.bool_)
    targets: dict[int, FloatArray] = {}
    existing = _inner_lines(mesh, [existing_lines(site)])
    for i, line in enumerate([*existing, *_inner_lines(mesh, wished)]):
        path = _path_along(mesh, line)
        if not path:
            continue
        places = {v: _foot(line, mesh.vertices[v]) for v in path}
        inner = {v: xy for v, xy in places.items() if not mesh.boundary_vertices[v]}
        trial = {**targets, **inner}
        moved = _moved(mesh, trial)
        if _least_sine(mesh, moved) < min(LEAST_SINE, _least_sine(mesh, mesh.vertices) - 0.02):
            continue
        targets = trial
        if i >= len(existing):
            continue
        for u, v in zip(path, path[1:]):
            adopted[mesh.edge_between(u, v)] = True
    if not targets:
        return mesh, adopted
    fixed = mesh.fixed.copy()
    fixed[list(targets)] = True
    return dataclasses.replace(mesh, vertices=_moved(mesh, targets), fixed=fixed), adopted


def existing_lines(site: Site) -> shapely.Geometry:
    """Centre lines of all existing streets of a site as one geometry."""
    lines = [street.line for street in (*site.boundary_streets, *site.inner_streets)]
    return shapely.union_all(np.array(lines, dtype=object))


def right_of_way(site: Site) -> shapely.Geometry:
    """Ground of the existing streets at the site: streets may cross it."""
    return shapely.buffer(existing_lines(site), RIGHT_OF_WAY)


def _inner_lines(mesh: QuadMesh, streets: Sequence[shapely.Geometry]) -> list[LineString]:
    """Parts of streets that run inside the mesh, longest first."""
    if not any(street.length for street in streets):
        return []
    outline = shapely.union_all(shapely.polygons(mesh.vertices[mesh.faces]), grid_size=0.001)
    deep = shapely.buffer(outline, -DEPTH * mesh.edge_length)
    inside = shapely.intersection(shapely.union_all(np.array(streets, dtype=object)), outline)
    merged = shapely.get_parts(shapely.line_merge(inside))
    lines = [
        part
        for part in merged
        if part.geom_type == "LineString"
        and shapely.length(shapely.intersection(part, deep)) > 0.5 * mesh.edge_length
    ]
    return sorted(lines, key=lambda line: (-line.length, line.bounds))


def _path_along(mesh: QuadMesh, line: LineString) -> list[int]:
    """Mesh vertices along a street, or nothing if no mesh line follows it."""
    h = mesh.edge_length
    middle = shapely.distance(shapely.points(mesh.vertices[mesh.edges].mean(axis=1)), line)
    ends = shapely.distance(shapely.points(mesh.vertices), line)
    off = np.maximum(ends[mesh.edges].max(axis=1), middle)
    near = (off < PULL * h) & ~mesh.boundary_edges
    graph: nx.Graph = nx.Graph()
    for e in np.flatnonzero(near).tolist():
        weight = float(mesh.lengths[e] * (1 + (off[e] / (0.2 * h)) ** 2))
        graph.add_edge(*mesh.edges[e].tolist(), weight=weight)
    if len(graph) < 2:
        return []
    among = np.array(sorted(graph.nodes))
    first, last = (
        int(among[np.hypot(*(mesh.vertices[among] - xy).T).argmin()])
        for xy in (line.coords[0][:2], line.coords[-1][:2])
    )
    if first == last or not nx.has_path(graph, first, last):
        return []
    path: list[int] = nx.shortest_path(graph, first, last, weight="weight")
    length = sum(mesh.lengths[mesh.edge_between(u, v)] for u, v in zip(path, path[1:]))
    return path if 0.6 * line.length < length < 1.6 * line.length else []


def _foot(line: LineString, xy: FloatArray) -> FloatArray:
    """Find the point of a line nearest to a position."""
    foot = line.interpolate(line.project(shapely.Point(xy)))
    return np.array([foot.x, foot.y])


def _moved(mesh: QuadMesh, targets: dict[int, FloatArray]) -> FloatArray:
    """Vertex positions when some are put in place and the rest follows smoothly.

    The displacement is harmonic over the mesh and zero on the boundary.
    """
    n = len(mesh.vertices)
    held = mesh.boundary_vertices.copy()
    shift = np.zeros((n, 2))
    for v, xy in targets.items():
        held[v] = True
        shift[v] = xy - mesh.vertices[v]
    free = np.flatnonzero(~held)
    if len(free):
        ends = np.vstack([mesh.edges, mesh.edges[:, ::-1]])
        graph = sparse.csr_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n))
        laplace = (sparse.diags(mesh.valences.astype(float)) - graph).tocsr()
        right = -laplace[free][:, np.flatnonzero(held)] @ shift[held]
        shift[free] = splu(laplace[free][:, free].tocsc()).solve(right)
    moved: FloatArray = mesh.vertices + shift
    return moved


def _least_sine(mesh: QuadMesh, vertices: FloatArray) -> float:
    """Least sine of all quad corners; negative where a quad is inverted."""
    corner = vertices[mesh.faces]
    ahead, back = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    size = np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2)
    return float((cross / np.maximum(size, 1e-12)).min())
