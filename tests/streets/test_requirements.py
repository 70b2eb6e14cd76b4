"""What is asked of the network as a whole, on whole plans; judged with plain graphs."""

from __future__ import annotations

import dataclasses

import networkx as nx
import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.network.checks.validation import check_design
from platwright.network.requirements.base import View
from platwright.network.specification import Specification
from platwright.progress import Silent
from platwright.site import BoundaryStreet
from platwright.streets import Preferences, StreetPlan, Wishes, design_streets, plan_layers
from shapely.geometry import LineString

from .conftest import make_site

PAPER = Specification(rules="paper", block_width=108.0, levels=1, gap=0.4, time_limit=20.0)


def plan_of(site, spec, **wishes):
    plan = design_streets([site], spec, wishes=Wishes(**wishes)).plans[0]
    for solved in plan.network.solved:
        assert not [v for v in check_design(solved.problem, solved.design.active) if v.hard]
    return plan


def graph_of(plan, existing=True):
    """Streets of the mesh as a graph of vertices."""
    ground = plan.network.ground
    streets = plan.network.level > 0
    if existing:
        streets = streets | ground.street
    graph = nx.Graph()
    for e in np.flatnonzero(streets).tolist():
        graph.add_edge(*ground.mesh.edges[e].tolist(), length=float(ground.mesh.lengths[e]))
    return graph


def chosen(plan):
    return plan.network.level > 0


def exits_of(plan):
    """Vertices on existing streets that new streets touch."""
    ground = plan.network.ground
    old = set(ground.mesh.edges[ground.street].ravel().tolist())
    new = set(ground.mesh.edges[chosen(plan)].ravel().tolist())
    return old & new


@pytest.mark.parametrize("rules", ["planner", "paper"])
@pytest.mark.parametrize("levels", [1, 2])
def test_no_more_exits_than_asked(rules, levels):
    site = make_site(shapely.box(0, 0, 432, 360))
    spec = Specification(rules=rules, levels=levels, exits=3, gap=0.4, time_limit=20.0)
    plan = plan_of(site, spec)
    assert 2 <= len(exits_of(plan)) <= 3
    assert plan.segments


@pytest.mark.parametrize("levels", [1, 2])
def test_the_length_budget_is_kept(levels):
    site = make_site(shapely.box(0, 0, 432, 288))
    free = plan_of(site, Specification(levels=levels, gap=0.3))
    whole = sum(s.line.length for s in free.segments)
    plan = plan_of(site, Specification(levels=levels, length_budget=0.6 * whole, gap=0.3))
    spent = float(plan.network.ground.mesh.lengths[chosen(plan)].sum())
    assert 0 < spent <= 0.6 * whole + 0.01
    assert sum(s.line.length for s in plan.segments) <= 0.65 * whole


@pytest.mark.parametrize("levels", [1, 2])
def test_no_junction_is_farther_from_an_exit_than_asked(levels):
    site = make_site(shapely.box(0, 0, 324, 324), frontage=[LineString([(0, 0), (324, 0)])])
    spec = dataclasses.replace(PAPER, levels=levels, max_distance=450.0)
    plan = plan_of(site, spec)
    sinks = set(np.flatnonzero(plan.network.ground.sinks).tolist())
    graph = graph_of(plan)
    far = nx.multi_source_dijkstra_path_length(graph, sinks & set(graph), weight="length")
    ends = set(plan.network.ground.mesh.edges[chosen(plan)].ravel().tolist())
    assert max(far[v] for v in ends) <= 450.0 + 1e-3


def test_links_make_ways_within_the_site_short():
    site = make_site(shapely.box(0, 0, 324, 324))
    within = dataclasses.replace(PAPER, traffic="within", patch_size=108.0)
    plan = plan_of(site, within)
    links = [r for s in plan.network.solved for r in s.problem.requirements if r.kind == "link"]
    assert len(links) >= 6
    graph = graph_of(plan)
    for link in links:
        assert nx.shortest_path_length(graph, link.start, link.end) <= link.limit


def test_drawn_patches_are_those_that_are_linked():
    site = make_site(shapely.box(0, 0, 432, 432))
    halves = [(shapely.box(0, 0, 216, 432), 3), (shapely.box(216, 0, 432, 432), 4)]
    spec = dataclasses.replace(PAPER, traffic="within")
    plan = plan_of(site, spec, preferences=Preferences(partition=halves))
    links = [r for s in plan.network.solved for r in s.problem.requirements if r.kind == "link"]
    assert len(links) == 1
    x = plan.network.ground.mesh.vertices[[links[0].start, links[0].end], 0]
    assert x.min() < 216 < x.max()


