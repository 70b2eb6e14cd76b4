"""Links between vertices: all forms of them agree with trying every set of edges."""

import dataclasses
import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import InfeasibleError, InputError
from platwright.mesh.grids import grid
from platwright.mip.solvers import solve_mip
from platwright.network.checks.validation import check_design, design_cost
from platwright.network.cp.sat import CpOptions, full_network, run_cp
from platwright.network.evaluate import Evaluator, evaluate
from platwright.network.examples import paper_problem
from platwright.network.mip import reference_links
from platwright.network.mip.model import flow_model
from platwright.network.mip.reference import reference_model
from platwright.network.mip.reference_links import list_paths
from platwright.network.partition import patches, point_to_point, through_route
from platwright.network.requirements.base import View
from platwright.network.requirements.linkrepair import repair
from platwright.network.requirements.links import Link
from platwright.network.search.chords import chord_start
from platwright.network.search.windows import Windows, solve_window
from platwright.network.solve import solve
from platwright.network.structure import structure

INF = math.inf
FEW = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


def draw_link(problem, data) -> Link:
    """Draw a link between any two vertices, mostly one that some design meets."""
    count = len(problem.mesh.vertices)
    a = data.draw(st.integers(0, count - 1))
    b = data.draw(st.integers(0, count - 2))
    b += b >= a
    hops = data.draw(st.booleans())
    private = data.draw(st.booleans())
    far = candidate_distance(problem, a, b, hops=hops, private=private)
    spare = data.draw(st.sampled_from([0.0, 1.0, 2.0, -0.5, 0.37]))
    limit = max(0.1, (far if math.isfinite(far) else 3.0) + spare)
    penalty = data.draw(st.sampled_from([INF, INF, 2.5, 0.7]))
    return Link(a, b, limit, hops=hops, private=private, penalty=penalty)


def candidate_distance(problem, a, b, *, hops=True, private=False) -> float:
    """Return the length of the shortest way by candidate and existing edges."""
    graph = nx.Graph()
    graph.add_nodes_from((a, b))
    old = set(problem.mesh.edges[problem.existing].ravel().tolist()) - {a, b}
    able = problem.candidate if private else problem.candidate | problem.existing
    for e in np.flatnonzero(able).tolist():
        u, v = problem.mesh.edges[e].tolist()
        if not (private and {u, v} & old):
            graph.add_edge(u, v, far=1.0 if hops else problem.length[e])
    try:
        return nx.shortest_path_length(graph, a, b, weight="far")
    except nx.NetworkXNoPath:
        return INF


def draw_problem(small, data, most=10, links=2):
    """Draw a small problem with links, and often with lengths of its own."""
    problem = small.draw_problem(data, most=most)
    if data.draw(st.booleans()):
        rng = np.random.default_rng(data.draw(st.integers(0, 999)))
        problem = dataclasses.replace(problem, length=rng.uniform(0.6, 1.9, len(problem.length)))
    drawn = tuple(draw_link(problem, data) for _ in range(data.draw(st.integers(1, links))))
    return dataclasses.replace(problem, requirements=drawn)


def mip_optimum(problem, build) -> float:
    """Return the exact objective of the optimum of a mixed-integer model."""
    index = structure(problem)
    if index.conflicts:
        return INF
    model = build(index)
    result = solve_mip(model.linear, time_limit=30)
    if result.status == "infeasible":
        return INF
    assert result.status == "optimal"
    return Evaluator(problem).objective(model.chosen(result.values))


def cp_optimum(problem) -> float:
    """Return the exact objective of CP-SAT's optimum."""
    index = structure(problem)
    if index.conflicts:
        return INF
    result = run_cp(full_network(index), CpOptions(30))
    if result.status == "infeasible":
        return INF
    assert result.status == "optimal"
    value = Evaluator(problem).objective(result.active)
    assert result.bound == pytest.approx(value, abs=1e-5)
    return value


@FEW
@given(data=st.data())
def test_evaluation_is_what_the_checker_says(small, data):
    problem = draw_problem(small, data, most=7)
    evaluator = Evaluator(problem)
    for active in small.subsets(problem):
        found = evaluator.evaluate(active)
        assert found.objective == pytest.approx(design_cost(problem, active))
        kinds = {link.kind for link in problem.requirements}
        listed = [v.kind for v in check_design(problem, active) if v.kind in kinds]
        assert {kind: listed.count(kind) for kind in listed} == {
            kind: found.counts[kind] for kind in kinds if kind in found.counts
        }


