"""Turning functions: copies are found, and the distance is that of the definition."""

from __future__ import annotations

import numpy as np
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from platwright.buildings.corridors.turning import arcs, turning_fits, turns

L_SHAPE = np.array([[0, 0], [90, 0], [90, 40], [30, 40], [30, 70], [0, 70]], dtype=float)


@st.composite
def rings(draw) -> np.ndarray:
    """Simple polygons, counter-clockwise."""
    count = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(40.0, 200.0), min_size=count, max_size=count))
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * np.array(radii)[:, None]
    assume(shapely.Polygon(ring).is_valid)
    assume(np.abs(turns(ring)).max() < 3.0)
    return ring


def turned(ring: np.ndarray, degrees: float, scale: float, start: int) -> np.ndarray:
    angle = np.radians(degrees)
    matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.roll(scale * ring @ matrix.T + [700.0, -300.0], -start, axis=0)


def by_sampling(ring: np.ndarray, other: np.ndarray, shift: float, count: int = 4000) -> float:
    """Root mean square difference of the directions of edges, at many places."""

    def heights(points: np.ndarray, places: np.ndarray) -> np.ndarray:
        ahead = np.roll(points, -1, axis=0) - points
        direction = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
        edge = np.searchsorted(np.cumsum(np.hypot(*ahead.T)), (places % 1.0) * line(points).length)
        return direction[np.minimum(edge, len(points) - 1)] + 2 * np.pi * np.floor(places)

    places = (np.arange(count) + 0.5) / count
    gap = heights(ring, places + shift) - heights(other, places)
    return float(np.std(gap))


def line(points: np.ndarray) -> shapely.LinearRing:
    return shapely.LinearRing(points)


@given(rings(), st.floats(0, 360), st.floats(0.2, 5.0), st.integers(0, 8))
@settings(max_examples=60)
def test_a_turned_and_scaled_copy_is_no_distance_away(ring, degrees, scale, start):
    start = start % len(ring)
    copy = turned(ring, degrees, scale, start)
    distance, shift = turning_fits(copy, ring, 1)[0]
    assert distance < 1e-5  # the root of what rounding leaves
    # the first vertex of the ring lies where the shift says, but for symmetric outlines
    at = arcs(ring)
    for k in range(len(ring)):
        there = line(copy).interpolate((at[k] + shift) % 1.0, normalized=True)
        assert min(np.hypot(*(copy - [there.x, there.y]).T)) < 1e-4 * scale


def test_a_mirrored_copy_is_only_near_once_it_is_mirrored_back():
    copy = (L_SHAPE * [-1.0, 1.0])[::-1]
    assert turning_fits(copy, L_SHAPE, 1)[0][0] > 0.2
    assert turning_fits(copy, (L_SHAPE * [-1.0, 1.0])[::-1], 1)[0][0] < 1e-9


@given(rings(), rings())
@settings(max_examples=40)
def test_the_distance_is_that_of_the_definition(ring, other):
    for distance, shift in turning_fits(ring, other, 3):
        assert abs(distance - by_sampling(ring, other, shift)) < 0.03
    best = turning_fits(ring, other, 1)[0][0]
    tried = [by_sampling(ring, other, t, 1000) for t in np.linspace(0.0, 1.0, 60)]
    assert best <= min(tried) + 0.03


@given(rings(), rings())
@settings(max_examples=40)
def test_the_distance_is_the_same_both_ways(ring, other):
    assert abs(turning_fits(ring, other, 1)[0][0] - turning_fits(other, ring, 1)[0][0]) < 1e-6


def test_fits_are_sorted_and_apart():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    fits = turning_fits(square, square, 6)
    assert [round(t, 6) for _, t in fits[:4]] == [0.0, 0.25, 0.5, 0.75]
    assert [d for d, _ in fits] == sorted(d for d, _ in fits)
