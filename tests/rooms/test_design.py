"""From outlines to plans of storeys and to levels, with real shapes and meshes."""

from __future__ import annotations

import dataclasses

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.rooms.design import design_floors, room_problem
from platwright.rooms.floors import floors_of
from platwright.rooms.level import design_level
from platwright.rooms.levels import faults
from platwright.rooms.problems import problem_layer, reasons_of
from platwright.rooms.rules import LEVEL_TYPES, RoomRules
from platwright.rooms.shapes import shipped_templates
from platwright.rooms.types import Template

UTM = 32632
#: The first plan will do.
QUICK = RoomRules(time_limit=30.0, gap=1.0)


def outline(*points):
    return gpd.GeoDataFrame(geometry=[shapely.Polygon(points)], crs=UTM)


@pytest.fixture(scope="module")
def hall():
    east, north = 500_000.0, 5_000_000.0
    shape = [(0, 0), (60, 0), (60, 30), (35, 30), (35, 50), (0, 50)]
    (floor,) = floors_of(outline(*((x + east, y + north) for x, y in shape)), module=5.0)
    return floor


@pytest.mark.parametrize("level_type", LEVEL_TYPES)
def test_each_type_of_level_keeps_its_rules(hall, level_type):
    level = design_level(hall, shipped_templates("caves"), QUICK, level_type)
    assert faults(level.problem, level.plan, level_type) == []
    ends = level.problem.network.mesh.edges[level.plan.active]
    graph = nx.Graph(ends.tolist())
    assert nx.is_connected(graph)
    if level_type == "circular":
        assert {d for _, d in graph.degree} == {2}
    if level_type == "linear":
        tips = {v for v, d in graph.degree if d == 1}
        assert tips == {level.start, level.goal}


def test_places_that_are_given_are_the_nearest_possible(hall):
    at = hall.mesh.vertices
    corner = at[np.argmin(at.sum(axis=1))]
    level = design_level(hall, shipped_templates("caves"), QUICK, "branching", [tuple(corner)])
    # a corner has no way that is no border
    assert 0 < np.hypot(*(at[level.start] - corner)) < 1.5 * hall.mesh.edge_length
    ring = design_level(hall, shipped_templates("caves"), QUICK, "circular", [tuple(corner)])
    assert not hall.mesh.boundary_vertices[ring.start] or hall.mesh.valences[ring.start] > 3
    assert ring.remarks == ()


def test_places_that_are_missing_are_chosen_and_told(hall):
    level = design_level(hall, shipped_templates("caves"), QUICK, "linear")
    (remark,) = level.remarks
    assert "start and goal" in remark.text
    far = np.hypot(*np.subtract(*hall.mesh.vertices[[level.start, level.goal]]))
    assert far > 40.0


@pytest.mark.parametrize(
    ("level_type", "places"),
    [
        ("linear", [(5.0, 5.0), (35.0, 5.0)]),
        ("linear", [(5.0, 5.0), (5.0, 15.0)]),
        ("branching", [(5.0, 5.0), (35.0, 15.0)]),
        ("circular", [(5.0, 5.0)]),
    ],
)
def test_the_route_is_one_piece_and_comes_to_every_place(level_type, places):
    # two pieces would be shorter where each place were a way out of its own
    corner = np.array([500_000.0, 5_000_000.0])
    shape = [(0, 0), (40, 0), (40, 20), (0, 20)]
    (floor,) = floors_of(outline(*(corner + p for p in shape)), module=5.0)
    square = (Template("square", frozenset((i, j) for i in (0, 1) for j in (0, 1))),)
    rules = RoomRules(time_limit=10.0)
    level = design_level(floor, square, rules, level_type, [tuple(corner + p) for p in places])
    graph = nx.Graph(level.problem.network.mesh.edges[level.plan.active].tolist())
    assert nx.is_connected(graph)
    used = [level.start] if level.goal is None else [level.start, level.goal]
    assert set(used) <= set(graph)
    degrees = {v: graph.degree[v] for v in used}
    if level_type == "linear":
        assert set(degrees.values()) == {1}
    if level_type == "circular":
        assert set(degrees.values()) == {2}
    assert faults(level.problem, level.plan, level_type) == []


