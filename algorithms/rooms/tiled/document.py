"""A map of Tiled, apart from how it is written: tile layers and objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from ...network.problem import FloatArray
from ..levels.collect import block_polygons
from ..levels.graph import Level, neighbours
from ..levels.trails import trail_points, trails
from ..types import IntArray
from .frame import Frame
from .raster import Tiles
from .tileset import Tileset

#: Name, type as Tiled calls it ("string", "int", "float", "bool", "color") and value of each.
Properties = tuple[tuple[str, str, object], ...]


@dataclass(frozen=True, eq=False)
class TileLayer:
    """Tiles of one layer: shape (height, width), 0 for none, else 1 + number in the tileset."""

    name: str
    gids: IntArray


@dataclass(frozen=True, eq=False)
class MapObject:
    """An object of a map.

    Attributes
    ----------
    name, kind
        What it is called, and of which class it is.
    shape
        "point", "polygon" or "polyline".
    points
        Shape (k, 2). Pixels from the upper left corner of the map, y downwards.
    properties
        As `Properties`.
    """

    name: str
    kind: str
    shape: str
    points: FloatArray
    properties: Properties = ()


@dataclass(frozen=True, eq=False)
class Document:
    """A map: its size in tiles, tileset, layers from below, objects and properties."""

    width: int
    height: int
    tileset: Tileset
    layers: tuple[TileLayer, ...]
    objects: tuple[MapObject, ...]
    properties: Properties


def document(level: Level, tiles: Tiles, tileset: Tileset, crs: str = "") -> Document:
    """Make a map of a level.

    Parameters
    ----------
    level, tiles
        The level, and its tiles.
    tileset
        Drawn for the templates of the level, in their order.
    crs
        Name of the working CRS, which the map then remembers.

    Returns
    -------
    Document
        Tile layers "floor" (under walls, too), "walls", "doors" and "marks" (route, start, goal,
        treasures). Objects: "block" polygons with `id`, `template`, `order`, `role`, `area_m2`,
        `colour` and `neighbours`, and "hole" polygons with the `id` of their block; points
        "start", "goal", "treasure", and "door" with `block_a` and `block_b`; "route" polylines
        away from the start. The map's properties say where it lies.
    """
    frame = tiles.frame
    kind = np.array([level.template(block) for block in range(level.count)], dtype=np.int64)
    floor = np.where(tiles.owner >= 0, kind[tiles.owner] + 1, 0)
    marks = np.where(tiles.route, 1 + tileset.index("route"), 0)
    for block_tile in tiles.treasures.values():
        marks[block_tile] = 1 + tileset.index("treasure")
    if tiles.goal is not None:
        marks[tiles.goal] = 1 + tileset.index("goal")
    marks[tiles.start] = 1 + tileset.index("start")
    layers = (
        TileLayer("floor", floor),
        TileLayer("walls", np.where(tiles.wall, 1 + tileset.index("wall"), 0)),
        TileLayer("doors", np.where(tiles.door >= 0, 1 + tileset.index("door"), 0)),
        TileLayer("marks", marks),
    )
    objects = [
        *_blocks(level, frame, tileset.size),
        *_route(level, frame, tileset.size),
        *_points(level, tiles, tileset.size),
    ]
    place: Properties = (
        ("crs", "string", crs),
        ("origin_x", "float", frame.origin[0]),
        ("origin_y", "float", frame.origin[1]),
        ("row_angle_deg", "float", float(np.degrees(frame.angle))),
        ("tile_m", "float", frame.tile_m),
    )
    return Document(frame.width, frame.height, tileset, layers, tuple(objects), place)


def _pixels(frame: Frame, points: FloatArray, size: int) -> FloatArray:
    """Turn metres into pixels, a tenth of a thousandth exact and never -0."""
    found: FloatArray = np.round(frame.to_tiles(points) * size, 4) + 0.0
    return found


def _blocks(level: Level, frame: Frame, size: int) -> list[MapObject]:
    """Make the blocks, and their holes, which polygons of Tiled cannot have."""
    found = []
    roles = level.roles
    near = neighbours(level.count, level.passages)
    for block, ground in enumerate(block_polygons(level)):
        template = level.problem.templates[level.template(block)]
        number: Properties = (("id", "int", block + 1),)
        properties: Properties = (
            *number,
            ("template", "string", template.name),
            ("order", "int", level.order[block]),
            ("role", "string", roles[block]),
            ("area_m2", "float", round(float(ground.area), 6)),
            ("colour", "color", "#ff" + template.colour[1:].lower()),
            ("neighbours", "string", ",".join(str(other + 1) for other in near[block])),
        )
        name = f"{template.name} {block + 1}"
        for part in _parts(ground):
            ring = _pixels(frame, shapely.get_coordinates(part.exterior)[:-1], size)
            found.append(MapObject(name, "block", "polygon", ring, properties))
            for hole in part.interiors:
                ring = _pixels(frame, shapely.get_coordinates(hole)[:-1], size)
                found.append(MapObject(name, "hole", "polygon", ring, number))
    return found


def _parts(ground: Polygon | MultiPolygon) -> Sequence[Polygon]:
    """Return the polygons of a block, which are several where it touches itself at corners."""
    return list(ground.geoms) if isinstance(ground, MultiPolygon) else [ground]


def _route(level: Level, frame: Frame, size: int) -> list[MapObject]:
    """Make the route: one line, or one from branch to branch."""
    mesh = level.problem.network.mesh
    pieces = trails(mesh.edges, level.route, level.along, stops=(level.start,))
    found = []
    for i, piece in enumerate(pieces):
        blocks = dict.fromkeys(int(level.edge_block[e]) + 1 for e in piece.edges)
        properties: Properties = (
            ("length_m", "float", round(float(mesh.lengths[list(piece.edges)].sum()), 6)),
            ("from_start_m", "float", round(float(level.along[piece.vertices[0]]), 6)),
            ("blocks", "string", ",".join(map(str, blocks))),
        )
        line = _pixels(frame, trail_points(mesh, piece), size)
        found.append(MapObject(f"route {i + 1}", "route", "polyline", line, properties))
    return found


def _points(level: Level, tiles: Tiles, size: int) -> list[MapObject]:
    """Make start, goal, treasures and doors."""

    def point(kind: str, at: tuple[int, int], block: int) -> MapObject:
        middle = np.array([[at[1] + 0.5, at[0] + 0.5]], dtype=np.float64) * float(size)
        return MapObject(kind, kind, "point", middle, (("id", "int", block + 1),))

    found = [point("start", tiles.start, level.start_block)]
    if tiles.goal is not None:
        found.append(point("goal", tiles.goal, level.goal_block))
    found += [point("treasure", at, block) for block, at in tiles.treasures.items()]
    vertices = level.problem.network.mesh.vertices
    for i, passage in enumerate(level.passages):
        middle = _pixels(tiles.frame, vertices[[passage.vertex]], size)
        for a, b in combinations(passage.blocks, 2):
            sides: Properties = (("block_a", "int", a + 1), ("block_b", "int", b + 1))
            found.append(MapObject(f"door {i + 1}", "door", "point", middle, sides))
    return found
