"""RZ's staged heuristic: what it places keeps all rules, and it does so again and again."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from clock import allowed
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.paths.plan import plan_paths
from platwright.buildings.place.checks import fits
from platwright.buildings.place.score import score
from platwright.buildings.place.staged import place_staged
from platwright.buildings.rules import LayoutRules
from platwright.buildings.sun import sun_hours
from platwright.buildings.types import ROWS, BuildingType, Placements
from platwright.buildings.zone import ControlLine
from platwright.progress import Silent
from shapely.geometry import box

from .zones import (
    HOUSE,
    ORIGIN,
    SHOP,
    SLAB,
    TOWER,
    TYPES,
    breaches,
    rows,
    slow_groups,
    sunny,
    ways_out,
    zone,
)

#: Plans of whole zones take their time.
pytestmark = pytest.mark.slow

RULES = LayoutRules(far=1.0, density=0.3, iterations=4)


class Listener(Silent):
    """Keeps what it is told, and cancels after so many questions."""

    def __init__(self, patience: float = float("inf")) -> None:
        self.values: list[float] = []
        self.stages: list[tuple[str, float]] = []
        self.asked, self.patience = 0, patience
        self.longest, self.last = 0.0, time.monotonic()

    def search(self, state) -> None:
        assert state.seconds >= 0
        assert state.bound is None
        self.values.append(state.incumbent)

    def stage(self, text, fraction) -> None:
        self.stages.append((text, fraction))

    def cancelled(self) -> bool:
        now = time.monotonic()
        self.longest, self.last = max(self.longest, now - self.last), now
        self.asked += 1
        return self.asked > self.patience


def same(one: Placements, two: Placements) -> bool:
    names = ("type", "xy", "facing", "patch", "line")
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in names)


def keeps_rules(ground, types, rules, lines, placed) -> None:
    """By the judge of the library and by the slow one of the tests."""
    assert fits(ground, types, rules, placed) == []
    assert breaches(ground, types, rules, placed) == set()
    assert ways_out(ground, types, rules, placed)
    for at in range(len(placed)):
        line = lines[placed.line[at]]
        assert line.leaf
        assert line.patch == placed.patch[at]
        assert line.use == types[placed.type[at]].use
        assert line.facing_deg == placed.facing[at]
        ends = np.array([line.start, line.end])
        way = np.hypot(*(ends[0] - placed.xy[at])) + np.hypot(*(ends[1] - placed.xy[at]))
        assert way == pytest.approx(line.length, abs=1e-5)


@st.composite
def cases(draw):
    """A rectangle or an L somehow turned, its types, rules and lines."""
    width, depth = (
        draw(st.sampled_from([64.0, 90.0, 131.0, 170.0])),
        draw(st.sampled_from([55.0, 83.0, 130.0])),
    )
    cut = draw(
        st.sampled_from([(0.0, 0.0), (0.5 * width, 0.4 * depth), (0.3 * width, 0.6 * depth)])
    )
    turn = draw(st.sampled_from([0.0, 12.0, -35.0]))
    street = draw(st.sampled_from(["south", "north", "west", "south east"]))
    facilities = draw(st.sampled_from([0, ROWS]))
    parts = draw(st.integers(1, 2))
    hole = draw(st.sampled_from([None, box(15, 20, 28, 30)]))
    ground = zone(width, depth, street, cut=cut, turn=turn, facilities=facilities, parts=parts,
                  hole=hole)  # fmt: skip
    types = draw(
        st.sampled_from([
            TYPES,
            (SLAB,),
            (dataclasses.replace(HOUSE, share=0.7, count=5), TOWER, SHOP),
            (dataclasses.replace(SLAB, entrance="same"), HOUSE),
        ])
    )  # fmt: skip
    rules = LayoutRules(
        far=draw(st.sampled_from([0.4, 1.0, 3.0])),
        density=draw(st.sampled_from([0.12, 0.4])),
        setback_m=draw(st.sampled_from([0.0, 3.0, 6.0])),
        gap_m=draw(st.sampled_from([4.0, 8.0])),
        group_m=draw(st.sampled_from([20.0, 50.0, 80.0])),
        step_m=draw(st.sampled_from([1.5, 4.0])),
        sun=sunny(draw(st.sampled_from([0.6, 1.2]))),
        iterations=2,
    )
    facing = 180.0 + draw(st.sampled_from([0.0, turn, 30.0]))
    lines = rows(
        ground, types, rules, facing=facing, lean=draw(st.sampled_from([0.0, 0.0, 20.0])),
        pitch=draw(st.sampled_from([None, 13.0])), spacing=draw(st.sampled_from([0.0, 0.0, 35.0])),
    )  # fmt: skip
    return ground, types, rules, lines


@settings(max_examples=60)
@given(cases())
def test_what_is_placed_keeps_all_rules(case):
    ground, types, rules, lines = case
    placed = place_staged(ground, types, rules, lines)
    keeps_rules(ground, types, rules, lines, placed)
    for line in np.unique(placed.line):
        xy = placed.xy[placed.line == line]
        apart = np.hypot(*(xy[:, None] - xy[None, :]).T)[np.triu_indices(len(xy), 1)]
        assert (apart >= lines[line].spacing_m - 0.01).all()


@settings(max_examples=10)
@given(cases())
def test_the_same_again(case):
    ground, types, rules, lines = case
    placed = place_staged(ground, types, rules, lines)
    assert same(placed, place_staged(ground, types, rules, lines))
    other = dataclasses.replace(rules, seed=rules.seed + 1)
    assert same(placed, place_staged(ground, types, other, lines))


@settings(max_examples=10)
@given(cases(), st.integers(0, 60))
def test_whoever_cancels_keeps_what_stands(case, patience):
    ground, types, rules, lines = case
    listener = Listener(patience)
    placed = place_staged(ground, types, rules, lines, listener)
    keeps_rules(ground, types, rules, lines, placed)
    assert listener.asked <= patience + 12


@pytest.fixture(scope="module")
def large():
    """10.8 ha in six patches, four types."""
    ground = zone(360, 300, "south north", parts=6, facilities=ROWS)
    rules = LayoutRules(far=1.1, density=0.28, iterations=6)
    return ground, rules, rows(ground, TYPES, rules, pitch=30.0)


@pytest.mark.slow
def test_a_hundred_buildings_soon(large):
    """10.8 ha within seconds, and no long silence between two questions for cancelling."""
    ground, rules, lines = large
    listener = Listener()
    begun = time.process_time()
    placed = place_staged(ground, TYPES, rules, lines, listener)
    assert time.process_time() - begun < 8.0
    assert len(placed) > 60
    assert listener.longest < allowed(1.0)
    assert fits(ground, TYPES, rules, placed) == []
    plan = plan_paths(ground, TYPES, rules, lines, placed)
    assert plan.reached.mean() > 0.95
    # one facility in each patch
    shops = placed.patch[placed.type == 3]
    assert sorted(shops.tolist()) == list(range(6))


@pytest.mark.slow
def test_the_objective_falls_and_fractions_rise(large):
    ground, rules, lines = large
    listener = Listener()
    placed = place_staged(ground, TYPES, rules, lines, listener)
    assert all(a >= b - 1e-9 for a, b in zip(listener.values, listener.values[1:]))
    assert listener.values[-1] == pytest.approx(score(ground, TYPES, rules, placed, None).total)
    fractions = [fraction for _, fraction in listener.stages]
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] <= fractions[-1] <= 1


def test_time_is_kept():
    ground = zone(600, 400, "south north", parts=6)
    rules = dataclasses.replace(RULES, iterations=None, time_limit=0.5, far=2.0)
    lines = rows(ground, TYPES, rules, pitch=20.0)
    begun = time.monotonic()
    placed = place_staged(ground, TYPES, rules, lines)
    assert time.monotonic() - begun < allowed(2.5)
    assert len(placed) > 0
    assert fits(ground, TYPES, rules, placed) == []


def test_one_row_by_hand():
    """Slabs of 24 m on 160 m less 5 m at both ends: two groups of two, 6 m apart, and one more."""
    ground = zone(160, 40)
    rules = dataclasses.replace(RULES, far=5.0, density=1.0, green=0.0, step_m=1.0)
    lines = rows(ground, (SLAB,), rules, pitch=100.0)
    placed = place_staged(ground, (SLAB,), rules, lines)
    x = np.sort(placed.xy[:, 0] - ORIGIN[0])
    assert x == pytest.approx([17, 41, 71, 95, 125])
    assert sorted(len(g) for g in slow_groups((SLAB,), placed)) == [1, 2, 2]


def test_what_stands_alone_moves_to_its_neighbour():
    """The walk meets its neighbour at a gap; moved to its wall it shares a gable."""
    ground = zone(100, 40)
    types = (dataclasses.replace(SLAB, count=1), dataclasses.replace(HOUSE, count=1))
    rules = dataclasses.replace(RULES, far=5.0, density=1.0, green=0.0, step_m=5.0)
    lines = rows(ground, types, rules, pitch=100.0)
    alone = place_staged(ground, types, dataclasses.replace(rules, iterations=0), lines)
    assert len(alone) == 2
    assert len(slow_groups(types, alone)) == 2
    joined = place_staged(ground, types, rules, lines)
    assert len(slow_groups(types, joined)) == 1
    before = score(ground, types, rules, alone, None)
    after = score(ground, types, rules, joined, None)
    assert after.total < before.total
    assert after.grouping < before.grouping


@pytest.mark.parametrize(("far", "least"), [(0.25, 5), (1.0, 13)])
def test_lines_that_mirror_each_other_carry_the_same(far, least):
    """The right half is the left half turned over, but for what is in its way."""
    ground = zone(200, 120, "south north", hole=box(170, 50, 180, 60))
    rules = dataclasses.replace(RULES, far=far, density=0.4, step_m=5.0)
    ways = rows(ground, (SLAB, HOUSE), rules, pitch=33.0)
    middle = ORIGIN[0] + 100
    lines = []
    for number, own in enumerate(ways):
        y = own.start[1]
        for side, mirror in ((-1, 2 * number + 1), (1, 2 * number)):
            ends = (middle + 5.0 * side, y), (middle + 100.0 * side, y)
            lines.append(
                dataclasses.replace(own, start=ends[0], end=ends[1], order=number, mirror=mirror)
            )
    assert {line.mirror for line in lines} == set(range(len(lines)))
    placed = place_staged(ground, (SLAB, HOUSE), rules, lines)
    keeps_rules(ground, (SLAB, HOUSE), rules, lines, placed)
    there = {(k, round(x - middle, 2), round(y, 2)) for k, (x, y) in zip(placed.type, placed.xy)}
    alone = {one for one in there if (one[0], -one[1], one[2]) not in there}
    assert len(there) >= least
    assert len(alone) <= 4
    # those that stood alone have moved together, on both sides
    groups = slow_groups((SLAB, HOUSE), placed)
    assert sum(len(group) > 1 for group in groups) >= len(groups) / 2
    # the stone keeps some from having a counterpart; else only the last one has none, when the
    # floor area is used up
    assert sum(round(y - ORIGIN[1]) not in (44, 77) for _, _, y in alone) <= 1
    assert np.bincount(placed.type).min() >= 2


def test_what_mirrors_another_moves_with_it_or_both_stay():
    """A stone is where one of two houses would have to go."""
    rules = dataclasses.replace(RULES, far=5.0, density=1.0, green=0.0, step_m=5.0)
    types = (dataclasses.replace(SLAB, count=1), dataclasses.replace(HOUSE, count=2))
    middle, y = ORIGIN + np.array([100.0, 22.0])
    for stone, off in ((box(110, 10, 129, 40), 37.0), (box(110, 10, 121, 40), 31.0)):
        ground = zone(200, 60, "south north", hole=stone)
        lines = [
            ControlLine((middle + 5.0 * side, y), (middle + 90.0 * side, y), 180.0, 0,
                        mirror=mirror)
            for side, mirror in ((-1, 1), (1, 0))
        ]  # fmt: skip
        placed = place_staged(ground, types, rules, lines)
        keeps_rules(ground, types, rules, lines, placed)
        houses = placed.xy[placed.type == 1, 0] - middle
        assert sorted(houses) == pytest.approx([-5 - off, 5 + off])
        assert len(placed) == 3


def test_mix_of_types_is_kept_where_there_is_room():
    ground = zone(300, 250, "south north", parts=3)
    types = (dataclasses.replace(SLAB, share=0.25), dataclasses.replace(HOUSE, share=0.75))
    rules = dataclasses.replace(RULES, far=0.4)
    placed = place_staged(ground, types, rules, rows(ground, types, rules))
    number = np.bincount(placed.type, minlength=2)
    assert number.sum() > 20
    assert abs(number[0] - 0.25 * number.sum()) <= 1.0


def test_as_much_as_is_allowed():
    """Where there is room, no more building of any type would have stayed within the limit."""
    ground = zone(300, 250, "south north", parts=3)
    rules = dataclasses.replace(RULES, far=0.5)
    types = (SLAB, HOUSE)
    placed = place_staged(ground, types, rules, rows(ground, types, rules))
    floor = np.array([kind.floor_area_m2 for kind in types])
    left = rules.most_far * 300 * 250 - floor[placed.type].sum()
    assert 0 <= left < floor.min()


@pytest.mark.slow
def test_hours_of_sun_for_all():
    """At 48 degrees north in January, with towers among the houses."""
    ground = zone(180, 120, "south north", parts=2)
    rules = dataclasses.replace(RULES, far=1.5, sun=sunny(hours=2.0))
    lines = rows(ground, TYPES, rules, pitch=24.0)
    placed = place_staged(ground, TYPES, rules, lines)
    assert len(placed) > 8
    hours = sun_hours(ground, TYPES, placed, rules.sun)
    home = np.array([TYPES[k].use == "residence" for k in placed.type])
    assert (hours[home] >= 2.0 - 1e-6).all()
    assert fits(ground, TYPES, rules, placed) == []
    # some have less than the whole window: the rule did say no
    assert hours[home].min() < 4.0


def test_strewn_buildings_are_not_parallel_and_keep_all_rules():
    ground = zone(160, 140, "south north", parts=2)
    rules = dataclasses.replace(RULES, far=0.6, group_m=15.0)
    types = (HOUSE, TOWER, SHOP)
    lines = rows(ground, types, rules, pitch=34.0)
    straight = place_staged(ground, types, rules, lines)
    placed = place_staged(ground, types, rules, lines, strewn=True)
    assert len(placed) == len(straight)
    assert len(np.unique(placed.facing)) > len(placed) / 2
    assert (np.abs(placed.facing - 180.0) <= 15.0).all()
    assert fits(ground, types, rules, placed) == []
    assert breaches(ground, types, rules, placed) == set()
    assert ways_out(ground, types, rules, placed)
    assert same(placed, place_staged(ground, types, rules, lines, strewn=True))
    other = dataclasses.replace(rules, seed=7)
    assert not same(placed, place_staged(ground, types, other, lines, strewn=True))


def test_nothing_fits_or_nothing_is_asked():
    ground = zone(30, 20)
    lines = rows(ground, (SLAB,), RULES)
    assert len(place_staged(ground, (SLAB,), RULES, lines)) == 0
    assert len(place_staged(ground, (SLAB,), RULES, ())) == 0
    none = (dataclasses.replace(SLAB, count=0),)
    large = zone(100, 60)
    assert len(place_staged(large, none, RULES, rows(large, none, RULES))) == 0
    shops = (SHOP,)
    assert len(place_staged(large, shops, RULES, rows(large, (SLAB,), RULES))) == 0


def test_a_building_longer_than_a_group_may_be_stands_alone():
    ground = zone(200, 60)
    rules = dataclasses.replace(RULES, group_m=20.0)
    long = (BuildingType("long", 45.0, 12.0, 12.0, 4),)
    placed = place_staged(ground, long, rules, rows(ground, long, rules))
    assert len(placed) >= 1
    assert len(slow_groups(long, placed)) == len(placed)
