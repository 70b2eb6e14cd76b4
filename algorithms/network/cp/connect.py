"""Connection to sinks and distances in CP-SAT: every active vertex has a parent nearer by."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Optional

import numpy as np
from scipy.sparse.csgraph import connected_components, dijkstra

from ..problem import BoolArray, FloatArray
from ..structure import graph, sink_distance
from .model import CpNetwork, Literal, index_of, whole, whole_scale

#: Finest unit of distance labels, as a part of one unit of length. Rounding a step down loses
#: a millionth then, less than `incumbent.TOLERANCE` of any distance.
FINEST_LENGTH = 1_000_000
#: The same in windows, whose results are judged by exact costs.
WINDOW_LENGTH = 1000


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
    index, write = network.index, network.write
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
            on[c] = used = network.model.new_bool_var("")
            for e in sorted({e for v in vertices for e in index.incident[v] if e in network.edge}):
                write.implies(network.number[e], used.index)
    rank = {c: write.whole(len(members)) for c in on}
    parents: dict[int, list[int]] = defaultdict(list)
    for e, x in network.number.items():
        network.check()
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
            way = write.whole(1)
            ways.append(way)
            write.implies(way, x)
            write.at_least((rank[a], rank[b]), (1, -1), 1, only_if=(way,))
            parents[a].append(way)
        if len(ways) == 2:
            write.at_most_one(ways)
    for c, literal in on.items():
        write.some_of([*parents[c], *absent(literal)])


def absent(literal: Literal) -> list[int]:
    """Return the negation of a literal as an index, or nothing if the literal holds."""
    return [] if literal is True else [-1 - index_of(literal)]


def add_distances(network: CpNetwork, limit: Optional[float] = None) -> None:
    """Label every vertex of the whole problem with its distance to a sink and count it.

    Parameters
    ----------
    network
        A model with all usable edges free.
    limit
        No vertex whose distance counts may be farther from a sink, in units of length; None for
        what the mesh allows. Existing streets may be farther: their distance costs nothing.
    """
    index, problem = network.index, network.index.problem
    far = float(problem.length[network.free].sum() + problem.length[problem.existing].sum())
    near = far if limit is None else min(far, limit)
    labels = _Labels(network, FINEST_LENGTH)
    streets = np.flatnonzero(np.array(index.street)).tolist()
    for v in sorted({*network.vertices, *streets}):
        if not problem.sinks[v] and math.isfinite(index.reach[v]):
            street = index.street[v]
            on = _labelled(network, v)
            labels.add(v, on, 0.0 if street else 1.0, far if street else near)
    for e, x in network.number.items():
        labels.link(*index.ends[e], float(problem.length[e]), x)
    for e in np.flatnonzero(problem.existing).tolist():
        u, v = index.ends[e]
        labels.link(u, v, float(problem.length[e]), None)
    labels.finish()


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


def add_window_distances(network: CpNetwork, active: BoolArray) -> None:
    """Label the vertices of a window with distances, the streets outside being fixed.

    What lies outside and leaves through the window counts as the weight of the vertex where it
    enters. That is exact only while ways outside do not change, so a result is to be judged by
    its exact objective.

    Parameters
    ----------
    network
        A model of a window.
    active
        Shape (e,). The design that the window is cut from.
    """
    index, problem = network.index, network.index.problem
    outside = network.fixed.copy()
    outside[network.free] = False
    without = sink_distance(problem, outside)
    now, weight = _downstream(network, active)
    far = 2.0 * float(now[np.isfinite(now)].max(initial=0.0)) + 30.0
    labels = _Labels(network, WINDOW_LENGTH)
    for v in network.vertices:
        if problem.sinks[v]:
            continue
        labels.add(v, network.vertex[v], weight[v], far)
        if math.isfinite(without[v]):
            labels.fix(v, float(without[v]))
    for e, x in network.number.items():
        labels.link(*index.ends[e], float(problem.length[e]), x)
    cut_off = [v for v in network.vertices if network.vertex[v] is True and math.isinf(without[v])]
    if cut_off:
        between = dijkstra(graph(problem, outside), indices=cut_off)
        for i, a in enumerate(cut_off):
            for b in cut_off[i + 1 :]:
                if math.isfinite(between[i, b]):
                    labels.link(a, b, float(between[i, b]), None)
    labels.finish()
    labels.hint(now)


def _downstream(network: CpNetwork, active: BoolArray) -> tuple[FloatArray, dict[int, float]]:
    """Return distances of a design, and how many vertices leave through each window vertex."""
    problem = network.index.problem
    sinks = np.flatnonzero(problem.sinks)
    distance, before, _ = dijkstra(
        graph(problem, active), indices=sinks, min_only=True, return_predecessors=True
    )
    counted = np.zeros(len(distance))
    counted[problem.mesh.edges[active].ravel()] = 1.0
    counted[problem.sinks | np.array(network.index.street)] = 0.0
    inside = set(network.vertices)
    # inactive vertices of the window count once they are active
    weight = {v: float(not network.index.street[v]) for v in network.vertices}
    far_first = np.argsort(-np.where(np.isfinite(distance), distance, -1.0), kind="stable")
    carried = counted.tolist()
    parents = before.tolist()
    for v in far_first.tolist():
        p = parents[v]
        if v in inside:
            weight[v] += carried[v] - float(counted[v])
        elif p >= 0:
            carried[p] += carried[v]
    return distance, weight


class _Labels:
    """Distance labels of vertices, each at least that of a parent plus the way to it."""

    def __init__(self, network: CpNetwork, finest: int) -> None:
        index = network.index
        used = index.problem.length[np.array(index.usable) | index.problem.existing]
        self.network = network
        self.write = network.write
        self.unit = whole_scale(np.unique(used).tolist(), finest)
        network.label_cost = index.problem.weight_distance / self.unit
        self.label: dict[int, int] = {}
        self.on: dict[int, Literal] = {}
        self.parents: dict[int, list[int]] = defaultdict(list)
        self.ways: list[tuple[int, int, int, float]] = []
        self.fixed: list[tuple[int, int, float]] = []

    def add(self, v: int, on: Literal, weight: float, far: float) -> None:
        """Give a vertex a label up to `far` that counts `weight` times."""
        self.network.check()
        top = math.ceil(far * self.unit) + 1
        label = self.write.whole(top)
        self.label[v], self.on[v] = label, on
        least = whole(self.network.index.reach[v], self.unit)
        # in linear form, since this is what the bound of the distance term rests on
        if on is True:
            self.write.at_least((label,), (1,), least)
        else:
            self.write.at_least((label, index_of(on)), (1, -least), 0)
        if weight > 0:
            self.network.costs.append((label, self.network.label_cost * weight, top))

    def fix(self, v: int, distance: float) -> None:
        """Offer a vertex a distance that is certain."""
        way = self.write.whole(1)
        least = whole(distance, self.unit)
        self.write.at_least((self.label[v],), (1,), least, only_if=(way,))
        self.parents[v].append(way)
        self.fixed.append((way, v, distance))

    def link(self, u: int, v: int, length: float, x: Optional[int]) -> None:
        """Let each of two vertices be the parent of the other if x holds (None: always)."""
        self.network.check()
        write = self.write
        step = whole(length, self.unit)
        sinks = self.network.index.root
        ways = []
        for a, b in ((u, v), (v, u)):
            at_sink = sinks[b] and self.network.index.problem.sinks[b]
            if a not in self.label or (b not in self.label and not at_sink):
                continue
            way = write.whole(1)
            ways.append(way)
            self.parents[a].append(way)
            self.ways.append((way, a, b, length))
            if x is not None:
                write.implies(way, x)
            base = self.label.get(b)
            if base is None:
                write.at_least((self.label[a],), (1,), step, only_if=(way,))
                continue
            write.at_least((self.label[a], base), (1, -1), step, only_if=(way,))
            on = self.on[b]
            if on is not True:
                write.implies(way, index_of(on))
        if len(ways) == 2:
            write.at_most_one(ways)

    def finish(self) -> None:
        """Demand a parent of every vertex that is on."""
        for v, on in self.on.items():
            self.network.check()
            self.write.some_of([*self.parents[v], *absent(on)])

    def hint(self, distances: FloatArray) -> None:
        """Suggest the labels of a design, given its distances."""
        distance: list[float] = distances.tolist()
        hints: list[tuple[int, int]] = []
        for v, label in self.label.items():
            value = distance[v]
            hints.append((label, whole(value, self.unit) if math.isfinite(value) else 0))
        served: set[int] = set()
        for way, v, far in self.fixed:
            take = abs(distance[v] - far) < 1e-9
            served |= {v} if take else set()
            hints.append((way, int(take)))
        for way, a, b, length in self.ways:
            take = a not in served and abs(distance[a] - distance[b] - length) < 1e-9
            served |= {a} if take else set()
            hints.append((way, int(take)))
        self.write.suggest([v for v, _ in hints], [value for _, value in hints])
