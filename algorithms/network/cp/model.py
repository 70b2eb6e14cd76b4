"""The network problem, or a window of it, as a CP-SAT model: all but connectivity."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Optional, Union

import numpy as np

from ..cuts.balls import BallCut
from ..local import Term
from ..problem import BoolArray
from ..structure import Structure
from .ortools_access import cp_model
from .write import Writer

#: A CP-SAT literal, or what is known already.
Literal = Union[bool, Any]

#: Whole numbers that a cost becomes at least, where no smaller factor makes all costs whole:
#: rounding down loses a millionth of each cost then.
FINEST = 1_000_000
#: Largest value of the objective in whole numbers; doubles are exact up to eight times that.
LARGEST = 2.0**50


def whole_scale(values: Iterable[float], finest: int = FINEST) -> int:
    """Return the least usual factor that makes all values whole, or `finest` if none does.

    Examples
    --------
    >>> whole_scale([1.0, 0.5]), whole_scale([1 / 3])
    (2, 1000000)
    """
    array = np.array(sorted({v for v in values if v and math.isfinite(v)}))
    for scale in (1, 2, 4, 5, 10, 20, 100, 1000, 10_000):
        rounded = np.round(array * scale)
        # a value that is nearly nothing must not pass for a whole 0
        if scale < finest and np.all((np.abs(array * scale - rounded) < 1e-9) & (rounded != 0)):
            return scale
    return finest


def cost_grain(index: Structure) -> int:
    """Return a number of which every objective is a whole multiple of 1 / it, or 0."""
    problem = index.problem
    costs = [index.cost[e] for e in index.edges] + [term.weight for term in index.terms]
    costs += [requirement.penalty for requirement in problem.requirements]
    costs += [problem.cover_penalty, index.fixed]
    if index.with_distance:
        used = problem.candidate | problem.existing
        costs += (problem.weight_distance * problem.length[used]).tolist()
    scale = whole_scale(costs)
    return scale if scale < FINEST else 0


def whole(value: float, scale: float) -> int:
    """Round a cost down to a whole number of 1/scale, so that bounds stay bounds.

    What is whole but for the rounding of floating-point numbers stays as it is.
    """
    scaled = value * scale
    near = round(scaled)
    return near if abs(scaled - near) <= 1e-9 + 1e-13 * near else math.floor(scaled)


def index_of(literal: Literal) -> int:
    """Return the index of an open literal in the model; that of a negated one is negative."""
    variable: Any = literal
    return int(variable.index)


class CpNetwork:
    """A CP-SAT model over the free edges of a problem, the others being fixed.

    Parameters
    ----------
    index
        The problem.
    free
        Edges to decide; all usable ones for the whole problem.
    fixed
        Shape (e,). Edges chosen among the others.
    finest
        See `FINEST`; the smaller, the faster and the coarser.
    check
        Called often while the model is built; may raise an error to end that.

    Attributes
    ----------
    model
        The CP-SAT model.
    edge
        Literal per edge: a variable for free ones.
    vertex
        Literal per vertex at free edges: whether it is active.
    write
        Writes into the model by index of variables, which is fast.
    costs
        Triples (index of a variable, cost, largest value), the objective so far.
    label_cost
        Cost of one unit of a distance label, 0 without any.
    hints
        Called with a design to start from, for the variables of requirements.
    tail
        Shape (k,). Decisions that follow the edges in a design, such as rooms; those that are in
        `further` count as they are solved.
    further
        Variable of each open decision of `tail`.
    """

    def __init__(
        self,
        index: Structure,
        free: Sequence[int],
        fixed: BoolArray,
        *,
        finest: int = FINEST,
        check: Optional[Callable[[], None]] = None,
    ) -> None:
        self.index = index
        self.free = list(free)
        self.fixed = fixed
        self.finest = finest
        self.check: Callable[[], None] = check or (lambda: None)
        self.model: Any = cp_model().CpModel()
        self.write = Writer(self.model)
        self._on: list[bool] = fixed.tolist()
        self.expression: Any = cp_model().LinearExpr
        self.costs: list[tuple[int, float, int]] = []
        self.label_cost = 0.0
        self.constant = 0.0
        self.slack: dict[int, Literal] = {}
        self.hints: list[Callable[[BoolArray], None]] = []
        self.tail: BoolArray = np.zeros(0, dtype=bool)
        self.further: dict[int, Any] = {}
        self.edge: dict[int, Any] = {e: self.model.new_bool_var("") for e in self.free}
        # the indices of the same variables
        self.number: dict[int, int] = {e: x.index for e, x in self.edge.items()}
        self.vertices = sorted({v for e in self.free for v in index.ends[e]})
        self.vertex: dict[int, Literal] = {}
        self._add_vertices()
        self._add_required()

    def literal(self, edge: int) -> Literal:
        """Return the literal of any edge: of a free one its variable."""
        found = self.edge.get(edge)
        return self._on[edge] if found is None else found

    def negated(self, literal: Literal) -> Literal:
        """Return the negation of a literal."""
        return (not literal) if isinstance(literal, bool) else ~literal

    def clause(self, literals: Iterable[Literal]) -> None:
        """Demand that one of the literals holds."""
        self.check()
        kept = [a for a in literals if a is not False]
        if not any(a is True for a in kept):
            self.write.some_of([index_of(a) for a in kept])

    def cost(self, literal: Literal, weight: float) -> None:
        """Add a cost that is due if the literal holds."""
        if literal is True:
            self.constant += weight
        elif literal is not False:
            self.add_cost(literal, weight)

    def add_cost(self, variable: Any, cost: float, top: int = 1) -> None:
        """Add a cost per unit of a variable that has at most the value `top`."""
        self.costs.append((variable.index, cost, top))

    def _add_vertices(self) -> None:
        """Tie vertices to edges and forbid dead ends in the form that relaxes best."""
        index, model, write = self.index, self.model, self.write
        for v in self.vertices:
            self.check()
            mine = index.incident[v]
            xs = [self.number[e] for e in mine if e in self.number]
            if index.street[v] or any(self._on[e] for e in mine if e not in self.number):
                self.vertex[v] = True
                continue
            self.vertex[v] = active = model.new_bool_var("")
            for x in xs:
                write.implies(x, active.index)
            if index.two[v]:
                write.at_least([*xs, active.index], [1] * len(xs) + [-2], 0)
            else:
                write.some_of([*xs, -1 - active.index])

    def _add_required(self) -> None:
        """Demand the required edges and put the length costs into the objective."""
        for e in self.free:
            self.cost(self.edge[e], self.index.cost[e])
            if self.index.problem.required[e]:
                self.clause([self.edge[e]])

    def add_terms(self, terms: Iterable[Term]) -> None:
        """Add local rules, patterns and clauses."""
        for term in terms:
            self.check()
            tried = [self._body(on, off) for on, off in term.alternatives]
            bodies = [body for body in tried if body is not None]
            if not bodies:
                continue
            if term.hard:
                for body in bodies:
                    self.write.some_of(body)
                continue
            if any(not body for body in bodies):
                self.constant += term.weight
                continue
            # the negation of a single literal needs no variable of its own
            if len(bodies) == 1 and len(bodies[0]) == 1:
                self.costs.append((-1 - bodies[0][0], term.weight, 1))
                continue
            due = self.write.whole(1)
            for body in bodies:
                self.write.some_of([*body, due])
            self.costs.append((due, term.weight, 1))

    def _body(self, on: Sequence[int], off: Sequence[int]) -> Optional[list[int]]:
        """Return literals of which one holds unless the alternative does; None: one does."""
        literals = []
        for e in on:
            x = self.number.get(e)
            if x is not None:
                literals.append(-1 - x)
            elif not self._on[e]:
                return None
        for e in off:
            x = self.number.get(e)
            if x is not None:
                literals.append(x)
            elif self._on[e]:
                return None
        return literals

    def add_cover(self, cover: Iterable[tuple[int, tuple[int, ...]]]) -> None:
        """Demand coverage, with a slack where it is soft (CND eq. 6)."""
        penalty = self.index.problem.cover_penalty
        for v, ball in cover:
            self.check()
            literals = [self._active(u) for u in ball]
            if any(a is True for a in literals):
                self.slack[v] = False
                continue
            if math.isinf(penalty):
                self.slack[v] = False
                self.clause(literals)
                continue
            kept = [a for a in literals if a is not False]
            slack = self.model.new_bool_var("") if kept else True
            self.slack[v] = slack
            if kept:
                self.write.some_of([index_of(a) for a in (*kept, slack)])
            self.cost(slack, penalty)

    def _active(self, v: int) -> Literal:
        """Return the literal of any vertex."""
        found = self.vertex.get(v)
        if found is not None:
            return found
        return self.index.street[v] or any(self._on[e] for e in self.index.incident[v])

    def add_cuts(self, cuts: Iterable[BallCut]) -> None:
        """Add ball-exit inequalities whose coverage slack is known."""
        for cut in cuts:
            self.check()
            parts: list[tuple[Literal, int]] = [(self.literal(e), cut.weight) for e in cut.exits]
            parts += [(self.literal(e), 1) for e in cut.inside]
            parts.append((self.slack.get(cut.vertex, False), cut.rhs))
            if cut.ring:
                parts.append((self._all_of(cut.ring), cut.weight))
            known = sum(w for literal, w in parts if literal is True)
            if known >= cut.rhs:
                continue
            kept = [(literal, w) for literal, w in parts if not isinstance(literal, bool)]
            indices, weights = [a.index for a, _ in kept], [w for _, w in kept]
            self.write.at_least(indices, weights, cut.rhs - known)

    def add_requirements(self) -> None:
        """Add what is asked of the network as a whole."""
        for requirement in self.index.problem.requirements:
            self.check()
            requirement.add_to_cp(self)

    def _all_of(self, edges: Sequence[int]) -> Literal:
        """Return a literal that holds only if all edges are chosen."""
        literals = [self.literal(e) for e in edges]
        if any(a is False for a in literals):
            return False
        kept = [a for a in literals if a is not True]
        if not kept:
            return True
        both = self.model.new_bool_var("")
        for a in kept:
            self.write.implies(both.index, index_of(a))
        return both

    def minimise(self) -> float:
        """Set the objective; return the factor that its whole numbers are multiples of."""
        scale = self._scale()
        self.write.minimise((index, whole(cost, scale)) for index, cost, _ in self.costs)
        return scale

    def _scale(self) -> float:
        """Return a factor that makes costs whole, or nearly so where they are too many kinds."""
        exact = whole_scale((cost for _, cost, _ in self.costs), self.finest)
        if exact < self.finest:
            return exact
        least = min((cost for _, cost, top in self.costs if cost > 0 and top == 1), default=1.0)
        scale = self.finest / min(1.0, least)
        if self.label_cost > 0:
            # labels are many and long: their cost stays exact
            scale = max(1.0, math.ceil(scale * self.label_cost - 1e-9)) / self.label_cost
        return min(scale, LARGEST / max(1.0, math.fsum(cost * top for _, cost, top in self.costs)))

    def chosen(self, value: Callable[[Any], Any]) -> BoolArray:
        """Return the design, edges first and `tail` after them, given the value of literals."""
        design = np.concatenate([self.fixed, self.tail])
        for e, x in self.edge.items():
            design[e] = bool(value(x))
        here = len(self.fixed)
        for i, x in self.further.items():
            design[here + i] = bool(value(x))
        return design

    def hint(self, active: BoolArray) -> None:
        """Suggest a design to start from."""
        on: list[bool] = active.tolist()
        self.write.suggest(self.number.values(), (int(on[e]) for e in self.number))
        open_ = [(v, a.index) for v, a in self.vertex.items() if not isinstance(a, bool)]
        incident = self.index.incident
        touched = (int(any(on[e] for e in incident[v])) for v, _ in open_)
        self.write.suggest((i for _, i in open_), touched)
        here = len(self.fixed)
        indices = (x.index for x in self.further.values())
        self.write.suggest(indices, (int(on[here + i]) for i in self.further))
        for tell in self.hints:
            tell(active)
