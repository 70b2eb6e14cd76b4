"""A route as lines: from stop to stop, each away from the start."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ...mesh.quadmesh import QuadMesh
from ...network.problem import BoolArray, FloatArray
from ..types import IntArray


@dataclass(frozen=True)
class Trail:
    """A piece of the route.

    Attributes
    ----------
    vertices
        Its vertices in order; the first is repeated at the end of a ring.
    edges
        Its edges in order, one fewer.
    """

    vertices: tuple[int, ...]
    edges: tuple[int, ...]


def trails(
    edges: IntArray, route: BoolArray, along: FloatArray, *, stops: Collection[int] = ()
) -> list[Trail]:
    """Cut a route where it ends, branches or stops.

    Parameters
    ----------
    edges
        Shape (e, 2). Vertices of each edge.
    route
        Shape (e,). Edges of the route.
    along
        Shape (n,). Distance of each vertex from the start; a piece begins at its nearer end.
    stops
        Vertices where to cut as well, such as the start and the doors.

    Returns
    -------
    list of Trail
        Every edge of the route is in one of them, in one place.
    """
    at: dict[int, list[int]] = {}
    for e in np.flatnonzero(route).tolist():
        for v in edges[e].tolist():
            at.setdefault(v, []).append(e)
    halts = {v for v, own in at.items() if len(own) != 2} | (set(stops) & set(at))
    free = {e for own in at.values() for e in own}
    found = []
    for v in sorted(at, key=lambda v: (v not in halts, along[v], v)):
        for e in at[v]:
            if e in free:
                # a ring without a stop begins at the vertex that is nearest to the start
                found.append(_walk(edges, at, free, halts | {v}, v, e))
    return found


def trail_points(mesh: QuadMesh, trail: Trail) -> FloatArray:
    """Return the points (k, 2) of a piece of the route, metres."""
    pieces = []
    for v, e in zip(trail.vertices, trail.edges):
        line = mesh.edge_line(e)
        pieces.append(line if mesh.edges[e, 0] == v else line[::-1])
    first = [pieces[0][:1]]
    points: FloatArray = np.vstack(first + [piece[1:] for piece in pieces])
    return points


def _walk(
    edges: IntArray,
    at: dict[int, list[int]],
    free: set[int],
    halts: set[int],
    vertex: int,
    edge: int,
) -> Trail:
    """Follow the route from a vertex along an edge to the next stop; its edges are used up."""
    vertices, walked = [vertex], [edge]
    while True:
        free.discard(walked[-1])
        u, v = edges[walked[-1]].tolist()
        vertices.append(v if vertices[-1] == u else u)
        if vertices[-1] in halts:
            return Trail(tuple(vertices), tuple(walked))
        walked.append(next(e for e in at[vertices[-1]] if e != walked[-1]))
