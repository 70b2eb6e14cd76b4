"""Choosing columns: a 0-1 program with cliques.

It is solved by HiGHS. CP-SAT was tried and given up: on programs of 500 to 1500 columns it needed
longer for the same objective, as far as a few runs tell, and often found nothing on larger ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...mip.linear import LinearModel
from ...mip.solvers import solve_mip
from ..types import Floats, Ints
from .columns import Bools

#: Limits may be exceeded by so little, since numbers are rounded.
ROUNDING = 5e-7
#: What is this close to the optimum (relative) is good enough.
GAP = 2e-4


@dataclass(frozen=True, eq=False)
class Wish:
    """Something of which there should be at least `need`; every unit that is missing costs.

    Attributes
    ----------
    need
        How much is missing before anything is chosen.
    gain
        What each column brings, not negative, shape (n,).
    price
        Cost of a missing unit, greater than 0.
    """

    need: float
    gain: Floats
    price: float


@dataclass(frozen=True, eq=False)
class Limit:
    """A sum that may not be exceeded: sum of coefficient times column <= high.

    Attributes
    ----------
    columns, coefficients
        Which columns count, and how much, shape (k,) each.
    high
        The limit.
    """

    columns: Ints
    coefficients: Floats
    high: float


@dataclass(eq=False)
class Program:
    """Choose columns at the least cost.

    Attributes
    ----------
    cost
        Cost of each column, shape (n,).
    cliques
        Sets of columns of which at most one can be chosen.
    wishes, limits
        What should and what must hold.
    hint
        Columns that are chosen now, shape (n,).
    """

    cost: Floats
    cliques: list[Ints]
    wishes: list[Wish]
    limits: list[Limit]
    hint: Bools
    cuts: list[Limit] = field(default_factory=list)

    def value(self, chosen: Bools) -> float:
        """Return what a choice costs."""
        missing = sum(w.price * max(0.0, w.need - float(w.gain[chosen].sum())) for w in self.wishes)
        return float(self.cost[chosen].sum()) + missing

    def allows(self, chosen: Bools) -> bool:
        """Tell whether a choice keeps to the cliques and limits."""
        if any(int(chosen[clique].sum()) > 1 for clique in self.cliques):
            return False
        return all(
            float((row.coefficients * chosen[row.columns]).sum()) <= row.high + 2 * ROUNDING
            for row in [*self.limits, *self.cuts]
        )


@dataclass(frozen=True)
class Effort:
    """How long a program may be worked at.

    Attributes
    ----------
    seconds
        Wall time.
    nodes
        Most nodes of the search tree, or None. What ends by them is the same every time.
    """

    seconds: float
    nodes: int | None = None


@dataclass(frozen=True, eq=False)
class Answer:
    """What a solver chose.

    Attributes
    ----------
    chosen
        Chosen columns, shape (n,); None if there is no answer.
    optimal
        Whether nothing better exists.
    bound
        Proven lower bound of the cost.
    """

    chosen: Bools | None
    optimal: bool
    bound: float


def solve_program(
    program: Program, effort: Effort, stop: Callable[[], bool] | None = None
) -> Answer:
    """Solve a program.

    Parameters
    ----------
    program
        What to choose from.
    effort
        How long, and by what.
    stop
        Asked many times a second; true ends the run, which keeps what it has.

    Returns
    -------
    Answer
    """
    if not len(program.cost):
        value = program.value(np.zeros(0, dtype=bool))
        return Answer(np.zeros(0, dtype=bool), True, value)
    model = LinearModel("buildings")
    x = [model.binary(float(cost)) for cost in program.cost]
    for wish in program.wishes:
        if wish.need > 0:
            missing = model.real(wish.need, wish.price)
            parts = [(x[i], float(wish.gain[i])) for i in np.flatnonzero(wish.gain)]
            model.row([*parts, (missing, 1.0)], low=wish.need)
    for clique in program.cliques:
        model.row([(x[i], 1.0) for i in clique], high=1.0)
    for row in [*program.limits, *program.cuts]:
        parts = [(x[i], float(c)) for i, c in zip(row.columns, row.coefficients)]
        if parts:
            model.row(parts, high=row.high)
    model.finish()
    result = solve_mip(
        model, time_limit=effort.seconds, gap=GAP, nodes=effort.nodes, cancelled=stop
    )
    if result.values is None:
        return Answer(None, False, result.bound)
    chosen = np.array([result.values.get(v.name, 0.0) > 0.5 for v in x])
    return Answer(chosen, result.status == "optimal", result.bound)
