"""Whole plans on small sites, judged by what a planner would see."""

from __future__ import annotations

import dataclasses

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.measure import measure_plan, validate_network
from platwright.mesh.grids import grid
from platwright.network.checks.validation import check_design
from platwright.network.specification import FORBID, Specification
from platwright.progress import Silent
from platwright.site import AccessPoint, BoundaryStreet
from platwright.streets import Wishes, design_streets, plan_layers, sink_places, survey
from platwright.streets.program import along_walls
from shapely.geometry import LineString

from .conftest import UTM, make_site


def plan_of(site, wishes=None, **spec):
    return design_streets([site], Specification(**spec), wishes=wishes).plans[0]


@pytest.fixture(scope="module")
def square_plan(square):
    """The plan of the square with nothing asked; not to be changed."""
    return plan_of(square)


@pytest.fixture(scope="module")
def field_plan(field):
    """The plan of the field with nothing asked; not to be changed."""
    return plan_of(field)


def test_blocks_of_a_square_are_as_wide_as_asked(square_plan):
    plan = square_plan
    areas = [b.polygon.area for b in plan.blocks]
    assert sum(areas) == pytest.approx(288 * 288, rel=1e-6)
    for block in plan.blocks:
        assert block.width == pytest.approx(72, abs=6)
        assert block.length <= 150
    assert plan.network.stopped == "optimal"


def test_streets_of_a_square_run_straight_through(square_plan):
    for segment in square_plan.segments:
        ends = shapely.distance(*shapely.points(np.array(segment.line.coords)[[0, -1]]))
        assert segment.line.length == pytest.approx(ends, rel=1e-3)


def test_both_levels_are_used(square, square_plan):
    assert {s.level for s in square_plan.segments} == {2, 3}
    assert {s.level for s in plan_of(square, levels=1).segments} == {3}


def test_a_side_without_a_road_is_no_sink_and_gets_no_street_end(field_plan):
    plan = field_plan
    ground = plan.network.ground
    sinks = ground.mesh.vertices[ground.sinks]
    assert (sinks[:, 1] < 1e-6).all()
    ends = [s.line.coords[i] for s in plan.segments for i in (0, -1)]
    walls = shapely.LineString([(0, 0), (0, 288), (432, 288), (432, 0)])
    inner_walls = [c for c in ends if walls.distance(shapely.Point(c)) < 1 and c[1] > 1]
    assert inner_walls == []


def test_no_part_hangs_on_a_single_street(field_plan):
    ends = [s.line.coords[i] for s in field_plan.segments for i in (0, -1)]
    on_road = {c for c in ends if c[1] < 1}
    assert len(on_road) >= 2


def test_streets_are_carried_on_to_the_centre_line(field_plan):
    assert field_plan.connectors
    for line in (joint.line for joint in field_plan.connectors):
        assert line.coords[0][1] == pytest.approx(0, abs=1e-6)
        assert line.coords[-1][1] == pytest.approx(-8, abs=1e-6)


def test_an_arriving_street_is_continued():
    point = AccessPoint((100.0, 0.0), (100.0, -8.0), (0.0, 1.0), "Mill Lane")
    plan = plan_of(make_site(shapely.box(0, 0, 288, 288), access=(point,)))
    assert plan.continued == 1
    ends = [s.line.coords[i] for s in plan.segments for i in (0, -1)]
    assert any(shapely.Point(c).distance(shapely.Point(100, 0)) < 1e-6 for c in ends)


def test_no_street_runs_through_an_obstacle():
    pond = shapely.box(110, 110, 180, 175)
    plan = plan_of(make_site(shapely.box(0, 0, 288, 288), obstacles=(pond,)))
    assert all(s.line.intersection(pond).length <= 2.0 for s in plan.segments)


def test_a_required_street_is_built(square):
    wished = LineString([(0, 144), (288, 144)])
    plan = plan_of(square, wishes=Wishes(required=[wished]))
    streets = shapely.union_all([s.line for s in plan.segments]).buffer(15)
    assert wished.intersection(streets).length > 0.9 * wished.length


