"""Which edges of a mesh cross ground that is not part of the site."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import Polygon

from .quadmesh import BoolArray, QuadMesh

FOREIGN_LENGTH = 5.0
"""Length outside the site, metres, up to which an edge is not called foreign."""


def foreign_edges(mesh: QuadMesh, site: Polygon, tolerance: float = FOREIGN_LENGTH) -> BoolArray:
    """Flag edges that run outside the site for more than a tolerance.

    Boundary edges are the site's own edge, chords of it included: they count as foreign only
    if they run across ground outside the true site by more than the tolerance measured at
    right angles to it, i.e. where cleaning closed a slot or cut a tip.

    Parameters
    ----------
    mesh
        The mesh, metres.
    site
        The true site with its holes, metres.
    tolerance
        Length in metres that may lie outside.

    Returns
    -------
    ndarray
        Shape (e,), bool.
    """
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    for i, arc in mesh.boundary_arcs.items():
        lines[i] = shapely.linestrings(arc)
    boundary = mesh.boundary_edges
    shapely.prepare(site)
    flags = np.zeros(len(lines), dtype=np.bool_)
    suspect = np.flatnonzero(~boundary & ~shapely.covers(site, lines))
    flags[suspect] = shapely.length(shapely.difference(lines[suspect], site)) > tolerance
    near = site.buffer(tolerance)
    shapely.prepare(near)
    suspect = np.flatnonzero(boundary & ~shapely.covers(near, lines))
    flags[suspect] = shapely.length(shapely.difference(lines[suspect], near)) > tolerance
    return flags
