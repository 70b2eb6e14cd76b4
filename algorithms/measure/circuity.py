"""Circuity: how much longer ways along streets are than the straight line.

Two definitions are in use for a network, and both are given. The mean over pairs of nodes of
network distance / straight distance is what CitySprout publishes (facts of its repository); the sum
of network distances / the sum of straight distances is what Giacomin and Levinson (2015, "Road
network circuity in metropolitan areas", Environment and Planning B 42) and others use: short ways,
which are the most roundabout, weigh less in it. What osmnx calls `circuity_avg` is a third thing,
the length of the edges / the straight distances of their ends: `sinuosity` here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from ..errors import CancelledError
from ..progress import Progress
from .graph import BoolArray, FloatArray, IntArray, StreetGraph

#: Nodes nearer to each other than this are no pair: their ratio says nothing (metres).
APART = 5.0
#: Up to about so many pairs of nodes are looked at.
PAIRS = 4_000_000
#: Distances computed at a time; between them the caller may cancel.
_BATCH = 200_000


@dataclass(frozen=True)
class Circuity:
    """Circuity of a network; NaN where no two nodes are apart.

    Attributes
    ----------
    mean_of_ratios
        Mean over pairs of nodes of network distance / straight distance, at least 1.
    ratio_of_sums
        Sum of network distances / sum of straight distances, at least 1.
    error
        Standard error of `mean_of_ratios` from drawing some of the nodes; 0 if all were taken.
    sources, nodes
        How many nodes distances were taken from, and to, each.
    """

    mean_of_ratios: float
    ratio_of_sums: float
    error: float
    sources: int
    nodes: int


def mean_circuity(
    graph: StreetGraph,
    *,
    at: BoolArray | None = None,
    pairs: int = PAIRS,
    apart: float = APART,
    seed: int = 0,
    progress: Progress | None = None,
) -> Circuity:
    """Measure the circuity between all nodes of the largest connected part of a network.

    Of a large network some nodes are drawn, and the ways from these to all nodes are measured. The
    draw depends on where nodes are and not on the order of the data.

    Parameters
    ----------
    graph
        The streets, metres; every one may be used both ways.
    at
        Shape (n,). Nodes that ways begin and end at; None for all. Where a layer cuts its streets
        between junctions, take those with `graph.degrees != 2`.
    pairs
        Most pairs of nodes to look at, about; all are if there are fewer.
    apart
        Least straight distance of a pair, metres.
    seed
        Of the draw.
    progress
        Asked whether to stop.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    nodes = _largest(graph, at)
    count = len(nodes)
    if count < 2:
        return Circuity(math.nan, math.nan, 0.0, 0, count)
    order = nodes[np.lexsort((graph.nodes[nodes, 1], graph.nodes[nodes, 0]))]
    many = min(count, max(1, round(pairs / count)))
    picked = np.random.default_rng(seed).choice(count, many, replace=False)
    sources = order if many == count else order[np.sort(picked)]
    links = _links(graph)
    ratio, walked, straight, found = (np.zeros(many) for _ in range(4))
    step = max(1, _BATCH // len(graph.nodes))
    for first in range(0, many, step):
        if progress is not None and progress.cancelled():
            raise CancelledError
        own = slice(first, first + step)
        ways = dijkstra(links, directed=False, indices=sources[own])[:, nodes]
        lines = graph.nodes[sources[own], None] - graph.nodes[None, nodes]
        direct = np.hypot(lines[..., 0], lines[..., 1])
        far = direct > apart
        ratio[own] = np.divide(ways, direct, out=np.zeros_like(ways), where=far).sum(axis=1)
        walked[own] = np.where(far, ways, 0.0).sum(axis=1)
        straight[own] = np.where(far, direct, 0.0).sum(axis=1)
        found[own] = far.sum(axis=1)
    if not found.any():
        return Circuity(math.nan, math.nan, 0.0, many, count)
    mean = ratio.sum() / found.sum()
    return Circuity(
        float(mean),
        float(walked.sum() / straight.sum()),
        _error(ratio, found, count),
        many,
        count,
    )


def edge_circuity(graph: StreetGraph) -> FloatArray:
    """Length of each edge / straight distance of its ends, shape (e,), at least 1.

    Parameters
    ----------
    graph
        The streets, metres. Rings, whose ends are one, have NaN.
    """
    straight = _straight(graph)
    ring = straight <= 0
    return np.where(ring, np.nan, np.maximum(graph.lengths / np.where(ring, 1.0, straight), 1.0))


def sinuosity(graph: StreetGraph) -> float:
    """Length of all edges / sum of the straight distances of their ends (osmnx `circuity_avg`).

    Parameters
    ----------
    graph
        The streets, metres. Rings add to the length only, as in osmnx; NaN if there is nothing
        but rings.
    """
    straight = float(_straight(graph).sum())
    return float(graph.lengths.sum()) / straight if straight > 0 else math.nan


def _straight(graph: StreetGraph) -> FloatArray:
    """Straight distances between the ends of edges, shape (e,)."""
    span = graph.nodes[graph.ends[:, 1]] - graph.nodes[graph.ends[:, 0]]
    return np.asarray(np.hypot(span[:, 0], span[:, 1]), dtype=float)


def _largest(graph: StreetGraph, at: BoolArray | None) -> IntArray:
    """Nodes of the connected part that has most of the asked ones, only those asked for."""
    asked = np.ones(len(graph.nodes), dtype=bool) if at is None else np.asarray(at, dtype=bool)
    if not asked.any():
        return np.zeros(0, dtype=np.int64)
    part = graph.components()
    size = np.bincount(part[asked], minlength=int(part.max()) + 1)
    # Of equal parts the longer one, whatever the order of the data.
    length = np.bincount(part[graph.ends[:, 0]], graph.lengths, minlength=len(size))
    best = np.lexsort((length, size))[-1]
    return np.flatnonzero(asked & (part == best))


def _links(graph: StreetGraph) -> csr_array:
    """Shortest edges between nodes: scipy would add parallel ones up, and drop zero lengths."""
    ends, size = np.sort(graph.ends, axis=1), graph.lengths
    order = np.lexsort((size, ends[:, 1], ends[:, 0]))
    pairs, first = np.unique(ends[order], axis=0, return_index=True)
    count = len(graph.nodes)
    cost = np.maximum(size[order][first], 1e-9)
    return csr_array((cost, (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _error(ratio: FloatArray, found: FloatArray, count: int) -> float:
    """Estimate the standard error of a mean over some of `count` nodes, drawn without return."""
    many = len(ratio)
    if many >= count or many < 2:
        return 0.0 if many >= count else math.nan
    left = ratio - ratio.sum() / found.sum() * found
    spread = math.sqrt(float((left**2).sum()) / (many - 1) / many * (1 - many / count))
    return spread / float(found.mean())
