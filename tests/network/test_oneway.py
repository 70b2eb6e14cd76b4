"""Two ways out of everything, against networks with an edge taken out and every set of edges."""

import dataclasses
import itertools
import math
import time

import networkx as nx
import numpy as np
import pytest
from clock import allowed
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.mip.solvers import solve_mip
from platwright.network.checks.oneway import check_directions
from platwright.network.checks.validation import check_design, design_cost
from platwright.network.cp.sat import CpOptions, full_network, run_cp
from platwright.network.evaluate import Evaluator
from platwright.network.examples import PAPER_MESHES, paper_problem
from platwright.network.mip.model import flow_model
from platwright.network.oneway.bridges import bridges, design_bridges
from platwright.network.oneway.orientation import orient
from platwright.network.requirements.twoways import TwoWays
from platwright.network.requirements.twowayscp import _shorten
from platwright.network.rules import straight_continuations
from platwright.network.search.windows import Windows, solve_window
from platwright.network.solve import solve
from platwright.network.structure import sink_distance, structure
from platwright.progress import Silent

INF = math.inf
FEW = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


def draw_two_ways(small, data, most=8, penalties=(INF, INF, 1.5, 0.25)):
    """Draw a small problem that asks for two ways."""
    problem = small.draw_problem(data, most=most)
    rule = TwoWays(data.draw(st.sampled_from(penalties)))
    return dataclasses.replace(problem, requirements=(rule,))


def cut_by(problem, active):
    """List chosen edges whose removal separates their ends, by removing each in turn."""
    streets = nx.MultiGraph()
    sinks = np.flatnonzero(problem.sinks).tolist()
    streets.add_nodes_from(range(len(problem.mesh.vertices)))
    nx.add_path(streets, sinks)
    for e in np.flatnonzero(active | problem.existing).tolist():
        streets.add_edge(*problem.mesh.edges[e].tolist(), key=("street", e))
    found = []
    for e in np.flatnonzero(active).tolist():
        u, v = problem.mesh.edges[e].tolist()
        streets.remove_edge(u, v, ("street", e))
        if not nx.has_path(streets, u, v):
            found.append(e)
        streets.add_edge(u, v, ("street", e))
    return found


@FEW
@given(data=st.data())
def test_bridges_of_random_multigraphs(data):
    count = data.draw(st.integers(1, 9))
    node = st.integers(0, count - 1)
    pairs = data.draw(st.lists(st.tuples(node, node), max_size=16))
    found, part = bridges(count, np.array(pairs, dtype=np.int64).reshape(-1, 2))
    graph = nx.MultiGraph()
    graph.add_nodes_from(range(count))
    graph.add_edges_from((a, b, i) for i, (a, b) in enumerate(pairs))
    for i, (a, b) in enumerate(pairs):
        rest = graph.copy()
        rest.remove_edge(a, b, i)
        assert found[i] == (not nx.has_path(rest, a, b))
    kept = graph.copy()
    kept.remove_edges_from((*pairs[i], i) for i in np.flatnonzero(found))
    for piece in nx.connected_components(kept):
        assert len({part[v] for v in piece}) == 1
    assert len(set(part)) == nx.number_connected_components(kept)


@FEW
@given(data=st.data())
def test_evaluation_counts_edges_that_alone_hold_a_part(small, data):
    problem = draw_two_ways(small, data, most=7)
    evaluator = Evaluator(problem)
    for active in small.subsets(problem):
        cut = cut_by(problem, active)
        found = evaluator.evaluate(active)
        assert found.counts.get("two ways", 0) == len(cut)
        listed = [v for v in check_design(problem, active) if v.kind == "two ways"]
        assert [v.edges for v in listed] == [(e,) for e in cut]
        assert found.objective == pytest.approx(design_cost(problem, active))


@FEW
@given(data=st.data())
def test_constraint_model_is_exact(small, data):
    problem = draw_two_ways(small, data)
    best = small.brute_force(problem)
    index = structure(problem)
    if index.conflicts:
        assert math.isinf(best)
        return
    result = run_cp(full_network(index), CpOptions(30))
    if math.isinf(best):
        assert result.status == "infeasible"
        return
    assert result.status == "optimal"
    assert Evaluator(problem).objective(result.active) == pytest.approx(best)
    assert result.bound == pytest.approx(best, abs=1e-6)


