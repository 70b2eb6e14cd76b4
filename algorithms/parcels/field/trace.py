"""Many lines traced through a cross field at once."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import STRtree

from .grid import Grid
from .outline import Complexes, Floats, Ints, Outline

#: Where the interpolated cross is shorter than this, a singularity is near.
LOST = 0.25
#: Tracing goes on until this many raster steps outside; where the line ends is found exactly.
BEYOND = 0.5


def turned(z: Complexes, ahead: Complexes) -> Complexes:
    """Of the four directions of crosses, the one that is nearest to the direction ahead.

    Parameters
    ----------
    z
        cos 4t + i sin 4t, of any length, shape (n,).
    ahead
        Complex numbers, not 0, shape (n,).

    Returns
    -------
    way
        Complex numbers, as long as the fourth root of the length of z, shape (n,).
    """
    back = ahead.conj()
    square = back * back
    # the root has an argument within 45 degrees of 0, so the result is that near to ahead
    return np.asarray(np.sqrt(np.sqrt(z * (square * square))) / back)


def trace(
    grid: Grid, start: Complexes, ahead: Complexes, step: float, most: int
) -> tuple[Complexes, Floats, Ints]:
    """Follow crosses from points until they leave the region (Runge-Kutta of 4th order).

    Parameters
    ----------
    grid
        The field.
    start, ahead
        Where, and which way, shape (n,).
    step
        Length of a step, metres.
    most
        Greatest number of steps.

    Returns
    -------
    path
        Points, shape (most + 1, n); after the last of a line it is repeated.
    inside
        Distance of the points to the boundary, the same shape; metres.
    count
        Number of points of each line, negative where it came to a singularity or to no end,
        shape (n,).
    """
    path = np.empty((most + 1, len(start)), complex)
    inside = np.empty((most + 1, len(start)))
    path[0] = start
    count = np.full(len(start), -1)
    who = np.arange(len(start))
    at, way = start.copy(), ahead.copy()
    out = -BEYOND * grid.step
    last = 0
    for number in range(most + 1):
        last = number
        z, depth = grid.take(at, grid.cross, grid.inside)
        inside[number, who] = depth.real
        left = depth.real < out
        gone = left | ((z.real**2 + z.imag**2 < LOST**2) & (depth.real > 0))
        if gone.any():
            count[who[left]] = number + 1
            inside[number + 1 :, who[gone]] = -1.0
            path[number + 1 :, who[gone]] = at[gone]
            keep = ~gone
            who, at, way, z = who[keep], at[keep], way[keep], z[keep]
        if not len(who) or number == most:
            break
        first = turned(z, way)
        second = turned(grid.take(at + 0.5 * step * first, grid.cross)[0], first)
        third = turned(grid.take(at + 0.5 * step * second, grid.cross)[0], second)
        fourth = turned(grid.take(at + step * third, grid.cross)[0], third)
        # a little slower near singularities, where crosses are short: the line is the same
        way = (first + 2 * (second + third) + fourth) / 6
        at = at + step * way
        path[number + 1, who] = at
    return path[: last + 1], inside[: last + 1], count


def first_hits(
    path: Complexes, inside: Floats, count: Ints, edges: Outline, reach: float
) -> tuple[Ints, Ints, Floats, Complexes]:
    """Where lines first meet the boundary.

    Parameters
    ----------
    path, inside, count
        See `trace`.
    edges
        The boundary.
    reach
        Only segments that begin nearer than this to the boundary are looked at, metres.

    Returns
    -------
    segment
        Number of the segment of each line that meets it, -1 for none, shape (n,).
    edge, t
        Which edge of the boundary, and where on it, 0 to 1, shape (n,).
    place
        The point, on the edge to rounding, shape (n,).
    """
    lines = path.shape[1]
    segment, edge = np.full(lines, -1), np.zeros(lines, np.int64)
    t, place = np.zeros(lines), np.zeros(lines, complex)
    number, line = np.nonzero(
        (np.arange(len(path) - 1)[:, None] < count - 1) & (inside[:-1] < reach)
    )
    if not len(line):
        return segment, edge, t, place
    a, b = path[number, line], path[number + 1, line]
    ends = np.stack([a.real, a.imag, b.real, b.imag], axis=1)
    boxes = shapely.linestrings(ends.reshape(-1, 2, 2))
    sides = shapely.linestrings(np.stack([edges.start, edges.end], axis=1))
    query, found = STRtree(sides).query(boxes)
    p, r = a[query], (b - a)[query]
    q = edges.start[found] @ [1, 1j]
    s = edges.end[found] @ [1, 1j] - q
    # p + u r = q + v s
    area = (r.conj() * s).imag
    area = np.where(area == 0, np.inf, area)
    u, v = ((q - p).conj() * s).imag / area, ((q - p).conj() * r).imag / area
    hit = (u >= 0) & (u <= 1) & (v >= -1e-12) & (v <= 1 + 1e-12) & np.isfinite(area)
    query, found, u, v = query[hit], found[hit], u[hit], np.clip(v[hit], 0, 1)
    order = np.lexsort((number[query] + u, line[query]))
    owner, first = np.unique(line[query][order], return_index=True)
    best = order[first]
    segment[owner] = number[query[best]]
    edge[owner], t[owner] = found[best], v[best]
    start, end = edges.start[found[best]], edges.end[found[best]]
    place[owner] = (start + t[owner][:, None] * (end - start)) @ [1, 1j]
    return segment, edge, t, place
