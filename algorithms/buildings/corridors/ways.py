"""Where corridors may run, and the shortest ways there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry
from shapely.ops import nearest_points

from ...site import Site
from ..types import Floats

#: Centre lines keep half their width and so much more from the edge and from obstacles (metres).
CLEARANCE = 5.0
#: Corners of the ground that do not count (metres).
ROUGH = 2.0
#: With more corners than this the ground is drawn more roughly.
MOST_CORNERS = 160
#: A way may be so much longer than the straight line, and so many metres more.
LONGER, LONGER_M = 1.35, 30.0
#: So many clearances around its entry a street may leave the ground.
MOUTH = 2.5


class Ways:
    """The ground of a site on which centre lines may run.

    Parameters
    ----------
    site
        A prepared site.
    width_m
        Width of corridors, metres.
    """

    def __init__(self, site: Site, width_m: float) -> None:
        self.clear = width_m / 2 + CLEARANCE
        solid = site.polygon
        if site.obstacles:
            solid = shapely.difference(solid, site.obstacle_union)
        self.solid = solid
        self.ground: BaseGeometry = shapely.buffer(solid, -self.clear, join_style="mitre")
        for rough in (ROUGH, 2 * ROUGH, 4 * ROUGH, 8 * ROUGH):
            plain = shapely.simplify(self.ground, rough)
            self._corners = shapely.get_coordinates(plain)
            if len(self._corners) <= MOST_CORNERS:
                break
        # corners of the plain ground may lie a little outside
        self._ground = shapely.buffer(self.ground, 0.5 * ROUGH + 0.01)
        shapely.prepare(self._ground)
        self._seen: tuple[Floats, Floats, Floats] | None = None

    @property
    def nothing(self) -> bool:
        """Tell whether no corridor finds room."""
        return bool(self.ground.is_empty)

    def nearest(self, xy: Floats) -> Floats:
        """Return the nearest place on the ground, shape (2,)."""
        point = Point(xy)
        if shapely.intersects(self.ground, point):
            return xy
        return np.array(nearest_points(self.ground, point)[0].coords[0])

    def way(self, start: Floats, end: Floats, mouths: list[Floats]) -> Floats | None:
        """Find the shortest way between two places.

        Parameters
        ----------
        start, end
            Shape (2,), metres.
        mouths
            Entries around which the way may leave the ground.

        Returns
        -------
        numpy.ndarray or None
            Vertices, shape (n, 2); None where there is no way of fair length.
        """
        region: Any = self._ground
        if mouths:
            discs = shapely.buffer(shapely.points(np.array(mouths)), MOUTH * self.clear)
            opening = shapely.intersection(shapely.union_all(discs), self.solid)
            region = shapely.buffer(shapely.union(region, opening), 0.1)
            shapely.prepare(region)
        straight = math.dist(start, end)
        if shapely.covers(region, LineString([start, end])):
            return np.array([start, end])
        if len(self._corners) == 0:
            return None
        i, j, length = self._visible()
        n = len(self._corners)
        ends = np.array([start, end])
        lines = np.stack([np.repeat(ends, n, axis=0), np.tile(self._corners, (2, 1))], axis=1)
        reach = np.hypot(*(lines[:, 1] - lines[:, 0]).T)
        use = reach < LONGER * straight + LONGER_M
        use[use] = shapely.covers(region, shapely.linestrings(lines[use]))
        at = np.flatnonzero(use)
        rows = np.concatenate([i, n + at // n])
        cols = np.concatenate([j, at % n])
        # a way of no length is no edge in a sparse matrix
        weights = np.maximum(np.concatenate([length, reach[at]]), 1e-6)
        graph = coo_matrix((weights, (rows, cols)), shape=(n + 2, n + 2)).tocsr()
        far, before = dijkstra(graph, directed=False, indices=n, return_predecessors=True)
        if not far[n + 1] <= LONGER * straight + LONGER_M:
            return None
        steps = [n + 1]
        while steps[-1] != n:
            steps.append(int(before[steps[-1]]))
        return np.vstack([self._corners, ends])[steps[::-1]]

    def _visible(self) -> tuple[Floats, Floats, Floats]:
        """Return which corners see each other: two indices and the distance, each of shape (m,)."""
        if self._seen is None:
            i, j = np.triu_indices(len(self._corners), 1)
            pairs = np.stack([self._corners[i], self._corners[j]], axis=1)
            seen = shapely.covers(self._ground, shapely.linestrings(pairs))
            length = np.hypot(*(pairs[seen, 1] - pairs[seen, 0]).T)
            self._seen = (i[seen], j[seen], length)
        return self._seen
