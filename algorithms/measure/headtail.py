"""Head/tail breaks: classes of values of which few are large and many are small.

Values are split at their mean. What lies above is the head; as long as it is a minority it is split
again at its own mean, and so on (Jiang 2013, "Head/tail breaks: a new classification scheme for
data with a heavy-tailed distribution", The Professional Geographer 65). The number of classes is
the ht-index (Jiang and Yin 2014, "Ht-index for quantifying the fractal or scaling structure of
geographic features", Annals of the AAG 104): one more than the number of times that "far more
small things than large ones" recurs.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from .graph import FloatArray, IntArray

#: A head of more than this share of its values is no minority (Jiang 2013).
SHARE = 0.4
#: Values count as above a mean where they are so by more than this share of the largest.
_ROUNDING = 1e-9


def head_tail_breaks(
    values: npt.ArrayLike, share: float = SHARE, *, relaxed: bool = False
) -> FloatArray:
    """Find the means at which values are split into heads and tails.

    Parameters
    ----------
    values
        Finite numbers, in any order.
    share
        Largest share of a head among the values that it is taken from, above 0 and below 1.
    relaxed
        Whether the mean of all shares so far must not be above `share`, in place of each single
        one (head/tail breaks 2.0; Jiang 2019, Sustainability 11, 4091).

    Returns
    -------
    array
        The breaks, ascending; empty where the values have no minority of large ones.

    Raises
    ------
    InputError
        If the share is out of bounds.

    Examples
    --------
    The first ten numbers of Zipf's law fall into three classes: one, two and seven of them.

    >>> breaks = head_tail_breaks([1 / k for k in range(1, 11)])
    >>> [round(b, 4) for b in breaks.tolist()]
    [0.2929, 0.6111]
    """
    if not 0 < share < 1:
        raise InputError(f"The share of a head is {share:g}.", "Give more than 0 and less than 1.")
    head = np.asarray(values, dtype=float).ravel()
    breaks: list[float] = []
    shares: list[float] = []
    while len(head) > 1:
        mean = float(head.mean())
        above = head[above_mean(head, mean)]
        shares.append(len(above) / len(head))
        if not len(above) or (np.mean(shares) if relaxed else shares[-1]) > share:
            break
        breaks.append(mean)
        head = above
    return np.array(breaks)


def ht_index(values: npt.ArrayLike, share: float = SHARE, *, relaxed: bool = False) -> int:
    """Count the classes of head/tail breaks.

    Parameters
    ----------
    values, share, relaxed
        See `head_tail_breaks`.

    Returns
    -------
    int
        1 where there is no minority of large values; 0 without values.
    """
    if not np.size(np.asarray(values)):
        return 0
    return len(head_tail_breaks(values, share, relaxed=relaxed)) + 1


def ht_levels(values: npt.ArrayLike, breaks: npt.ArrayLike) -> IntArray:
    """Tell the class of each value.

    Parameters
    ----------
    values
        Shape (n,).
    breaks
        See `head_tail_breaks`.

    Returns
    -------
    array
        Shape (n,). 1 for the many small ones up to the ht-index for the few largest ones.
    """
    own = np.asarray(values, dtype=float)
    level = np.ones(own.shape, dtype=np.int64)
    for mean in np.asarray(breaks, dtype=float).tolist():
        level += above_mean(own, mean)
    return level


def above_mean(values: FloatArray, mean: float) -> npt.NDArray[np.bool_]:
    """Tell which values lie above a mean, by more than rounding.

    Parameters
    ----------
    values
        Shape (n,).
    mean
        Of these or of some of them.
    """
    return np.asarray(values > mean + _ROUNDING * abs(mean))
