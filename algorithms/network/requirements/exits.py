"""Sinks whose number is given but not their place (CND figure 8e)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from .base import Requirement
from .units import check_penalty, touched_vertices

if TYPE_CHECKING:
    from ..cp.model import CpNetwork, Literal
    from ..mip.model import NetworkModel
    from ..problem import NetworkProblem
    from .base import View


@dataclass(frozen=True, eq=False)
class ExitCount(Requirement):
    """So many of the places where traffic may leave are used (CND section 5.1, figure 8e).

    All options are sinks of the problem. An option is an *exit* if a chosen edge touches it.
    An option that is none has no chosen edge, so that nothing can leave there: on a wall it is
    no way out. Where options lie on existing streets, these are ground that is free to use: a
    vertex of the design is as far from a sink as from the nearest place where it comes to an
    option, and what happens on the existing streets from there on costs nothing. Options that
    an existing street inside the site touches count only if a chosen edge does, too; see
    `uncounted` for places where new streets could reach existing ones without being counted.

    Attributes
    ----------
    options
        Vertices.
    most, least
        Largest and smallest number of exits. Each exit too many and each that is missing is a
        violation.
    penalty
        Cost of each violation; infinite forbids.
    kind
        See `Requirement`.

    Raises
    ------
    InputError
        If no number of exits fits.
    """

    options: tuple[int, ...]
    most: int
    least: int = 1
    penalty: float = math.inf
    kind: str = "number of exits"

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_penalty(self.penalty, "Number of exits")
        if not 0 <= self.least <= self.most:
            raise InputError(
                f"At least {self.least} and at most {self.most} exits are asked for.",
                "Give two numbers of which the second is the larger one, or both the same.",
            )
        if self.least > len(set(self.options)):
            raise InputError(
                f"At least {self.least} exits are asked for, but there are only "
                f"{len(set(self.options))} places for one.",
                "Ask for fewer exits or allow more places.",
            )

    def violations(self, view: View) -> int:
        """Return how many exits there are too many, or too few."""
        options = sorted(set(self.options))
        count = int(touched_vertices(view.problem, view.active)[options].sum())
        return max(0, count - self.most) + max(0, self.least - count)

    def places(self, view: View) -> Sequence[int]:
        """Return the exits if there are too many, else the other options."""
        touched = touched_vertices(view.problem, view.active)
        exits = [v for v in sorted(set(self.options)) if touched[v]]
        if len(exits) > self.most:
            return exits
        return [v for v in sorted(set(self.options)) if not touched[v]]

    def add_to_cp(self, network: CpNetwork) -> None:
        """Count exits: those outside a window are known."""
        literals = [exit_literal(network, v) for v in sorted(set(self.options))]
        known = sum(literal is True for literal in literals)
        open_ones = [literal for literal in literals if not isinstance(literal, bool)]
        count = known + network.expression.sum(open_ones)
        high, low = known + len(open_ones), known
        if high > self.most:
            over = self._excess(network, high - self.most)
            network.model.add(count <= self.most + over)
        if low < self.least:
            under = self._excess(network, self.least - low)
            network.model.add(count >= self.least - under)

    def _excess(self, network: CpNetwork, top: int) -> Any:
        """Return a variable that counts violations: 0 where they are forbidden."""
        if self.hard:
            return 0
        excess = network.model.new_int_var(0, top, "")
        network.add_cost(excess, self.penalty, top)
        return excess

    def add_to_mip(self, model: NetworkModel) -> None:
        """Count exits by a variable per option, which its edges decide."""
        linear = model.linear
        count: list[tuple[Any, float]] = []
        for v in sorted(set(self.options)):
            xs = [model.edge[e] for e in model.index.incident[v]]
            if not xs:
                continue
            used = linear.real(1.0)
            for x in xs:
                linear.row([(used, 1.0), (x, -1.0)], low=0.0)
            linear.row([(used, -1.0), *((x, 1.0) for x in xs)], low=0.0)
            count.append((used, 1.0))
        over: list[tuple[Any, float]] = []
        under: list[tuple[Any, float]] = []
        if not self.hard:
            over.append((linear.real(None, self.penalty), -1.0))
            under.append((linear.real(None, self.penalty), 1.0))
        linear.row([*count, *over], high=float(self.most))
        linear.row([*count, *under], low=float(self.least))


def exit_literal(network: CpNetwork, vertex: int) -> Literal:
    """Return a CP-SAT literal that says whether a chosen edge touches a vertex."""
    index = network.index
    mine = [network.literal(e) for e in index.incident[vertex]]
    if any(x is True for x in mine):
        return True
    xs = [x for x in mine if x is not False]
    if not xs:
        return False
    if len(xs) == 1:
        return xs[0]
    if not index.street[vertex]:
        return network.vertex[vertex]
    used = network.model.new_bool_var("")
    for x in xs:
        network.model.add_implication(x, used)
    network.model.add_bool_or([*xs, ~used])
    return used


def with_exits(
    problem: NetworkProblem,
    options: Sequence[int],
    most: int,
    *,
    least: int = 1,
    penalty: float = math.inf,
) -> NetworkProblem:
    """Return a problem whose sinks are the options, of which only some are to be used.

    Parameters
    ----------
    problem
        The problem; its sinks are replaced.
    options, most, least, penalty
        See `ExitCount`.
    """
    sinks = np.zeros_like(problem.sinks)
    sinks[list(options)] = True
    wanted = ExitCount(tuple(int(v) for v in options), most, least, penalty)
    return dataclasses.replace(problem, sinks=sinks, requirements=(*problem.requirements, wanted))


def uncounted(problem: NetworkProblem, options: Sequence[int]) -> list[int]:
    """List the vertices by which new streets could meet existing ones without being counted.

    Parameters
    ----------
    problem
        The problem.
    options
        Vertices that count.

    Returns
    -------
    list of int
        Vertices on existing streets with candidate edges that are no options, ascending. Make
        them options, or take the candidate edges there away, if they are to count.
    """
    on_street = touched_vertices(problem, problem.existing)
    on_street &= touched_vertices(problem, problem.candidate)
    on_street[list(options)] = False
    return np.flatnonzero(on_street).tolist()  # type: ignore[no-any-return]
