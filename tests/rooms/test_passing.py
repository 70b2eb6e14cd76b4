"""The bound of routes through tilings, against plans and against blocks counted by hand."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InfeasibleError
from platwright.mesh.grids import grid
from platwright.network.problem import Pattern
from platwright.network.structure import structure
from platwright.rooms.program.index import RoomIndex
from platwright.rooms.search.passing import least_way, may_end, passing_bound
from platwright.rooms.solve import solve_rooms

from .support import room_problem


def bound_of(problem) -> float:
    return passing_bound(structure(problem.network), RoomIndex(problem), lambda: False)


def way_through(nx, ny, name, **rules):
    """Return the least way through the only block of a grid; its single exit is far from it."""
    problem = room_problem(grid(nx, ny), [name], "level", sinks=[0], **rules)
    problem = dataclasses.replace(
        problem,
        network=dataclasses.replace(
            problem.network, candidate=np.ones(len(problem.network.candidate), dtype=bool)
        ),
    )
    index = structure(problem.network, strip=False)
    return least_way(index, RoomIndex(problem), 0, may_end(index))


@pytest.mark.parametrize(
    ("size", "name", "least"),
    [((2, 2), "2x2", 2.0), ((2, 1), "1x2", 1.0), ((3, 3), "3x3", 2.0), ((3, 2), "3x2", 2.0)],
)
def test_what_runs_through_a_block_joins_two_places_on_its_rim(size, name, least):
    assert way_through(*size, name) == least


def test_where_ends_are_allowed_one_edge_will_do():
    assert way_through(3, 3, "3x3", dead_ends=0.0) == 1.0


@settings(max_examples=15)
@given(
    nx=st.integers(3, 8),
    ny=st.integers(3, 7),
    weight=st.sampled_from([1.0, 2.5]),
    away=st.sampled_from([0.0, 1.0]),
    ends=st.sampled_from([math.inf, 0.0]),
    seed=st.integers(0, 3),
)
def test_no_plan_is_cheaper_than_the_bound(nx, ny, weight, away, ends, seed):
    problem = room_problem(
        grid(nx, ny), ["2x2", "3x2", "L", "1x2", "3x3"], "level", dead_ends=ends, too_close=0.0,
        weight_length=weight, weight_distance=away,
    )  # fmt: skip
    try:
        plan = solve_rooms(problem, time_limit=4, iterations=6, seed=seed)
    except InfeasibleError:
        return
    bound = bound_of(problem)
    length = weight * problem.network.length[plan.active].sum()
    assert 0 < bound <= length + 1e-6
    assert plan.bound >= bound - 1e-6 or plan.stopped != "optimal"


def test_squares_of_four_cells_are_crossed_by_two_edges_each():
    problem = room_problem(grid(8, 6), ["2x2"], "level", dead_ends=math.inf, too_close=0.0)
    # twelve squares; the sink lies on the border between two of them
    assert bound_of(problem) == pytest.approx(24.0, abs=1e-3)


def test_ends_that_patterns_forbid_are_known():
    mesh = grid(4, 4)
    problem = room_problem(mesh, ["2x2"], "level", dead_ends=0.0, too_close=0.0)
    inner = np.flatnonzero(~mesh.boundary_vertices).tolist()
    closed = inner[0]
    own = [e for e in mesh.vertex_edges[closed].tolist() if problem.network.candidate[e]]
    patterns = [
        Pattern((e,), tuple(g for g in own if g != e), math.inf, "dead end") for e in own
    ]  # fmt: skip
    network = dataclasses.replace(problem.network, patterns=patterns)
    able = may_end(structure(network))
    assert not able[closed]
    assert all(able[v] for v in inner[1:])
