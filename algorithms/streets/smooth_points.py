"""The points of streets that are moved: where they are, and how far each may go."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..network.problem import BoolArray, FloatArray, IntArray
from .smooth_anchors import Anchors
from .smooth_graph import StreetNet, chains_of

#: A junction moves at most this share of its shortest street.
SHORTEST = 0.3
#: A point moves at most this share of its distance to another street, so that two that come
#: towards each other cannot meet.
CLEARANCE = 0.4
#: From one point to the next the furthest move changes by at most this share of their distance.
SLOPE = 0.5


@dataclass(frozen=True, eq=False)
class Points:
    """The n nodes of a network and the points between them, N in all.

    Attributes
    ----------
    start
        Shape (N, 2). Where they are before they move, metres.
    sequence
        Shape (M,). Points along each edge with its end nodes, edge after edge.
    offset
        Shape (e + 1,). Where each edge begins in `sequence`.
    along
        Shape (M,). Distance of each place in `sequence` from the start of its edge, metres.
    fixed
        Shape (N,). Points that stay.
    clearance
        Shape (N,). How far each may move before anything is held back, metres.
    """

    start: FloatArray
    sequence: IntArray
    offset: IntArray
    along: FloatArray
    fixed: BoolArray
    clearance: FloatArray

    @cached_property
    def owner(self) -> IntArray:
        """Edge of each place in `sequence`, shape (M,)."""
        return np.repeat(np.arange(len(self.offset) - 1), np.diff(self.offset))

    @cached_property
    def links(self) -> IntArray:
        """Places in `sequence` whose next one is of the same edge, shape (M - e,)."""
        inner = np.ones(len(self.sequence), dtype=bool)
        inner[self.offset[1:] - 1] = False
        return np.flatnonzero(inner)

    @cached_property
    def lengths(self) -> FloatArray:
        """Distances from each of `links` to the next place, metres."""
        a, b = self.sequence[self.links], self.sequence[self.links + 1]
        return np.asarray(np.hypot(*(self.start[b] - self.start[a]).T))

    def limits(self, share: FloatArray) -> FloatArray:
        """How far each point may move, shape (N,), metres.

        Parameters
        ----------
        share
            Shape (N,). 1 for points that may move freely, less for those that are held back.
        """
        own = np.where(self.fixed, 0.0, self.clearance) * share
        # The least of every other point's limit plus the slope on the way there, as the shortest
        # way from one point that is beyond all of them.
        n = len(own)
        a, b = self.sequence[self.links], self.sequence[self.links + 1]
        rows = np.concatenate([a, np.full(n, n)])
        columns = np.concatenate([b, np.arange(n)])
        weights = np.concatenate([SLOPE * self.lengths, own]) + 1e-9
        graph = csr_matrix((weights, (rows, columns)), shape=(n + 1, n + 1))
        reach = dijkstra(graph, directed=False, indices=n)[:n]
        return np.asarray(np.minimum(own, reach))


def sample(net: StreetNet, anchors: Anchors, spacing: float, keep: float, most: float) -> Points:
    """Take points along the streets.

    Parameters
    ----------
    net
        The streets.
    anchors
        What holds them.
    spacing
        Largest distance between points, metres.
    keep
        The points' line strays at most this far from the street, metres.
    most
        Furthest move, metres.

    Returns
    -------
    Points
        With the limits that keep streets apart.
    """
    closed = shapely.is_closed(net.lines)
    rough = np.where(closed, net.lines, shapely.simplify(net.lines, keep))
    stations = [
        _stations(shapely.get_coordinates(line), shapely.get_coordinates(kept), spacing)
        for line, kept in zip(net.lines, rough)
    ]
    xy, along = np.vstack([s[0] for s in stations]), np.concatenate([s[1] for s in stations])
    count = np.array([len(s[1]) for s in stations])
    owner = np.repeat(np.arange(len(stations)), count)
    n = len(net.nodes)
    offset = np.concatenate([[0], np.cumsum(count)])
    inner = np.ones(len(xy), dtype=bool)
    inner[offset[:-1]] = inner[offset[1:] - 1] = False
    sequence = np.empty(len(xy), dtype=np.int64)
    sequence[inner] = n + np.arange(inner.sum())
    sequence[offset[:-1]], sequence[offset[1:] - 1] = net.ends.T
    start = np.vstack([net.nodes, xy[inner]])
    edge = owner[inner]
    fixed = np.concatenate([anchors.fixed, anchors.held[edge] | anchors.outside(xy[inner])])
    clearance = np.minimum(most, _room(net, start, edge, most))
    return Points(start, sequence, offset.astype(np.int64), along, fixed, clearance)


def _stations(line: FloatArray, kept: FloatArray, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Points on a line: some of its vertices, and others evenly between them.

    Returns
    -------
    array, array
        Shape (k, 2), and their distances along the line, shape (k,), metres.
    """
    arc = arcs(line)
    vertex = np.zeros(len(kept), dtype=np.int64)
    last = -1
    for k, xy in enumerate(kept.tolist()):
        last += 1
        while last < len(line) - 1 and line[last].tolist() != xy:
            last += 1
        vertex[k] = last
    vertex[-1] = len(line) - 1
    ends = arc[vertex]
    parts = np.maximum(np.ceil(np.diff(ends) / spacing), 1).astype(np.int64)
    places = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends, ends[1:], parts)]
    along = np.concatenate([*places, ends[-1:]])
    return np.column_stack([np.interp(along, arc, line[:, k]) for k in (0, 1)]), along


