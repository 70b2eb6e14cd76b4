"""Two ways and one-way streets, checked on their own with networkx."""

from __future__ import annotations

import networkx as nx

from ..problem import BoolArray, IntArray, NetworkProblem
from ..requirements.twoways import TwoWays
from .facts import Facts, Violation, facts_of


def check_two_ways(
    requirement: TwoWays,
    problem: NetworkProblem,  # noqa: ARG001
    facts: Facts,
) -> list[Violation]:
    """Check that no chosen edge alone holds a part to the sinks."""
    streets = nx.Graph()
    # a place of its own in the middle of each street, so that none runs beside another
    for e in facts.on:
        if facts.sinks.issuperset(facts.ends[e]):
            continue
        for v in facts.ends[e]:
            streets.add_edge(("street", e), "sink" if v in facts.sinks else v)
            if e in facts.existing:
                # nobody closes it: a second way along it
                streets.add_edge(("beside", e), "sink" if v in facts.sinks else v)
    single = {a if isinstance(a, tuple) else b for a, b in nx.bridges(streets)}
    found = []
    for e in sorted(e for kind, e in single if kind == "street"):
        text = f"If street edge {e} is closed or made one-way, a part is cut off from the sinks."
        found.append(Violation(requirement.kind, text, (e,), facts.ends[e], requirement.hard))
    return found


def check_directions(
    problem: NetworkProblem, active: BoolArray, direction: IntArray
) -> list[Violation]:
    """List vertices of streets without a way to a sink, or from one, along the directions.

    Parameters
    ----------
    problem
        What was asked.
    active
        Shape (e,). Chosen edges.
    direction
        Shape (e,). As `orientation.Orientation` has it; existing streets must be two-way.

    Returns
    -------
    list of Violation
        Kinds "no way out", "no way in" and "direction" (of an edge that is no new street).
    """
    facts = facts_of(problem, active)
    arcs = nx.DiGraph()
    arcs.add_nodes_from(facts.lively | facts.sinks)
    found = []
    for e, (u, v) in facts.ends.items():
        if direction[e] and e not in facts.chosen:
            text = f"Mesh edge {e} has a direction, but is no new street."
            found.append(Violation("direction", text, (e,), (u, v)))
        if e in facts.on:
            arcs.add_edges_from([(u, v)] if direction[e] >= 0 else [])
            arcs.add_edges_from([(v, u)] if direction[e] <= 0 else [])
    for kind, text, graph in (
        ("no way in", "No sink leads to vertex {} along the one-way streets.", arcs),
        ("no way out", "Vertex {} leads to no sink along the one-way streets.", arcs.reverse()),
    ):
        reached = set(facts.sinks)
        for s in facts.sinks:
            reached |= nx.descendants(graph, s)
        for v in sorted(facts.lively - reached):
            found.append(Violation(kind, text.format(v), (), (v,)))
    return found
