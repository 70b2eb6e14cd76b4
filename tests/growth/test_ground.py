"""Grounds of sites, of roads and of nothing: domain, streets along the edge, planar pieces."""

from __future__ import annotations

import dataclasses
from collections import Counter

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.land.given import levels_of
from platwright.growth.land.ground import ground_of_roads, ground_of_sites, open_ground
from platwright.progress import Silent
from platwright.site import prepare_sites
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

from .ground_checks import check_ground

UTM = "EPSG:25832"
GRID = shipped_grammar("grid")
X, Y = 500_000.0, 5_200_000.0


def frame(shapes, crs=UTM, **columns):
    moved = [None if s is None else shapely.affinity.translate(s, X, Y) for s in shapes]
    return gpd.GeoDataFrame(columns, geometry=moved, crs=crs)


def sites_of(polygons, roads=None, obstacles=None, **options):
    layers = [None if own is None else frame(own) for own in (polygons, roads, obstacles)]
    return prepare_sites(*layers, **options).sites


def local(geometry):
    return shapely.affinity.translate(geometry, -X, -Y)


def test_the_domain_reaches_the_centre_line_of_the_street_along_it():
    # the property line is 8 m from the centre line; the street goes on for 100 m to either side
    road = LineString([(-100, -8), (300, -8)])
    real = ground_of_sites(sites_of([box(0, 0, 200, 100)], [road]), GRID, scale=20)
    check_ground(real, None)
    # 200 x 100 m and a strip of 8 m to the street, which is known from 3 m behind the corners on
    assert real.ground.domain.area == pytest.approx(20_000 + 194 * 8 + 20, abs=30)
    (street,) = real.streets
    assert not street.edge
    for x in (4, 100, 196):
        assert real.ground.domain.contains(Point(X + x, Y - 8))
    assert not real.ground.domain.intersects(Point(X + 100, Y - 8.2))


def test_the_corner_between_two_streets_is_filled():
    roads = [LineString([(-90, -8), (200, -8)]), LineString([(-8, -90), (-8, 100)])]
    real = ground_of_sites(sites_of([box(0, 0, 200, 100)], roads), GRID, scale=20)
    check_ground(real, None)
    assert real.ground.domain.contains(Point(X - 8, Y - 8))
    assert real.ground.domain.area == pytest.approx(208 * 108, rel=0.01)
    ends = Counter(np.bincount(real.ground.ends.ravel()).tolist())
    assert ends[1] == 2


def test_sites_on_both_sides_of_a_street_are_one_domain():
    road = LineString([(-50, 0), (250, 0)])
    sites = sites_of([box(0, 8, 200, 100), box(0, -100, 200, -8)], [road])
    real = ground_of_sites(sites, GRID, scale=20)
    check_ground(real, None)
    assert len(sites) == 2
    assert real.ground.domain.geom_type == "Polygon"
    # both sites know the street; it is there once
    assert sum(s.line.length for s in real.streets) == pytest.approx(200, abs=65)
    assert real.ground.domain.area == pytest.approx(200 * 200, rel=0.01)


def test_obstacles_are_holes_and_slivers_are_dropped():
    # a wall across the site leaves a strip of 3 m, which holds no street
    walls = [box(190, -10, 197, 110), box(50, 30, 80, 60)]
    real = ground_of_sites(sites_of([box(0, 0, 200, 100)], None, walls), GRID, scale=20)
    check_ground(real, None)
    domain = real.ground.domain
    assert domain.area == pytest.approx(190 * 100 - 900)
    assert len(domain.interiors) == 1


def test_a_domain_of_two_parts_has_starts_in_both():
    river = [box(90, -10, 110, 110)]
    roads = [LineString([(-50, -8), (85, -8)])]
    real = ground_of_sites(sites_of([box(0, 0, 200, 100)], roads, river), GRID, scale=20)
    check_ground(real, None)
    parts = shapely.get_parts(real.ground.domain)
    assert len(parts) == 2
    for part in parts:
        assert any(part.buffer(1e-6).contains(Point(s.xy)) for s in real.ground.starts)
    assert real.problems["problem"].str.contains("no street from which").tolist() == [True]


