"""Candidate meshes whose cells are not square: as wide as a block, and a part of one long.

A block is some cells long. Where the asked length is no whole number of widths, squares make
blocks that are too long or, one cell less, far too short. Then the mesh is made on ground that
is stretched along one axis of the site, and carried back.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import shapely
from shapely.geometry import Polygon

from ..mesh import QuadMesh, quadrangulate
from ..network.problem import FloatArray
from ..progress import Progress

#: Cells are left square where they would be longer or shorter than wide by less than this share.
SQUARE = 0.06
#: A block is one cell longer where this share of a width is all that it lacks: shorter cells
#: are worse than longer ones, since rows are never quite even.
MORE = 0.3
#: No cell is shorter or longer than these shares of its width.
SHORTEST, LONGEST = 0.85, 1.33


def cell_ratio(width: float, length: float) -> float:
    """Tell how long a cell should be as a share of its width, so that blocks are whole cells.

    Parameters
    ----------
    width, length
        Wished block width, and the longest block, metres.

    Examples
    --------
    >>> cell_ratio(72.0, 150.0), cell_ratio(60.0, 150.0), cell_ratio(60.0, 108.0)
    (1.0, 1.25, 0.9)
    """
    count = max(1, math.floor(length / width + MORE))
    ratio = length / count / width
    if abs(ratio - 1) <= SQUARE or not SHORTEST <= ratio <= LONGEST:
        return 1.0
    return ratio


def stretched_mesh(
    polygon: Polygon,
    edge_length: float,
    ratio: float,
    across: bool,
    attract: FloatArray,
    progress: Progress | None = None,
) -> QuadMesh:
    """Fill a site with cells that are longer or shorter than wide.

    Parameters
    ----------
    polygon
        The site, metres.
    edge_length
        Width of the cells, metres.
    ratio
        Their length as a share of their width.
    across
        Whether they are long across the site's longer axis instead of along it.
    attract, progress
        See `quadrangulate`.

    Raises
    ------
    MeshError
        If the site is too small or too narrow for the cells.
    """
    axis = _main_axis(polygon)
    if across:
        axis = np.array([-axis[1], axis[0]])
    # stretch by 1 / ratio along the axis: I + (1 / ratio - 1) a a^T
    there = np.eye(2) + (1 / ratio - 1) * np.outer(axis, axis)
    back = np.eye(2) + (ratio - 1) * np.outer(axis, axis)
    origin = np.array(polygon.centroid.coords[0])

    def carried(xy: FloatArray, matrix: FloatArray) -> FloatArray:
        return np.asarray((xy - origin) @ matrix + origin)

    ground = shapely.transform(polygon, lambda xy: carried(xy, there))
    mesh = quadrangulate(
        ground, edge_length, attract_points=carried(attract, there), progress=progress
    )
    arcs = {edge: carried(arc, back) for edge, arc in mesh.boundary_arcs.items()}
    return dataclasses.replace(mesh, vertices=carried(mesh.vertices, back), boundary_arcs=arcs)


def _main_axis(polygon: Polygon) -> FloatArray:
    """Give the unit vector along the longer side of the smallest rectangle around a site."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(polygon))
    sides = np.diff(corners[:3], axis=0)
    longer = sides[int(np.hypot(*sides.T).argmax())]
    return np.asarray(longer / np.hypot(*longer))
