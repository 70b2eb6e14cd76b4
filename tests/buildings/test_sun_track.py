"""The position of the sun, against the sky."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.rules import SunRule
from platwright.buildings.sun import check_sun, sun_track
from platwright.buildings.sun.track import sun_steps
from platwright.errors import InputError, MissingDependencyError

from .sun_checks import noaa_sun, zone_at

OBLIQUITY = 23.44


def noon(latitude: float, month: int, day: int, longitude: float = 0.0):
    """Return azimuth and altitude at noon, true solar time."""
    rule = SunRule(month=month, day=day, start=11, end=13, step_minutes=60)
    track = sun_track(latitude, longitude, rule)
    return track.azimuth_deg[1], track.altitude_deg[1]


@pytest.mark.parametrize(
    ("place", "latitude", "longitude", "june", "december"),
    [
        # Noon altitudes at the solstices, 90 - |latitude -+ 23.44|.
        ("Berlin", 52.52, 13.4, 60.9, 14.0),
        ("Helsinki", 60.17, 24.9, 53.3, 6.4),
        ("Singapore", 1.35, 103.8, 67.9, 65.2),
        ("Quito", -0.18, -78.5, 66.4, 66.7),
        ("Sydney", -33.87, 151.2, 32.7, 79.6),
        ("Ushuaia", -54.80, -68.3, 11.8, 58.6),
        ("Tromso", 69.65, 18.96, 43.8, -3.1),
    ],
)
def test_noon_altitudes_at_the_solstices(place, latitude, longitude, june, december):
    assert noon(latitude, 6, 21, longitude)[1] == pytest.approx(june, abs=0.06), place
    assert noon(latitude, 12, 21, longitude)[1] == pytest.approx(december, abs=0.06), place


def test_the_noon_sun_stands_on_the_side_of_the_equator():
    assert noon(52.5, 6, 21)[0] == pytest.approx(180.0, abs=0.05)
    assert noon(-33.9, 6, 21)[0] % 360 == pytest.approx(0.0, abs=0.05)
    # Between the tropics it changes sides.
    assert noon(5.0, 6, 21)[0] % 360 == pytest.approx(0.0, abs=0.05)
    assert noon(5.0, 12, 21)[0] == pytest.approx(180.0, abs=0.05)


def test_at_the_equinox_it_rises_in_the_east_and_passes_the_zenith_of_the_equator():
    assert noon(0.0, 9, 22)[1] > 89.9
    for latitude in (-50.0, 10.0, 60.0):
        track = sun_track(latitude, 0.0, SunRule(month=9, day=22, start=6, end=18))
        assert track.altitude_deg[0] == pytest.approx(0.0, abs=0.15)
        assert track.azimuth_deg[0] == pytest.approx(90.0, abs=0.2)
        assert track.azimuth_deg[-1] == pytest.approx(270.0, abs=0.2)


def test_the_midnight_sun_and_the_pole():
    midnight = sun_track(69.65, 18.96, SunRule(month=6, day=21, start=0, end=1)).altitude_deg[0]
    assert midnight == pytest.approx(69.65 + OBLIQUITY - 90, abs=0.05)
    pole = sun_track(90.0, 0.0, SunRule(month=6, day=21, start=0, end=24, step_minutes=60))
    assert np.allclose(pole.altitude_deg, OBLIQUITY, atol=0.02)
    assert (sun_track(-90.0, 0.0, SunRule(month=6, day=21, start=0, end=24)).altitude_deg < 0).all()


@settings(max_examples=60)
@given(
    st.floats(-85, 85), st.floats(-180, 180), st.integers(1, 12), st.integers(1, 28),
    st.floats(0, 23),
)  # fmt: skip
def test_it_is_the_sun_of_noaas_calculator(latitude, longitude, month, day, start):
    rule = SunRule(month=month, day=day, start=start, end=start + 1, step_minutes=30)
    track = sun_track(latitude, longitude, rule)
    for hour, azimuth, altitude in zip(track.hours, track.azimuth_deg, track.altitude_deg):
        wanted_azimuth, wanted = noaa_sun(latitude, longitude, rule, hour)
        assert altitude == pytest.approx(wanted, abs=0.03)
        if abs(wanted) < 85:
            off = (azimuth - wanted_azimuth + 180) % 360 - 180
            assert abs(off) * np.cos(np.radians(wanted)) < 0.03


def test_the_window_is_covered_whatever_the_step():
    for step in (7.0, 10.0, 25.0, 60.0):
        track = sun_track(50.0, 10.0, SunRule(start=9, end=14.5, step_minutes=step))
        assert track.hours[0] == 9
        assert track.hours[-1] == 14.5
        assert (np.diff(track.hours) > 0).all()
        assert np.diff(track.hours).max() <= step / 60 + 1e-9
        assert track.weights.sum() == pytest.approx(5.5)


def test_the_steps_leave_out_a_low_sun_and_follow_the_grid():
    rule = SunRule(month=12, day=21, start=0, end=24, step_minutes=10)
    track, steps = sun_track(52.5, 15.0, rule), sun_steps(zone_at(52.5, convergence=2.0), rule)
    up = track.altitude_deg >= 3
    assert 0 < len(steps) == up.sum() < len(up)
    assert np.array_equal(steps.hours, track.hours[up])
    grid = np.degrees(np.arctan2(*steps.towards.T)) % 360
    # Grid north lies 2 degrees east of true north, so azimuths from it are 2 degrees less.
    assert np.allclose(grid, track.azimuth_deg[up] - 2.0)
    assert np.allclose(steps.tangent, np.tan(np.radians(track.altitude_deg[up])))


def test_the_same_track_is_shared_and_cannot_be_written_to():
    track = sun_track(50.0, 10.0, SunRule())
    assert sun_track(50.0, 10.0, SunRule()) is track
    with pytest.raises(ValueError, match="read-only"):
        track.altitude_deg[0] = 1.0


def test_without_pvlib_the_way_out_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "pvlib", None)
    with pytest.raises(MissingDependencyError, match=r"pvlib.*Settings > Options > Platwright"):
        sun_track(12.345, 67.89, SunRule())


# --- whether a rule can be met


def test_an_ordinary_place_has_nothing_to_say():
    assert check_sun(zone_at(52.5), SunRule(hours=2)) == []
    assert check_sun(zone_at(-33.9), SunRule(hours=2, month=6, day=21)) == []
    assert check_sun(zone_at(52.5), SunRule()) == []


@pytest.mark.parametrize("latitude", [70.0, 85.0, 90.0])
def test_in_the_polar_night_hours_are_refused_and_the_coefficient_explained(latitude):
    with pytest.raises(InputError, match="does not rise above 3 degrees") as caught:
        check_sun(zone_at(latitude), SunRule(hours=1))
    assert "20 January" in str(caught.value)
    assert "coefficient" in caught.value.remedy
    (text,) = check_sun(zone_at(latitude), SunRule())
    assert "hours of sun are 0" in text


def test_more_hours_than_the_sun_is_up_are_refused_with_the_number():
    # At 64 degrees on 20 January the sun is above 3 degrees for about 3.5 h around noon.
    with pytest.raises(InputError, match=r"no façade has more than 3\.\d h") as caught:
        check_sun(zone_at(64.0), SunRule(hours=5))
    assert "5 h asked" in str(caught.value)
    assert check_sun(zone_at(64.0), SunRule(hours=3)) == []


def test_near_the_equator_the_side_without_sun_is_told():
    (text,) = check_sun(zone_at(5.0), SunRule(hours=2, month=6, day=21))
    assert "azimuth 180" in text
    assert "at most 0.0 h" in text
    assert check_sun(zone_at(5.0, facing=0.0), SunRule(hours=2, month=6, day=21)) == []
    (text,) = check_sun(zone_at(-5.0), SunRule())
    assert "the north unless you choose another" in text