def draw_free_problem(small, data):
    """Draw a problem of up to 60 edges without rules but links, and a design on it."""
    nx_, ny = data.draw(st.integers(2, 5)), data.draw(st.integers(2, 4))
    mesh = grid(nx_, ny)
    scenario = data.draw(st.sampled_from(["boundary", "inner"]))
    problem = paper_problem(mesh, scenario, dead_ends=0.0, zigzags=0.0, too_close=0.0)
    rng = np.random.default_rng(data.draw(st.integers(0, 9999)))
    length = rng.uniform(0.6, 1.9, len(problem.length)) if rng.random() < 0.5 else problem.length
    # sinks everywhere: nothing needs a way out, all that counts is the link
    everywhere = np.ones(len(mesh.vertices), dtype=bool)
    problem = dataclasses.replace(problem, cover={}, sinks=everywhere, length=length)
    link = draw_link(problem, data)
    active = problem.candidate & (rng.random(len(length)) < rng.choice([0.1, 0.5, 0.8]))
    graph = nx.Graph()
    graph.add_edges_from(mesh.edges[problem.candidate].tolist())
    if {link.start, link.end} <= set(graph) and nx.has_path(graph, link.start, link.end):
        for u, v in graph.edges:
            graph[u][v]["far"] = rng.uniform(0.5, 1.5)
        way = nx.shortest_path(graph, link.start, link.end, weight="far")
        for u, v in zip(way, way[1:]):
            active[mesh.edge_between(u, v)] = rng.random() < 0.97
        if rng.random() < 0.5:  # clear what branches off, but for some
            inner = np.isin(mesh.edges, way[1:-1]).any(axis=1)
            on_way = np.zeros(len(length), dtype=bool)
            on_way[[mesh.edge_between(u, v) for u, v in zip(way, way[1:])]] = True
            active &= ~inner | on_way | (rng.random(len(length)) < 0.05)
    return dataclasses.replace(problem, requirements=(link,)), active


@pytest.mark.slow
@settings(FEW, max_examples=100)
@given(data=st.data())
def test_models_judge_a_given_design_as_the_checker_does(small, data):
    problem, active = draw_free_problem(small, data)
    demanded = dataclasses.replace(
        problem, requirements=(dataclasses.replace(problem.requirements[0], penalty=INF),)
    )
    met = not check_design(demanded, active)
    index = structure(demanded)
    network = full_network(index, cuts=[])
    for e, x in network.edge.items():
        network.clause([x if active[e] else network.negated(x)])
    assert (run_cp(network, CpOptions(30)).status != "infeasible") == met
    fixed = {e: bool(active[e]) for e in index.edges}
    result = solve_mip(flow_model(index, fixed=fixed).linear, time_limit=30)
    assert (result.status != "infeasible") == met
    # at a price the model pays exactly where the link is missing
    priced = dataclasses.replace(
        problem, requirements=(dataclasses.replace(problem.requirements[0], penalty=7.5),)
    )
    cost = float(problem.length[active].sum()) + (0.0 if met else 7.5)
    result = solve_mip(flow_model(structure(priced), fixed=fixed).linear, time_limit=30)
    assert result.bound == pytest.approx(cost, abs=1e-4)


@pytest.mark.slow
@settings(FEW, max_examples=100)
@given(data=st.data())
def test_windows_judge_a_given_design_as_the_checker_does(small, data):
    problem, active = draw_free_problem(small, data)
    link = dataclasses.replace(problem.requirements[0], penalty=7.5)
    problem = dataclasses.replace(problem, requirements=(link,), weight_length=0.0)
    index = structure(problem)
    free = index.edges[:: data.draw(st.integers(2, 9))]
    network = Windows(index).network(free, active)
    for e in free:
        network.clause([network.edge[e] if active[e] else network.negated(network.edge[e])])
    result = run_cp(network, CpOptions(30))
    if network.constant > 0 or any(cost > 0 for _, cost, _ in network.costs):
        assert result.bound == pytest.approx(7.5 * len(check_design(problem, active)))
    else:
        # a window that the link does not touch, or where it is met whatever is chosen
        states = set()
        for trial in range(20):
            other = active.copy()
            other[free] = np.random.default_rng(trial).random(len(free)) < 0.5
            states.add(len(check_design(problem, other)))
        assert len(states) == 1


