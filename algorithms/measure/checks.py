"""Checks of a street network in itself: connection, junctions, local shape, distances.

The definitions are those of CND section 4, read from geometry: a dead end is a node with one
street that is no sink; a branch has three or more; a T-junction exactly three.
"""

from __future__ import annotations

import math

import networkx as nx
import numpy as np
import shapely
from shapely.geometry import Point

from .distances import at_ends, distances_to_sinks, farthest_along
from .graph import BoolArray, Chain, FloatArray, IntArray
from .layers import StreetLayer
from .problems import Problem
from .turns import too_close, zigzags

#: Streets of this level and above may end blindly (cul-de-sacs).
CUL_DE_SAC = 4


def geometry_faults(streets: StreetLayer) -> list[Problem]:
    """List features without a line, crossings without a junction and doubled streets."""
    empty = shapely.GeometryCollection()
    found = [
        Problem("no geometry", f"Street {name} has no usable line.", empty, (name,))
        for name in streets.unusable
    ]
    graph = streets.graph
    # What existing streets do among themselves, on bridges for one, is no fault of a design.
    old = set(np.unique(graph.street[streets.existing]).tolist())
    for conflict in graph.crossings:
        if old >= set(conflict.streets):
            continue
        names = tuple(dict.fromkeys(streets.names[i] for i in conflict.streets))
        text = (
            f"Streets {names[0]} and {names[1]} cross without a junction."
            if len(names) == 2
            else f"Street {names[0]} crosses itself without a junction."
        )
        found.append(Problem("crossing", text, conflict.geometry, names))
    for conflict in graph.overlaps:
        if old >= set(conflict.streets):
            continue
        names = tuple(dict.fromkeys(streets.names[i] for i in conflict.streets))
        text = f"Streets {' and '.join(names)} share {conflict.geometry.length:.0f} m."
        found.append(Problem("overlap", text, conflict.geometry, names))
    return found


def islands(streets: StreetLayer, sinks: BoolArray, *, known: bool) -> list[Problem]:
    """List connected parts of the network from which no sink can be reached (CND 4.1).

    Where it is not known what is a sink the largest part is taken to be connected.
    """
    graph = streets.graph
    label = graph.components()
    if not len(graph.lines):
        return []
    of_edge = label[graph.ends[:, 0]]
    length = np.bincount(of_edge, graph.lengths, minlength=int(label.max()) + 1)
    reached = np.zeros(len(length), dtype=bool)
    reached[label[sinks]] = True
    if not known:
        reached[length.argmax()] = True
    found = []
    for part in np.flatnonzero(~reached & (length > 0)).tolist():
        edges = np.flatnonzero((of_edge == part) & ~streets.existing).tolist()
        if edges:
            text = f"{length[part]:.0f} m of streets have no connection to where traffic leaves."
            shape = shapely.MultiLineString([graph.lines[e] for e in edges])
            found.append(Problem("island", text, shape, streets.names_of(edges)))
    return found


def dead_ends(streets: StreetLayer, sinks: BoolArray) -> list[Problem]:
    """List blind ends of streets; cul-de-sacs (level 4) are meant to have one."""
    graph = streets.graph
    found = []
    incident = graph.incident()
    for v in np.flatnonzero((graph.degrees == 1) & ~sinks).tolist():
        edge = incident[v][0]
        if streets.existing[edge] or streets.level[edge] >= CUL_DE_SAC:
            continue
        name = streets.name(edge)
        text = f"Street {name} ends without a connection."
        found.append(Problem("dead end", text, Point(graph.nodes[v]), (name,)))
    return found


def junctions(streets: StreetLayer, sinks: BoolArray, kind: str) -> list[Problem]:
    """List T-junctions ("t-junction": three streets) or branches ("branch": three or more).

    Sinks and nodes on existing streets do not count.
    """
    graph = streets.graph
    degrees = graph.degrees
    hit = degrees == 3 if kind == "t-junction" else degrees >= 3
    touched = np.zeros(len(graph.nodes), dtype=bool)
    touched[graph.ends[~streets.designed].ravel()] = True
    incident = graph.incident()
    found = []
    for v in np.flatnonzero(hit & ~touched & ~sinks).tolist():
        names = streets.names_of(incident[v])
        text = f"{degrees[v]} streets meet here."
        found.append(Problem(kind, text, Point(graph.nodes[v]), names))
    return found


def zigzag_problems(streets: StreetLayer, chains: list[Chain], edge_length: float) -> list[Problem]:
    """List streets that turn sharply one way and then the other."""
    return [
        Problem(
            "zigzag",
            f"Two opposite sharp turns {line.length:.0f} m apart.",
            line,
            streets.names_of(chain.edges),
        )
        for chain, line in zigzags(chains, edge_length)
    ]


