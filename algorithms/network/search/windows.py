"""Solving a window of a network, the streets around it being fixed."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ..cp.connect import add_window_distances, nodes
from ..cp.model import CpNetwork
from ..cp.sat import CpOptions, run_cp
from ..cuts.balls import BallCut, ball_cuts
from ..problem import BoolArray
from ..structure import Structure

#: Costs in windows are rounded to this part of a unit; designs are judged by exact costs.
WINDOW_FINEST = 1000
#: How distances count in a window: by labels; as those that are the least in the mesh; not at all.
Distances = Literal["exact", "least", "none"]
#: Rounds of cutting off islands before a window is given up.
ROUNDS = 8


@dataclass(eq=False)
class Windows:
    """What windows of a problem need: which rules touch which edges.

    Attributes
    ----------
    index
        The problem.
    cuts
        Ball-exit inequalities.
    check
        Called often while models are built; may raise an error to end that.
    """

    index: Structure
    check: Optional[Callable[[], None]] = None
    cuts: list[BallCut] = field(init=False)
    #: Whether solutions are to be looked at even where labels keep them connected.
    repairs: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Index terms, coverage and cuts by edge and vertex."""
        index = self.index
        self.cuts = ball_cuts(index, self.check)
        self._terms: dict[int, list[int]] = defaultdict(list)
        for i, term in enumerate(index.terms):
            for e in {e for on, off in term.alternatives for e in on + off}:
                self._terms[e].append(i)
        self._cover: dict[int, list[int]] = defaultdict(list)
        for i, (_, ball) in enumerate(index.cover):
            for u in ball:
                self._cover[u].append(i)
        self._cuts: dict[int, list[int]] = defaultdict(list)
        for i, cut in enumerate(self.cuts):
            for e in {*cut.exits, *cut.inside}:
                self._cuts[e].append(i)
        n = len(index.incident)
        self._neighbours = [[index.vertex_of(e, v) for e in index.incident[v]] for v in range(n)]

    def around(self, centre: int, radius: int) -> list[int]:
        """Return the usable edges between vertices within `radius` edges of `centre`."""
        return self._grown({centre: 0}, radius)

    def near(self, centres: Iterable[int], radius: int) -> list[int]:
        """Return the usable edges between vertices within `radius` edges of any of those."""
        return self._grown(dict.fromkeys(centres, 0), radius)

    def _grown(self, depth: dict[int, int], radius: int) -> list[int]:
        """Return the edges between vertices within `radius` edges of those given."""
        ring = list(depth)
        for r in range(1, radius + 1):
            found: list[int] = []
            for u in ring:
                for w in self._neighbours[u]:
                    if w not in depth:
                        depth[w] = r
                        found.append(w)
            ring = found
        ends = self.index.ends
        edges = {e for v in depth for e in self.index.incident[v]}
        return sorted(e for e in edges if ends[e][0] in depth and ends[e][1] in depth)

    def along(self, edge: int, width: int, length: int) -> list[int]:
        """Return the usable edges within `width` edges of the mesh line through an edge.

        The line goes on for `length` edges to either side, or to its end.
        """
        index = self.index
        depth = dict.fromkeys(index.ends[edge], 0)
        for vertex in index.ends[edge]:
            here, on = vertex, edge
            for _ in range(length):
                on = self._onward(here, on)
                if on < 0:
                    break
                here = index.vertex_of(on, here)
                depth[here] = 0
        return self._grown(depth, width)

    def _onward(self, vertex: int, edge: int) -> int:
        """Return the usable edge that goes straight on, or -1."""
        following = self.index.problem.mesh.continuation(vertex, edge)
        return following if following >= 0 and self.index.usable[following] else -1

    def network(self, free: list[int], active: BoolArray) -> CpNetwork:
        """Build the model of a window: all but connectivity."""
        index = self.index
        fixed = active.copy()
        fixed[free] = False
        network = CpNetwork(index, free, fixed, finest=WINDOW_FINEST, check=self.check)
        network.add_terms(self._touching(self._terms, free, index.terms))
        network.add_cover(self._touching(self._cover, network.vertices, index.cover))
        network.add_cuts(self._touching(self._cuts, free, self.cuts))
        network.add_requirements()
        return network

    def cut(self, network: CpNetwork, active: BoolArray) -> bool:
        """Forbid what is wrong with a solution that the model allows; tell whether anything is."""
        return _cut_islands(network, active)

    @staticmethod
    def _touching(table: dict[int, list[int]], keys: Iterable[int], items: list[Any]) -> list[Any]:
        """Return the items that any of the keys touches, in order."""
        return [items[i] for i in sorted({i for k in keys for i in table[k]})]


