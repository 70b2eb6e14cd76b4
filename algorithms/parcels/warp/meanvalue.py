"""Mean value coordinates (Hormann and Floater 2006), the initial map of UP section 4.1."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Points = npt.NDArray[np.complex128]


def mean_value_coordinates(polygon: Points, points: Points) -> Floats:
    """Write points as weighted means of the vertices of a polygon.

    Parameters
    ----------
    polygon
        Its vertices, counter-clockwise, shape (n,).
    points
        Points inside, not on the outline, shape (m,).

    Returns
    -------
    ndarray
        Weights, shape (m, n), each row sums to 1; times the vertices they give the points.

    Examples
    --------
    >>> square = np.array([0, 2, 2 + 2j, 2j])
    >>> mean_value_coordinates(square, np.array([1 + 1j])).round(3).tolist()
    [[0.25, 0.25, 0.25, 0.25]]
    """
    to = polygon[None, :] - points[:, None]
    half = np.tan(np.angle(np.roll(to, -1, axis=1) * to.conj()) / 2.0)
    weight = (np.roll(half, 1, axis=1) + half) / np.abs(to)
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))
