"""The layers of floor plans and game levels; see `fields`."""

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
_ROOM = Field("room_id", "integer", "number of the room, from 1")
_STOREY = Field("floor", "integer", "number of the storey")
_WAY = Field("distance_m", "number", "way to the nearest exit along corridors, in metres")
_FOOTPRINT = Field("footprint_id", "integer", "number of the building, from 1")
ROOMS = LayerKind(
    "rooms",
    "Rooms",
    "Polygon",
    (
        _ROOM,
        _FOOTPRINT,
        _STOREY,
        Field("template", "text", "name of its shape"),
        Field("use", "text", "what its shape is for, where it says so"),
        Field("colour", "text", "colour of its shape, as #rrggbb"),
        Field("count_index", "integer", "number among the rooms of its shape on the storey"),
        Field("area_m2", "number", "area without corridors, in square metres"),
        Field("net_width_m", "number", "diameter of the largest circle in it, in metres"),
        _WAY,
        Field("door_side", "text", "side of the room that its door is on, such as N or SE"),
    ),
    "floor_rooms",
)
FLOOR_CORRIDORS = LayerKind(
    "corridors",
    "Corridors",
    "Polygon",
    (
        Field("corridor_id", "integer", "number of the corridor, from 1"),
        _FOOTPRINT,
        _STOREY,
        Field("area_m2", "number", "area in square metres"),
    ),
    "floor_corridors",
)
CORRIDOR_LINES = LayerKind(
    "corridor_lines",
    "Corridor lines",
    "LineString",
    (
        Field("line_id", "integer", "number of the piece, from 1"),
        _FOOTPRINT,
        _STOREY,
        Field("corridor_id", "integer", "corridor that it is the middle of"),
        Field("length_m", "number", "length in metres"),
        _WAY,
        Field("from_m", "number", "the same from the first point of the line, in metres"),
        Field("to_m", "number", "the same from its last point, in metres"),
        Field("width_m", "number", "width of the corridor in metres"),
    ),
    "floor_lines",
)
FLOOR_DOORS = LayerKind(
    "doors",
    "Doors",
    "LineString",
    (
        Field("door_id", "integer", "number of the door, from 1"),
        _FOOTPRINT,
        _STOREY,
        _ROOM,
        Field("corridor_id", "integer", "corridor that it opens to"),
        Field("width_m", "number", "width in metres"),
        Field("rotation_deg", "number", "into the corridor, in degrees clockwise from north"),
        _WAY,
    ),
    "floor_doors",
)
FLOOR_OBSTACLES = LayerKind(
    "obstacles",
    "Shafts and obstacles",
    "Polygon",
    (
        Field("obstacle_id", "integer", "number, from 1"),
        _FOOTPRINT,
        _STOREY,
        Field("area_m2", "number", "area in square metres"),
    ),
    "floor_obstacles",
)
FACES = LayerKind(
    "faces",
    "Cells",
    "Polygon",
    (
        Field("face_id", "integer", "number of the cell, from 1"),
        _FOOTPRINT,
        _STOREY,
        Field("room_id", "integer", "room that covers it, -1 for none"),
        Field("obstacle", "yes/no", "whether an obstacle covers it"),
    ),
    "floor_cells",
)
