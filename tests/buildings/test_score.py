"""The objective: its parts by plain sums, and what makes it rise and fall."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.buildings.layout import PathPlan
from platwright.buildings.place.groups import groups_of
from platwright.buildings.place.score import (
    buildings_needed,
    facing_cost,
    group_cost,
    score,
    straight_ways,
)
from platwright.buildings.rules import LayoutRules
from platwright.buildings.types import BuildingType, Placements
from shapely.geometry import MultiLineString, Point

from .zones import ORIGIN, SLAB, TYPES, slow_groups, standing, zone

RULES = LayoutRules(far=1.0, density=0.25, weights=(10.0, 2.0, 1.0), pattern_penalty=0.3)
GROUND = zone(300, 200)


@st.composite
def placements(draw) -> Placements:
    """Buildings in a few rows, some wall to wall, some turned."""
    buildings = []
    for row in range(draw(st.integers(0, 3))):
        x = 20.0
        for _ in range(draw(st.integers(1, 6))):
            kind = draw(st.integers(0, len(TYPES) - 1))
            half = TYPES[kind].length_m / 2
            x += half
            facing = draw(st.sampled_from([180.0, 180.0, 180.0, 170.0, 240.0, 0.0]))
            buildings.append((kind, x, 20.0 + 45.0 * row, facing))
            x += half + draw(st.sampled_from([0.0, 0.0, 8.0]))
    return standing(*buildings)


def plan_of(count: int, seed: int) -> PathPlan:
    rng = np.random.default_rng(seed)
    return PathPlan(
        (), np.ones(count, dtype=bool), rng.uniform(0, 200, count),
        rng.integers(0, 5, count).astype(float), rng.uniform(0, 2, count),
        rng.uniform(0.1, 1, count),
    )  # fmt: skip


def off_sun(facing: float, equator: float) -> float:
    """Degrees between two azimuths, by their vectors."""
    a, b = math.radians(facing), math.radians(equator)
    return math.degrees(math.acos(max(-1.0, min(1.0, math.cos(a) * math.cos(b)
                                                + math.sin(a) * math.sin(b)))))  # fmt: skip


@given(placements(), st.integers(0, 99))
def test_the_objective_is_the_sum_of_its_parts(placed, seed):
    """S, C, W, P and O as the formulas say, building by building and group by group."""
    plan = plan_of(len(placed), seed)
    found = score(GROUND, TYPES, RULES, placed, plan)
    area = 300 * 200
    kinds = [TYPES[k] for k in placed.type]
    homes = [k for k in TYPES if k.use == "residence"]
    number = area / (sum(k.length_m * k.width_m * k.storeys for k in homes) / len(homes))
    far = sum(k.length_m * k.width_m * k.storeys for k in kinds) / area
    density = sum(k.length_m * k.width_m for k in kinds) / area
    s = (max(0, 1 - far / 1.0) + max(0, 1 - density / 0.25)) / 2
    c = 0.0
    for group in slow_groups(TYPES, placed):
        c += len(group) - 0.25 * (len(group) - 1)
        long = sum(kinds[at].length_m for at in group)
        mean = long / len(group)
        while long > RULES.group_m + 1e-9:
            c += 1.5
            long -= mean
    w = sum(
        (plan.length_m[i] + 5 * plan.turns[i] + 5 * plan.roomy[i] + 10 * plan.exits[i]) / 100
        for i in range(len(placed))
    )
    p = 0.0
    for kind, facing in zip(kinds, placed.facing):
        off = off_sun(facing, 180.0)
        if kind.use == "residence" and off > 15:
            p += (off - 15) / 75 if off <= 90 else 1 + (off - 90) / 90
    assert found.remainder == pytest.approx(s)
    assert found.grouping == pytest.approx(c / number)
    assert found.ways == pytest.approx(w / number)
    assert found.pattern == pytest.approx(p / number, abs=1e-6)
    total = (10 * s + 2 * c / number + w / number) / 13 + 0.3 * p / number
    assert found.total == pytest.approx(total, abs=1e-6)


def test_nothing_built_costs_the_whole_remainder():
    found = score(GROUND, TYPES, RULES, Placements.empty(), None)
    assert found.remainder == 1.0
    assert (found.grouping, found.ways, found.pattern) == (0, 0, 0)
    assert found.total == pytest.approx(10 / 13)


@given(st.integers(1, 12), st.floats(10, 150))
def test_groups_cost_less_per_building_until_they_are_too_long(count, longest):
    """Subsection-linear: the price of one more falls by the gable, then rises beyond the limit."""
    rules = dataclasses.replace(RULES, group_m=longest)
    costs = []
    for n in (count, count + 1):
        chain = standing(*[(0, 24.0 * at, 0.0) for at in range(n)])
        group = groups_of(TYPES, chain)
        assert group.max() == 0
        costs.append(float(group_cost(TYPES, rules, chain, group)[0]))
    fits = (count + 1) * 24.0 <= longest
    more = costs[1] - costs[0]
    assert more == pytest.approx(0.75 if fits else 2.25)


@given(
    st.floats(0, 360), st.sampled_from([48.0, -33.0]), st.floats(-3, 3), st.floats(-180, 180),
    st.floats(-180, 180),
)  # fmt: skip
def test_facing_costs_by_the_distance_from_the_equators_side(facing, latitude, bend, one, two):
    """On either half of the earth, and by true north, not by that of the grid."""
    ground = dataclasses.replace(GROUND, latitude=latitude, convergence_deg=bend)
    sun = (180.0 if latitude > 0 else 0.0) - bend
    cost = float(facing_cost(ground, np.array([facing % 360.0]))[0])
    off = off_sun(facing, sun)
    if off <= 15:
        assert cost == pytest.approx(0.0, abs=1e-6)
    assert cost == pytest.approx(float(np.interp(off, [15, 90, 180], [0, 1, 2])), abs=1e-5)
    costs = facing_cost(ground, np.array([(sun + one) % 360.0, (sun + two) % 360.0]))
    if abs(one) <= abs(two):
        assert costs[0] <= costs[1] + 1e-9


@given(placements())
def test_ways_without_a_plan_go_straight_to_the_street(placed):
    """The street is the southern side: 1.3 times the distance of the entrance from it."""
    found = straight_ways(GROUND, TYPES, placed)
    for at in range(len(placed)):
        kind = TYPES[placed.type[at]]
        side = 1 if kind.entrance == "same" else -1
        angle = math.radians(placed.facing[at])
        off = side * kind.width_m / 2
        x = placed.xy[at] - ORIGIN + off * np.array([math.sin(angle), math.cos(angle)])
        away = max(0.0, math.hypot(max(0, -x[0], x[0] - 300), x[1]))
        assert found[at] == pytest.approx((1.3 * away + 5) / 100, abs=1e-6)


def test_ways_lead_to_the_street_of_the_own_patch():
    """Not to a nearer street on the other side of a boundary."""
    ground = zone(200, 100, "south", parts=2)
    own = [patch.access for patch in ground.patches]
    assert all(isinstance(line, MultiLineString) and line.length > 100 for line in own)
    placed = standing((0, 50.0, 50.0, 180.0, 0), (0, 150.0, 50.0, 180.0, 1))
    ways = straight_ways(ground, TYPES, placed)
    door = Point(ORIGIN + np.array([50.0, 56.0]))
    assert ways[0] == pytest.approx((1.3 * own[0].distance(door) + 5) / 100)
    assert own[1].distance(door) > own[0].distance(door) + 5


def test_number_of_buildings_that_the_wish_needs():
    rules = LayoutRules(far=1.0)
    assert buildings_needed(GROUND, (SLAB,), rules) == pytest.approx(60_000 / (24 * 12 * 5))
    # facilities do not count, and a small zone needs one
    assert buildings_needed(GROUND, (SLAB, TYPES[3]), rules) == pytest.approx(60_000 / 1440)
    assert buildings_needed(zone(10, 10), (SLAB,), rules) == 1.0
    only = BuildingType("hall", 30, 20, 6, 1, use="facility")
    assert buildings_needed(GROUND, (only,), rules) == pytest.approx(100.0)
