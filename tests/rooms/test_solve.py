"""Plans: the equations of CND 5.2 and CND-x 5.3, judged by code that knows no solver."""

from __future__ import annotations

import itertools
import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InfeasibleError
from platwright.mesh.grids import fan, grid
from platwright.network.evaluate import evaluate
from platwright.progress import Silent
from platwright.rooms.program.index import RoomIndex, covered_problem
from platwright.rooms.shapes import enumerate_placements
from platwright.rooms.solve import solve_rooms
from platwright.rooms.types import CountRule, RoomPlan, RoomProblem
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .support import room_problem


def judge(problem: RoomProblem, plan: RoomPlan) -> None:
    """Check the equations one by one, from the faces and edges alone."""
    mesh, placements = problem.network.mesh, problem.placements
    covered = [f for r in plan.rooms for f in placements.faces[r]]
    assert sorted(covered) == np.flatnonzero(problem.floor).tolist()  # eq. 15
    room_of = {f: r for r in plan.rooms for f in placements.faces[r]}
    touched, inside = set(), set()
    for e in np.flatnonzero(plan.active).tolist():
        sides = [room_of.get(f) for f in mesh.edge_faces[e].tolist() if f >= 0]
        if len(sides) == 2 and sides[0] == sides[1]:
            inside.add(sides[0])
        else:
            touched.update(sides)
    if problem.kind == "floor":
        assert not inside  # eq. 16
        assert touched >= set(plan.rooms)  # eq. 17
    else:
        assert inside == set(plan.rooms)  # eq. 19
        assert not touched  # eq. 20
        assert all(parts(problem, plan, r) == 1 for r in plan.rooms)
    ends = mesh.edges[plan.active]
    size = len(mesh.vertices)
    pairs = coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(size, size))
    _, label = connected_components(pairs, directed=False)
    roots = {int(label[v]) for v in np.flatnonzero(problem.network.sinks)}
    assert {int(label[v]) for v in ends.ravel()} <= roots
    degree = np.bincount(ends.ravel(), minlength=size)
    if math.isinf(problem.network.dead_ends):
        assert not np.any((degree == 1) & ~problem.network.sinks)
    if math.isinf(problem.network.branches):
        assert not np.any((degree > 2) & ~problem.network.sinks)
    for rule in problem.counts:
        assert rule.least <= sum(rule.weight[r] for r in plan.rooms) <= rule.most
    found = evaluate(problem.network, plan.active)
    assert plan.objective == pytest.approx(found.objective)
    assert plan.bound <= plan.objective + 1e-9


def parts(problem: RoomProblem, plan: RoomPlan, room: int) -> int:
    """Count the connected parts of the route in a block."""
    graph = nx.Graph()
    inner = [e for e in problem.placements.inner[room] if plan.active[e]]
    graph.add_edges_from(problem.network.mesh.edges[inner].tolist())
    return nx.number_connected_components(graph)


def brute_force(problem: RoomProblem) -> float:
    """Return the least objective of all plans of a tiny problem, by trying everything."""
    best = math.inf
    edges = np.flatnonzero(problem.network.candidate).tolist()
    placements = problem.placements
    tilings = list(_tilings(problem, frozenset(), ()))
    for chosen in itertools.product((False, True), repeat=len(edges)):
        active = np.zeros(len(problem.network.mesh.edges), dtype=bool)
        active[edges] = chosen
        on = set(np.flatnonzero(active).tolist())
        value = evaluate(problem.network, active).objective
        if value >= best:
            continue
        for rooms in tilings:
            inner = [on & set(placements.inner[r]) for r in rooms]
            rim = [on & set(placements.rim[r]) for r in rooms]
            good, bad = (rim, inner) if problem.kind == "floor" else (inner, rim)
            if all(good) and not any(bad) and _whole(problem, active, rooms):
                best = value
                break
    return best


def _whole(problem, active, rooms):
    plan = RoomPlan(rooms, active, 0.0, 0.0, 0.0, "", np.zeros(0))
    return problem.kind == "floor" or all(parts(problem, plan, r) == 1 for r in rooms)


def _tilings(problem, covered, rooms):
    free = [f for f in range(len(problem.floor)) if problem.floor[f] and f not in covered]
    if not free:
        yield rooms
        return
    for r, faces in enumerate(problem.placements.faces):
        if free[0] in faces and not covered & set(faces):
            yield from _tilings(problem, covered | set(faces), (*rooms, r))


@pytest.mark.parametrize("solver", ["cpsat", "highs"])
@pytest.mark.parametrize(
    ("kind", "shape", "names", "rules"),
    [
        ("floor", (4, 2), ["2x2", "1x2", "L"], {"dead_ends": 0.0, "too_close": 0.0}),
        ("floor", (2, 4), ["1x2"], {"dead_ends": 0.0, "too_close": 0.0, "weight_distance": 1.0}),
        ("level", (4, 2), ["2x2", "1x2"], {"dead_ends": 0.0, "too_close": 0.0}),
        ("level", (4, 2), ["2x2", "1x2"], {"dead_ends": 0.0, "weight_distance": 1.0}),
    ],
)
def test_optimum_of_tiny_problems_is_that_of_trying_everything(solver, kind, shape, names, rules):
    mesh = grid(*shape)
    sinks = [int(np.flatnonzero(~mesh.boundary_vertices)[0])]
    problem = room_problem(mesh, names, kind, sinks=sinks, **rules)
    expected = brute_force(problem)
    assert math.isfinite(expected)
    plan = solve_rooms(problem, time_limit=30, solver=solver)
    judge(problem, plan)
    assert plan.objective == pytest.approx(expected)
    assert plan.stopped == "optimal"


