"""Plans made by programs: valid, better than their start, the same again, cancelled at once."""

from __future__ import annotations

import dataclasses
import threading
import time

import numpy as np
import pytest
import shapely
from clock import allowed
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.lines import control_lines
from platwright.buildings.paths.exitcheck import ExitCheck
from platwright.buildings.paths.plan import plan_paths
from platwright.buildings.place.checks import fits
from platwright.buildings.place.optimise import place_optimised
from platwright.buildings.place.score import score
from platwright.buildings.place.staged import place_staged
from platwright.buildings.rules import LayoutRules, SunRule
from platwright.buildings.types import (
    CENTRIC,
    DOTTED,
    ENCLOSED,
    FACILITY,
    ROWS,
    SYMMETRICAL,
    BuildingType,
    Placements,
)
from platwright.progress import Silent
from shapely.geometry import Polygon, box

from .program_setup import HIGHRISE, MULTISTOREY, crossed_zone, plain_zone, rows

#: Plans of whole zones take their time.
pytestmark = pytest.mark.slow

HOMES = MULTISTOREY[:4]
RULES = LayoutRules(far=1.1, density=0.28, iterations=8)


def total(zone, types, rules, lines, placed) -> float:
    """The objective with planned paths."""
    plan = plan_paths(zone, types, rules, lines, placed)
    return score(zone, types, rules, placed, plan).total


def check(zone, types, rules, lines, start, placed) -> None:
    """A plan is valid and no worse than its start."""
    assert fits(zone, types, rules, placed) == []
    assert ExitCheck(zone, types, rules).reached(placed).all()
    assert total(zone, types, rules, lines, placed) <= (
        total(zone, types, rules, lines, start) + 1e-9
    )
    for kind, line, patch, facing, xy in zip(
        placed.type, placed.line, placed.patch, placed.facing, placed.xy
    ):
        own = lines[line]
        assert (own.use, own.patch, own.leaf) == (types[kind].use, patch, True)
        assert facing == pytest.approx(own.facing_deg)
        assert shapely.Point(xy).distance(shapely.LineString([own.start, own.end])) < 1e-3


class Listener(Silent):
    """Keeps what a search tells."""

    def __init__(self, cancel_after: int | None = None) -> None:
        self.states, self.stages, self.cancel_after = [], [], cancel_after

    def stage(self, _text, fraction):
        self.stages.append(fraction)

    def search(self, state):
        self.states.append(state)

    def cancelled(self):
        return self.cancel_after is not None and len(self.states) >= self.cancel_after


def same(one: Placements, two: Placements) -> bool:
    return len(one) == len(two) and all(
        (getattr(one, name) == getattr(two, name)).all()
        for name in ("type", "xy", "facing", "patch", "line")
    )


def test_from_nothing_to_a_full_plan():
    zone = plain_zone(box(0, 0, 160, 120))
    lines = rows(zone, 24.5)
    listener = Listener()
    none = Placements.empty()
    placed = place_optimised(zone, HOMES, RULES, lines, none, listener)
    check(zone, HOMES, RULES, lines, none, placed)
    far = sum(HOMES[k].floor_area_m2 for k in placed.type) / zone.polygon.area
    assert far >= RULES.far * 0.99
    values = [state.incumbent for state in listener.states]
    assert values == sorted(values, reverse=True)
    assert values[-1] == pytest.approx(total(zone, HOMES, RULES, lines, placed))
    bounds = {state.bound for state in listener.states}
    assert len(bounds) == 1
    assert 0 < bounds.pop() <= values[-1]
    assert listener.stages[-1] == 1.0
    assert listener.stages == sorted(listener.stages)


def test_the_same_seed_gives_the_same_plan_and_another_one_may_not():
    zone = plain_zone(box(0, 0, 160, 120))
    lines = control_lines(zone, HOMES, RULES)
    start = place_staged(zone, HOMES, RULES, lines)
    one, two = (place_optimised(zone, HOMES, RULES, lines, start) for _ in range(2))
    assert same(one, two)
    other = dataclasses.replace(RULES, seed=1)
    check(zone, HOMES, other, lines, start, place_optimised(zone, HOMES, other, lines, start))


def test_a_plan_is_better_than_the_staged_one():
    zone = plain_zone(box(0, 0, 190, 120), facilities=ROWS)
    lines = control_lines(zone, MULTISTOREY, RULES)
    start = place_staged(zone, MULTISTOREY, RULES, lines)
    placed = place_optimised(zone, MULTISTOREY, RULES, lines, start)
    check(zone, MULTISTOREY, RULES, lines, start, placed)
    before = total(zone, MULTISTOREY, RULES, lines, start)
    assert total(zone, MULTISTOREY, RULES, lines, placed) < before - 0.01
    # no facility of the start is given up
    for kind in (4, 5):
        assert (placed.type == kind).sum() >= (start.type == kind).sum()


