"""Limits of the total length of new streets: a budget, and a least length."""

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
        _check_unit(self.unit, "length budget", "over budget")

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


@dataclass(frozen=True, eq=False)
class LeastLength(Requirement):
    """Chosen edges have a total length of at least so many metres.

    The mirror of `LengthBudget`: lengths count in whole millimetres, existing streets count
    nothing. Where it is soft, each started `unit` of metres that are missing is a violation.

    Attributes
    ----------
    lengths
        Shape (e,). Length of each mesh edge in metres.
    least
        The least length in metres.
    unit
        Metres of a violation, at least a millimetre.
    penalty
        Cost of each violation; infinite makes the least length hard.
    kind
        See `Requirement`.

    Raises
    ------
    InputError
        If a length, the least length or the unit makes no sense.
    """

    lengths: FloatArray
    least: float
    unit: float
    penalty: float = math.inf
    kind: str = "least length"

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_penalty(self.penalty, "Least length")
        check_lengths(self.lengths, "Least length")
        check_number(self.least, "The least length")
        _check_unit(self.unit, "least length", "missing")

    @cached_property
    def steps(self) -> IntArray:
        """Shape (e,). Lengths in millimetres."""
        return whole_parts(self.lengths, MILLIMETRES)

    @property
    def wanted(self) -> int:
        """Least length in millimetres."""
        return whole_limit(self.least, MILLIMETRES)

    @property
    def _unit(self) -> int:
        """Unit in millimetres."""
        return whole_limit(self.unit, MILLIMETRES)

    def violations(self, view: View) -> int:
        """Return the number of started units that are missing."""
        return self._started(int(self.steps[view.active].sum()))

    def _started(self, total: int) -> int:
        """Return the number of started units that a total is short of."""
        return max(0, -((total - self.wanted) // self._unit))

    def add_to_cp(self, network: CpNetwork) -> None:
        """Demand of the free edges what the others leave missing."""
        outside = network.fixed.copy()
        outside[network.free] = False
        have = int(self.steps[outside].sum())
        top = self._started(have)
        if not top:
            return
        steps = self.steps[network.free]
        divisor = math.gcd(*steps.tolist(), *(() if self.hard else (self._unit,))) or 1
        missing = -((have - self.wanted) // divisor)
        xs = [network.edge[e].index for e in network.free]
        weights = (steps // divisor).tolist()
        if self.hard:
            network.write.at_least(xs, weights, missing)
            return
        short = network.model.new_int_var(0, top, "")
        network.write.at_least([*xs, short.index], [*weights, self._unit // divisor], missing)
        network.add_cost(short, self.penalty, top)

    def add_to_mip(self, model: NetworkModel) -> None:
        """Bound the sum in metres, with room for rounding below half a millimetre."""
        top = self._started(0)
        if not top:
            return
        row: list[tuple[Any, float]] = [
            (x, float(self.steps[e]) / MILLIMETRES) for e, x in model.edge.items()
        ]
        if not self.hard:
            short = model.linear.integer(float(top), self.penalty)
            row.append((short, float(self._unit) / MILLIMETRES))
        if not row:
            # nothing can be chosen: a row that no value keeps
            row = [(model.linear.real(0.0), 1.0)]
        model.linear.row(row, low=(self.wanted - 0.4) / MILLIMETRES)


def _check_unit(unit: float, what: str, how: str) -> None:
    """Raise `InputError` unless the metres of a violation are at least a millimetre."""
    if not (math.isfinite(unit) and unit * MILLIMETRES >= 1):
        raise InputError(
            f"The unit of the {what} is {unit:g} m.",
            f"Give the metres {how} that count as one violation.",
        )
