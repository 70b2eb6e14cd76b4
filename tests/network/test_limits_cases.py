"""Exits, budgets, distances and junction spacing on shapes with numbers worked out by hand."""

import dataclasses
import math

import numpy as np
import pytest
from platwright.errors import InfeasibleError, InputError
from platwright.mesh.grids import grid
from platwright.network.evaluate import evaluate
from platwright.network.examples import paper_problem
from platwright.network.requirements import spacing
from platwright.network.requirements.budget import LeastLength, LengthBudget
from platwright.network.requirements.exits import ExitCount, uncounted, with_exits
from platwright.network.requirements.reach import MaxDistance
from platwright.network.requirements.spacing import JunctionSpacing, junction_spacing, short_ways
from platwright.network.solve import solve
from platwright.network.structure import sink_distance

ALLOW = {"dead_ends": 0.0, "zigzags": 0.0, "too_close": 0.0, "weight_length": 0.0}


def problem_on(nx, ny, scenario="boundary", **rules):
    """Return a problem on a grid without coverage, in which everything is allowed."""
    return paper_problem(grid(nx, ny), scenario, **{**ALLOW, "cover_penalty": 0.0, **rules})


def streets(problem, *lines):
    """Return the edges of lines through grid points, each point (x, y)."""
    at = {tuple(xy): v for v, xy in enumerate(problem.mesh.vertices.round(6).tolist())}
    active = np.zeros(len(problem.mesh.edges), dtype=bool)
    for line in lines:
        for a, b in zip(line, line[1:]):
            active[problem.mesh.edge_between(at[a], at[b])] = True
    return active


def vertex(problem, x, y):
    """Return the vertex at a grid point."""
    return int(np.argmin(np.abs(problem.mesh.vertices - (x, y)).sum(axis=1)))


def count(problem, requirement, active):
    """Return the violations of one requirement."""
    whole = dataclasses.replace(problem, requirements=(requirement,))
    found = evaluate(whole, active)
    assert found.islands == found.barred == 0
    return found.counts.get(requirement.kind, 0)


CROSS = (
    [(0.0, 2.0), (1.0, 2.0), (2.0, 2.0), (3.0, 2.0), (4.0, 2.0)],
    [(2.0, 0.0), (2.0, 1.0), (2.0, 2.0), (2.0, 3.0), (2.0, 4.0)],
)


def test_exits_are_the_options_with_new_streets():
    problem = problem_on(4, 4)
    active = streets(problem, *CROSS)
    options = tuple(np.flatnonzero(problem.sinks).tolist())
    assert [count(problem, ExitCount(options, n, 0), active) for n in (2, 3, 4, 5)] == [2, 1, 0, 0]
    assert count(problem, ExitCount(options, 9, 6), active) == 2
    # places that are no options do not count
    left = (vertex(problem, 0, 2), vertex(problem, 0, 1))
    assert count(problem, ExitCount(left, 9, 2), active) == 1
    assert count(problem, ExitCount(left, 0, 0), active) == 1
    assert count(problem, ExitCount(left, 9, 1), np.zeros_like(active)) == 1


def test_an_unused_option_on_a_wall_is_no_way_out():
    problem = problem_on(4, 4, "inner")
    rim = problem.mesh.boundary_vertices[problem.mesh.edges].all(axis=1)
    problem = dataclasses.replace(problem, candidate=~rim)
    options = np.flatnonzero(problem.mesh.boundary_vertices).tolist()
    whole = with_exits(problem, options, 1)
    assert np.array_equal(np.flatnonzero(whole.sinks), options)
    line = [(0.0, 2.0), (1.0, 2.0), (2.0, 2.0), (3.0, 2.0)]
    found = evaluate(whole, streets(whole, line))
    assert found.valid
    # (4, 2) is a sink beside (3, 2), but no street goes there
    assert found.distance[vertex(whole, 3, 2)] == 3.0


def test_places_where_streets_could_leave_uncounted_are_listed():
    problem = problem_on(4, 4)
    left = [vertex(problem, 0, y) for y in (1, 2, 3)]
    others = [vertex(problem, x, y) for x in (1, 2, 3) for y in (0, 4)]
    others += [vertex(problem, 4, y) for y in (1, 2, 3)]
    assert uncounted(problem, left) == sorted(others)
    assert uncounted(problem, left + others) == []


