"""The ground while buildings are placed: overlaps, hours of sun, and what may still be tried."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.place.board import Board
from platwright.buildings.place.daylight import Daylight
from platwright.buildings.place.overlap import overlapping
from platwright.buildings.rules import LayoutRules
from platwright.buildings.sun import sun_hours
from platwright.buildings.types import Placements

from .sun_checks import outline
from .zones import TYPES, breaches, rows, standing, sunny, zone

GROUND = zone(200, 150, "south north")
RULES = LayoutRules(far=1.0, density=0.4)
FACES = (180.0, 180.0, 200.0, 90.0, 0.0, 313.0)


def scatter(seed: int, count: int, size: float = 150.0) -> Placements:
    rng = np.random.default_rng(seed)
    table = [
        (rng.integers(0, 4), *rng.uniform(20, size, 2), FACES[rng.integers(0, len(FACES))])
        for _ in range(count)
    ]
    return standing(*table)


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.05, 2.0]))
def test_overlaps_are_those_of_the_polygons(seed, depth):
    """Moved apart by less than the depth along some wall, shapes part that overlap less."""
    some, others = scatter(seed, 8), scatter(seed + 1, 11)
    found = overlapping(TYPES, some, others, depth)
    assert found.shape == (8, 11)
    for i in range(8):
        for j in range(11):
            one, two = outline(TYPES, some, i), outline(TYPES, others, j)
            assert found[i, j] == (deepest(one, two) > depth)


def deepest(one, two) -> float:
    """How far two rectangles must be moved along one of their sides until they part."""
    least = np.inf
    for shape in (one, two):
        ring = np.array(shape.exterior.coords)
        for a, b in ((0, 1), (1, 2)):
            axis = (ring[b] - ring[a]) / np.hypot(*(ring[b] - ring[a]))
            p, q = np.array(one.exterior.coords) @ axis, np.array(two.exterior.coords) @ axis
            least = min(least, min(p.max() - q.min(), q.max() - p.min()))
    return float(least)


def test_an_overlap_of_nothing_with_nothing():
    assert overlapping(TYPES, Placements.empty(), scatter(1, 3), 0.0).shape == (0, 3)
    assert overlapping(TYPES, scatter(1, 3), Placements.empty(), 0.0).shape == (3, 0)


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.lists(st.integers(0, 30), max_size=6), st.floats(0.5, 5))
def test_hours_of_sun_after_any_building_and_demolition(seed, lifted, asked):
    """Counted one by one they are those of all at once, and so is what is allowed."""
    rule = sunny(hours=asked)
    light = Daylight(GROUND, TYPES, rule)
    placed = Placements.empty()
    crowd = scatter(seed, 9)
    for at in range(8):
        one = crowd.take([at])
        light.put(placed, one)
        placed = placed.join(one)
    for at in lifted:
        if len(placed) > 2:
            at %= len(placed)
            one = placed.take([at])
            placed = placed.take(np.arange(len(placed)) != at)
            light.lift(placed, one, at)
    before = sun_hours(GROUND, TYPES, placed, rule)
    assert light.hours(placed) == pytest.approx(before)
    new = crowd.take([8])
    after = sun_hours(GROUND, TYPES, placed.join(new), rule)
    home = np.array([TYPES[k].use == "residence" for k in placed.join(new).type])
    lost = np.append(after[:-1] < before - 1e-9, True) & home
    assert light.allows(placed, new) == bool((after[lost] >= asked - 1e-6).all())


@settings(max_examples=25)
@given(
    st.integers(0, 10_000), st.sampled_from([0.0, 25.0]), st.sampled_from([0.5, 1.0, 1.6]),
    st.integers(0, 3),
)  # fmt: skip
def test_what_is_possible_holds_what_fits_and_what_fits_is_right(seed, lean, coefficient, kind):
    """The quick test throws away no place that fits; a place that fits breaks no rule."""
    rules = dataclasses.replace(RULES, sun=sunny(coefficient))
    ground = dataclasses.replace(GROUND, patches=[
        dataclasses.replace(p, facilities=1) for p in GROUND.patches
    ])  # fmt: skip
    lines = rows(ground, TYPES, rules, lean=lean)
    board = Board(ground, TYPES, rules, lines)
    rng = np.random.default_rng(seed)
    for _ in range(6):
        line = int(rng.integers(0, len(lines)))
        own = int(rng.integers(0, 4))
        one = board.at(own, line, rng.uniform(0, lines[line].length, 1))
        if board.fits(one):
            board.put(one)
    # beside what stands, and in a step
    line = int(board.placed.line[0]) if len(board.placed) else 0
    start, end = np.array(lines[line].start), np.array(lines[line].end)
    here = (board.placed.xy - start) @ (end - start) / lines[line].length
    half = np.array([k.length_m for k in TYPES])[board.placed.type] / 2 + TYPES[kind].length_m / 2
    t = np.concatenate([np.arange(0.0, lines[line].length, 7.0), here - half, here + half])
    t = t[(t >= 0) & (t <= lines[line].length)]
    many = board.at(kind, line, t)
    could = board.possible(many)
    good = np.array([board.fits(many.take([at])) for at in range(len(t))], dtype=bool)
    assert could[good].all()
    for at in rng.permutation(np.flatnonzero(good))[:4]:
        assert breaches(ground, TYPES, rules, board.placed.join(many.take([at]))) == set()
    for at in rng.permutation(np.flatnonzero(could & ~good))[:4]:
        # then it is the gap, an overlap of centimetres, a group or the way out
        broken = breaches(ground, TYPES, rules, board.placed.join(many.take([at])))
        assert broken <= {"gap", "group", "overlap"}


def test_room_for_one_more():
    """Until FAR, density or the number of a type is used up."""
    types = (dataclasses.replace(TYPES[0], count=3), *TYPES[1:])
    area = 200 * 150
    board = Board(GROUND, types, LayoutRules(far=1.0, density=0.4), ())
    for at in range(3):
        assert board.room_for(0)
        board.put(standing((0, 30 + 40 * at, 30)))
    assert not board.room_for(0)
    assert board.room_for(2)
    floor = 3 * types[0].floor_area_m2 + types[2].floor_area_m2
    just = dataclasses.replace(RULES, far=floor / area, far_limit=floor / area + 1e-9)
    for limit, expected in (
        (just, True),
        (dataclasses.replace(just, far=0.1, far_limit=floor / area - 1e-6), False),
    ):
        board.rules = limit
        assert board.room_for(2) is expected
    cover = 3 * types[0].footprint_m2 + types[2].footprint_m2
    for share, expected in ((cover / area + 1e-9, True), (cover / area - 1e-6, False)):
        board.rules = dataclasses.replace(RULES, density=share, density_limit=share)
        assert board.room_for(2) is expected


def test_what_is_lifted_is_given_back():
    board = Board(GROUND, TYPES, dataclasses.replace(RULES, sun=sunny(hours=2.0)), ())
    for at in range(4):
        board.put(standing((at, 30 + 40 * at, 30)))
    one = board.lift(1)
    assert one.type.tolist() == [1]
    assert board.placed.type.tolist() == [0, 2, 3]
    board.put(one)
    assert board.placed.type.tolist() == [0, 2, 3, 1]
    assert not board.fits(one)


def test_hours_are_right_after_any_move():
    """What is taken up gives back the sun that it took, and no other does."""
    rule = sunny(hours=3.0)
    board = Board(GROUND, TYPES, dataclasses.replace(RULES, sun=rule), ())
    crowd = [(2, 40, 40), (1, 40, 70), (2, 100, 40), (1, 100, 70), (0, 70, 90)]
    for building in crowd:
        board.put(standing(building))
    for at in (2, 0, 1, 3, 0):
        one = board.lift(at)
        for _ in range(2):
            found = board._daylight.hours(board.placed)
            assert found == pytest.approx(sun_hours(GROUND, TYPES, board.placed, rule))
            if len(board.placed) == len(crowd):
                break
            board.put(one)
    # the middle of the day is taken from some of them
    assert found.min() < found.max()


def test_who_borders_upon_one_keeps_the_gap_to_others():
    """A slab beside another one, with a low shop 3 m in front of it."""
    board = Board(GROUND, TYPES, RULES, rows(GROUND, TYPES, RULES))
    board.put(standing((0, 50, 30)))
    beside = standing((0, 74, 30))
    assert board.fits(beside)
    board.put(standing((3, 80, 14)))
    assert breaches(GROUND, TYPES, RULES, board.placed) == set()
    assert not board.fits(beside)
    board.lift(1)
    board.put(standing((3, 80, 114)))
    assert board.fits(beside)


def test_a_way_out_that_others_need_stays_open():
    """Only the south is street: a wall of shops may not shut in who stands behind."""
    rules = dataclasses.replace(RULES, setback_m=1.0)
    for width, passage in ((66.5, True), (63.5, False)):
        ground = zone(width, 80)
        board = Board(ground, TYPES, rules, rows(ground, TYPES, rules))
        board.put(standing((0, 30, 60)))
        for x in (12, 32):
            assert board.fits(standing((3, x, 20)))
            board.put(standing((3, x, 20)))
        # 62 m of wall: what is left to the east is a path's width or less
        assert board.fits(standing((3, 52, 20))) is passage
