"""Network distances to where traffic leaves, recomputed from street geometry alone."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from .graph import BoolArray, FloatArray, StreetGraph


def distances_to_sinks(
    graph: StreetGraph, sinks: BoolArray, lengths: FloatArray | None = None
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
    pairs = np.sort(graph.ends, axis=1)
    order = np.lexsort((size, pairs[:, 1], pairs[:, 0]))
    _, first = np.unique(pairs[order], axis=0, return_index=True)
    kept = order[first]
    at = np.flatnonzero(sinks)
    u = np.concatenate([pairs[kept, 0], at])
    v = np.concatenate([pairs[kept, 1], np.full(len(at), count)])
    cost = np.concatenate([np.maximum(size[kept], 1e-9), np.full(len(at), 1e-9)])
    links = coo_array((cost, (u, v)), shape=(count + 1, count + 1)).tocsr()
    return np.asarray(dijkstra(links, directed=False, indices=count)[:count], dtype=float)


def farthest_along(graph: StreetGraph, distance: FloatArray) -> FloatArray:
    """Largest distance to a sink of any point of each edge, shape (e,), metres."""
    start, end = distance[graph.ends[:, 0]], distance[graph.ends[:, 1]]
    return np.asarray((start + end + graph.lengths) / 2)


def mean_along(graph: StreetGraph, distance: FloatArray, use: BoolArray) -> float:
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
    """
    start, end = distance[graph.ends[:, 0]], distance[graph.ends[:, 1]]
    keep = use & np.isfinite(start) & np.isfinite(end)
    if not keep.any():
        return 0.0
    a, b, length = start[keep], end[keep], graph.lengths[keep]
    peak = (a + b + length) / 2
    rise, fall = peak - a, peak - b
    total = (a + peak) / 2 * rise + (b + peak) / 2 * fall
    return float(total.sum() / length.sum())
