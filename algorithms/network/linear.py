"""A small layer over PuLP: variables, rows and the answer, typed."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Optional

import pulp


class LinearModel:
    """A mixed-integer program to be minimised.

    Attributes
    ----------
    problem
        The PuLP problem.
    """

    def __init__(self, name: str) -> None:
        self.problem: Any = pulp.LpProblem(name, pulp.LpMinimize)
        self._costs: list[tuple[Any, float]] = []
        self._count = 0
        self.constant = 0.0

    def binary(self, cost: float = 0.0) -> Any:
        """Add a 0-1 variable."""
        return self._variable(1.0, "Integer", cost)

    def real(self, upper: Optional[float] = None, cost: float = 0.0) -> Any:
        """Add a continuous variable from 0 to `upper` (None for no limit)."""
        return self._variable(upper, "Continuous", cost)

    def _variable(self, upper: Optional[float], category: str, cost: float) -> Any:
        variable = pulp.LpVariable(f"v{self._count}", 0, upper, category)
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
        self.problem += pulp.LpAffineExpression(sums)