def test_a_budget_counts_started_units():
    problem = problem_on(4, 4)
    metres = np.full(len(problem.mesh.edges), 20.0)
    active = streets(problem, *CROSS)  # 8 edges, 160 m
    for most, unit, violations in (
        (160.0, 20.0, 0),
        (159.999, 20.0, 1),
        (140.0, 20.0, 1),
        (139.999, 20.0, 2),
        (100.0, 7.0, 9),
        (0.0, 1000.0, 1),
    ):
        assert count(problem, LengthBudget(metres, most, unit), active) == violations


def test_started_units_below_the_least_length_are_violations():
    problem = problem_on(4, 4)
    metres = np.full(len(problem.mesh.edges), 20.0)
    active = streets(problem, *CROSS)  # 8 edges, 160 m
    for least, unit, violations in (
        (160.0, 20.0, 0),
        (160.001, 20.0, 1),
        (180.0, 20.0, 1),
        (180.001, 20.0, 2),
        (0.0, 1000.0, 0),
    ):
        assert count(problem, LeastLength(metres, least, unit), active) == violations
    # 0.1 is no binary fraction
    tenths = LeastLength(np.full(len(problem.mesh.edges), 0.1), 0.8, 1.0)
    assert count(problem, tenths, active) == 0


def test_lengths_that_are_no_whole_numbers_add_up_to_the_budget():
    problem = problem_on(4, 4)
    # 0.1 is no binary fraction: eight times 0.1 is not 0.8 in floating point
    budget = LengthBudget(np.full(len(problem.mesh.edges), 0.1), 0.8, 1.0)
    assert count(problem, budget, streets(problem, *CROSS)) == 0


def test_far_vertices_are_those_beyond_the_limit():
    problem = problem_on(6, 2, "inner", dead_ends=0.0)
    sinks = np.arange(len(problem.sinks)) == vertex(problem, 0, 1)
    problem = dataclasses.replace(problem, sinks=sinks)
    active = streets(problem, [(float(x), 1.0) for x in range(7)])
    for most, violations in ((6.0, 0), (5.9, 1), (5.0, 1), (2.5, 4), (0.0, 6)):
        assert count(problem, MaxDistance(most), active) == violations
    hops = dataclasses.replace(problem, length=np.full(len(active), 0.1))
    assert count(hops, MaxDistance(0.6), active) == 0
    assert count(hops, MaxDistance(0.3), active) == 3


def test_edges_beyond_the_reach_are_known():
    problem = problem_on(6, 2, "inner", dead_ends=0.0)
    sinks = np.arange(len(problem.sinks)) == vertex(problem, 0, 1)
    problem = dataclasses.replace(problem, sinks=sinks)
    reach = sink_distance(problem, problem.candidate)
    barred = MaxDistance(3.0).too_far(problem)
    assert np.array_equal(barred, (reach[problem.mesh.edges] > 3).any(axis=1))
    assert 0 < barred.sum() < len(barred)
    assert not MaxDistance(3.0, penalty=1.0).too_far(problem).any()


def test_junctions_too_near_are_pairs():
    problem = problem_on(6, 4, "inner", dead_ends=0.0)
    metres = np.full(len(problem.mesh.edges), 20.0)
    spine = [(float(x), 2.0) for x in range(7)]
    ribs = [[(float(x), 2.0), (float(x), 3.0)] for x in (1, 2, 4)]
    active = streets(problem, spine, *ribs)
    for least, violations in ((20.0, 0), (20.001, 1), (40.0, 1), (40.1, 2), (60.1, 3), (100.0, 3)):
        assert count(problem, junction_spacing(problem, metres, least), active) == violations