@FEW
@given(data=st.data())
def test_flow_model_is_exact(small, data):
    problem = draw_two_ways(small, data)
    best = small.brute_force(problem)
    index = structure(problem)
    if index.conflicts:
        assert math.isinf(best)
        return
    model = flow_model(index)
    result = solve_mip(model.linear, time_limit=30)
    if math.isinf(best):
        assert result.status == "infeasible"
        return
    assert result.status == "optimal"
    value = Evaluator(problem).objective(model.chosen(result.values))
    assert value == pytest.approx(best)


@FEW
@given(data=st.data())
def test_the_relaxation_is_one(small, data):
    problem = draw_two_ways(small, data)
    best = small.brute_force(problem)
    index = structure(problem)
    if math.isinf(best) or index.conflicts:
        return
    model = flow_model(index, exact=False)
    result = solve_mip(model.linear, time_limit=30)
    assert result.status == "optimal"
    assert result.bound <= best + 1e-6


@pytest.mark.slow
@FEW
@given(data=st.data())
def test_windows_are_exact(small, data):
    # without distances, which windows only estimate
    problem = dataclasses.replace(draw_two_ways(small, data), weight_distance=0.0)
    evaluator = Evaluator(problem)
    valid = [a for a in small.subsets(problem) if math.isfinite(evaluator.objective(a))]
    if not valid:
        return
    active = valid[data.draw(st.integers(0, len(valid) - 1))]
    index = structure(problem)
    drawn = data.draw(st.sets(st.sampled_from(index.edges))) if index.edges else set()
    free = sorted(drawn)
    if not free:
        return
    found, _ = solve_window(Windows(index), free, active, CpOptions(30))
    fixed = [e for e in range(len(active)) if e not in drawn]
    best = min(evaluator.objective(a) for a in valid if (a[fixed] == active[fixed]).all())
    assert found is not None
    assert (found[fixed] == active[fixed]).all()
    assert evaluator.objective(found) == pytest.approx(best)


@FEW
@given(data=st.data())
def test_forests_are_shortened_to_the_nodes_that_matter(data):
    count = data.draw(st.integers(2, 12))
    tree = [(data.draw(st.integers(0, v - 1)), v) for v in range(1, count)]
    kept = data.draw(st.sets(st.integers(0, count - 1)))
    short, lost = _shorten(tree, kept)
    assert lost + sum(size for _, _, size in short) == len(tree)
    graph, less = nx.Graph(tree), nx.Graph()
    for a, b, size in short:
        less.add_edge(a, b, weight=size)
    for a in kept:
        for b in kept - {a}:
            far = nx.shortest_path_length(graph, a, b)
            assert nx.shortest_path_length(less, a, b, weight="weight") == far
    assert all(less.degree(v) > 2 for v in set(less) - kept)


def test_lollipops_and_stems_are_counted_by_edge():
    mesh = grid(4, 2)
    problem = paper_problem(mesh, "inner", weight_length=1.0)
    sinks = np.zeros(len(mesh.vertices), dtype=bool)
    sinks[0] = True
    problem = dataclasses.replace(problem, sinks=sinks)
    number = {tuple(pair): i for i, pair in enumerate(mesh.edges.tolist())}
    ring = [(2, 3), (3, 8), (7, 8), (2, 7)]
    stem = [(0, 1), (1, 2)]
    active = np.zeros(len(mesh.edges), dtype=bool)
    active[[number[p] for p in ring + stem]] = True
    found = design_bridges(problem, active)
    assert sorted(np.flatnonzero(found)) == sorted(number[p] for p in stem)
    # an existing stem is a two-way street: what hangs on it has two ways
    existing = np.zeros_like(active)
    existing[[number[p] for p in stem]] = True
    active &= ~existing
    old = dataclasses.replace(problem, existing=existing, candidate=~existing)
    assert not design_bridges(old, active).any()


def test_bridges_of_a_large_design_take_a_millisecond_or_two():
    problem = paper_problem(PAPER_MESHES[1200](), "boundary")
    active = problem.candidate & (np.random.default_rng(1).random(len(problem.candidate)) < 0.5)
    design_bridges(problem, active)
    times = []
    for _ in range(30):
        start = time.perf_counter()
        design_bridges(problem, active)
        times.append(time.perf_counter() - start)
    # ten times what it takes on a machine at rest
    assert min(times) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["boundary", "one sink", "inner"])
