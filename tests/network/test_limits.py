"""Exits, budgets, distances and junction spacing agree with trying every set of edges."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import InfeasibleError
from platwright.mip.solvers import solve_mip
from platwright.network.checks.validation import check_design, design_cost
from platwright.network.cp.sat import CpOptions, full_network, run_cp
from platwright.network.evaluate import Evaluator
from platwright.network.mip.model import flow_model
from platwright.network.requirements.budget import LeastLength, LengthBudget
from platwright.network.requirements.exits import ExitCount
from platwright.network.requirements.reach import MaxDistance
from platwright.network.requirements.spacing import junction_spacing
from platwright.network.search.windows import Windows, solve_window
from platwright.network.solve import solve
from platwright.network.structure import structure

INF = math.inf
FEW = settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
LIMITS = ("exits", "budget", "least", "distance", "spacing")


def draw_limit(data, problem, kind):
    """Draw a requirement of a kind with numbers that may matter on a tiny mesh."""
    penalty = data.draw(st.sampled_from([INF, INF, 2.0, 0.75]))
    edges = len(problem.mesh.edges)
    rng = np.random.default_rng(data.draw(st.integers(0, 9999)))
    metres = 20.0 * problem.length * rng.uniform(0.8, 1.25, edges)
    if data.draw(st.booleans()):
        metres = np.full(edges, 20.0)
    if kind == "exits":
        sinks = np.flatnonzero(problem.sinks).tolist()
        some = data.draw(st.lists(st.sampled_from(sinks), max_size=2))
        options = tuple(v for v in sinks if v not in some)
        least = data.draw(st.integers(0, min(2, len(options))))
        return ExitCount(options, least + data.draw(st.integers(0, 2)), least, penalty)
    if kind == "budget":
        most = data.draw(st.sampled_from([0.0, 35.5, 60.0, 80.0, 120.0, 400.0]))
        return LengthBudget(metres, most, data.draw(st.sampled_from([20.0, 7.3])), penalty)
    if kind == "least":
        least = data.draw(st.sampled_from([0.0, 20.0, 47.5, 80.0, 100.0, 160.0]))
        return LeastLength(metres, least, data.draw(st.sampled_from([20.0, 7.3])), penalty)
    if kind == "distance":
        most = data.draw(st.sampled_from([0.0, 1.0, 1.5, 2.0, 3.0, 4.0]))
        return MaxDistance(most, penalty)
    most = data.draw(st.sampled_from([15.0, 20.0, 21.0, 40.001, 60.0, 85.0]))
    return junction_spacing(problem, metres, most, penalty)


def limited(data, problem, kinds):
    """Add requirements to a problem, and now and then lengths that are no whole numbers."""
    if data.draw(st.booleans()):
        rng = np.random.default_rng(data.draw(st.integers(0, 9999)))
        length = rng.uniform(0.6, 1.6, len(problem.length))
        problem = dataclasses.replace(problem, length=length)
    wanted = tuple(draw_limit(data, problem, kind) for kind in kinds)
    return dataclasses.replace(problem, requirements=wanted)


def draw_limited(data, small, kind, most):
    """Draw a problem with requirements of one kind or of several."""
    kinds = (kind,)
    if kind == "combined":
        kinds = tuple(data.draw(st.lists(st.sampled_from(LIMITS), min_size=2, max_size=4)))
    return limited(data, small.draw_problem(data, most=most), kinds)


def mip_optimum(problem) -> float:
    """Return the exact objective of the optimum of the flow model."""
    index = structure(problem)
    if index.conflicts:
        return INF
    model = flow_model(index)
    result = solve_mip(model.linear, time_limit=30)
    if result.status == "infeasible":
        return INF
    assert result.status == "optimal"
    value = Evaluator(problem).objective(model.chosen(result.values))
    assert result.bound <= value + 1e-6
    return value


def cp_optimum(problem) -> float:
    """Return the exact objective of CP-SAT's optimum, and check its bound."""
    index = structure(problem)
    if index.conflicts:
        return INF
    result = run_cp(full_network(index), CpOptions(30))
    if result.status == "infeasible":
        return INF
    assert result.status == "optimal"
    value = Evaluator(problem).objective(result.active)
    assert result.bound <= value + 1e-6
    assert result.bound == pytest.approx(value, abs=1e-4)
    return value


