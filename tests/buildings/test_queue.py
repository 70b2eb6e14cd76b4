"""The order of placement: facilities first, then residences in the wished mix."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.buildings.place.queue import building_queue, wished_shares
from platwright.buildings.rules import LayoutRules
from platwright.buildings.types import ROWS, BuildingType

from .zones import HOUSE, SHOP, SLAB, TOWER, zone

GROUND = zone(400, 300, parts=3, facilities=ROWS)
RULES = LayoutRules(far=1.0)


def kinds(shares, counts=None, use="residence"):
    counts = counts or [None] * len(shares)
    return tuple(
        BuildingType(f"t{k}", 20.0, 10.0 + k, 12.0, 4, use=use, share=share, count=count)
        for k, (share, count) in enumerate(zip(shares, counts))
    )


@pytest.mark.parametrize(
    ("shares", "expected"),
    [
        ([None, None], [0.5, 0.5]),
        ([0.7, None], [0.7, 0.3]),
        ([0.7, None, None], [0.7, 0.15, 0.15]),
        ([1.0, 3.0], [0.25, 0.75]),
        ([70.0, 30.0], [0.7, 0.3]),
        ([0.2, 0.2], [0.5, 0.5]),
        ([1.5, None, 0.5], [0.75, 0.0, 0.25]),
        ([0.0, 0.0], [0.5, 0.5]),
        ([0.0, None], [0.0, 1.0]),
        ([None], [1.0]),
    ],
)
def test_shares_of_types(shares, expected):
    assert wished_shares(kinds(shares)) == pytest.approx(expected)


@given(st.lists(st.one_of(st.none(), st.floats(0, 1)), min_size=1, max_size=6))
def test_shares_are_parts_of_one_whole(shares):
    found = wished_shares(kinds(shares))
    assert found.sum() == pytest.approx(1.0)
    assert (found >= 0).all()


@given(st.lists(st.floats(0.02, 1), min_size=1, max_size=5), st.floats(0.2, 3.0))
def test_the_mix_is_right_at_every_length_until_the_floor_area_is_used_up(shares, far):
    types = kinds(shares)
    rules = LayoutRules(far=far)
    queue = building_queue(GROUND, types, rules)
    wish = np.array(shares) / sum(shares)
    floor = np.array([kind.floor_area_m2 for kind in types])
    left = rules.most_far * 400 * 300 - np.cumsum(floor[queue])
    for n in range(1, len(queue) + 1):
        made = np.bincount(queue[:n], minlength=len(types))
        if left[n - 1] >= floor.max():
            # largest remainder: no type is a whole building ahead, nor many behind
            assert (made - wish * n < 1 + 1e-9).all()
            assert (wish * n - made < max(1, len(types) - 1) + 1e-9).all()
    assert 0 <= left[-1] < floor.min()


def test_a_small_type_uses_what_a_large_one_leaves():
    types = (dataclasses.replace(TOWER, share=0.9), dataclasses.replace(HOUSE, share=0.1))
    queue = building_queue(GROUND, types, RULES)
    floor = np.array([kind.floor_area_m2 for kind in types])
    left = RULES.most_far * 400 * 300 - floor[queue].sum()
    assert 0 <= left < HOUSE.floor_area_m2


def test_a_count_ends_a_type_and_others_take_its_place():
    types = kinds([0.5, 0.5], [3, None])
    queue = building_queue(GROUND, types, RULES)
    assert queue.count(0) == 3
    assert queue[:6].count(0) == 3
    left = RULES.most_far * 400 * 300 - sum(types[k].floor_area_m2 for k in queue)
    assert 0 <= left < types[1].floor_area_m2
    for shares in ([0.5, 0.5], [None, None]):
        both = kinds(shares, [3, 2])
        assert sorted(building_queue(GROUND, both, RULES)) == [0, 0, 0, 1, 1]


def test_types_without_a_wish_stand_in_for_those_without_a_place():
    """As many as would use up the floor area alone; a wished share is not exceeded so."""
    types = kinds([0.5, None, 0.25])
    queue = building_queue(GROUND, types, RULES)
    first = building_queue(GROUND, kinds([0.5, 0.25, 0.25]), RULES)
    assert queue[: len(first)] == first
    more = queue[len(first) :]
    assert set(more) == {1}
    assert len(more) == int(RULES.most_far * 400 * 300 / types[1].floor_area_m2)


def test_facilities_come_first_one_for_each_patch():
    types = (SLAB, SHOP, HOUSE, dataclasses.replace(SHOP, name="school"), TOWER)
    queue = building_queue(GROUND, types, RULES)
    assert sorted(queue[:3]) == [1, 1, 3]
    assert set(queue[3:]) == {0, 2, 4}
    counted = (SLAB, dataclasses.replace(SHOP, count=5))
    assert building_queue(GROUND, counted, RULES)[:6] == [1, 1, 1, 1, 1, 0]
    none = (SLAB, dataclasses.replace(SHOP, count=0))
    assert set(building_queue(GROUND, none, RULES)) == {0}
    assert set(building_queue(zone(400, 300), (SLAB, SHOP), RULES)) == {0}
    assert building_queue(GROUND, (SHOP,), RULES) == [0, 0, 0]


def test_shares_of_facilities_are_kept():
    ground = zone(1000, 200, parts=10, facilities=ROWS)
    types = kinds([0.7, 0.3], use="facility")
    queue = building_queue(ground, types, RULES)
    assert (queue.count(0), queue.count(1)) == (7, 3)
