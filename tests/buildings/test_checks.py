"""The judge of placements finds each breach, and nothing in what keeps the rules."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.place.checks import fits
from platwright.buildings.place.ground import buildable
from platwright.buildings.rules import LayoutRules
from platwright.buildings.shape import footprints
from platwright.buildings.types import EMPTY, ROWS, BuildingType, Placements
from shapely.geometry import box

from .zones import ORIGIN, SLAB, TYPES, breaches, standing, sunny, zone

RULES = LayoutRules(far=1.0, density=0.5, green=0.3, setback_m=5.0, gap_m=6.0, group_m=60.0)
GROUND = zone(200, 150, facilities=ROWS)
#: What each sentence of the judge is called by `breaches`.
WORDS = {
    "edge": ("within its patch", "edge of its patch"),
    "overlap": ("overlap",),
    "gap": ("nearer than the gap",),
    "group": ("m long",),
    "far": ("floor area ratio",),
    "density": ("density is",),
    "count": ("of type",),
    "shade": ("in the shade",),
}


def said(ground, types, rules, placed) -> set[str]:
    """What the judge finds, in the words of `breaches`."""
    found = set()
    for text in fits(ground, types, rules, placed):
        own = [key for key, words in WORDS.items() if any(word in text for word in words)]
        assert len(own) == 1, text
        found.add(own[0])
    return found


@pytest.mark.parametrize(
    ("buildings", "breach"),
    [
        ([(0, 50, 30)], None),
        ([(0, 50, 30), (0, 74, 30)], None),
        ([(0, 50, 30), (1, 69, 30)], None),
        ([(0, 50, 30), (0, 80.01, 30)], None),
        ([(0, 17.01, 11.01)], None),
        ([(0, 50, 30), (0, 50, 57.1)], None),
        ([(0, 50, 10)], "edge"),
        ([(0, 12, 30)], "edge"),
        ([(0, 50, 160)], "edge"),
        ([(0, 50, 30), (0, 60, 30)], "overlap"),
        ([(0, 50, 30), (0, 75, 30)], "gap"),
        ([(0, 50, 30), (0, 79, 30)], "gap"),
        ([(0, 50, 30), (3, 50, 45)], "gap"),
        ([(0, 30, 30), (0, 54, 30), (0, 78, 30)], "group"),
        ([(0, 50, 30), (0, 50, 50)], "shade"),
        # what has its back to the other takes its sun from 18 m away
        ([(0, 50, 30, 0.0), (3, 50, 80), (0, 100, 30, 0), (0, 100, 50, 0.0)], "shade"),
    ],
)
def test_each_breach_has_its_sentence(buildings, breach):
    placed = standing(*buildings)
    assert said(GROUND, TYPES, RULES, placed) == ({breach} if breach else set())
    assert breaches(GROUND, TYPES, RULES, placed) == ({breach} if breach else set())


def test_a_facility_may_stand_in_the_shade():
    placed = standing((0, 50, 30), (3, 50, 52))
    assert fits(GROUND, TYPES, RULES, placed) == []


def test_limits_of_the_whole_zone():
    rows = [(0, 30.0 + 30.5 * i, 20.0 + 29.0 * j) for i in range(5) for j in range(4)]
    placed = standing(*rows)
    area = 200 * 150
    far, density = 20 * SLAB.floor_area_m2 / area, 20 * SLAB.footprint_m2 / area
    just = LayoutRules(far=far, density=density, far_limit=far, density_limit=density)
    assert fits(GROUND, TYPES, just, placed) == []
    less = dataclasses.replace(just, far=far * 0.9, far_limit=far * 0.99)
    assert said(GROUND, TYPES, less, placed) == {"far"}
    less = dataclasses.replace(just, density=density * 0.9, density_limit=density * 0.99)
    assert said(GROUND, TYPES, less, placed) == {"density"}
    # 5 % more than the wish is allowed where no limit is given
    assert fits(GROUND, TYPES, LayoutRules(far=far / 1.049, density=density), placed) == []
    assert said(GROUND, TYPES, LayoutRules(far=far / 1.051, density=density), placed) == {"far"}
    few = (dataclasses.replace(SLAB, count=19), *TYPES[1:])
    assert said(GROUND, few, just, placed) == {"count"}
    assert fits(GROUND, (dataclasses.replace(SLAB, count=20), *TYPES[1:]), just, placed) == []


def test_a_hole_keeps_its_setback():
    ground = zone(200, 150, hole=box(80, 40, 100, 60))
    beside = standing((0, 65, 50))
    assert len(fits(ground, TYPES, RULES, beside)) == 1
    assert fits(ground, TYPES, RULES, standing((0, 60, 28))) == []
    upon = fits(ground, TYPES, RULES, standing((0, 90, 50)))
    assert any("obstacle" in text for text in upon)


def test_a_use_that_the_patch_leaves_out():
    bare = zone(200, 150, facilities=EMPTY)
    assert fits(bare, TYPES, RULES, standing((0, 50, 30))) == []
    assert "facility in a patch" in fits(bare, TYPES, RULES, standing((3, 50, 30)))[0]


def test_hours_of_sun_are_looked_at():
    """A tower close to the south takes the winter sun, one far to the north takes nothing."""
    rules = dataclasses.replace(RULES, sun=sunny(hours=3.0))
    dark = fits(GROUND, TYPES, rules, standing((0, 60, 60), (2, 60, 30)))
    assert dark == ["residence 0 is in the shade"]
    assert fits(GROUND, TYPES, rules, standing((0, 60, 30), (2, 60, 100))) == []


def test_nothing_breaks_no_rule():
    assert fits(GROUND, TYPES, RULES, Placements.empty()) == []


@st.composite
def crowds(draw) -> Placements:
    """Buildings on a grid coarse enough that walls often touch."""
    buildings = [
        (
            draw(st.integers(0, 3)),
            12.0 * draw(st.integers(1, 15)),
            6.5 * draw(st.integers(1, 21)),
            draw(st.sampled_from([180.0, 180.0, 180.0, 0.0, 90.0, 200.0])),
        )
        for _ in range(draw(st.integers(1, 7)))
    ]
    return standing(*buildings)


@settings(max_examples=200)
@given(crowds(), st.sampled_from([0.0, 17.0]))
def test_the_judge_agrees_with_a_slow_one(placed, turn):
    """Pair by pair, by shapes that shapely itself has turned."""
    ground = zone(200, 150, facilities=ROWS, turn=turn)
    angle = np.radians(-turn)
    spin = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    there = Placements(
        placed.type, (placed.xy - ORIGIN) @ spin.T + ORIGIN, (placed.facing + turn) % 360.0,
        placed.patch, placed.line,
    )  # fmt: skip
    rules = LayoutRules(far=0.2, density=0.05, sun=sunny(0.7))
    counted = (dataclasses.replace(SLAB, count=2), *TYPES[1:])
    assert said(ground, counted, rules, there) == breaches(ground, counted, rules, there)


@given(
    st.floats(20, 120), st.floats(20, 120), st.floats(0, 0.6), st.floats(0, 0.6), st.floats(0, 15),
    st.floats(0, 90), st.integers(0, 2**31),
)  # fmt: skip
def test_buildable_ground_is_what_keeps_the_setback(width, depth, a, b, setback, turn, seed):
    """A footprint is covered if and only if it lies in the patch and keeps off its edge."""
    ground = zone(width, depth, cut=(a * width, b * depth), turn=turn)
    rules = dataclasses.replace(RULES, setback_m=setback)
    room = buildable(ground, rules)[0]
    patch = ground.patches[0].polygon
    rng = np.random.default_rng(seed)
    kind = (BuildingType("hut", 6.0, 4.0, 3.0, 1),)
    low, high = np.array(patch.bounds[:2]), np.array(patch.bounds[2:])
    none = np.zeros(40, dtype=np.int64)
    many = Placements(none, rng.uniform(low, high, (40, 2)), rng.uniform(0, 360, 40), none, none)
    for shape in footprints(kind, many):
        off = patch.exterior.distance(shape) if patch.covers(shape) else -1.0
        if shapely.covers(room, shape):
            assert off >= setback - 1e-3
        elif off > setback + 1e-3:
            # only at the inner corner of an L may more be kept free: the mitre
            corner = shape.distance(patch.exterior.convex_hull.difference(patch))
            assert corner < setback * 1.5
