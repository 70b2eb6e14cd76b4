"""Whether junctions keep their distance when streets are drawn off the mesh's lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.quadmesh import FloatArray, QuadMesh

#: What a gap may lose by drawing, as a part of the least one that is asked for.
LOSS = 0.01


def keeps_gaps(
    mesh: QuadMesh,
    ways: Sequence[Sequence[int]],
    lines: Mapping[int, FloatArray],
    least: float,
) -> bool:
    """Tell whether no gap between neighbouring junctions falls below what is asked.

    Gaps that are shorter on the mesh already count only if they shrink.

    Parameters
    ----------
    mesh
        The candidate mesh.
    ways
        Streets as sequences of vertices.
    lines
        Edge -> points (k, 2), as drawn.
    least
        Least distance between junctions along streets, metres.
    """
    most = (1 - LOSS) * least
    for edges in _between_junctions(mesh, ways):
        before = float(mesh.lengths[edges].sum())
        if sum(_length(lines[e]) for e in edges) < min(most, before * (1 - LOSS)):
            return False
    return _ends_keep_apart(mesh, ways, lines, most)


def _length(line: FloatArray) -> float:
    """Return the length of a line."""
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def _between_junctions(mesh: QuadMesh, ways: Sequence[Sequence[int]]) -> Iterator[list[int]]:
    """Yield the edges of each street between two junctions or the edge of the site."""
    degree = np.zeros(len(mesh.vertices), dtype=np.int64)
    for way in ways:
        np.add.at(degree, [*way[:-1], *way[1:]], 1)
    stop = (degree >= 3) | mesh.boundary_vertices
    for way in ways:
        first = next((i for i, v in enumerate(way) if stop[v]), 0)
        if way[0] == way[-1] and first:
            way = [*way[first:-1], *way[: first + 1]]  # a ring begins at a junction
        cuts = [i for i, v in enumerate(way) if stop[v]]
        for a, b in zip(cuts, cuts[1:]):
            part = way[a : b + 1]
            yield [mesh.edge_between(u, v) for u, v in zip(part, part[1:])]


def _ends_keep_apart(
    mesh: QuadMesh, ways: Sequence[Sequence[int]], lines: Mapping[int, FloatArray], most: float
) -> bool:
    """Tell whether streets that end at the edge of the site do so far enough from another."""
    drawn: dict[int, FloatArray] = {}
    for way in ways:
        for end, nxt in ((way[0], way[1]), (way[-1], way[-2])):
            if mesh.boundary_vertices[end]:
                edge = mesh.edge_between(end, nxt)
                drawn[end] = lines[edge][0 if mesh.edges[edge, 0] == end else -1]
    ends = sorted(drawn)
    if len(ends) < 2:
        return True
    now, before = np.array([drawn[v] for v in ends]), mesh.vertices[ends]
    pairs = cKDTree(now).query_pairs(most, output_type="ndarray")
    gap, old = (np.hypot(*(xy[pairs[:, 0]] - xy[pairs[:, 1]]).T) for xy in (now, before))
    return bool((gap >= np.minimum(most, old * (1 - LOSS))).all())