@pytest.mark.parametrize("kind", [*LIMITS, "combined"])
@FEW
@given(data=st.data())
def test_evaluation_is_what_the_checker_says(small, kind, data):
    problem = draw_limited(data, small, kind, most=7)
    evaluator = Evaluator(problem)
    for active in small.subsets(problem):
        found = evaluator.evaluate(active)
        assert found.objective == pytest.approx(design_cost(problem, active))
        listed = [v.kind for v in check_design(problem, active)]
        for requirement in problem.requirements:
            counted = found.counts.get(requirement.kind, 0)
            assert counted == listed.count(requirement.kind)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*LIMITS, "combined"])
@FEW
@given(data=st.data())
def test_flow_model_is_exact(small, kind, data):
    problem = draw_limited(data, small, kind, most=10)
    assert mip_optimum(problem) == pytest.approx(small.brute_force(problem))


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*LIMITS, "combined"])
@FEW
@given(data=st.data())
def test_constraint_model_is_exact(small, kind, data):
    problem = draw_limited(data, small, kind, most=10)
    assert cp_optimum(problem) == pytest.approx(small.brute_force(problem))


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["cpsat", "highs"])
@pytest.mark.parametrize("kind", [*LIMITS, "combined"])
@settings(FEW, max_examples=10)
@given(data=st.data())
def test_solve_returns_the_optimum(small, solver, kind, data):
    problem = draw_limited(data, small, kind, most=9)
    best = small.brute_force(problem)
    if math.isinf(best):
        with pytest.raises(InfeasibleError, match="No street network satisfies all rules"):
            solve(problem, time_limit=30, solver=solver)
        return
    design = solve(problem, time_limit=30, solver=solver)
    assert design.objective == pytest.approx(best)
    assert design.stopped == "optimal"
    assert design.bound == design.objective
    assert not [v for v in check_design(problem, design.active) if v.hard]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*LIMITS, "combined"])
@FEW
@given(data=st.data())
def test_a_window_is_exact_where_no_distance_counts(small, kind, data):
    """The best completion of what is fixed, found by trying all, is what the window returns."""
    problem = draw_limited(data, small, kind, most=9)
    problem = dataclasses.replace(problem, weight_distance=0.0)
    index = structure(problem)
    if index.conflicts or not index.edges:
        return
    evaluator = Evaluator(problem)
    designs = [(evaluator.objective(a), a) for a in small.subsets(problem)]
    valid = [a for value, a in designs if math.isfinite(value)]
    if not valid:
        return
    start = valid[data.draw(st.integers(0, len(valid) - 1))]
    free = sorted(set(data.draw(st.lists(st.sampled_from(index.edges), min_size=1, max_size=6))))
    others = [e for e in range(len(start)) if e not in free]
    best = min(value for value, a in designs if np.array_equal(a[others], start[others]))
    found, _ = solve_window(Windows(index), free, start, CpOptions(30))
    assert found is not None
    assert np.array_equal(found[others], start[others])
    assert evaluator.objective(found) == pytest.approx(best)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*LIMITS, "combined"])
@settings(FEW, max_examples=15)
@given(data=st.data())
def test_bounds_without_connection_never_exceed_the_optimum(small, kind, data):
    problem = draw_limited(data, small, kind, most=9)
    best = small.brute_force(problem)
    index = structure(problem)
    if index.conflicts:
        assert math.isinf(best)
        return
    relaxed = flow_model(index, flow=False).linear
    result = solve_mip(relaxed, time_limit=30)
    assert result.status == "optimal" or math.isinf(best)
    assert result.bound <= best + 1e-6
