"""Which streets lead through and which only serve parcels, and how far it is to leave the site."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from ...levels import COLLECTOR, CUL_DE_SAC, LOCAL, MAJOR
from ..edges import EdgeKind
from .mesh import StreetMesh
from .streets import MeshStreet

Floats = npt.NDArray[np.float64]
#: Pieces that turn by less at a junction are one natural street (degrees).
THROUGH = 30.0
#: A natural street of at least this length that can be left at both ends is a collector (metres).
LONG = 250.0


def exits(mesh: StreetMesh, streets: Sequence[MeshStreet]) -> list[int]:
    """Vertices at which streets leave the site: their ends on existing streets.

    Parameters
    ----------
    mesh
        The mesh.
    streets
        Its streets between junctions.
    """
    ends = {v for street in streets for v in street.ends}
    found = set()
    for (a, b), edge in mesh.edges.items():
        outer = edge.street < 0 and edge.kind != EdgeKind.CLOSED
        if outer:
            found |= {v for v in (a, b) if v in ends}
    return sorted(found)


def natural_streets(streets: Sequence[MeshStreet]) -> npt.NDArray[np.int64]:
    """Join pieces that go on through junctions (natural streets), shape (n,), their numbers.

    Parameters
    ----------
    streets
        Pieces between junctions. At a junction the two that turn least go on, if by less than
        30 degrees.
    """
    parent = list(range(len(streets)))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    around: dict[int, list[tuple[int, Floats]]] = {}
    for k, street in enumerate(streets):
        xy = np.array(street.line.coords)
        for v, way in zip(street.ends, (xy[1] - xy[0], xy[-2] - xy[-1])):
            around.setdefault(v, []).append((k, way / (np.hypot(*way) or 1.0)))
    for v in sorted(around):
        meeting = around[v]
        pairs = sorted(
            (float(first[1] @ second[1]), first[0], second[0])
            for at, first in enumerate(meeting)
            for second in meeting[at + 1 :]
        )
        taken: set[int] = set()
        for cosine, a, b in pairs:
            if cosine < -np.cos(np.radians(THROUGH)) and not taken & {a, b}:
                taken |= {a, b}
                parent[root(a)] = root(b)
    roots = [root(k) for k in range(len(streets))]
    order = {r: k for k, r in enumerate(dict.fromkeys(roots))}
    return np.array([order[r] for r in roots], dtype=np.int64)


def street_levels(
    mesh: StreetMesh, streets: Sequence[MeshStreet], blind: Sequence[int]
) -> npt.NDArray[np.int64]:
    """Rank streets: 1 given, 2 long and through, 3 local, 4 with a blind end; shape (n,).

    Parameters
    ----------
    mesh, streets
        The mesh and its streets between junctions.
    blind
        Vertices at which streets end blind.
    """
    natural = natural_streets(streets)
    out = set(exits(mesh, streets))
    length = np.bincount(natural, weights=[s.line.length for s in streets])
    leave = np.zeros(len(length), dtype=int)
    for number, street in zip(natural, streets):
        leave[number] += sum(v in out for v in street.ends)
    levels = np.where((length >= LONG) & (leave >= 2), COLLECTOR, LOCAL)[natural]
    ends_blind = set(blind)
    for k, street in enumerate(streets):
        if street.fixed:
            levels[k] = MAJOR
        elif ends_blind & set(street.ends):
            levels[k] = CUL_DE_SAC
    return np.asarray(levels)


def ways_out(mesh: StreetMesh, streets: Sequence[MeshStreet]) -> Floats:
    """Shortest way along streets to where the site can be left, from both ends, shape (n, 2).

    Parameters
    ----------
    mesh, streets
        The mesh and its streets between junctions. Infinite where no way leads out; metres.
    """
    ends = np.array([s.ends for s in streets], dtype=int).reshape(-1, 2)
    out = exits(mesh, streets)
    if not len(ends) or not out:
        return np.full((len(ends), 2), np.inf)
    length = np.array([s.line.length for s in streets])
    order = np.lexsort((length, ends.max(axis=1), ends.min(axis=1)))
    low, high = ends.min(axis=1)[order], ends.max(axis=1)[order]
    first = np.r_[True, (np.diff(low) != 0) | (np.diff(high) != 0)]
    size = len(mesh.xy)
    graph = csr_array((length[order][first], (low[first], high[first])), shape=(size, size))
    far = dijkstra(graph, directed=False, indices=out, min_only=True)
    return np.asarray(far[ends])
