"""Street segments between junctions, with their distances to the sinks."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
import shapely
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import LineString

from .pieces import Piece
from .survey import Ground

#: Level of a street that ends blind.
CUL_DE_SAC = 4


@dataclass(frozen=True)
class Segment:
    """A designed street between two junctions.

    Attributes
    ----------
    line
        Its course, metres.
    level
        1 major, 2 collector, 3 local, 4 cul-de-sac.
    start, end
        Junctions at its ends, numbered as in `Piece`.
    dist_start, dist_end
        Network distance from each end to the nearest sink, metres.
    """

    line: LineString
    level: int
    start: int
    end: int
    dist_start: float
    dist_end: float

    @property
    def distance(self) -> float:
        """Distance from the middle of the segment to the nearest sink, metres."""
        return min(self.dist_start, self.dist_end) + float(self.line.length) / 2

    @property
    def furthest(self) -> float:
        """Distance to the nearest sink from the segment's least favoured point, metres."""
        return (self.dist_start + self.dist_end + float(self.line.length)) / 2

    @property
    def mean_distance(self) -> float:
        """Mean distance over all points of the segment, metres.

        From one end the way out grows linearly up to the divide, from the other likewise.
        """
        length = float(self.line.length)
        if length == 0:
            return self.dist_start
        divide = min(max((self.dist_end - self.dist_start + length) / 2, 0.0), length)
        rest = length - divide
        total = divide * (self.dist_start + divide / 2) + rest * (self.dist_end + rest / 2)
        return total / length

    @property
    def direction(self) -> int:
        """1 where traffic descends along the line, -1 against it, 0 where it parts."""
        if abs(self.dist_start - self.dist_end) < 1e-6:
            return 0
        return 1 if self.dist_end < self.dist_start else -1


def segments(
    ground: Ground, pieces: Sequence[Piece], exits: frozenset[int] = frozenset()
) -> list[Segment]:
    """Measure how far it is from every street to the sinks.

    Distances are measured along the final courses, and along the boundary where existing
    streets run there.

    Parameters
    ----------
    ground
        The site and its mesh.
    pieces
        The streets.
    exits
        Junctions besides those of the mesh where traffic leaves.
    """
    distance = _node_distances(ground, pieces, exits)
    return [
        Segment(p.line, p.level, p.start, p.end, distance[p.start], distance[p.end])
        for p in _culs_de_sac(ground, pieces)
    ]


def _culs_de_sac(ground: Ground, pieces: Sequence[Piece]) -> list[Piece]:
    """Give level 4 to streets that end blind."""
    meeting = Counter(v for p in pieces for v in (p.start, p.end))
    kept = set(ground.mesh.edges[ground.street].ravel().tolist())

    def blind(v: int) -> bool:
        if v < 0 or meeting[v] != 1 or v in kept:
            return False
        return v >= len(ground.sinks) or not ground.sinks[v]

    return [
        dataclasses.replace(p, level=CUL_DE_SAC) if blind(p.start) or blind(p.end) else p
        for p in pieces
    ]


def _node_distances(
    ground: Ground, pieces: Sequence[Piece], exits: frozenset[int]
) -> dict[int, float]:
    """Network distance of every node to its nearest sink, metres; infinite if there is none."""
    mesh = ground.mesh
    kept = np.flatnonzero(ground.street)
    ways = [(p.start, p.end, float(p.line.length)) for p in pieces]
    ways += [(int(u), int(v), float(mesh.lengths[e])) for e, (u, v) in zip(kept, mesh.edges[kept])]
    if not ways:
        return {}
    everywhere = bool(ground.sinks[mesh.edges[kept]].all()) and len(kept) > 0
    if not everywhere:
        ways += _along_the_edge(ground, pieces)
    nodes = sorted({v for way in ways for v in way[:2]})
    place = {v: i for i, v in enumerate(nodes)}
    # parallel pieces between two nodes: the shorter one counts
    shortest: dict[tuple[int, int], float] = {}
    for u, v, length in ways:
        pair = (place[min(u, v)], place[max(u, v)])
        shortest[pair] = min(length, shortest.get(pair, math.inf))
    rows, columns = np.array(list(shortest)).T
    graph = sparse.coo_matrix((list(shortest.values()), (rows, columns)), shape=(len(nodes),) * 2)
    count = len(mesh.vertices)
    sinks = [
        place[v]
        for v in nodes
        if v in exits or (v < 0 and everywhere) or (0 <= v < count and ground.sinks[v])
    ]
    if not sinks:
        return dict.fromkeys(nodes, math.inf)
    found = dijkstra(graph.tocsr(), directed=False, indices=sinks, min_only=True)
    return {v: float(found[i]) for v, i in place.items()}


def _along_the_edge(ground: Ground, pieces: Sequence[Piece]) -> list[tuple[int, int, float]]:
    """Ways from junctions with existing streets to the next vertices of the mesh on them."""
    kept = np.flatnonzero(ground.street)
    if not len(kept):
        return []
    mesh = ground.mesh
    lines = np.array([LineString(mesh.edge_line(int(e))) for e in kept], dtype=object)
    found = []
    for piece in pieces:
        for v, xy in ((piece.start, piece.line.coords[0]), (piece.end, piece.line.coords[-1])):
            if v < 0:
                nearest = kept[int(shapely.distance(lines, shapely.Point(xy)).argmin())]
                for w in mesh.edges[nearest].tolist():
                    found.append((v, int(w), math.dist(xy, mesh.vertices[w])))
    return found
