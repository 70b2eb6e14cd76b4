"""Settings of single street levels: ranges, JSON, and what they change."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.network.level_settings import LevelSettings
from platwright.network.specification import FORBID, Specification


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"coverage": -1}, "coverage"),
        ({"coverage": math.inf}, "coverage"),
        ({"coverage": math.nan}, "coverage"),
        ({"coverage": "near"}, "coverage"),
        ({"coverage_unit": "miles"}, "miles"),
        ({"weight_length": -0.1}, "weight_length"),
        ({"weight_distance": math.inf}, "weight_distance"),
        ({"dead_ends": -1}, "dead_ends"),
        ({"time_share": 0}, "share"),
        ({"time_share": 1.01}, "share"),
        ({"speed_kmh": 0}, "speed"),
        ({"speed_kmh": math.inf}, "speed"),
        ({"speed_kmh": True}, "speed"),
    ],
)
def test_settings_out_of_range_are_refused(wrong, named):
    with pytest.raises(InputError, match=named):
        LevelSettings(**wrong)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({5: LevelSettings()}, "level 5"),
        ({"2": LevelSettings()}, "level 2"),
        ({2: {"coverage": 1}}, "level 2"),
        ({1: LevelSettings(coverage=2)}, "Major roads"),
        ({4: LevelSettings(dead_ends=FORBID)}, "end blind"),
    ],
)
def test_settings_that_no_level_has_are_refused(settings, named):
    with pytest.raises(InputError, match=named):
        Specification(level_settings=settings)


@pytest.mark.parametrize(
    "text",
    [
        '{"level_settings": 7}',
        '{"level_settings": {"2": 7}}',
        '{"level_settings": {"two": {}}}',
        '{"level_settings": {"2": {"colour": 1}}}',
        '{"level_settings": {"9": {}}}',
        '{"level_settings": {"2": {"speed_kmh": "fast"}}}',
        '{"cul_de_sac_length": 0}',
        '{"turning_radius": -1}',
    ],
)
def test_json_that_is_wrong_is_refused(text):
    with pytest.raises(InputError):
        Specification.from_json(text)


numbers = st.none() | st.floats(0, 1e6)
some = st.builds(
    LevelSettings,
    coverage=st.none() | st.integers(1, 5),
    weight_length=numbers,
    weight_distance=numbers,
    dead_ends=numbers,
    time_share=st.none() | st.floats(0.01, 1),
    speed_kmh=st.none() | st.floats(1, 200),
)


@given(st.dictionaries(st.sampled_from([2, 3, 4]), some), st.booleans())
def test_json_gives_back_what_it_was_given(settings, blind):
    spec = Specification(level_settings=settings, cul_de_sacs=blind)
    again = Specification.from_json(spec.to_json())
    assert again == spec
    assert hash(again) == hash(spec)
    json.loads(spec.to_json())


def test_infinity_and_specifications_without_levels_are_read_back():
    spec = Specification(level_settings={2: LevelSettings(dead_ends=FORBID)})
    assert '"dead_ends": "forbid"' in json.dumps(json.loads(spec.to_json())["level_settings"])
    assert Specification.from_json(spec.to_json()) == spec
    old = json.loads(Specification().to_json())
    for key in ("level_settings", "cul_de_sacs", "cul_de_sac_length", "turning_radius"):
        del old[key]
    assert Specification.from_json(json.dumps(old)) == Specification()


def test_a_level_differs_only_where_it_says_so():
    spec = Specification(
        coverage=2,
        weight_length=3.0,
        level_settings={2: LevelSettings(dead_ends=0.5, speed_kmh=40, time_share=0.3)},
    )
    at = spec.at_level(2)
    assert (at.dead_ends, at.coverage, at.weight_length) == (0.5, 2, 3.0)
    assert spec.at_level(3) is spec
    with pytest.raises(InputError, match=r"2\.5 edges"):
        Specification(level_settings={2: LevelSettings(coverage=2.5)}).at_level(2)
