"""Centre lines of streets inside templates."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ..templates.mesh import MERGE, Topology, ahead
from ..templates.types import Template
from .meanvalue import mean_value_coordinates

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def centre_ties(drawn: Template, mesh: Topology) -> tuple[tuple[tuple[Ints, Floats], ...], ...]:
    """Tie the points of the centre lines to the vertices of the faces around them.

    Parameters
    ----------
    drawn, mesh
        A template that repeats nothing any more, and its mesh.

    Returns
    -------
    tuple
        For each line, for each of its points: vertices and their weights, which sum to 1.
    """
    lines = [edge.line for edge in drawn.edges if edge.meaning == "centre"]
    if not lines:
        return ()
    start = np.concatenate(mesh.rings)
    end = np.concatenate([ahead(ring) for ring in mesh.rings])
    ends = np.stack([mesh.points[start], mesh.points[end]], axis=1).view(float).reshape(-1, 2, 2)
    edges = shapely.linestrings(ends)
    rings = [mesh.points[ring].view(float).reshape(-1, 2) for ring in mesh.rings]
    faces = np.array([shapely.Polygon(xy) for xy in rings], dtype=object)
    found = []
    for line in lines:
        crossing = shapely.intersection(edges, line)
        points = shapely.get_coordinates(crossing[shapely.get_type_id(crossing) == 0])
        every = np.concatenate([shapely.get_coordinates(line), points])
        at = shapely.line_locate_point(line, shapely.points(every))
        every = every[np.unique(np.round(at, 3), return_index=True)[1]]
        found.append(tuple(_tie(complex(*xy), mesh, start, end, faces) for xy in every))
    return tuple(found)


def _tie(where: complex, mesh: Topology, start: Ints, end: Ints, faces: Any) -> tuple[Ints, Floats]:
    """Write a point as a weighted mean of the vertices of an edge or a face."""
    a, b = mesh.points[start], mesh.points[end]
    local = (where - a) * (b - a).conj() / np.abs(b - a)
    near = np.abs(local.imag) < 2 * MERGE
    near &= (local.real > -2 * MERGE) & (local.real < np.abs(b - a) + 2 * MERGE)
    if near.any():
        k = int(np.flatnonzero(near)[0])
        u = float(np.clip(local.real[k] / abs(b[k] - a[k]), 0.0, 1.0))
        return np.array([start[k], end[k]]), np.array([1.0 - u, u])
    inside = np.flatnonzero(shapely.intersects_xy(faces, where.real, where.imag))
    if len(inside):
        ring = mesh.rings[int(inside[0])]
        return ring, mean_value_coordinates(mesh.points[ring], np.array([where]))[0]
    nearest = int(np.argmin(np.abs(mesh.points - where)))
    return np.array([nearest]), np.ones(1)
