"""Is a design what was asked for? Written on its own, to check what model and search do.

Nothing here is shared with the solvers: faces, turns and distances are worked out again from
the mesh's faces, with plain sets and networkx.
"""

from __future__ import annotations

import math

import networkx as nx

from ..problem import BoolArray, NetworkProblem
from .facts import Facts, Violation, facts_of
from .requirements import check_one, check_requirements


def check_design(problem: NetworkProblem, active: BoolArray) -> list[Violation]:
    """List every place where a design breaks a rule, soft rules included.

    Parameters
    ----------
    problem
        What was asked.
    active
        Shape (e,). Chosen edges.

    Returns
    -------
    list of Violation
        Rules with weight 0 are not checked. A design is valid if no violation is `hard`.
    """
    facts = facts_of(problem, active)
    found = _check_edges(problem, facts) + _check_islands(facts) + _check_cover(problem, facts)
    found += _check_vertices(problem, facts) + _check_quads(problem, facts)
    found += _check_wishes(problem, facts)
    return found + check_requirements(problem, facts)


def design_distances(problem: NetworkProblem, active: BoolArray) -> dict[int, float]:
    """Return the shortest network distance to a sink of every vertex that has one."""
    facts = facts_of(problem, active)
    streets = nx.Graph()
    streets.add_nodes_from(facts.sinks)
    for e in facts.on:
        streets.add_edge(*facts.ends[e], length=float(problem.length[e]))
    if not facts.sinks:
        return {}
    found = nx.multi_source_dijkstra_path_length(streets, facts.sinks, weight="length")
    return {int(v): float(d) for v, d in found.items()}


def design_cost(problem: NetworkProblem, active: BoolArray) -> float:
    """Return the objective of a design from first principles; infinite if it is not valid."""
    facts = facts_of(problem, active)
    violations = check_design(problem, active)
    if any(v.hard for v in violations):
        return math.inf
    price = {
        "uncovered": problem.cover_penalty,
        "dead end": problem.dead_ends,
        "branch": problem.branches,
        "zigzag": problem.zigzags,
        "too close": problem.too_close,
        "T-junction": problem.t_junctions,
    }
    cost = sum(
        problem.weight_length * float(problem.edge_factor[e]) * float(problem.length[e])
        for e in facts.chosen
    )
    cost += sum(price[v.kind] for v in violations if v.kind in price)
    for pattern in problem.patterns:
        if facts.on.issuperset(pattern.on) and not facts.on.intersection(pattern.off):
            cost += pattern.weight
    for clause in problem.clauses:
        if not facts.on.intersection(clause.edges):
            cost += clause.penalty
    for requirement in problem.requirements:
        cost += math.fsum(requirement.penalty for _ in check_one(requirement, problem, facts))
    if problem.weight_distance:
        far = design_distances(problem, active)
        counted = facts.lively - facts.sinks - facts.old
        cost += problem.weight_distance * sum(far[v] for v in counted)
    return float(cost)


