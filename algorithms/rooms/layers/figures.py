"""Figures of floor plans, from their layers alone."""

from __future__ import annotations

from collections.abc import Mapping

import geopandas as gpd
import networkx as nx
import numpy as np

#: Metres to which ends of lines are the same; degrees are so fine, too.
DIGITS = 7


def floor_figures(layers: Mapping[str, gpd.GeoDataFrame]) -> dict[str, float]:
    """Sum up floor plans.

    Parameters
    ----------
    layers
        As `collect.floor_layers` gives them, in any CRS.

    Returns
    -------
    dict of str to float
        Of all storeys, and of each with the prefix "floor_<number>_":
        "rooms" and "rooms_<template>", numbers; "gross_m2", the footprint; "net_to_gross", the
        area of rooms and "corridor_share", that of corridors, both as shares of the gross area;
        "corridor_m", length; "mean_egress_m" and "max_egress_m", from doors along corridors to
        the nearest sink; "dead_ends", ends of corridors that are no sinks, "dead_end_m", the
        length of corridors from there to the next branch or sink, and "longest_dead_end_m".
        A mean of nothing is 0.
    """
    found = _figures(layers)
    for storey in sorted({int(k) for k in layers["faces"]["floor"]}):
        own = {name: layer[layer["floor"] == storey] for name, layer in layers.items()}
        found.update({f"floor_{storey}_{key}": value for key, value in _figures(own).items()})
    return found


def _figures(layers: Mapping[str, gpd.GeoDataFrame]) -> dict[str, float]:
    """Sum up the storeys of some layers."""
    rooms, doors = layers["rooms"], layers["doors"]
    net, between, blocked = (
        float(layers[name]["area_m2"].sum()) for name in ("rooms", "corridors", "obstacles")
    )
    gross = net + between + blocked
    away = doors["distance_m"].to_numpy(dtype=np.float64)
    ends = dead_ends(layers["corridor_lines"])
    return {
        "rooms": float(len(rooms)),
        **{
            f"rooms_{name}": float(number)
            for name, number in rooms["template"].value_counts().sort_index().items()
        },
        "gross_m2": gross,
        "net_to_gross": net / gross if gross else 0.0,
        "corridor_share": between / gross if gross else 0.0,
        "corridor_m": float(layers["corridor_lines"]["length_m"].sum()),
        "mean_egress_m": float(away.mean()) if len(away) else 0.0,
        "max_egress_m": float(away.max()) if len(away) else 0.0,
        "dead_ends": float(len(ends)),
        "dead_end_m": float(sum(ends)),
        "longest_dead_end_m": max(ends, default=0.0),
    }


def dead_ends(lines: gpd.GeoDataFrame) -> list[float]:
    """Return the length of each dead end up to the next branch or sink, metres.

    Parameters
    ----------
    lines
        Layer "corridor_lines"; an end with the distance 0 is a sink.
    """
    graph = corridor_graph(lines)
    found = []
    for end in [n for n, degree in graph.degree if degree == 1 and not graph.nodes[n]["sink"]]:
        length, before, now = 0.0, None, end
        while True:
            ahead = [n for n in graph[now] if n != before]
            if len(ahead) != 1:
                break
            length += graph.edges[now, ahead[0]]["length"]
            before, now = now, ahead[0]
            if graph.nodes[now]["sink"]:
                break
        found.append(length)
    return found


def corridor_graph(lines: gpd.GeoDataFrame) -> nx.Graph:
    """Return the corridors as a graph.

    Parameters
    ----------
    lines
        Layer "corridor_lines".

    Returns
    -------
    networkx.Graph
        Nodes are (storey, x, y), rounded, with "sink"; edges have "length" in metres.
    """
    graph = nx.Graph()
    columns = [lines[name] for name in ("floor", "length_m", "from_m", "to_m")]
    for line, floor, length, first, last in zip(lines.geometry, *columns):
        ends = []
        for point, far in ((line.coords[0], first), (line.coords[-1], last)):
            node = (int(floor), round(point[0], DIGITS), round(point[1], DIGITS))
            graph.add_node(node, sink=far == 0)
            ends.append(node)
        graph.add_edge(*ends, length=float(length))
    return graph
