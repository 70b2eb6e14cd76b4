"""Smoothing: gentler streets, squarer junctions, and never another network.

What may not change is looked for by plain code of its own: which ends meet, how many blocks
there are, what crosses what, and how far anything has moved.
"""

from __future__ import annotations

import doctest
import importlib
import math
import time

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.progress import Silent
from platwright.streets.angles import count_bends
from platwright.streets.fillets import fillet
from platwright.streets.smooth_anchors import find_anchors
from platwright.streets.smooth_graph import build_net
from platwright.streets.smooth_layer import smooth_streets
from platwright.streets.smoothing import Smoothing, smooth_net
from scipy.spatial import Delaunay, cKDTree
from shapely.geometry import LineString, MultiLineString, Point, box

# A plane in metres, true to scale around its origin.
CRS = "+proj=tmerc +lat_0=60 +lon_0=25 +k=1 +datum=WGS84 +units=m +type=crs"


def layer(*shapes, crs=CRS, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=crs)


def lines_of(frame):
    return list(frame.geometry)


# Plain checks that share nothing with the code under test


def meeting_ends(lines, near=1e-6):
    """Groups of line ends that are at one place, each end as 2 x line + (0 start, 1 end)."""
    ends = np.array([line.coords[k] for line in lines for k in (0, -1)])
    return sorted({tuple(sorted(group)) for group in cKDTree(ends).query_ball_point(ends, near)})


def block_count(lines, least=1e-9):
    """How many blocks there are, but for what rounding makes where streets part at a point."""
    blocks = shapely.get_parts(shapely.polygonize([shapely.union_all(lines)]))
    return int((shapely.area(blocks) > least).sum())


def crossings(lines):
    """How often each pair of lines meets where neither ends."""
    found = {}
    for i, j in np.transpose(shapely.STRtree(lines).query(lines, predicate="intersects")).tolist():
        a, b = lines[i], lines[j]
        tips = shapely.MultiPoint([line.coords[k] for line in (a, b) for k in (0, -1)])
        inner = [p for p in shapely.get_parts(a.intersection(b)) if p.distance(tips) > 1e-6]
        if i < j and inner:
            found[i, j] = len(inner)
    return found


def furthest(a, b):
    """The furthest that a point of either line is from the other one."""
    steps = np.linspace(0, 1, 60)
    one, other = (shapely.line_interpolate_point(line, steps, normalized=True) for line in (a, b))
    gaps = [shapely.distance(one, b), shapely.distance(other, a)]
    for line, to in ((a, b), (b, a)):
        gaps.append(shapely.distance(shapely.points(line.coords), to))
    return np.concatenate(gaps).max()