def test_a_patch_that_is_missing_is_named():
    site = make_site(shapely.box(0, 0, 432, 432))
    half = Preferences(partition=[(shapely.box(0, 0, 216, 432), 3)], partition_layer="Parts")
    spec = dataclasses.replace(PAPER, traffic="within")
    with pytest.raises(InputError, match="belong to no patch") as caught:
        plan_of(site, spec, preferences=half)
    assert "Parts" in str(caught.value)


def test_traffic_through_the_site_has_a_route_without_branches():
    site = make_site(shapely.box(0, 0, 324, 324))
    route = LineString([(108, -5), (150, 150), (108, 330)])
    spec = dataclasses.replace(PAPER, traffic="through", detour=0.0)
    plan = plan_of(site, spec, preferences=Preferences(routes=[(route, 9)]))
    graph = graph_of(plan, existing=False)
    xy = plan.network.ground.mesh.vertices
    start = min(exits_of(plan), key=lambda v: np.hypot(*(xy[v] - (108, 0))))
    end = min(exits_of(plan), key=lambda v: np.hypot(*(xy[v] - (108, 324))))
    path = nx.shortest_path(graph, start, end)
    assert all(graph.degree(v) == 2 for v in path[1:-1])
    assert sum(graph[u][v]["length"] for u, v in zip(path, path[1:])) < 332


def test_a_route_that_ends_inside_is_refused():
    site = make_site(shapely.box(0, 0, 432, 432))
    route = Preferences(routes=[(LineString([(216, 0), (216, 216)]), 9)], route_layer="Routes")
    with pytest.raises(InputError, match="from the edge of the site") as caught:
        plan_of(site, dataclasses.replace(PAPER, traffic="through"), preferences=route)
    assert "Routes" in str(caught.value)
    assert "9" in str(caught.value)


def test_a_route_that_would_end_far_from_where_streets_can_leave_is_refused():
    site = make_site(shapely.box(0, 0, 432, 432), frontage=[LineString([(0, 0), (432, 0)])])
    line = LineString([(216, 0), (216, 432)])
    route = Preferences(routes=[(line, 9)], route_layer="Routes")
    with pytest.raises(InputError, match="432 m from the nearest place") as caught:
        plan_of(site, Specification(traffic="through", time_limit=3.0), preferences=route)
    assert "Layer 'Routes', feature 9" in str(caught.value)


@pytest.mark.parametrize(("top", "moved"), [(300, True), (432, False)])
def test_the_end_of_a_route_that_is_moved_is_told(top, moved):
    """The street along the west side ends at `top`, the route is drawn from near its north end."""
    south, west = LineString([(0, 0), (432, 0)]), LineString([(0, 0), (0, top)])
    site = make_site(shapely.box(0, 0, 432, 432), frontage=[south, west])
    line = LineString([(360, 0), (216, 250), (0, 425)])
    spec = Specification(traffic="through", gap=0.4, time_limit=4.0)
    plan = plan_of(site, spec, preferences=Preferences(routes=[(line, 9)]))
    problems = plan_layers(StreetPlan((plan,), plan.specification, 1.0))["problems"]
    rows = problems[problems["problem"].str.contains("Through route 9")]
    assert len(rows) == moved
    if moved:
        (row,) = rows.itertuples()
        assert (row.geometry.x, row.geometry.y) == pytest.approx((0, 425))
        away = int(row.problem.split(" m from here")[0].split()[-1])
        xy = plan.network.ground.mesh.vertices
        doors = [v for v in exits_or_doors(plan) if xy[v][0] < 1]
        assert away == round(min(np.hypot(*(xy[v] - (0, 425))) for v in doors))
        assert 72 < away < 216


def exits_or_doors(plan):
    """Vertices on existing streets."""
    ground = plan.network.ground
    return sorted(set(ground.mesh.edges[ground.street].ravel().tolist()))


def test_without_a_drawn_route_one_leads_where_one_can():
    """The streets that arrive farthest apart are cut off from each other by an obstacle."""
    site = make_site(
        shapely.box(0, 0, 720, 216),
        obstacles=(shapely.box(325, -10, 395, 226),),
    )
    spec = Specification(traffic="through", gap=0.4, time_limit=4.0)
    plan = plan_of(site, spec)
    (route,) = {
        (r.start, r.end)
        for s in plan.network.solved
        for r in s.problem.requirements
        if r.kind == "through route"
    }
    x = plan.network.ground.mesh.vertices[list(route), 0]
    assert (x < 360).all() or (x > 360).all()


