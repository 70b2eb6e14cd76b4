"""Whether streets may lie where smoothing has put them, and where they may not.

What is compared is always the drawing that came in: crossings that were there, a street that ran
over an obstacle before, or a bridge, are no fault of smoothing; what is new is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import shapely

from ..network.problem import BoolArray, FloatArray, IntArray
from .angles import leg_directions, rotation
from .smooth_graph import Geometries, StreetNet

#: A street may be longer over an obstacle, or outside the site, by this than it was (metres).
SLACK = 0.02
#: A street comes no nearer to an obstacle than this, or than it was (metres): half its width.
KEEP_OFF = 6.0
#: A street between two nodes keeps at least this share of its length.
LEAST_LENGTH = 0.5
#: A leg turns by less than this at its junction (degrees).
MOST_TURN = 75.0


@dataclass
class Faults:
    """Where edges are as they must not be.

    Attributes
    ----------
    edges
        Edges with a fault, one entry for each.
    places
        Where on it: a geometry, or None for all of the edge.
    """

    edges: list[int] = field(default_factory=list)
    places: list[shapely.Geometry | None] = field(default_factory=list)

    def __bool__(self) -> bool:
        """Tell whether there is any."""
        return bool(self.edges)

    def add(self, edges: Iterable[int], places: Iterable[shapely.Geometry | None]) -> None:
        """Note faults."""
        for edge, place in zip(edges, places):
            self.edges.append(int(edge))
            self.places.append(place)


class Guard:
    """Knows a network as it came, and finds what has become worse.

    Parameters
    ----------
    net
        The streets.
    most
        Furthest that a street may move, metres.
    obstacles
        Shape (k,). Polygons without streets.
    site
        Ground that streets must not leave.
    """

    def __init__(
        self,
        net: StreetNet,
        most: float,
        obstacles: Geometries | None = None,
        site: shapely.Geometry | None = None,
    ) -> None:
        self.net, self.most = net, most
        i, j = shapely.STRtree(net.lines).query(
            net.lines, predicate="dwithin", distance=2 * most + 1.0
        )
        self.pairs: tuple[IntArray, IntArray] = (i[i < j], j[i < j])
        none = np.zeros(0, dtype=object)
        self.obstacles = shapely.STRtree(none if obstacles is None else obstacles)
        self.site = None if site is None or site.is_empty else site
        if self.site is not None:
            shapely.prepare(self.site)
        every = np.arange(len(net.lines))
        self.meetings, _ = self._meetings(net.lines, *self.pairs)
        self.simple = shapely.is_simple(net.lines)
        self.over, _ = self._over(net.lines, every)
        self.gap, _ = self._gap(net.lines, every)
        self.outside, _ = self._outside(net.lines, every)
        self.lengths = net.lengths
        self.rotation = rotation(net, net.lines)
        self.away = leg_directions(net.lines)

    def faults(self, lines: Geometries, changed: BoolArray | None = None) -> Faults:
        """Find where streets are as they must not be.

        Parameters
        ----------
        lines
            Shape (e,). The streets as they are now; those that did not move are the very
            geometries of the network.
        changed
            Shape (e,). Edges that are not as they were when no fault was found with them; None
            for all.
        """
        moved = np.array([a is not b for a, b in zip(lines, self.net.lines)], dtype=bool)
        new = moved.copy() if changed is None else changed
        found = Faults()
        if new.any():
            self._crossing(lines, moved, new, found)
            self._ground(lines, np.flatnonzero(moved & new), found)
            self._shape(lines, moved & new, found)
        return found

    def _crossing(
        self, lines: Geometries, moved: BoolArray, changed: BoolArray, found: Faults
    ) -> None:
        """Note edges that meet others, or themselves, where they did not."""
        own = np.flatnonzero(moved & changed & self.simple)
        own = own[~shapely.is_simple(lines[own])]
        found.add(own, [None] * len(own))
        i, j = self.pairs
        some = np.flatnonzero(changed[i] | changed[j])
        now, shared = self._meetings(lines, i[some], j[some])
        new = (now != self.meetings[some]).any(axis=1)
        for edges in (i[some[new]], j[some[new]]):
            mine = moved[edges]
            found.add(edges[mine], shared[new][mine])

    def _ground(self, lines: Geometries, moved: IntArray, found: Faults) -> None:
        """Note edges on or near obstacles, outside the site, or too far from their start."""
        over, where = self._over(lines, moved)
        worse = over > self.over[moved] + SLACK
        found.add(moved[worse], where[worse])
        gap, where = self._gap(lines, moved)
        worse = gap < np.minimum(KEEP_OFF, self.gap[moved]) - SLACK
        found.add(moved[worse], where[worse])
        out, where = self._outside(lines, moved)
        worse = out > self.outside[moved] + SLACK
        found.add(moved[worse], where[worse])
        # The distance between two lines is greatest at a vertex of one of them.
        far = shapely.hausdorff_distance(lines[moved], self.net.lines[moved]) > self.most + 1e-6
        found.add(moved[far], [None] * int(far.sum()))

    def _shape(self, lines: Geometries, moved: BoolArray, found: Faults) -> None:
        """Note edges that are crushed, turned over, or in another order around a junction."""
        wrong = shapely.length(lines) < LEAST_LENGTH * self.lengths
        turned = (leg_directions(lines) * self.away).sum(axis=1) < np.cos(np.radians(MOST_TURN))
        wrong |= turned.reshape(-1, 2).any(axis=1)
        wrong |= (rotation(self.net, lines) != self.rotation).reshape(-1, 2).any(axis=1)
        edges = np.flatnonzero(wrong & moved)
        found.add(edges, [None] * len(edges))

    def _meetings(
        self, lines: Geometries, i: IntArray, j: IntArray
    ) -> tuple[FloatArray, Geometries]:
        """How many points pairs of edges have in common, and over what length they are one."""
        found = np.zeros((len(i), 2))
        where = np.full(len(i), None, dtype=object)
        meet = np.asarray(shapely.intersects(lines[i], lines[j]))
        where[meet] = shapely.intersection(lines[i[meet]], lines[j[meet]])
        found[meet, 0] = shapely.get_num_geometries(where[meet])
        found[meet, 1] = np.round(shapely.length(where[meet]), 3)
        return found, where

    def _over(self, lines: Geometries, edges: IntArray) -> tuple[FloatArray, Geometries]:
        """Lengths of edges over obstacles, and where that is."""
        length, where = np.zeros(len(edges)), np.full(len(edges), None, dtype=object)
        if len(self.obstacles):
            i, j = self.obstacles.query(lines[edges], predicate="intersects")
            part = shapely.intersection(lines[edges[i]], self.obstacles.geometries[j])
            np.add.at(length, i, shapely.length(part))
            for k in np.unique(i).tolist():
                where[k] = shapely.union_all(part[i == k])
        return length, where

    def _gap(self, lines: Geometries, edges: IntArray) -> tuple[FloatArray, Geometries]:
        """Distances of edges from the nearest obstacle, as far as they matter, and where."""
        gap, where = np.full(len(edges), KEEP_OFF), np.full(len(edges), None, dtype=object)
        if len(self.obstacles):
            (i, j), near = self.obstacles.query_nearest(
                lines[edges], max_distance=KEEP_OFF, return_distance=True, all_matches=False
            )
            gap[i] = near
            link = shapely.shortest_line(lines[edges[i]], self.obstacles.geometries[j])
            where[i] = shapely.get_point(link, 0)
        return gap, where

    def _outside(self, lines: Geometries, edges: IntArray) -> tuple[FloatArray, Geometries]:
        """Lengths of edges outside the site, and where that is."""
        length, where = np.zeros(len(edges)), np.full(len(edges), None, dtype=object)
        if self.site is not None:
            out = ~np.asarray(shapely.covers(self.site, lines[edges]))
            where[out] = shapely.difference(lines[edges[out]], self.site)
            length[out] = shapely.length(where[out])
        return length, where