@pytest.mark.parametrize("edge", ["stop", "join"])
def test_streets_along_the_edge_are_new(edge):
    road = LineString([(-100, -8), (300, -8)])
    pond = [box(80, 30, 130, 70), box(20, 20, 30, 30)]
    sites = sites_of([box(0, 0, 200, 100)], [road], pond)
    real = ground_of_sites(sites, GRID, edge=edge, obstacle_edge=edge, scale=20)
    check_ground(real, None)
    new = [s for s in real.streets if s.edge]
    if edge == "stop":
        assert new == []
        return
    assert {s.level for s in new} == {2}
    rings = [s.line for s in new if s.line.is_ring]
    # around the large pond, not around the small one, 100 m2
    assert [round(r.length) for r in rings] == [180]
    (outer,) = [local(s.line) for s in new if not s.line.is_ring]
    # up one side, along the top, down the other, and on to the street
    # from 3 m behind its corners
    assert outer.length == pytest.approx(400 + 2 * np.hypot(3, 8))
    assert {round(y) for _, y in (outer.coords[0], outer.coords[-1])} == {-8}
    ends = {tuple(np.round(outer.coords[k], 3)) for k in (0, -1)}
    nodes = {tuple(np.round(n, 3)) for n in real.ground.nodes - (X, Y)}
    assert ends <= nodes
    assert np.bincount(real.ground.ends.ravel()).min() == 2


def test_without_roads_a_street_may_run_around_the_whole_site():
    real = ground_of_sites(sites_of([box(0, 0, 200, 100)]), GRID, edge="join", scale=20)
    check_ground(real, None)
    (street,) = real.streets
    assert street.edge
    assert street.line.is_ring
    assert street.line.length == pytest.approx(600)
    # growth enters square to one of its sides
    (start,) = [s for s in real.ground.starts if s.state == GRID.leaf]
    assert sorted(np.round(np.abs(start.direction), 6)) == [0, 1]


def test_sites_in_other_working_crs_come_to_the_first_one():
    first = sites_of([box(0, 0, 200, 100)], [LineString([(-50, -8), (250, -8)])])
    other = frame([box(300, 0, 400, 100)]).to_crs(25833)
    second = prepare_sites(other).sites
    assert second[0].crs != first[0].crs
    real = ground_of_sites([*first, *second], GRID, scale=20)
    check_ground(real, None)
    assert real.crs == first[0].crs
    near, far = sorted(shapely.get_parts(real.ground.domain), key=lambda p: p.centroid.x)
    assert local(far.centroid).distance(Point(350, 50)) < 0.1
    assert near.area > far.area == pytest.approx(10_000, rel=0.01)


def test_inner_streets_reach_the_street_along_the_edge():
    roads = [LineString([(-50, -8), (250, -8)]), LineString([(60, -8), (60, 60)])]
    sites = sites_of([box(0, 0, 200, 100)], roads, inner_roads="keep")
    real = ground_of_sites(sites, GRID, scale=20)
    given_ = [s.line for s in (*sites[0].boundary_streets, *sites[0].inner_streets)]
    check_ground(real, given_)
    degree = np.bincount(real.ground.ends.ravel())
    junctions = real.ground.nodes[degree == 3] - (X, Y)
    assert np.round(junctions, 2).tolist() == [[60.0, -8.0]]
    # and the loose end inside goes on
    ends = [s for s in real.ground.starts if np.allclose(np.subtract(s.xy, (X, Y)), (60, 60))]
    assert [np.round(s.direction, 6).tolist() for s in ends] == [[0, 1]]


@pytest.mark.parametrize(
    ("kinds", "levels"),
    [
        (["motorway", "trunk_link", "primary", "secondary"], [1, 1, 1, 1]),
        (["Tertiary", "unclassified", "residential", "service"], [2, 2, 3, 3]),
        (["", ""], [2, 2]),
        (["primary", ""], [1, 3]),
        (["1.0", "2", "Route à 1 chaussée"], [1, 2, 3]),
        (["['residential', 'tertiary']", "service;secondary"], [2, 1]),
    ],
)
def test_levels_are_those_of_the_classes(kinds, levels):
    assert levels_of(kinds) == levels


