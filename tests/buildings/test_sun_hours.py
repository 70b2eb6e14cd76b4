"""Hours of sun at façades, against rays that are shot one by one."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from platwright.buildings.rules import SunRule
from platwright.buildings.sun import open_hours, sun_hours
from platwright.buildings.types import BuildingType, Placements

from .sun_checks import KINDS, noaa_sun, placed, scattered, slow_hours, turned, zone_at

WINTER = SunRule(hours=2)  # 20 January, 9 to 15 h


def test_a_house_alone_has_the_sun_that_its_side_sees():
    houses = placed((0, 0, 0, 180), (0, 1000, 0, 90), (0, 2000, 0, 0), (0, 3000, 0, 270))
    # Noon, in the plane of the façades to the east and the west, counts for neither.
    side = 3 - 5 / 60
    assert sun_hours(zone_at(52.5), KINDS, houses, WINTER) == pytest.approx([6, side, 0, side])
    assert np.array_equal(
        sun_hours(zone_at(52.5), KINDS, houses, WINTER),
        open_hours(zone_at(52.5), KINDS, houses, WINTER),
    )


def test_in_the_south_of_the_earth_it_comes_from_the_north():
    houses = placed((0, 0, 0, 180), (0, 1000, 0, 0))
    winter = SunRule(hours=2, month=6, day=21)
    assert sun_hours(zone_at(-40.0), KINDS, houses, winter) == pytest.approx([0, 6])


def test_polar_night_and_nothing_to_look_at():
    assert sun_hours(zone_at(75.0), KINDS, scattered(8, 1), WINTER) == pytest.approx([0] * 8)
    assert len(sun_hours(zone_at(50.0), KINDS, Placements.empty(), WINTER)) == 0


def test_a_long_wall_hides_the_sun_while_it_is_lower_than_its_top():
    """Behind an endless wall at distance d, the sun shows when tan(h) / cos(a) > top / d."""
    kinds = (KINDS[0], BuildingType("wall", 4000.0, 2.0, 21.0, 7))
    rule = SunRule(hours=2, month=2, day=10, step_minutes=5)
    for gap in (20.0, 35.0, 60.0):
        both = placed((0, 0, 0, 180), (1, 0, -6 - gap - 1, 180))
        wanted = 0.0
        hours = np.linspace(9, 15, 73)
        for at, hour in enumerate(hours):
            azimuth, altitude = noaa_sun(48.0, 15.0, rule, hour)
            way = (gap - 0.01) / math.cos(math.radians(azimuth - 180))
            free = way * math.tan(math.radians(altitude)) >= 21.0 - rule.sill_m
            wanted += free * (6 / 72) * (0.5 if at in (0, 72) else 1)
        found = sun_hours(zone_at(48.0), kinds, both, rule)
        assert found[0] == pytest.approx(wanted, abs=1e-9)
        assert found[1] == pytest.approx(6.0)
    assert 0 < wanted <= 6


def test_neighbours_in_a_row_hide_nothing_from_each_other():
    along = np.array([math.cos(math.radians(10)), math.sin(math.radians(10))])
    row = placed(*((0, *(20 * k * along), 170) for k in range(3)))
    zone = zone_at(52.5)
    assert np.array_equal(sun_hours(zone, KINDS, row, WINTER), open_hours(zone, KINDS, row, WINTER))


def test_low_buildings_and_high_sills():
    # Four metres high, a shop right in front: it hides nothing from a sill of four metres.
    both = placed((0, 0, 0, 180), (2, 0, -13, 180))
    low = sun_hours(zone_at(60.0), KINDS, both, SunRule(hours=1))[0]
    high = sun_hours(zone_at(60.0), KINDS, both, SunRule(hours=1, sill_m=4.0))[0]
    assert low < high == open_hours(zone_at(60.0), KINDS, both, SunRule(hours=1))[0]


@settings(max_examples=25)
@given(
    st.integers(0, 10_000), st.floats(-65, 65), st.floats(-3, 3),
    st.sampled_from([(180.0,), (0.0, 90.0, 180.0, 270.0), (163.0, 200.0, 95.5)]),
)  # fmt: skip
@example(1, 52.5, 0.0, (180.0,))
def test_hours_are_those_of_single_rays(seed, latitude, convergence, faces):
    zone = zone_at(latitude, convergence=convergence)
    houses = scattered(12, seed, width=150.0, faces=faces)
    rule = SunRule(hours=1, step_minutes=30, month=1 + seed % 12)
    fast, slow = sun_hours(zone, KINDS, houses, rule), slow_hours(zone, KINDS, houses, rule)
    assert fast == pytest.approx(slow, abs=1e-9)


def test_random_plans_have_sun_and_shade():
    zone = zone_at(50.0, convergence=-1.2)
    houses = scattered(25, 1, width=200.0, faces=(180.0, 150.0))
    fast = sun_hours(zone, KINDS, houses, WINTER)
    assert fast == pytest.approx(slow_hours(zone, KINDS, houses, WINTER), abs=1e-9)
    assert 0.2 < (fast < 3).mean() < 0.9


@settings(max_examples=20)
@given(st.integers(0, 1000), st.floats(-90, 90))
def test_a_turned_grid_changes_nothing(seed, turn):
    houses = scattered(15, seed, width=120.0, faces=(180.0, 140.0))
    straight = sun_hours(zone_at(47.0), KINDS, houses, WINTER)
    # Turned clockwise on the grid, whose north lies as much further counter-clockwise.
    again = sun_hours(zone_at(47.0, convergence=-turn), KINDS, turned(houses, turn), WINTER)
    assert (np.abs(straight - again) > 1e-6).sum() <= 1


def test_one_more_building_never_gives_more_sun():
    zone, houses = zone_at(50.0), scattered(40, 9, faces=(180.0, 200.0))
    before = sun_hours(zone, KINDS, houses.take(np.arange(39)), WINTER)
    after = sun_hours(zone, KINDS, houses, WINTER)[:39]
    assert (after <= before + 1e-12).all()


def test_batches_of_pairs_change_nothing(monkeypatch):
    zone, houses = zone_at(55.0), scattered(60, 2, faces=(180.0, 90.0))
    whole = sun_hours(zone, KINDS, houses, WINTER)
    monkeypatch.setattr("platwright.buildings.sun.rays.TOGETHER", 100)
    assert np.array_equal(sun_hours(zone, KINDS, houses, WINTER), whole)


def test_two_hundred_buildings_take_a_fraction_of_a_second():
    zone, houses = zone_at(52.5), scattered(200, 3, faces=(180.0, 175.0, 90.0))
    sun_hours(zone, KINDS, houses, WINTER)
    times = []
    for _ in range(3):
        begun = time.process_time()
        sun_hours(zone, KINDS, houses, WINTER)
        times.append(time.process_time() - begun)
    assert min(times) < 0.3
