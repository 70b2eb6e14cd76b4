"""Where a path of limited length from one vertex to another can run."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Optional
from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

if TYPE_CHECKING:
    from ..problem import FloatArray, NetworkProblem
    from .links import Link

#: Lengths within this share of a limit (of 1 where it is less) over it still keep it: sums of
#: floating-point numbers and solvers are not more exact.
SLACK = 1e-5

#: Edge, vertex at its other end, length.
Step = tuple[int, int, float]


@dataclass(frozen=True, eq=False)
class Corridor:
    """The edges that lie on a path, short enough, from `start` to `end`.

    Attributes
    ----------
    start, end
        Vertices.
    limit, slack
        Greatest length of a path, slack included; the slack.
    steps
        For each vertex of the corridor the edges of the corridor there.
    left
        For each vertex of the corridor the least length of the way to `end`.
    edges
        All edges of the corridor.
    """

    start: int
    end: int
    limit: float
    slack: float
    steps: Mapping[int, tuple[Step, ...]]
    left: Mapping[int, float]
    edges: frozenset[int]

    @property
    def shortest(self) -> float:
        """Length of the shortest path; infinite without any that is short enough."""
        return self.left.get(self.start, math.inf)

    def path(
        self, open_: Callable[[int], bool], price: Optional[Callable[[int], float]] = None
    ) -> Optional[list[int]]:
        """Return the edges of a path that is short enough, over open edges only.

        Parameters
        ----------
        open_
            Tells whether an edge may be used.
        price
            Cost of each edge, 0 or more; of all paths that are short enough a cheapest one is
            returned. Without it any such path will do.
        """
        if price is None:
            return self._shortest(open_)
        # labels (price so far, length so far) that no other label of the vertex beats in both
        heap: list[tuple[float, float, int, int, int]] = [(0.0, 0.0, self.start, -1, -1)]
        settled: list[tuple[int, int, int]] = []
        best: dict[int, float] = {}
        while heap:
            paid, far, v, edge, before = heapq.heappop(heap)
            if far >= best.get(v, math.inf):
                continue
            best[v] = far
            settled.append((v, edge, before))
            if v == self.end:
                return _back(settled)
            here = len(settled) - 1
            for e, w, length in self.steps.get(v, ()):
                reached = far + length
                if reached + self.left[w] <= self.limit and open_(e):
                    heapq.heappush(heap, (paid + price(e), reached, w, e, here))
        return None

    def _shortest(self, open_: Callable[[int], bool]) -> Optional[list[int]]:
        """Return the shortest path over open edges if it is short enough."""
        heap: list[tuple[float, int, int, int, float]] = []
        heapq.heappush(heap, (self.shortest, self.start, -1, -1, 0.0))
        settled: list[tuple[int, int, int]] = []
        seen: set[int] = set()
        while heap:
            _, v, edge, before, far = heapq.heappop(heap)
            if v in seen:
                continue
            seen.add(v)
            settled.append((v, edge, before))
            if v == self.end:
                return _back(settled)
            here = len(settled) - 1
            for e, w, length in self.steps.get(v, ()):
                reached = far + length
                least = reached + self.left[w]
                if w not in seen and least <= self.limit and open_(e):
                    heapq.heappush(heap, (least, w, e, here, reached))
        return None


def _back(settled: list[tuple[int, int, int]]) -> list[int]:
    """Follow the edges back from the vertex that was settled last."""
    path: list[int] = []
    _, edge, before = settled[-1]
    while before >= 0:
        path.append(edge)
        _, edge, before = settled[before]
    return path[::-1]


_KNOWN: WeakKeyDictionary[NetworkProblem, dict[Link, Corridor]] = WeakKeyDictionary()


def corridor(problem: NetworkProblem, link: Link) -> Corridor:
    """Return where the path of a link can run, given candidate and existing edges.

    An edge between u and v belongs to it if d(start, u) + its length + d(v, end) keeps the
    limit. Routes without branches run over candidate edges and touch no existing street but
    at their ends. Corridors are computed once for each problem.

    Parameters
    ----------
    problem
        The problem.
    link
        The link.
    """
    known = _KNOWN.setdefault(problem, {})
    found = known.get(link)
    if found is None:
        found = known[link] = _corridor(problem, link)
    return found


def _corridor(problem: NetworkProblem, link: Link) -> Corridor:
    """Compute a corridor."""
    pairs = problem.mesh.edges
    able = problem.candidate | problem.existing
    if link.private:
        inner = np.ones(len(problem.mesh.vertices), dtype=np.bool_)
        inner[pairs[problem.existing].ravel()] = False
        inner[[link.start, link.end]] = True
        able = problem.candidate & inner[pairs].all(axis=1)
    length = step_lengths(problem, hops=link.hops)
    slack = SLACK * max(1.0, link.limit)
    limit = link.limit + slack
    numbers = np.flatnonzero(able)
    u, v = pairs[numbers].T
    ends = (np.concatenate([u, v]), np.concatenate([v, u]))
    weights = np.tile(length[numbers], 2)
    size = len(problem.mesh.vertices)
    matrix = csr_matrix((weights, ends), shape=(size, size))
    there, back = dijkstra(matrix, indices=[link.start, link.end], limit=limit)
    lengths = np.minimum(there[u] + back[v], there[v] + back[u]) + length[numbers]
    steps: dict[int, list[Step]] = {}
    edges = numbers[lengths <= limit].tolist()
    for e in edges:
        a, b = (int(w) for w in pairs[e])
        steps.setdefault(a, []).append((e, b, float(length[e])))
        steps.setdefault(b, []).append((e, a, float(length[e])))
    return Corridor(
        start=link.start,
        end=link.end,
        limit=limit,
        slack=slack,
        steps={w: tuple(around) for w, around in steps.items()},
        left={w: float(back[w]) for w in steps},
        edges=frozenset(edges),
    )


def step_lengths(problem: NetworkProblem, *, hops: bool) -> FloatArray:
    """Return the length of every edge as links count it; shape (e,).

    Parameters
    ----------
    problem
        The problem.
    hops
        Whether every edge counts 1; else `NetworkProblem.length` counts.
    """
    if hops:
        return np.ones(len(problem.length))
    # a zero would count as no edge at all
    return np.maximum(problem.length, 1e-12)


def distances(steps: Mapping[int, list[Step]], source: int, limit: float) -> dict[int, float]:
    """Return the distance of every vertex within `limit` of a source."""
    found: dict[int, float] = {}
    heap = [(0.0, source)]
    while heap:
        far, v = heapq.heappop(heap)
        if v in found:
            continue
        found[v] = far
        for _, w, length in steps.get(v, ()):
            if w not in found and far + length <= limit:
                heapq.heappush(heap, (far + length, w))
    return found
