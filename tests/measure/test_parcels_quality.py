"""The measures of parcels: values by hand, and the definitions by other code."""

from __future__ import annotations

import math
import time

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.measure.histogram import MEASURES, Measure, histogram, histogram_rows
from platwright.measure.parcel_ideal import ideal_area_ratio, ideal_distance, outline_points
from platwright.measure.parcel_shape import rectangle_area, rectangles
from platwright.measure.parcels import Ideal, measure_parcels
from platwright.progress import Silent
from shapely import affinity
from shapely.geometry import LineString, Point, Polygon, box

CRS = 32633
WIDE, DEEP = 18.0, 30.0


def frame(shapes, **columns):
    """Return a layer, its origin where lengths in this CRS are true."""
    moved = [None if s is None else affinity.translate(s, 500_000, 6_000_000) for s in shapes]
    return gpd.GeoDataFrame(columns, geometry=moved, crs=CRS)


def measured(*shapes, streets=None, **more):
    """Measure shapes as one layer."""
    street = None if streets is None else frame(streets)
    return measure_parcels(frame(shapes), streets=street, **more)


def values(report, name):
    return report.parcels[name].tolist()


# Shapes by hand


def test_a_rectangle_is_perfect_however_it_lies():
    lot = affinity.rotate(box(0, 0, WIDE, DEEP), 33)
    report = measured(lot)
    for name, value in (
        ("area_m2", 540), ("p_angle", 0), ("p_area", 1), ("p_ideal", 1), ("depth_m", 30),
        ("width_m", 18), ("frontage_m", 96),
    ):  # fmt: skip
        assert values(report, name) == pytest.approx([value], abs=1e-6), name
    assert values(report, "p_similarity") == pytest.approx([0], abs=1e-6)
    assert values(report, "undesirable") == [False]


def test_a_triangle():
    # corners of 90, 45, 45 degrees; rectangle 20 x 20 m around 200 m2
    report = measured(Polygon([(0, 0), (20, 0), (0, 20)]))
    assert values(report, "p_angle") == pytest.approx([30])
    assert values(report, "p_area") == pytest.approx([2])
    assert values(report, "p_ideal") == pytest.approx([540 / 200])
    assert values(report, "undesirable") == [True]


def test_a_trapezoid():
    # slanted side 20 : 20, so 90, 90, 45 and 135 degrees; 20 x 40 m around 600 m2
    report = measured(Polygon([(0, 0), (40, 0), (20, 20), (0, 20)]))
    assert values(report, "p_angle") == pytest.approx([22.5])
    assert values(report, "p_area") == pytest.approx([800 / 600])


def test_an_l_is_square_and_yet_no_rectangle():
    lot = Polygon([(0, 0), (30, 0), (30, 10), (10, 10), (10, 30), (0, 30)])
    report = measured(lot)
    assert values(report, "p_angle") == pytest.approx([0])
    # the rectangle along the diagonal of its notch is smaller than 30 x 30 m
    assert values(report, "p_area")[0] == pytest.approx(
        shapely.oriented_envelope(lot).area / lot.area
    )
    assert values(report, "undesirable") == [True]


def test_jogs_of_surveyed_outlines_go_with_the_tolerance():
    lot = Polygon([(0, 0), (18, 0), (18, 10), (17.4, 10.6), (17.4, 30), (0, 30)])
    # corners of 135 degrees at both ends of the jog
    assert values(measured(lot), "p_angle") == pytest.approx([90 / 6])
    one = measured(lot, ideal=Ideal(tolerance=1))
    assert values(one, "p_angle")[0] < 1
    assert one.p_angle_surveyed == pytest.approx(values(one, "p_angle")[0])


# Frontage, depth, access


def test_depth_is_measured_from_the_street():
    wide = box(0, 0, 40, 25)
    south = [LineString([(-50, -7), (90, -7)])]
    west = [LineString([(-7, -50), (-7, 90)])]
    assert values(measured(wide, streets=south), "depth_m") == pytest.approx([25])
    assert values(measured(wide, streets=west), "depth_m") == pytest.approx([40])
    # at a corner the shorter side is the front
    assert values(measured(wide, streets=south + west), "depth_m") == pytest.approx([40])
    assert values(measured(wide, streets=south + west), "frontage_m") == pytest.approx([65])


def test_width_times_depth_is_the_area():
    lot = Polygon([(0, 0), (40, 0), (20, 20), (0, 20)])
    report = measured(lot, streets=[LineString([(-9, -5), (60, -5)])])
    assert values(report, "depth_m") == pytest.approx([20])
    assert values(report, "width_m") == pytest.approx([30])


