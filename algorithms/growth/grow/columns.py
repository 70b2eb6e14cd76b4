"""The nodes and edges of a growth while it goes on: plain columns, and the grids over them.

Lists are used, not arrays, because they grow by one and are read one at a time.
"""

from __future__ import annotations

from math import hypot

from ..types import GROWN, Ground
from .cells import PointCells, Segment, SegmentCells, box
from .choose import NO_STATE


class Columns:
    """Columns of nodes and edges, at first those of the ground.

    Parameters
    ----------
    ground
        Streets that are there.
    cell
        Side of the cells of the grids, metres.
    tolerance
        How far beside edges they are registered too, metres.

    Attributes
    ----------
    x, y, state, born, road_in, way_in, bend, at
        Of nodes: position, code of state, iteration, road number of the incoming edge, unit vector
        in which the node was reached, whether a street of the ground only bends there, edges.
    a, b, segment, way, road, kind, step, street
        Of edges: nodes, coordinates, unit vector from a to b, road number, position of the road
        type (-1 none), iteration, position of the street of the ground or `GROWN`.
    grown, length, roads
        Number and length (metres) of the edges that grew, greatest road number.
    """

    def __init__(self, ground: Ground, cell: float, tolerance: float) -> None:
        self.x: list[float] = ground.nodes[:, 0].tolist()
        self.y: list[float] = ground.nodes[:, 1].tolist()
        count = len(self.x)
        self.state = [NO_STATE] * count
        self.born = [0] * count
        self.road_in = [0] * count
        self.way_in = [(0.0, 0.0)] * count
        self.bend: list[bool] = ground.bends.tolist() or [False] * count
        self.at: list[list[int]] = [[] for _ in range(count)]
        self.a: list[int] = []
        self.b: list[int] = []
        self.segment: list[Segment] = []
        self.way: list[tuple[float, float]] = []
        self.road: list[int] = []
        self.kind: list[int] = []
        self.step: list[int] = []
        self.street: list[int] = []
        self.grown, self.length, self.roads = 0, 0.0, 0
        self.points = PointCells(cell)
        self.lines = SegmentCells(cell, tolerance)
        for node in range(count):
            self.points.add(node, self.x[node], self.y[node])
        for (a, b), street in zip(ground.ends.tolist(), ground.street.tolist()):
            self._edge(a, b, (0, -1, 0, street))

    def add_node(self, x: float, y: float, born: int) -> int:
        """Add a node without state and return its number."""
        node = len(self.x)
        self.x.append(x)
        self.y.append(y)
        self.state.append(NO_STATE)
        self.born.append(born)
        self.road_in.append(0)
        self.way_in.append((0.0, 0.0))
        self.bend.append(False)
        self.at.append([])
        self.points.add(node, x, y)
        return node

    def add_edge(self, a: int, b: int, road: int, kind: int, step: int) -> int:
        """Add an edge that has grown and return its number."""
        self.grown += 1
        self.length += hypot(self.x[b] - self.x[a], self.y[b] - self.y[a])
        return self._edge(a, b, (road, kind, step, GROWN))

    def split(self, edge: int, node: int) -> None:
        """Split an edge at a node on it; the second half becomes a new edge."""
        before, end = self.segment[edge], self.b[edge]
        x, y = self.x[node], self.y[node]
        self.b[edge] = node
        self.segment[edge] = after = (before[0], before[1], x, y)
        self.at[end].remove(edge)
        self.at[node].append(edge)
        self.lines.shorten(edge, before, after)
        self.way[edge] = self._way(edge)
        self._edge(
            node, end, (self.road[edge], self.kind[edge], self.step[edge], self.street[edge])
        )
        if self.street[edge] == GROWN:
            self.grown += 1

    def edge_between(self, a: int, b: int) -> int:
        """Return the edge that leads from one node to another, -1 if there is none."""
        starts, ends = self.a, self.b
        return next((e for e in self.at[a] if starts[e] == b or ends[e] == b), -1)

    def nearest(self, x: float, y: float, radius: float, *, but: int, bends: bool) -> int:
        """Return the nearest node within a radius, -1 if there is none.

        Parameters
        ----------
        x, y
            Where to look.
        radius
            Greatest distance, exclusive.
        but
            A node that does not count.
        bends
            Whether nodes count where a street only bends.
        """
        best, least, find = -1, radius * radius, self.points.cells.get
        xs, ys, bend = self.x, self.y, self.bend
        for key in box(x, y, radius, self.points.per):
            for node in find(key, ()):
                dx, dy = xs[node] - x, ys[node] - y
                square = dx * dx + dy * dy
                if square < least and node != but and (bends or not bend[node]):
                    best, least = node, square
        return best

    def foot(self, x: float, y: float, radius: float, but: int) -> tuple[int, float, float] | None:
        """Return the nearest edge within a radius and the point on it that is nearest.

        Parameters
        ----------
        x, y
            Where to look.
        radius
            Greatest distance, exclusive.
        but
            A node whose edges do not count.
        """
        best, least, find = None, radius * radius, self.lines.cells.get
        for key in box(x, y, radius, self.lines.per):
            for edge in find(key, ()):
                ax, ay, bx, by = self.segment[edge]
                dx, dy = bx - ax, by - ay
                along = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
                along = 0.0 if along < 0 else 1.0 if along > 1 else along
                fx, fy = ax + along * dx, ay + along * dy
                square = (fx - x) * (fx - x) + (fy - y) * (fy - y)
                if square < least and self.a[edge] != but and self.b[edge] != but:
                    best, least = (edge, fx, fy), square
        return best

    def end_near(self, edge: int, x: float, y: float, reach: float) -> int:
        """Return the bend at an end of an edge that is within reach of a point on it, or -1."""
        for node in (self.a[edge], self.b[edge]):
            near = abs(self.x[node] - x) < reach and abs(self.y[node] - y) < reach
            if near and self.bend[node] and hypot(self.x[node] - x, self.y[node] - y) < reach:
                return node
        return -1

    def _edge(self, a: int, b: int, of: tuple[int, int, int, int]) -> int:
        edge = len(self.a)
        self.a.append(a)
        self.b.append(b)
        self.segment.append((self.x[a], self.y[a], self.x[b], self.y[b]))
        self.way.append(self._way(edge))
        road, kind, step, street = of
        self.road.append(road)
        self.kind.append(kind)
        self.step.append(step)
        self.street.append(street)
        self.at[a].append(edge)
        self.at[b].append(edge)
        self.lines.add(edge, self.segment[edge])
        return edge

    def _way(self, edge: int) -> tuple[float, float]:
        ax, ay, bx, by = self.segment[edge]
        length = hypot(bx - ax, by - ay)
        return ((bx - ax) / length, (by - ay) / length)


def cell_side(lengths: list[float], radius: float, most: float) -> float:
    """Return a side for the cells: about a street long, and not too many for long lines.

    Parameters
    ----------
    lengths
        Lengths of the streets that rules draw, metres.
    radius
        Within which nodes are joined, metres.
    most
        Length of all that there is already, metres.
    """
    middle = sorted(lengths)[len(lengths) // 2] if lengths else 1.0
    return max(middle, radius, most / 1e6)
