"""The layers of game levels; see `fields`."""

from __future__ import annotations

from .fields import Field, LayerKind

_BLOCK = Field("block_id", "integer", "number of the block, from 1")
_ALONG = Field("from_start_m", "number", "distance from the start along the route, in metres")
BLOCKS = LayerKind(
    "blocks",
    "Blocks",
    "Polygon",
    (
        _BLOCK,
        Field("template", "text", "name of its shape"),
        Field("colour", "text", "colour of its shape, as #rrggbb"),
        Field("use", "text", "what its shape is for, where it says so"),
        Field("order", "integer", "place along the route, from 1 at the start"),
        Field("role", "text", "start, goal, treasure (one passage only), or empty"),
        Field("degree", "integer", "number of blocks that a passage leads to"),
        Field("area_m2", "number", "area in square metres"),
        _ALONG,
    ),
    "level_blocks",
)
ROUTE = LayerKind(
    "route",
    "Route",
    "LineString",
    (
        Field("route_id", "integer", "number of the piece, from 1"),
        Field("block_id", "integer", "block that it runs through"),
        Field("length_m", "number", "length in metres"),
        _ALONG,
    ),
    "level_route",
)
DOORS = LayerKind(
    "doors",
    "Doors",
    "Point",
    (
        Field("door_id", "integer", "number of the door, from 1"),
        Field("block_a", "integer", "block on one side"),
        Field("block_b", "integer", "block on the other side"),
        _ALONG,
    ),
    "level_doors",
)
ENDS = LayerKind(
    "sinks",
    "Start and goal",
    "Point",
    (
        Field("sink_id", "integer", "number, from 1"),
        Field("role", "text", "start or goal"),
        Field("block_id", "integer", "block that it lies in"),
        _ALONG,
        Field("is_sink", "yes/no", "whether it was asked for; a goal may be found, too"),
    ),
    "level_ends",
)
ADJACENCY = LayerKind(
    "adjacency",
    "Connected blocks",
    "NoGeometry",
    (
        Field("block_a", "integer", "a block"),
        Field("block_b", "integer", "a block that the route enters from it"),
        Field("door_id", "integer", "door between them"),
        Field("x", "number", "place of the door in the CRS of the layers"),
        Field("y", "number", "the same, upwards"),
    ),
    "",
)
