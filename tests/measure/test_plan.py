from __future__ import annotations

import geopandas as gpd
import pytest
from platwright.measure import measure_plan
from shapely.geometry import LineString, Point, box

# A plane in metres, true to scale around its origin.
CRS = "+proj=tmerc +lat_0=60 +lon_0=25 +k=1 +datum=WGS84 +units=m +type=crs"


def layer(*shapes, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=CRS)


def test_a_cross_makes_four_blocks():
    plan = measure_plan(
        layer(
            LineString([(72, 0), (72, 100), (72, 200)]),
            LineString([(0, 100), (72, 100), (112, 100)]),
        ),
        layer(box(0, 0, 112, 200)),
    )
    assert plan.area == pytest.approx(2.24)
    assert plan.length == pytest.approx(312)
    assert plan.length_per_hectare == pytest.approx(312 / 2.24)
    assert (plan.bends, plan.t_junctions, plan.crossings) == (0, 0, 1)
    assert plan.blocks == 4
    assert plan.block_area == pytest.approx((0.72 + 0.40) / 2)
    assert plan.block_width == pytest.approx((72 + 40) / 2)
    assert (plan.share_wide_enough, plan.share_too_thin) == (0.5, 0.5)
    assert plan.block_length == pytest.approx(100)
    assert plan.rectangularity == pytest.approx(1)


def test_bends_and_t_junctions():
    plan = measure_plan(
        layer(
            LineString([(0, 50), (60, 50), (100, 90), (200, 90)]),
            LineString([(150, 90), (150, 0)]),
        ),
        layer(box(0, 0, 200, 200)),
    )
    assert (plan.bends, plan.t_junctions, plan.crossings) == (2, 1, 0)


def test_continued_streets():
    streets = layer(LineString([(72, 0), (72, 150)]))
    site = layer(box(0, 0, 144, 150))
    arrivals = layer(Point(72, 0), Point(72, 0), Point(0, 75), bearing_deg=[10.0, 75.0, 90.0])
    plan = measure_plan(streets, site, access_points=arrivals)
    assert (plan.continued, plan.arriving) == (1, 3)
    anywhere = arrivals.drop(columns="bearing_deg")
    assert measure_plan(streets, site, access_points=anywhere).continued == 2


def test_obstacles_are_no_blocks_and_existing_streets_are_not_counted():
    streets = layer(
        LineString([(72, 0), (72, 150)]),
        LineString([(0, 75), (72, 75)]),
        status=["new", "existing"],
    )
    lake = layer(box(72, 0, 144, 100))
    plan = measure_plan(streets, layer(box(0, 0, 144, 150)), obstacles=lake)
    assert plan.blocks == 2
    assert plan.length == pytest.approx(150)
    assert plan.t_junctions == 0


def test_no_streets_leave_one_block():
    empty = gpd.GeoDataFrame(geometry=[], crs=CRS)
    plan = measure_plan(empty, layer(box(0, 0, 72, 150)))
    assert plan.blocks == 1
    assert plan.as_dict()["block_width"] == pytest.approx(72)
    assert plan.length_per_hectare == 0
