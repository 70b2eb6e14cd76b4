"""Sparse systems of the cross fields, on triangles with linear hat functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from .outline import Bools, Complexes, Floats
from .triangulation import Triangulation


def gradients(mesh: Triangulation) -> tuple[Floats, Floats]:
    """Gradients of the hat functions and areas of the triangles.

    Returns
    -------
    gradient
        Of the hat function of each corner, shape (t, 3, 2), 1/metre.
    area
        Shape (t,), square metres.
    """
    corner = mesh.points[mesh.triangles]
    opposite = np.roll(corner, -2, axis=1) - np.roll(corner, -1, axis=1)
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    twice = np.maximum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], 1e-12)
    normal = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1)
    return normal / twice[:, None, None], 0.5 * twice


def stiffness(
    mesh: Triangulation, along: Floats | None = None, drop: Floats | None = None
) -> tuple[Any, Floats]:
    """Matrix of the smoothness of functions on the triangles, and areas of the vertices.

    Parameters
    ----------
    mesh
        The triangles.
    along
        Unit vectors, shape (t, 2): changes in these directions may cost less.
    drop
        By which share they do, 0 to 1, shape (t,).

    Returns
    -------
    matrix
        Symmetric, sparse, n x n; for `along` None the Laplacian with cotangent weights.
    area
        A third of the triangles around each vertex, shape (n,), square metres.
    """
    gradient, area = gradients(mesh)
    form = np.einsum("tix,tjx->tij", gradient, gradient)
    if along is not None and drop is not None:
        slope = np.einsum("tix,tx->ti", gradient, along)
        form -= drop[:, None, None] * slope[:, :, None] * slope[:, None, :]
    form *= area[:, None, None]
    count = len(mesh.points)
    rows = np.repeat(mesh.triangles, 3, axis=1).ravel()
    columns = np.tile(mesh.triangles, (1, 3)).ravel()
    matrix = sparse.csr_matrix((form.ravel(), (rows, columns)), (count, count))
    mass = np.bincount(mesh.triangles.ravel(), np.repeat(area / 3, 3), minlength=count)
    return matrix, np.asarray(mass, np.float64)


class System:
    """A symmetric system with some unknowns given, factorised once for several right sides.

    Parameters
    ----------
    matrix
        Sparse, n x n.
    fixed
        Which unknowns are given, shape (n,).
    """

    def __init__(self, matrix: Any, fixed: Bools) -> None:
        self.free = np.flatnonzero(~fixed)
        self.rows = matrix[self.free]
        if not len(self.free):
            return
        system = self.rows[:, self.free]
        # a trace of the unit matrix keeps parts solvable that nothing ties
        trace = 1e-9 * max(float(system.diagonal().max()), 1e-12)
        system = (system + trace * sparse.identity(len(self.free))).tocsc()
        self.factor = splu(
            system,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def solve(self, right: Floats, given: Floats) -> Floats:
        """Return the unknowns for right sides and given values, all of shape (n, k)."""
        found = given.copy()
        if len(self.free):
            found[self.free] = 0.0
            target = right[self.free] - self.rows @ found
            found[self.free] = self.factor.solve(np.ascontiguousarray(target))
        return found


def smoothest(
    matrix: Any, fixed: Bools, value: Complexes, weight: Floats, wish: Complexes
) -> Complexes:
    """Find unit complex numbers that change as little and as evenly as possible.

    First they are left free in length, which makes the problem linear and finds the
    singularities; but then they turn most where they are short. So their angles are corrected
    once, which for given singularities is linear, too.

    Parameters
    ----------
    matrix
        Of smoothness, see `stiffness`.
    fixed, value
        Which vertices are given, and as what, shape (n,).
    weight, wish
        How strongly vertices are drawn to unit complex numbers, shape (n,).

    Returns
    -------
    z
        Of length 1, shape (n,).
    """
    system = System(matrix + sparse.diags(weight), fixed)
    right = weight * wish
    parts = system.solve(np.c_[right.real, right.imag], np.c_[value.real, value.imag])
    z = _unit(np.asarray(parts @ [1, 1j], np.complex128))
    links = matrix.tocoo()
    turn = np.angle(z[links.col] * z[links.row].conj())
    even = np.bincount(links.row, -links.data * turn, minlength=len(z))
    drawn = weight * np.angle(wish * z.conj())
    right_side = np.asarray(even + drawn, np.float64)[:, None]
    more = system.solve(right_side, np.zeros((len(z), 1)))[:, 0]
    return _unit(z * np.exp(1j * more))


def _unit(z: Complexes) -> Complexes:
    """Numbers of length 1 with the same angle; 1 for 0."""
    length = np.abs(z)
    return np.where(length > 1e-9, z / np.maximum(length, 1e-9), 1.0)
