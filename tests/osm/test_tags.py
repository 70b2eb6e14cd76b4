"""Numbers and words out of tags, which anybody may have written anything into."""

from __future__ import annotations

import doctest
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.osm import classes
from platwright.osm import tags as read


@pytest.mark.parametrize(
    ("value", "speed"),
    [
        ("50", 50), ("30 mph", 48), ("30mph", 48), ("50 km/h", 50), ("50;30", 30),
        (["50", "30"], 30), ("FR:zone30", 30), ("DE:zone:20", 20), ("FR:urban", 50),
        ("walk", 7), ("10 knots", 19), ("none", None), ("signals", None), ("FR:rural", None),
        ("-10", None), ("0", None), ("99999", None), ("", None), (None, None), (math.nan, None),
    ],
)  # fmt: skip
def test_speed(value, speed):
    assert read.speed_kmh(value) == speed


@pytest.mark.parametrize(
    ("value", "lanes"),
    [("2", 2), ("2;3", 2), (["4", "3"], 3), ("1.5", 1), (2, 2), ("two", None), ("-1", None),
     ("0", None), (None, None)],
)  # fmt: skip
def test_lanes(value, lanes):
    assert read.lanes(value) == lanes


@pytest.mark.parametrize(
    ("value", "height"),
    [("12", 12), ("12,5 m", 12.5), ("12.5m", 12.5), ("10 ft", 3.05), ("6'6\"", 1.98), ("6'", 1.83),
     ("~20", 20), ("3;9", 9), ("tall", None), ("-3", None), ("0", None), ("12345", None)],
)  # fmt: skip
def test_height(value, height):
    assert read.height_m(value) == height


@pytest.mark.parametrize(
    ("value", "levels"),
    [("5", 5), ("2.5", 2.5), ("3-4", 4), ("3;6", 6), ("-1", None), ("0", None), ("many", None)],
)
def test_levels(value, levels):
    assert read.levels(value) == levels


@given(st.one_of(st.none(), st.text(), st.floats(), st.lists(st.text(max_size=8), max_size=3)))
def test_no_value_makes_an_error(value):
    for reader in (read.speed_kmh, read.lanes, read.height_m, read.levels):
        found = reader(value)
        assert found is None or 0 < found <= 1000
    found = read.text(value)
    assert found is None or found.strip()
    assert read.is_yes(value) in (True, False)


def test_lists_become_texts_in_a_fixed_order():
    assert read.text(["b", "a", "b"]) == "a; b"
    assert read.text("x; y ;x") == "x; y"
    assert read.text([]) is None


def test_levels_of_streets():
    kinds = ("motorway", "primary_link", "tertiary", "residential", "service", None)
    assert [classes.street_level(kind) for kind in kinds] == [1, 1, 2, 3, 4, 4]


@pytest.mark.parametrize("network", classes.EXCLUDED)
def test_the_filter_of_overpass_and_of_files_is_the_same(network):
    import re

    text = classes.overpass_filter(network)
    parts = re.findall(r'\["([^"]+)"!~"([^"]+)"\]', text)
    ways = [
        {"highway": "residential"}, {"highway": "service", "service": "alley"},
        {"highway": "footway"}, {"highway": "motorway"}, {"highway": "cycleway"},
        {"highway": "construction"}, {"highway": "residential", "access": "private"},
        {"highway": "primary", "foot": "no"}, {"highway": "pedestrian", "area": "yes"},
        {"highway": "steps"}, {"railway": "rail"},
    ]  # fmt: skip
    asked = [
        "highway" in way and not any(key in way and re.search(p, way[key]) for key, p in parts)
        for way in ways
    ]
    assert asked == [classes.in_network(way, network) for way in ways]
    assert any(asked)
    assert not all(asked)


def test_what_bars_streets():
    assert classes.area_obstacle({"leisure": "park"}) == "green"
    assert classes.area_obstacle({"natural": "water", "layer": "-1"}) is None
    assert classes.area_obstacle({"landuse": "railway"}) is None
    assert classes.area_obstacle({"landuse": "grass"}) is None
    assert classes.area_obstacle({"leisure": "garden", "access": "private"}) is None
    assert classes.line_obstacle({"railway": "rail"}) == ("rail", 4.0)
    assert classes.line_obstacle({"railway": "rail", "tunnel": "yes"}) is None
    assert classes.line_obstacle({"railway": "rail", "bridge": "viaduct"}) is None
    assert classes.line_obstacle({"railway": "tram"}) is None
    assert classes.line_obstacle({"waterway": "river", "width": "30 m"}) == ("water", 15.0)


@pytest.mark.parametrize("module", [read, classes])
def test_examples(module):
    found = doctest.testmod(module)
    assert found.attempted >= 2
    assert found.failed == 0