def test_two_ways_between_junctions_are_one_violation():
    problem = problem_on(3, 3, "inner", dead_ends=0.0)
    metres = np.full(len(problem.mesh.edges), 20.0)
    # a square with a tail at two opposite corners: two ways of 40 m from one to the other
    square = [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0), (1.0, 1.0)]
    active = streets(problem, square, [(0.0, 1.0), (1.0, 1.0)], [(2.0, 2.0), (3.0, 2.0)])
    assert count(problem, junction_spacing(problem, metres, 40.0), active) == 0
    assert count(problem, junction_spacing(problem, metres, 40.5), active) == 1


def test_existing_streets_make_junctions_and_are_exempt():
    problem = problem_on(6, 4)
    metres = np.full(len(problem.mesh.edges), 20.0)
    wanted = junction_spacing(problem, metres, 30.0)
    lines = [[(float(x), float(y)) for y in range(5)] for x in (2, 3)]
    # at both ends of the two streets, along the existing boundary
    assert count(problem, wanted, streets(problem, *lines)) == 2
    old = dataclasses.replace(
        problem,
        existing=problem.existing | streets(problem, *lines),
        candidate=problem.candidate & ~streets(problem, *lines),
    )
    assert count(old, wanted, np.zeros_like(old.existing)) == 0
    # a new street between two old ones makes two junctions, 20 m from each other
    assert count(old, wanted, streets(old, [(2.0, 2.0), (3.0, 2.0)])) == 1


def test_short_ways_of_a_square():
    ends = np.array([[0, 1], [1, 2], [2, 3], [0, 3]])
    found = short_ways(ends, np.ones(4), 3.0)
    assert sorted(found) == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    assert sorted(found[0, 2]) == [(0, 1), (3, 2)]
    assert found[0, 1] == [(0,)]
    assert (0, 1, 2) in short_ways(ends, np.ones(4), 3.001)[0, 3]


def test_too_large_a_spacing_says_so(monkeypatch):
    mesh = grid(6, 6)
    monkeypatch.setattr(spacing, "MOST_WAYS", 500)
    assert JunctionSpacing(mesh.edges, np.full(len(mesh.edges), 20.0), 41.0).spacing == 41.0
    with pytest.raises(InputError, match=r"spacing of 100 m is too much for a mesh of 84 edges"):
        JunctionSpacing(mesh.edges, np.full(len(mesh.edges), 20.0), 100.0)


METRES = np.full(12, 20.0)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: ExitCount((1, 2), 1, 2), "At least 2 and at most 1"),
        (lambda: ExitCount((1, 2), 5, 3), "only 2 places"),
        (lambda: ExitCount((1, 2), 2, -1), "At least -1"),
        (lambda: ExitCount((1, 2), 2, penalty=0.0), "costs 0"),
        (lambda: LengthBudget(METRES, -1.0, 20.0), "length budget is -1"),
        (lambda: LengthBudget(METRES, math.inf, 20.0), "length budget is inf"),
        (lambda: LengthBudget(METRES, 100.0, 0.0), "unit of the length budget is 0"),
        (lambda: LengthBudget(-METRES, 100.0, 20.0), "negative"),
        (lambda: LengthBudget(METRES * np.nan, 100.0, 20.0), "no length"),
        (lambda: LeastLength(METRES, -1.0, 20.0), "least length is -1"),
        (lambda: LeastLength(METRES, 100.0, 0.0), "unit of the least length is 0"),
        (lambda: LeastLength(-METRES, 100.0, 20.0), "negative"),
        (lambda: MaxDistance(-2.0), "-2"),
        (lambda: MaxDistance(math.nan), "nan"),
        (lambda: MaxDistance(3.0, penalty=-1.0), "costs -1"),
        (lambda: JunctionSpacing(np.array([[0, 1]]), METRES[:1], 0.0), "junction spacing is 0"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(make, text):
    with pytest.raises(InputError, match=text):
        make()


def test_contradicting_limits_are_named():
    problem = paper_problem(grid(6, 6), "boundary", coverage=1)
    options = tuple(np.flatnonzero(problem.sinks).tolist())
    metres = np.full(len(problem.mesh.edges), 20.0)
    both = (ExitCount(options, 4, 4), LengthBudget(metres, 20.0, 20.0))
    with pytest.raises(InfeasibleError, match="length budget"):
        solve(dataclasses.replace(problem, requirements=both), time_limit=20)
