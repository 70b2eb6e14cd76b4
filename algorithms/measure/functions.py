"""Checks of what a network is asked as a whole: exits, metres, ways out, spacing of junctions.

Streets as drawn are straightened and trimmed, so that their lengths differ a little from those
that the design counted: limits may be missed by `TOLERANCE`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree
from shapely.geometry import Point

from .distances import distances_to_sinks
from .graph import BoolArray, FloatArray, IntArray
from .layers import TOUCH, StreetLayer
from .problems import Problem
from .surroundings import Surroundings

#: Share by which lengths may miss a limit.
TOLERANCE = 0.03
#: Searches for near junctions run over this many at a time, to bound the memory.
BATCH = 256


@dataclass(frozen=True)
class SiteFeatures:
    """The polygons for each of which exits and metres are counted.

    Attributes
    ----------
    labels
        Feature ids; one empty text where there is no site.
    shapes
        Polygons in the working CRS; empty where there is no site.
    """

    labels: tuple[str, ...]
    shapes: tuple[shapely.Geometry, ...]

    def owners(self, streets: StreetLayer) -> IntArray:
        """Tell the nearest polygon to the middle of each edge, shape (e,)."""
        lines = np.array(streets.graph.lines, dtype=object)
        if len(self.shapes) < 2 or not len(lines):
            return np.zeros(len(lines), dtype=np.int64)
        middles = shapely.line_interpolate_point(lines, 0.5, normalized=True)
        return np.asarray(shapely.STRtree(self.shapes).nearest(middles), dtype=np.int64)

    def name(self, k: int) -> str:
        """Name a polygon in a sentence."""
        return f"site {self.labels[k]}" if len(self.labels) > 1 else "the site"


def too_many_exits(
    streets: StreetLayer, around: Surroundings, sinks: BoolArray, sites: SiteFeatures, most: int
) -> list[Problem]:
    """List sites that new streets leave in too many places.

    A place is where new streets meet existing ones or the edge of the site where it is an exit.
    A connector and both its ends are one place, and so are places within `TOUCH`. Where they meet
    a street that lies inside the site, further from its edge than the snap distance, they do not
    leave it.

    Parameters
    ----------
    streets, around
        The streets and the site.
    sinks
        Shape (n,). Where traffic leaves.
    sites
        The polygons, each with its own count.
    most
        Greatest number of places.
    """
    places = exit_places(streets, around, sinks)
    owner = sites.owners(streets)
    found = []
    for k in range(len(sites.labels)):
        mine = [place for place in places if (owner[place[1]] == k).any()]
        if len(mine) <= most:
            continue
        text = (
            f"New streets leave {sites.name(k)} in {len(mine)} places; "
            f"{most} {'is' if most == 1 else 'are'} asked for at most."
        )
        names = streets.names_of([e for _, edges in mine for e in edges])
        points = shapely.MultiPoint([at for at, _ in mine])
        found.append(Problem("exits", text, points, names))
    return found


def exit_places(
    streets: StreetLayer, around: Surroundings, sinks: BoolArray
) -> list[tuple[Point, list[int]]]:
    """List each place where designed streets leave, with their edges."""
    graph = streets.graph
    door = (sinks | around.sink_nodes(streets)) & _at(streets, ~streets.existing)
    if not around.site.is_empty:
        points = shapely.points(graph.nodes)
        deep = shapely.distance(points, around.site.boundary) > around.snap_distance
        deep &= shapely.contains_xy(around.site, graph.nodes)
        door &= ~(deep & _at(streets, streets.existing))
    near = cKDTree(graph.nodes).query_pairs(TOUCH, output_type="ndarray")
    near = near[door[near].all(axis=1)] if len(near) else near.reshape(0, 2)
    label = _merged(len(graph.nodes), np.vstack([graph.ends[streets.connector], near]))
    found: dict[int, list[int]] = {k: [] for k in np.unique(label[door]).tolist()}
    for e in np.flatnonzero(streets.designed).tolist():
        for k in {int(label[v]) for v in graph.ends[e]} & set(found):
            found[k].append(e)
    return [
        (Point(graph.nodes[door & (label == k)].mean(axis=0)), edges)
        for k, edges in found.items()
        if edges
    ]


def over_budget(streets: StreetLayer, sites: SiteFeatures, budget: float) -> list[Problem]:
    """List sites whose new streets are longer together than a number of metres."""
    owner, lengths = sites.owners(streets), streets.graph.lengths
    found = []
    for k in range(len(sites.labels)):
        edges = np.flatnonzero(streets.designed & (owner == k)).tolist()
        total = float(lengths[edges].sum())
        if total <= budget * (1 + TOLERANCE):
            continue
        text = (
            f"The new streets of {sites.name(k)} are {total:.0f} m long, "
            f"{total - budget:.0f} m more than the budget of {budget:g} m."
        )
        shape = shapely.MultiLineString([streets.graph.lines[e] for e in edges])
        found.append(Problem("length budget", text, shape, streets.names_of(edges)))
    return found


def too_far(streets: StreetLayer, sinks: BoolArray, most: float) -> list[Problem]:
    """List ends of new streets from which the way out is longer than a number of metres.

    Ways lead along the streets and with the traffic; connectors do not count. Ends on existing
    streets and ends without any way out are not listed.
    """
    graph = streets.graph
    bare = np.where(streets.connector, 0.0, graph.lengths)
    distance = distances_to_sinks(graph, sinks, bare, streets.direction)
    incident = graph.incident()
    found = []
    hit = np.isfinite(distance) & (distance > most * (1 + TOLERANCE))
    for v in np.flatnonzero(
        hit & _at(streets, streets.designed) & ~_at(streets, ~streets.designed)
    ):
        text = f"The way out from here is {distance[v]:.0f} m long; {most:g} m are asked for."
        at = Point(graph.nodes[v])
        found.append(Problem("way out", text, at, streets.names_of(incident[v])))
    return found


def junctions_too_near(streets: StreetLayer, spacing: float) -> list[Problem]:
    """List pairs of junctions that are nearer along streets than a number of metres.

    A junction is a place where three or more streets meet, existing ones included; a connector
    is no street and both its ends are one place. Pairs that existing streets alone make are
    left out.
    """
    graph = streets.graph
    label = _merged(len(graph.nodes), graph.ends[streets.connector])
    ends, least = label[graph.ends], spacing * (1 - TOLERANCE)
    old = {(u, v) for u, v, _ in _near_pairs(ends, graph.lengths, streets.existing, least)}
    incident: dict[int, list[int]] = {}
    for e in np.flatnonzero(~streets.connector).tolist():
        for v in ends[e].tolist():
            incident.setdefault(v, []).append(e)
    place = {int(k): graph.nodes[label == k].mean(axis=0) for k in np.unique(label)}
    found = []
    for u, v, gap in _near_pairs(ends, graph.lengths, ~streets.connector, least):
        if (u, v) in old:
            continue
        text = f"Two junctions are {gap:.0f} m apart along the streets, less than {spacing:g} m."
        edges = [e for e in incident[u] + incident[v] if streets.designed[e]]
        names = streets.names_of(edges or incident[u] + incident[v])
        at = shapely.MultiPoint([place[u], place[v]])
        found.append(Problem("junction spacing", text, at, names))
    return found


def _near_pairs(
    ends: IntArray, lengths: FloatArray, use: BoolArray, least: float
) -> list[tuple[int, int, float]]:
    """List pairs of nodes with three or more of some edges that are nearer than a distance."""
    if not use.any():
        return []
    count = int(ends.max()) + 1
    many = np.flatnonzero(np.bincount(ends[use].ravel(), minlength=count) >= 3)
    pairs, size = np.sort(ends[use], axis=1), np.maximum(lengths[use], 1e-9)
    order = np.lexsort((size, pairs[:, 1], pairs[:, 0]))
    _, first = np.unique(pairs[order], axis=0, return_index=True)
    kept = order[first]
    links = coo_array((size[kept], pairs[kept].T), shape=(count, count)).tocsr()
    found = []
    for begin in range(0, len(many), BATCH):
        some = many[begin : begin + BATCH]
        gaps = dijkstra(links, directed=False, indices=some, limit=least)[:, many]
        for i, j in np.argwhere(gaps < least).tolist():
            if some[i] < many[j]:
                found.append((int(some[i]), int(many[j]), float(gaps[i, j])))
    return found


def _at(streets: StreetLayer, edges: BoolArray) -> BoolArray:
    """Mark the nodes of edges, shape (n,)."""
    mark = np.zeros(len(streets.graph.nodes), dtype=bool)
    mark[streets.graph.ends[edges].ravel()] = True
    return mark


def _merged(count: int, pairs: IntArray) -> IntArray:
    """Label nodes so that those of each pair are one, shape (n,)."""
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)).tocsr()
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
