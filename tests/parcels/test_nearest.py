"""Short cuts to the nearest edge give what the long way gives."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from platwright.parcels.field.crosses import cross_field
from platwright.parcels.field.outline import NearestEdge, outline
from platwright.parcels.split.ground import _nearest
from shapely.geometry import Polygon

SLITTED = Polygon(
    [(0, 0), (300, 20), (320, 200), (180, 190), (170, 60), (160, 195), (10, 170)],
    [[(40, 60), (40, 120), (90, 110), (85, 50)]],
)


@pytest.mark.parametrize("limit", [4.0, 30.0])
def test_distances_up_to_a_limit_are_those_without_one(limit: float) -> None:
    points = np.random.default_rng(3).uniform((-60, -60), (380, 260), (4000, 2))
    edges = outline(SLITTED)
    nearest = NearestEdge(edges, 5.0)
    distance, edge = nearest.within(points, limit)
    true = shapely.distance(shapely.boundary(SLITTED), shapely.points(points))
    near = true <= limit
    assert near.any()
    assert (~near).any()
    whole, number = nearest(points)
    assert (distance[near] == whole[near]).all()
    assert (edge[near] == number[near]).all()
    assert (distance[~near] >= limit).all()


def test_no_points_have_no_distances() -> None:
    distance, edge = NearestEdge(outline(SLITTED), 5.0).within(np.zeros((0, 2)), 9.0)
    assert distance.shape == edge.shape == (0,)


def test_values_on_the_raster_are_bilinear_to_the_bit() -> None:
    grid = cross_field(SLITTED).grid
    points = np.random.default_rng(5).uniform((-40, -40), (360, 240), (500, 2)) @ [1, 1j]
    cross, inside = grid.take(points, grid.cross, grid.inside)
    at, x, y = grid._place(points)
    for value, found in ((grid.cross, cross), (grid.inside, inside)):
        low = value[at] + (value[at + 1] - value[at]) * y
        above = at + grid.shape[1]
        high = value[above] + (value[above + 1] - value[above]) * y
        assert (found == low + (high - low) * x).all()


def test_the_nearest_segment_is_that_of_the_distances() -> None:
    rng = np.random.default_rng(8)
    segments = rng.uniform(0, 200, (40, 2, 2))
    segments[7, 1] = segments[7, 0]
    xy = rng.uniform(-20, 220, (900, 2))
    found = _nearest(xy, segments)
    lines = shapely.linestrings(segments)
    table = shapely.distance(shapely.points(xy)[:, None], lines[None])
    assert table[np.arange(len(xy)), found] == pytest.approx(table.min(axis=1), abs=1e-9)
