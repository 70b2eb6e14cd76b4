"""Files for Tiled, read back by pytiled_parser, which is not ours."""

from __future__ import annotations

import dataclasses
import json
import os
import stat
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.image
import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.rooms.levels import block_polygons, level_layers, read_level
from platwright.rooms.tiled import rasterise, write_tiled
from platwright.rooms.tiled.tileset import MARKS, draw_tileset
from pytiled_parser import parse_map
from pytiled_parser.tiled_object import Point, Polygon, Polyline

from .level_examples import SQUARE, circular, linear, moved, random_tree, solved, star

FORMATS = [(".tmx", False), (".tmx", True), (".tmj", False), (".tmj", True)]
LEVELS = {
    "linear": lambda: solved(6, 5, [(0, 1), (6, 4)]),
    "circular": circular,
    "branching": lambda: random_tree(4, 3, 5)[:2],
    "star": star,
}
CRS = "EPSG:3067"


def written(folder: Path, level, suffix: str, **options):
    """Write a level and read it again."""
    path = folder / f"level{suffix}"
    files = write_tiled(path, level, crs=CRS, **options)
    assert files[0] == path
    assert sorted(os.listdir(folder)) == sorted(file.name for file in files)
    return parse_map(path)


def objects(level_map, kind: str):
    (layer,) = [one for one in level_map.layers if one.name == "objects"]
    return [thing for thing in layer.tiled_objects if thing.class_ == kind]


def outline(thing) -> np.ndarray:
    """Return the points of an object, pixels of the map."""
    first = np.array([thing.coordinates.x, thing.coordinates.y])
    return first + [[p.x, p.y] for p in thing.points]


def tile_layer(level_map, name: str) -> np.ndarray:
    (layer,) = [one for one in level_map.layers if one.name == name]
    return np.array(layer.data)


@pytest.mark.parametrize(("suffix", "embed"), FORMATS)
@pytest.mark.parametrize("name", sorted(LEVELS))
def test_files_hold_the_level(tmp_path, name, suffix, embed):
    problem, plan = LEVELS[name]()
    level = read_level(problem, plan)
    k = 9 if name == "star" else 5
    tiles = rasterise(level, tiles_per_cell=k)
    read = written(tmp_path, level, suffix, tiles_per_cell=k, embed=embed)
    assert (read.orientation, read.render_order, read.infinite) == (
        "orthogonal", "right-down", False,
    )  # fmt: skip
    assert read.version == "1.10"
    height, width = tiles.owner.shape
    assert (read.map_size.width, read.map_size.height) == (width, height)
    assert (read.tile_size.width, read.tile_size.height) == (16, 16)
    assert [layer.name for layer in read.layers] == ["floor", "walls", "doors", "marks", "objects"]
    ids = [layer.id for layer in read.layers]
    assert len(set(ids)) == 5
    assert read.next_layer_id > max(ids)

    (tileset,) = read.tilesets.values()
    assert tileset.firstgid == 1
    kinds = {i + 1: tile.class_ for i, tile in tileset.tiles.items()}
    floor, walls = tile_layer(read, "floor"), tile_layer(read, "walls")
    doors, marks = tile_layer(read, "doors"), tile_layer(read, "marks")
    assert floor.shape == walls.shape == doors.shape == marks.shape == (height, width)
    assert {kinds[g] for g in np.unique(walls[walls > 0])} == {"wall"}
    assert {kinds[g] for g in np.unique(doors[doors > 0])} == {"door"}
    assert ((walls > 0) == tiles.wall).all()
    assert ((doors > 0) == (tiles.door >= 0)).all()
    assert ((floor > 0) == (tiles.owner >= 0)).all()
    assert [kinds[marks[tiles.start]], kinds[marks[tiles.goal]]] == ["start", "goal"]
    for block in range(level.count):
        (gid,) = np.unique(floor[tiles.owner == block])
        assert tileset.tiles[gid - 1].properties["template"] == (
            problem.templates[level.template(block)].name
        )
    check_objects(read, level, tiles)


