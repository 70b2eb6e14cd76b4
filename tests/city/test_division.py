"""Major roads cut a municipality; what a planner would call street space is no sub-region."""

from __future__ import annotations

import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.city import CityRules, divide_city
from platwright.errors import InputError
from shapely.geometry import Point, box

sys.path.insert(0, str(Path(__file__).parent))
from towns import X, Y, cross_town, ground, lines


def test_a_crossing_makes_four_sub_regions_from_north_to_south():
    city = divide_city(*cross_town())
    assert [r.number for r in city.regions] == [1, 2, 3, 4]
    assert [round(r.polygon.area) for r in city.regions] == [120_000] * 4
    corners = [(r.polygon.bounds[0] - X, r.polygon.bounds[1] - Y) for r in city.regions]
    assert np.round(corners, 1).tolist() == [[0, 300], [400, 300], [0, 0], [400, 0]]
    assert all(r.state == "design" for r in city.regions)
    # two sides of each lie on roads, the others on the edge of the municipality
    assert [round(r.frontage.length) for r in city.regions] == [700] * 4


def test_the_order_of_the_layer_and_its_crs_change_nothing():
    town, roads = cross_town()
    city = divide_city(town, roads)
    other = divide_city(town, roads.iloc[::-1].to_crs(25832))
    assert len(other.regions) == 4
    for a, b in zip(city.regions, other.regions):
        assert shapely.hausdorff_distance(a.polygon, b.polygon) < 0.1
    places = [sorted(xy for own in c.junctions for xy in own.sides.values()) for c in (city, other)]
    assert np.allclose(*places, atol=0.1)


def test_a_level_divides_where_there_is_no_class():
    town, roads = cross_town()
    levels = roads.assign(level=[1, 1, 3, 3]).drop(columns="highway")
    assert len(divide_city(town, levels).regions) == 4
    assert len(divide_city(town, levels.assign(level=[1, 2, 3, 3])).regions) == 2


def test_chosen_classes_divide():
    town, roads = cross_town()
    rules = CityRules(classes=("primary",))
    assert len(divide_city(town, roads, rules=rules).regions) == 2


def test_a_road_layer_without_major_roads_is_refused_by_name():
    town, roads = cross_town()
    with pytest.raises(InputError, match=r"Layer 'Streets'.*primary.*level"):
        divide_city(town, roads.assign(highway="residential"), road_layer="Streets")


def test_two_carriageways_leave_street_space_and_junctions_straight_across():
    roads = lines([
        ("primary", [(0, 290), (900, 290)]),
        ("primary", [(900, 310), (0, 310)]),
    ])  # fmt: skip
    city = divide_city(ground(900, 600), roads)
    assert [round(r.polygon.area) for r in city.regions] == [261_000, 261_000]
    assert city.street_space.area == pytest.approx(18_000, abs=1)
    assert city.junctions
    for junction in city.junctions:
        (xa, ya), (xb, yb) = junction.sides[1], junction.sides[2]
        assert (ya - Y, yb - Y) == pytest.approx((310, 290), abs=0.02)
        assert xa == pytest.approx(xb, abs=0.02)


def test_roundabouts_are_street_space():
    ring = shapely.get_coordinates(Point(400, 300).buffer(14).exterior)
    roads = lines([
        ("primary", [(0, 300), (386, 300)]),
        ("primary", [(414, 300), (800, 300)]),
        ("primary", [(400, 0), (400, 286)]),
        ("primary", [(400, 314), (400, 600)]),
        ("primary", ring.tolist()),
    ])  # fmt: skip
    city = divide_city(ground(800, 600), roads)
    assert len(city.regions) == 4
    assert city.street_space.area == pytest.approx(Point(0, 0).buffer(14).area, rel=0.01)


def test_nobody_enters_from_a_motorway():
    roads = lines([("motorway", [(0, 300), (800, 300)]), ("primary", [(400, 0), (400, 600)])])
    city = divide_city(ground(800, 600), roads)
    assert len(city.regions) == 4
    for region in city.regions:
        assert region.frontage.length == pytest.approx(300, abs=1)
        assert all(street.kind == "primary" for street in region.beside)
    places = [xy for own in city.junctions for xy in own.sides.values()]
    assert all(x == pytest.approx(X + 400, abs=0.02) for x, _ in places)


def test_ground_that_only_motorways_surround_is_left_with_the_reason():
    roads = lines([
        ("motorway", [(200, 0), (200, 600)]),
        ("motorway", [(500, 0), (500, 600)]),
        ("primary", [(700, 0), (700, 600)]),
    ])  # fmt: skip
    city = divide_city(ground(900, 600), roads)
    states = {round(r.polygon.bounds[0] - X): (r.state, r.reason) for r in city.regions}
    assert states[200] == ("left", "no road that gives access runs along it")
    assert states[500][0] == states[700][0] == "design"
    assert "no road that gives access" in " ".join(city.problems["problem"])


