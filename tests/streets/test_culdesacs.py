"""Culs-de-sac, judged by geometry that knows nothing of how they were found."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.measure import validate_network
from platwright.network.level_settings import LevelSettings
from platwright.network.specification import Specification
from platwright.site import AccessPoint, BoundaryStreet, prepare_sites, site_layers
from platwright.streets import design_streets, plan_layers
from platwright.streets.blocks import Block, block_size
from platwright.streets.cross_streets import Surroundings
from platwright.streets.culdesacs import culs_de_sac, served
from shapely.geometry import LineString, Point, Polygon, box

from .conftest import UTM, make_site

SPEC = Specification(cul_de_sacs=True)
NOTHING = shapely.Polygon()
SITES = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "sites"


def block(polygon: Polygon) -> Block:
    return Block(polygon, *block_size(polygon))


def found_in(polygon, streets, *, blocked=NOTHING, ends=(), arrivals=(), spec=SPEC):
    around = Surroundings(streets, np.array(ends).reshape(-1, 2), arrivals, blocked)
    return culs_de_sac([block(polygon)], spec, around)


def mean_depth(polygon: Polygon, streets) -> float:
    """Mean distance of the ground from streets, by random points."""
    west, south, east, north = polygon.bounds
    draw = np.random.default_rng(7)
    x, y = draw.uniform(west, east, 4000), draw.uniform(south, north, 4000)
    inside = shapely.contains_xy(polygon, x, y)
    return float(shapely.distance(shapely.points(x, y)[inside], streets).mean())


def assert_sound(polygon, streets, found, *, blocked=NOTHING, spec=SPEC):
    """What every planner would ask of culs-de-sac, whatever the block."""
    built = streets
    for street in found:
        line = street.line
        start, end = Point(line.coords[0]), Point(line.coords[-1])
        assert street.blind
        assert len(line.coords) == 2
        assert polygon.buffer(0.2).covers(line)
        assert streets.distance(start) < 0.15
        assert 0.4 * spec.block_width < line.length <= spec.cul_de_sac_length + 1e-6
        # a plot fits between the blind end and any street or wall
        assert end.distance(polygon.boundary) >= 0.34 * spec.block_width
        assert end.distance(built) >= 0.34 * spec.block_width
        if not blocked.is_empty:
            assert line.distance(blocked) >= 4.0 - 1e-6
            assert end.distance(blocked) >= spec.turning_radius
        built = shapely.union(built, line)
    for i, one in enumerate(found):
        for other in found[:i]:
            assert not one.line.intersects(other.line)


def test_the_back_row_along_a_wall_is_served():
    ground = box(0, 0, 200, 72)
    street = LineString([(-50, 0), (250, 0)])
    found = found_in(ground, street)
    assert_sound(ground, street, found)
    assert len(found) == 2
    for cul in found:
        (x0, y0), (x1, y1) = cul.line.coords
        assert x0 == pytest.approx(x1, abs=0.1)
        assert y0 == pytest.approx(0, abs=0.1)
        assert 72 - y1 >= 25
    assert abs(found[0].line.coords[0][0] - found[1].line.coords[0][0]) >= 55


def test_an_arm_narrower_than_a_block_gets_one_along_its_middle():
    arm = box(0, 0, 66, 190)
    street = LineString([(-50, 0), (116, 0)])
    (cul,) = found_in(arm, street)
    (x0, _), (x1, y1) = cul.line.coords
    assert x0 == pytest.approx(33, abs=2.5)
    assert x1 == pytest.approx(33, abs=2.5)
    assert 120 <= y1 <= 150


def test_a_block_as_wide_as_asked_gets_none():
    for size in ((150, 72), (150, 79), (100, 100), (110, 95)):
        ground = box(0, 0, *size)
        assert found_in(ground, LineString(ground.exterior)) == []


def test_a_block_twice_as_wide_gets_one_into_its_middle():
    ground = box(0, 0, 150, 150)
    ring = LineString(ground.exterior)
    found = found_in(ground, ring)
    assert found
    assert_sound(ground, ring, found)
    # a block of usual width is left on both sides
    for cul in found:
        (x0, y0), (_, y1) = cul.line.coords
        side = (y0, 150 - y0) if abs(y0 - y1) < 1 else (x0, 150 - x0)
        assert min(side) >= 55


def test_without_a_street_there_is_none():
    assert found_in(box(0, 0, 200, 200), NOTHING) == []


def test_obstacles_are_passed_with_room_to_turn():
    ground = box(0, 0, 300, 72)
    street = LineString([(-50, 0), (350, 0)])
    shed = box(80, 25, 130, 60)
    found = found_in(ground, street, blocked=shed)
    assert found
    assert_sound(ground, street, found, blocked=shed)


@pytest.mark.parametrize("height", [22.0, 25.5, 30.0])
def test_a_corner_between_two_samples_is_seen(height):
    ground, street = box(0, 0, 66, 190), LineString([(-50, 0), (116, 0)])
    needle = Polygon([(0, height - 0.5), (30.1, height), (0, height + 0.5)])
    found = found_in(ground, street, blocked=needle)
    assert_sound(ground, street, found, blocked=needle)


def test_a_longest_length_is_kept():
    arm = box(0, 0, 66, 400)
    street = LineString([(-50, 0), (116, 0)])
    for longest in (60.0, 90.0, 200.0):
        spec = dataclasses.replace(SPEC, cul_de_sac_length=longest)
        (cul,) = found_in(arm, street, spec=spec)
        assert longest - 5 < cul.line.length <= longest


def test_the_range_of_the_level_decides_what_is_deep():
    ground = box(0, 0, 200, 72)
    street = LineString([(-50, 0), (250, 0)])
    near = dataclasses.replace(SPEC, level_settings={4: LevelSettings(coverage=75.0)})
    assert found_in(ground, street, spec=near) == []
    dear = dataclasses.replace(SPEC, level_settings={4: LevelSettings(weight_length=50.0)})
    assert found_in(ground, street, spec=dear) == []


def test_a_street_that_arrives_goes_on_as_a_cul_de_sac():
    ground = box(0, 0, 130, 72)
    street = LineString([(0, 0), (130, 0)])
    point = AccessPoint((70.0, 0.0), (70.0, -8.0), (0.0, 1.0), "Mill Lane")
    (cul,) = found_in(ground, street, arrivals=(point,))
    assert cul.arrival is point
    assert cul.line.coords[0] == pytest.approx((70, 0), abs=0.01)


def test_served_places_lie_within_reach():
    (cul,) = found_in(box(0, 0, 66, 190), LineString([(-50, 0), (116, 0)]))
    places = np.array([[33.0, 100.0], [33.0, 189.0], [33.0, 1000.0]])
    gaps = [cul.line.distance(Point(xy)) for xy in places]
    assert served(places, [cul], SPEC).tolist() == [gap <= 0.55 * 72 for gap in gaps]
    assert not served(places, [], SPEC).any()


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    width=st.floats(60, 400),
    height=st.floats(50, 300),
    lean=st.floats(-0.4, 0.4),
    taper=st.floats(0.5, 1.0),
    turn=st.floats(0, 360),
    sides=st.integers(1, 4),
    shed=st.booleans(),
)
def test_any_block_gets_sound_ones(width, height, lean, taper, turn, sides, shed):
    outline = Polygon(
        [(0, 0), (width, 0), (width + lean * height, taper * height), (lean * height, height)]
    )
    outline = shapely.affinity.rotate(outline, turn, origin=(0, 0))
    corners = shapely.get_coordinates(outline)
    streets = LineString(corners[: sides + 1])
    blocked = outline.centroid.buffer(12) if shed else NOTHING
    found = found_in(outline, streets, blocked=blocked)
    assert_sound(outline, streets, found, blocked=blocked)
    if found:
        built = shapely.union_all([streets, *(c.line for c in found)])
        assert mean_depth(outline, built) < mean_depth(outline, streets) - 0.5


def strip_site():
    """A street along one long side, walls on the others: 2.5 blocks deep."""
    south = LineString([(0, 0), (420, 0)])
    return make_site(
        box(0, 0, 420, 75),
        frontage=[south],
        streets=(BoundaryStreet(LineString([(-50, -8), (470, -8)]), "South Street"),),
    )


def test_a_plan_with_culs_de_sac_is_labelled_joined_and_valid():
    site = strip_site()
    design = design_streets([site], SPEC)
    layers = plan_layers(design)
    new = layers["streets"].query("status == 'new'")
    blind = new[new["level"] == 4]
    assert len(blind) >= 3
    assert set(blind["level_name"]) == {"cul-de-sac"}
    assert set(blind["speed_kmh"]) == {20.0}
    assert set(blind["turning_m"]) == {9.0}
    assert new[new["level"] != 4]["turning_m"].isna().all()
    # each is carried on to the centre line outside
    links = layers["streets"].query("status == 'connector' and level == 4")
    assert len(links) == len(blind)
    for line in links.geometry:
        assert line.coords[-1][1] == pytest.approx(-8, abs=1e-6)
    ends = layers["junctions"].query("kind == 'dead end'")
    assert len(ends) == len(blind)
    for row in blind.itertuples():
        assert {round(row.dist_start_m, 3), round(row.dist_end_m, 3)} == {
            0.0,
            round(row.length_m, 3),
        }
    report = validate_network(
        layers["streets"], site=gpd.GeoDataFrame(geometry=[site.polygon], crs=UTM)
    )
    assert report.violations == 0, report.problems["text"].tolist()


def test_without_the_wish_there_is_no_cul_de_sac():
    plan = design_streets([strip_site()], Specification())
    assert not (plan_layers(plan)["streets"]["level"] == 4).any()


def test_no_turning_circle_where_none_is_asked():
    plan = design_streets([strip_site()], dataclasses.replace(SPEC, turning_radius=0.0))
    assert plan_layers(plan)["streets"]["turning_m"].isna().all()


def test_a_dead_end_site_keeps_its_network_and_its_culs_de_sac():
    mouth = LineString([(0, 0), (110, 0)])
    site = make_site(
        box(0, 0, 110, 500), frontage=[mouth], streets=(BoundaryStreet(mouth, "Quay Street"),)
    )
    plan = design_streets([site], SPEC).plans[0]
    assert sum(s.line.length for s in plan.segments) > 250
    assert {s.level for s in plan.segments} >= {4}
    for segment in plan.segments:
        assert segment.blind <= (segment.level == 4)


@pytest.mark.slow
def test_culs_de_sac_of_the_paper_are_a_level_of_their_own():
    south = LineString([(0, 0), (300, 0)])
    site = make_site(
        box(0, 0, 300, 260),
        frontage=[south],
        streets=(BoundaryStreet(LineString([(-50, 0), (350, 0)]), "South Street"),),
    )
    spec = Specification(
        rules="paper",
        levels=1,
        cul_de_sacs=True,
        time_limit=20,
        level_settings={3: LevelSettings(coverage=4), 4: LevelSettings(time_share=0.9)},
    )
    plan = design_streets([site], spec)
    own = plan.plans[0]
    assert {s.level for s in own.network.solved} == {3, 4}
    assert own.network.ground.mesh.edge_length == pytest.approx(12.0)
    graph_ends = [xy for s in own.segments for xy in (s.line.coords[0], s.line.coords[-1])]
    for segment in own.segments:
        tips = [
            xy
            for xy in (segment.line.coords[0], segment.line.coords[-1])
            if graph_ends.count(xy) == 1 and xy[1] > 1
        ]
        assert not tips or segment.level == 4
    layers = plan_layers(plan)
    report = validate_network(
        layers["streets"],
        site=gpd.GeoDataFrame(geometry=[site.polygon], crs=UTM),
        boundary_streets=gpd.GeoDataFrame(geometry=[south], crs=UTM),
    )
    errors = report.problems[report.problems["severity"] == "error"]
    assert errors["text"].tolist() == []


def real_sites():
    return sorted(SITES.glob("*.gpkg")) or [None]


@pytest.mark.slow
@pytest.mark.parametrize("file", real_sites(), ids=lambda f: f.stem[:2] if f else "none")
def test_culs_de_sac_of_real_sites_are_sound(file):
    if file is None:
        pytest.skip("the real sites are not here")
    names = [name for name, _ in pyogrio.list_layers(file)]
    site, roads = (gpd.read_file(file, layer=name) for name in ("site", "streets"))
    obstacles = gpd.read_file(file, layer="obstacles") if "obstacles" in names else None
    prepared = prepare_sites(site, roads, obstacles)
    plan = design_streets(prepared.sites, dataclasses.replace(SPEC, time_limit=12.0))
    layers, around = plan_layers(plan), site_layers(prepared)
    report = validate_network(
        layers["streets"],
        site=around["site"],
        obstacles=around["site_obstacles"],
        boundary_streets=around["boundary_streets"],
    )
    wrong = report.problems[report.problems["severity"] == "error"]
    assert wrong["text"].tolist() == []
    for own in plan.plans:
        culs = [c for c in own.cross_streets if c.blind]
        lines = [c.line for c in culs]
        others = [s.line for s in own.segments if not s.blind]
        for cul in culs:
            end = Point(cul.line.coords[-1])
            assert own.site.polygon.boundary.distance(end) >= 0.34 * 72
            rest = [*others, *(line for line in lines if line is not cul.line)]
            assert min((line.distance(end) for line in rest), default=math.inf) >= 0.34 * 72
            assert cul.line.distance(own.site.obstacle_union) >= 4 - 1e-6 or not own.site.obstacles