def test_no_street_crosses_a_forbidden_line(square):
    fence = LineString([(30, 40), (260, 40)])
    plan = plan_of(square, wishes=Wishes(forbidden=[fence]))
    assert not any(s.line.crosses(fence) for s in plan.segments)


def test_a_sink_outside_the_site_is_refused(square):
    with pytest.raises(InputError, match=r"Sinks.*lies 612 m outside"):
        plan_of(square, wishes=Wishes(sinks=[(900, 100)]), sink_mode="points")


def test_a_sink_on_an_obstacle_is_refused():
    site = make_site(shapely.box(0, 0, 288, 288), obstacles=(shapely.box(100, 100, 150, 150),))
    with pytest.raises(InputError, match="on an obstacle"):
        plan_of(site, wishes=Wishes(sinks=[(120, 120)]), sink_mode="points")


def test_a_required_street_in_an_obstacle_is_refused():
    site = make_site(shapely.box(0, 0, 288, 288), obstacles=(shapely.box(100, 100, 150, 150),))
    with pytest.raises(InputError, match="through an obstacle"):
        plan_of(site, wishes=Wishes(required=[LineString([(0, 120), (288, 120)])]))


def test_a_site_without_roads_has_no_sink():
    site = make_site(shapely.box(0, 0, 288, 288), frontage=[])
    with pytest.raises(InputError, match="there is no sink"):
        plan_of(site)
    assert plan_of(site, sink_mode="boundary").segments


def test_a_kept_street_inside_is_met_not_doubled():
    road = BoundaryStreet(LineString([(0, 150), (288, 150)]), "Old Road")
    plan = plan_of(make_site(shapely.box(0, 0, 288, 288), inner=(road,)))
    beside = shapely.box(20, 110, 268, 190)
    along = [
        s.line.intersection(beside) for s in plan.segments if s.line.intersection(beside).length > 1
    ]
    for line in along:
        x0, y0, x1, y1 = line.bounds
        assert y1 - y0 > x1 - x0, "a new street runs beside the kept one"


def test_the_same_seed_gives_the_same_plan(field):
    first, second = (plan_layers(design_streets([field], Specification())) for _ in range(2))
    for key in first:
        assert first[key].to_wkb().equals(second[key].to_wkb())


def test_distances_descend_to_the_sinks(field_plan):
    for s in field_plan.segments:
        assert abs(s.dist_start - s.dist_end) <= s.line.length + 1e-6
        assert s.direction == np.sign(round(s.dist_start - s.dist_end, 6))


def test_cancelled_before_anything(square):
    class Cancelled(Silent):
        def cancelled(self) -> bool:
            return True

    with pytest.raises(CancelledError):
        design_streets([square], Specification(), progress=Cancelled())


class CancelAfter(Silent):
    """Cancels at the n-th question."""

    def __init__(self, n: int) -> None:
        self.left = n

    def cancelled(self) -> bool:
        self.left -= 1
        return self.left < 0


