"""How alike two outlines are: the distance of their turning functions."""

from __future__ import annotations

import numpy as np

from ..types import Floats

#: Fits whose shifts differ by less than this are the same (share of the perimeter).
APART = 0.05


def arcs(ring: Floats) -> Floats:
    """Give the place of each vertex along a ring as a share of its length, shape (n,).

    Parameters
    ----------
    ring
        Vertices, the first not repeated, shape (n, 2).
    """
    step = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T)
    return np.asarray(np.concatenate([[0.0], np.cumsum(step)[:-1]]) / step.sum())


def turns(ring: Floats) -> Floats:
    """Give the turn at each vertex, radians, left positive, shape (n,)."""
    ahead = np.roll(ring, -1, axis=0) - ring
    behind = np.roll(ahead, 1, axis=0)
    cross = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
    return np.asarray(np.arctan2(cross, np.sum(behind * ahead, axis=1)))


def turning_fits(ring: Floats, other: Floats, most: int = 6) -> list[tuple[float, float]]:
    """Lay one outline upon another as well as it goes, from every start.

    The distance of Arkin et al. (1991): the least root mean square difference of the two turning
    functions over all rotations, outlines scaled to the same length. It is least where a vertex
    of one meets a vertex of the other, so only those starts are tried.

    Parameters
    ----------
    ring, other
        Vertices of simple polygons, counter-clockwise, shapes (n, 2) and (m, 2).
    most
        Number of fits.

    Returns
    -------
    list of (float, float)
        Distance, radians, and shift, 0 to 1: place p along `other` lies on p + shift along
        `ring`. Best first; shifts differ.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> [(round(d, 9), round(t, 9)) for d, t in turning_fits(square, 3 * square, 2)]
    [(0.0, 0.0), (0.0, 0.25)]
    """
    a, b = arcs(ring), arcs(other)
    height_a = np.concatenate([[0.0], np.cumsum(turns(ring)[1:])])
    height_b = np.concatenate([[0.0], np.cumsum(turns(other)[1:])])
    shifts = np.unique(np.round((a[:, None] - b[None]).ravel() % 1.0, 12) % 1.0)
    breaks = np.concatenate(
        [(a[None] - shifts[:, None]) % 1.0, np.broadcast_to(b, (len(shifts), len(b)))], axis=1
    )
    breaks = np.sort(breaks, axis=1)
    breaks = np.concatenate([breaks, np.ones((len(shifts), 1))], axis=1)
    width = np.diff(breaks, axis=1)
    middle = (breaks[:, 1:] + breaks[:, :-1]) / 2
    gap = _height(middle + shifts[:, None], a, height_a) - _height(middle, b, height_b)
    mean = np.sum(width * gap, axis=1)
    distance = np.sqrt(np.maximum(np.sum(width * gap**2, axis=1) - mean**2, 0.0))
    found: list[tuple[float, float]] = []
    for at in np.argsort(np.round(distance, 9), kind="stable"):
        shift = float(shifts[at])
        if all(0.5 - abs(0.5 - abs(shift - own)) >= APART for _, own in found):
            found.append((float(distance[at]), shift))
        if len(found) == most:
            break
    return found


def _height(place: Floats, at: Floats, height: Floats) -> Floats:
    """Return the turning function at places from 0 to 2; it grows by a full turn each round."""
    rounds = np.floor(place)
    step = np.searchsorted(at, place - rounds, side="right") - 1
    return np.asarray(height[np.maximum(step, 0)] + 2 * np.pi * rounds)