def corner_errors(lines):
    """How far the corners at junctions of three and four streets are from 90 or 180 degrees."""
    found = []
    for group in meeting_ends(lines):
        if len(group) not in (3, 4):
            continue
        bearings = []
        for end in group:
            line = lines[end // 2] if end % 2 == 0 else lines[end // 2].reverse()
            there = line.interpolate(min(15.0, line.length / 2))
            bearings.append(math.atan2(there.y - line.coords[0][1], there.x - line.coords[0][0]))
        around = np.degrees(np.sort(bearings))
        corners = np.diff([*around, around[0] + 360])
        found += [min(abs(c - 90), abs(c - 180)) for c in corners]
    return np.array(found)


def assert_same_network(before, after, most):
    assert meeting_ends(after) == meeting_ends(before)
    assert block_count(after) == block_count(before)
    assert crossings(after) == crossings(before)
    assert all(line.is_simple for line, old in zip(after, before) if old.is_simple)
    assert max(map(furthest, before, after)) <= most + 0.01


# Networks


def jittered_grid(nx, ny, size, jitter, seed, *, drop=0.0, bent=True):
    """Streets of a grid whose junctions, and middles of streets, are where chance puts them."""
    random = np.random.default_rng(seed)
    at = {
        (i, j): np.array([i * size, j * size]) + random.uniform(-jitter, jitter, 2)
        for i in range(nx)
        for j in range(ny)
    }
    lines = []
    for i, j in at:
        for other in ((i + 1, j), (i, j + 1)):
            if other in at and random.random() >= drop:
                a, b = at[i, j], at[other]
                middle = (a + b) / 2 + random.uniform(-jitter, jitter, 2) / 2
                lines.append(LineString([a, middle, b] if bent else [a, b]))
    return lines


def triangles(count, size, seed, *, drop=0.3):
    """Streets along some edges of a triangulation of random points: any angles, any lengths."""
    random = np.random.default_rng(seed)
    points = random.uniform(0, size, (count, 2))
    edges = {tuple(sorted((t[k], t[k - 1]))) for t in Delaunay(points).simplices for k in range(3)}
    lines = [LineString(points[list(edge)]) for edge in sorted(edges)]
    # What is within half a metre of a street meets it: chance shall not make junctions.
    clear = [np.sort(shapely.distance(line, shapely.points(points)))[2] > 1 for line in lines]
    return [line for line, alone in zip(lines, clear) if alone and random.random() >= drop]


@st.composite
def networks(draw):
    seed = draw(st.integers(0, 10**6))
    if draw(st.booleans()):
        size = draw(st.sampled_from([30.0, 80.0, 150.0]))
        share = draw(st.floats(0.0, 0.3))
        drop = draw(st.sampled_from([0.0, 0.2, 0.5]))
        shape = draw(st.integers(2, 5)), draw(st.integers(2, 5))
        lines = jittered_grid(*shape, size, share * size, seed, drop=drop)
    else:
        lines = triangles(draw(st.integers(4, 25)), draw(st.sampled_from([100.0, 400.0])), seed)
    if not lines:
        lines = [LineString([(0, 0), (50, 5), (100, 0)])]
    return lines


wishes = st.builds(
    Smoothing,
    shape=st.sampled_from(["curved", "straight"]),
    strength=st.sampled_from([0.0, 0.3, 0.5, 1.0]),
    max_move=st.sampled_from([None, 0.5, 5.0, 40.0]),
    fillet_radius=st.sampled_from([0.0, 15.0, 30.0]),
    square=st.booleans(),
)


@settings(max_examples=40)
@given(lines=networks(), asked=wishes)
def test_any_network_stays_the_same_network(lines, asked):
    made = smooth_streets(layer(*lines), asked)
    assert made.complete
    assert_same_network(lines, lines_of(made.streets), made.max_move)
    assert made.largest_move <= made.max_move + 0.01
    told = made.streets["moved_m"].to_numpy()
    # The field looks at vertices only, the plain check at points between them, too.
    assert told == pytest.approx(np.array([*map(furthest, lines, lines_of(made.streets))]), abs=0.2)
    assert made.after.junctions == made.before.junctions


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), shape=st.sampled_from(["curved", "straight"]))
def test_jittered_grids_become_square(seed, shape):
    lines = jittered_grid(5, 5, 80.0, 10.0, seed, drop=0.1)
    made = smooth_streets(layer(*lines), Smoothing(shape=shape))
    before, after = corner_errors(lines), corner_errors(lines_of(made.streets))
    assert after.mean() < 0.5 * before.mean()
    assert made.before.angle_mean == pytest.approx(before.mean(), abs=1e-6)
    assert made.after.angle_mean == pytest.approx(after.mean(), abs=1e-6)
    assert np.percentile(after, 90) < np.percentile(before, 90)
    assert made.after.bends <= made.before.bends


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), shape=st.sampled_from(["curved", "straight"]))
def test_smoothing_again_changes_little(seed, shape):
    lines = jittered_grid(4, 4, 80.0, 8.0, seed)
    asked = Smoothing(shape=shape, max_move=15.0)
    once = smooth_streets(layer(*lines), asked)
    twice = smooth_streets(layer(*lines_of(once.streets)), asked)
    assert twice.largest_move < 0.5 * once.largest_move
    first, second = once.streets["moved_m"].mean(), twice.streets["moved_m"].mean()
    assert second < 0.35 * first


def test_the_same_input_gives_the_same_result():
    lines = triangles(20, 300.0, 3)
    one, other = (smooth_streets(layer(*lines)).streets for _ in range(2))
    assert shapely.equals_exact(one.geometry.array, other.geometry.array).all()


