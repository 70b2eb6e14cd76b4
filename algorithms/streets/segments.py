"""Street segments between junctions, with their distances to the sinks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import LineString

from ..mesh import QuadMesh
from ..network.problem import FloatArray, IntArray
from ..site.carry import carry_to_centre_line
from .align import Alignment
from .survey import Ground


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
        Mesh vertices at its ends.
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


def sink_distances(ground: Ground, level: IntArray, alignment: Alignment) -> FloatArray:
    """Network distance of every vertex to its nearest sink, metres; infinite off the network.

    New streets count with the length of their final course, existing ones with that of the
    boundary.
    """
    mesh = ground.mesh
    lengths = mesh.lengths.copy()
    for e, line in alignment.lines.items():
        lengths[e] = np.hypot(*np.diff(line, axis=0).T).sum()
    used = np.flatnonzero((level > 0) | ground.street)
    n = len(mesh.vertices)
    ends = mesh.edges[used]
    graph = sparse.csr_matrix((lengths[used], (ends[:, 0], ends[:, 1])), shape=(n, n))
    sinks = np.flatnonzero(ground.sinks)
    return np.asarray(dijkstra(graph, directed=False, indices=sinks, min_only=True))


def segments(ground: Ground, level: IntArray, alignment: Alignment) -> list[Segment]:
    """Cut streets at junctions and at changes of level."""
    mesh = ground.mesh
    distance = sink_distances(ground, level, alignment)
    streets = (level > 0) | ground.street
    ends = np.bincount(mesh.edges[streets].ravel(), minlength=len(mesh.vertices))
    node = (ends != 2) | mesh.boundary_vertices | ground.sinks
    found = []
    for way in alignment.chains:
        path = [way[0]]
        previous = 0
        for u, v in zip(way, way[1:], strict=False):
            own = int(level[mesh.edge_between(u, v)])
            if len(path) > 1 and (node[u] or own != previous):
                found.append(_segment(mesh, alignment, path, previous, distance))
                path = [u]
            path.append(v)
            previous = own
        found.append(_segment(mesh, alignment, path, previous, distance))
    return found


def _segment(
    mesh: QuadMesh,
    alignment: Alignment,
    path: Sequence[int],
    level: int,
    distance: FloatArray,
) -> Segment:
    """Make the segment along a path of vertices."""
    points: list[FloatArray] = []
    for u, v in zip(path, path[1:], strict=False):
        edge = mesh.edge_between(u, v)
        line = alignment.lines[edge]
        line = line if mesh.edges[edge, 0] == u else line[::-1]
        points.append(line if not points else line[1:])
    return Segment(
        LineString(np.vstack(points)),
        level,
        path[0],
        path[-1],
        float(distance[path[0]]),
        float(distance[path[-1]]),
    )


def connectors(ground: Ground, level: IntArray, alignment: Alignment) -> dict[int, LineString]:
    """Carry streets on from the property line to the centre line of the street they meet.

    Returns
    -------
    dict
        Boundary vertex -> line from the vertex to the centre line. Where the boundary is the
        centre line, or no centre line is known, there is none.
    """
    mesh, site = ground.mesh, ground.site
    found = {}
    for v in np.flatnonzero(mesh.boundary_vertices).tolist():
        active = [int(e) for e in mesh.vertex_edges[v] if level[e] > 0]
        if not active or not any(ground.street[e] for e in mesh.vertex_edges[v]):
            continue
        xy = tuple(alignment.positions[v].tolist())
        point = ground.arrivals.get(v)
        target: tuple[float, float] | None
        if point is not None:
            target = point.junction
        else:
            line = alignment.lines[active[0]]
            line = line if mesh.edges[active[0], 1] == v else line[::-1]
            step = line[-1] - line[-2]
            heading = (float(step[0]), float(step[1]))
            target = carry_to_centre_line(site, (xy[0], xy[1]), heading)
        if target is not None and math.dist(xy, target) > 0.05:
            found[v] = LineString([xy, target])
    return found
