"""The independent check finds each fault that a level may have, and none in a right one."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.rooms.levels import faults, level_type
from platwright.rooms.types import CountRule

from .level_examples import (
    circular,
    level_problem,
    linear,
    plan_of,
    random_tree,
    solved,
    star,
    vertex,
    walk,
)


def test_right_levels_have_no_faults():
    for problem, plan in (linear(), circular(), star(), random_tree(4, 3, 5)[:2]):
        assert faults(problem, plan) == []
    assert faults(*solved(6, 5, [(0, 1), (6, 4)]), "linear") == []
    assert faults(*solved(8, 6, [(3, 3)]), "circular") == []


def test_the_type_follows_from_branches_and_sinks():
    assert level_type(linear()[0]) == "linear"
    assert level_type(circular()[0]) == "circular"
    assert level_type(star()[0]) == "branching"


def test_a_level_of_another_type_has_faults():
    said = faults(*circular(), "linear")
    assert "A linear level has 2 sinks, this one has 1." in said
    said = faults(*linear(), "circular")
    assert "A circular level has 1 sinks, this one has 2." in said
    assert any(s.startswith("1 edges of the route meet at sink") for s in said)
    tree = random_tree(4, 3, 5)[:2]
    assert "4 edges of the route meet at vertex 30, 2 should." in faults(*tree, "linear")
    with pytest.raises(InputError, match="'spiral' is no type of level"):
        faults(*linear(), "spiral")


def test_gaps_overlaps_and_obstacles_are_found():
    problem, plan = linear()
    said = faults(problem, dataclasses.replace(plan, rooms=(0, 1)))
    assert "Face 4 is in 0 blocks." in said
    assert any("is in no block at mesh edge" in s for s in said)
    said = faults(problem, dataclasses.replace(plan, rooms=(0, 0, 1, 2)))
    assert "Face 0 is in 2 blocks." in said
    floor = problem.floor.copy()
    floor[7] = False
    said = faults(dataclasses.replace(problem, floor=floor), plan)
    assert said == ["Face 7 is in 1 blocks, but is an obstacle."]
    assert faults(problem, dataclasses.replace(plan, rooms=(0, 1, 9)))[0] == (
        "Placement 9 does not exist."
    )


def test_blocks_of_the_wrong_size_are_found():
    problem, plan = linear()
    placements = dataclasses.replace(problem.placements, template=np.array([0, 1, 0]))
    said = faults(dataclasses.replace(problem, placements=placements), plan)
    assert said == ["Block 2 has not the size of template 'slab'."]


def test_numbers_out_of_range_are_found():
    problem, plan = linear()
    rule = CountRule("at most 2 of 'square'", np.ones(3), -math.inf, 2)
    assert faults(dataclasses.replace(problem, counts=(rule,)), plan) == [
        "The level has 3, asked was at most 2 of 'square'."
    ]
    rule = dataclasses.replace(rule, most=3)
    assert faults(dataclasses.replace(problem, counts=(rule,)), plan) == []


def test_routes_along_borders_and_blocks_left_out_are_found():
    problem, _ = linear()
    mesh = problem.network.mesh
    way = walk(mesh, [(0, 1), (6, 1)])
    (spur,) = walk(mesh, [(2, 1), (2, 2)])
    said = faults(problem, plan_of(problem, range(3), [*way, spur]))
    assert f"The route runs along the border of block 1 at mesh edge {spur}." in said
    assert f"The route runs along the border of block 2 at mesh edge {spur}." in said
    said = faults(problem, plan_of(problem, range(3), way[:4]))
    assert "The route leaves out block 3." in said


def test_a_route_in_parts_is_found():
    problem, _ = linear()
    mesh = problem.network.mesh
    way = walk(mesh, [(0, 1), (6, 1)])
    said = faults(problem, plan_of(problem, range(3), way[:2] + way[3:]))
    assert "The route is in 2 parts." in said
    assert any(s.startswith("Street ends at vertex") for s in said)


def test_a_block_crossed_twice_is_found():
    """A slab whose route leaves into the neighbour below and comes back."""
    mesh = grid(4, 4)
    # two slabs of 4 by 2 above each other, entered at x = 1 and left at x = 3
    rooms = [(0, tuple(range(8))), (0, tuple(range(8, 16)))]
    sinks = [vertex(mesh, 1, 0), vertex(mesh, 3, 0)]
    problem = level_problem(mesh, rooms, sinks)
    plan = plan_of(problem, [0, 1], walk(mesh, [(1, 0), (1, 3), (3, 3), (3, 0)]))
    size = ["Block 1 has not the size", "Block 2 has not the size"]
    said = [s for s in faults(problem, plan) if not s.startswith(tuple(size))]
    assert said == ["The route runs through block 1 in 2 parts."]
    said = faults(problem, plan, one_part=False)
    assert [s for s in said if not s.startswith(tuple(size))] == []


def test_rules_of_the_network_are_checked():
    problem, plan, _ = random_tree(3, 3, 1)
    network = dataclasses.replace(problem.network, dead_ends=math.inf)
    said = faults(dataclasses.replace(problem, network=network), plan, "branching")
    assert said
    assert all(s.startswith("Street ends at vertex") for s in said)


def test_arrays_that_do_not_fit_are_refused():
    problem, plan = linear()
    with pytest.raises(InputError, match="edges"):
        faults(problem, dataclasses.replace(plan, active=np.zeros(3, dtype=bool)))