def test_the_end_of_a_street_gives_access():
    ring = Point(0, 0).buffer(14)
    lot = shapely.box(-60, -60, 60, 60).difference(ring).intersection(box(-10, 0, 10, 60))
    lane = LineString([(0, -60), (0, 0)])
    (length,) = values(measured(lot, streets=[lane]), "frontage_m")
    arc = 2 * 14 * math.asin(10 / 14)
    assert length == pytest.approx(arc, rel=0.01)


def test_a_side_square_to_the_end_of_a_street_has_no_frontage():
    # the street passes in front and ends 5 m beyond the side
    lot, street = box(0, 0, 18, 30), LineString([(-40, -7.5), (23, -7.5)])
    assert values(measured(lot, streets=[street]), "frontage_m") == pytest.approx([18])


def test_parcels_drawn_up_to_the_centre_line_have_frontage_there():
    pair = box(0, 0, 18, 30), box(0, -30, 18, 0)
    street = LineString([(0, 0), (18, 0)])
    assert values(measured(*pair, streets=[street], reach=5), "frontage_m") == pytest.approx(
        [18 + 0, 18 + 0]
    )


def test_neighbours_need_not_share_vertices():
    # a long lot behind two, gaps of half a metre between all
    lots = box(0, 0, 18, 30), box(18.5, 0, 36, 30), box(0, 30.5, 36, 60)
    assert values(measured(*lots), "frontage_m") == pytest.approx(
        [18 + 30, 17.5 + 30, 36 + 2 * 29.5 + 0.5], abs=0.1
    )


def test_stacked_parcels_do_not_hide_their_frontage():
    lot = box(0, 0, 18, 30)
    assert values(measured(lot, lot, box(18, 0, 36, 30)), "frontage_m") == pytest.approx(
        [66, 66, 66]
    )


def test_a_lot_inside_another_has_no_access():
    hole = box(10, 10, 20, 20)
    report = measured(box(0, 0, 30, 30).difference(hole), hole)
    assert values(report, "access") == [True, False]
    assert report.figures.no_access == 1


@given(st.integers(0, 10_000))
@settings(max_examples=40)
def test_frontage_is_what_shapely_finds(seed):
    """Random rows of lots with bent streets, against buffers and intersections."""
    random = np.random.default_rng(seed)
    xs = np.cumsum(random.uniform(8, 30, 6))
    top, low = random.uniform(25, 40, 6), random.uniform(-6, 6, 6)
    lots = [
        Polygon(
            [(xs[k], low[k]), (xs[k + 1], low[k + 1]), (xs[k + 1], top[k + 1]), (xs[k], top[k])]
        )
        for k in range(5)
    ]
    turn = float(random.uniform(0, 360))
    lots = [affinity.rotate(lot, turn, origin=(0, 0)) for lot in lots]
    found = values(measured(*lots), "frontage_m")
    outer = shapely.union_all(lots).exterior.buffer(0.01)
    for lot, length in zip(lots, found, strict=True):
        assert length == pytest.approx(lot.exterior.intersection(outer).length, abs=0.2)


# Definitions by other code


def random_parcels(seed, count=20):
    random = np.random.default_rng(seed)
    for _ in range(count):
        hull = shapely.MultiPoint(
            random.uniform(0, 40, (int(random.integers(4, 9)), 2))
        ).convex_hull
        if hull.area > 50:
            yield affinity.rotate(hull, float(random.uniform(0, 360)))


@given(st.integers(0, 10_000))
@settings(max_examples=25)
def test_rectangles_are_the_smallest_of_all_turns(seed):
    lots = list(random_parcels(seed, 8))
    axis, sides = rectangles(np.array(lots, dtype=object))
    for lot, way, (along, across) in zip(lots, axis, sides, strict=True):
        turns = np.radians(np.arange(0, 90, 0.5))
        xy = np.array(lot.exterior.coords)
        spans = [
            np.ptp(xy @ [np.cos(t), np.sin(t)]) * np.ptp(xy @ [-np.sin(t), np.cos(t)])
            for t in turns
        ]
        assert along * across <= min(spans) + 1e-6
        assert along == pytest.approx(np.ptp(xy @ way))
        assert along * across == pytest.approx(shapely.oriented_envelope(lot).area)
    assert rectangle_area(np.array(lots, dtype=object)) == pytest.approx(sides.prod(axis=1))