def test_straight_streets_stay_exactly_where_they_are():
    lines = jittered_grid(4, 3, 80.0, 0.0, 0, bent=False)
    made = smooth_streets(layer(*lines), Smoothing(fillet_radius=0.0))
    assert made.largest_move == pytest.approx(0.0, abs=1e-6)
    assert made.after.angle_mean == pytest.approx(0.0, abs=1e-6)


# What moves, and how


def test_a_staircase_becomes_a_diagonal():
    steps = [(30.0 * (k // 2 + k % 2), 30.0 * (k // 2)) for k in range(21)]
    stairs = LineString(steps)
    assert count_bends(np.array([stairs], dtype=object)) == 19
    for shape in ("curved", "straight"):
        made = smooth_streets(layer(stairs), Smoothing(shape=shape, strength=1.0, max_move=20.0))
        assert made.before.bends == 19
        assert made.after.bends <= 4
        (line,) = lines_of(made.streets)
        diagonal = LineString([steps[3], steps[-4]])
        inner = shapely.ops.substring(line, 0.2, 0.8, normalized=True)
        assert max(diagonal.distance(Point(c)) for c in inner.coords) < 13


@pytest.mark.parametrize("shape", ["curved", "straight"])
def test_a_leg_is_drawn_square_and_the_through_street_straight(shape):
    main = LineString([(-150, 0), (0, 8), (150, 0)])
    leg = LineString([(0, 8), (25, 100)])
    made = smooth_streets(layer(main, leg), Smoothing(shape=shape, max_move=15.0))
    street, foot = lines_of(made.streets)
    junction = Point(foot.coords[0])
    assert street.distance(junction) < 1e-6
    along = [street.interpolate(street.project(junction) + d) for d in (-15, 15)]
    out = foot.interpolate(15)
    through = math.atan2(along[1].y - along[0].y, along[1].x - along[0].x)
    away = math.atan2(out.y - junction.y, out.x - junction.x)
    assert math.degrees(away - through) == pytest.approx(90, abs=4)
    turn = [
        math.atan2(b.y - a.y, b.x - a.x) for a, b in ((along[0], junction), (junction, along[1]))
    ]
    assert math.degrees(turn[1] - turn[0]) == pytest.approx(0, abs=2.5)
    # A leg that meets it askew, as a slip road does, is left alone.
    slip = LineString([(0, 8), (90, 40)])
    made = smooth_streets(layer(main, slip), Smoothing(shape=shape, max_move=15.0))
    (street, foot) = lines_of(made.streets)
    out = foot.interpolate(15)
    assert abs(math.degrees(math.atan2(out.y - foot.coords[0][1], out.x - foot.coords[0][0]))) < 40


def test_junctions_are_left_at_their_angles_where_that_is_asked():
    lines = [LineString([(-150, 0), (0, 0), (150, 0)]), LineString([(0, 0), (40, 100)])]
    made = smooth_streets(layer(*lines), Smoothing(square=False))
    assert made.largest_move < 0.05


def test_a_roundabout_stays_round():
    angles = np.linspace(0, 2 * math.pi, 25)
    ring = LineString(np.column_stack([15 * np.cos(angles), 15 * np.sin(angles)]))
    arms = [LineString([(15, 0), (60, 5), (120, -10)]), LineString([(-15, 0), (-120, 20)])]
    made = smooth_streets(layer(ring, *arms))
    assert lines_of(made.streets)[0].equals_exact(ring, 1e-9)
    assert made.streets["moved_m"].max() > 0


def test_a_corner_stays_a_corner_and_gets_an_arc():
    corner = LineString([(0, 0), (200, 0), (200, 200)])
    plain = smooth_streets(layer(corner), Smoothing(fillet_radius=0.0))
    assert plain.streets.geometry.iloc[0].distance(Point(200, 0)) < 1.5
    made = smooth_streets(layer(corner), Smoothing(fillet_radius=25.0))
    line = made.streets.geometry.iloc[0]
    # The middle of an arc is r (sqrt 2 - 1) from the corner.
    assert line.distance(Point(200, 0)) == pytest.approx(25 * (math.sqrt(2) - 1), abs=1.5)
    assert count_bends(np.array([line], dtype=object)) == 1


def test_an_arc_touches_both_sides():
    xy = np.array([(0.0, 0.0), (100.0, 0.0), (100.0, 100.0)])
    made, places = fillet(xy, np.full(3, 20.0), 20.0)
    inner = made[1:-1]
    assert np.hypot(*(inner - (80, 20)).T) == pytest.approx(np.full(len(inner), 20.0), abs=0.02)
    assert inner[[0, -1]] == pytest.approx(np.array([(80, 0), (100, 20)]))
    assert made[places[1]] == pytest.approx(
        (80 + 20 / math.sqrt(2), 20 - 20 / math.sqrt(2)), abs=0.02
    )
    # A turn that is too small, or a radius of nothing, leaves the line.
    assert fillet(xy, np.zeros(3), 20.0)[0] is xy
    assert fillet(xy, np.full(3, 20.0), 100.0)[0] is xy


def test_an_arc_at_the_seam_of_two_features_keeps_them_joined():
    one, other = LineString([(0, 0), (200, 0)]), LineString([(200, 0), (200, 200)])
    made = lines_of(smooth_streets(layer(one, other), Smoothing(fillet_radius=25.0)).streets)
    assert made[0].coords[-1] == made[1].coords[0]
    assert Point(made[0].coords[-1]).distance(Point(200, 0)) > 8


# What holds


def test_dead_ends_and_existing_streets_stay():
    lines = jittered_grid(4, 4, 80.0, 12.0, 5, drop=0.2)
    status = ["existing" if k % 3 == 0 else "new" for k in range(len(lines))]
    made = smooth_streets(layer(*lines, status=status))
    held = [k for k, word in enumerate(status) if word == "existing"]
    for k in held:
        assert made.streets.geometry.iloc[k].equals_exact(lines[k], 0.0)
        assert made.streets["moved_m"].iloc[k] == 0
    assert made.streets["moved_m"].max() > 0
    ends = [group[0] for group in meeting_ends(lines) if len(group) == 1]
    assert ends
    for end in ends:
        new, old = lines_of(made.streets)[end // 2], lines[end // 2]
        assert new.coords[-(end % 2)] == old.coords[-(end % 2)]


def test_a_street_that_continues_an_existing_one_goes_on_in_its_direction():
    old = LineString([(-200, 0), (0, 0)])
    new = LineString([(0, 0), (60, 40), (150, 60)])
    made = smooth_streets(layer(old, new, status=["existing", "new"]), Smoothing(max_move=20.0))
    line = lines_of(made.streets)[1]
    assert line.coords[0] == (0, 0)
    out = line.interpolate(8)
    assert abs(math.degrees(math.atan2(out.y, out.x))) < 8


def test_fixed_points_hold_streets_and_their_directions():
    line = LineString([(0, 0), (40, 25), (90, -20), (150, 15), (220, 0)])
    points = layer(Point(90.5, -20), Point(0, 1), Point(500, 500))
    made = smooth_streets(layer(line), fixed_points=points)
    new = lines_of(made.streets)[0]
    assert new.distance(Point(90, -20)) < 0.6
    assert new.coords[0] == (0, 0)
    out = new.interpolate(6)
    assert math.degrees(math.atan2(out.y, out.x)) == pytest.approx(
        math.degrees(math.atan2(25, 40)), abs=6
    )
    free = smooth_streets(layer(line))
    assert lines_of(free.streets)[0].distance(Point(90, -20)) > 3
    ignored = made.problems[made.problems["layer"] == "Fixed points"]
    assert ignored["feature"].tolist() == ["2"]
    assert "no street within" in ignored["problem"].iloc[0]


def test_ends_slide_along_the_edge_of_the_site_and_streets_stay_inside():
    site = box(0, 0, 300, 200)
    lines = [LineString([(120, 0), (150, 100), (150, 200)]), LineString([(150, 100), (300, 110)])]
    made = smooth_streets(layer(*lines), Smoothing(max_move=20.0), site=layer(site))
    foot = Point(lines_of(made.streets)[0].coords[0])
    assert foot.y == pytest.approx(0, abs=1e-6)
    assert 122 < foot.x < 145
    for line in lines_of(made.streets):
        assert site.buffer(0.03).covers(line)
    fixed = smooth_streets(layer(*lines), Smoothing(max_move=20.0, slide=False), site=layer(site))
    assert lines_of(fixed.streets)[0].coords[0] == (120, 0)


def test_what_lies_outside_the_site_stays():
    inside = LineString([(20, 20), (60, 45), (100, 15), (150, 40)])
    outside = LineString([(20, -120), (60, -145), (100, -115), (150, -140)])
    made = smooth_streets(layer(inside, outside), site=layer(box(0, 0, 200, 80)))
    assert made.streets["moved_m"].iloc[0] > 1
    assert lines_of(made.streets)[1].equals_exact(outside, 0.0)
    assert made.before.length == pytest.approx(inside.length)


def test_a_street_that_leaves_the_site_is_exactly_as_it_was_beyond_the_edge():
    wiggles = [(20.0 * k, 4.0 * (-1) ** k) for k in range(20)]
    street = LineString(wiggles)
    site = box(-10, -50, 200, 50)
    made = smooth_streets(layer(street), site=layer(site))
    (line,) = lines_of(made.streets)
    kept = [xy for xy in wiggles if xy[0] > 205]
    assert list(line.coords)[-len(kept) :] == kept
    assert line.difference(site).hausdorff_distance(street.difference(site)) < 1.5
    assert made.largest_move > 3


def test_what_was_on_an_obstacle_before_may_stay_there():
    street = LineString([(0, 0), (80, 10), (160, -4), (240, 10), (320, 0)])
    house = box(60, -20, 110, 30)
    made = smooth_streets(layer(street), obstacles=layer(house))
    (line,) = lines_of(made.streets)
    assert line.intersection(house).length <= street.intersection(house).length + 0.05
    assert made.largest_move > 2
    told = made.problems.set_index("problem")["action"].to_dict()
    assert told["runs over an obstacle"] == "kept there"


@pytest.mark.slow
@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), shape=st.sampled_from(["curved", "straight"]))
def test_obstacles_and_the_site_are_respected(seed, shape):
    random = np.random.default_rng(seed)
    lines = jittered_grid(4, 4, 80.0, 12.0, seed, drop=0.1)
    streets = shapely.union_all(lines)
    boxes = [
        Point(*random.uniform(-20, 260, 2)).buffer(random.uniform(3, 20), 4) for _ in range(40)
    ]
    boxes = [b for b in boxes if b.distance(streets) > 0.2]
    site = streets.buffer(7.0)
    made = smooth_streets(
        layer(*lines),
        Smoothing(shape=shape, fillet_radius=20.0),
        site=layer(site),
        obstacles=layer(*boxes),
    )
    after = lines_of(made.streets)
    assert_same_network(lines, after, made.max_move)
    for old, new in zip(lines, after):
        for b in boxes:
            # Half the width of a street, or what there was.
            assert (
                new.distance(b)
                >= min(6.0, old.distance(b), *(x.distance(old) for x in boxes)) - 0.05
            )
        assert new.difference(site).length < 0.05
    assert made.largest_move > 0


def test_a_bridge_stays_a_bridge():
    low = LineString([(-100, 0), (0, 10), (100, 0)])
    high = LineString([(10, -100), (0, 0), (12, 100)])
    made = smooth_streets(layer(low, high))
    after = lines_of(made.streets)
    assert made.largest_move > 0.5
    assert crossings(after) == crossings([low, high]) == {(0, 1): 1}
    told = made.problems
    assert told["problem"].tolist() == ["crosses feature 1 without a junction"]
    assert told.geometry.iloc[0].distance(low.intersection(high)) < 1e-6


def test_streets_that_lie_on_each_other_are_left_and_told():
    lines = [
        LineString([(0, 0), (50, 8), (100, 0)]),
        LineString([(0, 0), (50, 8), (100, 0)]),
        LineString([(100, 0), (150, 9), (200, 0)]),
    ]
    made = smooth_streets(layer(*lines))
    assert lines_of(made.streets)[0].equals_exact(lines[0], 0.0)
    assert made.streets["moved_m"].iloc[2] > 0.5
    assert "shares a stretch with feature 1" in made.problems["problem"].tolist()


# Layers of every kind


def test_all_fields_and_features_are_kept_and_lengths_are_true():
    lines = jittered_grid(3, 3, 80.0, 10.0, 1)
    frame = layer(
        *lines,
        name=[f"street {k}" for k in range(len(lines))],
        lanes=range(len(lines)),
        length_m=[line.length for line in lines],
    )
    frame.index = range(7, 7 + len(lines))
    frame.loc[8, "length_m"] = 1000.0  # somebody's own figure
    made = smooth_streets(frame).streets
    assert made.index.tolist() == frame.index.tolist()
    assert made["name"].tolist() == frame["name"].tolist()
    assert made["lanes"].tolist() == frame["lanes"].tolist()
    assert made.loc[8, "length_m"] == 1000.0
    others = made.drop(index=8)
    assert others["length_m"].to_numpy() == pytest.approx(others.length.to_numpy(), abs=1e-6)
    assert frame["length_m"].iloc[0] == lines[0].length


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857", "EPSG:2263"])
def test_degrees_feet_and_web_mercator_come_back_as_they_were(crs):
    lines = jittered_grid(4, 4, 80.0, 10.0, 2)
    home = "EPSG:32618"
    there = [shapely.transform(line, lambda xy: xy + np.array([585000, 4510000])) for line in lines]
    given_ = layer(*there, crs=home).to_crs(crs)
    made = smooth_streets(given_, Smoothing(max_move=10.0))
    assert made.streets.crs == given_.crs
    back = lines_of(made.streets.to_crs(home))
    assert meeting_ends(lines_of(made.streets), 0.0) == meeting_ends(lines_of(given_), 0.0)
    assert block_count(back) == 9
    assert max(map(furthest, there, back)) <= 10.05
    assert corner_errors(back).mean() < 0.5 * corner_errors(there).mean()


def test_parts_heights_touching_ends_and_shared_vertices():
    both = MultiLineString([[(0, 0), (60, 8), (120, 0)], [(300, 0), (360, 8), (420, 0)]])
    touching = LineString([(60, 8.1), (70, 100)])  # ends 0.1 m off the street
    through = LineString([(330, -80, 5), (360, 8, 6), (345, 90, 7)])
    made = smooth_streets(layer(both, touching, through))
    first, leg, high = lines_of(made.streets)
    assert first.geom_type == "MultiLineString"
    assert len(first.geoms) == 2
    assert first.distance(Point(leg.coords[0])) < 1e-9
    assert not high.has_z
    assert any("heights" in text for text in made.problems["problem"])
    assert made.before.junctions == made.after.junctions == 2


def test_features_without_a_line_are_kept_and_told():
    line = LineString([(0, 0), (50, 10), (100, 0)])
    spot = LineString([(5, 5), (5, 5)])
    frame = gpd.GeoDataFrame(
        {"a": [1, 2, 3, 4]}, geometry=[None, line, LineString(), spot], crs=CRS
    )
    made = smooth_streets(frame)
    assert made.streets["a"].tolist() == [1, 2, 3, 4]
    assert made.streets.geometry.iloc[0] is None
    assert made.streets.geometry.iloc[2].is_empty
    assert made.streets["moved_m"].iloc[1] > 0.5
    told = dict(zip(made.problems["feature"], made.problems["problem"]))
    assert told == {"0": "geometry is NULL", "2": "geometry is EMPTY", "3": "has no length"}


def complaint(*arguments, **options):
    with pytest.raises(InputError) as caught:
        smooth_streets(*arguments, **options)
    return str(caught.value)


def test_layers_that_cannot_be_used_are_refused():
    line = LineString([(0, 0), (100, 5)])
    assert "not a line" in complaint(layer(line, Point(0, 0)))
    assert "feature 1" in complaint(layer(line, Point(0, 0)))
    assert "no lines" in complaint(gpd.GeoDataFrame(geometry=[None], crs=CRS))
    assert "no lines" in complaint(gpd.GeoDataFrame(geometry=[], crs=CRS))
    assert "CRS" in complaint(gpd.GeoDataFrame(geometry=[line]))
    assert "No line in it has a length" in complaint(layer(LineString([(1, 1), (1, 1)])))
    assert "No street lies in the site" in complaint(layer(line), site=layer(box(900, 0, 950, 9)))
    assert "no polygon" in complaint(layer(line), site=layer(Point(0, 0)))
    bare = gpd.GeoDataFrame(geometry=[box(0, 0, 9, 9)])
    assert "Layer 'Obstacles'" in complaint(layer(line), obstacles=bare)


@pytest.mark.parametrize(
    "wrong",
    [
        {"shape": "round"}, {"strength": 1.5}, {"max_move": 0.0}, {"max_move": math.inf},
        {"fillet_radius": -1.0}, {"fillet_angle": 0.0}, {"strength": math.nan},
    ],
)  # fmt: skip
def test_wishes_out_of_range_are_refused(wrong):
    with pytest.raises(InputError):
        Smoothing(**wrong)


# Long work


class Impatient(Silent):
    """Cancels when it has been asked so many times."""

    def __init__(self, patience):
        self.patience, self.asked = patience, 0
        self.told: list[float] = []

    def stage(self, text, fraction):  # noqa: ARG002
        self.told.append(fraction)

    def cancelled(self):
        self.asked += 1
        return self.asked > self.patience


def test_a_run_can_be_cancelled_at_any_moment():
    """Before there is a safe drawing nothing is kept, after it that drawing is."""
    lines = jittered_grid(6, 6, 80.0, 12.0, 4, drop=0.1)
    asked = Smoothing(fillet_radius=15.0)
    watch = Impatient(10**9)
    whole = smooth_streets(layer(*lines), asked, progress=watch)
    assert watch.told == sorted(watch.told)
    assert watch.asked > 12
    for patience in range(watch.asked - 1):
        with pytest.raises(CancelledError):
            smooth_streets(layer(*lines), asked, progress=Impatient(patience))
    made = smooth_streets(layer(*lines), asked, progress=Impatient(watch.asked - 1))
    assert whole.complete
    assert not made.complete
    assert made.largest_move > 0
    assert_same_network(lines, lines_of(made.streets), made.max_move)


def test_a_network_whose_smoothing_is_cancelled_is_as_it_came():
    lines = jittered_grid(4, 4, 80.0, 12.0, 4)
    net = build_net(lines)
    anchors = find_anchors(net, np.zeros(len(lines), dtype=bool))
    for patience in (0, 1, 2, 5):
        made = smooth_net(net, anchors, progress=Impatient(patience))
        assert not made.complete
        assert all(a is b for a, b in zip(made.lines, net.lines))


@pytest.mark.slow
def test_two_thousand_streets_take_seconds():
    lines = jittered_grid(33, 34, 80.0, 10.0, 6, drop=0.03)
    assert len(lines) > 2000
    watch = Impatient(10**9)
    began = time.process_time()
    made = smooth_streets(layer(*lines), Smoothing(fillet_radius=15.0), progress=watch)
    assert time.process_time() - began < 20
    assert block_count(lines_of(made.streets)) == block_count(lines)
    assert made.after.angle_mean < 0.25 * made.before.angle_mean


@pytest.mark.slow
@pytest.mark.parametrize("town", ["baltimore_se_md", "vaduz_li"])
def test_real_streets_keep_their_network(shared_data, town):
    path = shared_data / "town" / f"{town}.gpkg"
    streets = gpd.read_file(path, layer="streets")
    streets = streets[~streets["highway"].isin(["footway", "path", "steps", "track", "service"])]
    houses = gpd.read_file(path, layer="buildings")
    made = smooth_streets(streets, Smoothing(fillet_radius=15.0), obstacles=houses)
    before, after = (list(shapely.get_parts(g.geometry.array)) for g in (streets, made.streets))
    # Ends that nearly met have become one.
    assert block_count(after, 1.0) == block_count(before, 1.0)
    assert made.largest_move <= made.max_move + 0.01
    assert made.after.angle_mean < made.before.angle_mean
    assert made.after.bends <= made.before.bends
    ground = shapely.union_all(shapely.make_valid(houses.to_crs(streets.crs).geometry.array))
    shapely.prepare(ground)
    over = [sum(line.intersection(ground).length for line in ls if ground.intersects(line))
            for ls in (before, after)]  # fmt: skip
    assert over[1] <= over[0] + 0.02 * len(before)


@pytest.mark.parametrize("name", ["angles", "fillets", "smooth_graph", "smooth_layer"])
def test_examples(name):
    result = doctest.testmod(importlib.import_module(f"platwright.streets.{name}"))
    assert result.attempted > 0
    assert result.failed == 0
