"""The network problem as a mixed-integer program: flow connectivity and ball-exit rows.

The paper's variables per half-edge (CND eq. 1-6) are replaced by one flow: every active vertex
sends one unit to the sinks over chosen edges. The flow connects, and its cost is the sum of
the shortest distances, so that no distance variables are needed.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Optional

import numpy as np

from ...mip.linear import LinearModel
from ..cuts.balls import ball_cuts
from ..local import Term
from ..problem import BoolArray
from ..structure import Structure


@dataclass(eq=False)
class NetworkModel:
    """A mixed-integer program of a network problem.

    Attributes
    ----------
    index
        The problem.
    linear
        The program.
    edge, vertex
        Variables of usable edges and of free vertices.
    slack
        Variable per vertex whose coverage is soft.
    exact
        Whether requirements must be exact; else they may leave out what only costs time where
        bounds are all that is wanted.
    """

    index: Structure
    linear: LinearModel
    edge: dict[int, Any] = field(default_factory=dict)
    vertex: dict[int, Any] = field(default_factory=dict)
    slack: dict[int, Any] = field(default_factory=dict)
    exact: bool = True

    def chosen(self, values: dict[str, float]) -> BoolArray:
        """Return the chosen edges of a solution, given the values by name of variable."""
        active = np.zeros(len(self.index.ends), dtype=bool)
        for e, x in self.edge.items():
            active[e] = values.get(x.name, 0.0) > 0.5
        return active


def flow_model(
    index: Structure,
    *,
    cuts: bool = True,
    flow: bool = True,
    exact: bool = True,
    fixed: Optional[dict[int, bool]] = None,
    further: Optional[Callable[[NetworkModel], None]] = None,
    check: Optional[Callable[[], None]] = None,
) -> NetworkModel:
    """Build the flow model.

    Parameters
    ----------
    index
        The problem.
    cuts
        Add ball-exit inequalities; see `balls`.
    flow
        Demand connection to sinks and count distances. Without it the model is a relaxation.
    exact
        See `NetworkModel`; False gives a relaxation where there are requirements.
    fixed
        Edges that are decided already, for instance outside a window.
    further
        Adds what else belongs to the model, such as rooms.
    check
        Called often while the model is built; may raise an error to end that.

    Returns
    -------
    NetworkModel
    """
    model = start_model(index, check)
    model.exact = exact and flow
    linear = model.linear
    add_rules(model)
    for e, value in (fixed or {}).items():
        linear.row([(model.edge[e], 1.0)], low=float(value), high=float(value))
    if further is not None:
        further(model)
    if cuts:
        _add_cuts(model, check)
    if flow:
        _add_flow(model)
    linear.finish()
    return model


def start_model(
    index: Structure,
    check: Optional[Callable[[], None]] = None,
    linear: Optional[LinearModel] = None,
) -> NetworkModel:
    """Return a model with edges, vertices, length costs and required edges only."""
    model = NetworkModel(index, linear or LinearModel("network", check))
    model.linear.constant = index.fixed
    for e in index.edges:
        model.edge[e] = model.linear.binary(index.cost[e])
        if index.problem.required[e]:
            model.linear.row([(model.edge[e], 1.0)], low=1.0)
    for v in index.free:
        model.vertex[v] = model.linear.binary()
    return model


def add_rules(model: NetworkModel) -> None:
    """Add all but connection and distances: degrees, local rules, coverage, requirements."""
    index, linear = model.index, model.linear
    for v in index.free:
        xs = [(model.edge[e], 1.0) for e in index.incident[v]]
        y = model.vertex[v]
        for x, _ in xs:
            linear.row([(x, 1.0), (y, -1.0)], high=0.0)
        linear.row([*xs, (y, -2.0 if index.two[v] else -1.0)], low=0.0)
        exempt = index.problem.sinks[v]
        if math.isinf(index.problem.branches) and not exempt:
            linear.row(xs, high=2.0)
    # what the rows above say already
    implied = {"dead end", "branch"}
    add_terms(model, (t for t in index.terms if not (t.hard and t.kind in implied)))
    add_cover(model)
    for requirement in index.problem.requirements:
        requirement.add_to_mip(model)


def add_terms(model: NetworkModel, terms: Iterable[Term]) -> None:
    """Add local rules, patterns and clauses: a broken one costs or is forbidden."""
    for term in terms:
        due = None if term.hard else model.linear.real(1.0, term.weight)
        for on, off in term.alternatives:
            row = [(model.edge[e], -1.0) for e in on] + [(model.edge[e], 1.0) for e in off]
            if due is not None:
                row.append((due, 1.0))
            model.linear.row(row, low=1.0 - len(on))


def add_cover(model: NetworkModel) -> None:
    """Add coverage (CND eq. 6) with a slack where it is soft."""
    penalty = model.index.problem.cover_penalty
    for v, ball in model.index.cover:
        row = [(model.vertex[u], 1.0) for u in ball]
        if not math.isinf(penalty):
            model.slack[v] = model.linear.real(1.0, penalty)
            row.append((model.slack[v], 1.0))
        model.linear.row(row, low=1.0)


def _add_cuts(model: NetworkModel, check: Optional[Callable[[], None]]) -> None:
    """Add the ball-exit inequalities."""
    for cut in ball_cuts(model.index, check):
        row = [(model.edge[e], float(cut.weight)) for e in cut.exits]
        row += [(model.edge[e], 1.0) for e in cut.inside]
        if cut.ring:
            ring = model.linear.real(1.0)
            for e in cut.ring:
                model.linear.row([(ring, 1.0), (model.edge[e], -1.0)], high=0.0)
            row.append((ring, float(cut.weight)))
        if cut.vertex in model.slack:
            row.append((model.slack[cut.vertex], float(cut.rhs)))
        model.linear.row(row, low=float(cut.rhs))


def _add_flow(model: NetworkModel) -> None:
    """Let every active vertex send a unit to a sink; its cost is the distance."""
    index, problem = model.index, model.index.problem
    counted = index.with_distance
    # without distances everything that is connected to a sink is as good as one
    ends = problem.sinks.tolist() if counted else index.root
    demand: dict[int, list[Any]] = defaultdict(list)
    for v in index.free:
        if not ends[v]:
            demand[v].append(model.vertex[v])
    # an edge between streets without a sink has no vertex that would ask for a way out
    links: dict[int, list[Any]] = defaultdict(list)
    for e in index.edges:
        u, v = index.ends[e]
        if all(index.street[w] and not index.root[w] for w in (u, v)):
            links[u].append(model.edge[e])
    if counted:
        _commodity(model, demand, ends, problem.weight_distance)
        if links:
            _commodity(model, links, ends, 0.0)
    else:
        for v, variables in links.items():
            demand[v] += variables
        _commodity(model, demand, ends, 0.0)


def _commodity(
    model: NetworkModel, demand: dict[int, list[Any]], ends: list[bool], price: float
) -> None:
    """Add a flow from the demands to the ends, at `price` per length."""
    index, problem, linear = model.index, model.index.problem, model.linear
    most = float(sum(len(variables) for variables in demand.values()))
    balance: dict[int, list[tuple[Any, float]]] = defaultdict(list)
    arcs: list[tuple[int, Optional[Any]]] = list(model.edge.items())
    arcs += [(e, None) for e in np.flatnonzero(problem.existing).tolist()]
    for e, x in arcs:
        u, v = index.ends[e]
        for a, b in ((u, v), (v, u)):
            if ends[a] or math.isinf(index.reach[a]):
                continue
            flow = linear.real(most, price * float(problem.length[e]))
            balance[a].append((flow, 1.0))
            if not ends[b]:
                balance[b].append((flow, -1.0))
            if x is not None:
                linear.row([(flow, 1.0), (x, -most)], high=0.0)
    for v, row in balance.items():
        linear.row([*row, *((y, -1.0) for y in demand.get(v, ()))], low=0.0, high=0.0)
    for v in demand:
        if v not in balance:
            linear.row([(y, 1.0) for y in demand[v]], high=0.0)
