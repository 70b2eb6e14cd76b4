"""Mean value coordinates against their definition, and what they must reproduce."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from platwright.buildings.corridors.meanvalue import mean_value_coordinates
from platwright.errors import InputError


@st.composite
def rings(draw) -> np.ndarray:
    """Simple polygons around the origin, most of them concave."""
    count = draw(st.integers(3, 14))
    radii = draw(st.lists(st.floats(20.0, 300.0), min_size=count, max_size=count))
    shifts = draw(st.lists(st.floats(-0.35, 0.35), min_size=count, max_size=count))
    angle = 2 * np.pi * (np.arange(count) + np.array(shifts)) / count
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * np.array(radii)[:, None]
    assume(shapely.Polygon(ring).is_valid)
    return ring + np.array([draw(st.floats(-1e3, 1e3)), draw(st.floats(-1e3, 1e3))])


def inside(ring: np.ndarray, shares: list[tuple[float, float]]) -> np.ndarray:
    """Points well inside a polygon: those of its triangles that lie in it."""
    polygon = shapely.Polygon(ring)
    low, high = ring.min(axis=0), ring.max(axis=0)
    points = low + np.array(shares) * (high - low)
    deep = shapely.contains(polygon.buffer(-0.5), shapely.points(points))
    middle = polygon.representative_point()
    return np.vstack([points[deep], [middle.x, middle.y]])


def by_definition(point: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Floater 2003, (2.1), angle by angle."""
    count = len(ring)
    angle = []
    for k in range(count):
        a, b = ring[k] - point, ring[(k + 1) % count] - point
        turn = math.atan2(b[1], b[0]) - math.atan2(a[1], a[0])
        angle.append((turn + math.pi) % (2 * math.pi) - math.pi)
    weight = [
        (math.tan(angle[k - 1] / 2) + math.tan(angle[k] / 2)) / math.dist(ring[k], point)
        for k in range(count)
    ]
    return np.array(weight) / sum(weight)


SHARES = st.lists(st.tuples(st.floats(0.02, 0.98), st.floats(0.02, 0.98)), min_size=1, max_size=8)


@given(rings(), SHARES)
@settings(max_examples=80)
def test_they_give_points_and_linear_functions_exactly(ring, shares):
    points = inside(ring, shares)
    weights = mean_value_coordinates(points, ring)
    assert weights.shape == (len(points), len(ring))
    assert np.allclose(weights.sum(axis=1), 1.0, atol=1e-9)
    assert np.allclose(weights @ ring, points, atol=1e-5)
    slope = 3.0 * ring[:, 0] - 2.0 * ring[:, 1] + 7.0
    assert np.allclose(weights @ slope, 3 * points[:, 0] - 2 * points[:, 1] + 7.0, atol=1e-4)


@given(rings(), SHARES)
@settings(max_examples=60)
def test_they_are_those_of_the_definition(ring, shares):
    points = inside(ring, shares)
    weights = mean_value_coordinates(points, ring)
    for point, own in zip(points, weights):
        expected = by_definition(point, ring)
        assert np.allclose(own, expected, atol=1e-6 * max(1.0, np.abs(expected).max()))


@given(
    rings(),
    SHARES,
    st.tuples(*[st.floats(-2.0, 2.0)] * 4),
    st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
)
@settings(max_examples=60)
def test_an_affine_map_of_the_boundary_maps_what_is_inside(ring, shares, matrix, move):
    points = inside(ring, shares)
    turn = np.array(matrix).reshape(2, 2)
    carried = mean_value_coordinates(points, ring) @ (ring @ turn.T + move)
    assert np.allclose(carried, points @ turn.T + move, atol=1e-4)


def test_in_a_triangle_they_are_shares_of_the_area():
    ring = np.array([[0.0, 0.0], [60.0, 0.0], [10.0, 40.0]])
    point = np.array([20.0, 12.0])
    whole = shapely.Polygon(ring).area
    expected = [
        shapely.Polygon([point, ring[(k + 1) % 3], ring[(k + 2) % 3]]).area / whole
        for k in range(3)
    ]
    assert np.allclose(mean_value_coordinates(point[None], ring)[0], expected)


def test_on_an_edge_and_at_a_vertex_only_its_ends_count():
    ring = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 30.0], [20.0, 10.0], [0.0, 30.0]])
    weights = mean_value_coordinates(np.array([[10.0, 0.0], [40.0, 30.0], [30.0, 20.0]]), ring)
    assert np.allclose(weights[0], [0.75, 0.25, 0, 0, 0])
    assert np.allclose(weights[1], [0, 0, 1, 0, 0])
    assert np.allclose(weights[2], [0, 0, 0.5, 0.5, 0])


@given(rings(), SHARES)
@settings(max_examples=30)
def test_the_direction_of_the_ring_does_not_matter(ring, shares):
    points = inside(ring, shares)
    there = mean_value_coordinates(points, ring)
    back = mean_value_coordinates(points, ring[::-1])
    assert np.allclose(there, back[:, ::-1], atol=1e-7 * max(1.0, np.abs(there).max()))


def test_two_vertices_enclose_nothing():
    with pytest.raises(InputError, match="encloses nothing"):
        mean_value_coordinates(np.zeros((1, 2)), np.array([[0.0, 0.0], [1.0, 0.0]]))
