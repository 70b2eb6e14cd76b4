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

from ..mesh import QuadMesh
from ..network.problem import FloatArray, IntArray
from ..site.types import Site
from .adopt import existing_lines
from .align import Alignment
from .joints import split_at
from .survey import Ground

#: Level of a street that ends blind.
CUL_DE_SAC = 4
#: Pieces shorter than this are not cut off (metres).
SHORTEST = 0.5


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
        Mesh vertices at its ends; negative numbers for junctions with existing streets.
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


@dataclass(frozen=True)
class _Piece:
    """A street between two nodes: mesh vertices, or negative numbers for other junctions."""

    line: LineString
    level: int
    start: int
    end: int


def segments(ground: Ground, level: IntArray, alignment: Alignment) -> list[Segment]:
    """Cut streets at junctions, where they cross existing streets, and at changes of level.

    Distances are measured along the final courses, and along the boundary where existing
    streets run there.
    """
    pieces = _cut_at_existing(ground.site, _pieces(ground, level, alignment))
    distance = _node_distances(ground, pieces)
    pieces = _culs_de_sac(ground, pieces)
    return [
        Segment(p.line, p.level, p.start, p.end, distance[p.start], distance[p.end]) for p in pieces
    ]


def _pieces(ground: Ground, level: IntArray, alignment: Alignment) -> list[_Piece]:
    """Cut streets at mesh vertices where others meet them."""
    mesh = ground.mesh
    streets = (level > 0) | ground.street
    ends = np.bincount(mesh.edges[streets].ravel(), minlength=len(mesh.vertices))
    node = (ends != 2) | mesh.boundary_vertices | ground.sinks
    found = []
    for way in alignment.chains:
        path = [way[0]]
        previous = 0
        for u, v in zip(way, way[1:]):
            own = int(level[mesh.edge_between(u, v)])
            if len(path) > 1 and (node[u] or own != previous):
                found.append(_piece(mesh, alignment, path, previous))
                path = [u]
            path.append(v)
            previous = own
        found.append(_piece(mesh, alignment, path, previous))
    return found


def _piece(mesh: QuadMesh, alignment: Alignment, path: Sequence[int], level: int) -> _Piece:
    """Join the lines along a path of vertices."""
    points: list[FloatArray] = []
    for u, v in zip(path, path[1:]):
        edge = mesh.edge_between(u, v)
        line = alignment.lines[edge]
        line = line if mesh.edges[edge, 0] == u else line[::-1]
        points.append(line if not points else line[1:])
    return _Piece(LineString(np.vstack(points)), level, path[0], path[-1])


def _cut_at_existing(site: Site, pieces: Sequence[_Piece]) -> list[_Piece]:
    """Make a junction wherever a new street crosses an existing one."""
    beside = existing_lines(site)
    found = []
    count = 0
    for piece in pieces:
        crossings = shapely.get_coordinates(shapely.intersection(piece.line, beside))
        parts = split_at(piece.line, [(x, y) for x, y in crossings.tolist()], SHORTEST)
        start = piece.start
        for i, part in enumerate(parts):
            count += i < len(parts) - 1
            end = piece.end if i == len(parts) - 1 else -count
            found.append(_Piece(part, piece.level, start, end))
            start = end
    return found


def _culs_de_sac(ground: Ground, pieces: Sequence[_Piece]) -> list[_Piece]:
    """Give level 4 to streets that end blind."""
    meeting = Counter(v for p in pieces for v in (p.start, p.end))
    kept = set(ground.mesh.edges[ground.street].ravel().tolist())

    def blind(v: int) -> bool:
        return v >= 0 and meeting[v] == 1 and v not in kept and not ground.sinks[v]

    return [
        dataclasses.replace(p, level=CUL_DE_SAC) if blind(p.start) or blind(p.end) else p
        for p in pieces
    ]


def _node_distances(ground: Ground, pieces: Sequence[_Piece]) -> dict[int, float]:
    """Network distance of every node to its nearest sink, metres; infinite if there is none."""
    mesh = ground.mesh
    kept = np.flatnonzero(ground.street)
    ends = [(p.start, p.end) for p in pieces] + [(int(u), int(v)) for u, v in mesh.edges[kept]]
    if not ends:
        return {}
    lengths = [float(p.line.length) for p in pieces] + mesh.lengths[kept].tolist()
    nodes = sorted({v for pair in ends for v in pair})
    place = {v: i for i, v in enumerate(nodes)}
    rows, columns = ([place[pair[k]] for pair in ends] for k in (0, 1))
    # parallel pieces between two nodes: the shorter one counts
    graph = sparse.coo_matrix((lengths, (rows, columns)), shape=(len(nodes),) * 2)
    shortest = graph.tolil()
    for r, c, length in zip(rows, columns, lengths):
        shortest[r, c] = min(length, shortest[r, c])
    everywhere = bool(ground.sinks[mesh.edges[kept]].all()) and len(kept) > 0
    sinks = [place[v] for v in nodes if (v < 0 and everywhere) or (v >= 0 and ground.sinks[v])]
    if not sinks:
        return dict.fromkeys(nodes, math.inf)
    found = dijkstra(shortest.tocsr(), directed=False, indices=sinks, min_only=True)
    return {v: float(found[i]) for v, i in place.items()}
