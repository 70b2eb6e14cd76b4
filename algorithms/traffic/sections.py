"""Networks cut at the places where trips begin and end, and shortest ways on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from .types import FloatArray, IntArray, Places, TrafficNetwork

#: A link of no length still takes so long (seconds), or the search would not see it.
_LEAST = 1e-6


@dataclass(frozen=True, eq=False)
class Sections:
    """A network cut at places: k directed links between q nodes, no two alike.

    The nodes of the network come first, then one for each interior place, then further ones that
    tell streets apart that join the same two nodes. Links are sorted by their start, then end.

    Attributes
    ----------
    nodes
        Number q of nodes.
    place
        Shape (p,). Node of each place.
    start, end
        Shape (k,). Nodes of each link.
    piece
        Shape (k,). Piece of the network that each link is a part of.
    ahead
        Shape (k,). Whether it runs from the start to the end of the piece.
    length
        Shape (k,), metres.
    free_time
        Shape (k,). Seconds on a free road, greater than 0.
    capacity
        Shape (k,). Vehicles per hour.
    """

    nodes: int
    place: IntArray
    start: IntArray
    end: IntArray
    piece: IntArray
    ahead: np.ndarray[tuple[int], np.dtype[np.bool_]]
    length: FloatArray
    free_time: FloatArray
    capacity: FloatArray

    def matrix(self, cost: FloatArray) -> csr_matrix:
        """Return the costs of the links, shape (k,), as a matrix whose data is in their order."""
        row = np.zeros(self.nodes + 1, dtype=np.int64)
        row[1:] = np.cumsum(np.bincount(self.start, minlength=self.nodes))
        return csr_matrix((cost, self.end, row), shape=(self.nodes, self.nodes))

    def times(self, cost: FloatArray, start: IntArray) -> FloatArray:
        """Return least costs from some nodes to all places.

        Parameters
        ----------
        cost
            Shape (k,). Of each link, greater than 0.
        start
            Shape (s,). Nodes.

        Returns
        -------
        array
            Shape (s, p); infinite where there is no way.
        """
        if not len(start):
            return np.zeros((0, len(self.place)))
        found = dijkstra(self.matrix(cost), indices=start)
        return np.asarray(found[:, self.place], dtype=np.float64)

    def reversed(self) -> Sections:
        """Return the same with all links turned round."""
        order = np.lexsort((self.start, self.end))
        return Sections(
            nodes=self.nodes,
            place=self.place,
            start=self.end[order],
            end=self.start[order],
            piece=self.piece[order],
            ahead=~self.ahead[order],
            length=self.length[order],
            free_time=self.free_time[order],
            capacity=self.capacity[order],
        )

    def link(self, start: IntArray, end: IntArray) -> IntArray:
        """Return the link from each start to each end, which must exist; any shape."""
        keys = self.start * self.nodes + self.end
        return np.asarray(np.searchsorted(keys, start * self.nodes + end), dtype=np.int64)


def cut_at_places(network: TrafficNetwork, places: Places) -> Sections:
    """Cut the pieces of a network at the interior places on them.

    Parameters
    ----------
    network
        The streets.
    places
        Where trips begin and end.
    """
    size = network.length
    inner = np.flatnonzero(~places.gates)
    count = len(network.nodes)
    node = places.node.copy()
    node[inner] = count + np.arange(len(inner))
    m = len(size)
    # The start of each piece, the places on it, its end: sections lie between neighbours.
    piece = np.concatenate([np.arange(m), places.piece[inner], np.arange(m)])
    along = np.concatenate(
        [np.zeros(m), np.clip(places.along[inner], 0.0, size[places.piece[inner]]), size]
    )
    at = np.concatenate([network.ends[:, 0], node[inner], network.ends[:, 1]])
    rank = np.repeat([0, 1, 2], [m, len(inner), m])
    order = np.lexsort((rank, along, piece))
    piece, along, at = piece[order], along[order], at[order]
    same = np.flatnonzero((piece[1:] == piece[:-1]) & (at[1:] != at[:-1]))
    ends = np.column_stack([at[same], at[same + 1]])
    part, length = piece[same], along[same + 1] - along[same]
    ends, part, length, total = _told_apart(ends, part, length, count + len(inner))
    return _linked(network, ends, part, length, total, node)


def _told_apart(
    ends: IntArray, part: IntArray, length: FloatArray, count: int
) -> tuple[IntArray, IntArray, FloatArray, int]:
    """Halve sections that join the same two nodes as an earlier one, by a node of their own."""
    pair = np.sort(ends, axis=1)
    _, first = np.unique(pair, axis=0, return_index=True)
    double = np.ones(len(ends), dtype=bool)
    double[first] = False
    more = int(double.sum())
    middle = count + np.arange(more)
    halves = length[double] / 2
    return (
        np.concatenate(
            [
                ends[~double],
                np.column_stack([ends[double, 0], middle]),
                np.column_stack([middle, ends[double, 1]]),
            ]
        ),
        np.concatenate([part[~double], part[double], part[double]]),
        np.concatenate([length[~double], halves, halves]),
        count + more,
    )


def _linked(
    network: TrafficNetwork,
    ends: IntArray,
    part: IntArray,
    length: FloatArray,
    count: int,
    place: IntArray,
) -> Sections:
    """Make a link of each direction that traffic may take."""
    ahead = np.flatnonzero(network.direction[part] >= 0)
    back = np.flatnonzero(network.direction[part] <= 0)
    section = np.concatenate([ahead, back])
    start = np.concatenate([ends[ahead, 0], ends[back, 1]])
    end = np.concatenate([ends[ahead, 1], ends[back, 0]])
    forward = np.arange(len(section)) < len(ahead)
    order = np.lexsort((end, start))
    section = section[order]
    piece = part[section]
    return Sections(
        nodes=count,
        place=place,
        start=start[order],
        end=end[order],
        piece=piece,
        ahead=forward[order],
        length=length[section],
        free_time=np.maximum(length[section] / network.speed[piece], _LEAST),
        capacity=network.capacity[piece],
    )