def test_links_across_a_kept_street_are_asked_of_both_sides():
    """The street divides the site into blocks; where links join them these are one program."""
    kept = BoundaryStreet(LineString([(144, 0), (144, 324)]))
    site = make_site(shapely.box(0, 0, 324, 324), inner=(kept,))
    within = dataclasses.replace(PAPER, traffic="within", patch_size=108.0)
    plan = plan_of(site, within)
    (solved,) = plan.network.solved
    links = [r for r in solved.problem.requirements if r.kind == "link"]
    x = plan.network.ground.mesh.vertices[:, 0]
    assert any((x[r.start] - 144) * (x[r.end] - 144) < 0 for r in links)
    graph = graph_of(plan)
    for link in links:
        assert nx.shortest_path_length(graph, link.start, link.end) <= link.limit


def test_links_of_a_divided_site_are_told_to_stay_inside_its_parts():
    site = make_site(shapely.box(0, 0, 576, 288))
    told = Told()
    wishes = Wishes(given={1: [LineString([(240, 0), (240, 288)])]})
    spec = Specification(traffic="within", gap=0.5, levels=1, time_limit=4.0)
    design_streets([site], spec, wishes=wishes, progress=told)
    assert any("inside each of its 2 sub-regions" in text for text in told.warnings)


class Told(Silent):
    """Keeps the warnings."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        self.warnings.append(text)


@pytest.mark.parametrize("rules", ["planner", "paper"])
def test_for_one_way_streets_no_street_is_the_only_way(rules):
    south = LineString([(0, 0), (432, 0)])
    site = make_site(shapely.box(0, 0, 432, 288), frontage=[south])
    spec = Specification(rules=rules, one_way="all", gap=0.4, time_limit=20.0)
    plan = plan_of(site, spec)
    graph = graph_of(plan)
    hub = [v for v in np.flatnonzero(plan.network.ground.sinks).tolist() if v in graph]
    for v in hub:
        nx.add_path(graph, [v, ("a", v), "hub", ("b", v), v])
    mesh = plan.network.ground.mesh
    new = {frozenset(pair) for pair in mesh.edges[chosen(plan)].tolist()}
    assert plan.segments
    assert not [b for b in nx.bridges(graph) if frozenset(b) in new]


def test_junctions_keep_their_distance():
    site = make_site(shapely.box(0, 0, 432, 432))
    spec = dataclasses.replace(PAPER, junction_spacing=60.0)
    plan = plan_of(site, spec)
    graph = graph_of(plan)
    many = [v for v in graph if graph.degree(v) >= 3]
    new = set(plan.network.ground.mesh.edges[chosen(plan)].ravel().tolist())
    for i, u in enumerate(many):
        near = nx.single_source_dijkstra_path_length(graph, u, cutoff=59.9, weight="length")
        others = [v for v in many[i + 1 :] if v in near and (u in new or v in new)]
        assert not others


@pytest.mark.parametrize("rules", ["planner", "paper"])
def test_one_way_streets_lead_out_and_in(rules):
    site = make_site(shapely.box(0, 0, 432, 360))
    plan = plan_of(site, Specification(rules=rules, one_way="all", gap=0.4, time_limit=20.0))
    streets = plan_layers(StreetPlan((plan,), plan.specification, 1.0))["streets"]
    new = streets[streets["status"] == "new"]
    single = new["oneway"].astype(bool)
    assert new.loc[single, "length_m"].sum() > 0.6 * new["length_m"].sum()
    graph = nx.DiGraph()
    edge = site.polygon.boundary
    for _, row in new.iterrows():
        ends = [tuple(np.round(row.geometry.coords[i], 2)) for i in (0, -1)]
        ends = ["out" if edge.distance(shapely.Point(xy)) < 0.5 else xy for xy in ends]
        graph.add_edge(*ends)
        if not row["oneway"]:
            graph.add_edge(*ends[::-1])
    assert nx.is_strongly_connected(graph)
    lengths = {}
    for _, row in new.iterrows():
        assert row["dist_to_sink_m"] >= row["length_m"] / 2 - 0.01
        lengths[row["street_id"]] = row["dist_end_m"]
    assert max(lengths.values()) < 2000


def test_two_way_streets_stay_so_without_the_wish(square):
    plan = plan_of(square, Specification())
    assert not any(s.one_way for s in plan.segments)


def test_what_cannot_be_had_is_told_in_place():
    """A route through a site two blocks wide would cost all other streets."""
    site = make_site(shapely.box(0, 0, 144, 432))
    route = LineString([(72, 0), (72, 432)])
    spec = Specification(traffic="through", gap=0.4, time_limit=20.0)
    plan = plan_of(site, spec, preferences=Preferences(routes=[(route, 9)]))
    problems = plan_layers(StreetPlan((plan,), plan.specification, 1.0))["problems"]
    broken = [
        solved
        for solved in plan.network.solved
        for link in solved.problem.requirements
        if link.violations(View(solved.problem, solved.design.active))
    ]
    told = any("leads through the site" in text for text in problems["problem"])
    assert told == bool(broken)


def test_culs_de_sac_need_no_exits_of_their_own():
    south = LineString([(0, 0), (432, 0)])
    site = make_site(shapely.box(0, 0, 432, 300), frontage=[south])
    spec = Specification(exits=2, cul_de_sacs=True, gap=0.4, time_limit=20.0)
    plan = plan_of(site, spec)
    touching = {
        (round(x), round(y))
        for s in plan.segments
        for x, y in (s.line.coords[0], s.line.coords[-1])
        if south.distance(shapely.Point(x, y)) < 1
    }
    assert len(touching) <= 2


@pytest.mark.parametrize("first", [0, 500])
def test_a_route_in_one_site_says_nothing_about_another(first):
    sites = [make_site(shapely.box(x, 0, x + 360, 288)) for x in (0, 500)]
    route = LineString([(first + 180, 0), (first + 180, 288)])
    wishes = Wishes(preferences=Preferences(routes=[(route, 7)]))
    for site in sites:
        own = wishes.of_site(site, sites).preferences.routes
        assert [i for _, i in own] == ([7] if site.polygon.bounds[0] == first else [])


@pytest.mark.parametrize("levels", [1, 2])
def test_sub_regions_share_the_length_budget(levels):
    site = make_site(shapely.box(0, 0, 576, 288))
    given = {1: [LineString([(240, 0), (240, 288)])]}
    spec = Specification(levels=levels, length_budget=700.0, gap=0.4, time_limit=8.0)
    plans = design_streets([site], spec, wishes=Wishes(given=given)).plans
    assert len(plans) == 2
    spent = [float(p.network.ground.mesh.lengths[p.network.level > 0].sum()) for p in plans]
    assert 0 < sum(spent) <= 700.01


def test_routes_and_earlier_streets_are_cut_at_given_streets():
    site = make_site(shapely.box(0, 0, 720, 360))
    given = {1: [LineString([(360, 0), (360, 360)])]}
    route = LineString([(0, 144), (720, 144)])
    short = [LineString([(x, 0), (x, 360)]) for x in (72, 432)]
    wishes = Wishes(
        given=given,
        preferences=Preferences(routes=[(route, 3)]),
        start={
            0: [*short, LineString([(0, 144), (360, 144)]), LineString([(360, 144), (720, 144)])]
        },
    )
    spec = Specification(traffic="through", sink_mode="boundary", gap=0.4, time_limit=8.0)
    plans = design_streets([site], spec, wishes=wishes).plans
    assert len(plans) == 2
    for plan in plans:
        west, _, east, _ = plan.site.polygon.bounds
        streets = shapely.union_all([s.line for s in plan.segments])
        low, _, high, _ = streets.bounds
        assert low - west < 1
        assert east - high < 1


def test_one_way_streets_need_no_mesh_lines():
    site = make_site(shapely.box(0, 0, 432, 150))
    given = {3: [LineString([(216, 0), (216, 150)])]}
    spec = Specification(
        block_width=50.0, block_length=100.0, cul_de_sacs=True, one_way="all", time_limit=5.0
    )
    plans = design_streets([site], spec, wishes=Wishes(given=given)).plans
    built = [s for plan in plans for s in plan.segments]
    assert built
    assert not any(plan.network.level.any() for plan in plans)


@pytest.mark.parametrize("field", ["rules", "traffic", "one_way", "sink_mode", "coverage_unit"])
def test_a_word_that_means_nothing_is_refused(field):
    with pytest.raises(InputError, match=field):
        Specification(**{field: "sideways"})
