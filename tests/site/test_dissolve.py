import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.site.dissolve import dissolve
from platwright.site.repair import Problems, repair_polygons
from pyproj import CRS
from shapely.geometry import Polygon, box

UTM = CRS.from_epsg(25832)


def run(*polygons):
    array = np.array(polygons, dtype=object)
    problems = Problems()
    sites = dissolve(array, np.arange(len(array)), "parcels", UTM, problems)
    return sites, problems.to_frame(UTM)


def test_adjoining_parcels_become_one():
    sites, problems = run(box(0, 0, 10, 20), box(10, 0, 30, 20))
    assert len(sites) == 1
    assert sites[0][0].equals(box(0, 0, 30, 20))
    assert sites[0][1] == [0, 1]
    assert len(problems) == 0


def test_a_gap_of_less_than_a_metre_is_closed():
    sites, problems = run(box(0, 0, 10, 20), box(10.6, 0, 30, 20))
    assert len(sites) == 1
    assert sites[0][0].area == pytest.approx(600, abs=0.1)
    assert problems["action"].tolist() == ["closed"]
    assert problems.geometry[0].area == pytest.approx(12, abs=0.1)


def test_a_lane_is_not_closed_and_the_order_is_kept():
    sites, _ = run(box(100, 0, 110, 20), box(0, 0, 10, 20), box(13, 0, 30, 20))
    assert [s[0].area for s in sites] == [200, 200, 340]
    assert [s[1] for s in sites] == [[0], [1], [2]]


def test_overlaps_count_once():
    sites, _ = run(box(0, 0, 20, 20), box(15, 0, 30, 20))
    assert sites[0][0].area == pytest.approx(600)


def test_parcels_that_meet_at_a_corner_stay_two_with_their_own_ids():
    sites, _ = run(box(0, 0, 20, 20), box(20, 20, 40, 40))
    assert [(s[0].area, s[1]) for s in sites] == [(400, [0]), (400, [1])]


def test_slit_in_the_middle_is_filled_and_a_real_hole_stays():
    ring = Polygon(box(0, 0, 100, 100).exterior, [
        box(20, 20, 20.6, 40).exterior, box(50, 50, 70, 70).exterior,
    ])  # fmt: skip
    sites, problems = run(ring)
    assert sites[0][0].area == pytest.approx(100 * 100 - 20 * 20)
    assert problems["problem"].tolist() == ["a hole narrower than 1 m"]


def test_needle_is_cut_off():
    shape = shapely.union(box(0, 0, 50, 50), box(50, 20, 90, 20.4))
    sites, problems = run(shape)
    assert sites[0][0].area == pytest.approx(2500, abs=0.5)
    assert problems["action"].tolist() == ["cut off"]


def test_strip_narrower_than_half_a_metre_is_no_site():
    sites, problems = run(box(0, 0, 50, 0.4))
    assert sites == []
    assert problems["severity"].tolist() == ["error"]


def test_holes_that_touch_each_other_and_the_edge_are_parted():
    shape = Polygon(box(0, 0, 100, 100).exterior, [
        [(30, 30), (40, 40), (30, 50), (20, 40)], [(40, 40), (50, 30), (60, 40), (50, 50)],
        [(100, 70), (90, 80), (80, 70), (90, 60)],
    ])  # fmt: skip
    assert shape.is_valid
    sites, problems = run(shape)
    ((site, _),) = sites
    rings = shapely.get_parts(site.boundary)
    pairs = [(a, b) for k, a in enumerate(rings) for b in rings[:k]]
    assert all(a.distance(b) > 0.1 for a, b in pairs)
    assert site.area == pytest.approx(shape.area, abs=2)
    assert problems["action"].tolist() == ["parted by a cut of 0.5 m"]


def test_rings_turn_the_right_way():
    shape = Polygon(box(0, 0, 100, 100).exterior, [box(50, 50, 70, 70).exterior])
    ((site, _),) = run(shape)[0]
    assert site.exterior.is_ccw
    assert not site.interiors[0].is_ccw


corner = st.tuples(st.integers(0, 400), st.integers(0, 400)).map(lambda t: (t[0] / 7, t[1] / 7))
shapes = st.one_of(
    st.lists(corner, min_size=3, max_size=7).map(Polygon),
    st.tuples(corner, st.floats(0.2, 30), st.floats(0.2, 30)).map(
        lambda t: box(t[0][0], t[0][1], t[0][0] + t[1], t[0][1] + t[2])
    ),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(shapes, min_size=1, max_size=6))
def test_sites_are_valid_apart_and_stay_as_they_are(given_shapes):
    problems = Problems()
    array = np.array(given_shapes, dtype=object)
    polygons, own = repair_polygons(array, np.arange(len(array)), "x", UTM, problems)
    once = [s for s, _ in dissolve(polygons, own, "x", UTM, problems)]
    assert all(s.is_valid and s.geom_type == "Polygon" and s.area >= 1 for s in once)
    for k, a in enumerate(once):
        assert all(a.intersection(b).area < 1e-6 for b in once[:k])
    covered = shapely.union_all(polygons).area
    assert sum(s.area for s in once) <= covered + 2 * sum(p.length for p in polygons)
    array = np.array([shapely.from_wkb(shapely.to_wkb(s)) for s in once], dtype=object)
    again = Problems()
    polygons, own = repair_polygons(array, np.arange(len(array)), "x", UTM, again)
    twice = [s for s, _ in dissolve(polygons, own, "x", UTM, again)]
    assert len(twice) == len(once)
    assert all(a.equals_exact(b, 1e-9) for a, b in zip(once, twice))
