"""Where growth begins: places worked out by hand."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.growth.grammar import Grammar, State
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.land.entries import longest_axis
from platwright.growth.land.ground import ground_of_roads, ground_of_sites
from platwright.growth.land.legs import Leg, widest_gap
from platwright.growth.land.starts import (
    ARRIVAL,
    ASKED,
    JUNCTION,
    LOOSE_END,
    Place,
    state_of,
    thinned,
    with_main,
)
from platwright.growth.rules import GrowthRules
from platwright.site import prepare_sites
from platwright.site.types import AccessPoint
from shapely.geometry import LineString, MultiPoint, Point, Polygon, box

from .ground_checks import check_ground

UTM = "EPSG:25832"
X, Y = 500_000.0, 5_200_000.0
GRID = shipped_grammar("grid")
MAIN, LARGE, SMALL = (State(road, "L") for road in "mls")


def layer(shapes, **columns):
    moved = [None if s is None else shapely.affinity.translate(s, X, Y) for s in shapes]
    return gpd.GeoDataFrame(columns, geometry=moved, crs=UTM)


def site_of(polygon, roads=(), access=None, **options):
    found = prepare_sites(layer([polygon]), layer(list(roads)) if roads else None, **options).sites
    if access is None:
        return found
    points = tuple(
        AccessPoint((X + x, Y + y), (X + x, Y + y), way, "", kind) for (x, y), way, kind in access
    )
    return [replace(site, access_points=points) for site in found]


def places(real):
    """Positions, directions and states of the starts, rounded, in the order of positions."""
    return sorted(
        (
            (round(s.xy[0] - X, 2), round(s.xy[1] - Y, 2)),
            (round(s.direction[0], 3) + 0.0, round(s.direction[1], 3) + 0.0),
            s.state,
        )
        for s in real.ground.starts
    )


class TestRoads:
    """Loose ends and junctions of roads without a domain."""

    def test_a_t_junction_goes_straight_on(self):
        roads = [
            LineString([(-300, 0), (300, 0)]),
            # the stem arrives at 80 degrees, and goes on in its own direction
            LineString([(-300 * math.cos(math.radians(80)), -300 * math.sin(math.radians(80))),
                        (0, 0)]),
        ]  # fmt: skip
        real = ground_of_roads(layer(roads, highway=["primary", "tertiary"]), GRID, scale=20)
        found = {xy: (way, state) for xy, way, state in places(real)}
        way, state = found[0.0, 0.0]
        assert way == (round(math.cos(math.radians(80)), 3), round(math.sin(math.radians(80)), 3))
        # the state is that of the stem, a collector; the main road goes on at its ends
        assert state == LARGE
        assert found[300.0, 0.0] == ((1.0, 0.0), MAIN)
        assert len(found) == 4

    def test_a_fork_goes_on_between_its_arms(self):
        roads = [LineString([(0, 0), (200, 120)]), LineString([(0, 0), (200, -120)]),
                 LineString([(0, 0), (200, 0)])]  # fmt: skip
        real = ground_of_roads(layer(roads), GRID, scale=20)
        assert ((0.0, 0.0), (-1.0, 0.0)) in [(xy, way) for xy, way, _ in places(real)]

    def test_a_crossing_does_not_grow(self):
        roads = [LineString([(-200, 0), (200, 0)]), LineString([(0, -200), (0, 200)])]
        real = ground_of_roads(layer(roads), GRID, scale=20)
        assert (0.0, 0.0) not in [xy for xy, _, _ in places(real)]
        assert len(real.ground.starts) == 4

    def test_an_end_beside_a_street_is_none(self):
        # the digitiser stopped 0.3 m before the street
        roads = [LineString([(0, 0), (300, 0)]), LineString([(150, 200), (150, 0.3)])]
        real = ground_of_roads(layer(roads), GRID, scale=20)
        assert [xy for xy, _, _ in places(real)] == [(0.0, 0.0), (150.0, 200.0), (300.0, 0.0)]

    def test_nothing_grows_into_blocks(self):
        ring = LineString(box(0, 0, 300, 300).exterior.coords)
        stub = LineString([(150, 0), (150, 100)])
        spur = LineString([(300, 150), (500, 150)])
        real = ground_of_roads(layer([ring, stub, spur]), GRID, scale=20)
        # the stub ends in a block of 9 ha; its T opens outwards, and so does the spur's end
        assert [xy for xy, _, _ in places(real)] == [(150.0, 0.0), (500.0, 150.0)]
        # a ring around 100 ha encloses open land
        outer = LineString(box(-350, -350, 650, 650).exterior.coords)
        stem = LineString([(150, -350), (150, 0)])
        real = ground_of_roads(layer([outer, stub, stem]), GRID, scale=20)
        assert (150.0, 100.0) in [xy for xy, _, _ in places(real)]

    def test_states_by_level(self):
        roads = [LineString([(0, 200 * k), (300, 200 * k)]) for k in range(3)]
        real = ground_of_roads(
            layer(roads, highway=["primary", "tertiary", "residential"]), GRID, scale=20
        )
        assert {(xy[1], state) for xy, _, state in places(real)} == {
            (0.0, MAIN), (200.0, LARGE), (400.0, SMALL),
        }  # fmt: skip

    def test_one_main_street_where_all_roads_are_local(self):
        roads = [LineString([(0, 200 * k), (300, 200 * k)]) for k in range(3)]
        real = ground_of_roads(layer(roads, highway=["residential"] * 3), GRID, scale=20)
        assert sorted(s.state.label for s in real.ground.starts) == ["mL"] + ["sL"] * 5

    def test_directions_are_measured_over_some_length(self):
        # the last metre of the road bends off
        road = LineString([(0, 0), (299, 0), (300, 1)])
        real = ground_of_roads(layer([road]), GRID, scale=20)
        (way,) = [way for xy, way, _ in places(real) if xy[0] == 300]
        assert math.degrees(math.atan2(way[1], way[0])) < 5

    def test_a_thousand_junctions_take_no_time(self):
        n = 32
        lines = [LineString([(100 * k, 0), (100 * k, 100 * n)]) for k in range(n)]
        lines += [LineString([(0, 100 * k), (100 * n, 100 * k)]) for k in range(n)]
        begun = time.process_time()
        real = ground_of_roads(layer(lines), GRID, scale=50)
        assert time.process_time() - begun < 2
        check_ground(real, None)
        # streets end on the first street at one side, and cross the last one at the other
        assert len(real.problems) == (n - 1) ** 2
        # only ends at the outside grow
        assert all(min(x, y) <= 0 or max(x, y) >= 100 * (n - 1) for (x, y), _, _ in places(real))


class TestSites:
    """Arrivals, streets inside, and entries."""

    SITE = box(0, 0, 400, 300)

    def test_roads_from_outside_go_on(self):
        roads = [LineString([(-200, -8), (600, -8)]), LineString([(120, -200), (120, -8)])]
        real = ground_of_sites(site_of(self.SITE, roads), GRID, scale=20)
        assert places(real) == [((120.0, -8.0), (0.0, 1.0), MAIN)]
        assert real.ground.starts[0].node >= 0

    def test_the_highest_road_that_arrives_is_the_main_one(self):
        access = [((0, 100), (1, 0), "residential"), ((200, 0), (0, 1), "tertiary"),
                  ((400, 200), (-1, 0), "service")]  # fmt: skip
        real = ground_of_sites(site_of(self.SITE, access=access), GRID, scale=20)
        assert [state for _, _, state in places(real)] == [SMALL, MAIN, SMALL]

    def test_a_road_that_goes_on_by_itself_gets_no_start(self):
        roads = [LineString([(-200, 150), (600, 150)])]
        sites = site_of(self.SITE, roads, inner_roads="keep")
        assert len(sites[0].access_points) == 2
        real = ground_of_sites(sites, GRID, scale=20)
        # the site is entered from that road instead: one main street crosses it, collectors
        # leave it 80 m from there and from each other, those across half-way between
        assert {xy[1] for xy, _, _ in places(real)} == {150.0}
        (main,) = [xy for xy, _, state in places(real) if state == GRID.start]
        assert main == (200.0, 150.0)
        sides = {
            side: [xy[0] for xy, way, state in places(real) if state == LARGE and way[1] == side]
            for side in (-1, 1)
        }
        assert sorted(sides.values()) == [[40, 120, 280, 360], [80, 160, 240, 320]]
        growth = grow(real.ground, GrowthRules(GRID, scale=20, iterations=1))
        middles = growth.xy[growth.ends[growth.grown]].mean(axis=1)
        at_main = middles[np.abs(middles[:, 0] - X - 200) < 1, 1] - Y
        assert np.round(at_main).tolist() in ([160, 140], [140, 160])

    def test_arrivals_near_each_other_are_one(self):
        access = [((200, 0), (0, 1), "tertiary"), ((212, 0), (0, 1), "residential"),
                  ((300, 0), (0, 1), "residential")]  # fmt: skip
        sites = site_of(self.SITE, access=access)
        near = ground_of_sites(sites, GRID, scale=20, spacing=10)
        assert [xy[0] for xy, _, _ in places(near)] == [200, 212, 300]
        far = ground_of_sites(sites, GRID, scale=20, spacing=20)
        assert [xy[0] for xy, _, _ in places(far)] == [200, 300]

    def test_a_long_straight_road_gets_entries_that_fit_a_grid(self):
        site = box(0, 0, 1000, 200)
        road = LineString([(-300, -8), (1300, -8)])
        real = ground_of_sites(site_of(site, [road]), GRID, scale=40)
        found = places(real)
        # square to the road, four streets of 40 m apart, one of them the main one
        assert {way for _, way, _ in found} == {(0.0, 1.0)}
        gaps = np.diff([xy[0] for xy, _, _ in found])
        assert np.allclose(gaps, 160, atol=0.01)
        # and none 20 m from the side of the site
        assert [xy[0] for xy, _, _ in found] == [180, 340, 500, 660, 820]
        assert [state for _, _, state in found].count(MAIN) == 1
        growth = grow(real.ground, GrowthRules(GRID, scale=40, iterations=60))
        # the grids fit together: all streets meet at right angles
        ways = np.diff(growth.xy[growth.ends[growth.grown]], axis=1)[:, 0]
        bent = np.abs(ways).min(axis=1) / np.abs(ways).max(axis=1)
        assert (bent < 0.01).mean() > 0.9

    def test_a_ring_road_is_entered_across_from_the_middle(self):
        site = box(0, 0, 400, 200)
        ring = LineString(box(-8, -8, 408, 208).exterior.coords)
        real = ground_of_sites(site_of(site, [ring]), GRID, scale=40)
        ways = {way for _, way, _ in places(real)}
        assert len(ways) == 1
        assert ways <= {(0.0, 1.0), (0.0, -1.0)}

    def test_without_streets_growth_begins_in_the_middle_along_the_site(self):
        turned = shapely.affinity.rotate(box(0, 0, 400, 120), 30, origin=(0, 0))
        real = ground_of_sites(site_of(turned), GRID, scale=20)
        ((xy, way, state),) = places(real)
        assert Point(xy).distance(turned.boundary) == pytest.approx(60, abs=5)
        assert way == pytest.approx((math.cos(math.radians(30)), 0.5), abs=1e-3)
        assert state == GRID.start
        real = ground_of_sites(site_of(turned), GRID, scale=20, direction=90)
        assert places(real)[0][1] == (1.0, 0.0)

    def test_ground_behind_a_street_is_entered_from_it(self):
        # a road through the site, and one that arrives in its southern half only
        roads = [LineString([(-200, 150), (600, 150)]), LineString([(200, -200), (200, 0)])]
        sites = site_of(self.SITE, roads, inner_roads="keep")
        real = ground_of_sites(sites, GRID, scale=20)
        assert [way for xy, way, _ in places(real) if xy[1] == 150] == [(0.0, 1.0)] * 5
        # but not where the ground behind it is small
        real = ground_of_sites(sites, GRID, scale=80)
        assert [xy[1] for xy, _, _ in places(real)] == [0.0]

    def test_every_part_of_the_ground_has_a_start(self):
        bars = [box(90 * k, -1, 90 * k + 10, 301) for k in range(1, 5)]
        sites = prepare_sites(layer([self.SITE]), None, layer(bars)).sites
        real = ground_of_sites(sites, GRID, scale=20)
        parts = shapely.get_parts(real.ground.domain)
        assert len(parts) == 5
        assert len(real.ground.starts) == 5


class TestPoints:
    """Points that the planner gives."""

    SITE = box(0, 0, 400, 300)
    ROAD = LineString([(-200, -8), (600, -8)])

    def test_a_point_on_open_ground_is_a_start_of_the_grammar(self):
        real = ground_of_sites(
            site_of(self.SITE, [self.ROAD]), GRID, scale=20, points=layer([Point(200, 150)])
        )
        assert places(real) == [((200.0, 150.0), (1.0, 0.0), GRID.start)]
        assert real.ground.starts[0].node == -1

    def test_directions_are_degrees_clockwise_from_north(self):
        points = layer([Point(100, 150), Point(300, 150)], Direction=[135.0, None])
        real = ground_of_sites(site_of(self.SITE), GRID, scale=20, points=points, direction=0)
        assert [way for _, way, _ in places(real)] == [(0.707, -0.707), (0.0, 1.0)]

    def test_a_point_near_a_street_is_on_it_and_leaves_square_to_it(self):
        points = layer([Point(200, 5), Point(300, 5)], direction=[None, 45.0])
        real = ground_of_sites(site_of(self.SITE, [self.ROAD]), GRID, scale=20, points=points)
        assert places(real) == [
            ((200.0, -8.0), (0.0, 1.0), MAIN), ((300.0, -8.0), (0.707, 0.707), MAIN),
        ]  # fmt: skip
        check_ground(real, None)

    def test_a_point_on_a_street_inside_leaves_to_both_sides(self):
        roads = [LineString([(-200, 150), (600, 150)])]
        sites = site_of(self.SITE, roads, inner_roads="keep")
        real = ground_of_sites(sites, GRID, scale=20, points=layer([Point(200, 160)]))
        ((xy, way, state),) = places(real)
        assert (xy, abs(way[1]), state) == ((200.0, 150.0), 1.0, GRID.start)

    def test_a_point_at_a_loose_end_goes_straight_on(self):
        roads = layer([LineString([(0, 0), (300, 0)])])
        real = ground_of_roads(roads, GRID, scale=20, points=layer([Point(302, 1)]))
        assert places(real) == [((300.0, 0.0), (1.0, 0.0), MAIN)]

    def test_points_in_another_crs(self):
        points = layer([Point(200, 150)]).to_crs(4326)
        real = ground_of_sites(site_of(self.SITE), GRID, scale=20, points=points)
        assert places(real)[0][0] == pytest.approx((200, 150), abs=0.02)

    def test_points_outside_are_left_out_and_told(self):
        points = layer([Point(200, 150), Point(900, 900), None, Point(420, 150)])
        points.index = [11, 12, 13, 14]
        real = ground_of_sites(site_of(self.SITE), GRID, scale=20, points=points,
                               point_layer="Centres")  # fmt: skip
        # the last one is within the snap distance of the edge, and moves to it
        assert [xy for xy, _, _ in places(real)] == [(200.0, 150.0), (400.0, 150.0)]
        told = real.problems[["layer", "feature", "severity"]].to_numpy().tolist()
        assert told == [["Centres", "12", "warning"], ["Centres", "13", "warning"]]
        assert "781 m outside" in real.problems["problem"][0]

    def test_all_points_outside_are_an_error(self):
        points = layer([Point(900, 900), Point(950, 900)])
        with pytest.raises(InputError, match=r"Layer 'Starts', feature 0: the point lies 781 m"):
            ground_of_sites(site_of(self.SITE), GRID, points=points)

    @pytest.mark.parametrize("shapes", [[], [None], [LineString([(0, 0), (9, 9)])]])
    def test_a_layer_without_points_is_an_error(self, shapes):
        with pytest.raises(InputError, match="Layer 'Starts': has no point"):
            ground_of_sites(site_of(self.SITE), GRID, points=layer(shapes))

    def test_a_layer_without_crs_is_an_error(self):
        points = gpd.GeoDataFrame(geometry=[Point(X + 1, Y + 1)])
        with pytest.raises(InputError, match="Layer 'Starts': has no coordinate reference system"):
            ground_of_sites(site_of(self.SITE), GRID, points=points)

    def test_multipoints_and_doubles(self):
        points = layer([MultiPoint([(100, 100), (300, 100)]), Point(100, 100)])
        real = ground_of_sites(site_of(self.SITE), GRID, scale=20, points=points)
        assert [xy for xy, _, _ in places(real)] == [(100.0, 100.0), (300.0, 100.0)]


def test_states_fall_back_where_a_road_type_has_no_rules():
    rules = {state: GRID.rules[state] for state in (LARGE, GRID.start)}
    some = Grammar("some", rules)
    assert [state_of(some, level) for level in (-1, 0, 1, 2, 3)] == [
        LARGE, GRID.start, LARGE, LARGE, LARGE,
    ]  # fmt: skip
    only = Grammar("only", {SMALL: GRID.rules[SMALL]})
    assert {state_of(only, level) for level in (-1, 0, 1, 2, 3)} == {SMALL}


@pytest.mark.parametrize("angle", [0, 17, 45, 90, 133, 179])
def test_the_longest_axis_turns_with_the_area(angle):
    area = shapely.affinity.rotate(box(0, 0, 300, 100), angle)
    way = longest_axis(area)
    assert math.degrees(math.atan2(way[1], way[0])) % 180 == pytest.approx(angle % 180, abs=1e-6)
    assert way[1] > -1e-9


def test_the_longest_axis_of_next_to_nothing():
    assert math.hypot(*longest_axis(Polygon([(0, 0), (1e-9, 0), (0, 1e-9)]))) == pytest.approx(1)


@given(st.lists(st.floats(-math.pi, math.pi), min_size=1, max_size=6))
@settings(max_examples=100)
def test_the_widest_gap_is_free_of_streets(angles):
    legs = [Leg((math.cos(a), math.sin(a)), 3) for a in angles]
    wide, middle = widest_gap(legs)
    turns = [math.acos(max(-1, min(1, leg.way[0] * middle[0] + leg.way[1] * middle[1])))
             for leg in legs]  # fmt: skip
    assert min(turns) == pytest.approx(wide / 2, abs=1e-6)
    assert wide >= 2 * math.pi / len(legs) - 1e-9


PLACE = st.builds(
    lambda x, y, a, level, origin: Place((x, y), (math.cos(a), math.sin(a)), level, origin),
    st.integers(0, 100), st.integers(0, 100), st.sampled_from([0.0, 0.5, math.pi]),
    st.integers(1, 3), st.sampled_from([ASKED, LOOSE_END, JUNCTION]),
)  # fmt: skip


@given(st.lists(PLACE, max_size=40), st.floats(1, 60))
@settings(max_examples=100)
def test_thinned_places_are_apart_and_none_is_far_from_one(found, spacing):
    kept = thinned(found, spacing)
    assert {p for p in found if p.origin == ASKED} <= set(kept)

    def near(a, b):
        turn = a.way[0] * b.way[0] + a.way[1] * b.way[1]
        return a.xy == b.xy or (math.dist(a.xy, b.xy) < 2 * spacing and turn > -0.5)

    for k, place in enumerate(kept):
        others = kept[:k] + kept[k + 1 :]
        assert place.origin == ASKED or not any(near(place, o) for o in others)
    assert all(any(near(place, other) for other in kept) for place in found)


def street(x, level, sight):
    return Place((x, 0.0), (0.0, 1.0), level, ARRIVAL, sight=sight)


def test_a_main_road_that_arrives_at_a_corner_is_no_main_street():
    # 75 m on it meets the next street; the main street begins where there is room for one
    places = [street(0, 1, 75.0), street(200, 3, 342.0), street(300, 3, 371.0)]
    assert [p.level for p in with_main(places, GRID)] == [3, 3, -1]


def test_a_main_road_with_room_stays_the_main_street():
    places = [street(0, 1, 120.0), street(200, 3, 371.0), street(300, 2, 60.0)]
    assert [p.level for p in with_main(places, GRID)] == [1, 3, 2]


def test_the_main_street_begins_where_there_is_room_though_a_higher_street_has_none():
    places = [street(0, 2, 50.0), street(200, 3, 250.0), street(300, 3, 371.0)]
    assert [p.level for p in with_main(places, GRID)] == [2, 3, -1]


def test_a_street_inside_with_a_long_view_takes_nothing_from_those_that_arrive():
    inner = Place((50.0, 50.0), (1.0, 0.0), 3, LOOSE_END, sight=900.0)
    places = [street(0, 2, 138.0), street(200, 2, 120.0), inner]
    assert [p.level for p in with_main(places, GRID)] == [-1, 2, 3]
