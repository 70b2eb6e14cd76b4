"""Regular meshes with known answers, for tests, examples and benchmarks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import InputError
from .quadmesh import QuadMesh


def grid(
    nx: int, ny: int, h: float = 1.0, keep: Callable[[int, int], bool] | None = None
) -> QuadMesh:
    """Make a grid of squares.

    Parameters
    ----------
    nx, ny
        Number of squares in x and y, at least 1.
    h
        Side of a square, metres.
    keep
        Told column i and row j of a square, says whether it is part of the mesh; None keeps
        all.

    Returns
    -------
    QuadMesh
        Vertices numbered row by row from the origin, faces likewise.

    Raises
    ------
    InputError
        If no square is left or the squares that are left touch only at a corner.

    Examples
    --------
    >>> mesh = grid(12, 12)
    >>> len(mesh.edges), int((~mesh.boundary_edges).sum())
    (312, 264)
    """
    if nx < 1 or ny < 1:
        raise InputError("A grid needs at least one square in each direction.")
    j, i = (a.ravel() for a in np.mgrid[0:ny, 0:nx])
    if keep is not None:
        kept = np.array([bool(keep(int(a), int(b))) for a, b in zip(i, j)])
        i, j = i[kept], j[kept]
        if not len(i):
            raise InputError("No square of the grid is kept.")
    corner = j * (nx + 1) + i
    faces = np.column_stack([corner, corner + 1, corner + nx + 2, corner + nx + 1])
    used, inverse = np.unique(faces, return_inverse=True)
    vertices = np.column_stack([used % (nx + 1), used // (nx + 1)]) * float(h)
    return QuadMesh(vertices, inverse.reshape(-1, 4), float(h))


def fan(count: int, k: int = 1, h: float = 1.0) -> QuadMesh:
    """Make `count` patches of k by k quads around one inner vertex of valence `count`.

    Parameters
    ----------
    count
        Number of patches, at least 3; 4 gives a square grid turned by 45 degrees.
    k
        Quads along the side of a patch, at least 1.
    h
        Length of the edges that leave the centre, metres.

    Returns
    -------
    QuadMesh
        Vertex 0 is the centre, at the origin; the mesh has ``count * k**2`` faces.

    Examples
    --------
    >>> int(fan(5, 2).valences[0])
    5
    """
    if count < 3 or k < 1:
        raise InputError("A fan needs at least three patches of at least one quad.")
    angle = 2 * np.pi * np.arange(count) / count
    spoke = np.column_stack([np.cos(angle), np.sin(angle)]) * h
    # vertex s, i, j: i steps along spoke s, j steps along the next; j = k + ... shared by s + 1
    index = np.zeros((count, k + 1, k + 1), dtype=np.int64)
    points = [np.zeros(2)]
    for s in range(count):
        for i in range(1, k + 1):
            for j in range(k + 1):
                index[s, i, j] = len(points)
                points.append(i * spoke[s] + j * spoke[(s + 1) % count])
    for s in range(count):
        index[s, 0, 1:] = index[(s + 1) % count, 1:, 0]
    patch = [index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]]
    faces = np.stack(patch, axis=-1).reshape(-1, 4)
    return QuadMesh(np.array(points), faces, float(h))
