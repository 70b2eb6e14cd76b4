"""Least-cost ways from many nodes to many at once, with turns: Dijkstra over two layers.

A state is a node and the axis along which one moves. Moves stay in a layer, a turn changes it.
Prices are the same as in `astar.find_way`, a way never turns right round (going back costs and
gains nothing), so that two layers do for four directions and the costs found are those of A*.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..types import Floats, Ints
from .ground import Ground, Prices

#: Costs of nothing must not vanish from a sparse matrix.
LITTLE = 1e-9


class Layered:
    """The graph of states of a ground.

    Parameters
    ----------
    ground
        The grid.
    prices
        Of turns and of missing room.

    Attributes
    ----------
    number
        Index of each free node, -1 elsewhere, shape (r, c).
    at
        Coordinates of the free nodes, metres, shape (n, 2).
    factor
        What a metre costs around each node, shape (n,); change it and call `weigh`.
    """

    def __init__(self, ground: Ground, prices: Prices) -> None:
        self.ground, self.prices = ground, prices
        rows, columns = np.nonzero(ground.free)
        self.row, self.column = rows, columns
        self.number = np.full(ground.free.shape, -1, dtype=np.int64)
        self.number[rows, columns] = np.arange(len(rows))
        self.at = np.column_stack([ground.xs[columns], ground.ys[rows]])
        self.factor = np.ones(len(rows))
        ends, base = [], []
        for axis, (p, q) in enumerate(
            (
                (self.number[:, :-1], self.number[:, 1:]),
                (self.number[:-1, :], self.number[1:, :]),
            )
        ):
            both = ground.steps(axis)
            a, b = p[both], q[both]
            rough = ground.rough[axis][rows, columns]
            length = np.abs(self.at[b] - self.at[a]).sum(axis=1)
            base.append(length * (1 + prices.room * (rough[a] + rough[b]) / 2))
            ends.append((a, b, axis))
        self._ends, self._base = ends, base
        n = len(rows)
        node = np.arange(n)
        start = np.concatenate([2 * a + x for a, _, x in ends] + [2 * node])
        stop = np.concatenate([2 * b + x for _, b, x in ends] + [2 * node + 1])
        size = 2 * n + 1  # the last state is where all searches start
        order = np.arange(1, len(start) + 1, dtype=float)
        matrix = coo_matrix(
            (np.r_[order, order], (np.r_[start, stop], np.r_[stop, start])), shape=(size, size)
        ).tocsr()
        self._order = matrix.data.astype(np.int64) - 1
        self._indices, self._indptr = matrix.indices, matrix.indptr
        self._size = size
        self.weigh()

    def weigh(self) -> None:
        """Take changed factors into account."""
        f = self.factor
        moves = [b * (f[p] + f[q]) / 2 for b, (p, q, _) in zip(self._base, self._ends)]
        weights = np.concatenate([*moves, np.full(len(f), max(self.prices.turn, LITTLE))])
        self._data = weights[self._order]

    def search(
        self, states: Ints, costs: Floats, limit: float = np.inf
    ) -> tuple[Floats, npt.NDArray[np.int32]]:
        """Find the least cost from any of some states to every state.

        Parameters
        ----------
        states
            States to start from, node * 2 + axis, shape (k,).
        costs
            What starting there costs, metres, shape (k,).
        limit
            States that cost more are not looked at.

        Returns
        -------
        cost : numpy.ndarray
            Shape (2 n,); infinite where nothing leads.
        before : numpy.ndarray
            The state before each, shape (2 n,); negative or 2 n where the search started.
        """
        order = np.argsort(states, kind="stable")
        indptr = self._indptr.copy()
        indptr[-1] = indptr[-2] + len(states)
        matrix = csr_matrix(
            (
                np.r_[self._data, np.asarray(costs, dtype=float)[order] + LITTLE],
                np.r_[self._indices, np.asarray(states, dtype=self._indices.dtype)[order]],
                indptr,
            ),
            shape=(self._size, self._size),
        )
        cost, before = dijkstra(
            matrix, directed=True, indices=self._size - 1, return_predecessors=True, limit=limit
        )
        return cost[:-1], before[:-1]

    def trace(self, before: npt.NDArray[np.int32], state: int) -> list[int]:
        """Give the states from a start to one that was found."""
        way = [state]
        while 0 <= before[way[-1]] < self._size - 1:
            way.append(int(before[way[-1]]))
        return way[::-1]