@pytest.mark.slow
def test_a_cancelled_run_says_so_and_keeps_what_it_has():
    sites = [
        make_site(shapely.box(0, 0, 600, 500)),
        make_site(shapely.box(2000, 0, 2400, 300)),
    ]
    counter = CancelAfter(10**9)
    design_streets(sites, Specification(), progress=counter)
    asked = 10**9 - counter.left
    kept = 0
    for n in range(1, asked, max(1, asked // 12)):
        progress = CancelAfter(n)
        try:
            plan = design_streets(sites, Specification(), progress=progress)
        except CancelledError:
            assert kept == 0, "a later cancel lost what an earlier one kept"
            continue
        if progress.left >= 0:
            continue  # how often the search asks depends on the clock: this run was not cancelled
        kept += 1
        assert plan.stopped == "cancelled"
        assert plan.plans
    assert kept > 0


def test_one_bad_site_does_not_cost_the_others():
    good, tiny = make_site(shapely.box(0, 0, 420, 300)), make_site(shapely.box(900, 0, 915, 8))
    plan = design_streets([tiny, good], Specification())
    assert len(plan.plans) == 1
    problems = plan_layers(plan)["problems"]
    assert (problems["severity"] == "error").sum() == 1


def test_problems_of_a_site_are_told_by_its_own_wishes():
    sites = [make_site(shapely.box(x, 0, x + 420, 300)) for x in (0, 900)]
    own = {id(site): Specification(gap=gap) for site, gap in zip(sites, (0.01, 0.02))}
    plan = design_streets(sites, lambda site: own[id(site)])
    assert [one.specification for one in plan.plans] == list(own.values())
    small = Specification(block_width=20, block_length=30)
    mixed = [plan.plans[0], dataclasses.replace(plan.plans[1], specification=small)]
    problems = plan_layers(dataclasses.replace(plan, plans=tuple(mixed)))["problems"]
    told = problems[problems["problem"].str.contains("wished length is 30 m")]
    assert len(told) == len(plan.plans[1].blocks)
    assert (told.geometry.x > plan.plans[0].site.polygon.bounds[2]).all()


def test_required_streets_are_followed_closely(square):
    wished = LineString([(0, 130), (288, 160)])
    plan = plan_of(square, wishes=Wishes(required=[wished]))
    streets = shapely.union_all([s.line for s in plan.segments])
    assert max(streets.distance(wished.interpolate(d)) for d in range(0, 288, 12)) < 8


def test_allowed_dead_ends_are_culs_de_sac(field):
    plan = plan_of(field, dead_ends=0.0, weight_length=4.0)
    ends = [xy for s in plan.segments for xy in (s.line.coords[0], s.line.coords[-1])]
    for s in plan.segments:
        blind = [
            xy for xy in (s.line.coords[0], s.line.coords[-1]) if ends.count(xy) == 1 and xy[1] > 1
        ]
        assert (s.level == 4) == bool(blind)


def test_the_written_streets_cut_the_same_blocks_as_the_plan():
    # slanted sides: vertices of the mesh miss the edge by rounding
    site = make_site(shapely.Polygon([(0, 0), (411.3, 37.7), (389.1, 318.9), (-23.7, 291.3)]))
    design = design_streets([site], Specification())
    ground = gpd.GeoDataFrame(geometry=[site.polygon], crs=UTM)
    measured = measure_plan(plan_layers(design)["streets"], ground)
    assert measured.blocks == len(design.plans[0].blocks)


def test_blocks_are_cut_by_a_kept_street():
    road = BoundaryStreet(LineString([(210, 0), (210, 300)]), "Old Road")
    plan = plan_of(make_site(shapely.box(0, 0, 420, 300), inner=(road,)))
    for block in plan.blocks:
        assert block.polygon.intersection(road.line).length < 1 or not block.polygon.buffer(
            -0.1
        ).intersects(road.line)


def test_the_rules_as_in_the_paper(square):
    plan = plan_of(square, rules="paper", gap=0.3, time_limit=10)
    for solved in plan.network.solved:
        assert check_design(solved.problem, solved.design.active) == []
    assert {s.level for s in plan.segments} <= {2, 3}


@st.composite
def outlines(draw):
    """Quadrilaterals and L-shapes of 2 to 12 ha."""
    w, h = draw(st.integers(150, 400)), draw(st.integers(150, 300))
    jitter = [draw(st.integers(-20, 20)) for _ in range(8)]
    corners = [(0, 0), (w, 0), (w, h), (0, h)]
    moved = [(x + jitter[2 * i], y + jitter[2 * i + 1]) for i, (x, y) in enumerate(corners)]
    polygon = shapely.Polygon(moved)
    if draw(st.booleans()):
        polygon = polygon.difference(shapely.box(w * 0.6, h * 0.6, w + 50, h + 50))
    return polygon


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    outlines(),
    st.sampled_from([0.0, 0.2]),
    st.sampled_from([FORBID, 0.0]),
    st.sampled_from(["streets", "boundary"]),
)
def test_every_design_passes_the_independent_check(outline, distance, dead_ends, sinks):
    site = make_site(outline)
    spec = Specification(
        weight_distance=distance, dead_ends=dead_ends, sink_mode=sinks, time_limit=4
    )
    design = design_streets([site], spec)
    plan = design.plans[0]
    for solved in plan.network.solved:
        violations = check_design(solved.problem, solved.design.active)
        assert [v for v in violations if v.hard] == []
        assert solved.design.bound <= solved.design.objective + 1e-6
    assert sum(b.polygon.area for b in plan.blocks) == pytest.approx(outline.area, rel=1e-3)
    layers = plan_layers(design)
    report = validate_network(
        layers["streets"],
        site=gpd.GeoDataFrame(geometry=[outline], crs=UTM),
        dead_ends=dead_ends,
    )
    wrong = report.problems[report.problems["severity"] == "error"]
    assert wrong["text"].tolist() == []


def test_a_street_along_a_wall_is_dear_where_no_house_fits_between():
    mesh = grid(2, 3, h=72.0)
    narrow = mesh.vertices.copy()
    narrow[:, 0] = np.where(narrow[:, 0] > 72, 102, narrow[:, 0])  # second column 30 m wide
    mesh = dataclasses.replace(mesh, vertices=narrow)
    west = LineString([(0, 0), (0, 216)])
    site = make_site(shapely.box(0, 0, 102, 216), frontage=[west])
    factor = along_walls(survey(site, mesh, Specification()), 72.0)
    middle = [mesh.vertices[pair, 0].tolist() == [72, 72] for pair in mesh.edges]
    assert (factor[middle] == 2.5).all()
    assert (factor[~np.array(middle)] == 1.0).all()
    ring = make_site(shapely.box(0, 0, 102, 216))
    assert (along_walls(survey(ring, mesh, Specification()), 72.0) == 1.0).all()


def test_a_site_with_one_way_in_gets_a_cul_de_sac_instead_of_nothing():
    mouth = LineString([(0, 0), (110, 0)])
    site = make_site(
        shapely.box(0, 0, 110, 500),
        frontage=[mouth],
        streets=(BoundaryStreet(mouth, "Quay Street"),),
    )
    said = Warnings()
    plan = design_streets([site], Specification(), progress=said).plans[0]
    assert sum(s.line.length for s in plan.segments) > 250
    assert {s.level for s in plan.segments} >= {4}
    assert any("culs-de-sac" in text for text in said.texts)


class Warnings(Silent):
    def __init__(self) -> None:
        self.texts: list[str] = []

    def warn(self, text: str) -> None:
        self.texts.append(text)


def test_streets_leave_at_the_given_exits_or_it_is_said():
    given = [(0.0, 85.0), (288.0, 190.0), (110.0, 0.0)]
    site = make_site(shapely.box(0, 0, 288, 288), frontage=[])  # walls all round
    design = design_streets([site], Specification(sink_mode="points"), wishes=Wishes(sinks=given))
    ends = [xy for s in design.plans[0].segments for xy in (s.line.coords[0], s.line.coords[-1])]
    problems = plan_layers(design)["problems"]
    said = problems[problems["problem"].str.contains("from the exit given")].geometry.tolist()
    met = [min(np.hypot(*(np.array(ends) - xy).T)) < 5 for xy in given]
    assert any(met)
    assert [shapely.Point(xy) for xy, there in zip(given, met) if not there] == said


@pytest.mark.parametrize("at", [30.0, 110.0, 144.0, 200.0])
def test_an_exit_along_an_existing_street_is_reached_over_it(at):
    """No new street need end there: whoever comes to the street goes on along it."""
    ring = LineString(shapely.box(0, 0, 288, 288).exterior)
    site = make_site(shapely.box(0, 0, 288, 288), streets=(BoundaryStreet(ring, "Ring"),))
    exits = Wishes(sinks=[(0.0, at)])
    design = design_streets([site], Specification(sink_mode="points"), wishes=exits)
    mean = design.numbers["MEAN_DISTANCE"]
    assert 0.0 < mean < 600.0
    layers = plan_layers(design)
    away = layers["junctions"]["dist_to_sink_m"]
    assert np.isfinite(away).all()
    # along the ring at least: no junction is nearer than as the crow flies
    straight = shapely.distance(layers["junctions"].geometry.array, shapely.Point(0.0, at))
    assert (away >= straight - 45.0).all()


def test_an_exit_that_no_corner_of_a_block_is_near_is_named(square):
    given = [(144.0, 110.0)]  # well inside: nothing is drawn to it
    plan = design_streets(
        [square], Specification(sink_mode="points", edge_length=72.0), wishes=Wishes(sinks=given)
    )
    problems = plan_layers(plan)["problems"]
    named = problems[problems["problem"].str.contains("from the exit given here")]
    assert len(named) == 1
    assert named.geometry.iloc[0].coords[0] == given[0]


def test_no_street_ends_beyond_the_street_along_the_edge():
    short = LineString([(0, 0), (165, 0)])  # the mesh edge from 144 to 216 m is half along it
    site = make_site(
        shapely.box(0, 0, 432, 288),
        frontage=[short, LineString([(0, 288), (0, 0)])],
        streets=(BoundaryStreet(LineString([(-50, -8), (165, -8)]), "South Street"),),
    )
    for segment in plan_of(site).segments:
        for xy in (segment.line.coords[0], segment.line.coords[-1]):
            if xy[1] < 1:
                assert xy[0] <= 165 + 6


def test_a_site_that_obstacles_cut_off_says_so():
    site = make_site(
        shapely.box(0, 0, 288, 288),
        frontage=[LineString([(0, 0), (288, 0)])],
        streets=(BoundaryStreet(LineString([(0, 0), (288, 0)]), "South Street"),),
        obstacles=(shapely.box(0, 8, 288, 24),),
    )
    said = Warnings()
    design_streets([site], Specification(), progress=said)
    assert any("cut the site off" in text for text in said.texts)


def test_few_roads_along_the_edge_are_remarked(field, square):
    said = Warnings()
    design_streets([square], Specification(), progress=said)
    assert said.texts == []
    design_streets([field], Specification(), progress=said)
    assert ["30 % of its edge" in text for text in said.texts] == [True]
    quiet = Warnings()
    design_streets([field], Specification(sink_mode="boundary"), progress=quiet)
    assert quiet.texts == []


@pytest.mark.parametrize("inset", [0.0, 12.0])
def test_distances_to_access_points_agree_with_the_check(inset):
    polygon = shapely.box(0, 0, 430, 290).difference(shapely.box(300, 200, 500, 500))
    ring = LineString(polygon.buffer(inset, join_style="mitre").exterior) if inset else None
    ring = ring or LineString(polygon.exterior)
    points = tuple(
        AccessPoint(xy, (xy[0] - way[0] * inset, xy[1] - way[1] * inset), way, f"Lane {i}")
        for i, (xy, way) in enumerate(
            [((0.0, 140.0), (1.0, 0.0)), ((215.0, 0.0), (0.0, 1.0)), ((333.0, 200.0), (0.0, -1.0))]
        )
    )
    site = make_site(polygon, access=points, streets=(BoundaryStreet(ring, "Ring"),))
    design = design_streets([site], Specification(sink_mode="access"))
    places = sink_places(design.plans[0].network.ground)
    report = validate_network(
        plan_layers(design)["streets"],
        site=gpd.GeoDataFrame(geometry=[polygon], crs=UTM),
        boundary_streets=gpd.GeoDataFrame(geometry=[ring], crs=UTM),
        sinks=gpd.GeoDataFrame(geometry=gpd.points_from_xy(*places.T), crs=UTM),
    )
    wrong = report.problems[report.problems["severity"] == "error"]
    assert wrong["text"].tolist() == []
    assert any(s.dist_start > 50 for s in design.plans[0].segments)


def test_a_whole_municipality_is_refused_at_once():
    site = make_site(shapely.box(0, 0, 4200, 4200))  # 1764 ha
    with pytest.raises(InputError, match="1764 ha"):
        design_streets([site], Specification())


def test_a_kept_street_inside_carries_an_arriving_one_on():
    lane = LineString([(144, -60), (144, 0)])
    inner = BoundaryStreet(LineString([(144, 0), (144, 288)]), "Mill Lane")
    point = AccessPoint((144.0, 0.0), (144.0, 0.0), (0.0, 1.0), "Mill Lane")
    site = make_site(
        shapely.box(0, 0, 288, 288),
        access=(point,),
        streets=(BoundaryStreet(lane, "Mill Lane"),),
        inner=(inner,),
    )
    design = design_streets([site], Specification())
    assert design.plans[0].not_continued == []
    problems = plan_layers(design)["problems"]
    assert not any("not continued" in text for text in problems["problem"])
