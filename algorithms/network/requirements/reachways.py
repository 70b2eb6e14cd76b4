"""How vertices at free edges reach sinks and each other by the streets that are decided."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..problem import BoolArray, FloatArray, IntArray, NetworkProblem
from .units import MILLIONTHS, whole_parts

#: A way that counts as none.
NONE = math.inf


def whole_lengths(problem: NetworkProblem) -> IntArray:
    """Return the length of each edge, shape (e,), in millionths of a unit, at least 1."""
    return np.maximum(whole_parts(problem.length, MILLIONTHS), 1)


def whole_distance(problem: NetworkProblem, streets: BoolArray, steps: IntArray) -> FloatArray:
    """Return the distance of each vertex to a sink.

    Parameters
    ----------
    problem
        Tells mesh and sinks.
    streets
        Shape (e,). Chosen and existing edges.
    steps
        Shape (e,). Lengths as whole numbers.

    Returns
    -------
    FloatArray
        Shape (n,). Whole numbers, infinite without way.
    """
    sinks = np.flatnonzero(problem.sinks)
    if not len(sinks):
        return np.full(len(problem.mesh.vertices), np.inf)
    found: FloatArray = dijkstra(_graph(problem, streets, steps), indices=sinks, min_only=True)
    return found


def _graph(problem: NetworkProblem, streets: BoolArray, steps: IntArray) -> csr_matrix:
    """Return the symmetric graph of some edges."""
    n = len(problem.mesh.vertices)
    pairs = problem.mesh.edges[streets]
    weights = steps[streets].astype(float)
    where = np.vstack([pairs, pairs[:, ::-1]]).T
    return csr_matrix((np.concatenate([weights, weights]), where), shape=(n, n))


@dataclass(frozen=True, eq=False)
class Ways:
    """What is known of distances while some edges are free and the others are decided.

    Attributes
    ----------
    without
        Shape (n,). Distance to a sink without any free edge.
    best
        Shape (n,). Distance to a sink if all free edges are chosen.
    links
        (a, b, length) of vertices at free edges with a way between them over decided streets
        that touches no other vertex at a free edge; a < b.
    beyond
        For each vertex elsewhere that is a matter of the free edges: the ways (b, length) by
        which it comes to vertices at free edges.
    """

    without: FloatArray
    best: FloatArray
    links: list[tuple[int, int, float]]
    beyond: dict[int, list[tuple[int, float]]]


def known_ways(
    problem: NetworkProblem,
    decided: BoolArray,
    free: Sequence[int],
    steps: IntArray,
    top: float,
) -> Ways:
    """Find what decided streets offer to the free edges, and what depends on these.

    Parameters
    ----------
    problem
        The problem.
    decided
        Shape (e,). Streets that are there in any case: existing ones, chosen ones elsewhere.
    free
        Edges that are not decided.
    steps
        Shape (e,). Lengths as whole numbers.
    top
        No way longer than this matters. Only vertices elsewhere that are farther than this
        from a sink without the free edges are listed in `Ways.beyond`.
    """
    everything = decided.copy()
    everything[list(free)] = True
    without = whole_distance(problem, decided, steps)
    best = whole_distance(problem, everything, steps)
    inside = np.zeros(len(problem.mesh.vertices), dtype=bool)
    inside[problem.mesh.edges[list(free)].ravel()] = True
    outer = np.zeros(len(inside), dtype=bool)
    outer[problem.mesh.edges[decided].ravel()] = True
    doors = np.flatnonzero(inside & outer)
    links: list[tuple[int, int, float]] = []
    beyond: dict[int, list[tuple[int, float]]] = {}
    if len(doors) and np.isfinite(top):
        far = _from_doors(_graph(problem, decided, steps), doors, inside, top)
        for i, j in np.argwhere(np.isfinite(far[:, doors])).tolist():
            if i < j:
                links.append((int(doors[i]), int(doors[j]), float(far[i, doors[j]])))
        for w in np.flatnonzero(outer & ~inside & (without > top)).tolist():
            reached = np.flatnonzero(np.isfinite(far[:, w])).tolist()
            beyond[w] = [(int(doors[i]), float(far[i, w])) for i in reached]
    return Ways(without, best, links, beyond)


def _from_doors(matrix: csr_matrix, doors: IntArray, inside: BoolArray, top: float) -> FloatArray:
    """Return distances (doors, n) from doors to all vertices that pass no other inner vertex."""
    n, count = matrix.shape[0], len(doors)
    entries = matrix.tocoo()
    # each door has a second vertex that can only be left; the first one can only be entered
    exits = np.full(n, -1, dtype=np.int64)
    exits[doors] = n + np.arange(count)
    rows = np.where(inside[entries.row], exits[entries.row], entries.row)
    shape = (n + count, n + count)
    split = csr_matrix((entries.data, (rows, entries.col)), shape=shape)
    found: FloatArray = dijkstra(split, indices=exits[doors], limit=top)[:, :n]
    # nobody asks for the way back to where it starts
    found[np.arange(count), doors] = np.inf
    return found
