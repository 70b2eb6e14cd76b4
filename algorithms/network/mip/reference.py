"""The paper's own integer program, kept for tests and benchmarks (CND equations 1-6, 9-14).

One 0-1 variable per half-edge and per pair of successive half-edges, one distance per
half-edge. Open solvers prove next to nothing with it; `model` says the same with a flow. The
equations are those of the paper with these additions: existing edges are active from the
start; half-edges that leave a sink are left out, since nothing needs them; equation 10 is also
demanded of the edge itself, since with one active half-edge only the literal form leaves the
other end unchecked. What is asked of the network as a whole beyond links is not in the paper
and is written as in `model`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Optional

import numpy as np

from ...mip.linear import LinearModel
from ..local import Term
from ..requirements.links import Link
from ..structure import Structure
from .model import NetworkModel, add_cover
from .reference_links import add_paths

HalfEdge = tuple[int, int]


@dataclass(eq=False)
class _Halves:
    """Variables of the half-edges."""

    active: dict[HalfEdge, Any] = field(default_factory=dict)
    distance: dict[HalfEdge, Any] = field(default_factory=dict)
    edge: dict[HalfEdge, int] = field(default_factory=dict)


def reference_model(
    index: Structure, further: Optional[Callable[[NetworkModel], None]] = None
) -> NetworkModel:
    """Build the paper's model.

    Its distance term is the sum of the distance values of half-edges, not of vertices, so that
    for a positive `weight_distance` its optimum may be another design than that of `model`.

    Parameters
    ----------
    index
        The problem.
    further
        Adds what else belongs to the model, such as rooms.

    Returns
    -------
    NetworkModel
    """
    model = NetworkModel(index, LinearModel("reference"))
    linear = model.linear
    linear.constant = index.fixed
    for e in index.edges:
        model.edge[e] = linear.binary(index.cost[e])
        if index.problem.required[e]:
            linear.row([(model.edge[e], 1.0)], low=1.0)
    halves = _half_edges(model)
    _no_islands(model, halves)
    for v in index.free:
        # equation 5
        model.vertex[v] = linear.binary()
        count = float(len(index.incident[v]))
        row = [(model.edge[e], 1.0) for e in index.incident[v]]
        linear.row([*row, (model.vertex[v], -count)], low=1.0 - count, high=0.0)
    add_cover(model)  # equation 6
    _no_dead_ends(model, halves)
    for term in index.terms:
        if not (term.hard and term.kind == "dead end"):
            _configuration(model, term)
    for requirement in index.problem.requirements:
        if isinstance(requirement, Link):
            add_paths(model, requirement)
        else:
            requirement.add_to_mip(model)
    if further is not None:
        further(model)
    linear.finish()
    return model


def _half_edges(model: NetworkModel) -> _Halves:
    """Add the half-edges and equation 4."""
    index, problem, linear = model.index, model.index.problem, model.linear
    existing = np.flatnonzero(problem.existing).tolist()
    total = 2.0 * float(problem.length[index.edges].sum() + problem.length[existing].sum())
    halves = _Halves()
    for e in [*index.edges, *existing]:
        u, v = index.ends[e]
        both = []
        for i, j in ((u, v), (v, u)):
            if problem.sinks[i] and not problem.sinks[j]:
                continue
            price = 0.0 if problem.existing[e] else problem.weight_distance
            halves.active[i, j] = linear.binary()
            halves.distance[i, j] = linear.real(total, price)
            halves.edge[i, j] = e
            both.append((halves.active[i, j], 1.0))
        if e in model.edge:
            linear.row([*both, (model.edge[e], -2.0)], low=-1.0, high=0.0)
            if len(both) == 1:
                linear.row([*both, (model.edge[e], -1.0)], low=0.0, high=0.0)
    return halves


def _no_islands(model: NetworkModel, halves: _Halves) -> None:
    """Add equations 1 to 3."""
    problem, linear = model.index.problem, model.linear
    out: dict[int, list[int]] = {}
    for i, j in halves.active:
        out.setdefault(i, []).append(j)
    total = 2.0 * float(problem.length[list(halves.edge.values())].sum())
    for (i, j), active in halves.active.items():
        if problem.sinks[j]:
            continue
        length = float(problem.length[halves.edge[i, j]])
        row = [(active, 1.0)]
        for k in out.get(j, []):
            if k == i:
                continue
            succeeds = linear.binary()
            linear.row([(succeeds, 1.0), (halves.active[j, k], -1.0)], high=0.0)
            parts = [(halves.distance[j, k], 1.0), (halves.distance[i, j], -1.0)]
            linear.row([*parts, (succeeds, total)], high=total - length)
            row.append((succeeds, -1.0))
        linear.row(row, high=0.0)


def _no_dead_ends(model: NetworkModel, halves: _Halves) -> None:
    """Add equations 9 and 10."""
    index, linear = model.index, model.linear
    for e in index.edges:
        for i, j in (index.ends[e], index.ends[e][::-1]):
            if not index.two[j]:
                continue
            others = [model.edge[g] for g in index.incident[j] if g != e]
            count = float(len(others))
            if not others:
                linear.row([(model.edge[e], 1.0)], high=0.0)
                continue
            goes_on = linear.binary()
            row = [(x, 1.0) for x in others]
            linear.row([*row, (goes_on, -count)], low=1.0 - count, high=0.0)
            if (i, j) in halves.active:
                linear.row([(halves.active[i, j], 1.0), (goes_on, -1.0)], high=0.0)
            linear.row([(model.edge[e], 1.0), (goes_on, -1.0)], high=0.0)


def _configuration(model: NetworkModel, term: Term) -> None:
    """Add an undesirable configuration as equations 12 and 13 do.

    With n edges, of which m must be off, and Z the indicator,
    ``0 <= sum on + sum (1 - off) - n Z <= n - 1``; forbidden ones have Z = 0. A term with
    several alternatives costs once: it has one indicator more, above all the others.
    """
    linear = model.linear
    shared = None
    if not math.isinf(term.weight) and len(term.alternatives) > 1:
        shared = linear.binary(term.weight)
    for on, off in term.alternatives:
        count = float(len(on) + len(off))
        parts = [(model.edge[e], 1.0) for e in on] + [(model.edge[e], -1.0) for e in off]
        if math.isinf(term.weight):
            linear.row(parts, high=count - 1.0 - len(off))
            continue
        present = linear.binary(term.weight if shared is None else 0.0)
        linear.row([*parts, (present, -count)], low=-float(len(off)), high=count - 1.0 - len(off))
        if shared is not None:
            linear.row([(present, 1.0), (shared, -1.0)], high=0.0)
