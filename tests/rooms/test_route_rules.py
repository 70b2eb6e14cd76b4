"""Length of the route and number of treasure rooms, counted again from faces and layers."""

from __future__ import annotations

import dataclasses
import itertools
import math
import time

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from clock import allowed
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InfeasibleError, InputError
from platwright.mesh.grids import grid
from platwright.network.evaluate import evaluate
from platwright.network.requirements.budget import LeastLength, LengthBudget
from platwright.network.structure import structure
from platwright.rooms.floors import floors_of
from platwright.rooms.level import design_level
from platwright.rooms.levels import faults, level_layers, read_level
from platwright.rooms.program.evaluate import faults as program_faults
from platwright.rooms.program.index import RoomIndex
from platwright.rooms.rules import RoomRules, RouteRules
from platwright.rooms.search.passing import least_length_cost
from platwright.rooms.shapes import shipped_templates
from platwright.rooms.solve import solve_rooms
from platwright.rooms.types import Template, Treasures
from platwright.rooms.why import NoPlanError
from platwright.rooms.why.route import longest_route, most_blocks

from .level_examples import random_tree, vertex
from .support import room_problem

UTM = 32632
QUICK = RoomRules(time_limit=30.0, gap=1.0)
LOOSE = {"dead_ends": 0.0, "too_close": 0.0, "zigzags": 0.0, "branches": 0.0}


@pytest.fixture(scope="module")
def hall():
    corner = np.array([500_000.0, 5_000_000.0])
    shape = [(0, 0), (60, 0), (60, 30), (35, 30), (35, 50), (0, 50)]
    frame = gpd.GeoDataFrame(geometry=[shapely.Polygon([corner + p for p in shape])], crs=UTM)
    (floor,) = floors_of(frame, module=5.0)
    return floor


def treasure_rooms(layers, start, goal) -> int:
    """Count blocks with one door place, away from start and goal, from the layers alone."""
    places: dict[int, set] = {block: set() for block in layers["blocks"]["block_id"]}
    for door in layers["doors"].itertuples():
        at = (round(door.geometry.x, 3), round(door.geometry.y, 3))
        places[door.block_a].add(at)
        places[door.block_b].add(at)
    route = layers["route"]
    ends = [shapely.Point(p) for p in (start, goal)]
    near = {
        own.block_id
        for own in route.itertuples()
        if any(own.geometry.distance(end) < 1e-3 for end in ends)
    }
    return sum(len(own) == 1 and block not in near for block, own in places.items())


def drawn(floor, level):
    """Return the layers of a level, its start and its goal as points."""
    ends = {"start": level.start, "goal": level.goal}
    layers = level_layers(level.problem, level.plan, floor.crs, **ends)
    at = layers["sinks"].set_index("role").geometry
    return layers, (at["start"].x, at["start"].y), (at["goal"].x, at["goal"].y)


@pytest.mark.parametrize(
    ("level_type", "low", "high"),
    [
        ("branching", 250.0, 262.0),
        ("branching", 0.0, 200.0),
        ("circular", 220.0, math.inf),
        ("linear", 200.0, 225.0),
    ],
)
def test_the_route_is_as_long_as_asked(hall, level_type, low, high):
    wanted = RouteRules(least_length=low, most_length=high)
    level = design_level(hall, shipped_templates("caves"), QUICK, level_type, route=wanted)
    assert faults(level.problem, level.plan, level_type) == []
    lines = drawn(hall, level)[0]["route"].geometry
    # lengths count in whole millimetres
    assert low - 0.1 <= float(lines.length.sum()) <= high + 0.1
    assert shapely.line_merge(shapely.union_all(list(lines))).length == pytest.approx(
        float(lines.length.sum())
    )


@pytest.mark.parametrize("number", [0, 1, 4])
@pytest.mark.parametrize("places", [(), ((10.0, 10.0),), ((10.0, 10.0), (50.0, 20.0))])
def test_there_are_as_many_treasure_rooms_as_asked(hall, number, places):
    given_places = [(500_000 + x, 5_000_000 + y) for x, y in places]
    wanted = RouteRules(treasures=number)
    shapes = shipped_templates("caves")
    level = design_level(hall, shapes, QUICK, "branching", given_places, route=wanted)
    assert faults(level.problem, level.plan, "branching") == []
    layers, start, goal = drawn(hall, level)
    assert list(layers["blocks"]["role"]).count("treasure") == number
    assert treasure_rooms(layers, start, goal) == number