def registered(lot, width, depth, starts=720):
    """Try many starts of the rectangle's outline; the best similarity of all by least squares."""
    outline = shapely.geometry.polygon.orient(lot).exterior
    ring = box(0, 0, width, depth).exterior
    ring = shapely.geometry.polygon.orient(Polygon(ring)).exterior
    count = 64
    z = np.array([outline.interpolate(k / count, normalized=True).coords[0] for k in range(count)])
    best = math.inf, math.inf
    for start in np.arange(starts) / starts:
        w = np.array(
            [
                ring.interpolate((start + k / count) % 1, normalized=True).coords[0]
                for k in range(count)
            ]
        )
        # unknowns c, s, a, b of the similarity (UP 4.1)
        rows = np.zeros((2 * count, 4))
        rows[0::2] = np.c_[w[:, 0], -w[:, 1], np.ones(count), np.zeros(count)]
        rows[1::2] = np.c_[w[:, 1], w[:, 0], np.zeros(count), np.ones(count)]
        solution = np.linalg.lstsq(rows, z.ravel(), rcond=None)[0]
        rest = (rows @ solution - z.ravel()).reshape(-1, 2)
        best = min(best, (float((rest**2).sum()), float(np.hypot(*rest.T).mean())))
    return best[1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_distance_is_that_of_the_best_similarity(seed):
    for lot in list(random_parcels(seed, 3)):
        (found,) = ideal_distance(np.array([lot], dtype=object), WIDE, DEEP)
        # outlines are sampled from another vertex there, so the two differ a little
        assert found == pytest.approx(registered(lot, WIDE, DEEP, 180), rel=0.03, abs=0.05)


def test_the_distance_of_a_square_and_of_a_circle():
    # squares of 20 and of 10 m: only the scale differs
    assert ideal_distance(np.array([box(0, 0, 20, 20)]), 10, 10) == pytest.approx([0], abs=1e-9)
    circle = Point(0, 0).buffer(20, quad_segs=64)
    (found,) = ideal_distance(np.array([circle]), 30, 30)
    assert found == pytest.approx(registered(circle, 30, 30, 90), rel=0.02)


@given(st.integers(0, 10_000), st.floats(0, 360), st.floats(0.2, 5))
@settings(max_examples=25)
def test_the_distance_turns_and_grows_with_the_parcel(seed, turn, scale):
    lots = np.array(list(random_parcels(seed, 4)), dtype=object)
    before = ideal_distance(lots, WIDE, DEEP)
    moved = [affinity.scale(affinity.rotate(lot, turn), scale, scale).reverse() for lot in lots]
    after = ideal_distance(np.array(moved, dtype=object), WIDE, DEEP)
    assert after == pytest.approx(before * scale, rel=1e-3, abs=1e-6)


def test_outline_points_lie_evenly_on_the_outline():
    lot = Polygon([(500000, 6700000), (500030, 6700000), (500030, 6700018), (500000, 6700020)])
    (points,) = outline_points(np.array([lot]), 64)
    gaps = np.abs(np.diff(points, append=points[:1]))
    assert np.median(gaps) == pytest.approx(lot.length / 64)
    middle = lot.envelope.centroid
    spots = shapely.points(points.real + middle.x, points.imag + middle.y)
    assert shapely.distance(spots, lot.exterior) == pytest.approx(np.zeros(64), abs=1e-6)


def test_the_area_ratio_treats_less_and_more_alike():
    lots = np.array([box(0, 0, 18, 15), box(0, 0, 18, 60), box(0, 0, 30, 18)])
    assert ideal_area_ratio(lots, WIDE, DEEP) == pytest.approx([2, 2, 1])


# The layer as a whole


def test_figures_by_hand():
    lots = box(0, 0, 10, 30), box(10, 0, 30, 30), Polygon([(30, 0), (50, 0), (30, 20)])
    figures = measured(*lots, site=frame([box(0, 0, 100, 100)])).figures
    area = np.array([300, 600, 200])
    assert figures.count == 3
    assert figures.per_km2 == pytest.approx(300)
    assert figures.mean_area == pytest.approx(area.mean())
    assert figures.median_area == pytest.approx(300)
    assert figures.cv_area == pytest.approx(area.std() / area.mean())
    assert figures.p_angle == pytest.approx(30 / 3)
    assert figures.p_area == pytest.approx((1 + 1 + 2) / 3)
    assert figures.p_ideal == pytest.approx((540 / 300 + 600 / 540 + 540 / 200) / 3)
    assert (figures.undesirable, figures.undesirable_pct) == pytest.approx((1, 100 / 3))
    assert figures.access_pct == 100
    shared = 30 + 30 + 20 + 20
    whole = 80 + 100 + 40 + math.hypot(20, 20)
    assert figures.frontage_pct == pytest.approx(100 * (whole - shared) / whole)


def test_the_layer_that_was_given_stays_as_it_was():
    given = frame([box(0, 0, 18, 30), None], AREA_M2=[1.0, 2.0], name=["a", "b"])
    given.index = [7, 9]
    before = given.copy()
    report = measure_parcels(given)
    assert given.equals(before)
    assert report.parcels.index.tolist() == [7, 9]
    assert report.parcels["name"].tolist() == ["a", "b"]
    assert "AREA_M2" not in report.parcels.columns
    assert report.parcels["area_m2"].isna().tolist() == [False, True]
    assert report.parcels["access"].tolist() == [True, None]
    assert report.problems["feature"].tolist() == ["9"]


def test_values_are_the_same_in_any_order_and_place():
    random = np.random.default_rng(5)
    lots = list(random_parcels(4, 12))
    spread = [affinity.translate(lot, 60 * k, 0) for k, lot in enumerate(lots)]
    names = ["area_m2", "frontage_m", "depth_m", "p_angle", "p_area", "p_ideal", "p_similarity"]
    plain = measured(*spread).parcels[names].to_numpy(dtype=float)
    order = random.permutation(len(spread))
    moved = [affinity.translate(spread[k], 1234.5, -678.9) for k in order]
    again = measured(*moved).parcels[names].to_numpy(dtype=float)
    assert again == pytest.approx(plain[order], rel=1e-4, abs=1e-3)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"width": 0}, "width"), ({"depth": math.inf}, "depth"), ({"tolerance": -1}, "simplified"),
    ],
)  # fmt: skip
def test_an_ideal_that_is_none_is_refused(options, text):
    with pytest.raises(InputError, match=text):
        Ideal(**options)


