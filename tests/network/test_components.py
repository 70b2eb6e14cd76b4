"""Component inequalities cut off no valid design, and the relaxation bounds all of them."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.mesh.grids import fan, grid
from platwright.network.bounds.beside import packing_bound
from platwright.network.bounds.detours import detours
from platwright.network.bounds.relaxation import Relaxation, raise_by_rounds
from platwright.network.cp.model import CpNetwork
from platwright.network.cp.sat import CpOptions, full_network, run_cp
from platwright.network.cuts.components import Region, Regions, cover_cut, region_of
from platwright.network.cuts.connection import Connector
from platwright.network.cuts.separation import Point, Separator
from platwright.network.evaluate import Evaluator
from platwright.network.examples import paper_problem
from platwright.network.structure import structure

INF = math.inf
SLOW = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
MESHES = {
    "notch": lambda: grid(6, 5, keep=lambda i, j: not (i < 2 and j < 2)),
    "hole": lambda: grid(7, 6, keep=lambda i, j: (i, j) not in ((3, 2), (3, 3))),
    "three": lambda: fan(3, 3),
    "five": lambda: fan(5, 2),
    "six": lambda: fan(6, 2),
}


def violated(cut, active, index, uncovered) -> bool:
    """Tell whether a design violates an inequality, with the best values of r and s."""
    touched = {v for e in np.flatnonzero(active).tolist() for v in index.ends[e]}
    left = len(touched & set(cut.vertices)) - cut.share * float(active[list(cut.edges)].sum())
    if cut.ring >= 0:
        left += bool(active[list(Regions(index).rings[cut.ring])].all())
    left += cut.cover in uncovered
    right = 1 if cut.base < 0 else cut.base in touched
    return left < right - 1e-9


def random_point(index, rng) -> Point:
    """Return values that make the separation grow large sets."""
    edge = rng.uniform(0, 1, len(index.ends)) ** 2
    vertex = [max((edge[e] for e in mine), default=0.0) for mine in index.incident]
    return Point(edge.tolist(), vertex, {}, {})


def all_cuts(index, seed):
    """Return the inequalities of the balls and those that some points lead to."""
    separator = Separator(Regions(index))
    rng = np.random.default_rng(seed)
    found = list(separator.first)
    for _ in range(3):
        found += separator.find(random_point(index, rng))
    return found


@pytest.mark.slow
@SLOW
@given(data=st.data())
def test_no_valid_design_of_a_tiny_mesh_is_cut_off(small, data):
    problem = small.draw_problem(data, most=9)
    index = structure(problem)
    if index.conflicts:
        return
    evaluator = Evaluator(problem)
    cuts = all_cuts(index, data.draw(st.integers(0, 999)))
    for active in small.subsets(problem):
        found = evaluator.evaluate(active)
        if found.valid:
            assert not any(violated(cut, active, index, set(found.uncovered)) for cut in cuts)


def bound_holds(small, data, most: int) -> None:
    """Compare all bounds with the optimum of a tiny problem."""
    problem = small.draw_problem(data, most=most)
    if data.draw(st.booleans()):
        rng = np.random.default_rng(data.draw(st.integers(0, 999)))
        problem = dataclasses.replace(problem, length=rng.uniform(0.5, 2.0, len(problem.length)))
    index = structure(problem)
    best = small.brute_force(problem)
    if index.conflicts or not index.edges:
        return
    assert packing_bound(index) <= best + 1e-9
    bounds = [-INF]
    relaxation = Relaxation(index)
    feasible = raise_by_rounds(relaxation, bounds.append, lambda: False)
    assert all(a <= b + 1e-4 for a, b in zip(bounds, bounds[1:]))
    if not feasible:
        assert math.isinf(best)
        return
    assert bounds[-1] <= best + 1e-9
    result = relaxation.solve_whole(lambda: False, bounds.append)
    assert max(bounds) <= best + 1e-9
    assert result.bound <= best + 1e-9
    if result.values is None:
        assert math.isinf(best)


@settings(SLOW, max_examples=40)
@given(data=st.data())
def test_the_relaxation_never_exceeds_the_optimum(small, data):
    bound_holds(small, data, most=7)


@pytest.mark.slow
@settings(SLOW, max_examples=1000)
@given(data=st.data())
def test_the_relaxation_never_exceeds_the_optimum_of_a_thousand_problems(small, data):
    bound_holds(small, data, most=10)


@pytest.mark.slow
@SLOW
@given(data=st.data())
def test_every_valid_design_leaves_the_sets_of_the_connection_inequalities(small, data):
    problem = small.draw_problem(data, most=9)
    index = structure(problem)
    if index.conflicts or not index.edges:
        return
    rng = np.random.default_rng(data.draw(st.integers(0, 999)))
    faint = dataclasses.replace(
        random_point(index, rng), edge=(rng.random(len(index.ends)) ** 4).tolist()
    )
    cuts = Connector(index).find(faint)
    evaluator = Evaluator(problem)
    for active in small.subsets(problem):
        found = evaluator.evaluate(active)
        if found.valid:
            assert all(active[list(c.exits)].any() or c.cover in found.uncovered for c in cuts)


def test_bounds_while_branching_stay_below_the_optimum():
    rules = {"weight_length": 0.0, "dead_ends": 1.5, "zigzags": 0.0, "too_close": 1.0}
    problem = paper_problem(grid(2, 2), "inner", coverage=1, **rules)
    candidate = problem.candidate.copy()
    candidate[[0, 11]] = False
    relaxation = Relaxation(structure(dataclasses.replace(problem, candidate=candidate)))
    # from the optimum of the relaxation HiGHS makes a first solution of cost 2
    assert raise_by_rounds(relaxation, lambda _: None, lambda: False)
    bounds: list[float] = []
    result = relaxation.solve_whole(lambda: False, bounds.append)
    assert result.bound == pytest.approx(1.0, abs=1e-4)
    assert max(bounds) <= 1.0 + 1e-6


def breaks(index, cut) -> bool:
    """Let CP-SAT look for a valid design that violates one inequality."""
    network: CpNetwork = full_network(index, cuts=[], ranks=True)
    model, total = network.model, 0
    slack = network.slack.get(cut.cover, False)
    if slack is not False:
        model.add_bool_or([~slack])
    for u in cut.vertices:
        total = total + network.vertex[u]
    for e in cut.edges:
        total = total - cut.share * network.literal(e)
    if cut.ring >= 0:
        ring = [network.literal(e) for e in Regions(index).rings[cut.ring]]
        closed = model.new_bool_var("")
        model.add_bool_or([*(~a for a in ring), closed])
        total = total + closed
    right = 1 if cut.base < 0 else network.vertex[cut.base]
    if cut.share == 1:
        model.add(total <= right - 1)
    else:
        # multiples of a share: whole numbers of a thousandth, rounded against the inequality
        parts = sum(1000 * network.vertex[u] for u in cut.vertices)
        parts -= sum(math.floor(1000 * cut.share) * network.literal(e) for e in cut.edges)
        model.add(parts <= 999)
    network.costs = []
    # that there is none is hard to prove where shares count: the search has to do then
    effort = 60.0 if cut.share == 1 else 5.0
    status = run_cp(network, CpOptions(600.0, effort=effort, first_only=True)).status
    assert status != "unknown" or cut.share < 1
    return status in ("optimal", "feasible")


@pytest.mark.slow
@pytest.mark.parametrize("mesh", sorted(MESHES))
@pytest.mark.parametrize("scenario", ["boundary", "inner"])
@pytest.mark.parametrize(
    "rules",
    [{}, {"too_close": 1.0}, {"dead_ends": 0.0}, {"cover_penalty": 9.0}],
    ids=["hard", "close pairs", "dead ends", "soft coverage"],
)
def test_no_valid_design_of_a_small_mesh_is_cut_off(mesh, scenario, rules):
    rng = np.random.default_rng(7)
    for coverage in (1, 2, 3):
        problem = paper_problem(MESHES[mesh](), scenario, coverage=coverage, **rules)
        index = structure(problem)
        relaxation = Relaxation(index)
        raise_by_rounds(relaxation, lambda _: None, lambda: False)
        cuts = relaxation.cuts + all_cuts(index, coverage)
        for i in rng.permutation(len(cuts))[:6]:
            assert not breaks(index, cuts[i])


@pytest.mark.slow
@SLOW
@given(data=st.data())
def test_no_valid_design_of_a_random_mesh_with_odd_balls_is_cut_off(small, data):
    mesh = small.draw_mesh(data)
    problem = paper_problem(mesh, data.draw(st.sampled_from(["boundary", "one sink", "inner"])))
    rng = np.random.default_rng(data.draw(st.integers(0, 999)))
    # coverage in metres and density fields give balls of any shape
    cover = {v: odd_ball(mesh, v, rng) for v in problem.cover if rng.random() < 0.7}
    index = structure(dataclasses.replace(problem, cover=cover))
    if index.conflicts:
        return
    cuts = all_cuts(index, int(rng.integers(999)))
    for i in rng.permutation(len(cuts))[:3]:
        assert not breaks(index, cuts[i])


def odd_ball(mesh, v, rng) -> tuple[int, ...]:
    """Return a random connected set of vertices around one."""
    ball = [v]
    for _ in range(int(rng.integers(4, 25))):
        e = rng.choice(mesh.vertex_edges[ball[int(rng.integers(len(ball)))]])
        ball += [u for u in mesh.edges[e].tolist() if u not in ball]
    return tuple(sorted(ball))


def test_a_ball_of_a_grid_gets_its_ring_and_wider_balls_a_share():
    index = structure(paper_problem(grid(12, 12)))
    regions = Regions(index)
    cover = dict(index.cover)
    middle = 6 * 13 + 6
    cut = cover_cut(regions, middle, cover[middle])
    assert (len(cut.vertices), len(cut.edges), cut.ring, cut.share) == (13, 16, middle, 1.0)
    wide = structure(paper_problem(grid(14, 14), coverage=3))
    v, ball = next(item for item in wide.cover if len(item[1]) == 25)
    cut = cover_cut(Regions(wide), v, ball)
    # 12 faces, so at most 6 pieces of at least 8 edges: h = 4 (1 + 1 / 6)
    assert cut.ring == -1
    assert cut.share == pytest.approx(1 - 6 / 28)


def test_a_region_does_not_grow_around_a_second_vertex_or_a_hole():
    regions = Regions(structure(paper_problem(grid(8, 8), "inner")))
    # the 3 x 3 block of vertices around (4, 4) has one full star
    block = [i * 9 + j for i in (3, 4, 5) for j in (3, 4, 5)]
    region = region_of(regions, block)
    assert region is not None
    assert region.centre == 4 * 9 + 4
    assert region.add(3 * 9 + 6)
    assert region.add(4 * 9 + 6)
    assert not region.add(5 * 9 + 6)  # would enclose (4, 5), too
    holed = MESHES["hole"]()
    around = Regions(structure(paper_problem(holed, "inner")))
    corner = np.flatnonzero(holed.boundary_vertices & (holed.valences == 3))
    start = int(corner[0])
    grown = Region(around, (start,), -1)
    frontier = [start]
    while frontier:
        v = frontier.pop()
        frontier += [w for w in around.neighbours[v] if w not in grown.members and grown.add(w)]
    assert region_of(around, grown.members) is not None


def test_a_vertex_beside_a_barred_way_has_a_detour_of_two_steps():
    problem = paper_problem(grid(6, 6), "one sink", weight_distance=1.0)
    index = structure(problem)
    onward, least = detours(index)
    for v, edges in onward.items():
        for e in edges:
            assert index.reach[index.vertex_of(e, v)] == pytest.approx(index.reach[v] - 1)
    assert {d for d in least.values() if math.isfinite(d)} == {2.0}


def test_rounds_raise_the_bound_of_a_paper_mesh_and_stop_when_told():
    index = structure(paper_problem(grid(12, 12), "one sink"))
    relaxation = Relaxation(index)
    first = relaxation.solve(lambda: False)
    bounds: list[float] = []
    assert raise_by_rounds(relaxation, bounds.append, lambda: False)
    # 39 streets are the best known; balls alone prove 33
    assert first.bound > 33
    assert 35 < bounds[-1] <= 39
    assert Relaxation(index).solve(lambda: True).values is None
