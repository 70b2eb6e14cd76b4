"""Ground of points alone."""

from __future__ import annotations

import geopandas as gpd
import pytest
from platwright.errors import InputError
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.grow import grow
from platwright.growth.land.pointground import ground_of_points
from platwright.growth.rules import GrowthRules
from shapely.geometry import LineString, Point

GRID = shipped_grammar("grid")


def layer(shapes, crs="EPSG:25832", **columns):
    return gpd.GeoDataFrame(columns, geometry=shapes, crs=crs)


def test_every_point_is_a_start_with_its_direction():
    points = layer([Point(500000, 0), Point(500900, 0)], direction=[90.0, None])
    real = ground_of_points(points, GRID, direction=180.0, point_layer="Centres")
    first, second = real.ground.starts
    assert (first.xy, second.xy) == ((500000, 0), (500900, 0))
    assert first.direction == pytest.approx((1, 0))
    assert second.direction == pytest.approx((0, -1))
    assert {start.state for start in real.ground.starts} == {GRID.start}
    assert real.ground.domain is None
    growth = grow(real.ground, GrowthRules(GRID, max_segments=60))
    # both have grown
    for x in (500000, 500900):
        near = abs(growth.xy[growth.ends].mean(axis=1) - (x, 0)).max(axis=1) < 60
        assert near.any()


def test_degrees_become_metres():
    real = ground_of_points(layer([Point(9.5, 47.1)], "EPSG:4326"), GRID)
    assert real.crs.to_epsg() == 32632
    assert real.source_crs.to_epsg() == 4326
    assert real.ground.starts[0].direction == (0, 1)


def test_what_is_no_point_is_told():
    shapes = [Point(500000, 0), None, LineString([(0, 0), (1, 1)])]
    real = ground_of_points(layer(shapes), GRID, point_layer="Centres")
    assert len(real.ground.starts) == 1
    assert set(real.problems["layer"]) == {"Centres"}
    assert len(real.problems) == 2
    with pytest.raises(InputError, match=r"Centres.*no point"):
        ground_of_points(layer([None]), GRID, point_layer="Centres")
    with pytest.raises(InputError, match="coordinate reference system"):
        ground_of_points(layer([Point(0, 0)], crs=None), GRID)
