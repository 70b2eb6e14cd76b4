"""The largest distance to a sink in CP-SAT: labels of the vertices that are near enough."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np

from ..cp.connect import absent
from .reachways import Ways, known_ways, whole_distance, whole_lengths
from .units import touched_vertices

if TYPE_CHECKING:
    from ..cp.model import CpNetwork, Literal
    from ..problem import BoolArray, IntArray


def add_near(network: CpNetwork, limit: int, penalty: float) -> None:
    """Demand that active vertices are at most so far from a sink, or price those that are not.

    A vertex is *near* only if it has a parent that is near, or a sink, and its label is at
    least the parent's and the way between them. Labels end at the limit, and those that are
    not near need none. In a window the ways over decided streets are known, and so is what
    beyond the window depends on it.

    Parameters
    ----------
    network
        The model of a whole problem or of a window.
    limit
        Millionths of a unit of length.
    penalty
        Cost of each vertex that is too far; infinite forbids.
    """
    problem = network.index.problem
    outside = network.fixed.copy()
    outside[network.free] = False
    steps = whole_lengths(problem)
    used = np.array(network.index.usable) | problem.existing
    # the same lengths and limit in a larger unit, if there is one that all are multiples of
    unit = math.gcd(*steps[used].tolist()) or 1
    steps, top = steps // unit, limit // unit
    ways = known_ways(problem, outside | problem.existing, network.free, steps, top)
    labels = _Near(network, ways, steps, top, penalty)
    for v in network.vertices:
        labels.add(v)
    for e, x in network.number.items():
        labels.link(*network.index.ends[e], int(steps[e]), x)
    for a, b, length in ways.links:
        labels.link(a, b, int(length), None)
    labels.finish()
    labels.add_beyond(outside)
    network.hints.append(labels.hint)


class _Near:
    """Labels of vertices at free edges."""

    def __init__(
        self, network: CpNetwork, ways: Ways, steps: IntArray, top: int, penalty: float
    ) -> None:
        self.network = network
        self.problem = network.index.problem
        self.ways = ways
        self.steps = steps
        self.top = top
        self.penalty = penalty
        self.write = network.write
        self.best: list[float] = ways.best.tolist()
        self.without: list[float] = ways.without.tolist()
        self.sinks: list[bool] = network.index.problem.sinks.tolist()
        self.label: dict[int, Any] = {}
        self.near: dict[int, Literal] = {}
        self.parents: dict[int, list[int]] = defaultdict(list)
        self.settled: set[int] = set()
        self.taken: list[tuple[int, int, int | None, int]] = []

    def add(self, v: int) -> None:
        """Give a vertex a label if it can be near, and say what it costs if it is not."""
        network = self.network
        if self.sinks[v]:
            return
        hard, street = math.isinf(self.penalty), network.index.street[v]
        if self.best[v] <= self.top:
            least, without = int(self.best[v]), self.without[v]
            self.label[v] = network.model.new_int_var(least, int(min(self.top, without)), "")
            if without <= self.top:
                self._certain(v, int(without))
                return
            alone = hard and not street
            self.near[v] = network.vertex[v] if alone else network.model.new_bool_var("")
        if street or (hard and v in self.near):
            return
        self._due([self.near.get(v, False), network.negated(network.vertex[v])], 1)

    def _certain(self, v: int, distance: int) -> None:
        """Note that a vertex is near by the streets that are decided."""
        self.near[v] = True
        if self.best[v] == distance:
            self.settled.add(v)
            return
        way = self.write.whole(1)
        self.write.at_least((self.label[v].index,), (1,), distance, only_if=(way,))
        self.parents[v].append(way)
        self.taken.append((way, v, None, distance))

    def _due(self, literals: list[Literal], count: int) -> None:
        """Demand that one of the literals holds, or price that none does."""
        due: Literal = False
        if any(literal is True for literal in literals):
            return
        if not math.isinf(self.penalty):
            due = self.network.model.new_bool_var("")
            self.network.cost(due, self.penalty * count)
        self.network.clause([*literals, due])

    def link(self, u: int, v: int, step: int, x: int | None) -> None:
        """Let each of two vertices be the parent of the other if x holds (None: always)."""
        self.network.check()
        write = self.write
        ways = []
        for a, b in ((u, v), (v, u)):
            if a not in self.label or not (self.sinks[b] or b in self.label):
                continue
            least = step if self.sinks[b] else step + self.best[b]
            # a way over decided streets serves as well as one that is no shorter
            if least > self.top or least >= self.without[a]:
                continue
            way = write.whole(1)
            ways.append(way)
            self.parents[a].append(way)
            self.taken.append((way, a, b, step))
            if x is not None:
                write.implies(way, x)
            label = self.label[a].index
            if self.sinks[b]:
                write.at_least((label,), (1,), step, only_if=(way,))
                continue
            write.at_least((label, self.label[b].index), (1, -1), step, only_if=(way,))
            near = self.near[b]
            if not isinstance(near, bool):
                write.implies(way, near.index)
        if len(ways) == 2:
            write.at_most_one(ways)

    def finish(self) -> None:
        """Demand a parent of every vertex that is near."""
        for v, near in self.near.items():
            if v not in self.settled:
                self.write.some_of([*self.parents[v], *absent(near)])

    def add_beyond(self, outside: BoolArray) -> None:
        """Ask the same of vertices beyond the window that leave through it."""
        problem, index = self.problem, self.network.index
        asked = touched_vertices(problem, outside) & ~problem.sinks
        groups: dict[tuple[tuple[int, int], ...], int] = defaultdict(int)
        for w, doors in self.ways.beyond.items():
            if asked[w] and not index.street[w]:
                key = tuple(sorted((b, self.top - int(d)) for b, d in doors if b in self.label))
                groups[key] += 1
        if math.isinf(self.penalty):
            groups = _strictest(groups)
        known: dict[tuple[int, int], Literal] = {}
        for key, count in sorted(groups.items()):
            for b, most in key:
                if (b, most) not in known:
                    known[b, most] = self._within(b, most)
            self._due([known[pair] for pair in key], count)

    def _within(self, b: int, most: int) -> Literal:
        """Return a literal that holds only if a vertex is near and its label at most so much."""
        if most < self.best[b]:
            return False
        if most >= min(self.top, self.without[b]):
            return self.near[b]
        model = self.network.model
        literal: Literal = model.new_bool_var("")
        model.add(self.label[b] <= most).only_enforce_if(literal)
        if self.near[b] is not True:
            model.add_implication(literal, self.near[b])
        return literal

    def hint(self, active: BoolArray) -> None:
        """Suggest the labels of a design."""
        streets = active | self.problem.existing
        distance: list[float] = whole_distance(self.problem, streets, self.steps).tolist()
        hints: list[tuple[int, int]] = []
        for v, label in self.label.items():
            near, own = distance[v] <= self.top, self.near[v]
            hints.append((label.index, int(distance[v] if near else self.best[v])))
            if not isinstance(own, bool) and own is not self.network.vertex[v]:
                hints.append((own.index, int(near)))
        served: set[int] = set()
        for way, a, b, step in self.taken:
            base = 0.0 if b is None else distance[b]
            take = a not in served and distance[a] <= self.top and distance[a] == base + step
            take = take and (b is None or self._joined(a, b, active))
            served |= {a} if take else set()
            hints.append((way, int(take)))
        self.write.suggest([v for v, _ in hints], [value for _, value in hints])

    def _joined(self, a: int, b: int, active: BoolArray) -> bool:
        """Tell whether a chosen edge or a decided street joins two vertices."""
        index, number = self.network.index, self.network.number
        free = [e for e in index.incident[a] if e in number and index.vertex_of(e, a) == b]
        return any(active[e] for e in free) or not free


def _strictest(
    groups: dict[tuple[tuple[int, int], ...], int],
) -> dict[tuple[tuple[int, int], ...], int]:
    """Keep of the demands on a single vertex the strictest; those on several all."""
    least: dict[int, int] = {}
    kept: dict[tuple[tuple[int, int], ...], int] = {}
    for key, count in groups.items():
        if len(key) == 1:
            b, most = key[0]
            least[b] = min(most, least.get(b, most))
        else:
            kept[key] = count
    for b, most in least.items():
        kept[((b, most),)] = 1
    return kept
