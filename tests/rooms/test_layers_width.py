"""Corridors of a width and the rooms beside them tile the footprint."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.mesh.grids import fan, grid
from platwright.mesh.quadmesh import QuadMesh
from platwright.rooms.layers.width import widen
from shapely.geometry import LineString, box

from .layer_examples import MESHES, floor_plan, hand, moved, outline, random_plan, vertex, walk

FAR = np.array([691_000.123, 6_671_000.377])


def tiles(ground, polygon) -> None:
    every = np.array([*ground.rooms, *ground.corridors, *ground.obstacles], dtype=object)
    assert (shapely.get_type_id(every) == 3).all()
    assert shapely.is_valid(every).all()
    assert (shapely.area(every) > 1e-3).all()
    assert shapely.coverage_is_valid(every)
    assert shapely.area(every).sum() == pytest.approx(polygon.area, abs=1e-6)
    assert shapely.coverage_union_all(every).symmetric_difference(polygon).area < 1e-6


def two_rooms(edges, sinks=((4, 0),), columns=2):
    """Return a row of squares of 4 m, each a room on its own, above another row."""
    mesh = grid(columns, 2, 4.0)
    rooms = [(f,) for f in range(len(mesh.faces))]
    return floor_plan(mesh, rooms, walk(mesh, edges), [vertex(mesh, *p) for p in sinks])


def test_a_corridor_across_takes_half_its_width_from_each_side():
    problem, plan = two_rooms([(0, 4), (8, 4)])
    ground = widen(problem, plan, outline(problem), 2.0)
    tiles(ground, box(0, 0, 8, 8))
    assert len(ground.corridors) == 1
    assert ground.corridors[0].equals(box(0, 3, 8, 5))
    wanted = [box(0, 0, 4, 3), box(4, 0, 8, 3), box(0, 5, 4, 8), box(4, 5, 8, 8)]
    assert all(room.equals(own) for room, own in zip(ground.rooms, wanted))


def test_a_corridor_along_the_outer_wall_lies_inside():
    problem, plan = two_rooms([(0, 0), (8, 0), (8, 4)])
    ground = widen(problem, plan, outline(problem), 1.5)
    tiles(ground, box(0, 0, 8, 8))
    # the wall at its end keeps it from the room above
    assert ground.corridors[0].equals(box(0, 0, 8, 1.5).union(box(6.5, 0, 8, 4)))


def test_a_turn_is_mitred_into_the_room_that_it_passes():
    problem, plan = two_rooms([(4, 0), (4, 4), (8, 4)])
    ground = widen(problem, plan, outline(problem), 2.0)
    tiles(ground, box(0, 0, 8, 8))
    assert ground.corridors[0].equals(box(3, 0, 5, 5).union(box(3, 3, 8, 5)))
    # the room at the outer side of the corner lost a square of 1 m
    assert ground.rooms[2].area == 15


def test_a_dead_end_is_square_and_stops_at_the_wall():
    problem, plan = two_rooms([(4, 0), (4, 4)])
    ground = widen(problem, plan, outline(problem), 2.0)
    tiles(ground, box(0, 0, 8, 8))
    assert ground.corridors[0].equals(box(3, 0, 5, 4))
    assert [room.area for room in ground.rooms] == [12, 12, 16, 16]


def test_a_slanting_wall_ends_a_corridor_without_spikes():
    """The walls across lean by 20 degrees; square ends would leave spikes of the rooms."""
    problem, plan = two_rooms([(4, 0), (4, 4)])
    lean = np.tan(np.radians(20.0))
    problem = moved(problem, lambda p: np.column_stack([p[:, 0], p[:, 1] + lean * p[:, 0]]))
    ground = widen(problem, plan, outline(problem), 2.0)
    tiles(ground, outline(problem))
    middle = lean * 4
    wanted = [
        (3, middle - lean),
        (5, middle + lean),
        (5, middle + 4 + lean),
        (3, middle + 4 - lean),
    ]
    wrong = ground.corridors[0].symmetric_difference(shapely.Polygon(wanted))
    assert wrong.area < 1e-6


def test_around_an_obstacle_a_corridor_lies_on_the_floor():
    mesh = grid(3, 3, 4.0)
    rooms = [(f,) for f in range(9) if f != 4]
    edges = walk(mesh, [(4, 4), (8, 4), (8, 8), (4, 8), (4, 4), (0, 4)])
    problem, plan = floor_plan(mesh, rooms, edges, [vertex(mesh, 0, 4)])
    ground = widen(problem, plan, outline(problem), 1.0)
    tiles(ground, box(0, 0, 12, 12))
    assert [shaft.equals(box(4, 4, 8, 8)) for shaft in ground.obstacles] == [True]
    way_in = box(0, 3.5, 4, 4.5)
    around = box(3, 3, 9, 9).union(way_in).difference(box(4, 4, 8, 8))
    assert ground.corridors[0].equals(around)


@pytest.mark.parametrize("bow", [-0.2, -0.01, -1e-5, 0.0, 1e-5, 0.01, 0.2])
def test_past_an_obstacle_a_corridor_changes_its_depth_by_a_step(bow):
    """The wall of the obstacle and the corridor that goes on from it meet at nearly 180 degrees."""
    mesh = grid(2, 2, 4.0)
    edges = walk(mesh, [(0, 4), (8, 4)])
    problem, plan = floor_plan(mesh, [(1,), (2,), (3,)], edges, [vertex(mesh, 0, 4)])
    problem = moved(problem, lambda p: p + np.column_stack([p[:, 0] * 0, bow * (p[:, 0] == 4)]))
    ground = widen(problem, plan, outline(problem), 2.0)
    tiles(ground, outline(problem))
    # above the obstacle all of the width, then half to each side; four sides of it lean
    wanted = box(0, 4, 4, 6).union(box(4, 3, 8, 5))
    assert ground.corridors[0].symmetric_difference(wanted).area < 9 * abs(bow) + 1e-6


def test_round_an_irregular_vertex_corridors_are_as_wide_as_asked():
    mesh = fan(3, 2, 6.0)
    spokes = [e for e, pair in enumerate(mesh.edges.tolist()) if 0 in pair]
    rooms = [tuple(range(4 * k, 4 * k + 4)) for k in range(3)]
    ends = [int(mesh.edges[e].max()) for e in spokes]
    edges = spokes + [
        e for e, (u, v) in enumerate(mesh.edges.tolist())
        if (u in ends or v in ends) and 0 not in (u, v)
        and abs(np.cross(mesh.vertices[u], mesh.vertices[v])) < 1e-9
    ]  # fmt: skip
    sinks = [int(mesh.edges[e].max()) for e in edges[3:]]
    problem, plan = floor_plan(mesh, rooms, edges, sinks)
    ground = widen(problem, plan, outline(problem), 2.0)
    tiles(ground, outline(problem))
    # three rhombi of 120 degrees in a hexagon of side 12: each keeps its shape, 1 m off two sides
    side = 12 - 2 / np.sqrt(3)
    assert [room.area for room in ground.rooms] == pytest.approx([side**2 * np.sqrt(3) / 2] * 3)


def test_two_corridors_apart_are_two_polygons():
    problem, plan = two_rooms([(4, 0), (4, 4)], columns=4)
    active = plan.active.copy()
    active[walk(problem.network.mesh, [(12, 0), (12, 4)])] = True
    ground = widen(problem, dataclasses.replace(plan, active=active), outline(problem), 2.0)
    tiles(ground, box(0, 0, 16, 8))
    assert sorted(c.bounds for c in ground.corridors) == [(3, 0, 5, 4), (11, 0, 13, 4)]
    mesh = problem.network.mesh
    for e in np.flatnonzero(active).tolist():
        middle = shapely.Point(mesh.vertices[mesh.edges[e]].mean(axis=0))
        assert ground.corridors[ground.corridor[e]].covers(middle)


@pytest.mark.parametrize("width", [7.9, 8.0, 30.0])
def test_a_corridor_too_wide_names_a_width_that_would_do(width):
    """Rooms of 4 m to both sides keep 0.3 m each beside a corridor of 7.4 m."""
    problem, plan = two_rooms([(0, 4), (8, 4)])
    shape = outline(problem)
    with pytest.raises(InputError, match=r"leaves nothing of room 1 .'small'") as caught:
        widen(problem, plan, shape, width)
    told = re.search(r"width of ([0-9.]+) m", str(caught.value))
    assert 7.3 < float(told[1]) < 7.4
    tiles(widen(problem, plan, shape, float(told[1])), shape)
    with pytest.raises(InputError, match="leaves nothing"):
        widen(problem, plan, shape, float(told[1]) + 0.1)


def test_a_room_that_would_be_cut_is_named():
    """Corridors end to both sides of a long room, which is 4 m deep."""
    mesh = grid(3, 3, 4.0)
    rooms = [(3, 4, 5), *((f,) for f in (0, 1, 2, 6, 7, 8))]
    edges = walk(mesh, [(4, 0), (4, 4), (8, 4)]) + walk(mesh, [(4, 12), (4, 8), (8, 8)])
    sinks = [vertex(mesh, 4, 0), vertex(mesh, 4, 12)]
    problem, plan = floor_plan(mesh, rooms, edges, sinks)
    shape = outline(problem)
    with pytest.raises(InputError, match="cuts room 1") as caught:
        widen(problem, plan, shape, 4.0)
    told = float(re.search(r"width of ([0-9.]+) m", str(caught.value))[1])
    tiles(widen(problem, plan, shape, told), shape)
    assert 3 < told < 4


def test_bad_input_is_refused():
    problem, plan = hand()
    shape = outline(problem)
    for width in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="corridor width"):
            widen(problem, plan, shape, width)
    with pytest.raises(InputError, match="footprint"):
        widen(problem, plan, shape.buffer(0.1), 2.0)
    with pytest.raises(InputError, match="no room"):
        widen(problem, dataclasses.replace(plan, rooms=plan.rooms[1:]), shape, 2.0)
    with pytest.raises(InputError, match="not free"):
        widen(problem, dataclasses.replace(plan, rooms=(0, *plan.rooms)), shape, 2.0)
    active = plan.active.copy()
    active[problem.placements.inner[0][0]] = True
    with pytest.raises(InputError, match="inside a room"):
        widen(problem, dataclasses.replace(plan, active=active), shape, 2.0)


def widened(problem, plan, shape, width):
    """Widen, by the width that the error names where it is too much."""
    try:
        return width, widen(problem, plan, shape, width)
    except InputError as error:
        less = float(re.search(r"width of ([0-9.]+) m", str(error))[1])
    return less, widen(problem, plan, shape, less)


@pytest.mark.parametrize("name", sorted(MESHES))
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10_000), width=st.floats(0.3, 2.0), far=st.booleans())
@example(seed=0, width=1.0, far=False)  # strips that meet within rounding
@example(seed=116, width=1.0, far=False)  # a corridor that touches itself
def test_random_plans_are_tiled(name, seed, width, far):
    outer = bool(seed % 2)
    blocked = [seed % 8] if seed % 4 == 0 else []
    problem, plan = random_plan(MESHES[name](), seed, blocked=blocked, outer=outer, spare=seed % 3)
    if far:
        problem = moved(problem, lambda points: points + FAR)
    shape = outline(problem)
    width, ground = widened(problem, plan, shape, width)
    tiles(ground, shape)
    mesh = problem.network.mesh
    corridors = shapely.union_all(ground.corridors)
    for e in np.flatnonzero(plan.active).tolist():
        line = LineString(mesh.vertices[mesh.edges[e]])
        assert line.difference(corridors.buffer(1e-6)).length < 1e-6
        # the strip is all there away from its ends
        piece = shapely.ops.substring(line, 0.49, 0.51, normalized=True)
        free = shape.difference(shapely.union_all(ground.obstacles))
        strip = piece.buffer(width / 2, cap_style="flat").intersection(free)
        assert strip.difference(corridors).area < 1e-6
    # nothing is taken farther from the centre lines than a mitre reaches
    lines = shapely.union_all(shapely.linestrings(mesh.vertices[mesh.edges[plan.active]]))
    assert corridors.hausdorff_distance(lines) <= 2.2 * width
    for k, room in enumerate(ground.rooms):
        own = shapely.polygons(
            mesh.vertices[mesh.faces[list(problem.placements.faces[plan.rooms[k]])]]
        )
        assert room.difference(shapely.union_all(own)).area < 1e-6


def test_true_sides_of_the_boundary_are_kept():
    """The upper wall is a polygon line of 9 points; a corridor runs along it."""
    bare = grid(2, 2, 4.0)
    arcs = {}
    for x in (0, 4):
        u, v = vertex(bare, x, 8), vertex(bare, x + 4, 8)
        along = np.linspace(0, 1, 9)
        bow = np.column_stack([x + 4 * along, 8 + 0.8 * np.sin(np.pi * along)])
        arcs[bare.edge_between(u, v)] = bow
    mesh = QuadMesh(bare.vertices, bare.faces, 4.0, boundary_arcs=arcs)
    edges = walk(mesh, [(0, 8), (8, 8), (8, 4)])
    problem, plan = floor_plan(mesh, [(0,), (1,), (2,), (3,)], edges, [vertex(mesh, 0, 8)])
    tops = [shapely.Polygon([*a, (a[-1][0], 4), (a[0][0], 4)]) for a in arcs.values()]
    shape = shapely.union_all([box(0, 0, 8, 4), *tops])
    ground = widen(problem, plan, shape, 1.2)
    tiles(ground, shape)
    corridor, walls = ground.corridors[0], [LineString(a) for a in arcs.values()]
    for wall in walls:
        middle = shapely.ops.substring(wall, 0.1, 0.9, normalized=True)
        deep = middle.buffer(1.2 - 1e-6, cap_style="flat").intersection(shape)
        assert deep.difference(corridor).area < 1e-6