def too_close_problems(
    streets: StreetLayer, chains: list[Chain], edge_length: float
) -> list[Problem]:
    """List streets that run alongside another one at a small distance."""
    return [
        Problem(
            "too close",
            f"Two streets run side by side less than {0.6 * edge_length:.0f} m apart "
            f"for {line.length:.0f} m.",
            line,
            tuple(dict.fromkeys(streets.names_of(one.edges) + streets.names_of(other.edges))),
        )
        for one, other, line in too_close(chains, edge_length)
    ]


def short_streets(streets: StreetLayer, chains: list[Chain], least: float) -> list[Problem]:
    """List streets between two junctions that are shorter than a length in metres."""
    return [
        Problem(
            "short",
            f"The street between two junctions is {chain.line.length:.1f} m long, "
            f"less than {least:g} m.",
            chain.line,
            streets.names_of(chain.edges),
        )
        for chain in chains
        if chain.line.length < least
    ]


def lollipops(streets: StreetLayer, sinks: BoolArray) -> list[Problem]:
    """List rings on a stem: parts with a ring that a single street joins to every sink."""
    graph = streets.graph
    network: nx.Graph[int] = nx.Graph()
    outside = -1
    double: set[tuple[int, int]] = set()
    for u, v in np.sort(graph.ends, axis=1).tolist():
        if network.has_edge(u, v) or u == v:
            double.add((u, v))
        network.add_edge(u, v)
    # Each sink is tied twice to the outside, so that no tie is a bridge by itself.
    for k, v in enumerate(np.flatnonzero(sinks).tolist()):
        for way in (0, 1):
            nx.add_path(network, [v, -2 - 2 * k - way, outside])
    if outside not in network:
        return []
    bridges = [b for b in nx.bridges(network) if tuple(sorted(b)) not in double]
    network.remove_edges_from(bridges)
    part = _labels(network)
    home = part.get(outside, -1)
    inner = np.array([part.get(v, -1) for v in range(len(graph.nodes))])
    same = inner[graph.ends[:, 0]] == inner[graph.ends[:, 1]]
    found = []
    tree = _tree(bridges, part)
    connected = nx.node_connected_component(tree, home) if home in tree else set()
    for label in sorted(set(inner[graph.ends[same, 0]].tolist()) & connected - {home}):
        edges = np.flatnonzero(same & (inner[graph.ends[:, 0]] == label)).tolist()
        if not all(streets.existing[e] for e in edges):
            shape = shapely.MultiLineString([graph.lines[e] for e in edges])
            text = "A ring of streets hangs on a single street."
            found.append(Problem("lollipop", text, shape, streets.names_of(edges)))
    return found


def _labels(network: nx.Graph[int]) -> dict[int, int]:
    return {v: k for k, part in enumerate(nx.connected_components(network)) for v in part}


def _tree(bridges: list[tuple[int, int]], part: dict[int, int]) -> nx.Graph[int]:
    tree: nx.Graph[int] = nx.Graph()
    tree.add_edges_from((part[u], part[v]) for u, v in bridges)
    return tree


def recorded_distances(
    streets: StreetLayer, sinks: BoolArray, distance: FloatArray
) -> list[Problem]:
    """Compare the field `dist_to_sink_m` with distances computed afresh.

    A street's record may mean its start, its end, its middle or its farthest point: it is
    wrong where it lies outside the range of its points by more than 1 m and 1 %. Connectors
    may count with their length or without.
    """
    graph = streets.graph
    known = np.isfinite(streets.recorded) & streets.designed
    if not known.any() or not sinks.any():
        return []
    bare = np.where(streets.connector, 0.0, graph.lengths)
    nearer = distances_to_sinks(graph, sinks, bare, streets.direction)
    low = np.minimum(*at_ends(graph, nearer, streets.direction, bare))
    high = farthest_along(graph, distance, streets.direction)
    found = []
    for street in np.unique(graph.street[known]).tolist():
        edges = np.flatnonzero(known & (graph.street == street))
        value = float(streets.recorded[edges[0]])
        least, most = float(low[edges].min()), float(high[edges].max())
        slack = 1.0 + 0.01 * (most if math.isfinite(most) else 0.0)
        if math.isfinite(least) and least - slack <= value <= most + slack:
            continue
        name = streets.names[street]
        where = f"between {least:.0f} and {most:.0f} m" if math.isfinite(least) else "no way at all"
        text = f"Street {name} records {value:.0f} m to where traffic leaves; found: {where}."
        shape = shapely.MultiLineString([graph.lines[e] for e in edges.tolist()])
        found.append(Problem("distance", text, shape, (name,)))
    return found


def sink_nodes_near(streets: StreetLayer, points: FloatArray, reach: float) -> IntArray:
    """Find for each point the nearest node within a reach; points without one are left out.

    Parameters
    ----------
    streets
        The streets.
    points
        Shape (k, 2), metres.
    reach
        Metres.
    """
    nodes = streets.graph.nodes
    if not len(nodes) or not len(points):
        return np.zeros(0, dtype=np.int64)
    tree = shapely.STRtree(shapely.points(nodes))
    pairs = tree.query_nearest(shapely.points(points), max_distance=reach, all_matches=False)
    return np.asarray(pairs[1], dtype=np.int64)
