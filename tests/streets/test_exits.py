"""The number of exits: of the whole site, shared by levels, blocks and sub-regions.

Exits are counted here from the streets as drawn, by plain geometry.
"""

from __future__ import annotations

import dataclasses

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.errors import CancelledError, InfeasibleError
from platwright.levels import COLLECTOR, LOCAL
from platwright.measure import validate_network
from platwright.mesh.grids import grid
from platwright.network.examples import paper_problem
from platwright.network.requirements.exits import ExitCount
from platwright.network.specification import Specification
from platwright.progress import Silent
from platwright.site import BoundaryStreet
from platwright.streets import Wishes, design_streets, plan_layers
from platwright.streets import levels as levels_module
from platwright.streets.exits import (
    across_streets,
    doors,
    exits_demanded,
    exits_used,
    out_of_reach,
    share_of_exits,
)
from platwright.streets.program import level_problem
from platwright.streets.requirements import with_requirements
from platwright.streets.wishes import Whole
from shapely.geometry import LineString, Point

from .conftest import make_site

SIDE = 432.0
PAPER = Specification(rules="paper", block_width=108.0, time_limit=5.0)


def ring_road(side=SIDE, height=SIDE):
    corners = [(0, 0), (side, 0), (side, height), (0, height), (0, 0)]
    return tuple(BoundaryStreet(LineString(pair)) for pair in zip(corners, corners[1:]))


def places(plans, edge):
    """Where new streets touch the edge of the site, each place once."""
    found = set()
    for plan in plans:
        for s in plan.segments:
            for x, y in (s.line.coords[0], s.line.coords[-1]):
                if edge.distance(Point(x, y)) < 1:
                    found.add((round(x), round(y)))
    return found


