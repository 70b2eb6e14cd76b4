"""The layers of streets that grow; see `fields`."""

from __future__ import annotations

from .fields import Field, LayerKind

_STATE = "road type (main, large, small) and node type (start, leaf, twig, branch, done, edge)"
_APPEARED = Field(
    "appeared",
    "date and time",
    "day of its iteration, from 1 January 2000 on, for the temporal controller",
)
_ROAD_TYPE = Field("road_type", "text", "main, large or small; empty for what was there before")
_ITERATION = Field("iteration", "integer", "iteration in which it appeared; 0 where it was there")
STREETS = LayerKind(
    "streets",
    "Streets",
    "LineString",
    (
        Field("street_id", "integer", "number of the street, from 1"),
        Field("status", "text", "new, or existing"),
        Field("level", "integer", "1 main or major, 2 large or collector, 3 small or local"),
        Field("level_name", "text", "major, collector or local"),
        Field("road", "integer", "number of the road that it is a part of; empty for existing"),
        _ROAD_TYPE,
        _ITERATION,
        Field("length_m", "number", "length in metres"),
        Field("start_state", "text", f"state of the node where it begins: {_STATE}"),
        Field("end_state", "text", "state of the node where it ends"),
        Field("dist_to_sink_m", "number", "shortest way to an existing street, mean of both ends"),
        Field("dist_start_m", "number", "the same from the first point of the line, m"),
        Field("dist_end_m", "number", "the same from the last point of the line, m"),
        Field("direction", "integer", "way out: 1 along the line, -1 against it, 0 level"),
        Field("speed_kmh", "number", "design speed in km/h"),
        Field("name", "text", "name of the street, where it has one"),
        _APPEARED,
    ),
    "grown_streets",
)
NODES = LayerKind(
    "nodes",
    "Nodes",
    "Point",
    (
        Field("node_id", "integer", "number of the node, from 1"),
        Field("state", "text", f"{_STATE}; empty where it did not grow"),
        Field("node_type", "text", "start, leaf, twig, branch, done or edge"),
        _ROAD_TYPE,
        _ITERATION,
        Field("degree", "integer", "number of streets that meet here"),
        Field(
            "road",
            "integer",
            "number of the road that reached it; empty where growth began or cut a street",
        ),
        Field(
            "kind",
            "text",
            "junction, bend, dead end, join (existing street), at the edge (of the site)",
        ),
        _APPEARED,
    ),
    "grown_nodes",
    on_request=True,
)
ROADS = LayerKind(
    "roads",
    "Roads",
    "MultiLineString",
    (
        Field("road", "integer", "number of the road"),
        Field("road_type", "text", "main, large or small: that of most of its length"),
        Field("level", "integer", "1 main, 2 large, 3 small"),
        Field("segments", "integer", "number of its streets"),
        Field("length_m", "number", "length in metres"),
        Field("first_iteration", "integer", "iteration in which its first street appeared"),
        Field("last_iteration", "integer", "iteration in which its last street appeared"),
        Field("junctions", "integer", "number of junctions along it"),
        _APPEARED,
    ),
    "grown_roads",
    on_request=True,
)
BLOCKS = LayerKind(
    "blocks",
    "Blocks",
    "Polygon",
    (
        Field("block_id", "integer", "number of the block, from 1"),
        Field("area_m2", "number", "area in square metres"),
        Field("perimeter_m", "number", "perimeter in metres"),
        Field("width_m", "number", "short side of the smallest rectangle around it, m"),
        Field("length_m", "number", "long side of that rectangle, m"),
        Field("sides", "integer", "number of different roads around it"),
        Field("enclosed", "text", "streets, or edge where the edge of the site closes it"),
        Field("compactness", "number", "4 pi area / perimeter^2; 1 for a circle"),
        Field("iteration", "integer", "iteration in which the last street around it appeared"),
        _APPEARED,
    ),
    "blocks",
)
STEPS = LayerKind(
    "steps",
    "Iterations",
    "NoGeometry",
    (
        Field("iteration", "integer", "number of the iteration, from 1"),
        Field("nodes", "integer", "number of new nodes after it"),
        Field("segments", "integer", "number of new streets between nodes after it"),
        Field("length_m", "number", "length of the new streets after it, in metres"),
        Field("population", "integer", "people that they stand for"),
        Field("growing", "integer", "nodes that may still grow"),
        Field("seconds", "number", "time since growth began"),
    ),
    "",
    on_request=True,
)