@pytest.mark.slow
@FEW
@given(data=st.data())
def test_constraint_model_is_exact(small, data):
    problem = draw_problem(small, data)
    assert cp_optimum(problem) == pytest.approx(small.brute_force(problem))


@FEW
@given(data=st.data())
def test_flow_model_is_exact(small, data):
    problem = draw_problem(small, data)
    assert mip_optimum(problem, flow_model) == pytest.approx(small.brute_force(problem))


@FEW
@given(data=st.data())
def test_listed_paths_and_flow_say_the_same(small, data):
    # equations 7 and 8 against the flow, in the same model otherwise
    problem = draw_problem(small, data)
    problem = dataclasses.replace(problem, weight_distance=0.0)
    listed = mip_optimum(problem, reference_model)
    assert listed == pytest.approx(mip_optimum(problem, flow_model))
    assert listed == pytest.approx(small.brute_force(problem))


@pytest.mark.parametrize("solver", ["cpsat", "highs"])
@settings(FEW, max_examples=9)
@given(data=st.data())
def test_solve_returns_the_optimum(small, solver, data):
    problem = draw_problem(small, data)
    best = small.brute_force(problem)
    if math.isinf(best):
        with pytest.raises(InfeasibleError, match="No street network satisfies all rules"):
            solve(problem, time_limit=30, solver=solver)
        return
    design = solve(problem, time_limit=30, solver=solver)
    assert design.objective == pytest.approx(best)
    assert not [v for v in check_design(problem, design.active) if v.hard]


@pytest.mark.slow
@settings(FEW, max_examples=15)
@given(data=st.data())
def test_windows_never_break_a_hard_link(small, data):
    problem = large_problem(small, data)
    index = structure(problem)
    start = None if index.conflicts else first_design(index)
    if start is None:
        return
    evaluator = Evaluator(problem)
    windows = Windows(index)
    active = start
    for _ in range(8):
        centre = data.draw(st.sampled_from(sorted({v for e in index.edges for v in index.ends[e]})))
        free = windows.around(centre, data.draw(st.integers(1, 4)))
        found, _ = solve_window(windows, free, active, CpOptions(10, effort=0.3))
        if found is None:
            continue
        assert not [v.text for v in check_design(problem, found) if v.hard]
        assert evaluator.objective(found) == pytest.approx(design_cost(problem, found))
        active = found


@pytest.mark.slow
@settings(FEW, max_examples=15)
@given(data=st.data())
def test_a_window_finds_its_best_design(small, data):
    # with a window as large as the mesh but for one edge, which is decided
    problem = draw_problem(small, data)
    problem = dataclasses.replace(problem, weight_distance=0.0)
    index = structure(problem)
    if index.conflicts or len(index.edges) < 2:
        return
    evaluator = Evaluator(problem)
    valid = [a for a in small.subsets(problem) if evaluator.evaluate(a).valid]
    if not valid:
        return
    start = valid[data.draw(st.integers(0, len(valid) - 1))]
    decided = data.draw(st.sampled_from(index.edges))
    free = [e for e in index.edges if e != decided]
    found, _ = solve_window(Windows(index), free, start, CpOptions(30))
    assert found is not None
    best = min(evaluator.objective(a) for a in valid if a[decided] == start[decided])
    assert evaluator.objective(found) == pytest.approx(best)


def large_problem(small, data):
    """Draw a problem of some 30 to 150 edges with links between patches and perhaps a route."""
    mesh = small.draw_mesh(data)
    scenario = data.draw(st.sampled_from(["boundary", "one sink", "inner"]))
    weight = data.draw(st.sampled_from([0.0, 1.0]))
    problem = paper_problem(mesh, scenario, weight_distance=weight, too_close=2.0)
    seed = data.draw(st.integers(0, 99))
    patch = patches(mesh, 6, seed=seed)
    measure = data.draw(st.sampled_from(["hops", "share"]))
    tolerance = 2.0 if measure == "hops" else 0.3
    links = point_to_point(problem, patch, tolerance=tolerance, measure=measure, seed=seed)
    if scenario == "boundary":
        rim = np.flatnonzero(mesh.boundary_vertices & touched(problem, problem.candidate))
        a, b = (int(rim[data.draw(st.integers(0, len(rim) - 1))]) for _ in range(2))
        if a != b and math.isfinite(candidate_distance(problem, a, b, private=True)):
            links.append(through_route(problem, a, b, tolerance=1.0))
    return dataclasses.replace(problem, requirements=tuple(links))


