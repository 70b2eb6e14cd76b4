"""Limits of numbers and areas against sums by hand, and plans that keep the shipped ones."""

from __future__ import annotations

import math

import numpy as np
import pytest
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.rooms.shapes import (
    count_rules,
    enumerate_placements,
    shipped_templates,
    template_sets,
)
from platwright.rooms.types import Template
from scipy.optimize import LinearConstraint, milp

PAIR, ONE = frozenset({(0, 0), (1, 0)}), frozenset({(0, 0)})


def test_each_limit_is_a_rule():
    mesh = grid(3, 1)
    kinds = (
        Template("ward", PAIR, least=1, most=4, least_share=0.25, most_share=0.5),
        Template("store", ONE),
        Template("hall", ONE, use="hall", most=0, most_share=1.0),
    )
    floor = np.array([True, True, True])
    found = enumerate_placements(mesh, kinds, floor)
    area = np.array([2.0, 3.0, 7.0])
    rules = count_rules(kinds, found, area, floor)
    assert [rule.text for rule in rules] == [
        "at least 1 of 'ward'",
        "at most 4 of 'ward'",
        "at least 25 % of the area in 'ward'",
        "at most 50 % of the area in 'ward'",
        "at most 0 of 'hall'",
    ]
    assert found.faces[:2] == ((0, 1), (1, 2))
    assert [rule.weight.tolist() for rule in rules] == [
        [1, 1, 0, 0, 0, 0, 0, 0],
        [1, 1, 0, 0, 0, 0, 0, 0],
        [5, 10, 0, 0, 0, 0, 0, 0],
        [5, 10, 0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, 1, 1, 1],
    ]
    bounds = [(rule.least, rule.most) for rule in rules]
    assert bounds[:2] == [(1, math.inf), (-math.inf, 4)]
    assert bounds[2] == (pytest.approx(3.0, abs=1e-6), math.inf)
    assert bounds[3] == (-math.inf, pytest.approx(6.0, abs=1e-6))
    assert bounds[4] == (-math.inf, 0)


def test_shares_are_of_the_floor_not_of_the_mesh():
    mesh = grid(4, 1)
    floor = np.array([True, True, True, False])
    kinds = (Template("store", ONE, most_share=0.5),)
    (rule,) = count_rules(
        kinds, enumerate_placements(mesh, kinds, floor), np.array([1.0, 2.0, 3.0, 100.0]), floor
    )
    assert rule.weight.tolist() == [1, 2, 3]
    assert rule.most == pytest.approx(3.0)


def test_rounding_forbids_no_exact_share():
    # 29 of 100 squares are 0.29 of them, yet 0.29 * 100 is below 29 in floating point.
    mesh = grid(10, 10)
    floor = np.ones(100, dtype=bool)
    assert 0.29 * 100 < 29
    kinds = (Template("store", ONE, least_share=0.29, most_share=0.29),)
    rules = count_rules(kinds, enumerate_placements(mesh, kinds, floor), np.ones(100), floor)
    for count, fine in ((28, False), (29, True), (30, False)):
        sums = [(r.least, r.weight[:count].sum(), r.most) for r in rules]
        assert all(least <= total <= most for least, total, most in sums) == fine


def test_no_limits_no_rules():
    mesh = grid(2, 1)
    floor = np.ones(2, dtype=bool)
    kinds = (Template("store", ONE),)
    assert count_rules(kinds, enumerate_placements(mesh, kinds, floor), np.ones(2), floor) == ()
    with pytest.raises(InputError, match="'floor' has shape"):
        count_rules(kinds, enumerate_placements(mesh, kinds, floor), np.ones(3), floor)


@pytest.mark.parametrize("name", list(template_sets()))
def test_shipped_sets_tile_a_floor_within_their_limits(name):
    mesh = grid(10, 6, h=3.6)
    kinds, floor = shipped_templates(name), np.ones(60, dtype=bool)
    found = enumerate_placements(mesh, kinds, floor)
    cover = np.zeros((60, len(found.faces)))
    for room, faces in enumerate(found.faces):
        cover[list(faces), room] = 1
    rules = count_rules(kinds, found, np.full(60, 3.6**2), floor)
    limits = [LinearConstraint(cover, 1, 1)]
    limits += [LinearConstraint(rule.weight[None], rule.least, rule.most) for rule in rules]
    answer = milp(
        np.zeros(len(found.faces)), integrality=1, bounds=(0, 1), constraints=limits,
        options={"time_limit": 60},
    )  # fmt: skip
    assert answer.status == 0, answer.message
    covered = cover @ np.round(answer.x)
    assert (covered == 1).all()
