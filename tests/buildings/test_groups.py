"""Groups: buildings that border upon each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.buildings.place.groups import bordering, group_lengths, groups_of
from platwright.buildings.types import Placements

from .zones import ORIGIN, TYPES, share_wall, slow_groups, standing


def as_sets(group: np.ndarray) -> set[frozenset[int]]:
    return {frozenset(np.flatnonzero(group == k).tolist()) for k in np.unique(group)}


@st.composite
def crowds(draw) -> Placements:
    """Chains of buildings wall to wall, some of them nearly so, all turned somehow."""
    turn = draw(st.floats(0, 360))
    buildings = []
    for chain in range(draw(st.integers(1, 3))):
        x = 0.0
        before = 0.0
        for _ in range(draw(st.integers(1, 5))):
            kind = draw(st.integers(0, len(TYPES) - 1))
            joint = draw(st.sampled_from([0.0, 0.0, 0.03, -0.03, 0.08, -0.08, 6.0]))
            shift = draw(st.sampled_from([0.0, 0.0, 2.1, 5.3, 9.2, 13.0]))
            tilt = draw(st.sampled_from([0.0, 0.0, 0.0, 0.02, 0.5, 180.0]))
            x += (before + TYPES[kind].length_m) / 2 + joint
            before = TYPES[kind].length_m
            buildings.append((kind, x, 40.0 * chain + shift, 180.0 + turn + tilt))
    placed = standing(*buildings)
    a = -math.radians(turn)
    spin = np.array([[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]])
    return Placements(
        placed.type, (placed.xy - ORIGIN) @ spin.T, placed.facing % 360.0, placed.patch,
        placed.line,
    )  # fmt: skip


@given(crowds())
def test_groups_are_those_found_pair_by_pair(placed):
    group = groups_of(TYPES, placed)
    assert as_sets(group) == {frozenset(g) for g in slow_groups(TYPES, placed)}
    pairs = {frozenset(pair) for pair in bordering(TYPES, placed).tolist()}
    n = len(placed)
    assert pairs == {
        frozenset((a, b)) for a in range(n) for b in range(a) if share_wall(TYPES, placed, a, b)
    }
    # numbered from 0 by their first building
    first = [int(np.flatnonzero(group == k)[0]) for k in range(group.max() + 1)]
    assert first == sorted(first)


@given(crowds(), st.randoms(use_true_random=False))
def test_order_of_buildings_does_not_matter(placed, random):
    order = list(range(len(placed)))
    random.shuffle(order)
    again = groups_of(TYPES, placed.take(np.array(order)))
    there = {frozenset(order[at] for at in members) for members in as_sets(again)}
    assert there == as_sets(groups_of(TYPES, placed))


@given(crowds())
def test_lengths_add_up_facades(placed):
    group = groups_of(TYPES, placed)
    lengths = group_lengths(TYPES, placed, group)
    for number, members in enumerate(np.unique(group)):
        own = sum(TYPES[k].length_m for k in placed.type[group == members])
        assert lengths[number] == pytest.approx(own)


def test_a_corner_or_a_back_wall_is_no_side_wall():
    """Back to back and corner to corner is not side by side."""
    slab = TYPES[0]
    back_to_back = standing((0, 0, 0), (0, 0, slab.width_m))
    corner = standing((0, 0, 0), (0, slab.length_m, slab.width_m))
    less_than_half = standing((0, 0, 0), (0, slab.length_m, slab.width_m / 2 + 0.1))
    more_than_half = standing((0, 0, 0), (0, slab.length_m, slab.width_m / 2 - 0.1))
    for apart in (back_to_back, corner, less_than_half):
        assert groups_of(TYPES, apart).tolist() == [0, 1]
    assert groups_of(TYPES, more_than_half).tolist() == [0, 0]


def test_a_shallow_house_beside_a_deep_tower():
    """Half of the smaller depth counts."""
    house, tower = TYPES[1], TYPES[2]
    apart = (house.length_m + tower.length_m) / 2
    flush = (tower.width_m - house.width_m) / 2
    assert groups_of(TYPES, standing((1, 0, 0), (2, apart, flush))).tolist() == [0, 0]


def test_nothing_and_one_building():
    assert groups_of(TYPES, Placements.empty()).tolist() == []
    assert group_lengths(TYPES, Placements.empty(), groups_of(TYPES, Placements.empty())).size == 0
    assert groups_of(TYPES, standing((0, 0, 0))).tolist() == [0]