def test_length_and_treasures_hold_together(hall):
    wanted = RouteRules(least_length=240.0, most_length=250.0, treasures=5)
    level = design_level(hall, shipped_templates("caves"), QUICK, "branching", route=wanted)
    layers, start, goal = drawn(hall, level)
    assert 239.9 <= float(layers["route"].geometry.length.sum()) <= 250.1
    assert treasure_rooms(layers, start, goal) == 5


def test_treasure_rooms_stay_as_many_while_the_search_goes_on(hall):
    rules = RoomRules(time_limit=6.0)
    first = design_level(
        hall, shipped_templates("caves"), QUICK, "branching", route=RouteRules(treasures=6)
    )
    level = design_level(
        hall, shipped_templates("caves"), rules, "branching", route=RouteRules(treasures=6)
    )
    layers, start, goal = drawn(hall, level)
    assert treasure_rooms(layers, start, goal) == 6
    assert level.plan.objective < first.plan.objective


@pytest.mark.parametrize(
    ("level_type", "wanted", "words"),
    [
        ("branching", RouteRules(treasures=60), ["60 treasure rooms", "at most"]),
        ("circular", RouteRules(least_length=3000.0), ["at least 3000 m", "longer than"]),
        ("branching", RouteRules(most_length=20.0), ["at most 20 m", "longer than"]),
        ("linear", RouteRules(most_length=20.0), ["at most 20 m", "longer than"]),
    ],
)
def test_what_no_route_can_keep_is_told_at_once(hall, level_type, wanted, words):
    begin = time.monotonic()
    with pytest.raises(NoPlanError) as caught:
        design_level(hall, shipped_templates("caves"), QUICK, level_type, route=wanted)
    assert time.monotonic() - begin < allowed(10)
    assert all(word in str(caught.value) for word in words)


def test_a_search_in_vain_names_the_wishes(hall):
    rules = RoomRules(time_limit=1.5)
    wanted = RouteRules(treasures=23, least_length=100.0)
    with pytest.raises(InfeasibleError, match="number of treasure rooms"):
        design_level(hall, shipped_templates("caves"), rules, "branching", route=wanted)


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ({"least_length": 30.0, "most_length": 20.0}, "at least 30 m and at most 20 m"),
        ({"least_length": -1.0}, "least length of the route is -1"),
        ({"least_length": math.inf}, "least length"),
        ({"least_length": math.nan}, "least length"),
        ({"most_length": 0.0}, "greatest length of the route is 0"),
        ({"most_length": math.nan}, "greatest length"),
        ({"treasures": -1}, "treasure rooms is -1"),
    ],
)
def test_wishes_that_contradict_are_refused(numbers, text):
    with pytest.raises(InputError, match=text):
        RouteRules(**numbers)


@pytest.mark.parametrize("level_type", ["circular", "linear"])
def test_rings_and_lines_have_no_treasure_rooms(hall, level_type):
    shapes = shipped_templates("caves")
    with pytest.raises(InputError, match="branching"):
        design_level(hall, shapes, QUICK, level_type, route=RouteRules(treasures=1))
    level = design_level(hall, shapes, QUICK, level_type, route=RouteRules(treasures=0))
    assert "treasure" not in read_level(level.problem, level.plan, start=level.start).roles


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 5), st.integers(2, 4), st.integers(0, 9999), st.integers(-2, 2))
def test_the_leaves_of_a_tree_are_its_treasures(columns, rows, seed, more):
    problem, plan, tree = random_tree(columns, rows, seed)
    start = vertex(problem.network.mesh, 0, 1)
    leaves = sum(degree == 1 and block != 0 for block, degree in tree.degree)
    asked = Treasures(max(0, leaves + more), max(0, leaves + more), (start,))
    counted = dataclasses.replace(problem, treasures=asked)
    wrong = more != 0 and asked.least != leaves
    said = [text for text in faults(counted, plan) if "one passage" in text]
    assert bool(said) == wrong
    inside = program_faults(RoomIndex(counted), plan.active, list(plan.rooms))
    assert any("treasure" in text for text in inside) == wrong
    # the goal is the farthest leaf, which leaves one fewer
    assert read_level(counted, plan, start=start).roles.count("treasure") == max(0, leaves - 1)


