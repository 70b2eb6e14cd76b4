"""Which vertices give cover to which (CND section 4.2, C2)."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable
from typing import Callable, Union

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.quadmesh import QuadMesh
from .problem import BoolArray, FloatArray

#: One range for all vertices, or one for each of them, shape (n,).
Range = Union[float, FloatArray]


def coverage_balls(
    mesh: QuadMesh,
    required: Iterable[int],
    covered: BoolArray,
    *,
    edges: Range | None = None,
    metres: Range | None = None,
    straight: Range | None = None,
) -> dict[int, tuple[int, ...]]:
    """List for every vertex that needs cover the vertices that give it (CND section 4.2).

    Parameters
    ----------
    mesh
        The candidate mesh.
    required
        Vertices that need cover.
    covered
        Shape (n,). Vertices that are active already; balls that hold one are left out.
    edges, metres, straight
        Range in mesh edges, in metres along mesh edges, or in metres as the crow flies; exactly
        one of the three, for all vertices or shape (n,).

    Raises
    ------
    ValueError
        If not exactly one range is given.

    Examples
    --------
    >>> from platwright.mesh import grid
    >>> mesh = grid(2, 1)
    >>> coverage_balls(mesh, [0], np.zeros(6, dtype=bool), edges=1)
    {0: (0, 1, 3)}
    """
    given = [r for r in (edges, metres, straight) if r is not None]
    if len(given) != 1:
        msg = "give exactly one of edges, metres and straight"
        raise ValueError(msg)
    ranges = np.broadcast_to(np.asarray(given[0], dtype=float), len(mesh.vertices)).tolist()
    find: Callable[[int, float], list[int]]
    if edges is not None:
        around = _neighbours(mesh)

        def find(v: int, reach: float) -> list[int]:
            return _hops(around, v, round(reach))

    elif metres is not None:

        def find(v: int, reach: float) -> list[int]:
            return _along(mesh, v, reach)

    else:
        tree = cKDTree(mesh.vertices)

        def find(v: int, reach: float) -> list[int]:
            return sorted(tree.query_ball_point(mesh.vertices[v], reach + 1e-9))

    found = {}
    for v in required:
        ball = find(v, ranges[v])
        if not covered[ball].any():
            found[int(v)] = tuple(ball)
    return found


def _neighbours(mesh: QuadMesh) -> list[list[int]]:
    """List the vertices next to each vertex."""
    found: list[list[int]] = [[] for _ in mesh.vertices]
    for u, v in mesh.edges.tolist():
        found[u].append(v)
        found[v].append(u)
    return found


def _hops(around: list[list[int]], centre: int, radius: int) -> list[int]:
    """Vertices within a number of edges of a vertex, sorted."""
    seen = {centre}
    ring = {centre}
    for _ in range(radius):
        ring = {u for v in ring for u in around[v]} - seen
        seen |= ring
    return sorted(seen)


def _along(mesh: QuadMesh, centre: int, radius: float) -> list[int]:
    """Vertices within a distance along mesh edges of a vertex, sorted."""
    best = {centre: 0.0}
    heap = [(0.0, centre)]
    while heap:
        distance, v = heapq.heappop(heap)
        if distance > best[v]:
            continue
        for e in mesh.vertex_edges[v].tolist():
            u = int(mesh.edges[e].sum()) - v
            onward = distance + float(mesh.lengths[e])
            if onward <= radius and onward < best.get(u, math.inf):
                best[u] = onward
                heapq.heappush(heap, (onward, u))
    return sorted(best)