def arcs(xy: FloatArray) -> FloatArray:
    """Return the distance of each vertex along a line, shape (k,)."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])


def _room(net: StreetNet, start: FloatArray, edge: IntArray, most: float) -> FloatArray:
    """How far each point may move so that streets stay apart and junctions whole, metres."""
    chain, length, ends = _chains(net)
    n = len(net.nodes)
    room = np.full(len(start), np.inf)
    junction = net.degrees[net.ends] > 2
    for side in (0, 1):
        at = net.ends[junction[:, side], side]
        np.minimum.at(room, at, SHORTEST * length[chain[junction[:, side]]])
    # Other streets: chains that share no junction with the point's own.
    some = np.zeros(n, dtype=np.int64)
    some[net.ends.ravel()] = np.repeat(np.arange(len(net.ends)), 2)
    own = chain[np.concatenate([some, edge])]
    tree = shapely.STRtree(net.lines)
    shapes = shapely.points(start)
    k, j = tree.query(shapes, predicate="dwithin", distance=most / CLEARANCE)
    other = chain[j]
    joined = (ends[own[k]][:, :, None] == ends[other][:, None, :]).any(axis=(1, 2))
    apart = ~joined & (own[k] != other)
    k, j = k[apart], j[apart]
    gap = shapely.distance(shapes[k], net.lines[j])
    # Streets that cross on bridges are no narrower than they were.
    some_gap = gap > 1e-6
    np.minimum.at(room, k[some_gap], CLEARANCE * gap[some_gap])
    return room


def _chains(net: StreetNet) -> tuple[IntArray, FloatArray, IntArray]:
    """Chain of each edge, and the length and end nodes of each chain."""
    found = chains_of(net)
    of_edge = np.zeros(len(net.ends), dtype=np.int64)
    lengths = net.lengths
    size, ends = [], []
    for number, steps in enumerate(found):
        edges = [e if e >= 0 else ~e for e in steps]
        of_edge[edges] = number
        size.append(float(lengths[edges].sum()))
        first, last = steps[0], steps[-1]
        ends.append(
            (
                int(net.ends[first, 0] if first >= 0 else net.ends[~first, 1]),
                int(net.ends[last, 1] if last >= 0 else net.ends[~last, 0]),
            )
        )
    return of_edge, np.array(size), np.array(ends, dtype=np.int64).reshape(-1, 2)
