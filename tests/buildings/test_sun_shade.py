"""Which residences stand in the shade, against shapely and against pairs looked at alone."""

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.rules import SunRule
from platwright.buildings.shape import centre_lines
from platwright.buildings.sun import (
    open_hours,
    shade_pairs,
    shaded,
    shadow_rectangles,
    sun_hours,
)
from platwright.buildings.sun import shade as room
from platwright.buildings.types import Placements

from .sun_checks import KINDS, placed, scattered, zone_at

ZONE = zone_at(52.5)
FACES = (180.0, 165.0, 90.0, 20.0)


def by_shapely(buildings: Placements, others: Placements, coefficient: float) -> set:
    """Return pairs where a centre line meets a shadow that is 1 cm smaller all round."""
    shadows = shapely.buffer(
        shadow_rectangles(KINDS, buildings, coefficient), -0.01, join_style="mitre"
    )
    lines = centre_lines(KINDS, others)
    return {
        (i, j)
        for i, shadow in enumerate(shadows)
        for j, line in enumerate(lines)
        if KINDS[others.type[j]].use == "residence" and shadow.intersects(line)
    }


def test_a_house_in_the_shadow_of_another_and_one_that_is_not():
    # 18 m high: the shadow reaches from 6 to 24 m north of the centre.
    for distance, dark in ((23.98, True), (24.0, False), (30.0, False), (18.0, True)):
        pair = placed((0, 0, 0, 180), (0, 0, distance, 180))
        assert shaded(ZONE, KINDS, pair, SunRule()).tolist() == [False, dark]
        found = shade_pairs(ZONE, KINDS, pair, pair, SunRule()).tolist()
        assert found == ([[0, 1]] if dark else [])
    beside = placed((0, 0, 0, 180), (0, 19.97, 15, 180))
    assert shaded(ZONE, KINDS, beside, SunRule()).tolist() == [False, True]
    beside = placed((0, 0, 0, 180), (0, 20.0, 15, 180))
    assert not shaded(ZONE, KINDS, beside, SunRule()).any()


def test_facilities_shade_and_are_not_shaded():
    shop_behind = placed((0, 0, 0, 180), (2, 0, 15, 180))
    assert not shaded(ZONE, KINDS, shop_behind, SunRule()).any()
    house_behind = placed((2, 0, 0, 180), (0, 0, 8.5, 180))
    assert shaded(ZONE, KINDS, house_behind, SunRule()).tolist() == [False, True]
    both = placed((1, 0, 0, 180), (2, 0, 15, 180), (0, 0, 30, 180))
    dark = shaded(ZONE, KINDS, both, SunRule(hours=5.9))
    assert dark.tolist() == [False, False, True]


def test_neighbours_that_border_upon_each_other_do_not_shade():
    row = placed((0, 0, 0, 180), (1, 17, 0, 180), (0, 34, 0, 180))
    assert not shaded(ZONE, KINDS, row, SunRule(coefficient=3)).any()


def test_nothing_gives_no_pairs():
    none, some = Placements.empty(), placed((0, 0, 0, 180))
    shops = placed((2, 0, 0, 180))
    for rule in (SunRule(), SunRule(hours=2)):
        for one, two in ((none, some), (some, none), (none, none), (some, shops), (some, some)):
            found = shade_pairs(ZONE, KINDS, one, two, rule)
            assert found.shape == (0, 2)
            assert found.dtype == np.int64
        assert len(shaded(ZONE, KINDS, none, rule)) == 0


@pytest.mark.parametrize("few", [0, 10**9], ids=["tree", "dense"])
@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), coefficient=st.floats(0.05, 3))
def test_pairs_are_those_of_shapely(few, seed, coefficient):
    before, room.FEW = room.FEW, few
    try:
        one, two = scattered(20, seed, 100.0, FACES), scattered(25, seed + 1, 100.0, FACES)
        found = shade_pairs(ZONE, KINDS, one, two, SunRule(coefficient=coefficient))
    finally:
        room.FEW = before
    assert {tuple(pair) for pair in found.tolist()} == by_shapely(one, two, coefficient)
    assert sorted(found.tolist()) == found.tolist()


def test_shaded_are_those_in_a_pair():
    buildings = scattered(50, 8, 200.0, FACES)
    wanted = {j for i, j in by_shapely(buildings, buildings, 1.3) if i != j}
    dark = shaded(ZONE, KINDS, buildings, SunRule(coefficient=1.3))
    assert set(np.flatnonzero(dark)) == wanted
    assert 0 < len(wanted) < 50


@settings(max_examples=20)
@given(
    seed=st.integers(0, 10_000), latitude=st.floats(-60, 60), asked=st.floats(0.4, 5.9),
    month=st.integers(1, 12),
)  # fmt: skip
def test_pairs_by_hours_are_those_of_two_buildings_alone(seed, latitude, asked, month):
    zone = zone_at(latitude)
    rule = SunRule(hours=asked, month=month, step_minutes=20)
    one, two = scattered(9, seed, 120.0, FACES), scattered(9, seed + 1, 120.0, FACES)
    found = {tuple(pair) for pair in shade_pairs(zone, KINDS, one, two, rule).tolist()}
    open_to = open_hours(zone, KINDS, two, rule)
    wanted = set()
    for i in range(9):
        for j in range(9):
            if KINDS[two.type[j]].use != "residence" or open_to[j] < asked:
                continue
            left = sun_hours(zone, KINDS, one.take([i]).join(two.take([j])), rule)[1]
            if left < asked - 1e-6:
                wanted.add((i, j))
    assert found == wanted


def test_by_hours_a_pair_is_shaded_and_a_lone_house_is_not():
    rule = SunRule(hours=3)
    buildings = scattered(60, 5, 300.0, (180.0,))
    dark = shaded(ZONE, KINDS, buildings, rule)
    assert 0 < dark.sum() < 60
    pairs = shade_pairs(ZONE, KINDS, buildings, buildings, rule)
    assert dark[pairs[:, 1]].all()
    assert (pairs[:, 0] != pairs[:, 1]).all()
    least = sun_hours(ZONE, KINDS, buildings, rule)[dark]
    assert (least < 3).all()
    assert not shaded(ZONE, KINDS, placed((0, 0, 0, 180)), rule).any()
    # Whoever looks north has too little sun alone: shaded, and in no pair.
    north = placed((0, 0, 0, 0), (1, 40, 40, 0))
    assert shaded(ZONE, KINDS, north, rule).all()
    assert len(shade_pairs(ZONE, KINDS, north, north, rule)) == 0


def test_twenty_thousand_placements_against_themselves():
    many = scattered(20_000, 6, 420.0, (180.0, 175.0))
    times = []
    for _ in range(2):
        begun = time.process_time()
        found = shade_pairs(ZONE, KINDS, many, many, SunRule())
        times.append(time.process_time() - begun)
    assert len(found) > 800_000
    assert min(times) < 2.0
    begun = time.process_time()
    for at in range(50):
        shade_pairs(ZONE, KINDS, many.take([at]), many, SunRule())
    assert (time.process_time() - begun) / 50 < 0.02
