"""The linear relaxation of a program: how good a choice can be, and which columns it is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from scipy.optimize import linprog

from ..types import Floats, Ints
from .columns import Bools
from .program import Limit, Program, Wish


@dataclass(frozen=True, eq=False)
class Relaxed:
    """An optimum of the relaxation.

    Attributes
    ----------
    bound
        Its cost: no choice is cheaper.
    part
        Which part of each column it chooses, shape (n,).
    reduced
        Reduced costs: a choice with this column costs at least `bound` + this, shape (n,).
    """

    bound: float
    part: Floats
    reduced: Floats


def relax(program: Program, seconds: float = math.inf) -> Relaxed | None:
    """Solve the relaxation of a program, or return None if the solver fails or time is up.

    It is tight: its cliques are those of intervals, whose programs are whole by themselves; only
    wishes, limits and shadows split columns.
    """
    n, wishes = len(program.cost), program.wishes
    index: list[Ints] = list(program.cliques)
    value = [np.ones(len(clique)) for clique in program.cliques]
    high = [1.0] * len(index)
    for row in [*program.limits, *program.cuts]:
        index.append(row.columns)
        value.append(row.coefficients)
        high.append(row.high)
    for k, wish in enumerate(wishes):
        some = np.flatnonzero(wish.gain)
        index.append(np.append(some, n + k))
        value.append(np.append(-wish.gain[some], -1.0))
        high.append(-wish.need)
    if not index:
        return None
    ends = np.cumsum([0, *[len(i) for i in index]])
    rows = scipy.sparse.csr_matrix(
        (np.concatenate(value), np.concatenate(index), ends), shape=(len(index), n + len(wishes))
    )
    cost = np.append(program.cost, [wish.price for wish in wishes])
    # a unit about the cost of a building, which absolute tolerances see
    unit = max(1e-9, float(np.median(program.cost)))
    limit = {"time_limit": max(0.01, seconds)} if math.isfinite(seconds) else {}
    result = linprog(cost / unit, rows, high, bounds=(0.0, None), method="highs-ds", options=limit)
    if result.status != 0:
        return None
    reduced = result.lower.marginals[:n] * unit
    return Relaxed(float(result.fun) * unit, result.x[:n], reduced)


def restricted(program: Program, keep: Bools) -> Program:
    """Return the program of some of the columns only."""
    number = np.where(keep, np.cumsum(keep) - 1, -1)
    cliques: dict[bytes, Ints] = {}
    for clique in program.cliques:
        left = number[clique]
        left = left[left >= 0]
        if len(left) > 1:
            cliques[left.tobytes()] = left

    def rows(limits: list[Limit]) -> list[Limit]:
        return [
            Limit(number[row.columns[kept]], row.coefficients[kept], row.high)
            for row in limits
            for kept in [keep[row.columns]]
        ]

    return Program(
        program.cost[keep],
        list(cliques.values()),
        [Wish(wish.need, wish.gain[keep], wish.price) for wish in program.wishes],
        rows(program.limits),
        program.hint[keep],
        rows(program.cuts),
    )


def worth_a_look(program: Program, most: int, seconds: float = math.inf) -> tuple[Bools, float]:
    """Tell which columns a better choice than the present one can have.

    Parameters
    ----------
    program
        The program with the present choice as its hint.
    most
        Most columns to keep; with fewer than could matter, something better may be missed.
    seconds
        How long the relaxation may take; without it all columns are kept.

    Returns
    -------
    keep : numpy.ndarray
        Shape (n,); none if there is nothing better.
    bound : float
        Lower bound of the cost.
    """
    found = relax(program, seconds)
    if found is None:
        return np.ones(len(program.cost), dtype=bool), -np.inf
    allowed = program.value(program.hint) - found.bound
    keep: Bools = (found.reduced < allowed) & (allowed > 0)
    if int(keep.sum()) > most:
        order = np.argsort(found.reduced - found.part, kind="stable")
        best = np.zeros(len(keep), dtype=bool)
        best[order[: int(most)]] = True
        keep &= best
    if keep.any():
        keep |= program.hint
    return keep, found.bound
