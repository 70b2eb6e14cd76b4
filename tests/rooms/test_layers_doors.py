"""Doors and distances."""

from __future__ import annotations

import dataclasses
import math

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.rooms.layers.distance import edge_distances, point_distances, vertex_distances
from platwright.rooms.layers.doors import place_doors
from platwright.rooms.layers.width import widen

from .layer_examples import MESHES, floor_plan, outline, random_plan, vertex, walk


def furnished(problem, plan, width=2.0, door=0.9):
    ground = widen(problem, plan, outline(problem), width)
    far = vertex_distances(problem.network.mesh, plan.active, problem.network.sinks)
    return ground, place_doors(problem, plan, ground, far, door)


def row(columns, rooms, sink):
    """Return rooms to both sides of a corridor along y = 4, as (first column, last, row)."""
    mesh = grid(columns, 2, 4.0)
    faces = [tuple(range(columns * j + a, columns * j + b + 1)) for a, b, j in rooms]
    edges = walk(mesh, [(0, 4), (4 * columns, 4)])
    return floor_plan(mesh, faces, edges, [vertex(mesh, sink, 4)])


def test_doors_are_near_the_sink_and_clear_of_corners():
    problem, plan = row(4, [(0, 1, 0), (2, 3, 0), (0, 3, 1)], 0)
    _, doors = furnished(problem, plan)
    # 0.3 m of wall and half of 0.9 m
    assert [door.middle.tolist() for door in doors] == [[0.75, 3], [8.75, 3], [0.75, 5]]
    assert [door.side for door in doors] == ["N", "N", "S"]
    assert [door.rotation for door in doors] == [0, 0, 180]
    for door in doors:
        assert np.ptp(door.line[:, 0]) == pytest.approx(0.9)
        assert np.ptp(door.line[:, 1]) == 0


def test_a_sink_amid_a_wall_has_the_door_in_front_of_it():
    problem, plan = row(4, [(0, 3, 0), (0, 3, 1)], 8)
    _, doors = furnished(problem, plan)
    assert [door.middle.tolist() for door in doors] == [[8, 3], [8, 5]]


def test_a_short_wall_has_its_door_in_the_middle():
    mesh = grid(4, 2, 2.0)
    faces = [(f,) for f in range(8)]
    edges = walk(mesh, [(0, 2), (8, 2)])
    problem, plan = floor_plan(mesh, faces, edges, [vertex(mesh, 0, 2)])
    _, doors = furnished(problem, plan, 1.0)
    assert [float(door.middle[0]) for door in doors] == [1, 3, 5, 7] * 2


def test_a_wall_shorter_than_a_door_has_a_narrow_one():
    mesh = grid(2, 2, 0.7)
    problem, plan = floor_plan(
        mesh, [(0,), (1,), (2,), (3,)], walk(mesh, [(0, 0.7), (1.4, 0.7)]), [vertex(mesh, 0, 0.7)]
    )
    _, doors = furnished(problem, plan, 0.4)
    assert [door.width for door in doors] == pytest.approx([0.7] * 4)
    assert sorted(doors[0].line[:, 0]) == pytest.approx([0, 0.7])


def test_doors_that_nearly_face_each_other_are_brought_into_line():
    """The second rooms begin at 3 and 4 m, so that their own best places are 3.6 and 4.6 m."""
    mesh = grid(7, 2, 1.0)
    faces = [(0, 1, 2), (3, 4, 5, 6), (7, 8, 9, 10), (11, 12, 13)]
    edges = walk(mesh, [(0, 1), (7, 1)])
    problem, plan = floor_plan(mesh, faces, edges, [vertex(mesh, 0, 1)])
    _, doors = furnished(problem, plan, 0.3, 0.6)
    assert [float(door.middle[0]) for door in doors] == pytest.approx([0.6, 4.6, 0.6, 4.6])


def test_doors_that_cannot_be_in_line_stay():
    mesh = grid(3, 2, 1.0)
    problem, plan = floor_plan(
        mesh, [(0,), (1, 2), (3, 4), (5,)], walk(mesh, [(0, 1), (3, 1)]), [vertex(mesh, 0, 1)]
    )
    _, doors = furnished(problem, plan, 0.3, 0.6)
    assert [float(door.middle[0]) for door in doors] == pytest.approx([0.5, 2, 1, 2.5])


