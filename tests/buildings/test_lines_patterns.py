"""What the lines of each pattern look like, by hand on simple patches."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from platwright.buildings.lines import control_lines
from platwright.buildings.rules import LayoutRules, SunRule
from platwright.buildings.sun import sun_hours
from platwright.buildings.types import FACILITY, BuildingType, Placements
from platwright.buildings.zone import Corridor
from shapely import affinity
from shapely.geometry import LineString, Point, Polygon, box

from .lines_setup import (
    DEMO1,
    ORIGIN,
    RULES,
    SLAB,
    ground_of,
    kinds,
    local,
    off,
    one_patch,
)

ROWS, CENTRIC, ENCLOSED, SYMMETRICAL, DOTTED = range(1, 6)
BLOCK = box(0, 0, 160, 130)
HOUSE = BuildingType("house", 20.0, 10.0, 18.0, 6)


def leaves(zone, types=(HOUSE,), rules=RULES):
    lines = [line for line in control_lines(zone, types, rules) if line.leaf]
    return sorted(lines, key=lambda line: line.order)


def test_rows_stand_at_the_spacing_of_the_sun_and_fill_the_depth():
    """Centre lines from 10 to 120 m; 5 + 18 m from one to the next at least: five rows."""
    lines = leaves(one_patch(BLOCK))
    height = [local(line)[0, 1] for line in lines]
    assert height[:5] == pytest.approx([10.0, 37.5, 65.0, 92.5, 120.0], abs=1e-3)
    for line in lines:
        assert line.facing_deg == pytest.approx(180.0)
        assert line.along
        assert local(line)[:, 0] == pytest.approx([5.0, 155.0], abs=1e-3)
    # the others offer a choice in between, at half the spacing at least
    assert 5 < len(lines) <= 10
    assert np.diff(sorted(height)).min() >= 23.0 / 2 - 1e-6


def test_main_rows_hold_for_the_type_that_needs_most():
    lines = leaves(one_patch(BLOCK), kinds())
    deepest = max(width / 2 + height for _, height, width in DEMO1)
    front = [line for line in lines if line.order < 4]
    height = np.sort([local(line)[0, 1] for line in front])
    assert np.diff(height).min() >= deepest - 1e-6


@pytest.mark.parametrize(("latitude", "sun"), [(50.0, 180.0), (-35.0, 0.0)])
@pytest.mark.parametrize("pattern", [ROWS, CENTRIC, SYMMETRICAL, DOTTED])
@pytest.mark.parametrize("convergence", [0.0, 2.5])
def test_balconies_face_the_equator_on_both_hemispheres(pattern, latitude, sun, convergence):
    round_ = Point(0, 0).buffer(80)
    zone = one_patch(round_, pattern, latitude=latitude, convergence=convergence)
    lines = leaves(zone)
    # slabs of rings turn by up to 60 degrees, all others look straight to the equator
    most = 60.0 if pattern == CENTRIC else 22.5
    for line in lines:
        assert off(line.facing_deg + convergence, sun) <= most + 0.01
    if pattern != CENTRIC:
        first = lines[0]
        assert off(first.facing_deg + convergence, sun) < 5.0


@pytest.mark.parametrize("latitude", [50.0, -35.0])
def test_the_front_row_is_on_the_side_of_the_equator(latitude):
    first = leaves(one_patch(BLOCK, latitude=latitude))[0]
    assert local(first)[0, 1] == pytest.approx(10.0 if latitude > 0 else 120.0, abs=1e-3)


@pytest.mark.parametrize(("turn", "followed"), [(0, 0), (12, 12), (-20, -20), (30, 0), (75, -15)])
def test_rows_follow_a_side_that_is_nearly_towards_the_sun(turn, followed):
    zone = one_patch(affinity.rotate(box(0, 0, 170, 90), turn))
    for line in leaves(zone):
        # turning by plane geometry is counter-clockwise, azimuths are clockwise
        assert line.facing_deg == pytest.approx(180.0 - followed, abs=0.01)


def test_the_wished_azimuth_of_a_patch_counts():
    for pattern in (ROWS, SYMMETRICAL, DOTTED):
        zone = one_patch(BLOCK, pattern, facing_deg=140.0)
        assert all(line.facing_deg == 140.0 for line in leaves(zone))


def test_enclosed_patches_have_a_line_along_each_side():
    lines = leaves(one_patch(box(0, 0, 160, 90), ENCLOSED))
    found = {}
    for line in lines:
        (x0, y0), (_, y1) = local(line)
        assert line.along
        if abs(y0 - y1) < 1e-6:
            found["south" if y0 < 45 else "north"] = (y0, line.facing_deg)
        else:
            found["west" if x0 < 80 else "east"] = (x0, line.facing_deg)
    assert found["south"] == pytest.approx((10.0, 180.0), abs=1e-3)
    assert found["north"] == pytest.approx((80.0, 180.0), abs=1e-3)
    # the sides that see the sun in the morning or in the evening look into the court
    assert found["west"] == pytest.approx((10.0, 90.0), abs=1e-3)
    assert found["east"] == pytest.approx((150.0, 270.0), abs=1e-3)
    assert len(lines) == 4


def test_deep_enclosed_patches_have_a_second_ring():
    outer, inner = 5.0 + 5.0, 5.0 + 5.0 + 23.0 + 5.0
    lines = leaves(one_patch(box(0, 0, 200, 200), ENCLOSED))
    edge = box(0, 0, 200, 200).exterior
    away = {round(LineString(local(line)).distance(edge), 2) for line in lines}
    assert {outer, inner} <= away


def test_rings_leave_a_green_middle():
    zone = one_patch(Point(0, 0).buffer(110), CENTRIC)
    lines = leaves(zone, kinds(SLAB))
    away = [Point(0, 0).distance(LineString(local(line))) for line in lines]
    assert min(away) > 0.25 * 110
    assert {line.along for line in lines} == {True, False}
    for line in lines:
        middle = local(line).mean(axis=0)
        way = (local(line)[1] - local(line)[0]) / line.length
        # a chord is square to the ray from the middle
        assert abs(way @ middle) / np.hypot(*middle) < math.sin(math.radians(12.0))
        if line.along:
            out = math.degrees(math.atan2(*middle))
            assert min(off(line.facing_deg, out), off(line.facing_deg, out + 180)) < 12.0
        else:
            assert line.facing_deg == pytest.approx(180.0, abs=0.5)


def test_arms_that_no_ring_reaches_get_rows():
    """Two squares that a neck joins which is too narrow for a ring."""
    shape = box(0, 0, 120, 120).union(box(115, 52, 170, 68)).union(box(165, 10, 265, 110))
    lines = leaves(one_patch(shape, CENTRIC))
    assert any(local(line)[:, 0].min() > 165 for line in lines)
    assert any(local(line)[:, 0].max() < 120 for line in lines)


def mirrored(xy, axis):
    """Points mirrored at the line through two others."""
    a, b = axis
    way = (b - a) / np.hypot(*(b - a))
    along = (xy - a) @ way
    return 2 * (a + along[:, None] * way) - xy


@pytest.mark.parametrize(
    "shape",
    [BLOCK, box(0, 0, 230, 90), Polygon([(0, 0), (200, 20), (60, 170)]),
     affinity.rotate(box(0, 0, 190, 110), 17),
     Polygon([(0, 0), (220, 0), (220, 70), (90, 70), (90, 190), (0, 190)]),
     box(0, 0, 200, 180).difference(Point(110, 90).buffer(28))],
)  # fmt: skip
def test_pairs_mirror_each_other_at_the_axis(shape):
    zone = one_patch(shape, SYMMETRICAL)
    lines = control_lines(zone, kinds(), RULES)
    axis = local(lines[0])
    pairs = [(k, line) for k, line in enumerate(lines) if line.mirror >= 0]
    assert len(pairs) >= 4
    for _, line in pairs:
        twin = lines[line.mirror]
        assert np.allclose(mirrored(local(line), axis), local(twin), atol=1e-4)
        assert twin.facing_deg == line.facing_deg
        assert twin.use == line.use


def test_the_axis_stays_free():
    """No building whose walls keep to the ends of its line reaches over the path on the axis."""
    zone = one_patch(BLOCK, SYMMETRICAL)
    lines = control_lines(zone, kinds(), RULES)
    path = LineString(local(lines[0])).buffer(RULES.path_m, cap_style="flat")
    for line in lines:
        if line.leaf:
            assert line.along
            assert LineString(local(line)).distance(path) >= 4.0 - 1e-6


def test_towers_stand_apart_and_see_the_sun_past_each_other():
    types = kinds(((16.3, 60.0, 12.3),))
    lines = leaves(one_patch(box(0, 0, 220, 200), DOTTED), types)
    assert len(lines) > 15
    middle = np.array([local(line).mean(axis=0) for line in lines])
    for k, (line, here) in enumerate(zip(lines, middle)):
        assert line.spacing_m >= 2 * 16.3
        assert line.length <= 2 * RULES.step_m + 1e-6
        others = np.delete(middle, k, axis=0)
        apart = np.abs(others - here)
        # the shadow is as wide as the tower and 60 m deep, from 6.15 m behind the centre
        shaded = (apart[:, 0] < 16.3) & (apart[:, 1] < 66.15 - 1e-6)
        assert not shaded.any()


def test_hours_of_sun_space_the_rows():
    """Two endless rows at the distance of the main rows leave the asked hours, and just so."""
    for latitude, hours in ((40.0, 2.0), (-33.0, 3.0), (55.0, 1.0)):
        rules = LayoutRules(sun=SunRule(hours=hours, month=1 if latitude > 0 else 6))
        zone = one_patch(box(0, 0, 200, 400), latitude=latitude)
        lines = leaves(zone, rules=rules)
        y = np.sort([local(line)[0, 1] for line in lines[:3]])
        wall = BuildingType("wall", 4000.0, 10.0, 18.0, 6)
        facing = 180.0 if latitude > 0 else 0.0
        for shift, enough in ((0.0, True), (-14.0, False)):
            at = np.array([0.0, (y[1] - y[0] + shift) * (1 if latitude > 0 else -1)])
            pair = Placements(
                np.zeros(2, dtype=int), np.column_stack([[0, 0], at]) + ORIGIN, np.full(2, facing),
                np.zeros(2, dtype=int), np.zeros(2, dtype=int),
            )  # fmt: skip
            assert (sun_hours(zone, (wall,), pair, rules.sun)[1] >= hours - 0.05) == enough


def test_facilities_stand_by_the_street_and_face_it():
    street = LineString([(0, 0), (160, 0)])
    zone = one_patch(BLOCK, ROWS, ROWS, street=street)
    lines = [line for line in leaves(zone, kinds()) if line.use == FACILITY]
    assert len(lines) >= 2
    for line in lines:
        assert line.facing_deg == pytest.approx(180.0)
        assert local(line)[:, 1].max() <= 5.0 + 15.0 + 1e-3
        # at a corner, so that the row behind keeps most of its length
        assert min(local(line)[:, 0].min(), 160 - local(line)[:, 0].max()) == pytest.approx(5.0)


def test_facilities_take_the_corner_of_important_streets_first():
    zone = one_patch(BLOCK, ROWS, ROWS, street=LineString([(0, 0), (160, 0)]))
    x0, y0 = ORIGIN
    main = Corridor(LineString([(x0 + 166, y0 - 50), (x0 + 166, y0 + 200)]), 12.0, 1)
    zone = dataclasses.replace(zone, corridors=(*zone.corridors, main))
    first = next(line for line in leaves(zone, kinds()) if line.use == FACILITY)
    assert local(first)[:, 0].max() > 140


def test_facilities_of_a_centric_patch_stand_in_the_middle():
    lines = [
        line for line in leaves(one_patch(BLOCK, ROWS, CENTRIC), kinds()) if line.use == FACILITY
    ]
    assert len(lines) == 1
    assert LineString(local(lines[0])).distance(Point(80, 65)) < 3.0


def test_facilities_of_a_symmetrical_patch_flank_its_axis():
    zone = one_patch(BLOCK, SYMMETRICAL, SYMMETRICAL, street=LineString([(0, 0), (160, 0)]))
    lines = control_lines(zone, kinds(), RULES)
    axis = local(lines[0])[:, 0]
    assert np.ptp(axis) < 1e-6
    x = [local(line)[:, 0].mean() for line in lines if line.use == FACILITY]
    assert min(x) < axis[0] < max(x)
    for line in lines:
        if line.use == FACILITY:
            assert np.abs(local(line)[:, 0] - axis[0]).min() >= 15.0 + RULES.path_m


def test_ground_is_the_patch_without_its_setback():
    """The rows of a setback of 0 reach to the edge."""
    rules = LayoutRules(setback_m=0.0)
    lines = leaves(one_patch(BLOCK), rules=rules)
    assert local(lines[0])[0] == pytest.approx([0.0, 5.0], abs=1e-3)
    assert ground_of(one_patch(BLOCK), rules).area == pytest.approx(BLOCK.area, rel=1e-4)
