"""Small networks for the tests of traffic, and a slow assignment that shares no code with ours."""

from __future__ import annotations

import itertools

import geopandas as gpd
import networkx as nx
import numpy as np
import shapely
import shapely.affinity
from platwright.traffic.types import Demand, Places, TrafficNetwork
from pyproj import CRS
from shapely.geometry import LineString

UTM = CRS.from_epsg(32633)
#: Where the small layers lie, metres: a UTM zone is true to 0.1 % near its middle only.
EAST, NORTH = 500_000.0, 5_500_000.0


def moved(shape):
    """A shape that was given around (0, 0), where the layers lie."""
    return shapely.affinity.translate(shape, EAST, NORTH)


def layer(lines, crs=32633, **columns):
    """A layer of streets from lists of points."""
    shapes = [moved(LineString(line)) for line in lines]
    return gpd.GeoDataFrame(columns, geometry=shapes, crs=crs)


def sites(*shapes, crs=32633, **columns):
    """A layer of any shapes around (0, 0)."""
    return gpd.GeoDataFrame(columns, geometry=[moved(shape) for shape in shapes], crs=crs)


def grid(columns, rows, step=100.0):
    """Streets of a grid, one line for each side of a block."""
    lines = [
        [(i * step, j * step), ((i + 1) * step, j * step)]
        for i, j in itertools.product(range(columns), range(rows + 1))
    ]
    lines += [
        [(i * step, j * step), (i * step, (j + 1) * step)]
        for i, j in itertools.product(range(columns + 1), range(rows))
    ]
    return layer(lines)


def network(count, links, times, capacities=None, *, one_way=True):
    """A network of straight pieces whose free time, in seconds, is given; nodes lie on a circle.

    Lengths are those of the drawing; the speed is what makes the time right.
    """
    turn = 2 * np.pi * np.arange(count) / count
    nodes = 1000 * np.column_stack([np.cos(turn), np.sin(turn)])
    ends = np.array(links, dtype=np.int64).reshape(-1, 2)
    lines = np.array([LineString(nodes[list(pair)]) for pair in ends], dtype=object)
    many = len(ends)
    return TrafficNetwork(
        nodes=nodes,
        ends=ends,
        lines=lines,
        feature=np.arange(many),
        direction=np.full(many, 1 if one_way else 0),
        speed=shapely.length(lines) / np.asarray(times, dtype=float),
        capacity=np.full(many, 1000.0) if capacities is None else np.asarray(capacities, float),
        lanes=np.ones(many, dtype=np.int64),
        level=np.full(many, 3),
        existing=np.zeros(many, dtype=bool),
        crs=UTM,
    )


def gates(streets, nodes):
    """Gates at nodes of a network."""
    piece = [int(np.argwhere(streets.ends == node)[0][0]) for node in nodes]
    side = [int(np.argwhere(streets.ends == node)[0][1]) for node in nodes]
    along = np.where(np.array(side) == 0, 0.0, streets.length[piece])
    names = np.array([str(node) for node in nodes], dtype=object)
    return Places(
        np.array(piece), along, np.array(nodes, dtype=np.int64), np.zeros(len(nodes)), names
    )


def between_nodes(streets, table):
    """Demand between all nodes that a table {(from, to): vehicles/h} names."""
    nodes = sorted({node for pair in table for node in pair})
    trips = np.zeros((len(nodes), len(nodes)))
    for (start, end), vehicles in table.items():
        trips[nodes.index(start), nodes.index(end)] = vehicles
    return Demand(gates(streets, nodes), {"boundary-boundary": trips})


def slow_times(streets, places):
    """Least times between all places, shape (p, p), by networkx, place by place."""
    graph = nx.MultiDiGraph()
    stops = [[] for _ in streets.lines]
    for k in range(len(places.piece)):
        if places.node[k] < 0:
            stops[places.piece[k]].append((float(places.along[k]), ("place", k)))
    for e, (u, v) in enumerate(streets.ends.tolist()):
        chain = [(0.0, u), *sorted(stops[e]), (float(streets.length[e]), v)]
        for (a, one), (b, other) in zip(chain, chain[1:]):
            if streets.direction[e] >= 0:
                graph.add_edge(one, other, time=(b - a) / streets.speed[e])
            if streets.direction[e] <= 0:
                graph.add_edge(other, one, time=(b - a) / streets.speed[e])
    names = [
        int(places.node[k]) if places.node[k] >= 0 else ("place", k)
        for k in range(len(places.piece))
    ]
    found = np.full((len(names), len(names)), np.inf)
    for i, start in enumerate(names):
        far = nx.single_source_dijkstra_path_length(graph, start, weight="time")
        for j, end in enumerate(names):
            found[i, j] = far.get(end, np.inf)
    return found


def surplus(sections, loads, demand):
    """What flows out of each node less what flows in, by kind, and what the trips ask for."""
    kinds = range(len(loads.kinds))
    out = np.array(
        [
            np.bincount(sections.start, loads.flow[c], minlength=sections.nodes)
            - np.bincount(sections.end, loads.flow[c], minlength=sections.nodes)
            for c in kinds
        ]
    )
    asked = np.zeros_like(out)
    for c, kind in enumerate(loads.kinds):
        trips = demand.trips[kind]
        np.add.at(asked[c], sections.place, trips.sum(axis=1) - trips.sum(axis=0))
    return out, asked
