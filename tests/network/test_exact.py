"""All models agree with trying every set of edges."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import InfeasibleError
from platwright.mesh.grids import grid
from platwright.mip.solvers import solve_mip
from platwright.network.checks.validation import check_design, design_cost
from platwright.network.cp import connect
from platwright.network.cp.sat import CpOptions, full_network, run_cp
from platwright.network.evaluate import Evaluator
from platwright.network.examples import paper_problem
from platwright.network.incumbent import TOLERANCE, Incumbent
from platwright.network.mip.model import flow_model
from platwright.network.mip.reference import reference_model
from platwright.network.search.cp_strategy import whole_problem
from platwright.network.solve import solve
from platwright.network.structure import structure
from platwright.progress import Deadline

FEW = settings(
    max_examples=30,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


def mip_optimum(problem, build) -> float:
    """Return the exact objective of the optimum of a mixed-integer model."""
    index = structure(problem)
    if index.conflicts:
        return math.inf
    model = build(index)
    result = solve_mip(model.linear, time_limit=30)
    if result.status == "infeasible":
        return math.inf
    assert result.status == "optimal"
    return Evaluator(problem).objective(model.chosen(result.values))


def cp_optimum(problem) -> float:
    """Return the exact objective of CP-SAT's optimum, and check its bound."""
    index = structure(problem)
    if index.conflicts:
        return math.inf
    result = run_cp(full_network(index), CpOptions(30))
    if result.status == "infeasible":
        return math.inf
    assert result.status == "optimal"
    value = Evaluator(problem).objective(result.active)
    assert result.bound == pytest.approx(value, abs=1e-6)
    return value


@FEW
@given(data=st.data())
def test_evaluation_is_what_the_checker_says(small, data):
    problem = small.draw_problem(data, most=7)
    evaluator = Evaluator(problem)
    for active in small.subsets(problem):
        assert evaluator.objective(active) == pytest.approx(design_cost(problem, active))


@pytest.mark.slow
@FEW
@given(data=st.data())
def test_flow_model_is_exact(small, data):
    problem = small.draw_problem(data)
    assert mip_optimum(problem, flow_model) == pytest.approx(small.brute_force(problem))


@pytest.mark.slow
@FEW
@given(data=st.data())
def test_constraint_model_is_exact(small, data):
    problem = small.draw_problem(data)
    assert cp_optimum(problem) == pytest.approx(small.brute_force(problem))


@settings(FEW, max_examples=20)
@given(data=st.data())
def test_reference_model_is_exact_without_distances(small, data):
    problem = small.draw_problem(data)
    if problem.weight_distance > 0:
        # the paper sums distances over half-edges: another objective, the same designs
        value = mip_optimum(problem, reference_model)
        assert math.isinf(value) == math.isinf(small.brute_force(problem))
        assert value >= small.brute_force(problem) - 1e-6 or math.isinf(value)
    else:
        assert mip_optimum(problem, reference_model) == pytest.approx(small.brute_force(problem))


@pytest.mark.parametrize("solver", ["cpsat", "highs"])
@settings(FEW, max_examples=18)
@given(data=st.data())
def test_solve_returns_the_optimum(small, solver, data):
    problem = small.draw_problem(data)
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


@pytest.mark.parametrize(
    "seed",
    [*range(0, 50, 5), *(pytest.param(s, marks=pytest.mark.slow) for s in range(50, 150, 5))],
)
def test_streets_farther_than_any_new_vertex_stay_usable(small, seed):
    # the best design bounds the distances of its own vertices, not of existing streets
    for s in range(seed, seed + 5):
        rng = np.random.default_rng(s)
        problem = far_sink_problem(small, rng)
        best = small.brute_force(problem)
        if math.isinf(best):
            continue
        design = solve(problem, time_limit=10)
        assert design.objective == pytest.approx(best)
        assert design.stopped == "optimal"


def far_sink_problem(small, rng):
    """Make a boundary street with one sink, lengths that are no whole numbers, cheap streets."""
    rules = {"weight_length": 0.1, "weight_distance": 0.5, "dead_ends": 0.0}
    rules |= {"too_close": 0.0, "zigzags": 0.0}
    problem = small.far_sink(grid(3, 2), rng, **rules)
    length = rng.uniform(0.5, 3.0, len(problem.length))
    return dataclasses.replace(problem, length=length)


def small_weight(weight, weight_length):
    """Make a problem with a small weight of distances and lengths that are no whole numbers."""
    mesh = grid(3, 3)
    rng = np.random.default_rng(3)
    return dataclasses.replace(
        paper_problem(mesh, "inner", weight_distance=weight, weight_length=weight_length),
        sinks=np.arange(16) == 0,
        length=rng.uniform(0.7, 1.4, len(mesh.edges)),
    )


@pytest.mark.parametrize(
    "weight", [0.012345, 0.001, 1e-5, pytest.param(1e-8, marks=pytest.mark.slow)]
)
def test_small_weights_of_distance_do_not_vanish(weight):
    # without other costs any weight leaves the same design
    plain = solve(small_weight(1.0, 0.0), time_limit=30)
    scaled = solve(small_weight(weight, 0.0), time_limit=30)
    assert plain.stopped == scaled.stopped == "optimal"
    assert scaled.objective == pytest.approx(weight * plain.objective, rel=1e-5)


@pytest.mark.parametrize("weight", [1.0, 0.3123456, 0.012345, 1e-3, 1e-5])
def test_rounded_costs_lose_less_than_the_tolerance(weight):
    problem = small_weight(weight, 0.1)
    index = structure(problem)
    result = run_cp(full_network(index), CpOptions(60))
    assert result.status == "optimal"
    value = Evaluator(problem).objective(result.active)
    assert result.bound <= value
    assert result.bound == pytest.approx(value, rel=TOLERANCE)
    exact = mip_optimum(problem, flow_model)
    assert result.bound <= exact * (1 + 1e-9)
    assert value == pytest.approx(exact, rel=TOLERANCE)


def test_a_bound_that_lost_too_much_proves_nothing(monkeypatch):
    # as coarse as this, rounding hides differences: the run must not call it an optimum
    monkeypatch.setattr(connect, "FINEST_LENGTH", 2)
    problem = small_weight(1.0, 0.0)
    run = Incumbent(Evaluator(problem), Deadline(30.0))
    assert whole_problem(run, structure(problem), 1, None) == "optimal"
    assert run.bound < run.value * 0.99
    assert not run.closed()
