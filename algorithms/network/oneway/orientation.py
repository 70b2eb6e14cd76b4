"""One-way streets: directions for the streets of a design.

The paper leaves one-way streets out (CND section 7). A design that meets
`requirements.twoways.TwoWays` can be made one-way altogether; of any other, the bridges stay
two-way. Directions are chosen such that round trips are short.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Optional

import numpy as np

from ...errors import InputError
from ...progress import Deadline, Progress
from ..problem import BoolArray, IntArray, NetworkProblem
from ..structure import sink_distance
from .bridges import design_bridges
from .orientgraph import OrientGraph, alternating, first_orientation

#: Up to this many pieces of street all directions are tried.
ALL_TRIED = 10
#: Directed circuits turned round at once to leave a local optimum.
KICK = 3


@dataclass(frozen=True, eq=False)
class Orientation:
    """Directions of the streets of a design.

    Attributes
    ----------
    direction
        Shape (e,). +1 from the first vertex of a mesh edge to the second, -1 back, 0 two-way
        (and 0 where there is no street).
    kept_two_way
        Edges that were to become one-way and cannot: a part hangs on each of them alone.
    before, after
        Sum over the vertices whose distance counts (chosen streets, but not sinks or existing
        streets) of the way to the nearest sink and the way from the nearest one, in units of
        `NetworkProblem.length`; before, all streets are two-way.
    first
        The same for the orientation that the search began with.
    changes
        Changes of direction along straight streets.
    cost, first_cost
        What was minimised: `after` and the weighted changes; and for the first orientation.
    optimal
        Whether all orientations were tried.
    """

    direction: IntArray
    kept_two_way: tuple[int, ...]
    before: float
    after: float
    first: float
    changes: int
    cost: float
    first_cost: float
    optimal: bool


def orient(
    problem: NetworkProblem,
    active: BoolArray,
    one_way: Optional[BoolArray] = None,
    *,
    turn_weight: float = 1.0,
    seed: int = 1,
    steps: int = 2000,
    time_limit: float = 60.0,
    progress: Optional[Progress] = None,
) -> Orientation:
    """Choose directions of one-way streets.

    Every vertex of the design reaches a sink and is reached from one. The search starts with
    Robbins' orientation, which is valid at once, and turns pieces, whole streets and circuits
    while that helps; turning a circuit round never breaks anything.

    Parameters
    ----------
    problem
        What was asked.
    active
        Shape (e,). A design: chosen edges, all of them connected to sinks.
    one_way
        Shape (e,). Chosen edges that are to become one-way; None for all chosen ones.
    turn_weight
        Cost of each change of direction along a straight street, in units of length, 0 or more.
    seed
        Seed of the random choices.
    steps
        Orientations tried; the same number gives the same directions.
    time_limit
        Seconds after which the best so far is returned; only then do runs differ.
    progress
        Asked for cancellation, which returns the best so far.

    Returns
    -------
    Orientation

    Raises
    ------
    InputError
        If `one_way` has edges that are not chosen, or a chosen edge has no way to a sink.
    """
    active = np.asarray(active, dtype=bool) & ~problem.existing
    wanted = active if one_way is None else np.asarray(one_way, dtype=bool)
    _check(problem, active, wanted, turn_weight)
    single = wanted & ~design_bridges(problem, active)
    graph = OrientGraph(problem, active, single, turn_weight)
    start = first_orientation(graph)
    deadline = Deadline(time_limit, progress)
    if len(graph.pieces) <= ALL_TRIED:
        best, optimal = _try_all(graph, start, deadline)
    else:
        best, optimal = _Search(graph, start, seed, steps, deadline).run(), False
    return Orientation(
        direction=best.astype(np.int8),
        kept_two_way=tuple(np.flatnonzero(wanted & ~single).tolist()),
        before=graph.round_trips(np.zeros_like(best)),
        after=graph.round_trips(best),
        first=graph.round_trips(start),
        changes=graph.changes(best),
        cost=graph.cost(best),
        first_cost=graph.cost(start),
        optimal=optimal,
    )


def _check(
    problem: NetworkProblem, active: BoolArray, one_way: BoolArray, turn_weight: float
) -> None:
    """Raise `InputError` if a design cannot be oriented."""
    if not turn_weight >= 0:
        raise InputError("turn_weight must not be negative.", "Give 0 or more.")
    extra = np.flatnonzero(one_way & ~active)
    if len(extra):
        raise InputError(
            f"{len(extra)} edges are to become one-way that the design does not choose (the "
            f"first is mesh edge {extra[0]}).",
            "Choose one-way streets among the new streets; existing streets stay two-way.",
        )
    far = sink_distance(problem, active)[problem.mesh.edges[active]]
    if not np.isfinite(far).all():
        raise InputError(
            f"{int((~np.isfinite(far)).any(axis=1).sum())} street edges have no way to a sink.",
            "Connect them or leave them out before streets are made one-way.",
        )


def _try_all(graph: OrientGraph, start: IntArray, deadline: Deadline) -> tuple[IntArray, bool]:
    """Return the best of all orientations, and whether there was time for all."""
    best, value = start, graph.cost(start)
    # turning everything round changes nothing
    rest = graph.pieces[1:]
    first = graph.pieces[:1]
    for signs in itertools.product((1, -1), repeat=len(rest)):
        if deadline.passed():
            return best, False
        tried = np.zeros_like(start)
        for piece, sign in zip([*first, *rest], (1, *signs)):
            for e, own in piece:
                tried[e] = sign * own
        cost = graph.cost(tried)
        if cost < value - 1e-9:
            best, value = tried, cost
    return best, True


class _Search:
    """Local search over orientations, with kicks; the same seed makes the same steps."""

    def __init__(
        self, graph: OrientGraph, start: IntArray, seed: int, steps: int, deadline: Deadline
    ) -> None:
        self.graph, self.deadline = graph, deadline
        self.left = steps
        self.rng = np.random.default_rng(seed)
        self.start = start
        self.best, self.value = start, graph.cost(start)
        self.piece_of = {e: i for i, piece in enumerate(graph.pieces) for e, _ in piece}
        self.ends = [self._piece_ends(i) for i in range(len(graph.pieces))]

    def run(self) -> IntArray:
        """Improve from Robbins' orientation and from alternating streets, then kick the best."""
        self._descend(self.start, self.value)
        self._descend(*self._alternate())
        while self._more():
            kicked = self.best
            for _ in range(KICK):
                kicked = self._turn_circuit(kicked)
            self._descend(kicked, self.graph.cost(kicked))
        return self.best

    def _more(self) -> bool:
        """Tell whether there is anything left to do, and time to do it."""
        return self.left > 0 and not self.deadline.passed()

    def _cost(self, direction: IntArray) -> float:
        """Count a step; return the cost of an orientation."""
        self.left -= 1
        return self.graph.cost(direction)

    def _alternate(self) -> tuple[IntArray, float]:
        """Direct straight streets alternately as far as every vertex keeps its ways."""
        direction, value = self.start, self.graph.cost(self.start)
        for street in alternating(self.graph):
            if not self._more():
                break
            tried = self._follow(direction, street)
            cost = self._cost(tried)
            if math.isfinite(cost):
                direction, value = tried, cost
        return direction, value

    def _follow(self, direction: IntArray, street: list[tuple[int, int]]) -> IntArray:
        """Return an orientation in which all pieces of a street follow it."""
        tried = direction.copy()
        for e, sign in street:
            if tried[e] != sign:
                self._turn(tried, self.piece_of[e])
        return tried

    def _turn(self, direction: IntArray, piece: int) -> None:
        """Turn a piece round, in place."""
        for e, _ in self.graph.pieces[piece]:
            direction[e] = -direction[e]

    def _descend(self, direction: IntArray, value: float) -> None:
        """Take every move that helps until none does; keep the best."""
        moves: list[int] = list(range(len(self.graph.pieces) + 2 * len(self.graph.streets)))
        better = True
        while better and self._more():
            better = False
            for move in self.rng.permutation(moves).tolist():
                if not self._more():
                    break
                tried = self._moved(direction, move)
                if (tried == direction).all():
                    continue
                cost = self._cost(tried)
                if cost < value - 1e-9:
                    direction, value, better = tried, cost, True
        if value < self.value - 1e-9:
            self.best, self.value = direction, value

    def _moved(self, direction: IntArray, move: int) -> IntArray:
        """Return what a move makes of an orientation."""
        pieces = len(self.graph.pieces)
        if move < pieces:
            tried = direction.copy()
            self._turn(tried, move)
            return tried
        street = self.graph.streets[(move - pieces) // 2]
        sign = 1 if (move - pieces) % 2 else -1
        return self._follow(direction, [(e, s * sign) for e, s in street])

    def _piece_ends(self, i: int) -> tuple[int, int]:
        """Return first and last vertex of a piece in its own direction."""
        piece, ends = self.graph.pieces[i], self.graph.ends
        # chains grow from an edge in the middle to both ends
        heads = {ends[e][1 if s > 0 else 0] for e, s in piece}
        tails = {ends[e][0 if s > 0 else 1] for e, s in piece}
        first, last = tails - heads, heads - tails
        if first and last:
            return min(first), min(last)
        around = ends[piece[0][0]][0]
        return around, around

    def _turn_circuit(self, direction: IntArray) -> IntArray:
        """Turn a random directed circuit round; every cut keeps its arcs both ways."""
        onward: dict[int, list[tuple[int, int]]] = {}
        for i, (tail, head) in enumerate(self.ends):
            e, sign = self.graph.pieces[i][0]
            if direction[e] == sign:
                onward.setdefault(tail, []).append((i, head))
            else:
                onward.setdefault(head, []).append((i, tail))
        tails = sorted(onward)
        v = tails[int(self.rng.integers(len(tails)))]
        seen: dict[int, int] = {}
        walk: list[int] = []
        while v not in seen and v in onward:
            seen[v] = len(walk)
            i, w = onward[v][int(self.rng.integers(len(onward[v])))]
            walk.append(i)
            v = w
        tried = direction.copy()
        if v in seen:
            for i in walk[seen[v] :]:
                self._turn(tried, i)
        return tried
