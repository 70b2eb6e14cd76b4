"""Ball-exit inequalities cut off no valid design."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.mesh.grids import fan, grid
from platwright.network.cp.model import CpNetwork
from platwright.network.cp.sat import CpOptions, full_network, run_cp
from platwright.network.cuts.balls import ball_cuts
from platwright.network.evaluate import Evaluator
from platwright.network.examples import paper_problem
from platwright.network.structure import structure

INF = float("inf")


def holds(cut, active, uncovered) -> bool:
    """Tell whether an inequality holds for a design, with the best value of its ring."""
    ring = bool(cut.ring) and bool(active[list(cut.ring)].all())
    left = cut.weight * (int(active[list(cut.exits)].sum()) + ring)
    left += int(active[list(cut.inside)].sum()) + cut.rhs * (cut.vertex in uncovered)
    return left >= cut.rhs


@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(data=st.data())
def test_no_valid_design_of_a_tiny_mesh_is_cut_off(small, data):
    problem = small.draw_problem(data, most=8)
    evaluator = Evaluator(problem)
    cuts = ball_cuts(structure(problem))
    for active in small.subsets(problem):
        found = evaluator.evaluate(active)
        if found.valid:
            assert all(holds(cut, active, set(found.uncovered)) for cut in cuts)


def violated_by_a_valid_design(index, cut) -> bool:
    """Let CP-SAT look for a valid design that violates one inequality."""
    network: CpNetwork = full_network(index, cuts=[])
    parts = [(network.literal(e), cut.weight) for e in cut.exits]
    parts += [(network.literal(e), 1) for e in cut.inside]
    slack = network.slack[cut.vertex]
    if slack is not False:
        network.model.add_bool_or([~slack])
    total = network.expression.weighted_sum([a for a, _ in parts], [w for _, w in parts])
    if cut.ring:
        # the ring takes its greatest value by itself: 1 if all of it is chosen
        ring = [network.literal(e) for e in cut.ring]
        closed = network.model.new_bool_var("")
        network.model.add_bool_or([*(~a for a in ring), closed])
        total = total + cut.weight * closed
    network.model.add(total <= cut.rhs - 1)
    network.costs = []
    status = run_cp(network, CpOptions(20, first_only=True)).status
    assert status != "unknown"
    return status != "infeasible"


@pytest.mark.parametrize(
    "mesh",
    [grid(6, 5, keep=lambda i, j: not (i < 2 and j < 2)), fan(3, 3), fan(5, 2), fan(6, 2)],
    ids=["notch", "three", "five", "six"],
)
@pytest.mark.parametrize("scenario", ["boundary", "inner"])
@pytest.mark.parametrize(
    "rules",
    [{}, {"too_close": 1.0}, {"dead_ends": 0.0}, {"cover_penalty": 9.0}],
    ids=["hard", "close pairs", "dead ends", "soft coverage"],
)
def test_no_valid_design_of_a_small_mesh_is_cut_off(mesh, scenario, rules):
    rng = np.random.default_rng(3)
    for coverage in (1, 2, 3):
        index = structure(paper_problem(mesh, scenario, coverage=coverage, **rules))
        cuts = ball_cuts(index)
        for i in rng.permutation(len(cuts))[:4]:
            assert not violated_by_a_valid_design(index, cuts[i])


def test_soft_rules_weaken_the_inequalities():
    mesh = grid(8, 8)
    strong = ball_cuts(structure(paper_problem(mesh)))
    assert {cut.rhs for cut in strong} == {2}
    assert any(cut.ring for cut in strong)
    weak = ball_cuts(structure(paper_problem(mesh, dead_ends=2.0)))
    assert {cut.rhs for cut in weak} == {1}
    assert not any(cut.ring or cut.inside for cut in weak)
    pairs = ball_cuts(structure(paper_problem(mesh, too_close=2.0)))
    assert {(cut.weight, cut.rhs) for cut in pairs if cut.inside} == {(4, 8)}


def test_a_ring_with_a_barred_edge_needs_no_ring_variable():
    problem = paper_problem(grid(8, 8), "inner")
    index = structure(problem)
    cut = next(cut for cut in ball_cuts(index) if cut.ring)
    problem.candidate[cut.ring[0]] = False
    other = {c.vertex: c for c in ball_cuts(structure(problem))}[cut.vertex]
    assert (other.rhs, other.ring, other.inside) == (2, (), ())
