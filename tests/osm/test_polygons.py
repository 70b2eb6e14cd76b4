"""Areas on the globe and areas out of lines."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.osm.polygons import (
    area_ha,
    area_of_element,
    areal_part,
    crosses_antimeridian,
    rings_to_area,
    same_area,
)


def test_a_square_of_a_hundredth_of_a_degree_at_the_equator():
    # 1113.195 m east (6378137 m * pi / 18000) by 1105.743 m north (meridian arc at the equator)
    assert area_ha(shapely.box(0, 0, 0.01, 0.01)) == pytest.approx(123.0907, rel=1e-4)


def test_holes_and_parts_count_whatever_their_direction():
    outer, hole = shapely.box(0, 0, 0.03, 0.03), shapely.box(0.01, 0.01, 0.02, 0.02)
    for ring in (hole.exterior, shapely.reverse(hole.exterior)):
        assert area_ha(shapely.polygons(outer.exterior, [ring])) == pytest.approx(
            area_ha(outer) - area_ha(hole)
        )
    both = shapely.MultiPolygon([hole, shapely.box(1, 1, 1.01, 1.01)])
    assert area_ha(both) > 1.99 * area_ha(hole)


def ring_pieces(polygon, cuts, flips):
    """Cut the rings of a polygon into lines, some of them turned round."""
    pieces = []
    for ring in (polygon.exterior, *polygon.interiors):
        points = list(ring.coords)
        ends = sorted({0, len(points) - 1, *(c % (len(points) - 1) for c in cuts)})
        pieces.append([shapely.LineString(points[a : b + 1]) for a, b in zip(ends, ends[1:])])
    return [
        [shapely.reverse(line) if flips >> k & 1 else line for k, line in enumerate(lines)]
        for lines in pieces
    ]


@st.composite
def star(draw):
    """A star-shaped polygon with a hole, its rings in any number of pieces."""
    count = draw(st.integers(5, 20))
    radii = np.array(draw(st.lists(st.floats(1, 3), min_size=count, max_size=count)))
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    around = np.c_[radii * np.cos(angles), radii * np.sin(angles)]
    return shapely.Polygon(around, [0.2 * around[::-1]])


@given(star(), st.lists(st.integers(0, 50), max_size=4), st.integers(0, 63))
def test_cut_rings_close_again(polygon, cuts, flips):
    outer, inner = ring_pieces(polygon, cuts, flips)
    made = rings_to_area(reversed(outer), inner)
    assert shapely.symmetric_difference(made, polygon).area < 1e-9


@given(star(), st.integers(1, 50))
def test_a_ring_with_a_piece_missing_is_no_area(polygon, cut):
    outer, inner = ring_pieces(polygon, [cut % 4 + 1], 0)
    assert rings_to_area(outer[1:], inner) is None
    assert rings_to_area([*outer, None], inner) is None


def test_an_island_in_a_lake_on_an_island():
    rings = [shapely.box(-r, -r, r, r).exterior for r in (4, 3, 1)]
    assert rings_to_area(rings, []).area == pytest.approx(64 - 36 + 4)


def test_members_that_only_describe_are_left_out():
    ring = shapely.box(7, 43, 8, 44).exterior
    line = [{"lon": x, "lat": y} for x, y in ring.coords]
    element = {
        "type": "relation",
        "members": [
            {"type": "node", "ref": 1, "role": "label"},
            {"type": "way", "ref": 2, "role": "outer", "geometry": line},
            {"type": "way", "ref": 3, "role": "subarea", "geometry": line[:2]},
        ],
    }
    assert area_of_element(element).area == pytest.approx(1)
    assert area_of_element({"type": "way", "geometry": line[:3]}) is None
    assert area_of_element({"type": "way"}) is None
    assert area_of_element({"type": "node", "lat": 1, "lon": 2}) is None


@pytest.mark.parametrize(
    "wkt", ["POINT (1 1)", "LINESTRING (0 0, 1 1)", "POLYGON EMPTY", "POLYGON ((0 0, 1 1, 0 0))"]
)
def test_what_has_no_area_is_none(wkt):
    assert areal_part(shapely.from_wkt(wkt)) is None
    assert areal_part(None) is None


def test_a_bow_tie_is_repaired():
    made = areal_part(shapely.from_wkt("POLYGON Z ((0 0 1, 2 2 1, 2 0 1, 0 2 1, 0 0 1))"))
    assert made.is_valid
    assert not made.has_z
    assert made.area == pytest.approx(2)


@given(star(), st.floats(-0.004, 0.004))
def test_the_same_ground_with_other_edges(polygon, width):
    assert same_area(polygon, polygon.buffer(width))
    assert not same_area(polygon, shapely.affinity.translate(polygon, 1.0))
    assert not same_area(polygon, polygon.buffer(0.5))


def test_the_180th_meridian():
    halves = shapely.union(shapely.box(179, 0, 180, 1), shapely.box(-180, 0, -179, 1))
    assert crosses_antimeridian(halves)
    assert not crosses_antimeridian(shapely.box(179, 0, 180, 1))
    assert not crosses_antimeridian(shapely.box(-179, 0, 179, 1))
