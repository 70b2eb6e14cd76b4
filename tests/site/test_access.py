import geopandas as gpd
import numpy as np
import pytest
from platwright.errors import InputError
from platwright.site import Site, access_points_from_layer, access_points_of_sites
from platwright.site.access import access_points
from platwright.site.frontage import frontage
from platwright.site.roadnetwork import build_network
from pyproj import CRS
from shapely.geometry import LineString, Point, Polygon, box

SITE = box(0, 0, 200, 100)
UTM = CRS.from_epsg(25832)


def find(*lines, site=SITE, kinds=None):
    array = np.array([LineString(x) for x in lines], dtype=object)
    names = np.array([f"n{k}" for k in range(len(lines))], dtype=object)
    kinds = np.array(kinds or [""] * len(lines), dtype=object)
    roads = build_network(array, names, kinds)
    return access_points(site, roads, frontage(site, roads, 30).lines, 30)


SOUTH = [(-100, -10), (300, -10)]


def test_junction_on_the_street_along_the_edge():
    (point,) = find(SOUTH, [(60, -110), (60, -10)])
    assert point.xy == pytest.approx((60, 0))
    assert point.junction == pytest.approx((60, -10))
    assert point.direction == pytest.approx((0, 1))
    assert point.name == "n1"


def test_oblique_street_is_carried_on_in_its_own_direction():
    # 3-4-5: from (60, -10) the direction (0.6, 0.8) reaches y = 0 at x = 67.5
    (point,) = find(SOUTH, [(0, -90), (60, -10)])
    assert point.xy == pytest.approx((67.5, 0))
    assert point.direction == pytest.approx((0.6, 0.8))


def test_flat_street_is_none():
    assert find(SOUTH, [(-100, -74), (60, -10)]) == []


def test_road_end_near_the_edge():
    (point,) = find([(300, 50), (215, 50)])
    assert (point.xy, point.direction) == (pytest.approx((200, 50)), pytest.approx((-1, 0)))


def test_road_end_too_far():
    assert find([(300, 50), (231, 50)]) == []


def test_road_that_crosses_into_the_site():
    (point,) = find([(100, -80), (100, 60)])
    assert point.xy == pytest.approx((100, 0))
    assert point.junction == point.xy
    assert point.direction == pytest.approx((0, 1))


def test_road_inside_that_begins_at_the_edge_does_not_arrive():
    assert find([(100, -0.3), (98, 60)]) == []


def test_road_through_the_site_arrives_twice():
    points = sorted(find([(100, -80), (100, 180)]), key=lambda p: p.xy)
    assert [p.xy for p in points] == [pytest.approx((100, 0)), pytest.approx((100, 100))]
    assert [p.direction for p in points] == [pytest.approx((0, 1)), pytest.approx((0, -1))]


def test_close_ones_are_merged():
    near = [(60, -110), (60, -10)], [(70, -110), (70, -10)]
    assert len(find(SOUTH, *near)) == 1
    far = [(60, -110), (60, -10)], [(75, -110), (75, -10)]
    assert len(find(SOUTH, *far)) == 2


def test_street_that_goes_on_past_the_edge_is_none():
    # West Street crosses South Street and goes on along the west edge
    assert find(SOUTH, [(-10, -110), (-10, 200)]) == []


def test_alley_only_where_no_street_is_near():
    roads = SOUTH, [(60, -110), (60, -10)], [(80, -110), (80, -10)], [(150, -110), (150, -10)]
    points = find(*roads, kinds=["", "residential", "service", "service"])
    assert [p.xy[0] for p in points] == pytest.approx([60, 150])


def test_dead_end_in_a_slot_goes_on():
    slot = Polygon([(0, 0), (95, 0), (95, 60), (105, 60), (105, 0), (200, 0), (200, 150), (0, 150)])
    points = find([(100, -50), (100, 55)], site=slot)
    assert [p.xy for p in points] == [pytest.approx((100, 60))]
    assert points[0].direction == pytest.approx((0, 1))