class TestRoads:
    """Road layers without a domain."""

    def test_roads_that_cross_without_a_junction_get_one(self):
        roads = frame(
            [LineString([(0, 0), (400, 0)]), LineString([(200, -200), (200, 200)])],
            name=["Long Lane", None],
        )
        real = ground_of_roads(roads, GRID, scale=20)
        check_ground(real, list(roads.geometry))
        assert real.problems["severity"].tolist() == ["info"]
        assert "without a junction" in real.problems["problem"][0]
        assert real.problems.geometry[0].distance(Point(X + 200, Y)) < 1e-6
        assert np.bincount(real.ground.ends.ravel()).max() == 4
        # four loose ends, all going on
        assert len(real.ground.starts) == 4

    def test_duplicates_are_taken_once(self):
        line = LineString([(0, 0), (100, 0), (200, 50)])
        roads = frame([line, line.reverse(), LineString([(50, 0), (100, 0), (100, 80)])])
        real = ground_of_roads(roads, GRID, scale=20)
        check_ground(real, list(roads.geometry))
        assert len(real.streets) == 2
        total = sum(s.line.length for s in real.streets)
        assert total == pytest.approx(line.length + 80)
        assert real.problems["problem"].str.contains("lies on another one").sum() == 2

    def test_one_road_grows_from_both_ends(self):
        real = ground_of_roads(frame([LineString([(0, 0), (300, 0)])]), GRID, scale=20)
        check_ground(real, None)
        found = {(s.xy[0] - X, s.direction) for s in real.ground.starts}
        assert found == {(0.0, (-1.0, 0.0)), (300.0, (1.0, 0.0))}

    def test_a_ring_is_entered_from_outside(self):
        ring = LineString(Point(0, 0).buffer(120).exterior.coords)
        real = ground_of_roads(frame([ring]), GRID, scale=20)
        check_ground(real, None)
        for start in real.ground.starts:
            radius = np.subtract(start.xy, (X, Y))
            assert radius @ start.direction == pytest.approx(np.hypot(*radius), rel=0.01)

    def test_multipart_raised_and_empty_roads(self):
        shapes = [
            MultiLineString([[(0, 0, 5), (100, 0, 6)], [(0, 50, 1), (100, 50, 2)]]),
            None,
            LineString(),
            LineString([(10, 10), (10, 10)]),
            LineString([(0, 100), (100, 100)]),
        ]
        roads = gpd.GeoDataFrame(geometry=shapes, crs=UTM, index=[5, 6, 7, 8, 9])
        real = ground_of_roads(roads, GRID, scale=20)
        check_ground(real, None)
        assert len(real.streets) == 3
        told = dict(zip(real.problems["feature"], real.problems["problem"]))
        assert told == {
            "6": "it has no geometry",
            "7": "it has no geometry",
            "8": "the road has no length",
        }

    def test_degrees_are_projected(self):
        roads = frame([LineString([(0, 0), (300, 0)])]).to_crs(4326)
        real = ground_of_roads(roads, GRID, scale=20)
        check_ground(real, None)
        assert real.crs.to_epsg() == 32632
        assert real.source_crs.to_epsg() == 4326
        assert real.streets[0].line.length == pytest.approx(300, abs=0.1)

    @pytest.mark.parametrize("shapes", [[], [None], [Point(0, 0)], [LineString()]])
    def test_no_road_is_an_error(self, shapes):
        with pytest.raises(InputError, match=r"Layer 'Ways': has no road .* leave it out"):
            ground_of_roads(frame(shapes), GRID, road_layer="Ways")

    def test_no_crs_is_an_error(self):
        roads = gpd.GeoDataFrame(geometry=[LineString([(0, 0), (9, 0)])])
        with pytest.raises(InputError, match="Layer 'Roads': has no coordinate reference system"):
            ground_of_roads(roads, GRID)


class TestOpenGround:
    """Nothing at all."""

    def test_it_is_that_of_citysprout(self):
        real = open_ground(GRID, UTM)
        (start,) = real.ground.starts
        assert (start.xy, start.direction) == ((0.0, 0.0), (0.0, 1.0))
        assert start.state == GRID.start
        assert real.ground.domain is None
        assert len(real.streets) == len(real.problems) == 0

    def test_directions_of_any_length_do(self):
        (start,) = open_ground(GRID, UTM, xy=(7, 8), direction=(3, 4)).ground.starts
        assert (start.xy, start.direction) == ((7.0, 8.0), (0.6, 0.8))

    @pytest.mark.parametrize(("crs", "units"), [("EPSG:4326", "degree"), (2263, "US survey foot")])
    def test_metres_are_needed(self, crs, units):
        with pytest.raises(InputError, match=f"is in {units}.* Choose a projected one in metres"):
            open_ground(GRID, crs)

    @pytest.mark.parametrize("bad", [{"direction": (0, 0)}, {"xy": (np.nan, 0)}])
    def test_numbers_must_be_finite(self, bad):
        with pytest.raises(InputError, match="Give finite numbers"):
            open_ground(GRID, UTM, **bad)


