"""Closed forms of the warp against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.parcels.warp.alignment import circle, smoother, straighten
from platwright.parcels.warp.meanvalue import mean_value_coordinates
from platwright.parcels.warp.registration import (
    AFFINE,
    RECTANGLE,
    RIGID,
    SIMILARITY,
    Allowed,
    bounded_scales,
    register,
)
from scipy.optimize import least_squares, minimize

SEEDS = st.integers(0, 2**32 - 1)


def case(seed, n=6):
    """Make points, weights and where they should go."""
    rng = np.random.default_rng(seed)
    local = rng.normal(size=n) * 9 + 1j * rng.normal(size=n) * 15
    weights = rng.uniform(0.2, 1.0, n)
    local -= (weights * local).sum() / weights.sum()
    goal = rng.normal(size=n) * 12 + 1j * rng.normal(size=n) * 12 + 1.3 * local * np.exp(0.5j)
    return local, weights, goal


def fitted(seed, kind, bounds=(1e-6, 1e6, 1e-6, 1e6), area=(0.0, np.inf)):
    """Register one face; return local, weights, goal and the places it is mapped to."""
    local, weights, goal = case(seed)
    one = [np.array([float(v)]) for v in (*bounds, *area)]
    square = np.array([(weights * np.abs(local) ** 2).sum()])
    twist = np.array([(weights * local**2).sum()])
    allowed = Allowed(np.array([kind]), *one, square, twist)
    p = np.array([(weights * goal * local.conj()).sum()])
    s = np.array([(weights * goal * local).sum()])
    a, b = register(p, s, allowed)
    centre = (weights * goal).sum() / weights.sum()
    return local, weights, goal, a[0], b[0], a * local + b * local.conj() + centre


def error(weights, goal, mapped):
    return float((weights * np.abs(mapped - goal) ** 2).sum())


def best(local, weights, goal, build, start):
    """Fit by scipy, from several starts."""
    found = []
    for turn in np.linspace(-np.pi, np.pi, 7):

        def off(x):
            away = np.sqrt(weights) * (build(x, local) - goal)
            return np.concatenate([away.real, away.imag])

        found.append(2 * least_squares(off, [turn, *start, 0.0, 0.0]).cost)
    return min(found)


@settings(max_examples=15)
@given(SEEDS)
def test_rigid_is_least_squares(seed):
    local, weights, goal, a, b, mapped = fitted(seed, RIGID)
    wanted = best(
        local, weights, goal, lambda x, z: np.exp(1j * x[0]) * z + x[1] + 1j * x[2], ()
    )  # fmt: skip
    assert error(weights, goal, mapped) == pytest.approx(wanted, rel=1e-6)
    assert abs(a) == pytest.approx(1.0)
    assert b == 0


@settings(max_examples=15)
@given(SEEDS)
def test_similarity_is_least_squares(seed):
    local, weights, goal, _, b, mapped = fitted(seed, SIMILARITY)

    def build(x, z):
        return x[1] * np.exp(1j * x[0]) * z + x[2] + 1j * x[3]

    wanted = best(local, weights, goal, build, (1.0,))
    assert error(weights, goal, mapped) == pytest.approx(wanted, rel=1e-6)
    assert b == 0


@settings(max_examples=15)
@given(SEEDS, st.floats(0.3, 1.0), st.floats(1.0, 2.0))
def test_bounded_similarity_is_least_squares_on_a_grid(seed, low, high):
    local, weights, goal, a, _, mapped = fitted(seed, SIMILARITY, (low, high, 1, 1))
    assert low - 1e-9 <= abs(a) <= high + 1e-9
    centre = (weights * goal).sum() / weights.sum()
    sizes = np.linspace(low, high, 60)[:, None, None]
    turns = np.exp(1j * np.linspace(-np.pi, np.pi, 721))[None, :, None]
    every = (weights * np.abs(sizes * turns * local + centre - goal) ** 2).sum(axis=-1)
    own = error(weights, goal, mapped)
    assert own <= every.min() + 1e-9
    assert own >= every.min() * 0.99


@settings(max_examples=15)
@given(SEEDS)
def test_affine_is_least_squares(seed):
    local, weights, goal, _, _, mapped = fitted(seed, AFFINE)
    root = np.sqrt(weights)
    base = np.stack([local.real, local.imag, np.ones(len(local))], axis=1) * root[:, None]
    wanted = 0.0
    for part in (goal.real, goal.imag):
        solution = np.linalg.lstsq(base, part * root, rcond=None)[0]
        wanted += float(((base @ solution - part * root) ** 2).sum())
    # a reflection is not allowed, however good it would be
    linear = np.linalg.lstsq(base, np.stack([goal.real, goal.imag], 1) * root[:, None], rcond=None)
    if np.linalg.det(linear[0][:2]) > 0:
        assert error(weights, goal, mapped) == pytest.approx(wanted, rel=1e-6)
    else:
        assert error(weights, goal, mapped) >= wanted


@settings(max_examples=30)
@given(SEEDS, st.floats(0.5, 1.0), st.floats(1.0, 1.6), st.floats(0.4, 0.9), st.floats(1.1, 2.0))
def test_affine_keeps_to_its_bounds(seed, low, high, least, most):
    _, _, _, a, b, _ = fitted(seed, AFFINE, (low, high, 1, 1), (least, most))
    matrix = np.array([[(a + b).real, (b - a).imag], [(a + b).imag, (a - b).real]])
    sizes = np.linalg.svd(matrix, compute_uv=False)
    area = np.linalg.det(matrix)
    assert least - 1e-9 <= area <= most + 1e-9
    # where the bounds of the area do not bite, those of the distortions hold
    if least < low**2 and most > high**2:
        assert sizes.min() >= low - 1e-9
        assert sizes.max() <= high + 1e-9


@settings(max_examples=25)
@given(SEEDS)
def test_rectangles_are_a_similarity_and_then_bounded_scales(seed):
    bounds = (0.8, 1.3, 0.7, 1.5)
    local, weights, goal, a, b, mapped = fitted(seed, RECTANGLE, bounds)
    turn = (a + b) / abs(a + b)
    assert (a / turn).imag == pytest.approx(0, abs=1e-9)
    plain = fitted(seed, SIMILARITY)[3]
    assert turn == pytest.approx(plain / abs(plain))
    centre = (weights * goal).sum() / weights.sum()

    def cost(x):
        z = (x[0] * local.real + 1j * x[1] * local.imag) * turn + centre
        return error(weights, goal, z)

    found = minimize(cost, [1.0, 1.0], bounds=[bounds[:2], bounds[2:]], method="L-BFGS-B")
    assert cost([abs(a + b), abs(a - b)]) <= found.fun * (1 + 1e-9) + 1e-9
    assert error(weights, goal, mapped) == pytest.approx(found.fun, rel=1e-5)


@settings(max_examples=60)
@given(
    st.floats(0.1, 3), st.floats(0.1, 3), st.floats(0.2, 5), st.floats(0.2, 5),
    st.floats(0.4, 1.0), st.floats(1.0, 2.0), st.floats(0.3, 0.95), st.floats(1.05, 2.5),
)  # fmt: skip
def test_the_program_of_two_unknowns_against_a_grid(x, y, wx, wy, low, high, least, most):
    one = [np.array([v]) for v in (x, y, wx, wy)]
    box = tuple(np.array([v]) for v in (low, high, low, high))
    u, v = (float(a[0]) for a in bounded_scales(*one, box, np.array([least]), np.array([most])))
    assert low - 1e-9 <= u <= high + 1e-9
    assert low - 1e-9 <= v <= high + 1e-9
    assert least - 1e-6 <= u * v <= most + 1e-6
    side = np.linspace(low, high, 401)
    grid_u, grid_v = np.meshgrid(side, side)
    cost = wx * (grid_u - x) ** 2 + wy * (grid_v - y) ** 2
    inside = (grid_u * grid_v >= least) & (grid_u * grid_v <= most)
    own = wx * (u - x) ** 2 + wy * (v - y) ** 2
    assert own <= cost[inside].min() + 1e-6


def test_where_area_and_scales_contradict_the_scales_win():
    one = [np.array([v]) for v in (1.0, 1.0, 1.0, 1.0)]
    box = tuple(np.array([v]) for v in (0.9, 1.1, 0.9, 1.1))
    u, v = bounded_scales(*one, box, np.array([2.0]), np.array([3.0]))
    assert (u[0], v[0]) == (1.1, 1.1)


@settings(max_examples=20)
@given(SEEDS)
def test_straight_lines_are_best(seed):
    rng = np.random.default_rng(seed)
    z = np.arange(8) * 5 * np.exp(0.7j) + rng.normal(size=8) + 1j * rng.normal(size=8)
    weights = rng.uniform(0.3, 2.0, 8)
    two = np.concatenate([z, 3 - z])
    moved = straighten(two, np.tile(weights, 2), np.array([0, 8]))
    for part, own in ((moved[:8], z), (moved[8:], 3 - z)):
        along = (part[-1] - part[0]) / abs(part[-1] - part[0])
        assert np.abs(((part - part[0]) * np.conj(along)).imag).max() < 1e-9
        # nearest points, so at right angles
        assert np.abs(((part - own) * np.conj(along)).real).max() < 1e-9

        def cost(x, own=own):
            return (weights * ((own - 1j * x[1]) * np.exp(-1j * x[0])).imag ** 2).sum()

        starts = [(angle, 0.0) for angle in np.linspace(0, np.pi, 5)]
        best_cost = min(minimize(cost, start).fun for start in starts)
        assert (weights * np.abs(part - own) ** 2).sum() <= best_cost * (1 + 1e-6) + 1e-9


def test_points_of_a_circle_stay_and_others_come_onto_one():
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    z = 40 - 7j + 11 * np.exp(1j * angle)
    ones = np.ones(12)
    assert np.allclose(circle(z, ones, np.array([0])), z)
    rough = z + 0.5 * np.exp(3j * np.arange(12))
    moved = circle(rough, ones, np.array([0]))

    def off(x):
        return np.abs(rough - x[0] - 1j * x[1]) ** 2 - x[2] ** 2

    x = least_squares(off, [40.0, -7.0, 11.0]).x
    assert np.allclose(np.abs(moved - x[0] - 1j * x[1]), x[2], atol=1e-6)


def test_a_circle_through_points_on_a_line_changes_nothing():
    z = np.arange(4) * (1 + 2j)
    assert np.array_equal(circle(z, np.ones(4), np.array([0])), z)


@settings(max_examples=20)
@given(SEEDS, st.integers(4, 10))
def test_moving_least_squares_keep_parabolas_and_smooth_the_rest(seed, n):
    rng = np.random.default_rng(seed)
    along = np.cumsum(rng.uniform(2.0, 6.0, n))
    matrix = smoother(along, 10.0)
    curve = 3 + 2j + (1 - 0.5j) * along + (0.01 + 0.03j) * along**2
    assert np.allclose(matrix @ curve, curve)
    # and against the weighted fit itself
    values = rng.normal(size=n)
    weight = np.exp(-(((along - along[1]) / 10.0) ** 2) / 2)
    fit = np.polyfit(along - along[1], values, 2, w=np.sqrt(weight))
    assert (matrix @ values)[1] == pytest.approx(fit[2])


@settings(max_examples=25)
@given(SEEDS, st.integers(3, 12))
def test_mean_value_coordinates_reproduce_linear_functions(seed, n):
    """Also in polygons that are not convex."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, n) * 0.1 + np.arange(n) * 2 * np.pi / n)
    polygon = rng.uniform(20.0, 60.0, n) * np.exp(1j * angle)
    points = rng.normal(size=5) + 1j * rng.normal(size=5)
    weights = mean_value_coordinates(polygon, points)
    assert np.allclose(weights.sum(axis=1), 1.0)
    assert np.allclose(weights @ polygon, points, atol=1e-8)
    assert np.allclose(weights @ (2 * polygon.real - polygon.imag), 2 * points.real - points.imag)
