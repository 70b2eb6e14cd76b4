"""Points that should lie on a straight line, a circle or a smooth curve (UP 4.1, regression)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Points = npt.NDArray[np.complex128]
Ints = npt.NDArray[np.int64]


def straighten(z: Points, weights: Floats, starts: Ints) -> Points:
    """Project sets of points onto their best straight lines.

    Parameters
    ----------
    z
        The points of all sets, one set after the other, shape (n,).
    weights
        Their weights, shape (n,).
    starts
        Where each set begins, shape (m,).

    Returns
    -------
    ndarray
        The points moved, shape (n,). The line of a set is that of least weighted squares of the
        distances.
    """
    sizes = np.diff(np.append(starts, len(z)))
    total = np.add.reduceat(weights, starts)
    centre = np.repeat(np.add.reduceat(weights * z, starts) / total, sizes)
    local = z - centre
    # the square root of the sum of squares points along the line
    along = np.sqrt(np.add.reduceat(weights * local**2, starts))
    size = np.abs(along)
    along = np.repeat(np.where(size > 1e-9, along / np.maximum(size, 1e-9), 1.0), sizes)
    return np.asarray(centre + (local * along.conj()).real * along)


def circle(z: Points, weights: Floats, starts: Ints) -> Points:
    """Project sets of points onto their best circles.

    Parameters
    ----------
    z, weights, starts
        See `straighten`.

    Returns
    -------
    ndarray
        The points moved, shape (n,). The circle is that of least weighted squares of
        |z - centre|^2 - radius^2 (Kasa 1976); sets on a straight line stay as they are.
    """
    sizes = np.diff(np.append(starts, len(z)))
    total = np.add.reduceat(weights, starts)
    middle = np.add.reduceat(weights * z, starts) / total
    local = z - np.repeat(middle, sizes)
    square = np.add.reduceat(weights * np.abs(local) ** 2, starts)
    twist = np.add.reduceat(weights * local**2, starts)
    third = np.add.reduceat(weights * local * np.abs(local) ** 2, starts)
    det = square**2 - np.abs(twist) ** 2
    flat = det <= 1e-6 * square**2
    det = np.where(flat, 1.0, det)
    # centre * square + conj(centre) * twist = third
    centre = (third * square - third.conj() * twist) / det
    radius = np.repeat(np.sqrt(np.abs(centre) ** 2 + square / total), sizes)
    away = local - np.repeat(centre, sizes)
    size = np.maximum(np.abs(away), 1e-12)
    onto = np.repeat(middle + centre, sizes) + radius * away / size
    return np.where(np.repeat(flat, sizes), z, onto)


def smoother(along: Floats, reach: float) -> Floats:
    """Give the matrix of a moving least squares fit along a curve.

    Parameters
    ----------
    along
        Place of each point along the curve, ascending, shape (n,); metres.
    reach
        Width of the Gauss weights, metres.

    Returns
    -------
    ndarray
        Shape (n, n); times the points it gives the values at each of local quadratic fits (linear
        ones for three points), the weights falling with the distance along the curve. Quadratic
        curves with that parameter stay as they are.
    """
    degree = 2 if len(along) > 3 else 1
    matrix = np.zeros((len(along), len(along)))
    for row, at in enumerate(along):
        step = (along - at) / reach
        weight = np.exp(-(step**2) / 2.0)
        base = np.vander(step, degree + 1, increasing=True)
        matrix[row] = np.linalg.pinv(base * np.sqrt(weight)[:, None])[0] * np.sqrt(weight)
    return matrix