def with_obstacle():
    return make_site(
        shapely.box(0, 0, SIDE, SIDE),
        streets=ring_road(),
        obstacles=(Point(230, 230).buffer(60),),
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_local_streets_use_the_exits_that_collectors_leave(seed):
    """What the collectors' exits leave out of reach has streets from others."""
    site = with_obstacle()
    spec = dataclasses.replace(PAPER, exits=4, max_distance=400.0, seed=seed, time_limit=8.0)
    plan = design_streets([site], spec).plans[0]
    assert not plan.uncovered
    assert 2 <= len(places([plan], site.polygon.boundary)) <= 4


@pytest.mark.slow
def test_sub_regions_share_the_exits_of_the_site():
    site = make_site(shapely.box(0, 0, 720, 360), streets=ring_road(720, 360))
    given = LineString([(300, 0), (300, 360)])
    spec = Specification(exits=4, gap=0.3, time_limit=6.0)
    plan = design_streets([site], spec, wishes=Wishes(given={1: [given]}))
    assert len(plan.plans) == 2
    at_edge = places(plan.plans, site.polygon.boundary)
    assert 0 < len(at_edge) <= 4
    # the given street is met inside the site, where it costs no exit
    inside = [xy for xy in places(plan.plans, given) if 30 < xy[1] < 330]
    assert inside
    used = sum(exits_used(p.network.ground, p.network.level > 0) for p in plan.plans)
    assert used <= 4


def test_the_checker_counts_exits_of_a_divided_site_at_its_edge():
    site = make_site(shapely.box(0, 0, 576, 288), streets=ring_road(576, 288))
    given = LineString([(240, 0), (240, 288)])
    spec = Specification(exits=3, levels=1, gap=0.5, time_limit=3.0)
    plan = design_streets([site], spec, wishes=Wishes(given={1: [given]}))
    streets = plan_layers(plan)["streets"].set_index("street_id", drop=False)

    def frame(*shapes):
        return gpd.GeoDataFrame(geometry=list(shapes), crs=site.crs)

    report = validate_network(
        streets,
        site=frame(site.polygon),
        boundary_streets=frame(*(s.line for s in site.boundary_streets)),
        exits_most=3,
    )
    assert not (report.problems["kind"] == "exits").any()
    fewer = len(places(plan.plans, site.polygon.boundary)) - 1
    if fewer > 0:
        strict = validate_network(
            streets,
            site=frame(site.polygon),
            boundary_streets=frame(*(s.line for s in site.boundary_streets)),
            exits_most=fewer,
        )
        assert (strict.problems["kind"] == "exits").any()


def test_a_street_that_is_kept_inside_is_no_exit():
    kept = LineString([(216, 0), (216, SIDE)])
    site = make_site(
        shapely.box(0, 0, SIDE, SIDE), streets=ring_road(), inner=(BoundaryStreet(kept),)
    )
    plan = design_streets([site], Specification(exits=2, gap=0.4, time_limit=3.0)).plans[0]
    ground = plan.network.ground
    outer, inner = doors(ground)
    assert inner.any()
    assert not (outer & inner).any()
    xy = ground.mesh.vertices[inner]
    assert np.abs(xy[:, 0] - 216).max() < 5
    assert xy[:, 1].min() > 30
    assert xy[:, 1].max() < SIDE - 30
    assert len(places([plan], site.polygon.boundary)) <= 2
    assert plan.segments


def test_streets_that_would_meet_a_road_uncounted_are_left_out(square):
    """A road crosses the south of the site between two rows of vertices, 28 m from the first."""
    spec = Specification(exits=2, levels=1, edge_length=72.0, gap=0.5, time_limit=2.0)
    ground = design_streets([square], spec).plans[0].network.ground
    mesh = ground.mesh
    nothing = np.zeros(len(mesh.edges), dtype=bool)
    y = mesh.vertices[mesh.edges][:, :, 1]
    assert not across_streets(ground).any()
    for at, met in ((100.0, True), (144.0, False), (40.0, False)):
        road = (BoundaryStreet(LineString([(-20, at), (308, at)])),)
        crossed = dataclasses.replace(
            ground, site=dataclasses.replace(square, boundary_streets=road)
        )
        over = (y.min(axis=1) < at - 1) & (y.max(axis=1) > at + 1) & ~mesh.boundary_edges
        mark = across_streets(crossed)
        # the first row leads from the outline, where each street comes alone and is cut off
        assert mark.tolist() == (over & met).tolist()
        problem = local_problem(crossed, spec, nothing)
        assert not (problem.candidate & mark).any()
        assert (problem.candidate & ~mark).any()


def local_problem(ground, spec, above):
    problem = level_problem(ground, spec, LOCAL, above)
    return with_requirements(problem, ground, spec, LOCAL, above)


def test_places_out_of_reach_are_counted():
    square = make_site(shapely.box(0, 0, SIDE, SIDE))
    spec = Specification(exits=2, levels=1, edge_length=72.0, gap=0.5, time_limit=2.0)
    ground = design_streets([square], spec).plans[0].network.ground
    nothing = np.zeros(len(ground.mesh.edges), dtype=bool)
    assert out_of_reach(local_problem(ground, spec, nothing)) == 0
    shut = dataclasses.replace(ground, whole=Whole(square.polygon.boundary, 0))
    problem = local_problem(shut, spec, nothing)
    assert out_of_reach(problem) == len(problem.cover) > 0
    # from one street all of it can be reached, but not within 60 m
    column = ground.mesh.vertices[ground.mesh.edges][:, :, 0]
    above = ground.free & (np.abs(column - 72) < 5).all(axis=1)
    assert above.any()
    assert out_of_reach(local_problem(shut, spec, above)) == 0
    near = dataclasses.replace(spec, max_distance=60.0)
    assert out_of_reach(local_problem(shut, near, above)) > 0


def test_collectors_give_exits_back_where_places_would_be_out_of_reach(monkeypatch):
    kept = []
    count, solve = levels_module.out_of_reach, levels_module.solve_level

    def counted(problem):
        # the first collectors leave something out of reach
        return count(problem) + (kept == [0])

    def listened(problem, spec, seconds, progress, name, start=None, **options):
        if name == "collectors":
            kept.extend(4 - r.most for r in problem.requirements if r.kind == "number of exits")
        return solve(problem, spec, seconds, progress, name, start, **options)

    monkeypatch.setattr(levels_module, "out_of_reach", counted)
    monkeypatch.setattr(levels_module, "solve_level", listened)
    site = make_site(shapely.box(0, 0, 360, 288))
    plan = design_streets([site], Specification(exits=4, edge_length=72.0, time_limit=4.0)).plans[0]
    assert kept == [0, 2]
    assert 0 < len(places([plan], site.polygon.boundary)) <= 4


def test_collectors_in_hand_outlive_a_cancelled_second_attempt(monkeypatch):
    solve, calls = levels_module.solve_level, []

    def cancelled(problem, spec, seconds, progress, name, start=None, **options):
        calls.append(name)
        if calls.count("collectors") == 2:
            raise CancelledError("Cancelled.")
        return solve(problem, spec, seconds, progress, name, start, **options)

    monkeypatch.setattr(levels_module, "out_of_reach", lambda _: len(calls))
    monkeypatch.setattr(levels_module, "solve_level", cancelled)
    site = make_site(shapely.box(0, 0, 360, 288))
    plan = design_streets([site], Specification(exits=4, edge_length=72.0, time_limit=4.0)).plans[0]
    assert calls.count("collectors") == 2
    assert any(solved.level == COLLECTOR for solved in plan.network.solved)


def test_exits_that_are_needed_elsewhere_are_left():
    problem = paper_problem(grid(4, 4), "boundary")
    rim = np.flatnonzero(problem.mesh.boundary_vertices)
    count = ExitCount(tuple(rim.tolist()), 3, least=0)
    problem = dataclasses.replace(problem, requirements=(count,))

    def most(share, elsewhere):
        return share_of_exits(problem, share, elsewhere).requirements[0].most

    assert most(0.7, 0) == 3
    assert most(0.7, 1) == 2
    assert most(0.7, 5) == 0
    inner = np.flatnonzero(
        problem.candidate & problem.mesh.boundary_vertices[problem.mesh.edges].any(axis=1)
    )
    required = np.zeros_like(problem.required)
    required[inner[:2]] = True
    problem = dataclasses.replace(problem, required=required)
    assert exits_demanded(problem) == 2
    assert most(0.1, 5) == 2


def test_without_collectors_that_keep_to_the_limits_all_streets_are_local(monkeypatch):
    solve = levels_module.solve_level

    def failing(problem, spec, seconds, progress, name, start=None, **options):
        if name == "collectors":
            raise InfeasibleError("None.")
        return solve(problem, spec, seconds, progress, name, start, **options)

    monkeypatch.setattr(levels_module, "solve_level", failing)
    told = Told()
    site = make_site(shapely.box(0, 0, 360, 288))
    spec = Specification(exits=4, edge_length=72.0, time_limit=4.0)
    plan = design_streets([site], spec, progress=told).plans[0]
    assert {s.level for s in plan.segments} == {3}
    assert any("no collectors" in text for text in told.warnings)
    with pytest.raises(InfeasibleError):
        design_streets([site], dataclasses.replace(spec, exits=None))


class Told(Silent):
    """Keeps the warnings."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        self.warnings.append(text)
