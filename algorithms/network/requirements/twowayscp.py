"""Two ways in CP-SAT: directions of edges, a way out and a way in of every active node.

In a window, what fixed edges make 2-edge-connected is one node, and a way of fixed bridges is
one edge, so that the model is as small as the window.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from ..oneway.bridges import bridges, merged_nodes, robbins

if TYPE_CHECKING:
    from ..cp.model import CpNetwork, Literal
    from ..problem import BoolArray


def add_two_ways(network: CpNetwork, penalty: float) -> None:
    """Forbid bridges of the merged graph, or price them.

    Every free edge gets a direction, every active node a parent on a way out and one on a way
    in, each of smaller rank and along the directions. Edges that stay two-way are the bridges.

    Parameters
    ----------
    network
        A model of a whole problem or of a window.
    penalty
        Cost of each bridge; infinite forbids.
    """
    graph = _contract(network)
    if graph.lost and math.isinf(penalty):
        network.clause([])
        return
    if graph.lost:
        network.constant += penalty * graph.lost
    ways = _CpWays(network, graph, penalty)
    ways.add()
    network.hints.append(ways.hint)


@dataclass
class _Merged:
    """The part of the merged graph that a window decides; node 0 is where the sinks are.

    Attributes
    ----------
    node
        Node of each vertex.
    free
        (node, node, edge) of each edge to decide, without loops.
    stems
        (node, node, number of edges) of each way that is there and whose edges are all bridges
        unless free edges close a cycle.
    lost
        Number of edges that are bridges whatever is chosen.
    """

    node: list[int]
    free: list[tuple[int, int, int]]
    stems: list[tuple[int, int, int]]
    lost: int


def _contract(network: CpNetwork) -> _Merged:
    """Contract what fixed edges make 2-edge-connected, and ways of fixed bridges to one edge."""
    problem = network.index.problem
    first = merged_nodes(problem)
    fixed = network.fixed.copy()
    fixed[network.free] = False
    chosen = np.flatnonzero(fixed & ~problem.existing)
    pairs = first[problem.mesh.edges[chosen]]
    single, part = bridges(len(first), pairs)
    # the first node stays the one of the sinks
    part = [0 if p == part[0] else p for p in part]
    node = [part[v] for v in first.tolist()]
    free = []
    for e in network.free:
        u, v = network.index.ends[e]
        if node[u] != node[v]:
            free.append((node[u], node[v], e))
    kept = {0, *(a for a, _, _ in free), *(b for _, b, _ in free)}
    stems, lost = _shorten([(part[a], part[b]) for a, b in pairs[single].tolist()], kept)
    return _Merged(node, free, stems, lost)


def _shorten(
    forest: list[tuple[int, int]], kept: set[int]
) -> tuple[list[tuple[int, int, int]], int]:
    """Drop branches of a forest that hold no kept node, join edges that only follow each other.

    Returns
    -------
    list of tuple
        (node, node, number of edges joined).
    int
        Number of edges dropped.
    """
    size: dict[int, int] = {}
    around: dict[int, dict[int, int]] = defaultdict(dict)
    for i, (a, b) in enumerate(forest):
        around[a][i] = b
        around[b][i] = a
        size[i] = 1
    lost = 0
    stack = sorted(v for v in around if v not in kept)
    while stack:
        v = stack.pop()
        mine = around[v]
        if len(mine) == 1:
            ((i, w),) = mine.items()
            lost += size.pop(i)
            del mine[i], around[w][i]
            if w not in kept:
                stack.append(w)
        elif len(mine) == 2:
            (i, a), (j, b) = mine.items()
            size[i] += size.pop(j)
            around[v] = {}
            del around[b][j]
            around[a][i], around[b][i] = b, a
    ends: dict[int, list[int]] = defaultdict(list)
    for v in sorted(around):
        for i in around[v]:
            ends[i].append(v)
    return [(*sorted(ends[i]), size[i]) for i in sorted(size)], lost  # type: ignore[misc]


@dataclass
class _Arc:
    """An edge of the merged graph with its variables.

    Attributes
    ----------
    ends
        Its two nodes.
    edge
        The free edge, or None for a way that is there.
    onward
        Whether it leads from the first node to the second.
    both
        Whether it is two-way, or False.
    ways
        (variable, side, child, parent): whether it is the child's way out (0) or in (1).
    """

    ends: tuple[int, int]
    edge: Optional[int]
    onward: Any
    both: Literal
    ways: list[tuple[Any, int, int, int]] = field(default_factory=list)


class _CpWays:
    """Directions, ranks out and ranks in of the nodes of a merged graph, in CP-SAT."""

    def __init__(self, network: CpNetwork, graph: _Merged, penalty: float) -> None:
        self.network, self.model = network, network.model
        self.graph, self.penalty = graph, penalty
        self.on = self._active()
        top = len(self.on)
        self.rank = [
            {c: self.model.new_int_var(0, top, "") for c in self.on if c} for _ in range(2)
        ]
        #: Literals of the ways out of each node, and of the ways in.
        self.parents: list[dict[int, list[Any]]] = [defaultdict(list), defaultdict(list)]
        self.arcs: list[_Arc] = []

    def _active(self) -> dict[int, Literal]:
        """Return whether each node has streets, and so needs two ways."""
        graph, network = self.graph, self.network
        index = network.index
        members: dict[int, list[int]] = defaultdict(list)
        for v, c in enumerate(graph.node):
            members[c].append(v)
        on: dict[int, Literal] = {0: True}
        for a, b, _ in graph.stems:
            on[a] = on[b] = True
        fixed = network.fixed.copy()
        fixed[network.free] = False
        touched = {graph.node[v] for v in index.problem.mesh.edges[fixed].ravel().tolist()}
        for a, b, e in graph.free:
            for c in (a, b):
                if c in touched:
                    on[c] = True
                elif c not in on:
                    v = members[c][0]
                    plain = len(members[c]) == 1 and not index.street[v]
                    on[c] = network.vertex[v] if plain else self.model.new_bool_var("")
                if on[c] is not True:
                    self.model.add_implication(network.edge[e], on[c])
        return on

    def add(self) -> None:
        """Write it all."""
        soft = not math.isinf(self.penalty)
        at: dict[int, list[Literal]] = defaultdict(list)
        for a, b, e in self.graph.free:
            x = self.network.edge[e]
            self._edge((a, b), e, self._both(1) if soft else False)
            at[a].append(x)
            at[b].append(x)
        for a, b, size in self.graph.stems:
            self._edge((a, b), None, self._both(size) if soft else False)
            at[a].append(True)
            at[b].append(True)
        if not soft:
            self._bar()
        for c, literal in self.on.items():
            if not c:
                continue
            for side in self.parents:
                self.network.clause([*side[c], self.network.negated(literal)])
            if not soft:
                # implied, and good for the relaxation
                total = self.network.expression.sum(at[c])
                self.model.add(total >= 2 * (1 if literal is True else literal))

    def _bar(self) -> None:
        """Forbid edges that would be bridges even if all others were chosen."""
        number = {c: i for i, c in enumerate(self.on)}
        pairs = [[number[c] for c in arc.ends] for arc in self.arcs]
        single, _ = bridges(len(number), np.array(pairs, dtype=np.int64).reshape(-1, 2))
        for i in np.flatnonzero(single).tolist():
            e = self.arcs[i].edge
            self.network.clause([] if e is None else [~self.network.edge[e]])

    def _both(self, size: int) -> Any:
        """Return a literal that lets a way be two-way, at a cost."""
        both = self.model.new_bool_var("")
        self.network.cost(both, self.penalty * size)
        return both

    def _edge(self, ends: tuple[int, int], edge: Optional[int], both: Literal) -> None:
        """Let an edge serve as way out and way in, in one direction unless it is two-way."""
        self.network.check()
        model = self.model
        arc = _Arc(ends, edge, model.new_bool_var(""), both)
        self.arcs.append(arc)
        a, b = ends
        for p, q, along in ((a, b, arc.onward), (b, a, ~arc.onward)):
            # out of p to q, and into q from p
            for side, child, parent in ((0, p, q), (1, q, p)):
                if not child:
                    continue
                way = model.new_bool_var("")
                arc.ways.append((way, side, child, parent))
                self.parents[side][child].append(way)
                if edge is not None:
                    model.add_implication(way, self.network.edge[edge])
                self.network.clause([~way, along, both])
                if parent:
                    rank = self.rank[side]
                    model.add(rank[child] >= rank[parent] + 1).only_enforce_if(way)

    def hint(self, active: BoolArray) -> None:
        """Suggest directions, ways and ranks of a design."""
        model = self.model
        there = [arc for arc in self.arcs if arc.edge is None or active[arc.edge]]
        number = {c: i for i, c in enumerate(self.on)}
        pairs = [(number[arc.ends[0]], number[arc.ends[1]]) for arc in there]
        signs = robbins(len(number), pairs)
        single, _ = bridges(len(number), np.array(pairs, dtype=np.int64).reshape(-1, 2))
        steps: dict[tuple[int, int], int] = {}
        onward: list[dict[int, list[int]]] = [defaultdict(list), defaultdict(list)]
        for (a, b), sign, bridge in zip(pairs, signs, single.tolist()):
            for p, q, way in ((a, b, 1), (b, a, -1)):
                if bridge or sign == way:
                    onward[0][q].append(p)
                    onward[1][p].append(q)
        for side in (0, 1):
            queue = [0]
            steps[side, 0] = 0
            for v in queue:
                for w in onward[side][v]:
                    if (side, w) not in steps:
                        steps[side, w] = steps[side, v] + 1
                        queue.append(w)
        for side, ranks in enumerate(self.rank):
            for c, rank in ranks.items():
                model.add_hint(rank, steps.get((side, number[c]), 0))
        chosen = {id(arc): (sign, bridge) for arc, sign, bridge in zip(there, signs, single)}
        for arc in self.arcs:
            sign, bridge = chosen.get(id(arc), (0, False))
            model.add_hint(arc.onward, sign >= 0)
            if arc.both is not False:
                model.add_hint(arc.both, bool(bridge))
            for way, side, child, parent in arc.ways:
                far, near = (steps.get((side, number[c]), 0) for c in (child, parent))
                forward = (child == arc.ends[0]) == (side == 0)
                open_to = bool(bridge) or sign == (1 if forward else -1)
                model.add_hint(way, sign != 0 and open_to and far == near + 1)