def test_designs_with_two_ways_are_found_at_the_size_of_the_paper(scenario):
    mesh = grid(12, 12)
    problem = paper_problem(mesh, scenario)
    if scenario == "one sink":
        # a single wall opening has a single street: two more make it possible
        problem = paper_problem(mesh, "inner")
    problem = dataclasses.replace(problem, requirements=(TwoWays(),))
    design = solve(problem, time_limit=4.0)
    assert cut_by(problem, design.active) == []
    assert not [v for v in check_design(problem, design.active) if v.hard]


def connected_design(small, data, most):
    """Draw a problem and a set of edges that all reach a sink, or None."""
    problem = small.draw_problem(data, most=most)
    able = np.flatnonzero(problem.candidate)
    active = np.zeros(len(problem.candidate), dtype=bool)
    active[able] = data.draw(st.lists(st.booleans(), min_size=len(able), max_size=len(able)))
    far = sink_distance(problem, active)
    active &= np.isfinite(far[problem.mesh.edges]).all(axis=1)
    return problem, active


def arcs_of(problem, active, direction):
    """Return the streets as a directed graph, sinks apart."""
    graph = nx.DiGraph()
    graph.add_nodes_from(range(len(problem.mesh.vertices)))
    for e in np.flatnonzero(active | problem.existing).tolist():
        u, v = problem.mesh.edges[e].tolist()
        length = float(problem.length[e])
        if direction[e] >= 0:
            graph.add_edge(u, v, length=length)
        if direction[e] <= 0:
            graph.add_edge(v, u, length=length)
    return graph


def round_trips(problem, active, direction):
    """Sum the ways to the nearest sink and from it, by networkx; infinite without."""
    graph = arcs_of(problem, active, direction)
    sinks = set(np.flatnonzero(problem.sinks).tolist())
    old = set(problem.mesh.edges[problem.existing].ravel().tolist())
    counted = set(problem.mesh.edges[active].ravel().tolist()) - sinks - old
    if not sinks:
        return INF if counted else 0.0
    away = nx.multi_source_dijkstra_path_length(graph, sinks, weight="length")
    home = nx.multi_source_dijkstra_path_length(graph.reverse(), sinks, weight="length")
    return sum(away.get(v, INF) + home.get(v, INF) for v in counted)


def assert_strongly_connected(problem, active, direction):
    """All vertices of streets are one strong component once the sinks are one place."""
    graph = arcs_of(problem, active, direction)
    sinks = np.flatnonzero(problem.sinks).tolist()
    for a, b in zip(sinks, sinks[1:]):
        graph.add_edges_from([(a, b), (b, a)])
    lively = set(problem.mesh.edges[active].ravel().tolist())
    parts = [part for part in nx.strongly_connected_components(graph) if part & lively]
    assert len(parts) <= 1


def turns_against(problem, direction):
    """Count straight continuations of one-way streets that meet head on or part."""
    count = 0
    for (v, e), (g, _) in straight_continuations(problem.mesh).items():
        if e < g and direction[e] and direction[g]:
            into = [(problem.mesh.edges[k][1] == v) == (direction[k] > 0) for k in (e, g)]
            count += into[0] == into[1]
    return count


@FEW
@given(data=st.data())
def test_orientations_are_the_best_of_all(small, data):
    problem, active = connected_design(small, data, most=10)
    weight = data.draw(st.sampled_from([0.0, 1.0, 2.5]))
    found = orient(problem, active, turn_weight=weight)
    cut = cut_by(problem, active)
    assert list(found.kept_two_way) == cut
    one_way = [e for e in np.flatnonzero(active).tolist() if e not in cut]
    assert np.flatnonzero(found.direction).tolist() == one_way
    assert_strongly_connected(problem, active, found.direction)
    assert check_directions(problem, active, found.direction) == []
    best = INF
    for signs in itertools.product((1, -1), repeat=max(0, len(one_way) - 1)):
        direction = np.zeros(len(active), dtype=int)
        direction[one_way] = (1, *signs)[: len(one_way)]
        cost = round_trips(problem, active, direction)
        best = min(best, cost + weight * turns_against(problem, direction))
    assert found.cost == pytest.approx(best)
    assert found.optimal
    assert found.after == pytest.approx(round_trips(problem, active, found.direction))
    assert found.before == pytest.approx(round_trips(problem, active, 0 * found.direction))
    assert found.changes == turns_against(problem, found.direction)


