"""Streets given by level: they stay where they are, and nothing is designed above them."""

from __future__ import annotations

import math
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.measure import validate_network
from platwright.mesh.grids import grid
from platwright.network.specification import Specification
from platwright.progress import Silent
from platwright.site import AccessPoint, BoundaryStreet, prepare_sites, site_layers
from platwright.streets import Wishes, design_streets, plan_layers
from shapely.geometry import LineString, Point, box

from .conftest import UTM, make_site

SITES = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "sites"
SPEC = Specification(time_limit=10)


class Warnings(Silent):
    def __init__(self) -> None:
        self.texts: list[str] = []

    def warn(self, text: str) -> None:
        self.texts.append(text)


def field(width=432.0, height=432.0, **more):
    """A site with a ring of streets on its edge."""
    ring = LineString(box(0, 0, width, height).exterior)
    return make_site(
        box(0, 0, width, height), streets=(BoundaryStreet(ring, "Ring Street"),), **more
    )


def designed(site, lines, spec=SPEC, progress=None, **more):
    wishes = Wishes(given=lines, **more)
    plan = design_streets([site], spec, wishes=wishes, progress=progress)
    return plan, plan_layers(plan)


def errors_of(layers, site, **more):
    report = validate_network(
        layers["streets"], site=gpd.GeoDataFrame(geometry=[site.polygon], crs=UTM), **more
    )
    wrong = report.problems[report.problems["severity"] == "error"]
    return wrong["text"].tolist()


def assert_in_place(streets, line, level, polygon):
    """The rows of a given street cover its course in the site and nothing else."""
    rows = streets[(streets["status"] == "given") & (streets["level"] == level)]
    wished = line.intersection(polygon)
    covered = shapely.union_all(rows.geometry.to_numpy())
    assert wished.difference(covered.buffer(0.01)).length < 0.1
    assert covered.buffer(0.01).intersection(wished).length == pytest.approx(wished.length, abs=0.1)
    return covered


MAJOR = LineString([(-60, 190), (200, 205), (500, 260)])


def test_a_major_road_cuts_the_site_and_stays_where_it_is():
    site = field()
    plan, layers = designed(site, {1: [MAJOR]})
    assert len(plan.plans) == 2
    assert sum(p.site.polygon.area for p in plan.plans) == pytest.approx(site.polygon.area)
    streets = layers["streets"]
    assert_in_place(streets, MAJOR, 1, site.polygon)
    own = streets[streets["status"] == "given"]
    assert set(own["level"]) == {1}
    assert set(own["level_name"]) == {"major"}
    assert set(own["speed_kmh"]) == {65.0}
    new = streets[streets["status"] == "new"]
    assert set(new["level"]) == {2, 3}
    # it is met, never crossed between junctions, nor run along
    road = MAJOR.intersection(site.polygon)
    for line in new.geometry:
        assert not line.crosses(road.buffer(0.001).boundary) or line.distance(road) < 0.01
        assert line.intersection(road.buffer(5)).length < 8
    assert errors_of(layers, site) == []
    # every street row exists once
    assert streets.geometry.to_wkb().is_unique
    assert len(layers["blocks"]) == sum(len(p.blocks) for p in plan.plans)
    assert layers["blocks"].area.sum() == pytest.approx(site.polygon.area, rel=1e-6)


def test_streets_go_on_across_a_given_street():
    site = field()
    _, layers = designed(site, {1: [LineString([(0, 216), (432, 216)])]})
    new = layers["streets"].query("status == 'new'")
    ends = [xy for line in new.geometry for xy in (line.coords[0], line.coords[-1])]
    on_road = [xy for xy in ends if abs(xy[1] - 216) < 0.01]
    both = {round(x) for x, _ in on_road}
    met_twice = [x for x in both if sum(abs(xy[0] - x) < 1 for xy in on_road) == 2]
    assert len(met_twice) >= 2
    # the junction is one row with all its streets
    spots = layers["junctions"]
    crossing = spots[[abs(p.y - 216) < 0.01 and round(p.x) in met_twice for p in spots.geometry]]
    assert len(crossing) == len(met_twice)
    assert set(crossing["valence"]) == {4}


def test_given_collectors_leave_only_local_streets_to_design():
    site = field()
    lines = [LineString([(0, 200), (432, 220)]), LineString([(230, -5), (210, 440)])]
    plan, layers = designed(site, {2: lines})
    assert len(plan.plans) == 4  # noded where they cross
    streets = layers["streets"]
    for line in lines:
        assert_in_place(streets, line, 2, site.polygon)
    assert set(streets[streets["status"] == "new"]["level"]) == {3}
    assert {s.level for p in plan.plans for s in p.network.solved} == {3}
    assert errors_of(layers, site) == []