@settings(max_examples=12)
@given(
    nx=st.integers(4, 9),
    ny=st.integers(4, 8),
    cut=st.integers(0, 3),
    kind=st.sampled_from(["floor", "level"]),
    seed=st.integers(0, 5),
    ends=st.sampled_from([math.inf, 0.0]),
)
def test_plans_keep_every_equation(nx, ny, cut, kind, seed, ends):
    mesh = grid(nx, ny, keep=lambda i, j: not (i < cut and j < cut))
    names = ["2x2", "3x2", "L", "1x2", "T"]
    problem = room_problem(mesh, names, kind, dead_ends=ends, too_close=0.0)
    try:
        plan = solve_rooms(problem, time_limit=4, iterations=6, seed=seed)
    except InfeasibleError:
        return
    judge(problem, plan)


def test_same_seed_gives_same_plan():
    problem = room_problem(grid(9, 8), ["2x2", "3x2", "L"])
    plans = [solve_rooms(problem, time_limit=60, iterations=15, seed=4) for _ in range(2)]
    assert plans[0].rooms == plans[1].rooms
    assert np.array_equal(plans[0].active, plans[1].active)


def test_counts_and_areas_hold():
    mesh = grid(8, 6)
    plain = room_problem(mesh, ["2x2", "3x2", "L"])
    is_l = (plain.placements.template == 2).astype(float)
    area = np.array([len(f) for f in plain.placements.faces], dtype=float)
    counts = (
        CountRule("exactly 4 of 'L'", is_l, 4.0, 4.0),
        CountRule("at most half of the area in '3x2'", area * (area == 6), 0.0, 24.0),
    )
    problem = room_problem(mesh, ["2x2", "3x2", "L"], counts=counts)
    plan = solve_rooms(problem, time_limit=10, iterations=10)
    judge(problem, plan)


def test_a_start_is_kept_unless_something_better_is_found():
    problem = room_problem(grid(8, 6), ["2x2", "3x2", "L"])
    first = solve_rooms(problem, time_limit=20, iterations=0)
    again = solve_rooms(problem, time_limit=20, iterations=0, start=(first.active, first.rooms))
    assert again.objective <= first.objective


@pytest.mark.parametrize("solver", ["cpsat", "highs"])
def test_no_route_crosses_a_block_twice(solver):
    # without that rule the shortest ring through this level crosses a block in two parts
    mesh = grid(8, 6)
    inner = np.flatnonzero((mesh.vertices == (4.0, 3.0)).all(axis=1)).tolist()
    rules = {"branches": math.inf, "too_close": 0.0, "zigzags": 0.0}
    problem = room_problem(mesh, ["4x2", "3x3", "3x2"], "level", sinks=inner, **rules)
    judge(problem, solve_rooms(problem, time_limit=15, solver=solver))


def test_linear_route_is_one_path_and_circular_route_is_one_ring():
    mesh = grid(8, 8)
    size = mesh.vertices
    rules = {"branches": math.inf, "too_close": 0.0, "zigzags": 0.0}
    inner = np.flatnonzero(~mesh.boundary_vertices).tolist()
    ends = np.flatnonzero(mesh.boundary_vertices & (mesh.valences == 3)).tolist()
    for sinks, odd in (([inner[len(inner) // 2]], 0), ([ends[0], ends[-1]], 2)):
        problem = room_problem(mesh, ["2x2", "3x2", "L", "T"], "level", sinks=sinks, **rules)
        plan = solve_rooms(problem, time_limit=30, iterations=20)
        judge(problem, plan)
        degree = np.bincount(mesh.edges[plan.active].ravel(), minlength=len(size))
        assert int((degree == 1).sum()) == odd
        assert set(degree.tolist()) <= {0, 1, 2}


def test_whatever_solves_rooms_solves_the_coverage_that_bounds_them():
    problem = room_problem(grid(9, 7), ["2x2", "3x2", "L"])
    plan = solve_rooms(problem, time_limit=20, iterations=10)
    loose = evaluate(covered_problem(RoomIndex(problem)), plan.active)
    assert loose.objective == pytest.approx(plan.objective)


def test_meshes_with_irregular_vertices_have_plans():
    mesh = fan(5, 4)
    templates = room_problem(grid(4, 4), ["2x2", "1x2", "L"]).templates
    where = enumerate_placements(mesh, templates, np.ones(len(mesh.faces), bool))
    sinks = [int(np.flatnonzero(mesh.boundary_vertices)[0])]
    problem = room_problem(
        mesh, ["2x2", "1x2", "L"], placements=where, sinks=sinks, outer=True, too_close=0.0
    )
    judge(problem, solve_rooms(problem, time_limit=20, iterations=10))


class Stopped(Silent):
    """Cancels as soon as there is a plan."""

    def __init__(self) -> None:
        self.seen = False

    def search(self, state) -> None:
        self.seen |= state.incumbent is not None

    def cancelled(self) -> bool:
        return self.seen


def test_a_cancelled_run_keeps_the_best_plan():
    problem = room_problem(grid(12, 12), ["2x2", "3x2", "L"])
    plan = solve_rooms(problem, time_limit=60, progress=Stopped())
    judge(problem, plan)
    assert plan.stopped == "cancelled"
    assert plan.seconds < 30


def test_a_run_cancelled_at_once_says_so():
    stopped = Stopped()
    stopped.seen = True
    with pytest.raises(CancelledError, match="before a first plan"):
        solve_rooms(room_problem(grid(12, 12), ["2x2", "L"]), time_limit=60, progress=stopped)
