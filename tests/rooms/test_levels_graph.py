"""Levels as graphs: who meets whom, in which order, where it starts and ends."""

from __future__ import annotations

import dataclasses
import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.rooms.levels import dead_ends, is_cycle, is_path, neighbours, read_level
from platwright.rooms.levels.graph import Passage
from platwright.rooms.levels.trails import trails

from .level_examples import circular, linear, plan_of, random_tree, solved, star, vertex, walk


def test_three_blocks_in_a_row():
    level = read_level(*linear())
    mesh = level.problem.network.mesh
    assert [(p.vertex, p.blocks) for p in level.passages] == [
        (vertex(mesh, 2, 1), (0, 1)),
        (vertex(mesh, 4, 1), (1, 2)),
    ]
    assert level.order == (1, 2, 3)
    assert level.roles == ("start", "", "goal")
    assert (level.start, level.goal) == (vertex(mesh, 0, 1), vertex(mesh, 6, 1))
    assert level.along[vertex(mesh, 3, 1)] == 3
    assert math.isinf(level.along[vertex(mesh, 3, 0)])
    assert neighbours(3, level.passages) == ((1,), (0, 2), (1,))
    assert dead_ends(3, level.passages) == (0, 2)
    assert is_path(3, level.passages)
    assert not is_cycle(3, level.passages)


def test_a_ring_is_ordered_one_way_round_and_ends_opposite():
    level = read_level(*circular())
    # blocks lie 2 3 above 0 1, so along the ring 0 1 3 2
    assert level.order == (1, 2, 4, 3)
    assert level.roles == ("start", "", "", "goal")
    assert is_cycle(4, level.passages)
    assert not is_path(4, level.passages)
    assert level.along[level.goal] == 4


def test_start_and_goal_can_be_chosen():
    problem, plan = circular()
    mesh = problem.network.mesh
    chosen = read_level(problem, plan, start=vertex(mesh, 3, 3), goal=vertex(mesh, 1, 3))
    assert chosen.roles == ("", "", "goal", "start")
    assert chosen.order[3] == 1
    with pytest.raises(InputError, match="goal of the level, mesh vertex 12, is not on its route"):
        read_level(problem, plan, goal=vertex(mesh, 2, 2))


def test_a_ring_may_start_where_two_blocks_meet():
    problem, plan = circular()
    at = vertex(problem.network.mesh, 1, 2)
    level = read_level(problem, plan, start=at)
    assert level.order[level.start_block] == 1
    assert sorted(level.order) == [1, 2, 3, 4]
    # one after the other are neighbours
    queue = sorted(range(4), key=lambda b: level.order[b])
    near = neighbours(4, level.passages)
    assert all(b in near[a] for a, b in zip(queue, queue[1:]))


def test_three_blocks_may_meet_at_one_vertex():
    level = read_level(*star())
    assert [p.blocks for p in level.passages] == [(0, 1, 2)]
    assert neighbours(3, level.passages) == ((1, 2), (0, 2), (0, 1))
    assert dead_ends(3, level.passages) == (0, 1, 2)
    assert level.roles == ("start", "goal", "treasure")
    # the meeting is no ring: a player gets back only the way she came
    assert not is_cycle(3, level.passages)


def test_two_passages_between_two_blocks_are_a_ring():
    twice = (Passage(4, (0, 1)), Passage(9, (0, 1)))
    assert is_cycle(2, twice)
    assert not is_path(2, twice)
    assert dead_ends(2, twice) == ()


@given(st.integers(1, 5), st.integers(1, 5), st.integers(0, 10_000))
@settings(max_examples=30)
def test_blocks_of_a_random_tree_meet_as_drawn(columns, rows, seed):
    problem, plan, tree = random_tree(columns, rows, seed)
    level = read_level(problem, plan)
    found = nx.Graph([pair for p in level.passages for pair in [p.blocks]])
    assert {frozenset(e) for e in found.edges} == {frozenset(e) for e in tree.edges}
    far = nx.single_source_shortest_path_length(tree, 0)
    by_rank = sorted(range(level.count), key=lambda b: level.order[b])
    # breadth first, or along where nothing branches, never gets nearer to the start
    assert [far[b] for b in by_rank] == sorted(far.values())
    if columns * rows > 1:
        assert far[level.goal_block] == max(far.values())
    ends = {b for b in tree if tree.degree(b) == 1} - {0, level.goal_block}
    assert {b for b, role in enumerate(level.roles) if role == "treasure"} == ends


@given(st.integers(1, 5), st.integers(1, 5), st.integers(0, 10_000))
@settings(max_examples=30)
def test_trails_hold_every_edge_once_and_lead_away(columns, rows, seed):
    problem, plan, _ = random_tree(columns, rows, seed)
    level = read_level(problem, plan)
    mesh = problem.network.mesh
    pieces = trails(mesh.edges, level.route, level.along, stops=(level.start,))
    assert sorted(e for p in pieces for e in p.edges) == np.flatnonzero(plan.active).tolist()
    for piece in pieces:
        for e, u, v in zip(piece.edges, piece.vertices, piece.vertices[1:]):
            assert {u, v} == set(mesh.edges[e].tolist())
            assert level.along[v] == pytest.approx(level.along[u] + 1)


def test_trails_follow_rings_without_stops():
    problem, plan = circular()
    mesh = problem.network.mesh
    (ring,) = trails(mesh.edges, plan.active, np.zeros(len(mesh.vertices)))
    assert ring.vertices[0] == ring.vertices[-1]
    assert len(ring.edges) == 8


def test_solved_levels_are_paths_and_rings():
    path = read_level(*solved(6, 5, [(0, 1), (6, 4)]))
    assert is_path(path.count, path.passages)
    assert path.order[path.goal_block] == path.count
    ring = read_level(*solved(8, 6, [(3, 3)]))
    assert is_cycle(ring.count, ring.passages)


def test_plans_that_are_no_levels_are_refused():
    problem, plan = linear()
    mesh = problem.network.mesh
    border = plan_of(problem, range(3), walk(mesh, [(0, 1), (6, 1)]) + walk(mesh, [(2, 1), (2, 2)]))
    with pytest.raises(InputError, match="along the border of a block"):
        read_level(problem, border)
    short = plan_of(problem, range(3), walk(mesh, [(0, 1), (4, 1)]))
    with pytest.raises(InputError, match="leaves out block 3"):
        read_level(problem, short)
    with pytest.raises(InputError, match="Blocks 1 and 4 of the level overlap"):
        read_level(problem, dataclasses.replace(plan, rooms=(0, 1, 2, 0)))
    parts = plan_of(problem, range(3), walk(mesh, [(0, 1), (2, 1)]) + walk(mesh, [(3, 1), (6, 1)]))
    with pytest.raises(InputError, match=r"leaves out|cannot be reached"):
        read_level(problem, parts)
    nowhere = dataclasses.replace(
        problem, network=dataclasses.replace(problem.network, sinks=np.zeros(21, dtype=bool))
    )
    with pytest.raises(InputError, match="No sink is on the route"):
        read_level(nowhere, plan)
