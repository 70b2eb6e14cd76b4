"""Network distances to where traffic leaves, recomputed from street geometry alone."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from .graph import BoolArray, FloatArray, IntArray, StreetGraph


def directed_pairs(graph: StreetGraph, direction: IntArray | None) -> tuple[IntArray, IntArray]:
    """List where traffic can go along edges: from one node to the next.

    Parameters
    ----------
    graph
        The streets.
    direction
        Shape (e,). 1 where traffic runs from start to end of an edge only, -1 where it runs
        from end to start, 0 for both; None for both everywhere.

    Returns
    -------
    array, array
        Nodes that traffic goes from and to, shape (k, 2), and the edge of each, shape (k,).
    """
    count = len(graph.ends)
    way = np.zeros(count, dtype=np.int64) if direction is None else direction
    ahead, back = np.flatnonzero(way >= 0), np.flatnonzero(way <= 0)
    pairs = np.concatenate([graph.ends[ahead], graph.ends[back][:, ::-1]])
    return pairs, np.concatenate([ahead, back])


def distances_to_sinks(
    graph: StreetGraph,
    sinks: BoolArray,
    lengths: FloatArray | None = None,
    direction: IntArray | None = None,
) -> FloatArray:
    """Shortest distance along streets from each node to the nearest sink (CND section 4.1).

    Parameters
    ----------
    graph
        The streets.
    sinks
        Shape (n,). Where traffic leaves.
    lengths
        Shape (e,). Lengths to use in place of the graph's own, metres, not negative.
    direction
        Shape (e,). See `directed_pairs`: on one-way streets the way out runs with the traffic.

    Returns
    -------
    array
        Shape (n,), metres; infinite where no sink can be reached.
    """
    count = len(graph.nodes)
    if not count or not sinks.any():
        return np.full(count, np.inf)
    size = graph.lengths if lengths is None else lengths
    # One more node stands for all sinks. Zero lengths would be no edges to scipy, parallel
    # edges would be added up: hence a small floor and the shortest of each pair.
    pairs, edge = directed_pairs(graph, direction)
    size = size[edge]
    order = np.lexsort((size, pairs[:, 1], pairs[:, 0]))
    _, first = np.unique(pairs[order], axis=0, return_index=True)
    kept = order[first]
    at = np.flatnonzero(sinks)
    # The search starts at the sinks, against the traffic: from where it goes to where it comes.
    u = np.concatenate([pairs[kept, 1], np.full(len(at), count)])
    v = np.concatenate([pairs[kept, 0], at])
    cost = np.concatenate([np.maximum(size[kept], 1e-9), np.full(len(at), 1e-9)])
    links = coo_array((cost, (u, v)), shape=(count + 1, count + 1)).tocsr()
    return np.asarray(dijkstra(links, indices=count)[:count], dtype=float)


def at_ends(
    graph: StreetGraph,
    distance: FloatArray,
    direction: IntArray | None = None,
    lengths: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Distance to a sink from just inside each end of each edge, shapes (e,), metres.

    Inside a one-way street the way out leads on to its far end.
    """
    start, end = distance[graph.ends[:, 0]], distance[graph.ends[:, 1]]
    if direction is None:
        return start, end
    size = graph.lengths if lengths is None else lengths
    return (
        np.where(direction > 0, end + size, start),
        np.where(direction < 0, start + size, end),
    )


def farthest_along(
    graph: StreetGraph, distance: FloatArray, direction: IntArray | None = None
) -> FloatArray:
    """Largest distance to a sink of any point of each edge, shape (e,), metres."""
    start, end = at_ends(graph, distance, direction)
    return np.asarray((start + end + graph.lengths) / 2)


def mean_along(
    graph: StreetGraph, distance: FloatArray, use: BoolArray, direction: IntArray | None = None
) -> float:
    """Mean distance to a sink over all points of the streets, metres.

    Weighted by length, so that it does not depend on where lines are cut. On an edge of
    length L between nodes at distances a and b the distance rises from both ends to
    p = (a + b + L) / 2; the integral is exact.

    Parameters
    ----------
    graph
        The streets.
    distance
        Shape (n,). See `distances_to_sinks`.
    use
        Shape (e,). Edges that count; those out of reach are left out.
    direction
        Shape (e,). See `directed_pairs`.
    """
    start, end = at_ends(graph, distance, direction)
    keep = use & np.isfinite(start) & np.isfinite(end)
    if not keep.any():
        return 0.0
    a, b, length = start[keep], end[keep], graph.lengths[keep]
    peak = (a + b + length) / 2
    rise, fall = peak - a, peak - b
    total = (a + peak) / 2 * rise + (b + peak) / 2 * fall
    return float(total.sum() / length.sum())
