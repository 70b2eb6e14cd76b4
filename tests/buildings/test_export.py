"""CityJSON and glTF of laid out zones, read by cjio and trimesh and checked face by face."""

from __future__ import annotations

import importlib.util
import json
import os
import struct
import subprocess
import sys

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.export import city_json, files, gltf, write_city_json, write_gltf
from platwright.buildings.export import triangles as triangles_module
from platwright.buildings.export.triangles import triangulate
from platwright.buildings.layers import layout_layers, zone_layers
from platwright.errors import InputError
from pyproj import CRS
from shapely.geometry import MultiPolygon, Point, Polygon, box

from .hand_made import ORIGIN, RULES, SIZE, make_layout

#: Vertices of CityJSON are whole millimetres.
MM = 0.001


@pytest.fixture(scope="module")
def layers():
    return layout_layers(make_layout(), RULES)


@pytest.fixture(scope="module")
def city(layers):
    return json.loads(json.dumps(city_json(layers), allow_nan=False))


def coordinates(city):
    transform = city["transform"]
    return np.array(city["vertices"]) * transform["scale"] + transform["translate"]


def newell(points):
    """Twice the area of a ring in space, as a vector along its normal."""
    after = np.roll(points, -1, axis=0)
    return np.cross(points, after).sum(axis=0)


def faces_of(thing):
    (geometry,) = thing["geometry"]
    (shell,) = geometry["boundaries"]
    return shell, geometry["semantics"]


def volume_of(shell, xyz):
    """By the divergence theorem, seen from one vertex."""
    eye = xyz[shell[0][0][0]]
    return sum(
        newell(xyz[ring] - eye) @ (xyz[face[0][0]] - eye) / 6 for face in shell for ring in face
    )


# --- triangles ------------------------------------------------------------------------------


def check_triangles(polygon):
    points, index = triangulate(polygon)
    made = shapely.polygons(points[index])
    assert sum(shapely.area(made)) == pytest.approx(polygon.area)
    assert shapely.union_all(made).symmetric_difference(polygon).area < 1e-6 * polygon.area
    assert shapely.is_ccw(shapely.get_exterior_ring(made)).all()


def star(seed, count=12, holes=2):
    """A star with holes."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, count))
    far = rng.uniform(20.0, 60.0, count)
    shape = Polygon(np.column_stack([far * np.cos(angle), far * np.sin(angle)])).buffer(0.5)
    for x, y in rng.uniform(-15, 15, (holes, 2)):
        shape = shape.difference(box(x, y, x + 6, y + 4))
    return max(shapely.get_parts(shape), key=shapely.area)


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_triangles_fill_a_polygon_with_holes(seed):
    check_triangles(star(seed))


def test_triangles_without_the_help_of_the_library(monkeypatch):
    monkeypatch.delattr(shapely, "constrained_delaunay_triangles", raising=False)
    assert not hasattr(triangles_module.shapely, "constrained_delaunay_triangles")
    for seed in range(25):
        check_triangles(star(seed))


# --- CityJSON -------------------------------------------------------------------------------


#: What cjio makes of a file. It changes how Python's json writes numbers, so it runs apart.
CJIO = """
import collections, json, sys
from cjio import cityjson
with open(sys.argv[1], encoding="utf-8") as file:
    model = cityjson.CityJSON(file=file)
