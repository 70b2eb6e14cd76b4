"""Are the links of a design there? Written on its own, with networkx."""

from __future__ import annotations

import math

import networkx as nx

from ..problem import NetworkProblem
from ..requirements.links import Link
from .facts import Facts, Violation


def check_link(link: Link, problem: NetworkProblem, facts: Facts) -> list[Violation]:
    """Check that streets join two vertices by a way that is short enough.

    Parameters
    ----------
    link
        What was asked.
    problem
        Tells the lengths of the edges.
    facts
        The design.

    Returns
    -------
    list of Violation
        One, or none.
    """
    streets = facts.chosen if link.private else facts.on
    graph: nx.Graph = nx.Graph()
    graph.add_nodes_from((link.start, link.end))
    for e in streets:
        u, v = facts.ends[e]
        graph.add_edge(u, v, far=1.0 if link.hops else float(problem.length[e]))
    if link.private:
        # where a street begins, ends or branches off no path without branches leads through
        closed = {v for v, count in graph.degree if count != 2} | facts.old
        graph.remove_nodes_from(closed - {link.start, link.end})
    try:
        far = nx.shortest_path_length(graph, link.start, link.end, weight="far")
    except nx.NetworkXNoPath:
        far = math.inf
    if far <= link.limit + 1e-5 * max(1.0, link.limit):
        return []
    return [_missing(link, far)]


def _missing(link: Link, far: float) -> Violation:
    """Say what is missing."""
    unit = "edges" if link.hops else "mesh edge lengths"
    way = "route without branches" if link.private else "way"
    text = f"There is no {way} from vertex {link.start} to vertex {link.end} of at most "
    text += f"{link.limit:.6g} {unit}"
    text += f"; the shortest is {far:.6g} long." if math.isfinite(far) else "."
    return Violation(link.kind, text, (), (link.start, link.end), link.hard)
