"""Scores of streamlines, against figures worked out by hand and sums written out."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.parcels.field import (
    CLOSED,
    FRONTAGE,
    REASONS,
    STREET,
    Region,
    Spacing,
    Weights,
    cross_field,
    meet_streets,
    outline,
    propose,
    score,
    streamlines,
)
from shapely.affinity import rotate
from shapely.geometry import Point, Polygon, box

RECTANGLE = box(0, 0, 300, 225)
DISC = Point(0, 0).buffer(100, quad_segs=24)
RING = DISC.difference(Point(0, 0).buffer(40, quad_segs=24))


def set_up(shape, **wishes):
    field = cross_field(shape)
    lines = streamlines(field)
    return field, lines, score(field, lines, Region.of(shape), **wishes)


def end_points(lines):
    return np.stack([lines.points[lines.first[:-1]], lines.points[lines.first[1:] - 1]], axis=1)


# -- distances -------------------------------------------------------------------------------


def brute_force(y, kind, depth, street, widths):
    """The least over all sums of up to six blocks, written out."""
    pitches = [width + street for width in widths]
    start = {STREET: 0.0, FRONTAGE: -street / 2, CLOSED: depth + street / 2}[kind]
    costs = [abs(y - start) / min(pitches)] if kind == CLOSED else []
    for count in range(1, 7):
        for chosen in itertools.combinations_with_replacement(pitches, count):
            off = abs(y - start - sum(chosen))
            costs.append(off / (min(pitches) * count**0.5))
    return min(1.0, *costs)


@settings(max_examples=40)
@given(
    st.floats(0, 250),
    st.sampled_from([STREET, FRONTAGE, CLOSED]),
    st.floats(20, 40),
    st.floats(6, 20),
    st.lists(st.floats(45, 90), max_size=3),
)
def test_opt_is_the_best_of_all_sums(y, kind, depth, street, widths):
    spacing = Spacing(depth, street, tuple(widths))
    found = spacing.opt(np.array([y]), np.array([kind]))[0]
    # sums within 0.1 m of each other count as one
    off = 0.6 / spacing.pitch
    assert found == pytest.approx(
        brute_force(y, kind, depth, street, widths or [2 * depth]), abs=off
    )


def test_good_distances_by_hand():
    spacing = Spacing(depth=30, street=15)
    assert spacing.pitch == 75
    assert spacing.sums(STREET, 200)[0].tolist() == [75, 150, 225]
    assert spacing.sums(FRONTAGE, 140)[0].tolist() == [67.5, 142.5]
    assert spacing.sums(CLOSED, 120)[0].tolist() == [37.5, 112.5, 187.5]
    assert spacing.least(np.array([STREET, FRONTAGE, CLOSED])).tolist() == [75, 67.5, 37.5]


@pytest.mark.parametrize("wrong", [{"depth": 0}, {"street": -1}, {"widths": (60.0, float("nan"))}])
def test_patterns_of_no_width_are_refused(wrong):
    with pytest.raises(InputError, match="Give numbers"):
        Spacing(**wrong)


# -- scores ----------------------------------------------------------------------------------


def test_divergence_is_the_integral_over_length_to_the_power():
    # a sector of an annulus: radii part by 1 / r, so DIV = ln(r1 / r0) / length^0.9
    angle = np.linspace(0, np.pi / 2, 40)
    inner, outer = 100.0, 250.0
    sector = Polygon(
        np.r_[
            np.c_[outer * np.cos(angle), outer * np.sin(angle)],
            np.c_[inner * np.cos(angle), inner * np.sin(angle)][::-1],
        ]
    )
    _, lines, scores = set_up(sector)
    radial = np.abs(lines.length - 150) < 1
    assert radial.sum() > 5
    expected = np.log(outer / inner) / 150**0.9
    assert np.median(scores.div[radial]) == pytest.approx(expected, rel=0.01)
    # and arcs do not part at all
    arcs = lines.length > 170
    assert arcs.sum() > 5
    assert scores.div[arcs].max() < 0.05 * expected


def test_distance_to_boundary_of_a_rectangle_by_hand():
    _, lines, scores = set_up(RECTANGLE)
    both = end_points(lines)
    spacing = Spacing()
    for line in range(len(lines)):
        axis = 0 if abs(both[line, 0, 0] - both[line, 1, 0]) < 1 else 1
        near = both[line, 0, axis]
        sides = np.array([near, RECTANGLE.bounds[2 + axis] - near])
        expected = spacing.opt(sides, np.zeros(2, int)).mean()
        assert scores.db[line] == pytest.approx(expected, abs=0.02)
        tight = sides.min() < 0.6 * 75
        if abs(sides.min() - 45) > 2:
            assert (REASONS[scores.reason[line]] == "too near the boundary") == tight


def test_the_best_street_of_a_rectangle_leaves_room_for_two_rows():
    # 300 x 225 m: 75 m or 150 m from the long sides, 75, 150 or 225 m from the short ones
    result = propose(Region.of(rotate(RECTANGLE, 30)))
    assert result.best
    best = result.scores.order[0]
    assert result.scores.db[best] < 0.02
    assert result.scores.least_angle[best] == pytest.approx(90, abs=0.1)


def test_no_street_ends_where_there_is_none():
    # no street along the left and the right
    site = box(0, 0, 262.5, 300)
    edges = outline(site)
    upright = np.abs(edges.start[:, 0] - edges.end[:, 0]) < 1
    result = propose(Region(site, np.where(upright, CLOSED, STREET)))
    both = end_points(result.lines)
    level = np.abs(both[:, 0, 1] - both[:, 1, 1]) < 1
    assert level.any()
    assert (result.scores.closed == level).all()
    for best in result.best[:2]:
        assert result.scores.closed[best] == 0
        # 37.5 m for one row and half a street, and 75 m for each block
        place = both[best, 0, 0]
        expected = Spacing().opt(np.array([place, 262.5 - place]), np.full(2, CLOSED)).mean()
        assert result.scores.db[best] == pytest.approx(expected, abs=0.02)


def test_sharp_bends_are_measured():
    # a street that follows an arc of 40 m turns by 36 degrees in 25 m, a straight one not at all
    angle = np.linspace(0, np.pi / 2, 30)
    arc = np.c_[np.cos(angle), np.sin(angle)]
    elbow = Polygon(np.r_[130 * arc, [[-200, 130]], [[-200, 20]], (20 * arc)[::-1]])
    _, lines, scores = set_up(elbow)
    drawn = lines.geometry()
    straight = lines.length < shapely.distance(*end_points_as_points(lines)) + 0.01
    assert scores.bend[straight].max() < 0.05
    curved = shapely.distance(drawn, Point(0, 0)) < 45
    assert scores.bend[curved & ~straight].max() > 0.3


def end_points_as_points(lines):
    both = end_points(lines)
    return shapely.points(both[:, 0]), shapely.points(both[:, 1])


def test_singularities_are_measured_exactly():
    field, lines, scores = set_up(DISC)
    exact = shapely.distance(lines.geometry(), shapely.MultiPoint(field.singularities))
    assert np.allclose(scores.ds, exact)
    assert (set_up(RECTANGLE)[2].ds == 0).all()


def test_streets_are_continued_and_other_junctions_kept_off():
    # a street comes from the south at x = 152: 2 m from a line of seeds
    region = Region(RECTANGLE, np.zeros(4, int), np.array([[152.0, 0.0]]), np.array([[0.0, -1.0]]))
    field = cross_field(RECTANGLE)
    seeds = np.array([[150.0, 100.0], [130.0, 100.0], [230.0, 100.0]])
    lines = streamlines(field, first=seeds)
    moved = meet_streets(lines, region, field.mesh.outline)
    scores = score(field, moved, region)
    both = end_points(moved)
    south = both[both[..., 1] == 0]
    assert np.isclose(south[:, 0], 152).any()
    for line, ends in enumerate(both):
        at = ends[ends[:, 1] == 0]
        if len(at) != 1:
            continue
        off = abs(at[0, 0] - 152)
        corner = min(at[0, 0], 300 - at[0, 0])
        assert scores.ct[line] == (0.5 if off < 1e-9 else 1.0)
        north = 0.5 * (min(ends[:, 0].min(), 300 - ends[:, 0].max()) < 45)
        here = 0.5 * (4 < off < 45 or 4 < corner < 45)
        assert scores.offset[line] == here + north


def test_a_street_that_is_continued_is_met_exactly_and_bent_evenly():
    region = Region(RECTANGLE, np.zeros(4, int), np.array([[152.0, 0.0]]), np.array([[0.0, -1.0]]))
    field = cross_field(RECTANGLE)
    lines = streamlines(field, first=np.array([[150.0, 100.0]]))
    moved = meet_streets(lines, region, field.mesh.outline)
    edges = outline(RECTANGLE)
    number = edges.first[moved.ring] + moved.edge
    place = edges.start[number] + moved.t[..., None] * (edges.end - edges.start)[number]
    assert np.allclose(place, end_points(moved))
    assert np.allclose(shapely.length(moved.geometry()), moved.length)
    # one end of one line
    assert (np.abs(end_points(moved) - end_points(lines)).max(axis=2) > 1e-9).sum() == 1


def test_acute_ends_are_no_candidates():
    wedge = Polygon([(0, 0), (500, 0), (500, 260)])
    _, lines, scores = set_up(wedge)
    both = end_points(lines)
    drawn = lines.geometry()
    for line in range(len(lines)):
        worst = 180.0
        for k, at in ((0, 3.0), (1, -3.0)):
            a = both[line, k]
            way = shapely.get_coordinates(shapely.line_interpolate_point(drawn[line], at))[0] - a
            for s in (-2, 2):
                on = wedge.exterior.project(Point(a)) + s
                b = shapely.get_coordinates(wedge.exterior.interpolate(on % wedge.length))[0] - a
                cosine = way @ b / np.hypot(*way) / np.hypot(*b)
                worst = min(worst, np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        if worst < 52:
            assert REASONS[scores.reason[line]] == "meets the boundary at an acute angle"
        if worst > 58:
            assert REASONS[scores.reason[line]] != "meets the boundary at an acute angle"


def test_narrow_regions_get_streets_across_in_the_middle():
    strip = rotate(box(0, 0, 400, 80), 12)
    result = propose(Region.of(strip))
    assert result.across
    best = result.best[0]
    assert result.lines.length[best] == pytest.approx(80, abs=0.1)
    assert result.scores.balance[best] < 0.15
    wide = propose(Region.of(strip), across=False)
    assert not wide.across


def test_weights_decide():
    site = box(0, 0, 300, 225)
    only = {"div": 0, "db": 0, "ds": 0, "ct": 0, "offset": 0, "angle": 0, "closed": 0, "bend": 0}
    even = propose(Region.of(site), weights=Weights(**{**only, "balance": 1}))
    areas = [piece.area for piece in even.pieces[0]]
    assert abs(areas[0] - areas[1]) / sum(areas) < 0.06
    far = propose(Region.of(site), weights=Weights(**{**only, "db": 1, "balance": 0}))
    assert far.scores.db[far.best[0]] == far.scores.db[far.scores.order].min()
    assert ((far.scores.quality >= 0) & (far.scores.quality <= 1)).all()
    with pytest.raises(InputError, match="weights"):
        Weights(**{**only, "balance": 0})