@FEW
@given(data=st.data())
def test_some_streets_one_way_others_two_way(small, data):
    problem, active = connected_design(small, data, most=14)
    chosen = np.flatnonzero(active)
    picked = data.draw(st.lists(st.booleans(), min_size=len(chosen), max_size=len(chosen)))
    one_way = np.zeros_like(active)
    one_way[chosen] = picked
    found = orient(problem, active, one_way, steps=60)
    assert not found.direction[~one_way].any()
    cut = set(cut_by(problem, active))
    assert set(found.kept_two_way) == cut & set(np.flatnonzero(one_way).tolist())
    assert_strongly_connected(problem, active, found.direction)
    assert found.cost <= found.first_cost


@FEW
@given(data=st.data())
def test_large_networks_get_better_than_the_first_orientation(small, data):
    mesh = small.draw_mesh(data)
    scenario = data.draw(st.sampled_from(["boundary", "one sink", "inner"]))
    problem = paper_problem(mesh, scenario)
    rng = np.random.default_rng(data.draw(st.integers(0, 999)))
    active = problem.candidate & (rng.random(len(problem.candidate)) < rng.uniform(0.4, 1.0))
    active &= np.isfinite(sink_distance(problem, active)[mesh.edges]).all(axis=1)
    found = orient(problem, active, seed=3, steps=120)
    assert_strongly_connected(problem, active, found.direction)
    assert list(found.kept_two_way) == cut_by(problem, active)
    assert found.cost <= found.first_cost
    assert found.before <= found.after
    assert found.after == pytest.approx(round_trips(problem, active, found.direction))
    again = orient(problem, active, seed=3, steps=120)
    assert (again.direction == found.direction).all()


def test_a_grid_of_streets_alternates():
    # a plain grid of streets that all end at a ring road: one-way pairs as in grid cities
    problem = paper_problem(grid(8, 8), "boundary")
    found = orient(problem, problem.candidate.copy(), turn_weight=1.0)
    assert found.changes == 0
    assert found.cost < 0.8 * found.first_cost


def test_vertices_without_a_way_in_or_out_are_listed():
    mesh = grid(2, 1)
    number = {tuple(pair): i for i, pair in enumerate(mesh.edges.tolist())}
    ring = [(0, 1), (1, 4), (3, 4), (0, 3)]
    problem = dataclasses.replace(paper_problem(mesh, "inner"), sinks=np.arange(6) == 0)
    active = np.zeros(len(mesh.edges), dtype=bool)
    active[[number[pair] for pair in ring]] = True
    direction = np.zeros(len(active), dtype=int)
    direction[[number[0, 1], number[1, 4]]] = 1
    direction[[number[3, 4], number[0, 3]]] = -1
    assert check_directions(problem, active, direction) == []
    direction[number[0, 3]] = 1
    found = check_directions(problem, active, direction)
    assert [(v.kind, v.vertices) for v in found] == [
        ("no way out", (1,)),
        ("no way out", (3,)),
        ("no way out", (4,)),
    ]
    direction[number[1, 2]] = 1
    assert "direction" in {v.kind for v in check_directions(problem, active, direction)}


def test_islands_and_foreign_edges_are_refused():
    problem = paper_problem(grid(4, 4), "inner")
    active = np.zeros(len(problem.candidate), dtype=bool)
    none = np.zeros_like(problem.sinks)
    active[0] = True
    with pytest.raises(InputError, match="no way to a sink"):
        orient(dataclasses.replace(problem, sinks=none), active)
    with pytest.raises(InputError, match="mesh edge 1"):
        orient(problem, active & False, np.arange(len(active)) == 1)
    with pytest.raises(InputError, match="turn_weight"):
        orient(problem, active & False, turn_weight=-1.0)


def test_orienting_stops_when_it_is_cancelled():
    class Cancelled(Silent):
        def cancelled(self):
            return True

    problem = paper_problem(PAPER_MESHES[660](), "boundary")
    start = time.monotonic()
    found = orient(problem, problem.candidate.copy(), steps=10**9, progress=Cancelled())
    assert time.monotonic() - start < allowed(2.0)
    assert_strongly_connected(problem, problem.candidate, found.direction)
