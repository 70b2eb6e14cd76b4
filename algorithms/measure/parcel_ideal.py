"""How far parcels are from the ideal one: by area, and by shape (UP section 7).

The paper defines both measures in words only; what is computed here stands in the docstrings.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ..progress import Progress
from ..site.watch import ask

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

#: Points on each outline.
POINTS = 64
#: So many outlines are laid over the ideal one at a time, to bound the memory.
BATCH = 20_000


def ideal_area_ratio(polygons: npt.NDArray[Any], width: float, depth: float) -> Floats:
    """Area against that of the ideal parcel, the larger / the smaller, shape (n,).

    UP section 7: p_ideal, "the average area distortion w.r.t. the ideal parcel shapes"; like
    p_area it is 1 where there is none, and 2 for half the area as well as for double.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), metres.
    width, depth
        Sides of the ideal parcel, metres, greater than 0.

    Returns
    -------
    ndarray
        At least 1; infinite for polygons without area.

    Examples
    --------
    >>> ideal_area_ratio(np.array([shapely.box(0, 0, 9, 30)]), 18, 30).tolist()
    [2.0]
    """
    area = shapely.area(polygons)
    share = area / (width * depth)
    with np.errstate(divide="ignore"):
        return np.asarray(np.maximum(share, 1.0 / share))


def ideal_distance(
    polygons: npt.NDArray[Any],
    width: float,
    depth: float,
    tolerance: float = 0.0,
    progress: Progress | None = None,
) -> Floats:
    """Mean distance of each outline from the ideal parcel laid over it, shape (n,), metres.

    UP section 7: p_similarity, "the average similarity distortion ... computed as the average
    registration distance to the ideal parcel". Outline and ideal rectangle are sampled at 64
    points, evenly along their length, and the rectangle is registered to the outline by the
    similarity (position, turn and scale) with the least sum of squares. For given
    correspondences this has a closed form (UP 4.1): with both sets of points z and w as complex
    numbers about their means the similarity is the factor sum(conj(w) z) / sum(|w|^2). Which
    point of the rectangle belongs to the first one of the outline is found by trying all, as
    one correlation; between two, a parabola tells. The distance is the mean of |z - factor w|.

    Since the scale is free, it tells shape alone; `ideal_area_ratio` tells the size.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), metres; holes are not looked at.
    width, depth
        Sides of the ideal parcel, metres, greater than 0.
    tolerance
        Outlines are simplified by this first, metres.
    progress
        Asked for cancellation, or None.

    Returns
    -------
    ndarray
        At least 0; NaN for empty polygons.

    Raises
    ------
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> turned = shapely.box(0, 0, 30, 18), shapely.Point(0, 0).buffer(20)
    >>> ideal_distance(np.array(turned), 18, 30).round(1).tolist()
    [0.0, 4.1]
    """
    found = np.full(len(polygons), np.nan)
    for begin in range(0, len(polygons), BATCH):
        ask(progress)
        part = polygons[begin : begin + BATCH]
        good = np.flatnonzero(~shapely.is_empty(part) & ~shapely.is_missing(part))
        if len(good):
            simple = shapely.simplify(part[good], tolerance) if tolerance else part[good]
            found[begin + good] = _distances(outline_points(simple, POINTS), width, depth)
    return found


def outline_points(polygons: npt.NDArray[Any], count: int) -> Complex:
    """Sample outlines evenly along their length, counter-clockwise from the sharpest corner.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), not empty.
    count
        Points on each.

    Returns
    -------
    ndarray
        Shape (n, count), as complex numbers about the middle of the bounds.
    """
    rings = shapely.get_exterior_ring(polygons)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    box = shapely.bounds(polygons)
    middle = (box[:, :2] + box[:, 2:]) / 2
    z = ((xy - middle[ring]) @ [1, 1j]).astype(complex)
    first = np.searchsorted(ring, np.arange(len(rings)))
    size = np.diff(np.r_[first, len(z)])
    step = np.diff(z, append=z[:1])
    step[first + size - 1] = 0.0
    way = np.cumsum(np.abs(step)) - np.abs(step)
    way -= way[first][ring]
    whole = way[first + size - 1]
    start = way[_sharpest(z, ring, first, size)]
    ccw = shapely.is_ccw(rings)
    share = np.where(ccw[:, None], 1, -1) * np.arange(count) / count
    asked = np.mod(start[:, None] + share * whole[:, None], whole[:, None])
    # all outlines one behind the other, so that one look-up serves them all
    offset = np.r_[0.0, np.cumsum(whole + 1.0)][:-1]
    at = (asked + offset[:, None]).ravel()
    line = way + offset[ring]
    return np.asarray(np.interp(at, line, z.real) + 1j * np.interp(at, line, z.imag)).reshape(
        len(rings), count
    )


def _sharpest(z: Complex, ring: Any, first: Any, size: Any) -> Any:
    """Index of the vertex with the sharpest angle of each ring."""
    on = np.roll(z, -1) - z
    last = first + size - 1
    on[last] = on[first]
    back = np.roll(on, 1)
    back[first] = on[last - 1]
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = np.nan_to_num(np.abs(np.angle(on / back)))
    # the closing vertex repeats the first; the least wins a tie, so that the start is the same
    turn[last] = -1.0
    order = np.lexsort((np.arange(len(z)), -turn.round(6), ring))
    return order[first]


def rectangle_points(width: float, depth: float, count: int, start: Floats) -> Complex:
    """Sample a rectangle evenly along its length, counter-clockwise.

    Parameters
    ----------
    width, depth
        Its sides, metres.
    count
        Number of points.
    start
        How far from the corner at the start of a side of `width` the first point lies, metres,
        shape (n,).

    Returns
    -------
    ndarray
        Shape (n, count), as complex numbers about their mean.
    """
    corners = np.array([0, width, width + 1j * depth, 1j * depth, 0])
    way = np.cumsum([0, width, depth, width, depth])
    at = np.mod(np.reshape(start, (-1, 1)) + np.arange(count) / count * way[-1], way[-1])
    points = np.interp(at, way, corners.real) + 1j * np.interp(at, way, corners.imag)
    return np.asarray(points - points.mean(axis=1, keepdims=True))


def _distances(z: Complex, width: float, depth: float) -> Floats:
    """Lay the rectangle over outlines that are sampled likewise."""
    z = z - z.mean(axis=1, keepdims=True)
    spectrum = np.fft.fft(z, axis=1)
    best = np.full(len(z), np.inf)
    step, row = 2 * (width + depth) / z.shape[1], np.arange(len(z))
    # from a corner at the start of each of the two sides, then between the best shifts
    for start in (0.0, width):
        plain = np.fft.fft(rectangle_points(width, depth, z.shape[1], np.array([start])))
        match = np.abs(np.fft.ifft(spectrum * np.conj(plain), axis=1))
        shift = match.argmax(axis=1)
        low, top, high = (match[row, (shift + k) % z.shape[1]] for k in (-1, 0, 1))
        bend = low - 2 * top + high
        between = np.where(bend < 0, 0.5 * (low - high) / np.where(bend < 0, bend, -1.0), 0.0)
        for where in (shift, shift + between):
            w = rectangle_points(width, depth, z.shape[1], start - where * step)
            factor = (np.conj(w) * z).sum(axis=1) / (np.abs(w) ** 2).sum(axis=1)
            best = np.minimum(best, np.abs(z - factor[:, None] * w).mean(axis=1))
    return best