def check_objects(read, level, tiles):
    """Compare the objects of a map with the layers of the level."""
    layers = level_layers(level.problem, level.plan, CRS)
    table = layers["blocks"].set_index("block_id")
    blocks = objects(read, "block")
    assert {thing.properties["id"] for thing in blocks} == set(table.index)
    metre = 16 / tiles.frame.tile_m
    for thing in blocks:
        assert isinstance(thing, Polygon)
        row = table.loc[thing.properties["id"]]
        for field in ("template", "order", "role"):
            assert thing.properties[field] == row[field]
        assert thing.properties["area_m2"] == pytest.approx(row["area_m2"], abs=1e-5)
        colour = thing.properties["colour"]
        assert (colour.red, colour.green, colour.blue) == tuple(bytes.fromhex(row["colour"][1:]))
        drawn = shapely.Polygon(outline(thing))
        assert drawn.area == pytest.approx(row["area_m2"] * metre**2, rel=1e-4)
        # up is down on the screen
        ground = shapely.get_coordinates(row.geometry.exterior)
        east_north = tiles.frame.to_tiles(ground) * 16
        assert drawn.symmetric_difference(shapely.Polygon(east_north)).area < 1e-3 * drawn.area
    for kind, at, block in (
        ("start", tiles.start, level.start_block),
        ("goal", tiles.goal, level.goal_block),
    ):
        (point,) = objects(read, kind)
        assert isinstance(point, Point)
        assert point.properties["id"] == block + 1
        assert (point.coordinates.y // 16, point.coordinates.x // 16) == at
    treasures = {thing.properties["id"] for thing in objects(read, "treasure")}
    assert treasures == set(table.index[table["role"] == "treasure"])
    pairs = [(d.properties["block_a"], d.properties["block_b"]) for d in objects(read, "door")]
    rows = layers["adjacency"][["block_a", "block_b"]].to_numpy().tolist()
    assert sorted(pairs) == sorted(map(tuple, rows))
    route = objects(read, "route")
    assert all(isinstance(line, Polyline) for line in route)
    lines = [shapely.LineString(outline(line)) for line in route]
    assert sum(line.length for line in lines) == pytest.approx(
        layers["route"].length.sum() * metre, rel=1e-4
    )
    real = [tiles.frame.to_tiles(shapely.get_coordinates(g)) * 16 for g in layers["route"].geometry]
    apart = shapely.hausdorff_distance(
        shapely.MultiLineString(lines), shapely.MultiLineString(real)
    )
    assert apart < 1e-3
    everything = [thing.id for layer in read.layers[4:] for thing in layer.tiled_objects]
    assert len(set(everything)) == len(everything)
    assert read.next_object_id > max(everything)


def test_a_route_without_branches_is_one_line(tmp_path):
    level = read_level(*LEVELS["linear"]())
    (route,) = objects(written(tmp_path, level, ".tmx"), "route")
    drawn = outline(route)
    ends = level.problem.network.mesh.vertices[[level.start, level.goal]]
    tiles = rasterise(level)
    assert drawn[[0, -1]] == pytest.approx(tiles.frame.to_tiles(ends) * 16)
    by_rank = sorted(range(level.count), key=lambda b: level.order[b])
    assert route.properties["blocks"] == ",".join(str(b + 1) for b in by_rank)


def test_both_formats_hold_the_same(tmp_path):
    level = read_level(*LEVELS["branching"]())
    for folder in ("x", "j"):
        (tmp_path / folder).mkdir()
    as_xml = written(tmp_path / "x", level, ".tmx")
    as_json = written(tmp_path / "j", level, ".tmj")
    assert as_xml.properties == as_json.properties
    for one, other in zip(as_xml.layers[:4], as_json.layers[:4]):
        assert one.data == other.data
    for one, other in zip(as_xml.layers[4].tiled_objects, as_json.layers[4].tiled_objects):
        assert (one.id, one.name, one.class_) == (other.id, other.name, other.class_)
        assert (one.coordinates, one.properties) == (other.coordinates, other.properties)
        assert getattr(one, "points", None) == getattr(other, "points", None)
    (a,), (b,) = as_xml.tilesets.values(), as_json.tilesets.values()
    assert (a.tile_count, a.columns, a.name) == (b.tile_count, b.columns, b.name)
    assert [t.properties for t in a.tiles.values()] == [t.properties for t in b.tiles.values()]


def test_the_map_remembers_where_it_lies(tmp_path):
    problem, plan = linear()
    moved_there = moved(problem, lambda points: np.add(points, (386000, 6672000)))
    read = written(tmp_path, read_level(moved_there, plan), ".tmj")
    assert read.properties["crs"] == CRS
    assert read.properties["origin_x"] == pytest.approx(386000)
    assert read.properties["origin_y"] == pytest.approx(6672000)
    assert read.properties["tile_m"] == pytest.approx(0.2)
    assert read.properties["row_angle_deg"] == pytest.approx(0)


def test_the_picture_of_the_tiles_fits(tmp_path):
    level = read_level(*linear())
    read = written(tmp_path, level, ".tmx", tile_px=24)
    (tileset,) = read.tilesets.values()
    picture = matplotlib.image.imread(tileset.image)
    assert picture.shape == (24, 24 * tileset.tile_count, 4)
    assert (tileset.image_width, tileset.image_height) == picture.shape[1::-1]
    assert tileset.tile_count == len(level.problem.templates) + len(MARKS)
    # the middle of the first floor has the colour of its template; walls and floors are opaque
    assert np.round(picture[12, 12] * 255).tolist() == [0x88, 0xAA, 0xCC, 255]
    drawn = draw_tileset(level.problem.templates, 24)
    assert (np.round(picture * 255) == drawn.pixels).all()
    for i, kind in enumerate(drawn.kinds):
        alpha = picture[:, i * 24 : (i + 1) * 24, 3]
        assert (alpha.min() == 1) == (kind in {"floor", "wall", "door"})
        assert alpha.max() > 0.5
    assert len({drawn.pixels[:, i * 24 : (i + 1) * 24].tobytes() for i in range(10)}) == 10


def test_only_walls_stop(tmp_path):
    (tileset,) = written(tmp_path, read_level(*linear()), ".tmx").tilesets.values()
    stops = [tile.class_ for tile in tileset.tiles.values() if not tile.properties["walkable"]]
    assert stops == ["wall"]


@pytest.mark.parametrize("suffix", [".tmx", ".tmj"])
def test_any_name_can_be_written(tmp_path, suffix):
    name = 'a "b" & <c>\n\td \u00e4\u2603'
    problem, plan = linear()
    own = (dataclasses.replace(SQUARE, name=name), *problem.templates[1:])
    level = read_level(dataclasses.replace(problem, templates=own), plan)
    blocks = objects(written(tmp_path, level, suffix), "block")
    assert {thing.properties["template"] for thing in blocks} == {name}
    bell = (dataclasses.replace(SQUARE, name="bell \x07"), *problem.templates[1:])
    level = read_level(dataclasses.replace(problem, templates=bell), plan)
    # XML has no way to write a bell
    blocks = objects(written(tmp_path, level, suffix), "block")
    assert blocks[0].properties["template"] in {"bell \ufffd", "bell \x07"}


def test_files_are_plain_xml_and_json(tmp_path):
    level = read_level(*linear())
    write_tiled(tmp_path / "a.tmx", level)
    root = ElementTree.parse(tmp_path / "a.tmx").getroot()  # noqa: S314 - our own file
    assert root.find("tileset").attrib == {"firstgid": "1", "source": "a_tiles.tsx"}
    rows = root.find("layer/data").text.strip().split("\n")
    # a comma after each tile but the last
    assert [len(row.rstrip(",").split(",")) for row in rows] == [30] * 10
    assert [row.endswith(",") for row in rows] == [True] * 9 + [False]
    tiles = ElementTree.parse(tmp_path / "a_tiles.tsx").getroot()  # noqa: S314 - our own file
    assert tiles.find("image").attrib["source"] == "a_tiles.png"
    write_tiled(tmp_path / "b.tmj", level)
    content = json.loads((tmp_path / "b.tmj").read_text("utf-8"))
    assert content["type"] == "map"
    assert content["tilesets"] == [{"firstgid": 1, "source": "b_tiles.tsj"}]
    (start,) = [o for o in content["layers"][4]["objects"] if o["type"] == "start"]
    assert start["point"] is True
    again = tmp_path / "again.tmx"
    write_tiled(again, level)
    said = again.read_text("utf-8").replace("again_tiles", "a_tiles")
    assert said == (tmp_path / "a.tmx").read_text("utf-8")
    assert stat.S_IMODE(again.stat().st_mode) == 0o666 & ~umask()


def umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_a_block_around_a_yard_keeps_its_hole(tmp_path):
    from platwright.mesh.grids import grid

    from .level_examples import level_problem, plan_of, vertex, walk

    mesh = grid(3, 3)
    problem = level_problem(mesh, [(0, (0, 1, 2, 3, 5, 6, 7, 8))], [vertex(mesh, 1, 0)])
    level = read_level(problem, plan_of(problem, [0], walk(mesh, [(1, 0), (1, 1)])))
    read = written(tmp_path, level, ".tmx")
    (block,), (hole,) = objects(read, "block"), objects(read, "hole")
    assert hole.properties["id"] == block.properties["id"] == 1
    area = shapely.Polygon(outline(block)).area - shapely.Polygon(outline(hole)).area
    assert area == block_polygons(level)[0].area * 80**2
    floor = tile_layer(read, "floor")
    assert (floor[5:10, 5:10] == 0).all()
    assert (floor > 0).sum() == 200
    # the yard is walled off all around
    walls = tile_layer(read, "walls")
    assert (walls[4:11, 4:11] > 0).sum() == 49 - 25


def test_other_extensions_and_small_tiles_are_refused(tmp_path):
    level = read_level(*linear())
    with pytest.raises(InputError, match=r"level.json is no map of Tiled"):
        write_tiled(tmp_path / "level.json", level)
    with pytest.raises(InputError, match="4 pixels are too small"):
        write_tiled(tmp_path / "level.tmx", level, tile_px=4)
    bad = (dataclasses.replace(SQUARE, colour="red"), *level.problem.templates[1:])
    problem = dataclasses.replace(level.problem, templates=bad)
    with pytest.raises(InputError, match="Template 'square' has the colour 'red'"):
        write_tiled(tmp_path / "level.tmx", read_level(problem, level.plan))
    with pytest.raises(InputError, match="cannot be written"):
        write_tiled(tmp_path / "missing" / "level.tmx", level)
    assert os.listdir(tmp_path) == []


def test_all_files_are_written_or_none(tmp_path, monkeypatch):
    before = read_level(*linear())
    files = write_tiled(tmp_path / "level.tmx", before)
    kept = {file: file.read_bytes() for file in files}
    real, done = os.replace, []

    def fails_at_the_map(begun, path):
        if str(path).endswith(".tmx"):
            raise PermissionError(13, "Permission denied", str(path))
        done.append(path)
        real(begun, path)

    monkeypatch.setattr(os, "replace", fails_at_the_map)
    with pytest.raises(InputError, match="Permission denied"):
        write_tiled(tmp_path / "level.tmx", read_level(*circular()), tile_px=32)
    assert len(done) == 2
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == kept
    with pytest.raises(InputError, match="Permission denied"):
        write_tiled(tmp_path / "other.tmx", before)
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == kept
