"""Network distances of junctions to where traffic leaves, along the streets as they are drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy.sparse as sparse
import shapely
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import LineString

from ..network.problem import FloatArray
from .joints import Connector
from .pieces import Piece
from .survey import Ground

#: A junction this near to an existing street lies on it (metres).
ON = 0.2
#: Ends of existing streets nearer than this are one (metres).
SAME = 0.01

#: From, to, metres, and whether that is the only direction.
Way = tuple[int, int, float, bool]


def node_distances(
    ground: Ground,
    pieces: Sequence[Piece],
    connectors: Sequence[Connector],
    exits: frozenset[int],
) -> dict[int, float]:
    """Distance of every junction to its nearest sink, metres; infinite if there is none.

    Parameters
    ----------
    ground
        The site and its mesh.
    pieces
        The designed streets.
    connectors
        What carries them on to the centre lines of existing ones.
    exits
        Junctions besides those of the mesh where traffic leaves.
    """
    nodes = {v for p in pieces for v in (p.start, p.end)}
    kept = ground.mesh.edges[ground.street]
    if len(kept) and ground.sinks[kept].all():
        # whoever reaches an existing street has left
        ways = [(p.start, p.end, float(p.line.length), p.one_way) for p in pieces]
        sinks = {v for v in nodes if v < 0 or _is_sink(ground, v)} | (exits & nodes)
    else:
        places, reach = sink_places(ground), ground.mesh.edge_length / 2
        network = _Network(ground, pieces, connectors)
        sinks = {v for v in nodes if v in exits or _is_sink(ground, v)}
        sinks |= network.nearest(places, reach)
        if not sinks:
            # all exits lie in the middle of existing streets
            network = _Network(ground, pieces, connectors, places)
            sinks = network.nearest(places, reach)
        ways = network.ways
    found = _shortest(ways, sinks)
    return {v: found.get(v, math.inf) for v in nodes}


def sink_places(ground: Ground) -> FloatArray:
    """Places where traffic leaves, shape (k, 2), metres: sinks of the mesh and access points.

    An access point at which no mesh line ends is one, too: existing streets lead to it.
    """
    places = ground.mesh.vertices[ground.sinks]
    return places if ground.exits else np.vstack([places, ground.site.access_xy])


def _is_sink(ground: Ground, v: int) -> bool:
    return 0 <= v < len(ground.sinks) and bool(ground.sinks[v])


def _shortest(ways: Sequence[Way], sinks: set[int]) -> dict[int, float]:
    """Shortest way from every node to a sink."""
    names = sorted({v for way in ways for v in way[:2]})
    place = {v: i for i, v in enumerate(names)}
    starts = sorted(place[v] for v in sinks if v in place)
    if not starts:
        return {}
    # parallel ways between two nodes: the shorter one counts
    best: dict[tuple[int, int], float] = {}
    for u, v, length, one_way in ways:
        # from the sinks the search runs against the traffic
        for a, b in ((v, u),) if one_way else ((u, v), (v, u)):
            pair = (place[a], place[b])
            best[pair] = min(max(length, 1e-9), best.get(pair, math.inf))
    rows, columns = np.array(list(best)).T
    graph = sparse.coo_matrix((list(best.values()), (rows, columns)), shape=(len(names),) * 2)
    found = dijkstra(graph.tocsr(), indices=starts, min_only=True)
    return {v: float(found[i]) for v, i in place.items()}


class _Network:
    """Designed streets, connectors and existing streets, joined where they meet.

    Existing streets are cut at places that are given, too, each at its nearest point.
    """

    def __init__(
        self,
        ground: Ground,
        pieces: Sequence[Piece],
        connectors: Sequence[Connector],
        cuts: FloatArray | None = None,
    ) -> None:
        self.ways: list[Way] = [(p.start, p.end, float(p.line.length), p.one_way) for p in pieces]
        self.places: dict[int, FloatArray] = {}
        for p in pieces:
            course = shapely.get_coordinates(p.line)
            self.places[p.start], self.places[p.end] = course[0], course[-1]
        self.fresh = max([len(ground.mesh.vertices), *self.places]) + 1
        for joint in connectors:
            outer = self._add(shapely.get_coordinates(joint.line)[-1])
            self.ways.append((joint.node, outer, float(joint.line.length), False))
        lines = _existing(ground)
        if cuts is not None:
            self._cut(lines, cuts)
        self._join(lines)

    def nearest(self, points: FloatArray, reach: float) -> set[int]:
        """Nodes nearest to points, where there is one within reach."""
        names = list(self.places)
        places = np.array([self.places[v] for v in names]).reshape(-1, 2)
        found = set()
        for xy in points:
            gap = np.hypot(*(places - xy).T)
            if len(gap) and gap.min() <= reach:
                found.add(names[int(gap.argmin())])
        return found

    def _add(self, xy: FloatArray) -> int:
        node, self.fresh = self.fresh, self.fresh + 1
        self.places[node] = xy
        return node

    def _cut(self, lines: Sequence[LineString], points: FloatArray) -> None:
        """Make places of the points of existing streets that are nearest to the given ones."""
        for xy in points if lines else ():
            here = shapely.Point(xy)
            line = lines[int(shapely.distance(np.array(lines, dtype=object), here).argmin())]
            self._add(shapely.get_coordinates(line.interpolate(line.project(here)))[0])

    def _join(self, lines: Sequence[LineString]) -> None:
        """Cut existing streets where the others meet them, and add their pieces."""
        meeting = dict(self.places)
        ends: dict[tuple[int, int], int] = {}
        for line in lines:
            course = shapely.get_coordinates(line)
            stops = []
            for at, xy in ((0.0, course[0]), (float(line.length), course[-1])):
                key = (round(xy[0] / SAME), round(xy[1] / SAME))
                if key not in ends:
                    ends[key] = self._add(xy)
                stops.append((at, ends[key]))
            for node, xy in meeting.items():
                here = shapely.Point(xy)
                if line.distance(here) <= ON:
                    stops.append((float(line.project(here)), node))
            stops.sort()
            self.ways += [(u, v, b - a, False) for (a, u), (b, v) in zip(stops, stops[1:])]


def _existing(ground: Ground) -> list[LineString]:
    """Existing streets cut where they meet each other; without roads the edge they run along."""
    site = ground.site
    lines = [street.line for street in (*site.boundary_streets, *site.inner_streets)]
    lines = lines or list(site.street_frontage.geoms)
    if not lines:
        return []
    return list(shapely.get_parts(shapely.union_all(np.array(lines, dtype=object))))