def solve_window(
    windows: Windows,
    free: list[int],
    active: BoolArray,
    options: CpOptions,
    stop: Optional[Callable[[], bool]] = None,
    *,
    distances: Distances = "exact",
) -> tuple[Optional[BoolArray], float]:
    """Choose the edges of a window anew.

    Parameters
    ----------
    windows
        The problem.
    free
        Edges of the window.
    active
        Shape (e,), or longer with what follows the edges (`CpNetwork.tail`). A design; where it
        breaks hard rules, only at edges of the window.
    options
        How CP-SAT works on it.
    stop
        Asked whether to stop at once.
    distances
        How distances count in the window, if they count at all.

    Returns
    -------
    BoolArray or None
        A design that differs from `active` only inside the window and breaks no hard rule,
        or None if none was found in time. Whether it is better is to be evaluated.
    float
        The work done, in CP-SAT's deterministic units.
    """
    network = windows.network(free, active)
    labels = distances == "exact" and windows.index.with_distance
    if labels:
        add_window_distances(network, active[: len(network.fixed)])
    elif distances != "none" and windows.index.with_distance:
        add_least_distances(network)
    network.hint(active)
    effort = 0.0
    for _ in range(ROUNDS):
        result = run_cp(network, options, stop=stop)
        effort += result.effort
        if result.active is None or (labels and not windows.repairs):
            return result.active, effort
        if not windows.cut(network, result.active):
            return result.active, effort
    return None, effort


def add_least_distances(network: CpNetwork) -> None:
    """Let each vertex cost its least possible distance, which no label is needed for."""
    index = network.index
    weight = index.problem.weight_distance
    for v in network.vertices:
        if not index.problem.sinks[v] and not index.street[v] and math.isfinite(index.reach[v]):
            network.cost(network.vertex[v], weight * float(index.reach[v]))


def _cut_islands(network: CpNetwork, active: BoolArray) -> bool:
    """Forbid the islands of a solution; return whether there were any."""
    index = network.index
    node, must = nodes(network)
    count = len(node) + 1
    pairs = [
        (node[u] + 1, node[v] + 1) for u, v in (index.ends[e] for e in network.free if active[e])
    ]
    touched = {c for pair in pairs for c in pair} | {c + 1 for c in must}
    rows, columns = ([p[0] for p in pairs], [p[1] for p in pairs]) if pairs else ([], [])
    matrix = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    _, label = connected_components(matrix, directed=False)
    lost: dict[int, set[int]] = defaultdict(set)
    for c in touched:
        if label[c] != label[0]:
            lost[int(label[c])].add(c - 1)
    for island in lost.values():
        _cut(network, island, node, must)
    return bool(lost)


def _cut(network: CpNetwork, island: set[int], node: list[int], must: dict[int, bool]) -> None:
    """Demand a way out of a set of nodes from each of its active vertices."""
    index = network.index
    ways = [
        network.edge[e]
        for e in network.free
        if (node[index.ends[e][0]] in island) != (node[index.ends[e][1]] in island)
    ]
    if any(c in must for c in island):
        network.clause(ways)
        return
    for v in network.vertices:
        if node[v] in island and not index.street[v]:
            network.clause([*ways, network.negated(network.vertex[v])])
    # streets without a sink need a way out only if something is built on them
    for e in network.free:
        inside = [node[v] in island and index.street[v] for v in index.ends[e]]
        if all(inside):
            network.clause([*ways, network.negated(network.edge[e])])
