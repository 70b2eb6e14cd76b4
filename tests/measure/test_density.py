"""Road area, road length and the ground they lie on, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.measure.density import (
    WIDTHS,
    alpha_area,
    alpha_shape,
    level_widths,
    road_area,
    road_area_share,
    road_density,
)
from platwright.measure.graph import build_graph
from platwright.parcels.streetspace import StreetWidths
from shapely.geometry import LineString, box


def street(*points):
    return LineString(points)


def test_usual_widths_are_those_that_blocks_are_cut_with():
    assert [WIDTHS[k] for k in (1, 2, 3, 4)] == StreetWidths().by_level.tolist()
    assert level_widths(np.array([1, 3, 9])).tolist() == [20, 12, 12]


def test_a_street_is_as_wide_as_it_is_and_ends_straight():
    graph = build_graph([street((0, 0), (100, 0))])
    assert road_area(graph, 10.0).area == pytest.approx(1000)
    assert road_area(graph).area == pytest.approx(1200)


def test_a_crossing_is_counted_once():
    graph = build_graph([street((0, 0), (50, 0), (100, 0)), street((50, -50), (50, 0), (50, 50))])
    assert road_area(graph, 10.0).area == pytest.approx(2 * 1000 - 100)


def test_a_t_is_counted_once():
    graph = build_graph([street((0, 0), (100, 0)), street((50, 0), (50, 50))])
    assert road_area(graph, 10.0).area == pytest.approx(1000 + 450)


def test_a_corner_of_two_edges_is_closed():
    graph = build_graph([street((0, 0), (100, 0)), street((100, 0), (100, 100))])
    # Two strips, less the square that they share, and a quarter disc at the outer side.
    quarter = math.pi * 25 / 4
    assert road_area(graph, 10.0).area == pytest.approx(2000 - 25 + quarter, abs=0.5)


def test_where_a_wide_street_becomes_narrow_nothing_stands_out():
    graph = build_graph([street((0, 0), (100, 0)), street((100, 0), (200, 0))])
    assert road_area(graph, [20.0, 10.0]).area == pytest.approx(3000)


def test_density_of_a_square_kilometre():
    # Ten streets of 1 km each, 12 m wide, without a crossing.
    graph = build_graph([street((0, y), (1000, y)) for y in range(50, 1050, 100)])
    ground = box(0, 0, 1000, 1000)
    found = road_density(graph, ground=ground)
    assert (found.ground, found.length) == (1e6, 1e4)
    assert found.km_per_km2 == pytest.approx(10)
    assert found.hm_per_hm2 == pytest.approx(1)
    assert found.share == pytest.approx(0.12)
    assert road_area_share(graph, 24.0, ground) == pytest.approx(0.24)


def test_what_lies_outside_does_not_count():
    graph = build_graph([street((0, 50), (300, 50)), street((0, 0), (100, 0))])
    found = road_density(graph, 10.0, box(0, 0, 100, 100))
    # 100 m inside, and 100 m along the edge with half of their width.
    assert found.length == pytest.approx(200)
    assert found.roads == pytest.approx(1000 + 500)


def test_a_street_along_the_edge_counts_wherever_rounding_puts_it():
    # Every 5 m a hair to either side, as after a change of the CRS.
    for shift in (1e-7, -1e-7, 0.3):
        edge = [(x, shift * (-1) ** k) for k, x in enumerate(np.arange(0.0, 201.0, 5.0))]
        graph = build_graph(
            [street(*edge), street((100, 50), (100, 150)), street((0, 90), (40, 98))]
        )
        found = road_density(graph, 10.0, box(0, 0, 200, 100))
        # What crosses the edge ends there, at a right angle or not.
        assert found.length == pytest.approx(
            street(*edge).length + 50 + math.hypot(40, 8), abs=0.2
        ), shift
    beside = build_graph([street((0, -1.5), (200, -1.5))])
    assert road_density(beside, 10.0, box(0, 0, 200, 100)).length == 0


def test_road_area_is_the_same_in_tiles_as_at_once():
    rng = np.random.default_rng(4)
    # Over several tiles of the sum, and longer than one.
    graph = build_graph([street(*rng.uniform(-2500, 2500, (2, 2))) for _ in range(60)])
    widths = rng.uniform(5, 25, len(graph.lines))
    ground = shapely.Point(200, -300).buffer(1900)
    whole = shapely.intersection(road_area(graph, widths), ground).area
    assert road_density(graph, widths, ground).roads == pytest.approx(whole, rel=1e-9)


def test_without_ground_there_is_no_density():
    found = road_density(build_graph([]))
    assert (found.ground, found.length, found.roads) == (0, 0, 0)
    assert math.isnan(found.share)
    assert math.isnan(found.km_per_km2)


def test_alpha_shape_of_a_raster_is_its_square():
    xy = np.stack(np.meshgrid(np.arange(6), np.arange(6)), -1).reshape(-1, 2) * 100.0
    assert alpha_area(xy) == pytest.approx(500**2)
    assert alpha_shape(xy).equals(box(0, 0, 500, 500))
    # Circles round the triangles of a cell have a radius of 70.7 m.
    assert alpha_area(xy, 70.0) == 0
    assert alpha_area(xy, 71.0) == pytest.approx(500**2)


def test_alpha_shape_leaves_bays_and_far_parts_out():
    xy = np.stack(np.meshgrid(np.arange(11), np.arange(11)), -1).reshape(-1, 2) * 100.0
    bay = ~((xy[:, 0] > 250) & (xy[:, 0] < 750) & (xy[:, 1] > 250))
    both = np.vstack([xy[bay], xy + np.array([5000, 0])])
    # Half a cell is cut off the two inner corners of the bay: its circle is as small as others.
    assert alpha_area(both, 75.0) == pytest.approx(2 * 1000**2 - 600 * 800 + 100**2)
    assert alpha_shape(both, 75.0).geom_type == "MultiPolygon"
    assert alpha_area(both, 1e7) > 5e6


def test_points_in_a_line_have_no_area():
    assert alpha_area([]) == 0
    assert alpha_area([(0, 0), (1, 1)]) == 0
    assert alpha_area([(0, 0), (1, 1), (2, 2), (3, 3)]) == 0
    assert alpha_shape([(0, 0), (1, 1), (2, 2)]).is_empty


@given(st.integers(0, 10_000), st.floats(0.1, 50), st.floats(50, 400))
def test_alpha_area_scales_and_is_that_of_the_shape(seed, scale, radius):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 1000, (40, 2))
    area = alpha_area(xy, radius)
    assert alpha_shape(xy, radius).area == pytest.approx(area)
    assert alpha_area(xy[::-1] * scale + 7e5, radius * scale) == pytest.approx(
        area * scale**2, rel=1e-6
    )
    assert area <= alpha_area(xy, 2 * radius) <= 1000**2


@given(st.integers(0, 10_000))
def test_road_area_is_between_the_widest_strip_and_the_sum(seed):
    rng = np.random.default_rng(seed)
    graph = build_graph([street(*rng.uniform(0, 500, (2, 2))) for _ in range(5)])
    widths = rng.uniform(5, 25, len(graph.lines))
    area = road_area(graph, widths).area
    assert (widths * graph.lengths).max() <= area + 1e-6
    assert area <= (widths * graph.lengths).sum() + 1e-6
