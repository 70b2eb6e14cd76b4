"""The layers of a level, checked by plain geometry."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.rooms.levels import COLUMNS, level_layers

from .level_examples import circular, linear, moved, random_tree, solved, star, vertex

CRS = "EPSG:3067"


def test_fields_are_as_described():
    layers = level_layers(*linear(), CRS)
    assert set(layers) == set(COLUMNS)
    for name, columns in COLUMNS.items():
        own = [c for c in layers[name].columns if c != "geometry"]
        assert own == list(columns)
    assert all(layers[name].crs == CRS for name in ("blocks", "route", "doors", "sinks"))
    assert "geometry" not in layers["adjacency"].columns


def test_three_blocks_in_a_row():
    layers = level_layers(*linear(), CRS)
    blocks = layers["blocks"]
    assert blocks["order"].tolist() == [1, 2, 3]
    assert blocks["role"].tolist() == ["start", "", "goal"]
    assert blocks["degree"].tolist() == [1, 2, 1]
    assert blocks["area_m2"].tolist() == [4, 4, 4]
    assert blocks["from_start_m"].tolist() == [0, 2, 4]
    assert set(blocks["template"]) == {"square"}
    assert set(blocks["colour"]) == {"#88aacc"}
    route = layers["route"]
    assert route[["length_m", "from_start_m"]].to_numpy().tolist() == [[2, 0], [2, 2], [2, 4]]
    assert route["block_id"].tolist() == [1, 2, 3]
    rows = layers["adjacency"].to_numpy().tolist()
    assert rows == [[1, 2, 1, 2, 1], [2, 3, 2, 4, 1]]
    assert layers["doors"].geometry.iloc[1].coords[0] == (4, 1)
    assert layers["sinks"]["role"].tolist() == ["start", "goal"]
    assert layers["sinks"]["block_id"].tolist() == [1, 3]
    assert layers["sinks"]["is_sink"].all()


def test_a_goal_that_is_no_sink_is_told():
    problem, plan = circular()
    sinks = level_layers(problem, plan, CRS)["sinks"]
    assert sinks["role"].tolist() == ["start", "goal"]
    assert sinks["is_sink"].tolist() == [True, False]
    assert sinks.geometry.iloc[1].coords[0] == (3, 3)
    chosen = level_layers(problem, plan, CRS, goal=vertex(problem.network.mesh, 3, 1))
    assert chosen["blocks"]["role"].tolist() == ["start", "goal", "", ""]


def test_where_three_blocks_meet_each_two_are_neighbours():
    layers = level_layers(*star(), CRS)
    pairs = layers["adjacency"][["block_a", "block_b"]].to_numpy().tolist()
    assert sorted(pairs) == [[1, 2], [1, 3], [2, 3]]
    assert layers["doors"].geometry.distance(shapely.Point(0, 0)).max() == pytest.approx(0)


def wave(points):
    """Bend a grid smoothly, without folding it."""
    x, y = points.T
    return np.column_stack([x + 0.2 * np.sin(y), y + 0.2 * np.sin(x + 0.3 * y)]) * 7


@given(st.integers(1, 5), st.integers(1, 4), st.integers(0, 10_000), st.booleans())
@settings(max_examples=20)
def test_blocks_tile_the_ground_and_the_route_keeps_off_their_borders(columns, rows, seed, bent):
    problem, plan, _ = random_tree(columns, rows, seed)
    problem = moved(problem, wave) if bent else problem
    check_by_geometry(problem, plan)


@pytest.mark.parametrize("size", [(6, 5, [(0, 1), (6, 4)]), (8, 6, [(3, 3)])])
def test_solved_levels_by_geometry(size):
    check_by_geometry(*solved(*size))


def check_by_geometry(problem, plan):
    """Judge layers of a level without looking at the mesh but for its faces."""
    layers = level_layers(problem, plan, CRS)
    mesh = problem.network.mesh
    blocks, route, doors = layers["blocks"], layers["route"], layers["doors"]
    ground = shapely.union_all(shapely.polygons(mesh.vertices[mesh.faces]))
    assert shapely.coverage_is_valid(blocks.geometry.to_numpy())
    assert blocks.area.sum() == pytest.approx(ground.area)
    assert blocks["area_m2"].to_numpy() == pytest.approx(blocks.area.to_numpy())
    assert blocks.union_all().symmetric_difference(ground).area < 1e-6 * ground.area
    assert route["length_m"].sum() == pytest.approx(mesh.lengths[plan.active].sum())
    assert sorted(set(route["block_id"])) == blocks["block_id"].tolist()
    slack = 1e-6 * math.sqrt(ground.area)
    for number, line in zip(route["block_id"], route.geometry):
        block = blocks.geometry.iloc[number - 1]
        assert block.buffer(slack).contains(line)
        # the border is met at most in points
        assert line.intersection(block.boundary.buffer(slack)).length < 10 * slack
    for a, b, point in zip(doors["block_a"], doors["block_b"], doors.geometry):
        for number in (a, b):
            assert blocks.geometry.iloc[number - 1].boundary.distance(point) < slack
            assert route[route["block_id"] == number].distance(point).min() < slack
    drawn = {frozenset(p) for p in layers["adjacency"][["block_a", "block_b"]].to_numpy().tolist()}
    degree = [sum(number in pair for pair in drawn) for number in blocks["block_id"]]
    assert blocks["degree"].tolist() == degree


def test_layers_go_to_the_crs_that_is_asked():
    problem, plan = linear()
    problem = moved(problem, lambda points: points * 50 + (386000, 6672000))
    here = level_layers(problem, plan, CRS)
    there = level_layers(problem, plan, CRS, "EPSG:4326")
    assert there["blocks"].crs == "EPSG:4326"
    assert there["blocks"]["area_m2"].tolist() == here["blocks"]["area_m2"].tolist()
    x, y = there["adjacency"][["x", "y"]].iloc[0]
    assert (x, y) == pytest.approx(there["doors"].geometry.iloc[0].coords[0])
    assert 24 < x < 26
    assert 60 < y < 61


def test_a_block_around_a_yard_has_a_hole():
    """One block of the 8 squares around the middle one, which is an obstacle."""
    from platwright.mesh.grids import grid

    from .level_examples import level_problem, plan_of, walk

    mesh = grid(3, 3)
    problem = level_problem(mesh, [(0, (0, 1, 2, 3, 5, 6, 7, 8))], [vertex(mesh, 1, 0)])
    floor = np.ones(9, dtype=bool)
    floor[4] = False
    problem = dataclasses.replace(problem, floor=floor)
    plan = plan_of(problem, [0], walk(mesh, [(1, 0), (1, 1)]))
    blocks = level_layers(problem, plan, CRS)["blocks"]
    assert blocks["area_m2"].tolist() == [8]
    assert len(blocks.geometry.iloc[0].interiors) == 1
