"""Where streets that were there only bend."""

from __future__ import annotations

import numpy as np

from .types import GROWN, BoolArray, IntArray


def bends_of(count: int, ends: IntArray, street: IntArray) -> BoolArray:
    """Tell at which nodes exactly two pieces of one street that was there meet, shape (count,).

    Parameters
    ----------
    count
        Number of nodes.
    ends, street
        As in `Ground` or `Growth`.

    Examples
    --------
    >>> bends_of(4, np.array([[0, 1], [1, 2], [2, 3]]), np.array([5, 5, GROWN])).tolist()
    [False, True, False, False]
    """
    degree = np.bincount(ends.ravel(), minlength=count)
    low, high = np.full(count, np.iinfo(np.int64).max), np.full(count, GROWN)
    for side in (0, 1):
        np.minimum.at(low, ends[:, side], street)
        np.maximum.at(high, ends[:, side], street)
    return np.asarray((degree == 2) & (low == high) & (high != GROWN))
