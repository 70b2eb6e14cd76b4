"""Registration of faces in closed form (UP section 4.1, equation 1), all faces at once.

Every map is written as z -> a l + b conj(l) + c with complex a, b and c, where l are the
coordinates of the face as drawn, centred and turned so that its width runs along the real axis:
b = 0 is a similarity; a = r (x + y) / 2 and b = r (x - y) / 2 turn by r and scale by x and y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Points = npt.NDArray[np.complex128]
Ints = npt.NDArray[np.int64]

RIGID, SIMILARITY, RECTANGLE, AFFINE = range(4)
KINDS = {"rigid": RIGID, "similarity": SIMILARITY, "rectangle": RECTANGLE, "affine": AFFINE}
#: Places looked at, and how often closer, where a rectangle is on the bound of its area.
LOOKS, ROUNDS = 33, 5


@dataclass(frozen=True)
class Allowed:
    """What maps faces may be registered by, arrays of shape (f,).

    Attributes
    ----------
    kind
        RIGID, SIMILARITY, RECTANGLE or AFFINE.
    low_x, high_x, low_y, high_y
        Bounds of the scale along width and depth; the first two for similarities and for both
        principal distortions of affine maps.
    low_area, high_area
        Bounds of the factor of the area, of rectangles, similarities and affine maps.
    square, twist
        Sums of |l|^2 and of l^2 over the vertices, weighted.
    """

    kind: Ints
    low_x: Floats
    high_x: Floats
    low_y: Floats
    high_y: Floats
    low_area: Floats
    high_area: Floats
    square: Floats
    twist: Points


def register(p: Points, s: Points, allowed: Allowed) -> tuple[Points, Points]:
    """Find the best allowed map of each face.

    Parameters
    ----------
    p, s
        Sums of w q conj(l) and of w q l over the vertices of each face, where q are their present
        places and w their weights; shape (f,). The centre c is the weighted mean of q.
    allowed
        What maps are allowed.

    Returns
    -------
    a, b
        The maps, shape (f,). Rigid maps, similarities (bounded or not) and unbounded affine maps
        are the least squares solution; rectangles are a similarity and then the least squares
        scales of its axes within their bounds (UP's quadratic program in two unknowns, which is
        separable here); bounded affine maps have the principal distortions of the unbounded one
        clipped.
    """
    size = np.abs(p)
    turn = np.where(size > 1e-12, p / np.maximum(size, 1e-12), 1.0)
    kind = allowed.kind
    low, high = allowed.low_x, allowed.high_x
    scale = np.clip(size / allowed.square, low, high)
    scale = np.where(kind == RIGID, 1.0, scale)
    area = np.sqrt(allowed.low_area), np.sqrt(allowed.high_area)
    scale = np.where(kind == SIMILARITY, np.clip(scale, *area), scale)
    a = scale * turn
    b = np.zeros_like(a)
    which = np.flatnonzero(kind == RECTANGLE)
    if len(which):
        a[which], b[which] = _rectangles(p[which], s[which], turn[which], allowed, which)
    which = np.flatnonzero(kind == AFFINE)
    if len(which):
        a[which], b[which] = _affine(p[which], s[which], allowed, which)
    return a, b


def _rectangles(
    p: Points, s: Points, turn: Points, allowed: Allowed, which: Ints
) -> tuple[Points, Points]:
    """Scale along both axes, the rotation being that of the similarity."""
    back = turn.conj()
    straight, crossed = (back * p).real, (back * s).real
    square, twist = allowed.square[which], allowed.twist[which].real
    weight_x, weight_y = (square + twist) / 2.0, (square - twist) / 2.0
    x = (straight + crossed) / 2.0 / weight_x
    y = (straight - crossed) / 2.0 / weight_y
    bounds = (
        allowed.low_x[which],
        allowed.high_x[which],
        allowed.low_y[which],
        allowed.high_y[which],
    )
    x, y = bounded_scales(
        x, y, weight_x, weight_y, bounds, allowed.low_area[which], allowed.high_area[which]
    )
    a: Points = turn * ((x + y) / 2.0)
    b: Points = turn * ((x - y) / 2.0)
    return a, b


def bounded_scales(
    x: Floats,
    y: Floats,
    weight_x: Floats,
    weight_y: Floats,
    bounds: tuple[Floats, Floats, Floats, Floats],
    low_area: Floats,
    high_area: Floats,
) -> tuple[Floats, Floats]:
    """Minimise weight_x (u - x)^2 + weight_y (v - y)^2 within bounds of u, of v and of u v.

    Parameters
    ----------
    x, y
        Scales without bounds, shape (f,).
    weight_x, weight_y
        Their weights, greater than 0.
    bounds
        Least and largest u, least and largest v, greater than 0.
    low_area, high_area
        Bounds of u v; where they contradict the others, the others win.

    Returns
    -------
    u, v
        The scales, shape (f,).
    """
    low_x, high_x, low_y, high_y = bounds
    u, v = np.clip(x, low_x, high_x), np.clip(y, low_y, high_y)
    area = u * v
    off = np.flatnonzero((area < low_area) | (area > high_area))
    if not len(off):
        return u, v
    goal = np.where(area < low_area, low_area, high_area)[off]
    # On the hyperbola u v = goal; bounds of v become bounds of u.
    first = np.maximum(low_x[off], goal / high_y[off])
    last = np.minimum(high_x[off], goal / low_y[off])
    open_ = first <= last
    wx, wy, tx, ty = weight_x[off], weight_y[off], x[off], y[off]
    # There may be two minima along the hyperbola: look at all of it, then closer and closer.
    low, high = np.log(first), np.log(np.maximum(last, first))
    steps = np.linspace(0.0, 1.0, LOOKS)
    rows = np.arange(len(off))
    for _ in range(ROUNDS):
        at = low[:, None] + (high - low)[:, None] * steps
        cost = wx[:, None] * (np.exp(at) - tx[:, None]) ** 2
        cost += wy[:, None] * (goal[:, None] * np.exp(-at) - ty[:, None]) ** 2
        best = np.argmin(cost, axis=1)
        low = at[rows, np.maximum(best - 1, 0)]
        high = at[rows, np.minimum(best + 1, LOOKS - 1)]
    found = np.exp(at[rows, best])
    # the bounds win where the hyperbola does not cross them
    near_x = np.where(area[off] < low_area[off], high_x[off], low_x[off])
    near_y = np.where(area[off] < low_area[off], high_y[off], low_y[off])
    u, v = u.copy(), v.copy()
    u[off] = np.where(open_, found, near_x)
    v[off] = np.where(open_, goal / found, near_y)
    return u, v


def _affine(p: Points, s: Points, allowed: Allowed, which: Ints) -> tuple[Points, Points]:
    """Fit a linear map and clip its principal distortions."""
    square, twist = allowed.square[which], allowed.twist[which]
    det = np.maximum(square**2 - np.abs(twist) ** 2, 1e-12 * square**2)
    a = (p * square - s * twist.conj()) / det
    b = (s * square - p * twist) / det
    size_a, size_b = np.abs(a), np.abs(b)
    low, high = allowed.low_x[which], allowed.high_x[which]
    large = np.clip(size_a + size_b, low, high)
    small = np.clip(size_a - size_b, low, high)
    area = large * small
    fix = np.sqrt(np.clip(area, allowed.low_area[which], allowed.high_area[which]) / area)
    large, small = large * fix, small * fix
    unit_a = np.where(size_a > 1e-12, a / np.maximum(size_a, 1e-12), 1.0)
    unit_b = np.where(size_b > 1e-12, b / np.maximum(size_b, 1e-12), 0.0)
    return unit_a * (large + small) / 2.0, unit_b * (large - small) / 2.0
