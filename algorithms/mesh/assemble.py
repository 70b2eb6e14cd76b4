"""Join the meshes of all parts of a site to one `QuadMesh`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from .clean import polygons_of
from .foreign import foreign_edges
from .quadmesh import BoolArray, FloatArray, IntArray, QuadMesh
from .variants import PartMesh


def assemble(
    parts: Sequence[PartMesh],
    site: Polygon | MultiPolygon,
    h: float,
    *,
    holes_filled: bool = False,
) -> QuadMesh:
    """Give the vertices of all parts one numbering, add boundary arcs and foreign flags.

    Parameters
    ----------
    parts
        Meshes of the parts.
    site
        The true site, metres.
    h
        Edge length, metres.
    holes_filled
        Whether the meshes run across the holes of the site: quads that lie mostly in a hole go.
    """
    vertices = np.vstack([p.vertices for p in parts])
    first = np.concatenate([[0], np.cumsum([len(p.vertices) for p in parts])])
    faces = np.vstack([p.draft.faces + k for p, k in zip(parts, first)])
    fixed = np.concatenate([p.draft.station >= 0 for p in parts])
    lines: dict[tuple[int, int], FloatArray] = {}
    attracted: dict[int, int] = {}
    for part, k in zip(parts, first.tolist()):
        lines.update({(u + k, v + k): arc for (u, v), arc in _boundary_lines(part).items()})
        attracted.update({v + k: p for v, p in part.attracted.items()})
    if holes_filled:
        keep = _outside_holes(vertices, faces, site)
        used = np.unique(faces[keep])
        number = np.full(len(vertices), -1, dtype=np.int64)
        number[used] = np.arange(len(used))
        vertices, fixed, faces = vertices[used], fixed[used], number[faces[keep]]
        lines = {
            (int(number[u]), int(number[v])): arc
            for (u, v), arc in lines.items()
            if number[u] >= 0 and number[v] >= 0
        }
        attracted = {int(number[v]): p for v, p in attracted.items() if number[v] >= 0}
    return finish(vertices, faces, h, site, lines=lines, fixed=fixed, attracted=attracted)


def finish(
    vertices: FloatArray,
    faces: IntArray,
    h: float,
    site: Polygon | MultiPolygon,
    *,
    lines: dict[tuple[int, int], FloatArray],
    fixed: BoolArray,
    attracted: dict[int, int],
) -> QuadMesh:
    """Make the `QuadMesh`: arcs by vertex pair become arcs by edge, foreign edges are found."""
    bare = QuadMesh(vertices, faces, h)
    arcs = {}
    for (u, v), line in lines.items():
        edge = bare.edge_between(u, v)
        if edge >= 0 and bare.boundary_edges[edge]:
            arcs[edge] = line if u < v else line[::-1]
    shaped = QuadMesh(vertices, faces, h, boundary_arcs=arcs, fixed=fixed, attracted=attracted)
    return QuadMesh(
        vertices,
        faces,
        h,
        boundary_arcs=arcs,
        fixed=fixed,
        foreign=foreign_edges(shaped, site),
        attracted=attracted,
    )


def _boundary_lines(part: PartMesh) -> dict[tuple[int, int], FloatArray]:
    """Return the true course of boundary edges, from the first to the second vertex."""
    lines = {}
    for ring, loop in zip(part.rings, part.draft.loops):
        for u, v in zip(loop.tolist(), np.roll(loop, -1).tolist()):
            length = float(np.mod(part.arc[v] - part.arc[u], ring.length))
            if not 1e-6 < length < 0.6 * ring.length:
                continue
            line = ring.part(float(part.arc[u]), float(part.arc[u]) + length)
            line[0], line[-1] = part.vertices[u], part.vertices[v]
            if len(line) > 2:
                lines[u, v] = line
    return lines


def _outside_holes(
    vertices: FloatArray, faces: IntArray, site: Polygon | MultiPolygon
) -> BoolArray:
    """Return the quads that lie at most half in holes and still form a manifold."""
    holes = shapely.union_all([Polygon(i) for p in polygons_of(site) for i in p.interiors])
    quads = shapely.polygons(vertices[faces])
    covered = shapely.area(shapely.intersection(quads, holes)) / shapely.area(quads)
    keep: BoolArray = covered < 0.5
    while True:
        pinched = _pinched_vertices(faces[keep])
        touching = keep & np.isin(faces, pinched).any(axis=1)
        if not touching.any():
            return keep
        # where parts touch only at a vertex, the quad that lies most in the hole goes
        worst = np.flatnonzero(touching)[np.argmax(covered[touching])]
        keep[worst] = False


def _pinched_vertices(faces: IntArray) -> IntArray:
    """Return vertices at which the quads do not form one fan."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = int(faces.max()) + 1
    edge = np.minimum(start, end) * count + np.maximum(start, end)
    keys, uses = np.unique(edge, return_counts=True)
    single = keys[uses == 1]
    ends = np.bincount(np.concatenate([single // count, single % count]), minlength=count)
    return np.flatnonzero(ends > 2)
