import pytest
from platwright.site import BoundaryStreet, Site, carry_to_centre_line
from pyproj import CRS
from shapely.geometry import LineString, box

UTM = CRS.from_epsg(25832)


def site(*lines):
    streets = tuple(BoundaryStreet(LineString(x)) for x in lines)
    return Site("s", 1, box(0, 0, 200, 100), UTM, UTM, boundary_streets=streets)


SOUTH = [(-100, -10), (300, -10)]


def test_straight_on():
    assert carry_to_centre_line(site(SOUTH), (60, 0), (0, -1)) == pytest.approx((60, -10))


def test_oblique_within_twice_the_gap():
    # direction (0.6, -0.8): 12.5 m of way for a gap of 10 m
    got = carry_to_centre_line(site(SOUTH), (60, 0), (6, -8))
    assert got == pytest.approx((67.5, -10))


def test_nearest_point_where_straight_on_is_too_far():
    got = carry_to_centre_line(site(SOUTH), (60, 0), (1, -0.2))
    assert got == pytest.approx((60, -10))


def test_on_the_centre_line_itself():
    assert carry_to_centre_line(site([(0, 0), (200, 0)]), (60, 0), (0, -1)) == (60, 0)


def test_nothing_near():
    assert carry_to_centre_line(site(), (60, 0), (0, -1)) is None
    assert carry_to_centre_line(site(SOUTH), (60, 100), (0, 1)) is None
    assert carry_to_centre_line(site(SOUTH), (60, 0), (0, -1), max_distance=8) is None


def test_not_across_the_site():
    # from the west edge the street south of the site is only reached across it
    assert carry_to_centre_line(site([(50, -10), (200, -10)]), (0, 30), (-1, 0), 100) is None
