"""A small layer over PuLP: variables, rows and the answer, typed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, Optional

import pulp


class LinearModel:
    """A mixed-integer program to be minimised.

    Attributes
    ----------
    problem
        The PuLP problem; its objective is multiplied by `factor` and lacks `constant`.
    constant
        Cost that is always due.
    factor
        Power of 2 that brings small costs to where solvers with absolute tolerances see them.
    """

    def __init__(self, name: str, check: Optional[Callable[[], None]] = None) -> None:
        self.problem: Any = pulp.LpProblem(name, pulp.LpMinimize)
        self.factor = 1.0
        self._check = check
        # PuLP 3.3 warns whoever makes variables in the way of older versions
        self._make: Any = getattr(self.problem, "add_variable", pulp.LpVariable)
        self._costs: list[tuple[Any, float]] = []
        self._count = 0
        self.constant = 0.0

    def binary(self, cost: float = 0.0) -> Any:
        """Add a 0-1 variable."""
        return self._variable(1.0, "Integer", cost)

    def integer(self, upper: float, cost: float = 0.0) -> Any:
        """Add a whole-number variable from 0 to `upper`."""
        return self._variable(upper, "Integer", cost)

    def real(self, upper: Optional[float] = None, cost: float = 0.0) -> Any:
        """Add a continuous variable from 0 to `upper` (None for no limit)."""
        return self._variable(upper, "Continuous", cost)

    def _variable(self, upper: Optional[float], category: str, cost: float) -> Any:
        variable = self._make(f"v{self._count}", 0, upper, category)
        self._count += 1
        # also those without cost: a variable in no row would be lost otherwise
        self._costs.append((variable, cost))
        return variable

    def add_cost(self, variable: Any, cost: float) -> None:
        """Add to the cost of a variable."""
        self._costs.append((variable, cost))

    def row(
        self,
        parts: Iterable[tuple[Any, float]],
        *,
        low: float = -math.inf,
        high: float = math.inf,
    ) -> None:
        """Demand low <= sum of coefficient times variable <= high."""
        if self._check is not None:
            self._check()
        sums: dict[Any, float] = {}
        for variable, coefficient in parts:
            sums[variable] = sums.get(variable, 0.0) + coefficient
        expression = pulp.LpAffineExpression(sums)
        if low == high:
            self.problem += pulp.LpConstraint(expression, pulp.LpConstraintEQ, rhs=low)
            return
        if high < math.inf:
            self.problem += pulp.LpConstraint(expression, pulp.LpConstraintLE, rhs=high)
        if low > -math.inf:
            self.problem += pulp.LpConstraint(expression, pulp.LpConstraintGE, rhs=low)

    def finish(self) -> None:
        """Set the objective; call once, after everything else."""
        sums: dict[Any, float] = {}
        for variable, cost in self._costs:
            sums[variable] = sums.get(variable, 0.0) + cost
        largest = max(sums.values(), default=0.0)
        if 0 < largest < 1:
            self.factor = 2.0 ** math.ceil(-math.log2(largest))
        scaled = {variable: cost * self.factor for variable, cost in sums.items()}
        self.problem += pulp.LpAffineExpression(scaled)

    def cost_of(self, value: float) -> float:
        """Return the cost that a value of the solver's objective stands for."""
        return value / self.factor + self.constant
