"""A grid for a footprint whose walls are at right angles.

Every wall gets a whole coordinate (`steps`), so that the rings close on a lattice whose cells
are the squares. Lattice lines follow the walls and are spread in between as evenly as the walls
allow; where they all can be straight, they are.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from shapely.geometry import LineString, Polygon

from ...errors import InputError
from ...mesh.quadmesh import FloatArray, IntArray, QuadMesh
from .rings import WallRing, wall_rings
from .steps import Lines, wall_lines, whole_steps


def wall_grid(polygon: Polygon, module: float) -> QuadMesh | None:
    """Lay a grid whose lines follow the walls of a footprint.

    Parameters
    ----------
    polygon
        Valid footprint, metres.
    module
        Side that squares should have, metres.

    Returns
    -------
    QuadMesh or None
        Its boundary vertices lie on the footprint's rings, without the arcs between them. None
        where walls run askew or fit no grid.
    """
    rings = wall_rings(polygon, module)
    if rings is None:
        return None
    first, second = (wall_lines(rings, parity, module) for parity in (0, 1))
    rows = whole_steps(rings, first, second, 0, module)
    columns = whole_steps(rings, second, first, 1, module)
    if rows is None or columns is None:
        return None
    corners = [
        _lattice_corners(ring, columns[second.of[k]], rows[first.of[k]])
        for k, ring in enumerate(rings)
    ]
    cells = _cells(corners, int(columns[-1]), int(rows[-1]))
    if cells is None:
        return None
    size = int(rows[-1]) + 1
    used, faces = np.unique(_cell_corners(cells, size), return_inverse=True)
    faces = faces.reshape(-1, 4)
    x, y = _spread(second, columns), _spread(first, rows)
    known: dict[int, FloatArray] = {}
    for ring, lattice in zip(rings, corners):
        _place_walls(ring, lattice, x, y, size, known)
    if not set(known) <= set(used.tolist()):
        return None
    vertices = _relaxed(used, faces, known, x, y)
    try:
        mesh = QuadMesh(vertices, faces, module)
    except InputError:
        return None  # rings that touch at a corner: the cells there are no manifold
    return mesh if int(mesh.boundary_vertices.sum()) == len(known) else None


def _lattice_corners(ring: WallRing, column: IntArray, row: IntArray) -> IntArray:
    """Return the lattice point (r, 2) at which each wall begins."""
    before = np.roll(np.arange(len(ring.direction)), 1)
    along = ring.direction % 2 == 0
    return np.column_stack(
        [np.where(along, column[before], column), np.where(along, row, row[before])]
    )


def _cells(corners: list[IntArray], width: int, height: int) -> IntArray | None:
    """Return the cells (m, 2) inside lattice rings."""
    try:
        shape = Polygon(corners[0], corners[1:])
    except (ValueError, shapely.errors.GEOSException):
        return None
    if not shape.is_valid:
        return None
    i, j = (a.ravel() for a in np.mgrid[0:width, 0:height])
    inside = shapely.contains_xy(shape, i + 0.5, j + 0.5)
    return np.column_stack([i[inside], j[inside]]) if inside.any() else None


def _cell_corners(cells: IntArray, size: int) -> IntArray:
    """Return the numbers of the lattice points at the corners of cells, counter-clockwise."""
    low = cells[:, 0] * size + cells[:, 1]
    return np.column_stack([low, low + size, low + size + 1, low + 1])


def _spread(lines: Lines, step: IntArray) -> FloatArray:
    """Return a place for each coordinate of the lattice, evenly spread between the lines."""
    mean = np.bincount(step, lines.at) / np.maximum(np.bincount(step), 1)
    known = np.unique(step)
    return np.interp(np.arange(int(step[-1]) + 1), known, mean[known])


def _place_walls(
    ring: WallRing,
    lattice: IntArray,
    x: FloatArray,
    y: FloatArray,
    size: int,
    known: dict[int, FloatArray],
) -> None:
    """Put the lattice points of a ring on its walls; of two corners in one point the first."""
    line = LineString(ring.line)
    at = shapely.line_locate_point(line, shapely.points(ring.corners))
    for i in range(len(lattice)):
        here, there = lattice[i], lattice[(i + 1) % len(lattice)]
        known.setdefault(int(here[0] * size + here[1]), ring.corners[i])
        count = int(np.abs(there - here).max())
        if count < 2:
            continue
        step = (there - here) // count
        points = here + np.arange(1, count)[:, None] * step
        place = x if step[0] else y
        k = points[:, 0] if step[0] else points[:, 1]
        a, b = place[here[0 if step[0] else 1]], place[there[0 if step[0] else 1]]
        length = (at[(i + 1) % len(at)] - at[i]) % line.length
        arc = (at[i] + (place[k] - a) / (b - a) * length) % line.length
        for number, xy in zip(
            (points[:, 0] * size + points[:, 1]).tolist(),
            shapely.get_coordinates(shapely.line_interpolate_point(line, arc)),
        ):
            known.setdefault(number, xy)


def _relaxed(
    used: IntArray, faces: IntArray, known: dict[int, FloatArray], x: FloatArray, y: FloatArray
) -> FloatArray:
    """Spread the inner vertices: springs whose rest is the grid itself where walls allow it."""
    size = len(y)
    i, j = used // size, used % size
    pairs = np.unique(
        np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1),
        axis=0,
    )
    a, b = pairs.T
    length = np.abs(x[i[a]] - x[i[b]]) + np.abs(y[j[a]] - y[j[b]])
    force = 1.0 / np.maximum(length, 1e-6)
    count = len(used)
    springs = coo_matrix((force, (a, b)), shape=(count, count))
    springs = (springs + springs.T).tocsr()
    held = np.isin(used, list(known))
    vertices = np.zeros((count, 2))
    vertices[held] = np.array([known[n] for n in used[held].tolist()])
    free = np.flatnonzero(~held)
    if len(free):
        total = np.asarray(springs.sum(axis=1)).ravel()
        inner = coo_matrix((total[free], (np.arange(len(free)),) * 2)) - springs[free][:, free]
        pull = springs[free][:, np.flatnonzero(held)] @ vertices[held]
        vertices[free] = np.column_stack([spsolve(inner.tocsc(), pull[:, k]) for k in (0, 1)])
    return vertices