def touched(problem, edges):
    """Mark the vertices of edges."""
    mark = np.zeros(len(problem.mesh.vertices), dtype=bool)
    mark[problem.mesh.edges[edges].ravel()] = True
    return mark


def first_design(index):
    """Return any valid design, or None if none is found soon."""
    network = full_network(index, cuts=[], ranks=True)
    return run_cp(network, CpOptions(10, first_only=True, linearization=0)).active


def test_a_route_has_no_branches():
    mesh = grid(8, 8)
    problem = paper_problem(mesh)
    x, y = mesh.vertices.T
    south = int(np.flatnonzero((x == 3) & (y == 0))[0])
    north = int(np.flatnonzero((x == 5) & (y == 8))[0])
    route = through_route(problem, south, north, tolerance=0)
    assert (route.limit, route.hops, route.kind) == (10.0, True, "through route")
    problem = dataclasses.replace(problem, requirements=(route,))
    design = solve(problem, time_limit=2)
    streets = nx.Graph(mesh.edges[design.active].tolist())
    old = set(mesh.edges[problem.existing].ravel().tolist()) - {south, north}
    plain = nx.subgraph(streets, [v for v in streets if v in (south, north) or v not in old])
    ways = [
        way
        for way in nx.all_simple_paths(plain, south, north, cutoff=10)
        if all(streets.degree(v) == 2 for v in way[1:-1])
    ]
    assert len(ways) == 1
    assert len(ways[0]) == 11


def placed(mesh, *places):
    """Return the vertices at positions in mesh edge lengths."""
    near = np.round(mesh.vertices / mesh.edge_length).astype(int).tolist()
    return [near.index(list(place)) for place in places]


def along(mesh, *places):
    """Mark the edges of a way from place to place."""
    way = placed(mesh, *places)
    mark = np.zeros(len(mesh.edges), dtype=bool)
    mark[[mesh.edge_between(u, v) for u, v in zip(way, way[1:])]] = True
    return mark


def allowed(problem, active, free=None) -> tuple[bool, bool, bool]:
    """Tell whether evaluation, CP-SAT and flow model accept a design; CP-SAT in a window."""
    index = structure(problem)
    network = full_network(index, cuts=[])
    if free is not None:
        network = Windows(index).network(free, active)
    for e, x in network.edge.items():
        network.clause([x if active[e] else network.negated(x)])
    fixed = {e: bool(active[e]) for e in index.edges}
    linear = flow_model(index, fixed=fixed).linear
    return (
        evaluate(problem, active).valid,
        run_cp(network, CpOptions(10)).status != "infeasible",
        solve_mip(linear, time_limit=10).status != "infeasible",
    )


def open_problem(mesh, scenario, **fields):
    """Make a problem without rules in which everything is a sink."""
    problem = paper_problem(mesh, scenario, dead_ends=0.0, zigzags=0.0, too_close=0.0)
    everywhere = np.ones(len(mesh.vertices), dtype=bool)
    return dataclasses.replace(problem, cover={}, sinks=everywhere, **fields)


@pytest.mark.parametrize(("limit", "fits"), [(6, False), (7, False), (8, True)])
def test_several_detours_add_up(limit, fits):
    # each step lies on some way of six edges, the whole is eight long
    mesh = grid(5, 3)
    snake = [(0, 0), (0, 1), (1, 1), (1, 0), (2, 0), (2, 1), (3, 1), (3, 0), (4, 0)]
    a, b = placed(mesh, snake[0], snake[-1])
    link = Link(a, b, limit, hops=True)
    problem = open_problem(mesh, "inner", requirements=(link,))
    assert allowed(problem, along(mesh, *snake)) == (fits,) * 3