def test_given_local_streets_leave_culs_de_sac():
    site = make_site(
        box(0, 0, 432, 300),
        frontage=[LineString([(0, 0), (432, 0)])],
        streets=(BoundaryStreet(LineString([(-20, 0), (450, 0)]), "South Street"),),
    )
    local = LineString([(216, 0), (216, 200)])
    said = Warnings()
    plan, layers = designed(site, {3: [local]}, progress=said)
    assert any("nothing is left to design" in text for text in said.texts)
    assert layers["streets"].query("status == 'new'").empty
    assert len(plan.plans) == 1
    spec = Specification(cul_de_sacs=True)
    plan, layers = designed(site, {3: [local]}, spec)
    new = layers["streets"].query("status == 'new'")
    assert len(new)
    assert set(new["level"]) == {4}
    assert all(np.isfinite(new["dist_to_sink_m"]))
    assert errors_of(layers, site) == []


def test_given_culs_de_sac_stand_for_those_that_would_be_designed():
    site = make_site(
        box(0, 0, 420, 75),
        frontage=[LineString([(0, 0), (420, 0)])],
        streets=(BoundaryStreet(LineString([(-50, 0), (470, 0)]), "South Street"),),
    )
    cul = LineString([(200, 0), (200, 45)])
    _, layers = designed(site, {4: [cul]}, Specification(cul_de_sacs=True))
    streets = layers["streets"]
    assert_in_place(streets, cul, 4, site.polygon)
    assert streets.query("status == 'new' and level == 4").empty


def test_several_levels_at_once_and_a_street_in_two_layers():
    site = field()
    major = LineString([(0, 216), (432, 216)])
    collector = LineString([(150, 0), (150, 432)])
    plan, layers = designed(site, {1: [major], 2: [collector, major]})
    streets = layers["streets"]
    assert_in_place(streets, major, 1, site.polygon)
    assert_in_place(streets, collector, 2, site.polygon)
    given_rows = streets[streets["status"] == "given"]
    assert given_rows.length.sum() == pytest.approx(864, abs=1.5)
    assert set(streets[streets["status"] == "new"]["level"]) <= {3}
    assert len(plan.plans) == 4
    assert errors_of(layers, site) == []


def test_an_end_just_short_of_the_edge_reaches_it():
    site = field()
    short = LineString([(6, 200), (425, 200)])
    plan, layers = designed(site, {1: [short]})
    assert len(plan.plans) == 2
    covered = assert_in_place(layers["streets"], short, 1, site.polygon)
    assert covered.length == pytest.approx(432, abs=0.1)


def test_a_street_that_ends_inside_divides_nothing_but_is_met():
    site = field()
    blind = LineString([(0, 216), (220, 216)])
    plan, layers = designed(site, {1: [blind]})
    assert len(plan.plans) == 1
    assert_in_place(layers["streets"], blind, 1, site.polygon)
    new = layers["streets"].query("status == 'new'")
    for line in new.geometry:
        assert line.intersection(blind.buffer(7)).length < 20
    assert errors_of(layers, site) == []


def test_given_streets_are_carried_on_to_the_centre_line():
    polygon = box(0, 0, 432, 432)
    ring = LineString(polygon.buffer(9, join_style="mitre").exterior)
    site = make_site(polygon, streets=(BoundaryStreet(ring, "Ring Street"),))
    _, layers = designed(site, {1: [LineString([(-40, 216), (480, 216)])]})
    own = shapely.line_merge(
        shapely.union_all(layers["streets"].query("status == 'given'").geometry.to_numpy())
    )
    assert own.bounds == pytest.approx((-9, 216, 441, 216), abs=0.01)


def test_streets_outside_are_left_out_with_a_word():
    site = field()
    away, along = LineString([(600, 0), (600, 432)]), LineString([(0, 1), (432, 1)])
    said = Warnings()
    plan, _ = designed(
        site,
        {1: [away, MAJOR, along]},
        progress=said,
        given_ids={1: ["a7", "b8", "c9"]},
        given_layers={1: "Arterials"},
    )
    assert any("Layer 'Arterials': features a7, c9 run outside" in text for text in said.texts)
    assert any("feature b8 runs beyond" in text and "cut off" in text for text in said.texts)
    assert len(plan.plans) == 2
    said = Warnings()
    plan, _ = designed(site, {1: [away]}, progress=said)
    assert any("all levels are designed" in text for text in said.texts)
    assert plan.plans[0].division is None
    assert {s.level for s in plan.plans[0].segments} == {2, 3}