def test_a_ring_around_a_court_needs_no_start():
    corner = np.array([500_000.0, 5_000_000.0])
    shell = [tuple(corner + p) for p in ((0, 0), (50, 0), (50, 40), (0, 40))]
    court = [tuple(corner + p) for p in ((20, 15), (30, 15), (30, 25), (20, 25))]
    frame = gpd.GeoDataFrame(geometry=[shapely.Polygon(shell, [court])], crs=UTM)
    (floor,) = floors_of(frame, module=5.0)
    square = (Template("square", frozenset((i, j) for i in (0, 1) for j in (0, 1))),)
    blocks = (*square, *shipped_templates("caves"))
    level = design_level(floor, blocks, RoomRules(time_limit=20.0), "circular")
    assert faults(level.problem, level.plan, "circular") == []


def test_a_place_that_is_far_off_is_moved_and_told(hall):
    off = tuple(hall.mesh.vertices.max(axis=0) + 40.0)
    level = design_level(hall, shipped_templates("caves"), QUICK, "branching", [off])
    (remark,) = level.remarks
    away = np.hypot(*(hall.mesh.vertices[level.start] - off))
    assert f"{away:.1f} m" in remark.text


def test_a_share_that_is_met_exactly_is_met():
    corner = np.array([500_000.0, 5_000_000.0])
    side = 1 / np.sqrt(3)
    shape = [(0, 0), (6 * side, 0), (6 * side, 4 * side), (0, 4 * side)]
    (floor,) = floors_of(outline(*(corner + p for p in shape)), module=side)
    cells = {"square": (2, 2), "oblong": (4, 2)}
    shapes = tuple(
        Template(name, frozenset((i, j) for i in range(a) for j in range(b)), most_share=share)
        for (name, (a, b)), share in zip(cells.items(), (1 / 3, 2 / 3))
    )
    rules = dataclasses.replace(QUICK, dead_ends=0.0, too_close=0.0, outer=True)
    (made,) = design_floors([floor], shapes, rules)
    assert made.error is None


def test_too_many_places_are_refused(hall):
    places = [(0.0, 0.0), (10.0, 0.0), (20.0, 0.0)]
    with pytest.raises(InputError, match="linear"):
        design_level(hall, shipped_templates("caves"), QUICK, "linear", places)


def test_storeys_share_their_shafts():
    shaft = gpd.GeoDataFrame(
        geometry=[shapely.box(500_024, 5_000_008, 500_032, 5_000_012)], crs=UTM
    )
    house = outline(
        *((500_000 + x, 5_000_000 + y) for x, y in [(0, 0), (56, 0), (56, 20), (0, 20)])
    )
    floors = floors_of(house, module=4.0, obstacles=shaft, sinks=shaft.representative_point()
                       .to_frame("geometry"), storeys=2)  # fmt: skip
    rules = dataclasses.replace(QUICK, dead_ends=0.0, too_close=0.0)
    made = design_floors(floors, shipped_templates("basic"), rules)
    assert [own.floor.storey for own in made] == [0, 1]
    assert made[0].floor.mesh is made[1].floor.mesh
    assert np.array_equal(made[0].floor.sinks, made[1].floor.sinks)
    for own in made:
        assert own.error is None
        placements = own.problem.placements
        covered = [f for r in own.plan.rooms for f in placements.faces[r]]
        assert sorted(covered) == np.flatnonzero(own.floor.floor).tolist()
        lengths = own.floor.mesh.lengths[own.plan.active].sum() / 4.0
        assert own.plan.objective >= lengths - 1e-6


def test_corridors_keep_off_outer_walls_unless_allowed(hall):
    shapes = shipped_templates("basic")
    inner = room_problem(hall, shapes, QUICK).network.candidate
    both = room_problem(hall, shapes, dataclasses.replace(QUICK, outer=True)).network.candidate
    assert not inner[hall.mesh.boundary_edges].any()
    assert both[hall.mesh.boundary_edges].all()


def test_a_storey_without_a_plan_says_why_and_where(hall):
    big = (Template("big", frozenset((i, j) for i in range(4) for j in range(4))),)
    (made,) = design_floors([hall], big, QUICK)
    assert made.plan is None
    remarks = reasons_of(hall, made.error)
    layer = problem_layer(remarks, "halls", 0, hall.crs, "EPSG:4326")
    assert set(layer["severity"]) == {"error"}
    assert layer.geometry.geom_type.eq("Point").all()
    inside = gpd.GeoSeries([hall.polygon], crs=hall.crs).to_crs("EPSG:4326").iloc[0]
    assert layer.geometry.within(inside.buffer(1e-6)).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"weight_length": -1.0},
        {"weight_length": 0.0},
        {"dead_ends": -1.0},
        {"corridor_width": 0.0},
        {"time_limit": float("inf")},
    ],
)
def test_rules_out_of_range_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        RoomRules(**wrong)