def _check_edges(problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """Check that chosen edges may be chosen and required ones are."""
    found = []
    for e in sorted(facts.chosen):
        if not problem.candidate[e] or e in facts.existing:
            text = f"Mesh edge {e} is a street, but no street may be there."
            found.append(Violation("barred", text, (e,), facts.ends[e]))
    for e, wanted in enumerate(problem.required):
        if wanted and e not in facts.chosen:
            text = f"Mesh edge {e} was required to be a street."
            found.append(Violation("required", text, (e,), facts.ends[e]))
    return found


def _check_islands(facts: Facts) -> list[Violation]:
    """Check that all chosen streets reach a sink (CND C1)."""
    streets = nx.Graph()
    streets.add_edges_from(facts.ends[e] for e in facts.on)
    found = []
    for piece in nx.connected_components(streets):
        if piece & facts.sinks:
            continue
        lost = sorted(e for e in facts.chosen if facts.ends[e][0] in piece)
        if lost:
            text = f"{len(lost)} street edges have no way to a sink."
            found.append(Violation("island", text, tuple(lost), tuple(sorted(piece))))
    return found


def _check_cover(problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """Check coverage (CND C2)."""
    if problem.cover_penalty == 0:
        return []
    active = facts.lively | facts.old
    hard = math.isinf(problem.cover_penalty)
    return [
        Violation("uncovered", f"Vertex {v} is too far from any street.", (), (v,), hard)
        for v, near in problem.cover.items()
        if not active.intersection(near)
    ]


def _check_vertices(problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """Check dead ends, branches and T-junctions (CND L2 i, ii, iv)."""
    valence: dict[int, int] = {}
    at: dict[int, list[int]] = {}
    for e, pair in facts.ends.items():
        for v in pair:
            valence[v] = valence.get(v, 0) + 1
            if e in facts.chosen:
                at.setdefault(v, []).append(e)
    old = facts.old
    found = []

    def note(kind: str, text: str, v: int, weight: float) -> None:
        if weight > 0:
            edges = tuple(at[v])
            found.append(Violation(kind, text, edges, (v,), math.isinf(weight)))

    for v in sorted(set(at) - old):
        count = len(at[v])
        if count == 3 and valence[v] == 4:
            note("T-junction", f"T-junction at vertex {v}.", v, problem.t_junctions)
        if v in facts.sinks:
            continue
        if count == 1:
            note("dead end", f"Street ends at vertex {v}.", v, problem.dead_ends)
        if count >= 3:
            note("branch", f"{count} streets meet at vertex {v}.", v, problem.branches)
    return found


def _check_quads(problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """Check zigzags and streets too close to each other (CND L2 iii)."""
    sides = [
        [facts.number[frozenset((quad[k], quad[(k + 1) % 4]))] for k in range(4)]
        for quad in facts.quads
    ]
    pairs = {frozenset((s[k], s[k + 2])) for s in sides for k in (0, 1)}
    found = []
    if problem.too_close > 0:
        for pair in sorted(tuple(sorted(p)) for p in pairs if p <= facts.chosen and len(p) == 2):
            text = f"Street edges {pair[0]} and {pair[1]} are too close to each other."
            hard = math.isinf(problem.too_close)
            found.append(Violation("too close", text, pair, (), hard))
    if problem.zigzags > 0:
        for triple in sorted(_zigzags(facts, sides)):
            text = f"Street edges {triple[0]}, {triple[1]} and {triple[2]} make a zigzag."
            hard = math.isinf(problem.zigzags)
            found.append(Violation("zigzag", text, triple, (), hard))
    return found


def _zigzags(facts: Facts, sides: list[list[int]]) -> set[tuple[int, int, int]]:
    """Find middle edges that turn into one face at one end and the other face at the other."""
    beside: dict[int, list[int]] = {}
    for f, edges in enumerate(sides):
        for e in edges:
            beside.setdefault(e, []).append(f)
    found = set()
    for e in facts.chosen:
        if len(beside[e]) != 2:
            continue
        f, g = beside[e]
        for u, v in (facts.ends[e], facts.ends[e][::-1]):
            first = [a for a in sides[f] if a != e and u in facts.ends[a]]
            last = [b for b in sides[g] if b != e and v in facts.ends[b]]
            for a in first:
                for b in last:
                    if a != b and {a, b} <= facts.chosen:
                        found.add((min(a, b), e, max(a, b)))
    return found


def _check_wishes(problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """Check clauses and patterns."""
    found = []
    for clause in problem.clauses:
        if clause.penalty > 0 and not facts.on.intersection(clause.edges):
            kind = clause.kind or "clause"
            text = f"None of {len(clause.edges)} edges is a street, one was asked for ({kind})."
            hard = math.isinf(clause.penalty)
            found.append(Violation(kind, text, tuple(clause.edges), (), hard))
    for pattern in problem.patterns:
        due = facts.on.issuperset(pattern.on) and not facts.on.intersection(pattern.off)
        if pattern.weight > 0 and due:
            kind = pattern.kind or "pattern"
            edges = (*pattern.on, *pattern.off)
            text = f"Street edges {edges} follow an unwanted pattern ({kind})."
            found.append(Violation(kind, text, edges, (), math.isinf(pattern.weight)))
    return found