def test_what_cannot_be_given_is_refused_by_name():
    site = field(obstacles=(box(180, 180, 240, 240),))
    with pytest.raises(InputError, match=r"Arterials.*feature x1.*through an obstacle"):
        designed(
            site,
            {1: [LineString([(0, 200), (432, 200)])]},
            given_ids={1: ["x1"]},
            given_layers={1: "Arterials"},
        )
    with pytest.raises(InputError, match="level 7 cannot be given"):
        designed(site, {7: [MAJOR]})
    with pytest.raises(InputError, match="no usable line"):
        designed(site, {1: [LineString([(0, 100), (math.inf, 100)])]})


@pytest.mark.parametrize("sinks", ["access", "points", "boundary"])
def test_whoever_reaches_a_given_street_has_arrived(sinks):
    points = (AccessPoint((0.0, 80.0), (0.0, 80.0), (1.0, 0.0), "Mill Lane"),)
    site = field(access=points)
    spec = Specification(sink_mode=sinks, time_limit=10)
    major = LineString([(0, 216), (432, 216)])
    wishes = Wishes(given={1: [major]}, sinks=[(144.0, 0.0)])
    plan = design_streets([site], spec, wishes=wishes)
    assert len(plan.plans) == 2
    for own in plan.plans:
        assert own.segments
        assert all(math.isfinite(s.dist_start) and math.isfinite(s.dist_end) for s in own.segments)
        at_major = [
            d
            for s in own.segments
            for xy, d in ((s.line.coords[0], s.dist_start), (s.line.coords[-1], s.dist_end))
            if abs(xy[1] - 216) < 0.01
        ]
        assert at_major
        assert set(at_major) == {0.0}


def test_required_streets_run_through_all_parts():
    site = field()
    wished = LineString([(144, 0), (144, 432)])
    major = LineString([(0, 216), (432, 216)])
    plan = design_streets(
        [site], SPEC, wishes=Wishes(given={1: [major]}, required=[wished], required_ids=["r"])
    )
    built = shapely.union_all([s.line for p in plan.plans for s in p.segments])
    assert wished.difference(built.buffer(12)).length < 30


def test_a_drawn_mesh_keeps_its_lines():
    site = field(288.0, 288.0)
    major = LineString([(0, 144), (288, 144)])
    plan = design_streets(
        [site], SPEC, wishes=Wishes(given={1: [major]}), mesh=lambda _: grid(4, 4, 72.0)
    )
    (own,) = plan.plans
    assert own.network.ground.street[~own.network.ground.mesh.boundary_edges].sum() == 4
    layers = plan_layers(plan)
    assert_in_place(layers["streets"], major, 1, site.polygon)
    new = layers["streets"].query("status == 'new'")
    assert all(line.intersection(major).length < 0.1 for line in new.geometry)
    assert errors_of(layers, site) == []


def test_a_narrow_strip_beside_a_given_street_is_a_block():
    site = field()
    plan, layers = designed(site, {1: [LineString([(0, 30), (432, 30)])]})
    assert len(plan.plans) == 2
    strip = plan.plans[1]
    assert strip.network.solved == ()
    assert len(strip.blocks) >= 1
    assert errors_of(layers, site) == []


def test_only_sites_with_given_streets_are_divided():
    first = field()
    second = make_site(
        box(1000, 0, 1432, 288), streets=(BoundaryStreet(LineString([(1000, 0), (1432, 0)])),)
    )
    wishes = Wishes(given={1: [MAJOR.intersection(first.polygon)]})
    plan = design_streets([first, second], SPEC, wishes=wishes)
    assert [len(group) for group in plan.by_site] == [2, 1]
    assert plan.plans[2].division is None


class CancelAfterParts(Silent):
    """Cancels once the second part begins."""

    def __init__(self) -> None:
        self.second = False

    def stage(self, text: str, fraction: float) -> None:
        self.second |= "part 2" in text and fraction > 0

    def cancelled(self) -> bool:
        return self.second


def test_a_cancelled_run_keeps_the_parts_that_are_finished():
    plan, layers = designed(field(), {1: [MAJOR]}, progress=CancelAfterParts())
    assert plan.stopped == "cancelled"
    assert plan.plans[0].segments
    assert plan.plans[1].segments == ()
    assert sum(b.polygon.area for p in plan.plans for b in p.blocks) == pytest.approx(432**2)
    assert (layers["streets"]["status"] == "given").any()

    class Cancelled(Silent):
        def cancelled(self) -> bool:
            return True

    with pytest.raises(CancelledError):
        designed(field(), {1: [MAJOR]}, progress=Cancelled())


