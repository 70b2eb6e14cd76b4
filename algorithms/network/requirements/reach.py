"""No place farther than so much from a way out."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .base import Requirement
from .reachcp import add_near
from .reachways import Ways, known_ways, whole_distance, whole_lengths
from .units import MILLIONTHS, check_number, check_penalty, touched_vertices, whole_limit

if TYPE_CHECKING:
    from ..cp.model import CpNetwork
    from ..mip.model import NetworkModel
    from ..problem import BoolArray, NetworkProblem
    from .base import View


@dataclass(frozen=True, eq=False)
class MaxDistance(Requirement):
    """Every new street corner is at most so far from a sink, by the network.

    A violation is a vertex of a chosen edge that is no sink and on no existing street, and
    whose shortest way to a sink over chosen and existing edges is longer than the limit: the
    vertices whose distances CND sums up (section 4.1). Lengths count in millionths of a unit
    of `NetworkProblem.length`, each edge at least one of these.

    Attributes
    ----------
    most
        The limit in units of `NetworkProblem.length`: metres divided by the mesh's edge length.
    penalty
        Cost of each violation; infinite forbids.
    kind
        See `Requirement`.

    Raises
    ------
    InputError
        If the limit is negative or no number.
    """

    most: float
    penalty: float = math.inf
    kind: str = "distance to a sink"

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_penalty(self.penalty, "Distance to a sink")
        check_number(self.most, "The largest distance to a sink")

    @property
    def limit(self) -> int:
        """The limit in millionths."""
        return whole_limit(self.most, MILLIONTHS)

    def violations(self, view: View) -> int:
        """Return the number of vertices that are too far from a sink."""
        return int(self._far(view).sum())

    def _far(self, view: View) -> BoolArray:
        """Return which vertices, shape (n,), are too far from a sink."""
        problem = view.problem
        streets = view.active | problem.existing
        far: BoolArray = whole_distance(problem, streets, whole_lengths(problem)) > self.limit
        counted = touched_vertices(problem, view.active) & ~problem.sinks
        return far & counted & ~touched_vertices(problem, problem.existing)

    def places(self, view: View) -> Sequence[int]:
        """Return the vertices that are too far from a sink."""
        return np.flatnonzero(self._far(view)).tolist()  # type: ignore[no-any-return]

    def too_far(self, problem: NetworkProblem) -> BoolArray:
        """Return the candidate edges, shape (e,), that no design keeping the limit can choose.

        Where the requirement is soft, none.
        """
        if not self.hard:
            return np.zeros_like(problem.candidate)
        steps = whole_lengths(problem)
        best = whole_distance(problem, problem.candidate | problem.existing, steps)
        lost = (best > self.limit) & ~touched_vertices(problem, problem.existing)
        barred: BoolArray = problem.candidate & lost[problem.mesh.edges].any(axis=1)
        return barred

    def add_to_cp(self, network: CpNetwork) -> None:
        """Give vertices labels up to the limit, each at least that of a parent and the way."""
        add_near(network, self.limit, self.penalty)

    def add_to_mip(self, model: NetworkModel) -> None:
        """Do the same with rows that hold where the parent is chosen."""
        index = model.index
        problem = index.problem
        steps = whole_lengths(problem)
        ways = known_ways(problem, problem.existing, index.edges, steps, self.limit)
        rows = _Rows(model, ways, self.limit)
        vertices = [v for v, mine in enumerate(index.incident) if mine and not problem.sinks[v]]
        for v in vertices:
            rows.add(v)
        for e, x in model.edge.items():
            u, v = index.ends[e]
            rows.link(u, v, float(steps[e]), x)
            rows.link(v, u, float(steps[e]), x)
        for a, b, length in ways.links:
            rows.link(a, b, length, None)
            rows.link(b, a, length, None)
        rows.finish()
        for v in vertices:
            if index.street[v]:
                continue
            row = [(model.vertex[v], 1.0)]
            if v in rows.near:
                row.append((rows.near[v], -1.0))
            if not self.hard:
                row.append((model.linear.real(1.0, self.penalty), -1.0))
            model.linear.row(row, high=0.0)


class _Rows:
    """Labels as variables of a mixed-integer program, in units of length."""

    def __init__(self, model: NetworkModel, ways: Ways, top: int) -> None:
        self.model = model
        self.linear = model.linear
        self.ways = ways
        self.top = float(top)
        self.label: dict[int, Any] = {}
        self.near: dict[int, Any] = {}
        self.parents: dict[int, list[Any]] = defaultdict(list)

    def add(self, v: int) -> None:
        """Give a vertex a label and a variable that says whether it is near, if it can be."""
        if self.ways.best[v] > self.top:
            return
        # half a millionth is room for rounding
        self.label[v] = self.linear.real((self.top + 0.5) / MILLIONTHS)
        self.near[v] = self.linear.real(1.0)
        self.linear.row([(self.label[v], 1.0)], low=self.ways.best[v] / MILLIONTHS)
        if self.ways.without[v] <= self.top:
            way = self.linear.binary()
            self.parents[v].append(way)
            self._behind(v, None, float(self.ways.without[v]), way)

    def link(self, a: int, b: int, length: float, x: Any) -> None:
        """Let b be the parent of a if x is chosen (None: in any case)."""
        at_sink = bool(self.model.index.problem.sinks[b])
        if a not in self.label or not (at_sink or b in self.label):
            return
        if (0.0 if at_sink else float(self.ways.best[b])) + length > self.top:
            return
        way = self.linear.binary()
        self.parents[a].append(way)
        if x is not None:
            self.linear.row([(way, 1.0), (x, -1.0)], high=0.0)
        if not at_sink:
            self.linear.row([(way, 1.0), (self.near[b], -1.0)], high=0.0)
        self._behind(a, None if at_sink else b, length, way)

    def _behind(self, a: int, b: int | None, length: float, way: Any) -> None:
        """Demand label(a) >= label(b) + length if the way is taken."""
        base = 0.0 if b is None else self.top
        most = (base + length - float(self.ways.best[a])) / MILLIONTHS
        if most <= 0:
            return
        row = [(self.label[a], 1.0), (way, -most)]
        if b is not None:
            row.append((self.label[b], -1.0))
        self.linear.row(row, low=length / MILLIONTHS - most)

    def finish(self) -> None:
        """Let a vertex be near only if it has a parent."""
        for v, near in self.near.items():
            self.linear.row([(near, 1.0), *((p, -1.0) for p in self.parents[v])], high=0.0)
