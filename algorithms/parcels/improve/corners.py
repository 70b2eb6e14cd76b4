"""The four sides of a region, if it has four."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
#: The outline turns by more than this at corners, and by less at all other vertices (degrees).
CORNER = 45.0
WEAK = 32.0
#: Turns are measured between the pieces so far before and after a vertex: this share of the
#: outline's length, but at least and at most so many metres.
WINDOW = 0.03
LEAST, LARGEST = 6.0, 15.0


def turns(xy: Floats) -> Floats:
    """By how much an outline turns at its vertices, seen from some way off, shape (n,), degrees.

    Parameters
    ----------
    xy
        Ring of shape (n, 2), the first vertex not repeated; metres. Left turns are positive.
    """
    n = len(xy)
    around = np.vstack([xy, xy, xy, xy[:1]])
    at = np.r_[0.0, np.cumsum(np.hypot(*np.diff(around, axis=0).T))]
    window = float(np.clip(WINDOW * at[n], LEAST, LARGEST))
    here = at[n : 2 * n]

    def place(s: Floats) -> Floats:
        return np.column_stack([np.interp(s, at, c) for c in around.T])

    back, on = xy - place(here - window), place(here + window) - xy
    cross = back[:, 0] * on[:, 1] - back[:, 1] * on[:, 0]
    return np.asarray(np.degrees(np.arctan2(cross, (back * on).sum(axis=1))))


def four_sides(xy: Floats) -> list[list[int]] | None:
    """Divide a ring into four sides at its corners.

    Parameters
    ----------
    xy
        Ring, counter-clockwise, shape (n, 2), the first vertex not repeated; metres.

    Returns
    -------
    list of list of int or None
        Indices of the vertices of each side, from corner to corner; None if the ring does not
        have four clear corners that turn left.

    Examples
    --------
    >>> four_sides(np.array([(0, 0), (90, 0), (200, 0), (200, 60), (0, 60)], dtype=float))
    [[0, 1, 2], [2, 3], [3, 4], [4, 0]]
    """
    n = len(xy)
    if n < 4:
        return None
    turn = turns(xy)
    if (turn < -CORNER).any():
        return None
    near = np.hypot(*(np.roll(xy, -1, axis=0) - xy).T)
    corners: list[int] = []
    for k in np.argsort(-turn, kind="stable"):
        if turn[k] < WEAK:
            break
        if all(_apart(near, int(k), c) > LEAST for c in corners):
            corners.append(int(k))
    if len(corners) < 4 or (len(corners) > 4 and turn[corners[4]] > CORNER):
        return None
    own = sorted(corners[:4])
    found = []
    for start, stop in zip(own, (*own[1:], own[0] + n)):
        found.append([k % n for k in range(start, stop + 1)])
    return found


def _apart(steps: Floats, a: int, b: int) -> float:
    """Length of the shorter way round a ring between two of its vertices."""
    low, high = min(a, b), max(a, b)
    inner = float(steps[low:high].sum())
    return min(inner, float(steps.sum()) - inner)
