"""All models agree with trying every set of edges."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import InfeasibleError
from platwright.network.cpsat import CpOptions, full_network, run_cp
from platwright.network.evaluate import Evaluator
from platwright.network.model import flow_model
from platwright.network.reference import reference_model
from platwright.network.solve import solve
from platwright.network.solvers import solve_mip
from platwright.network.structure import structure
from platwright.network.validation import check_design, design_cost

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


@FEW
@given(data=st.data())
def test_flow_model_is_exact(small, data):
    problem = small.draw_problem(data)
    assert mip_optimum(problem, flow_model) == pytest.approx(small.brute_force(problem))


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