class TestBadInput:
    """What a planner may get wrong."""

    def test_no_site(self):
        with pytest.raises(InputError, match="No site is given"):
            ground_of_sites([], GRID)

    def test_a_site_as_narrow_as_a_sliver(self):
        with pytest.raises(InputError, match="less than 4 m wide"):
            ground_of_sites(sites_of([box(0, 0, 200, 3)]), GRID)

    def test_obstacles_everywhere(self):
        sites = sites_of([box(0, 0, 50, 50)], None, [box(-5, -5, 55, 55)])
        with pytest.raises(InputError, match="Choose another polygon, or leave obstacles out"):
            ground_of_sites(sites, GRID)

    def test_a_site_smaller_than_a_street_still_has_a_start(self):
        real = ground_of_sites(sites_of([box(0, 0, 30, 20)]), GRID, scale=100)
        check_ground(real, None)

    def test_roads_wholly_outside(self):
        sites = sites_of([box(0, 0, 200, 100)], [LineString([(0, 900), (200, 900)])])
        real = ground_of_sites(sites, GRID, scale=20)
        check_ground(real, None)
        assert real.streets == ()
        assert [s.state for s in real.ground.starts] == [GRID.start]

    @pytest.mark.parametrize(
        "options",
        [{"edge": "cut"}, {"obstacle_edge": ""}, {"scale": 0.0}, {"spacing": -1.0},
         {"scale": float("nan")}],
    )  # fmt: skip
    def test_choices_out_of_bounds(self, options):
        with pytest.raises(InputError):
            ground_of_sites(sites_of([box(0, 0, 200, 100)]), GRID, **options)

    def test_cancelling(self):
        class Cancelled(Silent):
            def cancelled(self):
                return True

        with pytest.raises(CancelledError):
            ground_of_sites(sites_of([box(0, 0, 9, 9)]), GRID, progress=Cancelled())
        with pytest.raises(CancelledError):
            ground_of_roads(frame([LineString([(0, 0), (9, 0)])]), GRID, progress=Cancelled())


CORNER = st.tuples(st.integers(0, 40), st.integers(0, 40))


@st.composite
def sites_with_roads(draw):
    """A quadrangle or a polygon with a notch, roads across and along it, perhaps obstacles."""
    wide, deep = draw(st.integers(60, 300)), draw(st.integers(60, 300))
    corners = [(0, 0), (wide, 0), (wide, deep), (0, deep)]
    shaken = [(x + dx, y + dy) for (x, y), (dx, dy) in zip(corners, [draw(CORNER) for _ in "abcd"])]
    far = st.tuples(st.integers(-80, 380), st.integers(-80, 380))
    roads = draw(
        st.lists(
            st.lists(far, min_size=2, max_size=4).map(LineString).filter(lambda r: r.length > 0),
            max_size=5,
        )
    )
    gap = draw(st.integers(0, 12))
    roads += [LineString([(-60, -gap), (360, -gap)])] * draw(st.integers(0, 2))
    x, y = draw(far)
    barred = [box(x, y, x + draw(st.integers(1, 90)), y + draw(st.integers(1, 90)))]
    return Polygon(shaken), roads, barred


@given(
    sites_with_roads(),
    st.sampled_from(["stop", "join"]),
    st.sampled_from(["ignore", "keep"]),
    st.sampled_from([10, 40, 100]),
)
@settings(max_examples=60)
def test_any_site_becomes_a_ground(drawn, edge, inner_roads, scale):
    polygon, roads, barred = drawn
    if not polygon.is_valid:
        polygon = polygon.convex_hull
    sites = sites_of([polygon], roads or None, barred, inner_roads=inner_roads)
    try:
        real = ground_of_sites(sites, GRID, edge=edge, obstacle_edge=edge, scale=scale)
    except InputError as error:
        assert "wide enough" in str(error)  # noqa: PT017 (obstacles may cover everything)
        return
    kept = [s.line for site in sites for s in (*site.boundary_streets, *site.inner_streets)]
    check_ground(real, kept or None)
    again = ground_of_sites(sites, GRID, edge=edge, obstacle_edge=edge, scale=scale)
    assert again.ground.starts == real.ground.starts
    assert again.ground.nodes.tobytes() == real.ground.nodes.tobytes()
    assert again.ground.domain.wkb == real.ground.domain.wkb


def test_real_ground_is_frozen():
    real = open_ground(GRID, UTM)
    with pytest.raises(dataclasses.FrozenInstanceError):
        real.streets = ()
