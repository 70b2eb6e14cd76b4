"""The quick check for a way out, by cases whose answer is plain."""

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from clock import allowed
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.paths import ExitCheck
from platwright.buildings.paths.frame import Frame, covered
from platwright.buildings.rules import LayoutRules
from platwright.buildings.types import BuildingType, Placements
from shapely.geometry import LineString, box

from .paths_setup import SLAB, TYPES, make_placed, make_zone, small_town

RULES = LayoutRules()


def reached(zone, placed, types=TYPES, rules=RULES) -> list[bool]:
    return ExitCheck(zone, types, rules).reached(placed).tolist()


def test_a_building_on_open_ground_has_a_way_out():
    zone = make_zone(box(0, 0, 80, 60))
    assert reached(zone, make_placed([(0, 40, 30, 180, 0)])) == [True]
    assert reached(zone, Placements.empty()) == []


def test_no_street_no_way_out():
    zone = make_zone(box(0, 0, 80, 60), access=[[]])
    assert reached(zone, make_placed([(0, 40, 30, 180, 0)])) == [False]


def test_a_court_that_is_closed_has_no_way_out():
    # Four walls around a court of 30 m; entrances of the walls inside, and one tower within.
    long = BuildingType("long", 50.0, 10.0, 12.0, 4, entrance="same")
    short = BuildingType("short", 30.0, 10.0, 12.0, 4, entrance="same")
    tower = BuildingType("tower", 8.0, 8.0, 30.0, 10)
    zone = make_zone(box(0, 0, 100, 100))
    # (facing inwards, so that the entrances on the same side are inside)
    walls = [
        (0, 50, 30, 0, 0), (0, 50, 70, 180, 0), (1, 30, 50, 90, 0), (1, 70, 50, 270, 0),
        (2, 50, 50, 180, 0),
    ]  # fmt: skip
    types = (long, short, tower)
    assert reached(zone, make_placed(walls), types) == [False] * 5
    # A gap of 5 m north of the eastern wall lets a path of 3 m out, and one of 8 m not.
    less = BuildingType("less", 25.0, 10.0, 12.0, 4, entrance="same")
    walls[3] = (3, 70, 47.5, 270, 0)
    assert reached(zone, make_placed(walls), (*types, less)) == [True] * 5
    wide = LayoutRules(path_m=8.0)
    assert not any(reached(zone, make_placed(walls), (*types, less), wide))


def test_only_the_side_of_the_street_leads_out():
    ground = box(0, 0, 80, 60)
    # A wall from edge to edge; the street is in the south.
    wall = BuildingType("wall", 78.0, 10.0, 12.0, 4, entrance="same")
    zone = make_zone(ground, access=[[LineString([(0, 0), (80, 0)])]])
    south, north = make_placed([(0, 40, 30, 180, 0)]), make_placed([(0, 40, 30, 0, 0)])
    assert reached(zone, south, (wall,)) == [True]
    assert reached(zone, north, (wall,)) == [False]


def test_an_entrance_right_at_the_street_has_a_way_out():
    zone = make_zone(box(0, 0, 80, 60))
    front = BuildingType("front", 24.0, 12.0, 15.0, 5, entrance="same")
    assert reached(zone, make_placed([(0, 40, 6.5, 180, 0)]), (front,)) == [True]


def test_patches_do_not_depend_on_each_other():
    zone, placed = small_town()
    check = ExitCheck(zone, TYPES, RULES)
    whole = check.reached(placed)
    for patch in range(len(zone.patches)):
        here = placed.patch == patch
        assert np.array_equal(whole[here], check.reached(placed.take(here)))
    assert whole.all()


def test_the_check_is_quick():
    zone, placed = small_town()
    check = ExitCheck(zone, TYPES, RULES)
    check.reached(placed)
    took = []
    for _ in range(7):
        begun = time.perf_counter()
        check.reached(placed)
        took.append(time.perf_counter() - begun)
    # 2 ms on an idle machine.
    assert min(took) < allowed(0.015)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(0, 30), st.floats(0, 20), st.floats(0, 360), st.floats(1, 9)),
        max_size=4,
    )
)
def test_rows_cut_rectangles_as_shapely_does(boxes):
    xs, ys = np.arange(0.05, 30.0, 0.7), np.arange(0.03, 20.0, 0.9)
    centres = np.array([b[:2] for b in boxes]).reshape(-1, 2)
    angle = np.radians([b[2] for b in boxes])
    along = np.column_stack([np.cos(angle), np.sin(angle)]).reshape(-1, 2)
    half = np.array([(b[3], 2.0) for b in boxes]).reshape(-1, 2)
    mask = covered(xs, ys, centres, along, half, 0.5)
    across = np.column_stack([-along[:, 1], along[:, 0]])
    for r, c in np.ndindex(mask.shape):
        step = np.array([xs[c], ys[r]]) - centres
        u, v = np.abs((step * along).sum(axis=1)), np.abs((step * across).sum(axis=1))
        deep = np.minimum(half[:, 0] + 0.5 - u, 2.5 - v)
        if not (np.abs(deep) < 1e-6).any():
            assert mask[r, c] == (deep > 0).any()


def test_a_frame_turns_there_and_back():
    frame = Frame(10.0, -3.0, 0.7)
    points = np.random.default_rng(1).uniform(-50, 50, (20, 2))
    assert frame.outward(frame.inward(points)) == pytest.approx(points)
    turned = frame.geometry(shapely.box(0, 0, 4, 2))
    assert turned.area == pytest.approx(8.0)
    assert SLAB.footprint_m2 == pytest.approx(180.0)
