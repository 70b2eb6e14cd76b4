"""Streets to be made one-way, as a graph whose directed distances are found fast."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..problem import BoolArray, FloatArray, IntArray, NetworkProblem
from ..rules import straight_continuations
from .bridges import merged_nodes, robbins

#: Ways longer than this are none.
FAR = 1e17

#: Edges of one piece of street between junctions, each with the sign that follows the piece.
Piece = tuple[tuple[int, int], ...]


class OrientGraph:
    """Chosen and existing streets, some of them to become one-way.

    Parameters
    ----------
    problem
        The problem.
    active
        Shape (e,). Chosen edges.
    single
        Shape (e,). Edges that become one-way, no bridges among them.
    turn_weight
        Cost of each change of direction along a straight street.

    Attributes
    ----------
    pieces
        Chains of one-way edges through vertices without any other street: all edges of a piece
        point the same way in every valid orientation.
    streets
        Pieces along each straight street, with the sign that follows the street.
    turns
        (edge, edge, sign): straight continuations; the product of the two directions is the
        sign where the street keeps its direction.
    """

    def __init__(
        self, problem: NetworkProblem, active: BoolArray, single: BoolArray, turn_weight: float
    ) -> None:
        self.problem, self.turn_weight = problem, turn_weight
        self.on = np.flatnonzero(active | problem.existing)
        self.single = single
        self.ends = problem.mesh.edges.tolist()
        street = np.zeros(len(problem.mesh.vertices), dtype=bool)
        street[problem.mesh.edges[problem.existing].ravel()] = True
        touched = np.zeros_like(street)
        touched[problem.mesh.edges[active].ravel()] = True
        self.counted = touched & ~street & ~problem.sinks
        self._index()
        self.pieces = self._pieces()
        self.turns = self._turns()
        self.streets = self._streets()

    def _index(self) -> None:
        """Lay the arcs of all streets out as a sparse matrix whose values change."""
        problem = self.problem
        pairs = problem.mesh.edges[self.on]
        used, flat = np.unique(pairs.ravel(), return_inverse=True)
        pairs = flat.reshape(-1, 2)
        k, n = len(pairs), len(used)
        rows = np.concatenate([pairs[:, 0], pairs[:, 1]])
        columns = np.concatenate([pairs[:, 1], pairs[:, 0]])
        order = np.lexsort((columns, rows))
        place = np.empty(2 * k, dtype=np.int64)
        place[order] = np.arange(2 * k)
        self._forth, self._back = place[:k], place[k:]
        starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n))])
        weights = np.maximum(problem.length[self.on], 1e-12)
        self._weights = weights
        data = np.empty(2 * k)
        data[self._forth] = data[self._back] = weights
        self._data = data
        self._matrix = csr_matrix((data.copy(), columns[order], starts), shape=(n, n))
        self._sinks = np.flatnonzero(problem.sinks[used])
        self._asked = self.counted[used]
        self.used = used

    def round_trips(self, direction: IntArray) -> float:
        """Return the sum over counted vertices of the way to a sink and the way from one.

        Parameters
        ----------
        direction
            Shape (e,). +1 from the first vertex of an edge to the second, -1 back, 0 both.
        """
        if not self._asked.any():
            return 0.0
        if not len(self._sinks):
            return float("inf")
        mine = direction[self.on]
        forth = np.where(mine < 0, np.inf, self._weights)
        back = np.where(mine > 0, np.inf, self._weights)
        total = 0.0
        for first, second in ((forth, back), (back, forth)):
            self._matrix.data[self._forth] = first
            self._matrix.data[self._back] = second
            far = dijkstra(self._matrix, indices=self._sinks, min_only=True, limit=FAR)
            total += float(far[self._asked].sum())
        return total

    def changes(self, direction: IntArray) -> int:
        """Return how often straight streets change their direction."""
        if not len(self.turns):
            return 0
        a, b, sign = self.turns.T
        return int((direction[a] * direction[b] != sign).sum())

    def cost(self, direction: IntArray) -> float:
        """Return what is minimised; infinite where a vertex has no way to or from a sink."""
        return self.round_trips(direction) + self.turn_weight * self.changes(direction)

    def _pieces(self) -> list[Piece]:
        """Chain one-way edges through vertices that have no other street and are no sink."""
        around: dict[int, list[int]] = defaultdict(list)
        for e in self.on.tolist():
            for v in self.ends[e]:
                around[v].append(e)
        sinks = self.problem.sinks

        def through(v: int) -> bool:
            return len(around[v]) == 2 and not sinks[v] and all(self.single[around[v]])

        left = dict.fromkeys(np.flatnonzero(self.single).tolist())
        found = []
        for e in sorted(left):
            if e not in left:
                continue
            chain: list[tuple[int, int]] = [(e, 1)]
            del left[e]
            for forward in (True, False):
                v, last = self.ends[e][1 if forward else 0], e
                while through(v):
                    (following,) = (g for g in around[v] if g != last)
                    if following not in left:
                        break
                    del left[following]
                    leaves = self.ends[following][0] == v
                    chain.append((following, 1 if leaves == forward else -1))
                    v = self.ends[following][1 if leaves else 0]
                    last = following
            found.append(tuple(chain))
        return found

    def _turns(self) -> IntArray:
        """List the straight continuations between one-way edges; see `turns`."""
        found = []
        for (v, e), (g, _) in straight_continuations(self.problem.mesh).items():
            if e < g and self.single[e] and self.single[g]:
                # one comes in and one goes out: at v both start or both end only if opposed
                same = (self.ends[e][0] == v) == (self.ends[g][0] == v)
                found.append((e, g, -1 if same else 1))
        return np.array(found, dtype=np.int64).reshape(-1, 3)

    def _streets(self) -> list[list[tuple[int, int]]]:
        """Group edges to straight streets: (edge, sign along the street), two edges or more."""
        onward: dict[int, list[tuple[int, int]]] = defaultdict(list)
        for e, g, sign in self.turns.tolist():
            onward[e].append((g, sign))
            onward[g].append((e, sign))
        seen: set[int] = set()
        found = []
        for start in sorted(onward):
            if start in seen:
                continue
            seen.add(start)
            street = [(start, 1)]
            for e, sign in street:
                for g, turn in onward[e]:
                    if g not in seen:
                        seen.add(g)
                        street.append((g, sign * turn))
            found.append(sorted(street))
        return found


def first_orientation(graph: OrientGraph) -> IntArray:
    """Return a valid orientation by depth-first search (Robbins' theorem).

    From the sinks, edges of the search tree lead away and all others back towards the root.

    Parameters
    ----------
    graph
        The streets.

    Returns
    -------
    IntArray
        Shape (e,), see `OrientGraph.round_trips`.
    """
    node = merged_nodes(graph.problem)
    chosen = graph.on[~graph.problem.existing[graph.on]]
    pairs = [(a, b) for a, b in node[graph.problem.mesh.edges[chosen]].tolist()]
    direction = np.zeros(len(graph.ends), dtype=np.int64)
    direction[chosen] = robbins(len(node), pairs)
    direction[~graph.single] = 0
    return direction


def alternating(graph: OrientGraph) -> list[list[tuple[int, int]]]:
    """Return the straight streets with signs that alternate from each to the next beside it.

    Parameters
    ----------
    graph
        The streets.

    Returns
    -------
    list
        Streets as in `OrientGraph.streets`.
    """
    points = graph.problem.mesh.vertices
    rows = []
    for street in graph.streets:
        steps = np.array([s * (points[graph.ends[e][1]] - points[graph.ends[e][0]])
                          for e, s in street])  # fmt: skip
        middle = np.mean([points[graph.ends[e]].mean(axis=0) for e, _ in street], axis=0)
        rows.append((steps.sum(axis=0), middle))
    families = _families([along for along, _ in rows])
    found = []
    for family, normal in families:
        ordered = sorted(family, key=lambda i: (round(float(rows[i][1] @ normal), 6), i))
        tangent = np.array([normal[1], -normal[0]])
        for k, i in enumerate(ordered):
            forward = float(rows[i][0] @ tangent) >= 0
            sign = 1 if forward == (k % 2 == 0) else -1
            found.append([(e, s * sign) for e, s in graph.streets[i]])
    return found


def _families(directions: list[FloatArray]) -> list[tuple[list[int], FloatArray]]:
    """Group directions that differ by less than 45 degrees; give each group's normal."""
    groups: list[tuple[list[int], FloatArray]] = []
    for i, along in enumerate(directions):
        size = float(np.hypot(*along)) or 1.0
        normal = np.array([-along[1], along[0]]) / size
        for members, first in groups:
            if abs(float(first @ normal)) > 0.70:
                members.append(i)
                break
        else:
            groups.append(([i], normal))
    return groups
