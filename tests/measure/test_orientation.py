"""Directions of streets: bearings by hand, entropy and order by hand and by osmnx."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.measure.orientation import (
    bearings,
    orientation_entropy,
    orientation_order,
    orientation_shares,
)
from pyproj import CRS, Transformer

UTM = CRS.from_epsg(32633)
#: On the central meridian, where the grid's north is true north.
X, Y = 500_000.0, 6_000_000.0


@pytest.mark.parametrize(
    ("step", "axis"),
    [
        ((0, 100), 0), ((0, -100), 0), ((100, 0), 90), ((-100, 0), 90), ((100, 100), 45),
        ((-100, -100), 45), ((100, -100), 135), ((50, 50 * math.sqrt(3)), 30),
    ],
)  # fmt: skip
def test_a_direction_is_an_axis_from_north(step, axis):
    found = bearings([[X, Y]], [[X + step[0], Y + step[1]]], UTM)
    assert found == pytest.approx([axis], abs=0.01)
    assert 0 <= found[0] < 180


def test_north_is_that_of_the_globe_and_not_of_the_grid():
    """Due north at 18 degrees east is no vertical line on the grid of zone 33."""
    project = Transformer.from_crs(4326, UTM, always_xy=True).transform
    start, end = project(18.0, 60.0), project(18.0, 60.01)
    assert abs(start[0] - end[0]) > 40
    assert bearings([start], [end], UTM) == pytest.approx([0.0], abs=1e-4)


def test_what_ends_where_it_starts_has_none():
    assert np.isnan(bearings([[X, Y]], [[X, Y]], UTM)).all()
    assert bearings(np.zeros((0, 2)), np.zeros((0, 2)), UTM).shape == (0,)


def test_without_a_place_on_the_globe_the_grid_has_the_north():
    local = CRS.from_wkt('LOCAL_CS["site grid",UNIT["metre",1]]')
    assert bearings([[0, 0]], [[0, 9]], local) == pytest.approx([0.0])
    assert bearings([[0, 0]], [[9, 9]], local) == pytest.approx([45.0])


def test_bins_are_centred_on_north():
    share = orientation_shares([0.0, 4.9, 175.1, 5.1])
    # both directions: bins of 0 and 180 degrees, and of 10 and 190
    assert share[0] == share[18] == pytest.approx(3 / 8)
    assert share[1] == share[19] == pytest.approx(1 / 8)
    assert share.sum() == pytest.approx(1)


def test_weights_count():
    share = orientation_shares([0.0, 90.0], [300.0, 100.0])
    assert share[[0, 9, 18, 27]] == pytest.approx([3 / 8, 1 / 8, 3 / 8, 1 / 8])
    by_hand = -2 * (3 / 8 * math.log(3 / 8) + 1 / 8 * math.log(1 / 8))
    assert orientation_entropy([0.0, 90.0], [300.0, 100.0]) == pytest.approx(by_hand)


@pytest.mark.parametrize(
    ("axes", "entropy", "order"),
    [
        ([12.0, 102.0], math.log(4), 1.0),
        (np.arange(0, 180, 10.0), math.log(36), 0.0),
        ([45.0], math.log(2), 1.0),
        ([0.0, 45.0, 90.0, 135.0], math.log(8), 1 - (math.log(2) / math.log(9)) ** 2),
    ],
)
def test_entropy_and_order_by_hand(axes, entropy, order):
    found = orientation_entropy(axes)
    assert found == pytest.approx(entropy)
    assert orientation_order(found) == pytest.approx(order, abs=1e-12)


def test_nothing_has_no_entropy():
    assert math.isnan(orientation_entropy([]))
    assert math.isnan(orientation_entropy([math.nan]))
    assert math.isnan(orientation_order(math.nan))


@given(st.lists(st.floats(0, 179.99), min_size=1, max_size=60), st.integers(0, 35))
@settings(max_examples=100, deadline=None)
def test_entropy_is_the_same_after_a_turn_by_whole_bins(axes, turns):
    # away from the edges of bins, where rounding decides
    own = [round(a / 10) * 10 + (a % 4) - 2 for a in axes]
    turned = [(a + 10 * turns) % 180 for a in own]
    assert orientation_entropy(turned) == pytest.approx(orientation_entropy(own))


@given(st.lists(st.tuples(st.floats(0, 359.9), st.floats(1, 500)), min_size=2, max_size=40))
@settings(max_examples=50, deadline=None)
def test_entropy_is_that_of_osmnx(streets):
    osmnx = pytest.importorskip("osmnx")
    import networkx as nx

    graph = nx.MultiGraph(crs="EPSG:4326")
    for k, (bearing, length) in enumerate(streets):
        graph.add_edge(2 * k, 2 * k + 1, bearing=bearing, length=length)
    axes = [bearing % 180 for bearing, _ in streets]
    lengths = [length for _, length in streets]
    expected = osmnx.bearing.orientation_entropy(graph)
    assert orientation_entropy(axes) == pytest.approx(expected, abs=1e-9)
    expected = osmnx.bearing.orientation_entropy(graph, weight="length")
    assert orientation_entropy(axes, lengths) == pytest.approx(expected, abs=1e-9)