kinds = collections.Counter(thing["type"] for thing in model.j["CityObjects"].values())
told = model.get_bbox()
doubles, orphans = model.remove_duplicate_vertices(), model.remove_orphan_vertices()
model.update_bbox()
print(json.dumps({
    "version": model.get_version(), "epsg": model.get_epsg(), "title": model.get_title(),
    "kinds": kinds, "doubles": doubles, "orphans": orphans, "told": told,
    "bounds": model.get_bbox(),
}))
"""


def test_cjio_reads_the_file(layers, tmp_path):
    if importlib.util.find_spec("cjio") is None:
        pytest.skip("cjio is not installed")
    path = tmp_path / "zone.city.json"
    write_city_json(path, layers, title="Mill Street")
    done = subprocess.run(
        [sys.executable, "-c", CJIO, str(path)], capture_output=True, text=True, timeout=120,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["version"], found["epsg"], found["title"]) == ("2.0", 32633, "Mill Street")
    kinds = found["kinds"]
    assert kinds["Building"] == len(layers["buildings"]) == 38
    assert kinds["PlantCover"] == len(layers["green"])
    assert kinds["SolitaryVegetationObject"] == len(layers["trees"])
    # a path that is all on another one has no ground of its own
    roads = len(layers["corridors"]) + len(layers["parking"])
    assert roads < kinds["Road"] <= roads + len(layers["paths"])
    # nothing to clean up
    assert (found["doubles"], found["orphans"]) == (0, 0)
    assert found["bounds"] == pytest.approx(found["told"], abs=MM)


def test_solids_are_closed_and_look_outwards(city, layers):
    xyz = coordinates(city)
    built = layers["buildings"].set_index("building_id")
    found = {
        name: thing for name, thing in city["CityObjects"].items() if thing["type"] == "Building"
    }
    assert len(found) == len(built)
    for thing in found.values():
        row = built.loc[thing["attributes"]["building_id"]]
        shell, _ = faces_of(thing)
        rings = [ring for face in shell for ring in face]
        edges = [(a, b) for ring in rings for a, b in zip(ring, ring[1:] + ring[:1])]
        # every edge once in each direction: closed, and turned alike
        assert len(set(edges)) == len(edges)
        assert {(b, a) for a, b in edges} == set(edges)
        assert volume_of(shell, xyz) == pytest.approx(
            row["footprint_m2"] * row["height_m"], rel=1e-3
        )


def test_surfaces_are_what_they_are_called(city):
    xyz = coordinates(city)
    for thing in city["CityObjects"].values():
        if thing["type"] != "Building":
            continue
        shell, semantics = faces_of(thing)
        (values,) = semantics["values"]
        names = [semantics["surfaces"][value]["type"] for value in values]
        assert len(names) == len(shell)
        for face, name in zip(shell, names):
            normal = newell(xyz[face[0]] - xyz[face[0][0]])
            up = normal[2] / np.linalg.norm(normal)
            expected = {"RoofSurface": 1.0, "GroundSurface": -1.0, "WallSurface": 0.0}[name]
            assert up == pytest.approx(expected, abs=1e-6)
        assert names.count("RoofSurface") == names.count("GroundSurface") == 1


def test_fields_become_attributes(city, layers):
    row = layers["buildings"].iloc[0]
    told = city["CityObjects"]["building-1"]["attributes"]
    for name in ("type", "use", "storeys", "height_m", "dwellings", "sun_hours", "shaded"):
        assert told[name] == row[name]
    assert city["CityObjects"]["corridor-1"]["attributes"]["name"] == "Mill Street"
    assert city["CityObjects"]["corridor-1"]["attributes"]["function"] == "street"


def test_pieces_of_ground_do_not_overlap_and_cover_the_zone(city, layers):
    xyz = coordinates(city)
    shapes = []
    for thing in city["CityObjects"].values():
        if thing["type"] not in ("Road", "PlantCover", "LandUse"):
            continue
        (geometry,) = thing["geometry"]
        for face in geometry["boundaries"]:
            shell, *holes = [xyz[ring][:, :2] for ring in face]
            assert xyz[face[0]][:, 2].max() == 0.0
            assert newell(xyz[face[0]] - xyz[face[0][0]])[2] > 0
            shapes.append(shapely.make_valid(Polygon(shell, holes)))
    whole = shapely.union_all(shapes)
    assert sum(shapely.area(shapes)) == pytest.approx(whole.area, rel=2e-4)
    ground = shapely.union_all([whole, *layers["buildings"].geometry])
    zone = layers["zone"].geometry.iloc[0]
    assert zone.difference(ground).area < 0.002 * zone.area


def test_every_vertex_is_used_once(city):
    points = [tuple(point) for point in city["vertices"]]
    assert len(set(points)) == len(points)
    used = set()

    def walk(boundaries):
        for part in boundaries:
            if isinstance(part, list):
                walk(part)
            else:
                used.add(part)

    for thing in city["CityObjects"].values():
        for geometry in thing["geometry"]:
            walk(geometry["boundaries"])
    assert used == set(range(len(points)))


def test_trees_stand_where_they_are(city, layers):
    xyz = coordinates(city)
    for at in (0, 17, len(layers["trees"]) - 1):
        thing = city["CityObjects"][f"tree-{at + 1}"]
        (geometry,) = thing["geometry"]
        corners = xyz[np.unique(np.concatenate([f[0] for f in geometry["boundaries"]]))]
        place = layers["trees"].geometry.iloc[at]
        assert (corners[:, 0].min() + corners[:, 0].max()) / 2 == pytest.approx(place.x, abs=0.3)
        assert (corners[:, 1].min() + corners[:, 1].max()) / 2 == pytest.approx(place.y, abs=0.3)
        assert corners[:, 2].min() == 0.0
        assert corners[:, 2].max() == pytest.approx(thing["attributes"]["height_m"], abs=0.1)


@pytest.mark.parametrize(("code", "told"), [(4326, 32633), (3857, 32633), (25833, 25833)])
def test_a_plan_in_another_crs_comes_out_in_metres(code, told):
    found = city_json(layout_layers(make_layout(source=CRS.from_epsg(code)), RULES))
    assert found["metadata"]["referenceSystem"].endswith(f"/EPSG/0/{told}")
    xyz = coordinates(found)
    shell, _ = faces_of(found["CityObjects"]["building-1"])
    assert volume_of(shell, xyz) == pytest.approx(24 * 12 * 18, rel=1e-3)
    assert found["metadata"]["geographicalExtent"][0] == pytest.approx(ORIGIN[0], abs=2.0)


def court(layers, shape, height=12.0):
    """The layers with one building of another shape."""
    built = layers["buildings"].iloc[:1].copy()
    built["height_m"] = height
    built = built.set_geometry(gpd.GeoSeries([shape], index=built.index, crs=built.crs))
    return {**layers, "buildings": built}


def test_a_court_is_hollow(layers):
    x, y = ORIGIN
    ring = box(x, y, x + 40, y + 30).difference(box(x + 10, y + 10, x + 30, y + 20))
    found = city_json(court(layers, ring))
    shell, semantics = faces_of(found["CityObjects"]["building-1"])
    assert volume_of(shell, coordinates(found)) == pytest.approx(1000 * 12.0)
    assert len(shell) == 10
    assert semantics["values"][0].count(1) == 8


def test_a_building_of_two_parts_becomes_two(layers):
    x, y = ORIGIN
    parts = MultiPolygon([box(x, y, x + 10, y + 10), box(x + 20, y, x + 30, y + 20)])
    found = city_json(court(layers, parts))["CityObjects"]
    assert {"building-1-1", "building-1-2"} <= set(found)


def test_a_building_without_a_height_has_that_of_its_storeys(layers):
    found = city_json(court(layers, layers["buildings"].geometry.iloc[0], height=np.nan))
    # six of three metres
    assert coordinates(found)[:, 2].max() >= 18.0
    shell, _ = faces_of(found["CityObjects"]["building-1"])
    assert volume_of(shell, coordinates(found)) == pytest.approx(24 * 12 * 18.0)


def test_two_zones_come_out_in_one_file():
    layouts = [make_layout(), make_layout(site_id=2, source=CRS.from_epsg(32633))]
    found = city_json(zone_layers(layouts, RULES))
    kinds = [thing["type"] for thing in found["CityObjects"].values()]
    assert kinds.count("Building") == 2 * 38


# --- glTF -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def scene(layers, tmp_path_factory):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    path = tmp_path_factory.mktemp("gltf") / "zone.glb"
    write_gltf(path, layers)
    return trimesh.load_scene(path)


def placed_mesh(scene, name):
    """A node with all its materials as one mesh, in the places where it stands."""
    import trimesh

    found = []
    for node in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph[node]
        if node == name or scene.graph.transforms.parents.get(node) == name:
            mesh = scene.geometry[geometry].copy()
            mesh.apply_transform(matrix)
            found.append(mesh)
    mesh = trimesh.util.concatenate(found)
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    return mesh


def test_trimesh_reads_buildings_as_closed_solids(scene, layers):
    built = layers["buildings"]
    middle = np.round(np.array(layers["patches"].total_bounds).reshape(2, 2).mean(axis=0))
    for at in (0, 3, 12, 25, 37):
        row = built.iloc[at]
        mesh = placed_mesh(scene, f"building-{row['building_id']}")
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume == pytest.approx(row["footprint_m2"] * row["height_m"], rel=1e-3)
        low, high = mesh.bounds
        assert (low[1], high[1]) == (0.0, pytest.approx(row["height_m"], abs=1e-3))
        # east is x, north is -z
        x0, y0, x1, y1 = row.geometry.bounds
        east, south = (low[0] + high[0]) / 2, (low[2] + high[2]) / 2
        assert east == pytest.approx((x0 + x1) / 2 - middle[0], abs=8.0)
        assert south == pytest.approx(middle[1] - (y0 + y1) / 2, abs=8.0)
        assert high[0] - low[0] == pytest.approx(x1 - x0, abs=1e-3)


def test_the_plan_keeps_its_distances_and_its_north(scene, layers):
    built = layers["buildings"]
    first, other = (placed_mesh(scene, f"building-{k}").bounds.mean(axis=0) for k in (1, 30))
    a, b = built.geometry.iloc[0].centroid, built.geometry.iloc[29].centroid
    step = other - first
    assert (step[0], -step[2]) == (
        pytest.approx(b.x - a.x, abs=1e-2), pytest.approx(b.y - a.y, abs=1e-2),
    )  # fmt: skip


def test_the_ground_is_flat_and_of_the_right_size(scene, layers):
    for name, layer in (("green", "green"), ("parking", "parking")):
        mesh = placed_mesh(scene, name)
        assert mesh.area == pytest.approx(layers[layer].area.sum(), rel=1e-4)
        assert np.ptp(mesh.vertices[:, 1]) == 0.0
        assert (mesh.face_normals[:, 1] > 0.99).all()
    assert placed_mesh(scene, "plate").bounds[0][1] < 0.0


def test_trees_are_one_mesh_in_many_places(scene, layers):
    names = [f"tree-{k + 1}" for k in range(len(layers["trees"]))]
    assert set(names) <= set(scene.graph.nodes)
    places = np.array([scene.graph[name][0][:3, 3] for name in names])
    there = shapely.get_coordinates(layers["trees"].geometry.to_numpy())
    middle = places[:, [0, 2]] * [1.0, -1.0] - there
    assert middle == pytest.approx(np.tile(middle[0], (len(there), 1)), abs=2e-3)
    mesh = placed_mesh(scene, "tree-5")
    assert 6.0 < mesh.bounds[1][1] < 10.0
    assert mesh.bounds[0][1] == pytest.approx(0.0)
    assert mesh.volume > 10.0


def test_colours_tell_use_and_storeys(scene, layers):
    built = layers["buildings"].set_index("building_id")
    seen = {}
    for node in scene.graph.nodes_geometry:
        owner = scene.graph.transforms.parents.get(node) or node
        name = node if node.startswith("building-") else owner
        if not name.startswith("building-"):
            continue
        number = int(name.split("-")[1].split("_")[0])
        material = scene.geometry[scene.graph[node][1]].visual.material.name
        seen.setdefault(built.loc[number, "type"], set()).add(material)
    assert seen == {
        "slab": {"middle walls", "middle roof"},
        "tower": {"high walls", "high roof"},
        "shop": {"facility walls", "facility roof"},
    }


def parsed(data):
    """Header, JSON and binary chunk of a .glb file."""
    magic, version, total = struct.unpack_from("<4sII", data)
    size, kind = struct.unpack_from("<I4s", data, 12)
    text = data[20 : 20 + size]
    length, binary = struct.unpack_from("<I4s", data, 20 + size)
    assert (magic, version, total) == (b"glTF", 2, len(data))
    assert (kind, binary) == (b"JSON", b"BIN\0")
    assert size % 4 == length % 4 == 0
    assert 28 + size + length == len(data)
    return json.loads(text), data[28 + size :]


def test_the_bytes_are_as_declared(layers):
    document, data = parsed(gltf(layers))
    for accessor in document["accessors"]:
        view = document["bufferViews"][accessor["bufferView"]]
        width = 3 if accessor["type"] == "VEC3" else 1
        assert view["byteLength"] == 4 * width * accessor["count"]
        piece = data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        if "min" in accessor:
            points = np.frombuffer(piece, "<f4").reshape(-1, 3)
            assert points.min(axis=0).tolist() == accessor["min"]
            assert points.max(axis=0).tolist() == accessor["max"]
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            view = document["bufferViews"][primitive["indices"]]
            index = np.frombuffer(data, "<u4", view["byteLength"] // 4, view["byteOffset"])
            count = document["accessors"][primitive["attributes"]["POSITION"]]["count"]
            assert index.max() < count
    used = {p["material"] for mesh in document["meshes"] for p in mesh["primitives"]}
    assert used == set(range(len(document["materials"])))
    assert document["asset"]["extras"]["crs"] == "EPSG:32633"
    middle = [ORIGIN[0] + SIZE[0] / 2, ORIGIN[1] + SIZE[1] / 2]
    assert document["asset"]["extras"]["origin"] == pytest.approx(middle, abs=8.0)
    (node,) = [n for n in document["nodes"] if n["name"] == "building-1"]
    assert node["extras"]["type"] == "slab"


def test_the_same_plan_gives_the_same_files(layers):
    assert gltf(layers) == gltf(layout_layers(make_layout(), RULES))
    assert city_json(layers) == city_json(layout_layers(make_layout(), RULES))


def test_buildings_alone_can_be_exported(layers):
    only = {"buildings": layers["buildings"]}
    document, _ = parsed(gltf(only))
    assert "tree" not in [mesh["name"] for mesh in document["meshes"]]
    assert len(city_json(only)["CityObjects"]) == 38


def test_trees_without_a_place_are_left_out(layers):
    trees = layers["trees"].iloc[:3].copy()
    trees.loc[trees.index[1], "geometry"] = Point()
    document, _ = parsed(gltf({**layers, "trees": trees}))
    assert len([n for n in document["nodes"] if n["name"].startswith("tree-")]) == 2


# --- files ----------------------------------------------------------------------------------


@pytest.mark.parametrize("write", [write_city_json, write_gltf])
def test_a_file_that_cannot_be_finished_leaves_the_old_one(write, layers, tmp_path, monkeypatch):
    path = tmp_path / "plan.out"
    path.write_text("the plan of yesterday")

    def full(*_args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        write(path, layers)
    assert path.read_text() == "the plan of yesterday"
    assert os.listdir(tmp_path) == ["plan.out"]


@pytest.mark.parametrize("write", [write_city_json, write_gltf])
def test_a_folder_that_is_not_there_is_named(write, layers, tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        write(tmp_path / "nowhere" / "plan.out", layers)


@pytest.mark.parametrize("write", [write_city_json, write_gltf])
def test_nothing_is_written_of_nothing(write, layers, tmp_path):
    with pytest.raises(InputError, match="nothing to draw"):
        write(tmp_path / "plan.out", {"buildings": layers["buildings"].iloc[:0]})
    with pytest.raises(InputError, match="no layer of buildings"):
        write(tmp_path / "plan.out", {})
    assert os.listdir(tmp_path) == []


def test_a_file_may_be_read_like_others(layers, tmp_path):
    other = tmp_path / "other"
    other.write_text("")
    write_gltf(tmp_path / "plan.glb", layers)
    assert (tmp_path / "plan.glb").stat().st_mode == other.stat().st_mode