@pytest.mark.slow
@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    level=st.integers(1, 3),
    first=st.floats(0.15, 0.85),
    last=st.floats(0.15, 0.85),
    upright=st.floats(0.2, 0.8),
    two=st.booleans(),
    blind=st.booleans(),
)
def test_any_given_streets_stay_and_the_rest_is_valid(level, first, last, upright, two, blind):
    site = field(400.0, 320.0)
    lines = [LineString([(-20, 320 * first), (420, 320 * last)])]
    if two:
        lines.append(LineString([(400 * upright, -30), (400 * (1 - upright), 350)]))
    spec = Specification(time_limit=4, cul_de_sacs=blind)
    _, layers = designed(site, {level: lines}, spec)
    streets = layers["streets"]
    for line in lines:
        assert_in_place(streets, line, level, site.polygon)
    new = streets[streets["status"] == "new"]
    assert (new["level"] > level).all()
    assert errors_of(layers, site) == []
    # scraps of less than a square metre are no blocks
    assert layers["blocks"].area.sum() == pytest.approx(400 * 320, abs=2.0)


def real_sites():
    return sorted(SITES.glob("*.gpkg")) or [None]


@pytest.mark.slow
@pytest.mark.parametrize("file", real_sites(), ids=lambda f: f.stem[:2] if f else "none")
def test_a_major_road_through_a_real_site(file):
    if file is None:
        pytest.skip("the real sites are not here")
    names = [name for name, _ in pyogrio.list_layers(file)]
    site, roads = (gpd.read_file(file, layer=name) for name in ("site", "streets"))
    obstacles = gpd.read_file(file, layer="obstacles") if "obstacles" in names else None
    prepared = prepare_sites(site, roads, obstacles)
    ground = prepared.sites[0]
    west, south, east, north = ground.polygon.bounds
    x, y = ground.polygon.representative_point().coords[0]
    # across the shorter way, where no obstacle is
    across = east - west > north - south
    for shift in np.linspace(-0.3, 0.3, 13):
        if across:
            at = x + shift * (east - west)
            line = LineString([(at, south - 50), (at + 20, north + 50)])
        else:
            at = y + shift * (north - south)
            line = LineString([(west - 50, at), (east + 50, at + 20)])
        inside = line.intersection(ground.polygon)
        if inside.length > 40 and inside.intersection(ground.obstacle_union).length == 0:
            break
    else:
        pytest.skip("obstacles everywhere")
    spec = Specification(time_limit=12, cul_de_sacs=True)
    plan = design_streets([ground], spec, wishes=Wishes(given={1: [line]}))
    layers, around = plan_layers(plan), site_layers(prepared)
    streets = layers["streets"].to_crs(ground.crs)
    own = shapely.union_all(streets[streets["status"] == "given"].geometry.to_numpy())
    assert inside.difference(own.buffer(0.05)).length < 0.5
    assert not (streets[streets["status"] == "new"]["level"] == 1).any()
    report = validate_network(
        layers["streets"],
        site=around["site"],
        obstacles=around["site_obstacles"],
        boundary_streets=around["boundary_streets"],
    )
    # what the check has to say of streets above and below is said without given streets, too
    wrong = report.problems[report.problems["severity"] == "error"].to_crs(ground.crs)
    blind = streets[(streets["status"] == "new") & (streets["level"] == 4)].geometry.to_numpy()
    here = shapely.union_all([own, *blind])
    assert wrong[wrong.distance(here) < 0.5]["text"].tolist() == []
    assert own.distance(Point(inside.centroid)) < 30


def test_a_street_over_a_slot_stays_on_its_course():
    slot = box(200, 0, 216, 150)
    polygon = box(0, 0, 432, 300).difference(slot)
    roads = (
        BoundaryStreet(LineString([(-20, -8), (450, -8)]), "South Street"),
        BoundaryStreet(LineString([(208, -8), (208, 140)]), "Slot Lane"),
    )
    site = make_site(polygon, frontage=[LineString([(0, 0), (200, 0)])], streets=roads)
    line = LineString([(0, 80), (432, 100)])
    _, layers = designed(site, {1: [line]})
    rows = layers["streets"].query("status == 'given'")
    built = shapely.union_all(rows.geometry.to_numpy())
    assert line.difference(built.buffer(0.01)).length < 0.1
    assert built.difference(line.buffer(0.01)).length < 0.1
    assert errors_of(layers, site) == []
