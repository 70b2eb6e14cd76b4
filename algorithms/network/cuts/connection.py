"""Connection inequalities: what covers a vertex has a way to a sink.

Let U be a set of vertices that are no sinks and on no street that leads to one; a connected piece
of existing streets belongs to U with all its vertices or not at all. If U contains all that may
cover a vertex, something in U is active, and its way to a sink leaves U over a chosen edge:
``x(exits) + s >= 1``. The strongest such set for a fractional solution is a least cut.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from ..problem import BoolArray, IntArray
from ..structure import Structure
from .separation import LEAST, Point

#: Units of flow that stand for 1.
UNIT = 1_000_000
#: Least cuts that are computed in one round.
TRIES = 60


@dataclass(frozen=True)
class ConnectionCut:
    """The inequality ``x(exits) + s >= 1``.

    Attributes
    ----------
    exits
        Usable edges with one end in the set.
    cover
        Vertex whose coverage slack s counts.
    """

    exits: tuple[int, ...]
    cover: int


class Connector:
    """Finds connection inequalities.

    Parameters
    ----------
    index
        The problem.
    check
        Called often; may raise an error to end the work.
    """

    def __init__(self, index: Structure, check: Optional[Callable[[], None]] = None) -> None:
        self._check: Callable[[], None] = check or (lambda: None)
        names = {-1: 0}
        node = [names.setdefault(c, len(names)) for c in index.node]
        self._balls = [
            (v, sorted({node[u] for u in ball}))
            for v, ball in index.cover
            if all(node[u] for u in ball)
        ]
        ends = [(node[index.ends[e][0]], node[index.ends[e][1]], e) for e in index.edges]
        self._links = np.array([link for link in ends if link[0] != link[1]]).reshape(-1, 3)
        # the source of each flow comes last
        self._count = len(names) + 1
        self._next = 0

    def find(self, point: Point) -> list[ConnectionCut]:
        """Return violated inequalities; balls take turns from call to call."""
        found: dict[tuple[int, ...], ConnectionCut] = {}
        if not len(self._links) or not self._balls:
            return []
        a, b, edges = self._links.T
        flow = np.rint(np.array(point.edge)[edges] * UNIT).astype(np.int64)
        covered = np.zeros(self._count, dtype=bool)
        tries = 0
        for step in range(len(self._balls)):
            if tries == TRIES:
                break
            self._check()
            v, ball = self._balls[(self._next + step) % len(self._balls)]
            if covered[ball].any():
                continue
            tries += 1
            inside = self._least_cut(a, b, flow, ball)
            if inside is None:
                continue
            exits = tuple(sorted(edges[inside[a] != inside[b]].tolist()))
            value = sum(point.edge[e] for e in exits) + point.slack.get(v, 0.0)
            if value < 1.0 - LEAST:
                covered |= inside
                found[exits] = ConnectionCut(exits, v)
        self._next += step + 1
        return list(found.values())

    def _least_cut(
        self, a: IntArray, b: IntArray, flow: IntArray, ball: list[int]
    ) -> Optional[BoolArray]:
        """Return the nodes on the ball's side of a least cut, or None if it is worth 1."""
        source = self._count - 1
        out = np.array(ball)
        rows = np.concatenate([a, b, np.full(len(out), source)])
        columns = np.concatenate([b, a, out])
        values = np.concatenate([flow, flow, np.full(len(out), UNIT)])
        # equal arcs are summed up
        capacity = csr_matrix((values, (rows, columns)), shape=(self._count, self._count))
        capacity = capacity.astype(np.int32)
        result = maximum_flow(capacity, source, 0)
        if result.flow_value >= (1.0 - LEAST) * UNIT:
            return None
        left = capacity - result.flow
        left.eliminate_zeros()
        reached = breadth_first_order(left, source, return_predecessors=False)
        inside = np.zeros(self._count, dtype=bool)
        inside[reached] = True
        return inside
