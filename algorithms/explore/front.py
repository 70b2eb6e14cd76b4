"""Which of many designs are worth a look: those that no other is better than in every way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt


def pareto_front(
    figures: npt.ArrayLike, smaller_is_better: bool | Sequence[bool] = True
) -> npt.NDArray[np.bool_]:
    """Tell which rows no other row dominates.

    A row dominates another if it is as good in every column and better in one. Equal rows do not
    dominate each other, so that all of them are on the front or none is.

    Parameters
    ----------
    figures
        Shape (n, k). One row for each design.
    smaller_is_better
        For all columns, or for each, whether less is better.

    Returns
    -------
    ndarray of bool
        Shape (n,). Rows with a figure that is no number are never on the front and dominate
        nothing.

    Examples
    --------
    >>> pareto_front([[1.0, 5.0], [2.0, 2.0], [3.0, 3.0]]).tolist()
    [True, True, False]
    """
    rows = np.array(figures, dtype=float, ndmin=2)
    if rows.size == 0:
        return np.zeros(len(rows), dtype=np.bool_)
    rows = np.where(np.broadcast_to(smaller_is_better, rows.shape[1:]), rows, -rows)
    known = ~np.isnan(rows).any(axis=1)
    front = np.zeros(len(rows), dtype=np.bool_)
    best: list[npt.NDArray[np.float64]] = []
    # in this order nothing is dominated by what comes after it
    for row in np.lexsort(rows.T[::-1]):
        if not known[row]:
            continue
        mine = rows[row]
        if not any((one <= mine).all() and (one < mine).any() for one in best):
            front[row] = True
            best.append(mine)
    return front