def test_no_polygons_are_refused():
    with pytest.raises(InputError, match=r"'Parcels'.*no polygons"):
        measure_parcels(frame([LineString([(0, 0), (1, 1)])]))
    with pytest.raises(InputError, match="coordinate reference system"):
        measure_parcels(frame([box(0, 0, 1, 1)]).set_crs(None, allow_override=True))


def test_cancel_ends_the_work():
    class Stopped(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        measure_parcels(frame([box(0, 0, 18, 30)]), progress=Stopped())


# Histograms


def test_classes_hold_their_lower_bound():
    found = histogram(
        np.array([0.0, 0.999, 1.0, 5.0, 99.0, np.inf, np.nan, -1e-9]),
        Measure("x", "X", "m", (0, 1, 5)),
    )
    assert found.counts.tolist() == [3, 1, 3]
    assert found.mean == pytest.approx((0.999 + 1 + 5 + 99) / 6)
    assert found.labels() == ["0 to 1", "1 to 5", "5 and more"]
    rows = histogram_rows([found])
    assert rows["count"] == [3, 1, 3]
    assert sum(rows["share_pct"]) == pytest.approx(100)
    assert math.isnan(rows["bin_to"][-1])


def test_every_measure_has_rising_classes():
    for measure in MEASURES:
        assert list(measure.bounds) == sorted(set(measure.bounds))
        assert measure.limit is None or measure.limit in measure.bounds


# Real parcels, and many


def test_real_parcels_as_measured_before(shared_data):
    """Figures of another measurement: p_angle 8.56 and 4.52 degrees in the blocks, here of all."""
    file = shared_data / "parcels" / "cambridge_ma_cambridgeport_grid.gpkg"
    lots = gpd.read_file(file, layer="parcels")
    fine, coarse = (measure_parcels(lots, ideal=Ideal(tolerance=t)).figures for t in (0.05, 1.0))
    assert fine.count == len(lots) == 1596
    assert coarse.p_angle < 0.7 * fine.p_angle
    assert coarse.p_area == fine.p_area == pytest.approx(1.12, abs=0.02)
    envelopes = shapely.oriented_envelope(lots.geometry.array)
    parts = np.array([max(g.geoms, key=lambda p: p.area) for g in lots.geometry], dtype=object)
    envelopes = shapely.area(shapely.oriented_envelope(parts))
    assert fine.p_area == pytest.approx(float((envelopes / shapely.area(parts)).mean()), rel=1e-3)


@pytest.mark.slow
def test_a_hundred_thousand_parcels_are_measured_in_seconds():
    at = np.arange(100_000)
    block, k = at // 40, at % 40
    x, y = (block % 50) * 375.0 + (k % 20) * 18.0, (block // 50) * 75.0 + (k // 20) * 30.0
    lots = shapely.box(x + 5e5, y + 67e5, x + 5e5 + 18, y + 67e5 + 30)
    began = time.process_time()
    layer = gpd.GeoDataFrame(geometry=lots, crs=3067)
    report = measure_parcels(layer)
    assert time.process_time() - began < 30
    assert report.figures.mean_frontage == pytest.approx((18 * 36 + 48 * 4) / 40)
    assert report.figures.mean_depth == pytest.approx(30)
