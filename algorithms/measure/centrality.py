"""How central places and streets are: betweenness and closeness, by shortest paths in metres.

Betweenness of a place (Freeman 1977) or street is the share of all pairs of places whose shortest
path runs through it; of several shortest paths each counts its part. It is accumulated source by
source after U. Brandes, "A faster algorithm for betweenness centrality", Journal of Mathematical
Sociology 25 (2001), for many sources at once: places are taken in the order of their distance
from each source, so that one step over arrays does the same place in the order of all of them.

Large networks are measured from a sample of their places (Brandes and Pich 2007, "Centrality
estimation in large networks"; for closeness Eppstein and Wang 2004, "Fast approximation of
centrality").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from ..progress import Progress, Share, Silent
from ..site.watch import ask
from .graph import FloatArray, IntArray

#: Networks of up to so many nodes are measured from every one of them.
EXACT = 5000
#: From so many nodes larger ones are measured.
SOURCES = 250
#: Lengths are counted in whole units of this, so that equal ways are equal in any order of adding
#: (metres).
UNIT = 1e-3
#: So many numbers, sources x nodes x streets at a node, are worked on at once.
_BATCH = 6_000_000
#: Stands for more shortest paths than a float can count.
_MANY = 1e300


@dataclass(frozen=True, eq=False)
class Centrality:
    """How central n nodes and e edges are.

    Attributes
    ----------
    nodes
        Shape (n,). Betweenness: share of the pairs of other nodes, from 0 to 1.
    edges
        Shape (e,). Share of all pairs of nodes.
    closeness
        Shape (n,). 1 / mean distance to all nodes that can be reached, per kilometre, times the
        share of nodes that can be (Wasserman and Faust 1994); 0 where there are none.
    sources, connected
        Number of nodes that it was measured from, and that are joined to others at all; the same
        where it is exact.
    """

    nodes: FloatArray
    edges: FloatArray
    closeness: FloatArray
    sources: int
    connected: int


def centrality(
    count: int,
    ends: IntArray,
    lengths: npt.ArrayLike,
    *,
    exact: int = EXACT,
    sources: int = SOURCES,
    seed: int = 0,
    progress: Progress | None = None,
) -> Centrality:
    """Measure betweenness and closeness, in metres along streets of two-way traffic.

    Parameters
    ----------
    count
        Number of nodes.
    ends
        Shape (e, 2). Nodes at the ends of edges; several may join the same nodes. Loops lie on no
        shortest path.
    lengths
        Shape (e,). Metres.
    exact
        Up to so many nodes, all are sources.
    sources
        Above that, so many of each connected part, drawn by `seed`.
    seed
        Of the sample.
    progress
        Told of the stage and asked for cancellation, or None.

    Raises
    ------
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> row = centrality(3, np.array([[0, 1], [1, 2]]), [100.0, 100.0])
    >>> row.nodes.tolist(), row.edges.round(3).tolist(), row.closeness.round(2).tolist()
    ([0.0, 1.0, 0.0], [0.667, 0.667], [6.67, 10.0, 6.67])
    """
    told = progress or Silent()
    between, along, near = np.zeros(count), np.zeros(len(ends)), np.zeros(count)
    units = np.maximum(np.rint(np.asarray(lengths, dtype=float) / UNIT), 1.0)
    proper = np.flatnonzero(ends[:, 0] != ends[:, 1])
    label, size = _parts(count, ends)
    members, edges = _groups(label, len(size)), _groups(label[ends[proper, 0]], len(size))
    generator = np.random.default_rng(seed)
    local = np.zeros(count, dtype=np.int64)
    used = done = 0
    for part in np.flatnonzero(size > 1).tolist():
        nodes, own = members[part], proper[edges[part]]
        local[nodes] = np.arange(len(nodes))
        start = np.arange(len(nodes))
        if count > exact and len(nodes) > sources:
            start = np.sort(generator.choice(len(nodes), sources, replace=False))
        share = Share(told, done / count, (done + len(nodes)) / count)
        through, paths, far = _accumulate(len(nodes), local[ends[own]], units[own], start, share)
        used, done = used + len(start), done + len(nodes)
        scale = len(nodes) / len(start)
        between[nodes] = through * scale / max((count - 1) * (count - 2), 1)
        along[own] = paths * scale / (count * (count - 1))
        others = np.full(len(nodes), float(len(start)))
        others[start] -= 1.0
        mean = far * UNIT / 1000.0 / others
        near[nodes] = (len(nodes) - 1) / (count - 1) / mean
    return Centrality(between, along, near, used, done)


def _parts(count: int, ends: IntArray) -> tuple[IntArray, IntArray]:
    """Label the connected part of each node, (n,), and count their nodes."""
    links = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    label = np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
    return label, np.bincount(label, minlength=1)


def _groups(label: IntArray, count: int) -> list[IntArray]:
    """Positions of each label."""
    order = np.argsort(label, kind="stable")
    found = np.split(order, np.cumsum(np.bincount(label, minlength=count))[:-1])
    return [np.asarray(one, dtype=np.int64) for one in found]


def _accumulate(
    count: int, ends: IntArray, units: FloatArray, sources: IntArray, progress: Progress
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sum over sources what runs through nodes (n,) and edges (e,), and distances (n,)."""
    tail, head = ends.T.ravel(), ends[:, ::-1].T.ravel()
    length = np.tile(units, 2)
    order = np.lexsort((length, head, tail))
    tail, head, length = tail[order], head[order], length[order]
    degree = np.bincount(tail, minlength=count)
    slot = np.arange(len(tail)) - (np.cumsum(degree) - degree)[tail]
    widest = int(degree.max())
    neighbour = np.zeros((widest, count), dtype=np.int64)
    step = np.full((widest, count), np.inf)
    neighbour[slot, tail], step[slot, tail] = head, length
    # Of parallel edges only the shortest leads anywhere; a matrix would add them up.
    first = np.append(True, (np.diff(tail) != 0) | (np.diff(head) != 0))
    ways = csr_array((length[first], (tail[first], head[first])), shape=(count, count))
    through, paths, far = np.zeros(count), np.zeros(len(ends)), np.zeros(count)
    many = max(1, _BATCH // (count * widest))
    for at in range(0, len(sources), many):
        start = sources[at : at + many]
        progress.stage("Measuring centrality", at / len(sources))
        ask(progress)
        distance = np.ascontiguousarray(dijkstra(ways, indices=start).T)
        ask(progress)
        number, share = _paths(distance, neighbour, step, progress)
        # share: how much of the traffic to all nodes beyond uses one shortest path to a node.
        passing = share * number - 1.0
        passing[start, np.arange(len(start))] = 0.0
        through += passing.sum(axis=1)
        far += distance.sum(axis=1)
        for low in range(0, len(ends), 1000):
            (u, v), x = ends[low : low + 1000].T, units[low : low + 1000, None]
            onward = distance[u] + x == distance[v]
            back = distance[v] + x == distance[u]
            flow = np.where(onward, number[u] * share[v], 0.0)
            flow += np.where(back, number[v] * share[u], 0.0)
            paths[low : low + 1000] += flow.sum(axis=1)
    return through, paths, far


def _paths(
    distance: FloatArray, neighbour: IntArray, step: FloatArray, progress: Progress
) -> tuple[FloatArray, FloatArray]:
    """Count shortest paths to nodes, and what goes on along each of them (Brandes 2001).

    Parameters
    ----------
    distance
        Shape (n, s). From each of s sources to n nodes.
    neighbour, step
        Shape (d, n). Neighbours of each node and how far they are; infinite where there are less.

    Returns
    -------
    number, share
        Shape (n, s). Shortest paths from the source; (1 + dependency) / number.
    """
    count, many = distance.shape
    column = np.arange(many)
    # Sorting along rows is faster; the sources are columns everywhere else.
    ranked = np.ascontiguousarray(np.argsort(np.ascontiguousarray(distance.T), axis=1).T)
    order = ranked * many + column
    # Where a neighbour is not on a shortest path, a cell that stays 0 is read in its place.
    nothing = count * many
    before = np.empty((count, len(neighbour), many), dtype=np.int64)
    after = np.empty_like(before)
    for k, (to, length) in enumerate(zip(neighbour, step)):
        ask(progress)
        there, far = distance[to], length[:, None]
        cell = (to * many)[ranked] + column
        before[:, k] = np.where((there + far == distance).ravel()[order], cell, nothing)
        after[:, k] = np.where((distance + far == there).ravel()[order], cell, nothing)
    number, share = np.zeros(nothing + 1), np.zeros(nothing + 1)
    number[order[0]] = 1.0
    read = np.empty((len(neighbour), many))
    with np.errstate(over="ignore"):
        for rank in range(1, count):
            number.take(before[rank], out=read, mode="clip")
            number[order[rank]] = np.add.reduce(read, 0)
    ask(progress)
    np.minimum(number, _MANY, out=number)
    one = 1.0 / number[order]
    for rank in range(count - 1, -1, -1):
        share.take(after[rank], out=read, mode="clip")
        share[order[rank]] = np.add.reduce(read, 0) + one[rank]
    shape = (count, many)
    return number[:-1].reshape(shape), share[:-1].reshape(shape)
