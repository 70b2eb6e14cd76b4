"""Density by area, prices of the ground and slopes, checked with plain geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.network.coverage import coverage_balls
from platwright.network.specification import Specification
from platwright.streets import Preferences, Wishes, Zone, design_streets
from platwright.streets.preferences import coverage_ranges, edge_prices, grades

from .conftest import make_site


def middles(mesh):
    return mesh.vertices[mesh.edges].mean(axis=1)


def test_straight_cover_is_a_circle():
    mesh = grid(6, 6, 10.0)
    none = np.zeros(len(mesh.vertices), dtype=bool)
    balls = coverage_balls(mesh, range(len(mesh.vertices)), none, straight=15.0)
    for v, ball in balls.items():
        gaps = np.hypot(*(mesh.vertices - mesh.vertices[v]).T)
        assert set(ball) == set(np.flatnonzero(gaps <= 15.0).tolist())


def test_every_vertex_may_have_a_range_of_its_own():
    mesh = grid(6, 6, 10.0)
    none = np.zeros(len(mesh.vertices), dtype=bool)
    ranges = np.where(mesh.vertices[:, 0] < 25, 10.0, 20.0)
    balls = coverage_balls(mesh, range(len(mesh.vertices)), none, metres=ranges)
    inner = ~mesh.boundary_vertices & (np.abs(mesh.vertices[:, 1] - 30) < 11)
    sizes = {
        (float(ranges[v]), len(balls[v]))
        for v in np.flatnonzero(inner)
        if 15 < mesh.vertices[v, 0] < 45
    }
    assert sizes == {(10.0, 5), (20.0, 13)}


def test_exactly_one_range_is_taken():
    mesh = grid(2, 2)
    none = np.zeros(9, dtype=bool)
    with pytest.raises(ValueError, match="exactly one"):
        coverage_balls(mesh, [0], none, edges=1, metres=1.0)


def test_the_densest_area_counts_where_areas_overlap():
    mesh = grid(4, 4, 10.0)
    west, all_over = shapely.box(-1, -1, 11, 41), shapely.box(-1, -1, 41, 41)
    ranges = coverage_ranges(mesh, 99.0, [Zone(west, 12.0), Zone(all_over, 30.0)])
    assert set(ranges[mesh.vertices[:, 0] < 11]) == {12.0}
    assert set(ranges[mesh.vertices[:, 0] > 11]) == {30.0}


def test_an_edge_pays_for_its_share_of_a_zone():
    mesh = grid(4, 4, 10.0)
    prices = edge_prices(mesh, Preferences(prices=[Zone(shapely.box(-1, -1, 15, 41), 3.0)]))
    x = middles(mesh)[:, 0]
    assert set(np.round(prices[x < 14], 6)) == {3.0}
    assert set(np.round(prices[np.isclose(x, 15)], 6)) == {2.0}
    assert set(prices[x > 16]) == {1.0}


def test_a_line_makes_the_streets_along_it_cheap_not_those_across():
    mesh = grid(4, 4, 10.0)
    track = shapely.LineString([(0, 20), (40, 20)])
    prices = edge_prices(mesh, Preferences(prices=[Zone(track, 0.5)]))
    along = np.isclose(mesh.vertices[mesh.edges][:, :, 1], 20).all(axis=1)
    assert prices[along] == pytest.approx(0.5)
    assert (prices[~along] > 0.85).all()


def test_grades_are_those_of_the_ground():
    mesh = grid(4, 4, 10.0)
    found = grades(mesh, lambda places: 0.1 * places[:, 0])
    step = np.abs(np.diff(mesh.vertices[mesh.edges], axis=1)[:, 0])
    assert found == pytest.approx(np.where(step[:, 0] > 1, 0.1, 0.0))
    prices = edge_prices(mesh, Preferences(elevation=lambda p: 0.06 * p[:, 0]), 2.0)
    assert set(np.round(prices, 6)) == {1.0, 3.0}


def test_unknown_heights_cost_nothing():
    mesh = grid(2, 2, 10.0)
    assert (edge_prices(mesh, Preferences(elevation=lambda p: np.full(len(p), np.nan))) == 1).all()


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_values_without_sense_name_layer_and_feature(value):
    zone = Zone(shapely.box(0, 0, 1, 1), value, 17)
    with pytest.raises(InputError) as caught:
        Preferences(prices=[zone], price_layer="Ground")
    assert "Ground" in str(caught.value)
    assert "17" in str(caught.value)


def test_heights_that_do_not_cover_the_site_are_refused(square):
    wishes = Wishes(preferences=Preferences(elevation=lambda p: np.full(len(p), np.nan)))
    with pytest.raises(InputError, match="no height in this site"):
        design_streets([square], Specification(), wishes=wishes)


def length_within(plan, shape) -> float:
    return sum(s.line.intersection(shape).length for s in plan.segments)


@pytest.mark.slow
def test_a_less_dense_half_gets_fewer_streets():
    site = make_site(shapely.box(0, 0, 576, 432))
    west, east = shapely.box(0, 0, 288, 432), shapely.box(288, 0, 576, 432)
    zone = Zone(shapely.box(296, -1, 580, 440), 200.0)
    wishes = Wishes(preferences=Preferences(density=[zone]))
    plan = design_streets([site], Specification(levels=1), wishes=wishes).plans[0]
    assert length_within(plan, east) < 0.75 * length_within(plan, west)


@pytest.mark.slow
def test_streets_keep_to_cheap_ground():
    site = make_site(shapely.box(0, 0, 288, 288))
    dear = shapely.box(70, -10, 74, 300)
    spec = Specification(rules="paper", levels=1, edge_length=36.0, gap=0.0)
    free = design_streets([site], spec).plans[0]
    wishes = Wishes(preferences=Preferences(prices=[Zone(dear, 9.0)]))
    plan = design_streets([site], spec, wishes=wishes).plans[0]
    assert length_within(plan, dear) <= length_within(free, dear)
    along = [s for s in plan.segments if s.line.intersection(dear).length > 20]
    assert not along
