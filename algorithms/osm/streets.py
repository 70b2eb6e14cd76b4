"""A street graph of osmnx becomes streets and intersections with fields for planners.

Boeing, G. (2025): Topological Graph Simplification Solutions to the Street Intersection
Miscount Problem. Transactions in GIS 29 (3), e70037: a street runs from junction to junction.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import geopandas as gpd
import numpy as np
import shapely

from . import tags as read
from .classes import street_level
from .ground import lengths_m
from .shapes import WGS84

WAY_TAGS = (
    "highway", "name", "ref", "lanes", "maxspeed", "oneway", "bridge", "tunnel", "junction",
    "service", "access", "area", "width", "covered", "layer",
)  # fmt: skip
"""Tags of ways that osmnx is to keep."""

#: A street also ends where one of these changes, so that each has one class and one name and a
#: tunnel never passes for a street.
_ENDS_WHERE_DIFFERENT = ("highway", "name", "bridge", "tunnel", "oneway", "covered")

STREET_COLUMNS = (
    "osm_id", "highway", "level", "speed_kmh", "lanes", "oneway", "name", "length_m", "bridge",
    "tunnel",
)  # fmt: skip
INTERSECTION_COLUMNS = ("osm_id", "street_count", "kind")

_SHORTEST = 0.5
_THROUGH = 2


def street_layers(
    osmnx: ModuleType, graph: Any, area: shapely.Geometry
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Simplify a graph and cut its streets to an area.

    Parameters
    ----------
    osmnx
        The module.
    graph
        A `networkx.MultiDiGraph` of osmnx, not simplified, its nodes with street_count. It
        should reach further than the area, so that the streets at its edge are whole.
    area
        Polygon in EPSG:4326.

    Returns
    -------
    streets, intersections : geopandas.GeoDataFrame
        In EPSG:4326, columns as in `STREET_COLUMNS` and `INTERSECTION_COLUMNS`. A street has a
        line for each part inside the area. Intersections are junctions of three or more streets
        and dead ends inside it.
    """
    simple = osmnx.simplification.simplify_graph(
        graph, edge_attrs_differ=_ENDS_WHERE_DIFFERENT, remove_rings=False
    )
    if len(simple.edges) == 0:
        return no_streets()
    undirected = osmnx.convert.to_undirected(simple)
    rows = [data for _, _, data in undirected.edges(data=True)]
    shapely.prepare(area)
    return _streets(rows, area), _intersections(undirected, area)


def _streets(rows: list[dict[str, Any]], area: shapely.Geometry) -> gpd.GeoDataFrame:
    lines = np.array([row["geometry"] for row in rows], dtype=object)
    inside = shapely.intersection(lines, area) if len(lines) else lines
    parts, origin = shapely.get_parts(_merged(inside), return_index=True)
    keep = shapely.get_type_id(parts) == shapely.GeometryType.LINESTRING
    parts, origin = parts[keep], origin[keep]
    table = [_described(rows[k]) for k in origin]
    frame = gpd.GeoDataFrame(
        table, columns=[c for c in STREET_COLUMNS if c != "length_m"], geometry=parts, crs=WGS84
    )
    frame["length_m"] = lengths_m(frame.geometry)
    frame = frame[frame["length_m"] >= _SHORTEST]
    frame = frame.sort_values(["level", "osm_id", "length_m"], kind="stable")
    return frame[[*STREET_COLUMNS, "geometry"]].reset_index(drop=True)


def _merged(lines: Any) -> Any:
    """Join what an intersection has cut at a touch of the border into single lines again."""
    several = shapely.get_type_id(lines) == shapely.GeometryType.MULTILINESTRING
    result = np.asarray(lines, dtype=object).copy()
    result[several] = shapely.line_merge(result[several])
    return result


def _described(row: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a street from the tags of its ways."""
    highway = read.text(row.get("highway"))
    ways = row.get("osmid")
    ids = sorted(set(ways)) if isinstance(ways, (list, tuple, set)) else [ways]
    return {
        "osm_id": ";".join(f"W{way}" for way in ids),
        "highway": highway,
        "level": street_level(highway),
        "speed_kmh": read.speed_kmh(row.get("maxspeed")),
        "lanes": read.lanes(row.get("lanes")),
        "oneway": read.is_yes(row.get("oneway")),
        "name": read.text(row.get("name")) or read.text(row.get("ref")),
        "bridge": read.text(row.get("bridge")),
        "tunnel": _tunnel(row),
    }


def _tunnel(row: dict[str, Any]) -> str | None:
    """Return what the tag tunnel says, or that the street is covered."""
    found = read.text(row.get("tunnel"))
    return "covered" if found is None and read.is_yes(row.get("covered")) else found


def _intersections(graph: Any, area: shapely.Geometry) -> gpd.GeoDataFrame:
    rows = []
    for node, data in graph.nodes(data=True):
        count = int(data.get("street_count", graph.degree(node)))
        if count not in (0, _THROUGH):
            kind = "dead end" if count == 1 else "junction"
            rows.append((f"N{node}", count, kind, data["x"], data["y"]))
    points = shapely.points([row[3:] for row in rows]) if rows else []
    frame = gpd.GeoDataFrame(
        [row[:3] for row in rows], columns=list(INTERSECTION_COLUMNS), geometry=points, crs=WGS84
    )
    return frame[shapely.intersects(frame.geometry.to_numpy(), area)].reset_index(drop=True)


def no_streets() -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Return the layers of streets and intersections of an area that has none."""
    return (
        gpd.GeoDataFrame(columns=list(STREET_COLUMNS), geometry=[], crs=WGS84),
        gpd.GeoDataFrame(columns=list(INTERSECTION_COLUMNS), geometry=[], crs=WGS84),
    )