def test_small_ground_stays_as_it_is_and_is_told():
    town, roads = cross_town()
    more = lines([("primary", [(0, 520), (60, 520), (60, 600)])])
    city = divide_city(town, pd.concat([roads, more], ignore_index=True))
    small = [r for r in city.regions if r.state == "left"]
    assert [round(r.polygon.area) for r in small] == [4800]
    assert "smaller than 1 ha" in small[0].reason
    assert any("smaller than 1 ha" in text for text in city.problems["problem"])


def test_a_river_parts_the_ground_and_is_kept_free():
    town, roads = cross_town()
    river = gpd.GeoDataFrame(geometry=[box(X, Y + 400, X + 800, Y + 430)], crs=32632)
    pond = gpd.GeoDataFrame(geometry=[box(X + 100, Y + 100, X + 130, Y + 130)], crs=32632)
    city = divide_city(town, roads, pd.concat([river, pond], ignore_index=True))
    assert sum(r.polygon.area for r in city.regions) == pytest.approx(480_000 - 24_000, rel=1e-4)
    assert len(city.regions) == 6
    assert [sum(o.area for o in r.obstacles) for r in city.regions].count(pytest.approx(900)) == 1
    # no road runs along the far bank: the crossing road does
    assert all(r.state == "design" for r in city.regions)


def test_ground_too_large_is_cut_by_new_collectors():
    roads = lines([("primary", [(0, 500), (2000, 500)])])
    city = divide_city(ground(2000, 1000), roads, rules=CityRules(most_ha=60))
    assert len(city.regions) == 4
    assert max(r.polygon.area for r in city.regions) <= 600_000
    cuts = [road for road in city.roads if road.new]
    assert sorted(round(road.line.length) for road in cuts) == [500, 500]
    assert all(road.level == 2 for road in cuts)
    # both sides of each cut are given the same junctions
    for cut in cuts:
        here = [j for j in city.junctions for xy in j.sides.values()
                if cut.line.distance(Point(xy)) < 0.1]  # fmt: skip
        assert here
        assert all(len(j.sides) == 2 for j in here)


def test_junctions_of_today_come_first_and_gaps_are_filled():
    city = divide_city(*cross_town(), rules=CityRules(spacing=100.0))
    by_kind = {
        kind: sorted(
            tuple(np.round(np.subtract(xy, (X, Y)), 1))
            for j in city.junctions if j.kind == kind for xy in set(j.sides.values())
        )
        for kind in ("existing", "planned")
    }  # fmt: skip
    assert by_kind["existing"] == [(210.0, 300.0), (600.0, 300.0)]
    west = [x for x, y in by_kind["planned"] if y == 300.0 and x < 400]
    assert west == pytest.approx([105, 305])
    for junction in city.junctions:
        assert len(junction.sides) == 2
        assert len(set(junction.sides.values())) == 1


def test_junctions_keep_their_distance():
    rules = CityRules(spacing=180.0)
    city = divide_city(*cross_town(), rules=rules)
    places = np.array([xy for j in city.junctions for xy in set(j.sides.values())])
    gaps = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    np.fill_diagonal(gaps, np.inf)
    assert gaps.min() > 0.44 * rules.spacing


@settings(max_examples=25)
@given(
    st.lists(st.integers(150, 1850), min_size=1, max_size=4, unique=True),
    st.lists(st.integers(150, 1050), min_size=0, max_size=3, unique=True),
    st.floats(-0.2, 0.2),
)
def test_sub_regions_and_street_space_tile_the_ground(across, along, slope):
    rows = [("primary", [(x, 0), (x + slope * 600, 1200)]) for x in across]
    rows += [("secondary", [(0, y), (2000, y)]) for y in along]
    town = ground(2000, 1200)
    city = divide_city(town, lines(rows))
    shapes = [r.polygon for r in city.regions]
    whole = shapely.union_all([*shapes, city.street_space])
    assert sum(s.area for s in shapes) + city.street_space.area == pytest.approx(2.4e6, rel=1e-4)
    assert whole.area == pytest.approx(2.4e6, rel=1e-4)
    assert all(s.area <= 600_001 for s in shapes)
    for junction in city.junctions:
        for number, xy in junction.sides.items():
            assert shapes[number - 1].boundary.distance(Point(xy)) < 0.1
            assert city.regions[number - 1].frontage.distance(Point(xy)) < 0.1


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"spacing": 0}, "spacing"),
        ({"thin": float("nan")}, "thin"),
        ({"most_ha": 1.5}, "less than twice"),
        ({"apart": 5.0}, "apart"),
    ],
)
def test_rules_are_checked(asked, said):
    with pytest.raises(InputError, match=said):
        CityRules(**asked)
