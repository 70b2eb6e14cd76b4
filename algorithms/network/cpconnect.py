"""Connection to sinks and distances in CP-SAT: every active vertex has a parent nearer by."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Any, Optional

import numpy as np
from scipy.sparse.csgraph import connected_components

from .cpmodel import CpNetwork, Literal, whole, whole_scale
from .structure import graph

#: Finest unit of distance labels, as a part of one unit of length.
FINEST_LENGTH = 10_000


def nodes(network: CpNetwork) -> tuple[list[int], dict[int, bool]]:
    """Contract existing and fixed streets.

    Returns
    -------
    list of int
        For each mesh vertex, its node: -1 if it is connected to a sink, else a number that
        the vertices of one piece share.
    dict
        For each node other than -1 that has chosen fixed edges: True, since it must be
        connected to a sink.
    """
    index = network.index
    fixed = network.fixed.copy()
    fixed[network.free] = False
    count, label = connected_components(graph(index.problem, fixed), directed=False)
    rooted = np.zeros(count, dtype=bool)
    rooted[label[index.problem.sinks]] = True
    node = np.where(rooted[label], -1, label)
    chosen_ends = index.problem.mesh.edges[fixed].ravel()
    return node.tolist(), {int(c): True for c in node[chosen_ends] if c >= 0}


def add_ranks(network: CpNetwork) -> None:
    """Connect every active node to a sink: a parent of smaller rank (after CND eq. 1-3).

    The rank takes the part of the paper's distance value, one label per vertex instead of one
    per half-edge.
    """
    index, model = network.index, network.model
    node, must = nodes(network)
    members: dict[int, list[int]] = defaultdict(list)
    for v in network.vertices:
        if node[v] >= 0:
            members[node[v]].append(v)
    on: dict[int, Literal] = {}
    for c, vertices in members.items():
        if c in must:
            on[c] = True
        elif len(vertices) == 1 and not index.street[vertices[0]]:
            on[c] = network.vertex[vertices[0]]
        else:
            on[c] = model.new_bool_var("")
            for e in {e for v in vertices for e in index.incident[v] if e in network.edge}:
                model.add_implication(network.edge[e], on[c])
    rank = {c: model.new_int_var(0, len(members), "") for c in on}
    parents: dict[int, list[Any]] = defaultdict(list)
    for e, x in network.edge.items():
        ends = node[index.ends[e][0]], node[index.ends[e][1]]
        if ends[0] == ends[1]:
            continue
        ways = []
        for a, b in (ends, ends[::-1]):
            if a < 0:
                continue
            if b < 0:
                # an edge to the root always serves as parent; no variable is needed
                parents[a].append(x)
                continue
            way = model.new_bool_var("")
            ways.append(way)
            model.add_implication(way, x)
            model.add(rank[a] >= rank[b] + 1).only_enforce_if(way)
            parents[a].append(way)
        if len(ways) == 2:
            model.add_at_most_one(ways)
    for c, literal in on.items():
        network.clause([*parents[c], network.negated(literal)], "connection to a sink")


def add_distances(network: CpNetwork, limit: Optional[float] = None) -> None:
    """Label every vertex of the whole problem with its distance to a sink and count it.

    Parameters
    ----------
    network
        A model with all usable edges free.
    limit
        No vertex may be farther from a sink, in units of length; None for what the mesh allows.
    """
    index, model, problem = network.index, network.model, network.index.problem
    unit = whole_scale(problem.length.tolist(), FINEST_LENGTH)
    far = float(problem.length[network.free].sum() + problem.length[problem.existing].sum())
    top = math.ceil(min(far, far if limit is None else limit) * unit) + 1
    streets = np.flatnonzero(np.array(index.street)).tolist()
    vertices = sorted({*network.vertices, *streets})
    label: dict[int, Any] = {}
    on: dict[int, Literal] = {}
    for v in vertices:
        if problem.sinks[v] or math.isinf(index.reach[v]):
            continue
        label[v] = model.new_int_var(0, top, "")
        on[v] = _labelled(network, v)
    parents: dict[int, list[Any]] = defaultdict(list)
    arcs: list[tuple[int, Optional[Any]]] = list(network.edge.items())
    arcs += [(e, None) for e in np.flatnonzero(problem.existing).tolist()]
    for e, x in arcs:
        _add_arc(network, e, x, label, on, parents, whole(float(problem.length[e]), unit))
    for v, literal in on.items():
        network.clause([*parents[v], network.negated(literal)], "connection to a sink")
        least = whole(index.reach[v], unit)
        # in linear form, since this is what the bound of the distance term rests on
        model.add(label[v] >= least * (1 if literal is True else literal))
        if not index.street[v]:
            network.costs.append((label[v], problem.weight_distance / unit))


def _labelled(network: CpNetwork, v: int) -> Literal:
    """Return whether a vertex needs a label: it is active, or a chosen edge meets its street."""
    index = network.index
    if not index.street[v]:
        return network.vertex[v]
    if index.root[v]:
        return True
    literal = network.model.new_bool_var("")
    for e in index.incident[v]:
        network.model.add_implication(network.edge[e], literal)
    return literal


def _add_arc(
    network: CpNetwork,
    edge: int,
    x: Optional[Any],
    label: dict[int, Any],
    on: dict[int, Literal],
    parents: dict[int, list[Any]],
    length: int,
) -> None:
    """Let each end of an edge be the parent of the other; x is None for existing edges."""
    model = network.model
    u, v = network.index.ends[edge]
    ways = []
    for a, b in ((u, v), (v, u)):
        if a not in label or (b not in label and not network.index.problem.sinks[b]):
            continue
        way = model.new_bool_var("")
        ways.append(way)
        parents[a].append(way)
        if x is not None:
            model.add_implication(way, x)
        if b in label:
            model.add(label[a] >= label[b] + length).only_enforce_if(way)
            if on[b] is not True:
                model.add_implication(way, on[b])
        else:
            model.add(label[a] >= length).only_enforce_if(way)
    if len(ways) == 2:
        model.add_at_most_one(ways)