def a_site():
    return Site("Mill Field", 7, SITE, UTM, UTM, site_id=2)


def test_edited_layer_is_taken_back():
    frame = gpd.GeoDataFrame(
        {"bearing_deg": [90.0, None, 0.0], "name": ["West", None, "x"], "site_id": [2, 2, 1]},
        geometry=[Point(-3, 40), Point(150, 0), Point(9999, 0)],
        crs=UTM,
    )
    points = access_points_from_layer(frame, a_site(), "edited")
    by_x = sorted(points, key=lambda p: p.xy)
    assert [p.xy for p in by_x] == [pytest.approx((0, 40)), pytest.approx((150, 0))]
    assert by_x[0].direction == pytest.approx((1, 0))
    assert by_x[0].junction == pytest.approx((-3, 40))
    assert by_x[0].name == "West"
    assert by_x[1].direction == pytest.approx((0, 1))  # square to the edge, inwards


def test_point_far_from_the_edge_is_named():
    frame = gpd.GeoDataFrame(geometry=[Point(0, 40), Point(-31, 40)], index=[4, 8], crs=UTM)
    with pytest.raises(InputError, match=r"Layer 'edited', feature 8: .*31 m.*Mill Field"):
        access_points_from_layer(frame, a_site(), "edited")


def test_lines_are_refused():
    frame = gpd.GeoDataFrame(geometry=[LineString([(0, 0), (1, 0)])], crs=UTM)
    with pytest.raises(InputError, match="LineString, not a point"):
        access_points_from_layer(frame, a_site(), "edited")


def two_sites():
    return [a_site(), Site("Far Field", 9, box(900, 0, 1100, 100), UTM, UTM, site_id=3)]


def test_points_without_number_belong_to_the_nearest_site():
    places = [Point(-3, 40), Point(1103, 40), Point(890, 50)]
    frame = gpd.GeoDataFrame(geometry=places, crs=UTM)
    near, far = access_points_of_sites(frame, two_sites(), "edited")
    assert [p.xy for p in near] == [pytest.approx((0, 40))]
    assert sorted(p.xy for p in far) == [pytest.approx((900, 50)), pytest.approx((1100, 40))]
    single = access_points_from_layer(frame, a_site(), "edited", sites=two_sites())
    assert single == near


def test_numbers_come_before_nearness_and_missing_ones_are_found():
    places = [Point(-3, 40), Point(903, 40)]
    frame = gpd.GeoDataFrame({"site_id": [2, None]}, geometry=places, crs=UTM)
    near, far = access_points_of_sites(frame, two_sites(), "edited")
    assert (len(near), len(far)) == (1, 1)
    frame["site_id"] = [3, 3]
    with pytest.raises(InputError, match=r"feature 0: .* boundary of Far Field"):
        access_points_of_sites(frame, two_sites(), "edited")


def test_point_far_from_all_sites_is_named():
    frame = gpd.GeoDataFrame(
        geometry=[Point(0, 40), Point(900, 40), Point(500, 40)], index=[4, 8, 15], crs=UTM
    )
    with pytest.raises(InputError, match=r"feature 15: .*300 m.*Mill Field"):
        access_points_of_sites(frame, two_sites(), "edited")


def test_sites_in_different_zones_share_points():
    east = CRS.from_epsg(25833)
    sites = [a_site(), Site("East", 9, box(500_000, 0, 500_100, 100), east, UTM, site_id=3)]
    far = gpd.GeoSeries([Point(500_000, 50)], crs=east).to_crs(UTM)[0]
    frame = gpd.GeoDataFrame(geometry=[Point(0, 40), far], crs=UTM)
    near, there = access_points_of_sites(frame, sites, "edited")
    assert (len(near), len(there)) == (1, 1)
    assert there[0].xy == pytest.approx((500_000, 50), abs=0.01)
