"""Control lines of all patterns: on the ground, with room, as a tree."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.buildings.lines import control_lines
from platwright.buildings.types import BUILDING_PATTERNS, FACILITY, RESIDENCE
from shapely.geometry import LineString, Point, Polygon, box

from .lines_setup import (
    DEMO1,
    FACILITIES,
    RULES,
    SLAB,
    fits_somewhere,
    ground_of,
    grounds,
    has_room,
    kinds,
    off,
    one_patch,
)

PATTERNS = range(1, 6)
SHAPES = {
    "rectangle": box(0, 0, 160, 130),
    "L": Polygon([(0, 0), (220, 0), (220, 70), (90, 70), (90, 190), (0, 190)]),
    "triangle": Polygon([(0, 0), (200, 20), (60, 170)]),
    "pond": box(0, 0, 200, 180).difference(Point(110, 90).buffer(28)),
    "curve": Point(0, 0).buffer(230).difference(Point(0, 0).buffer(110)).intersection(
        box(0, 0, 230, 230)
    ),
    "strip": box(0, 0, 34, 150),
    "neck": box(0, 0, 80, 80).union(box(75, 36, 130, 44)).union(box(125, 0, 200, 80)),
}  # fmt: skip


def check_tree(zone, lines, types, rules=RULES) -> None:
    """All that holds for any control lines."""
    roots = [line.patch for line in lines if line.parent < 0]
    assert len(roots) == len(set(roots)), "one tree per patch"
    for k, line in enumerate(lines):
        assert line.length > 0
        assert 0 <= line.facing_deg < 360
        if line.parent < 0:
            assert not line.leaf
        else:
            assert line.parent < k, "parents come before children, so there is no cycle"
            assert not lines[line.parent].leaf
            assert lines[line.parent].patch == line.patch
        shape = LineString([line.start, line.end])
        if not line.leaf:
            assert zone.patches[line.patch].polygon.buffer(0.02).covers(shape)
            continue
        ground = ground_of(zone, rules, line.patch)
        assert ground.covers(shape)
        assert has_room(ground, line, types), "a line on which nothing fits is of no use"
        if line.mirror >= 0:
            assert line.mirror != k
            assert lines[line.mirror].mirror == k
            assert lines[line.mirror].length == pytest.approx(line.length, abs=1e-6)


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("homes", [DEMO1, SLAB])
def test_lines_lie_on_the_ground_and_have_room(name, pattern, homes):
    types = kinds(homes)
    for paths in (1, 2, 3):
        zone = one_patch(SHAPES[name], pattern, pattern, paths=paths)
        lines = control_lines(zone, types, RULES)
        check_tree(zone, lines, types)
        assert {line.use for line in lines if line.leaf} >= {RESIDENCE}
        assert len([line for line in lines if line.leaf]) <= 130


@pytest.mark.parametrize("pattern", PATTERNS)
@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow])
@given(shape=grounds(), south=st.booleans(), paths=st.integers(1, 3), direction=st.integers(0, 1))
def test_wherever_a_building_fits_there_is_a_line(pattern, shape, south, paths, direction):
    types = kinds()
    zone = one_patch(
        shape, pattern, pattern, latitude=-30.0 if south else 50.0, paths=paths,
        path_direction=direction,
    )  # fmt: skip
    lines = control_lines(zone, types, RULES)
    check_tree(zone, lines, types)
    if fits_somewhere(ground_of(zone), zone.equator_deg, types):
        assert any(line.use == RESIDENCE and line.leaf for line in lines)


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("size", [(20.0, 18.0), (10.8, 10.2), (12.0, 30.0)])
def test_a_patch_as_large_as_one_building_has_a_line(pattern, size):
    types = kinds(((size[0], 12.0, size[1]),))
    whole = box(0, 0, size[0] + 10.0, size[1] + 10.0)
    lines = control_lines(one_patch(whole, pattern), types, RULES)
    assert any(line.leaf for line in lines)
    smaller = box(0, 0, size[0] + 9.9, size[1] + 9.9)
    assert control_lines(one_patch(smaller, pattern), types, RULES) == ()


@pytest.mark.parametrize("pattern", PATTERNS)
def test_where_nothing_fits_that_faces_the_sun_buildings_turn(pattern):
    """A strip from south to north, too narrow for façades towards the sun."""
    zone = one_patch(box(0, 0, 23.0, 120.0), pattern)
    types = kinds(((30.0, 12.0, 12.0),))
    lines = [line for line in control_lines(zone, types, RULES) if line.leaf]
    assert lines
    check_tree(zone, control_lines(zone, types, RULES), types)
    assert all(off(line.facing_deg, 180.0) == pytest.approx(90.0) for line in lines)


def test_an_empty_pattern_leaves_its_use_out():
    types = kinds()
    shape = SHAPES["rectangle"]
    assert control_lines(one_patch(shape, 0, 0), types, RULES) == ()
    only = control_lines(one_patch(shape, 0, 1), types, RULES)
    assert {line.use for line in only if line.leaf} == {FACILITY}
    homes = control_lines(one_patch(shape, 1, 0), types, RULES)
    assert {line.use for line in homes if line.leaf} == {RESIDENCE}
    # nor are there lines for a use without types, or with types that nobody wants
    assert control_lines(one_patch(shape, 0, 1), kinds(others=()), RULES) == ()
    none = tuple(dataclasses.replace(kind, count=0) for kind in types)
    assert control_lines(one_patch(shape, 1, 1), none, RULES) == ()


def test_patches_have_trees_of_their_own():
    one = one_patch(box(0, 0, 100, 90), 1, 1)
    two = one_patch(box(120, 0, 240, 90), 4, 1, paths=1)
    zone = dataclasses.replace(
        one, polygon=one.polygon.union(two.polygon), patches=(*one.patches, *two.patches)
    )
    types = kinds()
    lines = control_lines(zone, types, RULES)
    check_tree(zone, lines, types)
    assert [line.patch for line in lines if line.parent < 0] == [0, 1]
    assert len(lines) == len(control_lines(one, types, RULES)) + len(
        control_lines(two, types, RULES)
    )


@pytest.mark.parametrize("pattern", PATTERNS)
def test_facilities_come_first_and_take_little(pattern):
    zone = one_patch(SHAPES["rectangle"], 1, pattern)
    lines = [line for line in control_lines(zone, kinds(), RULES) if line.leaf]
    first = max(line.order for line in lines if line.use == FACILITY)
    assert first < min(line.order for line in lines if line.use == RESIDENCE)
    assert len({line.order for line in lines}) == len(lines)
    if BUILDING_PATTERNS[pattern] != "enclosed":
        length = sum(line.length for line in lines if line.use == FACILITY)
        assert length <= 4 * 1.25 * max(length for length, _, _ in FACILITIES)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_same_twice(pattern):
    zone = one_patch(SHAPES["triangle"], pattern, pattern)
    assert control_lines(zone, kinds(), RULES) == control_lines(zone, kinds(), RULES)


@pytest.mark.parametrize(("paths", "least"), [(1, 4), (2, 1), (3, 4)])
def test_the_path_pattern_shapes_the_upper_tree(paths, least):
    zone = one_patch(SHAPES["rectangle"], 1, paths=paths)
    upper = [line for line in control_lines(zone, kinds(), RULES) if not line.leaf]
    assert len(upper) >= least
    shapes = [LineString([line.start, line.end]) for line in upper]
    whole = shapely.union_all(shapes)
    assert whole.distance(zone.patches[0].access) < 0.02, "paths lead to the street"
    if paths == 1:
        assert len(shapely.get_parts(shapely.polygonize([shapely.node(whole)]))) == 1
    if paths == 3:
        assert all(shape.crosses(shapes[0]) for shape in shapes[1:]), "branches of a spine"


@pytest.mark.parametrize(("paths", "direction"), [(1, 1), (1, 0)])
def test_a_loop_runs_inside_or_along_the_edge(paths, direction):
    zone = one_patch(SHAPES["rectangle"], 3, paths=paths, path_direction=direction)
    upper = [line for line in control_lines(zone, kinds(), RULES) if not line.leaf]
    sides = np.array([LineString([line.start, line.end]) for line in upper[:4]])
    away = shapely.distance(sides, zone.patches[0].polygon.exterior)
    assert (away > 25.0).all() if direction else (away < 3.0).all()
