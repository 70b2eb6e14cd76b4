"""A budget on the total length of new streets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from .base import Requirement
from .units import (
    MILLIMETRES,
    check_lengths,
    check_number,
    check_penalty,
    whole_limit,
    whole_parts,
)

if TYPE_CHECKING:
    from ..cp.model import CpNetwork
    from ..mip.model import NetworkModel
    from ..problem import FloatArray, IntArray
    from .base import View


@dataclass(frozen=True, eq=False)
class LengthBudget(Requirement):
    """Chosen edges have a total length of at most so many metres.

    Lengths count in whole millimetres. Existing streets count nothing. Where the budget is
    soft, each started `unit` of metres over it is a violation.

    Attributes
    ----------
    lengths
        Shape (e,). Length of each mesh edge in metres.
    most
        The budget in metres.
    unit
        Metres of a violation, at least a millimetre; the edge length of the mesh does well.
    penalty
        Cost of each violation; infinite makes the budget hard.
    kind
        See `Requirement`.

    Raises
    ------
    InputError
        If a length, the budget or the unit makes no sense.
    """

    lengths: FloatArray
    most: float
    unit: float
    penalty: float = math.inf
    kind: str = "length budget"

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_penalty(self.penalty, "Length budget")
        check_lengths(self.lengths, "Length budget")
        check_number(self.most, "The length budget")
        if not (math.isfinite(self.unit) and self.unit * MILLIMETRES >= 1):
            raise InputError(
                f"The unit of the length budget is {self.unit:g} m.",
                "Give the metres over budget that count as one violation.",
            )

    @cached_property
    def _steps(self) -> IntArray:
        """Shape (e,). Lengths in millimetres."""
        return whole_parts(self.lengths, MILLIMETRES)

    @property
    def _budget(self) -> int:
        """Budget in millimetres."""
        return whole_limit(self.most, MILLIMETRES)

    @property
    def _unit(self) -> int:
        """Unit in millimetres."""
        return whole_limit(self.unit, MILLIMETRES)

    def violations(self, view: View) -> int:
        """Return the number of started units over the budget."""
        return self._started(int(self._steps[view.active].sum()))

    def _started(self, total: int) -> int:
        """Return the number of started units by which a total is over the budget."""
        return max(0, -((self._budget - total) // self._unit))

    def add_to_cp(self, network: CpNetwork) -> None:
        """Bound the sum of the free edges by what the others leave."""
        outside = network.fixed.copy()
        outside[network.free] = False
        spent = int(self._steps[outside].sum())
        steps = self._steps[network.free]
        top = self._started(spent + int(steps.sum()))
        if not top:
            return
        divisor = math.gcd(*steps.tolist(), *(() if self.hard else (self._unit,))) or 1
        left = (self._budget - spent) // divisor
        xs = [network.edge[e] for e in network.free]
        total = network.expression.weighted_sum(xs, (steps // divisor).tolist())
        if self.hard:
            network.model.add(total <= left)
            return
        over = network.model.new_int_var(0, top, "")
        network.model.add(total <= left + self._unit // divisor * over)
        network.add_cost(over, self.penalty, top)

    def add_to_mip(self, model: NetworkModel) -> None:
        """Bound the sum in metres, with room for rounding below half a millimetre."""
        steps = self._steps
        top = self._started(int(np.sum(steps[list(model.edge)])))
        if not top:
            return
        row: list[tuple[Any, float]] = [
            (x, float(steps[e]) / MILLIMETRES) for e, x in model.edge.items()
        ]
        if not self.hard:
            over = model.linear.integer(float(top), self.penalty)
            row.append((over, -float(self._unit) / MILLIMETRES))
        model.linear.row(row, high=(self._budget + 0.4) / MILLIMETRES)