def test_a_block_at_the_goal_is_no_treasure():
    problem, plan, tree = random_tree(4, 3, 5)
    mesh = problem.network.mesh
    leaf = max(block for block, degree in tree.degree if degree == 1)
    goal = vertex(mesh, 2 * (leaf % 4) + 1, 2 * (leaf // 4) + 1)
    start = vertex(mesh, 0, 1)
    leaves = sum(degree == 1 and block != 0 for block, degree in tree.degree)
    asked = Treasures(leaves - 1, leaves - 1, (start, goal))
    counted = dataclasses.replace(problem, treasures=asked)
    assert faults(counted, plan) == []
    assert read_level(counted, plan, start=start, goal=goal).roles.count("treasure") == leaves - 1


def tiny(treasures, least, most):
    """Return a level of 4 by 2 cells with wishes."""
    mesh = grid(4, 2)
    metres = np.linspace(3.0, 5.0, len(mesh.edges))
    wishes = []
    if least is not None:
        wishes.append(LeastLength(metres, least, 5.0))
    if most is not None:
        wishes.append(LengthBudget(metres, most, 5.0))
    sink = vertex(mesh, 1, 1)
    problem = room_problem(
        mesh, ["1x2", "2x2"], "level", sinks=[sink], requirements=tuple(wishes), **LOOSE
    )
    asked = None if treasures is None else Treasures(*treasures, (sink,))
    return dataclasses.replace(problem, treasures=asked), metres


def levels_of(problem):
    """Yield all levels of a tiny problem: tiling and edges, by trying everything."""
    mesh, placements = problem.network.mesh, problem.placements
    edges = np.flatnonzero(problem.network.candidate).tolist()
    (sink,) = np.flatnonzero(problem.network.sinks).tolist()
    bare = dataclasses.replace(problem.network, requirements=())
    for chosen in itertools.product((False, True), repeat=len(edges)):
        on = {e for e, own in zip(edges, chosen) if own}
        way = nx.Graph(mesh.edges[sorted(on)].tolist())
        if sink not in way or not nx.is_connected(way):
            continue
        active = np.zeros(len(mesh.edges), dtype=bool)
        active[sorted(on)] = True
        value = evaluate(bare, active).objective
        for rooms in tilings(problem, frozenset(), ()):
            inner = [on & set(placements.inner[r]) for r in rooms]
            along = any(on & set(placements.rim[r]) for r in rooms)
            whole = [nx.Graph(mesh.edges[sorted(own)].tolist()) for own in inner]
            if all(inner) and not along and all(nx.is_connected(own) for own in whole):
                yield rooms, on, value


def tilings(problem, covered, rooms):
    free = [f for f in range(len(problem.floor)) if f not in covered]
    if not free:
        yield rooms
        return
    for r, faces in enumerate(problem.placements.faces):
        if free[0] in faces and not covered & set(faces):
            yield from tilings(problem, covered | set(faces), (*rooms, r))


def dead_ends_of(problem, rooms, on) -> int:
    """Count the blocks with one passage that do not touch the sink."""
    ends = problem.network.mesh.edges.tolist()
    touched = [{v for e in on & set(problem.placements.inner[r]) for v in ends[e]} for r in rooms]
    (sink,) = np.flatnonzero(problem.network.sinks).tolist()
    count = 0
    for i, own in enumerate(touched):
        others = set().union(*touched[:i], *touched[i + 1 :])
        count += len(own & others) == 1 and sink not in own
    return count


@pytest.mark.parametrize("solver", ["cpsat", "highs"])
@pytest.mark.parametrize(
    ("treasures", "least", "most"),
    [
        ((2, 2), None, None),
        ((0, 0), None, None),
        ((1, 1), 20.0, None),
        (None, 22.5, 24.0),
        (None, None, 16.0),
        ((3, 3), None, None),
        ((0, 1), 25.0, 28.0),
    ],
)
def test_optima_are_those_of_trying_everything(solver, treasures, least, most):
    problem, metres = tiny(treasures, least, most)
    best = math.inf
    for rooms, on, value in levels_of(problem):
        length = sum(round(metres[e] * 1000) for e in on)
        fits = (least or 0.0) * 1000 <= length <= (most or math.inf) * 1000
        dead = dead_ends_of(problem, rooms, on)
        if fits and (treasures is None or treasures[0] <= dead <= treasures[1]):
            best = min(best, value)
    if math.isinf(best):
        with pytest.raises(InfeasibleError):
            solve_rooms(problem, time_limit=20, solver=solver)
        return
    plan = solve_rooms(problem, time_limit=20, solver=solver)
    assert plan.objective == pytest.approx(best)
    assert faults(problem, plan) == []


def test_no_level_has_more_blocks_or_a_longer_route_than_is_said():
    problem, metres = tiny(None, None, None)
    index = RoomIndex(problem)
    found = list(levels_of(problem))
    assert found
    assert max(len(rooms) for rooms, _, _ in found) <= most_blocks(index)
    longest = max(sum(metres[e] for e in on) for _, on, _ in found)
    assert longest <= longest_route(index, metres) + 1e-9
    single = dataclasses.replace(problem.network, branches=math.inf)
    ways = RoomIndex(dataclasses.replace(problem, network=single))
    ends = problem.network.mesh.edges
    plain = [
        sum(metres[e] for e in on)
        for _, on, _ in found
        if np.bincount(ends[sorted(on)].ravel()).max() <= 2
    ]
    assert max(plain) <= longest_route(ways, metres) + 1e-9
    assert longest_route(ways, metres) <= longest_route(index, metres)


@pytest.mark.parametrize("least", [0.0, 12.0, 21.5, 24.0])
def test_the_cost_of_a_least_length_is_a_bound(least):
    problem, metres = tiny(None, least, None)
    bound = least_length_cost(structure(problem.network))
    fit = [v for _, on, v in levels_of(problem) if sum(metres[e] for e in on) >= least + 0.1]
    assert bound <= min(fit) + 1e-9
    assert bool(bound) == bool(least)


def test_squares_alone_have_treasures_with_the_other_solver():
    square = (Template("square", frozenset((i, j) for i in (0, 1) for j in (0, 1))),)
    box = shapely.box(500_000, 5_000_000, 500_030, 5_000_020)
    frame = gpd.GeoDataFrame(geometry=[box], crs=UTM)
    (floor,) = floors_of(frame, module=5.0)
    rules = dataclasses.replace(QUICK, solver="highs")
    level = design_level(floor, square, rules, "branching", route=RouteRules(treasures=2))
    layers, start, goal = drawn(floor, level)
    assert treasure_rooms(layers, start, goal) == 2


def test_a_fault_of_length_is_found_without_the_solver():
    problem, plan, _ = random_tree(3, 2, 1)
    metres = problem.network.mesh.lengths
    total = float(metres[plan.active].sum())
    for wish, wrong in (
        (LeastLength(metres, total, 1.0), False),
        (LeastLength(metres, total + 1.0, 1.0), True),
        (LengthBudget(metres, total, 1.0), False),
        (LengthBudget(metres, total - 1.0, 1.0), True),
    ):
        network = dataclasses.replace(problem.network, requirements=(wish,))
        said = faults(dataclasses.replace(problem, network=network), plan)
        assert bool(said) == wrong


def test_routes_that_may_end_anywhere_get_shorter(hall):
    # stubs in every block, unconnected, are cheapest for each window and no level
    shapes = shipped_templates("caves")
    first = design_level(hall, shapes, QUICK, "branching").plan.objective
    rules = RoomRules(time_limit=6.0)
    assert design_level(hall, shapes, rules, "branching").plan.objective < 0.8 * first


def test_a_tight_limit_is_come_to_by_making_a_long_route_shorter():
    corner = np.array([500_000.0, 5_000_000.0])
    shape = [(0, 0), (90, 0), (90, 40), (60, 40), (60, 70), (0, 70)]
    frame = gpd.GeoDataFrame(geometry=[shapely.Polygon([corner + p for p in shape])], crs=UTM)
    (floor,) = floors_of(frame, module=5.0)
    shapes = shipped_templates("caves")
    free = design_level(floor, shapes, QUICK, "branching")
    metres = floor.mesh.lengths
    most = 0.72 * float(metres[free.plan.active].sum())
    wanted = RouteRules(most_length=most)
    level = design_level(floor, shapes, QUICK, "branching", route=wanted)
    assert float(metres[level.plan.active].sum()) <= most + 0.1
    assert faults(level.problem, level.plan, "branching") == []