def test_distances_of_a_corner_by_hand():
    mesh = grid(3, 3, 4.0)
    active = np.zeros(len(mesh.edges), dtype=bool)
    active[walk(mesh, [(4, 0), (4, 8), (8, 8)])] = True
    sinks = np.zeros(len(mesh.vertices), dtype=bool)
    sinks[[vertex(mesh, 4, 0), vertex(mesh, 12, 12)]] = True
    far = vertex_distances(mesh, active, sinks)
    assert far[vertex(mesh, 8, 8)] == 12
    # a sink off the corridors is none
    assert math.isinf(far[vertex(mesh, 12, 12)])
    assert np.isfinite(far).sum() == 4
    edges = np.flatnonzero(active)
    points = np.array([[5.0, 1.5], [6.5, 9.0], [4.0, 8.0]])
    assert point_distances(mesh, far, points, edges).tolist() == [1.5, 10.5, 8]
    middle = edge_distances(mesh, far)
    assert sorted(middle[active].tolist()) == [2, 6, 10]


def test_without_a_sink_every_way_is_endless():
    mesh = grid(2, 2, 4.0)
    active = np.ones(len(mesh.edges), dtype=bool)
    far = vertex_distances(mesh, active, np.zeros(len(mesh.vertices), dtype=bool))
    assert np.isinf(far).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), name=st.sampled_from(sorted(MESHES)))
def test_distances_equal_those_of_another_library(seed, name):
    problem, plan = random_plan(MESHES[name](), seed, outer=True, spare=3)
    mesh, rng = problem.network.mesh, np.random.default_rng(seed)
    sinks = rng.random(len(mesh.vertices)) < 0.1
    graph = nx.Graph()
    for e in np.flatnonzero(plan.active).tolist():
        u, v = mesh.edges[e].tolist()
        graph.add_edge(u, v, weight=math.dist(mesh.vertices[u], mesh.vertices[v]))
    far = vertex_distances(mesh, plan.active, sinks)
    starts = set(np.flatnonzero(sinks).tolist()) & set(graph)
    wanted = nx.multi_source_dijkstra_path_length(graph, starts) if starts else {}
    for v in range(len(mesh.vertices)):
        assert far[v] == pytest.approx(wanted.get(v, math.inf))


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), name=st.sampled_from(sorted(MESHES)))
def test_doors_of_random_plans(seed, name):
    problem, plan = random_plan(MESHES[name](), seed, outer=bool(seed % 2))
    ground, doors = furnished(problem, plan, 1.2)
    assert [door.room for door in doors] == list(range(len(ground.rooms)))
    for door, room in zip(doors, ground.rooms):
        line = shapely.LineString(door.line)
        assert line.length == pytest.approx(door.width)
        corridor = ground.corridors[door.corridor]
        for polygon in (room, corridor):
            assert polygon.boundary.buffer(0.021).covers(line)
        # half a metre that way is corridor, the other way room
        way = np.array(
            [math.sin(math.radians(door.rotation)), math.cos(math.radians(door.rotation))]
        )
        assert corridor.covers(shapely.Point(door.middle + 0.05 * way))
        assert room.covers(shapely.Point(door.middle - 0.05 * way))
        # corners of the wall are clear, where it is long enough
        if math.dist(door.start, door.end) >= 1.5:
            ends = shapely.MultiPoint([door.start, door.end])
            assert line.distance(ends) >= 0.3 - 1e-9
        # no straight common wall is longer
        common = shapely.get_parts(
            shapely.line_merge(room.boundary.intersection(corridor.boundary))
        )
        for wall in common:
            simple = np.asarray(shapely.simplify(wall, 1e-6).coords)
            longest = np.hypot(*np.diff(simple, axis=0).T).max()
            assert longest <= math.dist(door.start, door.end) + 1e-3


def test_bad_input_is_refused():
    problem, plan = row(4, [(0, 1, 0), (2, 3, 0), (0, 3, 1)], 0)
    for width in (0.0, -0.9, float("nan")):
        with pytest.raises(InputError, match="door width"):
            furnished(problem, plan, 2.0, width)
    active = plan.active.copy()
    active[walk(problem.network.mesh, [(8, 4), (16, 4)])] = False
    with pytest.raises(InputError, match="Room 2 does not touch"):
        furnished(problem, dataclasses.replace(plan, active=active))
