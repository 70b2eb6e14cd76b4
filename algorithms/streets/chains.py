"""Streets as people see them: edges joined where one goes on into the other."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..mesh import QuadMesh
from ..network.problem import BoolArray, FloatArray, IntArray

#: Edges that meet alone are one street unless they turn by more than this (degrees).
CORNER = 50.0
#: At a junction a street goes straight on up to this turn (degrees).
THROUGH = 45.0


def chains(mesh: QuadMesh, level: IntArray, positions: FloatArray | None = None) -> list[list[int]]:
    """Join the edges of a network into streets that run straight through junctions.

    At each vertex the straightest pairs are joined first, those of one level before mixed
    ones ("natural streets" by good continuity).

    Parameters
    ----------
    mesh
        The candidate mesh.
    level
        Shape (e,). Street level of each edge, 0 for none.
    positions
        Shape (n, 2). Where the vertices are, if not where the mesh has them.

    Returns
    -------
    list of list of int
        Vertices along each street; a closed one repeats its first vertex at the end.

    Examples
    --------
    >>> from platwright.mesh import grid
    >>> mesh = grid(2, 2)
    >>> level = (~mesh.boundary_edges).astype(int)
    >>> sorted(len(chain) for chain in chains(mesh, level))
    [3, 3]
    """
    where = mesh.vertices if positions is None else positions
    partner = _partners(mesh, level, where)
    seen: set[int] = set()
    found = []
    for first in np.flatnonzero(level > 0).tolist():
        if first in seen:
            continue
        seen.add(first)
        u, v = mesh.edges[first].tolist()
        ahead = _walk(mesh, partner, v, first, seen)
        closed = bool(ahead) and ahead[-1] == u and partner.get((u, first)) in seen
        back = [] if closed else _walk(mesh, partner, u, first, seen)
        found.append([*back[::-1], u, v, *ahead])
    return found


def _partners(mesh: QuadMesh, level: IntArray, where: FloatArray) -> dict[tuple[int, int], int]:
    """(vertex, edge) -> the edge that carries the street on."""
    partner: dict[tuple[int, int], int] = {}
    for v, fan in enumerate(mesh.vertex_edges):
        if mesh.boundary_vertices[v]:
            continue
        active = [int(e) for e in fan if level[e] > 0]
        if len(active) < 2:
            continue
        limit = CORNER if len(active) == 2 else THROUGH
        away = {e: _unit(where[_other(mesh, e, v)] - where[v]) for e in active}
        pairs = []
        for i, a in enumerate(active):
            for b in active[i + 1 :]:
                turn = float(np.degrees(np.arccos(np.clip(-(away[a] @ away[b]), -1, 1))))
                if turn <= limit:
                    pairs.append((turn + (20.0 if level[a] != level[b] else 0.0), a, b))
        used: set[int] = set()
        for _, a, b in sorted(pairs):
            if a not in used and b not in used:
                used |= {a, b}
                partner[v, a], partner[v, b] = b, a
    return partner


def _walk(
    mesh: QuadMesh, partner: dict[tuple[int, int], int], v: int, edge: int, seen: set[int]
) -> list[int]:
    """Vertices that follow v when a street is followed over `edge` and onwards."""
    path: list[int] = []
    while True:
        onward = partner.get((v, edge))
        if onward is None or onward in seen:
            return path
        seen.add(onward)
        edge, v = onward, _other(mesh, onward, v)
        path.append(v)


def _other(mesh: QuadMesh, edge: int, vertex: int) -> int:
    """Return the far end of an edge."""
    return int(mesh.edges[edge].sum()) - vertex


def _unit(vector: FloatArray) -> FloatArray:
    """Return the vector at length 1."""
    size = float(np.hypot(*vector))
    return vector / size if size > 0 else vector


def degree(mesh: QuadMesh, edges: BoolArray | Iterable[int]) -> IntArray:
    """Shape (n,): how many of the edges meet at each vertex."""
    chosen = mesh.edges[np.asarray(edges)]
    return np.bincount(chosen.ravel(), minlength=len(mesh.vertices)).astype(np.int64)