@pytest.mark.parametrize("old", [False, True])
def test_a_route_stays_off_existing_streets_on_its_way(old):
    mesh = grid(4, 4)
    plain = open_problem(mesh, "boundary")
    way = [(2, 0), (2, 1), (2, 2), (2, 3), (2, 4)]
    inner = along(mesh, (0, 2), (1, 2), (2, 2)) & old
    problem = dataclasses.replace(
        plain, existing=plain.existing | inner, candidate=plain.candidate & ~inner
    )
    a, b = placed(mesh, way[0], way[-1])
    problem = dataclasses.replace(problem, requirements=(Link(a, b, 4, hops=True, private=True),))
    active = along(mesh, *way)
    assert evaluate(problem, active).valid != old
    assert (not [v for v in check_design(problem, active) if v.hard]) != old
    if not old:
        assert allowed(problem, active) == (True,) * 3


@pytest.mark.parametrize("branch", [False, True])
def test_a_window_beside_a_route_lets_nothing_branch_off(branch):
    # the branch is too far off for the route itself
    mesh = grid(4, 4)
    way = [(2, 0), (2, 1), (2, 2), (2, 3), (2, 4)]
    a, b = placed(mesh, way[0], way[-1])
    route = Link(a, b, 4, hops=True, private=True)
    problem = open_problem(mesh, "boundary", requirements=(route,))
    side = along(mesh, (2, 2), (3, 2))
    active = along(mesh, *way) | (side & branch)
    free = np.flatnonzero(side).tolist()
    assert allowed(problem, active, free) == (not branch,) * 3


def test_a_route_that_cannot_be_is_refused():
    problem = paper_problem(grid(4, 4))
    corner, middle = 0, 2  # no candidate edge ends at a corner
    with pytest.raises(InputError, match="No route for through traffic is possible"):
        through_route(problem, corner, middle)
    with pytest.raises(InputError, match="joins vertex 3 of the mesh with itself"):
        Link(3, 3, 1.0)
    with pytest.raises(InputError, match="limit"):
        Link(3, 4, 0.0)
    with pytest.raises(InputError, match="penalty"):
        Link(3, 4, 1.0, penalty=-1.0)


def test_a_part_keeps_the_links_that_it_can_make():
    mesh = grid(6, 3)
    problem = paper_problem(mesh)
    x, y = mesh.vertices.T

    def vertex(i, j):
        return int(np.flatnonzero((x == i) & (y == j))[0])

    inner = Link(vertex(1, 1), vertex(2, 2), 2.0, hops=True)
    across = Link(vertex(1, 1), vertex(5, 1), 4.0, hops=True)
    around = Link(vertex(0, 0), vertex(3, 0), 3.0, hops=True)
    route = Link(vertex(1, 0), vertex(1, 3), 3.0, hops=True, private=True)
    assert around.without(problem) is None  # existing streets make it
    assert [link.without(problem) for link in (inner, across, route)] == [inner, across, route]
    west = problem.candidate & (x[mesh.edges] <= 3).all(axis=1)
    part = dataclasses.replace(problem, candidate=west)
    assert [link.without(part) for link in (inner, across, route)] == [inner, None, route]


def test_too_many_paths_are_not_listed(monkeypatch):
    monkeypatch.setattr(reference_links, "MOST_PATHS", 200)
    problem = paper_problem(grid(9, 9), "inner")
    link = Link(0, 55, 10.0, hops=True)
    model = flow_model(structure(dataclasses.replace(problem, requirements=(link,))))
    with pytest.raises(InputError, match="More than 200 paths"):
        list_paths(model, link)
    assert len(list_paths(model, Link(0, 22, 4.0, hops=True))) == 6


@FEW
@given(data=st.data())
def test_repair_leaves_no_more_broken_links_than_it_must(small, data):
    problem = large_problem(small, data)
    index = structure(problem)
    none = np.zeros(len(problem.candidate), dtype=bool)
    mended = repair(index, none)
    assert not (mended & ~problem.candidate).any()
    links = [link for link in problem.requirements if not link.private]
    routes = [link for link in problem.requirements if link.private]
    if not routes:
        assert not any(link.violations(View(problem, mended)) for link in links)
    assert repair(index, mended) is mended or routes


def test_repair_makes_a_valid_start_of_straight_streets():
    mesh = grid(12, 12)
    problem = paper_problem(mesh, weight_length=0.0, weight_distance=1.0)
    links = tuple(point_to_point(problem, patches(mesh, 16)))
    problem = dataclasses.replace(problem, requirements=links)
    index = structure(problem)
    straight = chord_start(index)
    assert math.isinf(evaluate(problem, straight).objective)
    assert evaluate(problem, repair(index, straight)).valid
