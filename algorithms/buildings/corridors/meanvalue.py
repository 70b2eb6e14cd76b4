"""Mean value coordinates: points inside a polygon follow when its boundary is bent."""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ..types import Floats

#: Points this near to an edge lie on it (share of the size of the polygon).
ON_EDGE = 1e-9


def mean_value_coordinates(points: Floats, ring: Floats) -> Floats:
    """Give the mean value coordinates of points in a polygon.

    Floater (2003), equation 2.1, for polygons of any shape with the signed angles of Hormann and
    Floater (2006), section 3. On an edge the coordinates are those of the line between its ends.
    They give linear functions exactly: ``coordinates @ ring`` are the points.

    Parameters
    ----------
    points
        Points inside the polygon or on its edge, shape (k, 2).
    ring
        Vertices of a simple polygon in either direction, the first not repeated, shape (n, 2).

    Returns
    -------
    numpy.ndarray
        Shape (k, n); rows sum to 1. M_p of RZ section 2.

    Raises
    ------
    InputError
        If the ring has fewer than three vertices.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> mean_value_coordinates(np.array([[1.0, 1.0]]), square)
    array([[0.25, 0.25, 0.25, 0.25]])
    """
    if len(ring) < 3:
        raise InputError(f"A ring of {len(ring)} vertices encloses nothing.", "Give three or more.")
    ring = np.asarray(ring, dtype=float)
    spoke = ring[None] - np.asarray(points, dtype=float).reshape(-1, 1, 2)
    following = np.roll(spoke, -1, axis=1)
    reach = np.hypot(spoke[..., 0], spoke[..., 1])
    reach_on = np.roll(reach, -1, axis=1)
    cross = spoke[..., 0] * following[..., 1] - spoke[..., 1] * following[..., 0]
    dot = np.sum(spoke * following, axis=2)
    # tan(a / 2) = sin a / (1 + cos a), which holds for signed angles short of 180 degrees
    below = reach * reach_on + dot
    scale = float(np.ptp(ring, axis=0).max()) ** 2
    on_edge = (np.abs(cross) <= ON_EDGE * scale) & (dot <= 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.where(on_edge, 0.0, cross / below)
        weight = (half + np.roll(half, 1, axis=1)) / reach
        weight = weight / weight.sum(axis=1, keepdims=True)
    for row in np.flatnonzero(on_edge.any(axis=1)):
        edge = int(np.argmax(on_edge[row]))
        length = reach[row, edge] + reach_on[row, edge]
        share = reach[row, edge] / length if length > 0 else 0.0
        weight[row] = 0.0
        weight[row, edge] += 1.0 - share
        weight[row, (edge + 1) % len(ring)] += share
    return np.asarray(weight)
