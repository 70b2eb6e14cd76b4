"""Bridges of a street network: edges whose removal cuts a part off from the sinks.

Existing streets are two-way and all sinks are one place: both are contracted before bridges
are looked for. By Robbins' theorem the streets of a connected network can be made one-way such
that every vertex reaches a sink and is reached from one if and only if this *merged graph* has
no bridge (H. E. Robbins, A theorem on graphs, with an application to a problem of traffic
control, 1939; with two-way streets: F. Boesch and R. Tindell, 1980).
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ..problem import BoolArray, IntArray, NetworkProblem

#: Nodes of problems that were asked for before; they depend on nothing that a design changes.
_KNOWN: WeakKeyDictionary[NetworkProblem, IntArray] = WeakKeyDictionary()


def merged_nodes(problem: NetworkProblem) -> IntArray:
    """Return the node of each vertex when existing edges and all sinks are contracted.

    Parameters
    ----------
    problem
        The problem.

    Returns
    -------
    IntArray
        Shape (n,), numbers from 0. Sinks and all that existing edges connect with them have
        the number 0 where there is any sink; without one, 0 is a number like any other.
    """
    found = _KNOWN.get(problem)
    if found is None:
        found = _merge(problem)
        found.setflags(write=False)
        _KNOWN[problem] = found
    return found


def _merge(problem: NetworkProblem) -> IntArray:
    """Contract existing edges and sinks."""
    n = len(problem.mesh.vertices)
    sinks = np.flatnonzero(problem.sinks)
    tied = np.column_stack([sinks[:-1], sinks[1:]])
    pairs = np.vstack([problem.mesh.edges[problem.existing], tied])
    matrix = csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(matrix, directed=False)
    nodes: IntArray = label.astype(np.int64)
    if len(sinks):
        root = int(nodes[sinks[0]])
        nodes = np.where(nodes == root, 0, np.where(nodes == 0, root, nodes))
    return nodes


def bridges(count: int, pairs: IntArray) -> tuple[BoolArray, list[int]]:
    """Find the bridges and the 2-edge-connected components of a multigraph, in linear time.

    A breadth-first forest is grown; every other edge covers the way between its ends in the
    forest, and what is covered is contracted. Edges of the forest that stay are the bridges.

    Parameters
    ----------
    count
        Number of nodes.
    pairs
        Shape (k, 2). Nodes of each edge; parallel edges and loops are allowed and no bridges.

    Returns
    -------
    BoolArray
        Shape (k,). Whether each edge is a bridge.
    list of int
        For each node, one node of its 2-edge-connected component, the same for all of them.

    Examples
    --------
    >>> found, part = bridges(4, np.array([[0, 1], [1, 2], [2, 0], [2, 3]]))
    >>> found.tolist(), [p == part[0] for p in part]
    ([False, False, False, True], [True, True, True, False])
    """
    ends: list[list[int]] = pairs.tolist()
    around: list[list[int]] = [[] for _ in range(count)]
    for e, (a, b) in enumerate(ends):
        around[a].append(e)
        around[b].append(e)
    parent, depth = [-1] * count, [-1] * count
    entry = [-1] * count
    closing: list[int] = []
    for start in range(count):
        if depth[start] >= 0 or not around[start]:
            continue
        depth[start] = 0
        queue = [start]
        for v in queue:
            mine, below = entry[v], depth[v] + 1
            for e in around[v]:
                if e == mine:
                    continue
                a, b = ends[e]
                w = a if b == v else b
                if depth[w] < 0:
                    depth[w], parent[w], entry[w] = below, v, e
                    queue.append(w)
                elif entry[w] != e:
                    closing.append(e)
    part = list(range(count))
    _cover(part, parent, depth, [ends[e] for e in closing])
    found = np.zeros(len(ends), dtype=bool)
    found[[entry[v] for v in range(count) if parent[v] >= 0 and part[v] == v]] = True
    return found, [_top(part, v) for v in range(count)]


def _cover(part: list[int], parent: list[int], depth: list[int], pairs: list[list[int]]) -> None:
    """Contract the ways in the forest between the ends of each pair, in place."""
    for a, b in pairs:
        p, q = _top(part, a), _top(part, b)
        while p != q:
            if depth[p] < depth[q]:
                p, q = q, p
            part[p] = parent[p]
            p = _top(part, p)


def _top(part: list[int], v: int) -> int:
    """Return the highest vertex of the component that a vertex is in so far."""
    while part[v] != v:
        part[v] = part[part[v]]
        v = part[v]
    return v


def robbins(count: int, pairs: list[tuple[int, int]]) -> list[int]:
    """Direct the edges of a multigraph by depth-first search from node 0 (Robbins' theorem).

    Edges of the search tree lead away from its root, all others back. Where no edge is a
    bridge, and where bridges are then taken as two-way, every component becomes strongly
    connected.

    Parameters
    ----------
    count
        Number of nodes.
    pairs
        Nodes of each edge.

    Returns
    -------
    list of int
        +1 from the first node of an edge to the second, -1 back.
    """
    around: list[list[int]] = [[] for _ in range(count)]
    for e, (a, b) in enumerate(pairs):
        around[a].append(e)
        around[b].append(e)
    sign = [0] * len(pairs)
    reached = [False] * count
    for start in range(count):
        if reached[start]:
            continue
        reached[start] = True
        stack = [(start, iter(around[start]))]
        while stack:
            v, edges = stack[-1]
            e = next(edges, -1)
            if e < 0:
                stack.pop()
            elif not sign[e]:
                a, b = pairs[e]
                sign[e] = 1 if a == v else -1
                other = b if a == v else a
                if not reached[other]:
                    reached[other] = True
                    stack.append((other, iter(around[other])))
    return sign


def design_bridges(problem: NetworkProblem, active: BoolArray) -> BoolArray:
    """Find the chosen edges that are bridges of the merged graph.

    Parameters
    ----------
    problem
        The problem.
    active
        Shape (e,). Chosen edges.

    Returns
    -------
    BoolArray
        Shape (e,).
    """
    node = merged_nodes(problem)
    chosen = np.flatnonzero(active & ~problem.existing)
    found = np.zeros(len(active), dtype=bool)
    if len(chosen):
        found[chosen] = bridges(len(node), node[problem.mesh.edges[chosen]])[0]
    return found
