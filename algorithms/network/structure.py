"""A network problem made ready for solving: what is decided, removed; what is left, indexed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from .local import Term, fold, rule_terms
from .problem import BoolArray, FloatArray, NetworkProblem


@dataclass(frozen=True, eq=False)
class Structure:
    """Index of a `NetworkProblem` with n vertices and e edges, in plain lists for speed.

    Attributes
    ----------
    problem
        The problem.
    ends
        The two vertices of each edge.
    usable
        For each edge, whether a valid design may choose it.
    edges
        The usable edges.
    incident
        For each vertex, the usable edges there.
    street
        For each vertex, whether an existing edge touches it.
    root
        For each vertex, whether it is connected to a sink by existing edges or is one.
    node
        For each vertex, the vertex that stands for it when existing streets are contracted:
        -1 for roots, the least vertex of its component for other street vertices, else itself.
    free
        Vertices with usable edges and no street.
    two
        For each vertex, whether it must not have exactly one chosen edge.
    cost
        Length cost of each edge.
    reach
        For each vertex, least possible distance to a sink, infinite where there is none.
    cover
        For each vertex that is not covered for certain: (vertex, vertices that may cover it).
    terms
        Terms over usable edges.
    fixed
        Cost that every design has; with `strip`, what causes it is in neither list.
    conflicts
        Sentences that say why there is no valid design at all, or nothing.
    """

    problem: NetworkProblem
    ends: list[tuple[int, int]]
    usable: list[bool]
    edges: list[int]
    incident: list[list[int]]
    street: list[bool]
    root: list[bool]
    node: list[int]
    free: list[int]
    two: list[bool]
    cost: list[float]
    reach: list[float]
    cover: list[tuple[int, tuple[int, ...]]]
    terms: list[Term]
    fixed: float
    conflicts: list[str] = field(default_factory=list)

    @property
    def with_distance(self) -> bool:
        """Whether distances count in the objective."""
        return self.problem.weight_distance > 0

    def vertex_of(self, edge: int, vertex: int) -> int:
        """Return the other end of an edge."""
        u, v = self.ends[edge]
        return v if u == vertex else u


def graph(problem: NetworkProblem, chosen: BoolArray) -> csr_matrix:
    """Return the symmetric weighted graph of chosen and existing edges; weights are lengths."""
    start, end, edge = problem.mesh.directed_edges
    kept = (chosen | problem.existing)[edge]
    n = len(problem.mesh.vertices)
    row = np.zeros(n + 1, dtype=np.int32)
    np.cumsum(np.bincount(start[kept], minlength=n), out=row[1:])
    # a zero would count as no edge at all
    weights = np.maximum(problem.length[edge[kept]], 1e-12)
    return csr_matrix((weights, end[kept], row), shape=(n, n))


def sink_distance(problem: NetworkProblem, chosen: BoolArray) -> FloatArray:
    """Return the shortest distance to a sink by chosen and existing edges.

    Parameters
    ----------
    problem
        The problem.
    chosen
        Shape (e,).

    Returns
    -------
    FloatArray
        Shape (n,), in units of `NetworkProblem.length`, infinite where no sink is reached.
    """
    sinks = np.flatnonzero(problem.sinks)
    if not len(sinks):
        return np.full(len(problem.mesh.vertices), np.inf)
    found: FloatArray = dijkstra(graph(problem, chosen), indices=sinks, min_only=True)
    return found


def structure(
    problem: NetworkProblem,
    *,
    strip: bool = True,
    check: Optional[Callable[[], None]] = None,
) -> Structure:
    """Index a problem.

    Parameters
    ----------
    problem
        The problem.
    strip
        Drop candidate edges that no valid design can choose: those that reach no sink and,
        where dead ends are forbidden, those that lead nowhere. Without it every candidate
        edge is usable, as evaluation of any set of edges needs.
    check
        Called often; may raise an error to end the work.

    Returns
    -------
    Structure
    """
    ends = [(int(u), int(v)) for u, v in problem.mesh.edges]
    street_array = np.zeros(len(problem.mesh.vertices), dtype=bool)
    street_array[problem.mesh.edges[problem.existing].ravel()] = True
    street: list[bool] = street_array.tolist()
    node, root = _contract(problem, street_array)
    sinks: list[bool] = problem.sinks.tolist()
    may_end = [a or b for a, b in zip(sinks, street)]
    usable_array = problem.candidate.copy()
    reach = sink_distance(problem, usable_array)
    if strip:
        usable_array &= np.isfinite(reach[problem.mesh.edges]).all(axis=1)
        if math.isinf(problem.dead_ends):
            _strip_leaves(problem, usable_array, may_end)
    usable: list[bool] = usable_array.tolist()
    incident = [[e for e in around.tolist() if usable[e]] for around in problem.mesh.vertex_edges]
    conflicts: list[str] = []
    for e in np.flatnonzero(problem.required & ~usable_array)[:5].tolist():
        conflicts.append(f"required edge {e} cannot be part of any network with access to a sink")
    cover, uncovered = _cover(problem, street, incident)
    terms, always = _terms(problem, usable, check or (lambda: None))
    fixed = 0.0
    if strip:
        fixed = _settle(problem, uncovered, always, conflicts)
    else:
        cover += [(v, ()) for v in uncovered]
        terms += always
    return Structure(
        problem=problem,
        ends=ends,
        usable=usable,
        edges=np.flatnonzero(usable_array).tolist(),
        incident=incident,
        street=street,
        root=root,
        node=node,
        free=[v for v, mine in enumerate(incident) if mine and not street[v]],
        two=[math.isinf(problem.dead_ends) and not exempt for exempt in may_end],
        cost=(problem.weight_length * problem.edge_factor * problem.length).tolist(),
        reach=reach.tolist(),
        cover=cover,
        terms=terms,
        fixed=fixed,
        conflicts=conflicts,
    )


def _contract(problem: NetworkProblem, street: BoolArray) -> tuple[list[int], list[bool]]:
    """Find what each vertex is when existing streets are contracted; see `Structure.node`."""
    n = len(street)
    none = np.zeros(len(problem.existing), dtype=bool)
    count, label = connected_components(graph(problem, none), directed=False)
    rooted = np.zeros(count, dtype=bool)
    rooted[label[problem.sinks]] = True
    first = np.full(count, n, dtype=np.int64)
    np.minimum.at(first, label, np.arange(n))
    root = rooted[label]
    return np.where(root, -1, first[label]).tolist(), root.tolist()


def _strip_leaves(problem: NetworkProblem, usable: BoolArray, may_end: Sequence[bool]) -> None:
    """Drop edges that end at a vertex with no other edge, again and again, in place."""
    edges = problem.mesh.edges
    around = problem.mesh.vertex_edges
    degree = np.bincount(edges[usable].ravel(), minlength=len(around))
    stack = [v for v in np.flatnonzero(degree == 1).tolist() if not may_end[v]]
    while stack:
        v = stack.pop()
        for e in around[v].tolist():
            if not usable[e]:
                continue
            usable[e] = False
            for w in edges[e].tolist():
                degree[w] -= 1
                if degree[w] == 1 and not may_end[w]:
                    stack.append(w)


def _cover(
    problem: NetworkProblem, street: Sequence[bool], incident: Sequence[Sequence[int]]
) -> tuple[list[tuple[int, tuple[int, ...]]], list[int]]:
    """Reduce coverage to vertices that can be active; also list the vertices without any."""
    kept: list[tuple[int, tuple[int, ...]]] = []
    impossible: list[int] = []
    if problem.cover_penalty == 0:
        return kept, impossible
    for v, ball in problem.cover.items():
        if any(street[u] for u in ball):
            continue
        able = tuple(u for u in ball if incident[u])
        if able:
            kept.append((v, able))
        else:
            impossible.append(v)
    return kept, impossible


def _terms(
    problem: NetworkProblem, usable: list[bool], check: Callable[[], None]
) -> tuple[list[Term], list[Term]]:
    """Fold all terms; return those that depend on the design and those that are always due."""
    kept: list[Term] = []
    always: list[Term] = []
    for raw in rule_terms(problem):
        check()
        term = fold(raw, problem, usable)
        if term is not None:
            decided = any(not on and not off for on, off in term.alternatives)
            (always if decided else kept).append(term)
    return kept, always


def _settle(
    problem: NetworkProblem, uncovered: list[int], always: list[Term], conflicts: list[str]
) -> float:
    """Return the cost of what no design can avoid; note a conflict where that is forbidden."""
    if uncovered and math.isinf(problem.cover_penalty):
        conflicts.append(
            f"{len(uncovered)} vertices have no possible street within the coverage range "
            f"(the first is vertex {uncovered[0]})"
        )
    conflicts += [f"rule '{t.kind}' is broken whatever is chosen" for t in always if t.hard]
    cost = math.fsum(t.weight for t in always if not t.hard)
    if uncovered and not math.isinf(problem.cover_penalty):
        cost += len(uncovered) * problem.cover_penalty
    return cost
