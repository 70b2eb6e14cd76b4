"""How good a quad mesh is: figures for people and one score for the choice of the best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from .quadmesh import FloatArray, IntArray, QuadMesh
from .relax import line_triples


@dataclass(frozen=True)
class MeshQuality:
    """Figures of a mesh.

    Attributes
    ----------
    quads, vertices, edges
        Counts.
    inner_valence_4
        Share of inner vertices with four edges (1 where there is no inner vertex).
    inverted
        Quads with a corner of 180 degrees or more.
    min_scaled_jacobian
        Least sine of an angle over all corners of all quads, negative where inverted.
    mean_edge_ratio
        Mean edge length over the asked one.
    within_15_percent
        Share of edges whose length is within 15 percent of the asked one.
    angle_deviation
        Mean deviation of the corners from 90 degrees, in degrees.
    bend
        Mean turn of the mesh lines at inner vertices of valence 4, in degrees.
    foreign
        Number of foreign edges.
    area_ratio
        Area of the mesh over the area of the site, or 1 where no site was given.
    """

    quads: int
    vertices: int
    edges: int
    inner_valence_4: float
    inverted: int
    min_scaled_jacobian: float
    mean_edge_ratio: float
    within_15_percent: float
    angle_deviation: float
    bend: float
    foreign: int
    area_ratio: float


def corner_angles(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the angles (m, 4) at the corners of quads, radians in (-pi, pi]."""
    p = vertices[faces]
    after, before = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    cross = after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]
    return np.asarray(np.arctan2(cross, (after * before).sum(axis=2)))


def scaled_jacobians(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the least sine of the four corner angles of each quad, shape (m,).

    Examples
    --------
    >>> square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    >>> scaled_jacobians(square, np.array([[0, 1, 2, 3], [3, 2, 1, 0]])).tolist()
    [1.0, -1.0]
    """
    return np.asarray(np.sin(corner_angles(vertices, faces)).min(axis=1))


def face_areas(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return signed areas of the quads by their chords, shape (m,), square metres."""
    p = vertices[faces]
    diagonal_a, diagonal_b = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    return np.asarray(
        (diagonal_a[:, 0] * diagonal_b[:, 1] - diagonal_a[:, 1] * diagonal_b[:, 0]) / 2
    )


def line_bends(vertices: FloatArray, triples: IntArray) -> FloatArray:
    """Return the turn (radians, absolute) of mesh lines at vertex triples, shape (k,)."""
    u = vertices[triples[:, 1]] - vertices[triples[:, 0]]
    v = vertices[triples[:, 2]] - vertices[triples[:, 1]]
    cross = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, (u * v).sum(axis=1))))


def quality(mesh: QuadMesh, site_polygon: Polygon | None = None) -> MeshQuality:
    """Measure a mesh.

    Parameters
    ----------
    mesh
        The mesh.
    site_polygon
        The site, for the area ratio.

    Examples
    --------
    >>> from platwright.mesh.grids import grid
    >>> figures = quality(grid(3, 3))
    >>> figures.inner_valence_4, figures.inverted, figures.min_scaled_jacobian
    (1.0, 0, 1.0)
    """
    inner = ~mesh.boundary_vertices
    jacobian = scaled_jacobians(mesh.vertices, mesh.faces)
    angle = np.abs(np.degrees(corner_angles(mesh.vertices, mesh.faces)) % 360 - 90)
    ratio = mesh.lengths / mesh.edge_length
    bends = line_bends(mesh.vertices, line_triples(mesh))
    area = float(face_areas(mesh.vertices, mesh.faces).sum())
    return MeshQuality(
        quads=len(mesh.faces),
        vertices=len(mesh.vertices),
        edges=len(mesh.edges),
        inner_valence_4=float((mesh.valences[inner] == 4).mean()) if inner.any() else 1.0,
        inverted=int((jacobian <= 0).sum()),
        min_scaled_jacobian=float(jacobian.min()),
        mean_edge_ratio=float(ratio.mean()),
        within_15_percent=float((np.abs(ratio - 1) <= 0.15).mean()),
        angle_deviation=float(angle.mean()),
        bend=float(np.degrees(bends).mean()) if len(bends) else 0.0,
        foreign=int(mesh.foreign.sum()),
        area_ratio=1.0 if site_polygon is None else area / float(site_polygon.area),
    )


def score(
    topology: QuadMesh, vertices: FloatArray, h: float, area: float, guide: float | None = None
) -> float:
    """Return one figure for a mesh, smaller is better; under 1 good, above 3 doubtful.

    Inversion weighs most, then edges far from the asked length, angles, worst corner,
    irregular vertices, bends of mesh lines and ground left out.

    Parameters
    ----------
    topology
        A mesh with the same faces.
    vertices
        Positions (n, 2), metres.
    h
        Asked edge length, metres.
    area
        Area to be covered, square metres.
    guide
        Direction (radians) that the mesh lines should follow, modulo a quarter turn.
    """
    faces, m = topology.faces, len(topology.faces)
    angles = corner_angles(vertices, faces)
    jacobian = np.sin(angles).min(axis=1)
    inverted, least = int((jacobian <= 0).sum()), float(jacobian.min())
    v = vertices[topology.edges[:, 1]] - vertices[topology.edges[:, 0]]
    size = np.log(np.maximum(np.hypot(*v.T), 1e-6) / h)
    inner = ~topology.boundary_vertices
    irregular = float((topology.valences[inner] != 4).mean()) if inner.any() else 0.0
    bends = line_bends(vertices, line_triples(topology))
    total = 2.0 * bool(inverted) + 30 * inverted / m
    total += 4.0 * float(np.sqrt((size**2).mean())) + 1.5 * abs(float(size.mean()))
    total += float(np.abs(np.degrees(angles) % 360 - 90).mean()) / 10
    total += float(np.degrees(bends).mean()) / 20 if len(bends) else 0.0
    total += 3 * max(0.0, 0.5 - least) + 10 * max(0.0, 0.45 - least) + 10 * irregular
    total += max(0.0, float(np.exp(size.max())) - 2) + 3 * max(0.0, 0.4 - float(np.exp(size.min())))
    covered = float(face_areas(vertices, faces).sum()) / area
    total += 5 * max(0.0, 0.98 - covered)
    if guide is not None:
        off = np.angle(np.exp(4j * (np.arctan2(v[:, 1], v[:, 0]) - guide))) / 4
        total += 2 * float(np.abs(off).mean()) / (np.pi / 8)
    return total