@pytest.mark.parametrize("pattern", [CENTRIC, ENCLOSED, SYMMETRICAL, DOTTED])
def test_every_pattern(pattern):
    zone = plain_zone(box(0, 0, 170, 130), residences=pattern)
    types = HIGHRISE[1:2] if pattern == DOTTED else HOMES[:3]
    lines = control_lines(zone, types, RULES)
    start = place_staged(zone, types, RULES, lines)
    placed = place_optimised(zone, types, RULES, lines, start)
    assert len(placed)
    check(zone, types, RULES, lines, start, placed)


def test_hours_of_sun_are_kept():
    zone = plain_zone(box(0, 0, 170, 150))
    types = HOMES[:3]
    rules = dataclasses.replace(RULES, sun=SunRule(hours=2.0))
    lines = control_lines(zone, types, rules)
    start = place_staged(zone, types, rules, lines)
    placed = place_optimised(zone, types, rules, lines, start)
    check(zone, types, rules, lines, start, placed)
    assert total(zone, types, rules, lines, placed) <= total(zone, types, rules, lines, start)


def test_shares_and_counts_are_kept():
    zone = plain_zone(box(0, 0, 190, 150))
    types = (
        dataclasses.replace(HOMES[1], share=0.5),
        dataclasses.replace(HOMES[2], share=0.5),
        BuildingType("kiosk", 12.0, 10.0, 4.0, 1, use=FACILITY, count=2, entrance="same"),
    )
    lines = control_lines(zone, types, RULES)
    none = Placements.empty()
    placed = place_optimised(zone, types, RULES, lines, none)
    check(zone, types, RULES, lines, none, placed)
    number = np.bincount(placed.type, minlength=3)
    homes = number[:2].sum()
    assert homes > 8
    assert (np.abs(number[:2] - homes / 2) <= 0.05 * homes + 1).all()
    assert number[2] <= 2


def test_types_that_fit_nowhere_leave_the_start_as_it_is():
    zone = plain_zone(box(0, 0, 40, 30))
    types = (BuildingType("huge", 80.0, 20.0, 9.0, 3),)
    lines = rows(zone, 40.0, first=15.0)
    assert len(place_optimised(zone, types, RULES, lines, Placements.empty())) == 0
    assert len(place_optimised(zone, types, RULES, (), Placements.empty())) == 0


def test_a_cancelled_run_keeps_the_best_plan():
    zone = crossed_zone()
    rules = LayoutRules(time_limit=60.0)
    lines = control_lines(zone, MULTISTOREY, rules)
    none = Placements.empty()
    listener = Listener(cancel_after=2)
    done: list[Placements] = []
    cancelled_at: list[float] = []
    tell = listener.search

    def search(state):
        tell(state)
        if len(listener.states) == 2:
            cancelled_at.append(time.monotonic())

    listener.search = search
    thread = threading.Thread(
        target=lambda: done.append(place_optimised(zone, MULTISTOREY, rules, lines, none, listener))
    )
    thread.start()
    thread.join(50)
    assert done
    assert time.monotonic() - cancelled_at[0] < allowed(2.0)
    check(zone, MULTISTOREY, rules, lines, none, done[0])
    assert total(zone, MULTISTOREY, rules, lines, done[0]) == pytest.approx(
        listener.states[-1].incumbent
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("types", "far", "density"), [(MULTISTOREY, 1.1, 0.28), (HIGHRISE, 1.8, 0.25)]
)
def test_the_demos_of_the_paper_reach_their_far(types, far, density):
    zone = crossed_zone()
    rules = LayoutRules(far=far, density=density, iterations=12)
    lines = control_lines(zone, types, rules)
    start = place_staged(zone, types, rules, lines)
    placed = place_optimised(zone, types, rules, lines, start)
    check(zone, types, rules, lines, start, placed)
    reached = sum(types[k].floor_area_m2 for k in placed.type) / zone.polygon.area
    assert reached >= far
    before = total(zone, types, rules, lines, start)
    assert total(zone, types, rules, lines, placed) < 0.97 * before


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(
    corners=st.lists(st.tuples(st.floats(70, 150), st.floats(-0.5, 0.5)), min_size=4, max_size=6),
    pattern=st.sampled_from([ROWS, CENTRIC, ENCLOSED, SYMMETRICAL, DOTTED]),
    hours=st.sampled_from([None, None, 2.0]),
    latitude=st.sampled_from([52.0, 30.0, -35.0]),
    seed=st.integers(0, 99),
)
def test_random_zones(corners, pattern, hours, latitude, seed):
    n = len(corners)
    angle = [2 * np.pi * (k + shift) / n for k, (_, shift) in enumerate(corners)]
    ring = [(r * np.cos(a), r * np.sin(a)) for (r, _), a in zip(corners, angle)]
    zone = plain_zone(
        Polygon(ring).convex_hull, latitude=latitude, residences=pattern, facilities=ROWS
    )
    rules = dataclasses.replace(RULES, iterations=4, seed=seed, sun=SunRule(hours=hours))
    lines = control_lines(zone, MULTISTOREY, rules)
    start = place_staged(zone, MULTISTOREY, rules, lines)
    placed = place_optimised(zone, MULTISTOREY, rules, lines, start)
    check(zone, MULTISTOREY, rules, lines, start, placed)
