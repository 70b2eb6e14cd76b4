import numpy as np
import pytest
import shapely
from platwright.site.frontage import frontage
from platwright.site.roadnetwork import build_network
from shapely.geometry import LineString, Point, Polygon, box
from shapely.ops import substring

SITE = box(0, 0, 200, 100)


def net(*lines):
    array = np.array([LineString(x) for x in lines], dtype=object)
    blank = np.array([""] * len(lines), dtype=object)
    return build_network(array, blank, blank)


def test_street_along_one_edge():
    found = frontage(SITE, net([(-100, -10), (300, -10)]), 30)
    (stretch,) = found.stretches.geoms
    assert stretch.length == pytest.approx(200, abs=6)
    assert max(y for _, y in stretch.coords) < 5
    (street,) = found.streets
    assert street.line.length == pytest.approx(200, abs=6)


def test_street_that_ends_at_the_edge_is_no_frontage():
    found = frontage(SITE, net([(300, 50), (205, 50)]), 30)
    assert found.stretches.is_empty
    assert found.streets == []


def test_street_too_far_away():
    roads = net([(-100, -40), (300, -40)])
    assert frontage(SITE, roads, 30).stretches.is_empty
    assert frontage(SITE, roads, 45).stretches.length == pytest.approx(200, abs=6)


@pytest.mark.parametrize(("angle", "length"), [(20, 64.4), (40, 0)])
def test_oblique_streets(angle, length):
    # (x, 0) is (x - 20) sin 20 + 5 cos 20 from the road: within 25 m up to x = 79.4; before the
    # road's end at (20, -5) it is ahead by more than 45 degrees where x < 15
    run = 60 / np.tan(np.radians(angle))
    roads = net([(20, -5), (20 + run, -65)])
    got = frontage(SITE, roads, 25).stretches.length
    assert got == pytest.approx(length, abs=6)


def test_street_across_another_part_of_the_site_does_not_count():
    # a U of two wings 12 m wide and 10 m apart; the road runs outside the east wing
    shape = Polygon(
        [(0, 0), (34, 0), (34, 100), (22, 100), (22, 12), (12, 12), (12, 100), (0, 100)]
    )
    found = frontage(shape, net([(40, -50), (40, 150)]), 30)
    assert min(x for g in found.stretches.geoms for x, _ in g.coords) >= 33


def test_centre_line_as_boundary():
    found = frontage(SITE, net([(0, 0), (200, 0)], [(200, 0), (200, 100)]), 30)
    assert found.stretches.length == pytest.approx(300, abs=6)
    assert sum(s.line.length for s in found.streets) == pytest.approx(300, abs=6)


def test_gap_at_a_junction_mouth_is_closed_and_a_long_one_is_not():
    close = net([(0, -10), (90, -10)], [(105, -10), (200, -10)])
    assert len(frontage(SITE, close, 12).stretches.geoms) == 1
    wide = net([(0, -10), (60, -10)], [(140, -10), (200, -10)])
    assert len(frontage(SITE, wide, 12).stretches.geoms) == 2


def test_short_piece_of_road_is_a_scrap():
    assert frontage(SITE, net([(90, -3), (92, -3)]), 8).stretches.is_empty


def test_streets_are_cut_at_junctions():
    found = frontage(SITE, net([(-100, -10), (300, -10)], [(60, -110), (60, -10)]), 30)
    assert sorted(s.line.length for s in found.streets) == pytest.approx([60, 140], abs=4)
    assert len(found.stretches.geoms) == 1


def test_hole_with_a_street_in_it():
    shape = Polygon(SITE.exterior, [box(50, 40, 150, 60).exterior])
    found = frontage(shape, net([(50, 50), (150, 50)]), 12)
    assert {round(y) for g in found.stretches.geoms for _, y in g.coords} >= {40, 60}
    assert found.stretches.length == pytest.approx(200, abs=12)


def test_frontage_lies_on_the_boundary():
    found = frontage(SITE, net([(-100, -10), (300, -10)], [(210, -50), (210, 150)]), 30)
    assert found.stretches.difference(SITE.boundary.buffer(1e-6)).is_empty
    assert found.stretches.length == pytest.approx(300, abs=6)


RING = [
    [(-8, -8), (80, -8), (208, -8)],
    [(208, -8), (208, 108)],
    [(208, 108), (-8, 108)],
    [(-8, 108), (-8, -8)],
]


def named(*lines):
    array = np.array([LineString(x) for x in lines], dtype=object)
    names = np.array(["South", "East", "North", "West", "Lane"][: len(lines)], dtype=object)
    return build_network(array, names, np.array(["residential"] * len(lines), dtype=object))


@pytest.mark.parametrize("lane", [[], [[(80, -8), (80, -120)]]])
def test_four_named_streets_around_a_block(lane):
    found = frontage(SITE, named(*RING, *lane), 30)
    lengths = sorted((s.name, round(s.line.length)) for s in found.streets)
    south = [("South", 88), ("South", 128)] if lane else [("South", 216)]
    assert lengths == [("East", 116), ("North", 216), *south, ("West", 116)]
    assert found.stretches.length == pytest.approx(600)


def test_a_street_that_turns_away_under_another_name_is_left_behind():
    # the road goes on round the corner and 15 m further, then meets another
    away = [(208, -8), (216, -20)], [(216, -20), (216, -90)], [(216, -20), (290, -20)]
    found = frontage(SITE, named(RING[0], *away), 30)
    assert {s.name for s in found.streets} == {"South"}
    assert sum(s.line.length for s in found.streets) == pytest.approx(216, abs=4)


def test_a_short_named_piece_in_a_street_is_kept():
    lines = [(-8, -8), (100, -8)], [(100, -8), (104, -8)], [(104, -8), (208, -8)]
    found = frontage(SITE, named(*lines), 30)
    assert sorted((s.name, round(s.line.length)) for s in found.streets) == [
        ("East", 4), ("North", 104), ("South", 108),
    ]  # fmt: skip


def beside_all(found, *lines):
    """Parts of the lines, in the order of their roads, that are no street along the edge."""
    streets = shapely.union_all([s.line for s in found.streets]).buffer(1e-6)
    return sum(LineString(line).difference(streets).length for line in lines)


@pytest.mark.parametrize("gap", [5, 12, 25])
def test_a_street_that_bends_around_a_corner_has_no_hole(gap):
    # one road around the north-east corner: from beside the west end to beside the south end
    road = [(0, 100 + gap), (200 + gap, 100 + gap), (200 + gap, 0)]
    found = frontage(SITE, net(road), 30)
    assert beside_all(found, road) < 6
    (street,) = found.streets
    assert street.line.length == pytest.approx(300 + 2 * gap, abs=6)


def test_a_street_around_a_sharp_corner_has_no_hole():
    wedge = Polygon([(0, 0), (200, 0), (0, 346.4)])  # 60 degrees to the right
    road = [(0, -20), (234.64, -20), (17.3 - 10, 346.4 + 27)]
    found = frontage(wedge, net(road), 30)
    assert len(found.streets) == 1
    assert found.streets[0].line.distance(Point(234.64, -20)) < 1e-6


@pytest.mark.parametrize("start", [(100, 125), (225, 125), (220, 125), (225, 90)])
def test_a_street_all_around_is_whole_wherever_its_line_begins(start):
    ring = Polygon([(-25, -25), (225, -25), (225, 125), (-25, 125)]).exterior
    at = ring.project(Point(start))
    road = [*substring(ring, at, ring.length).coords, *substring(ring, 0, at).coords[1:]]
    found = frontage(SITE, net(road), 30)
    assert sum(s.line.length for s in found.streets) == pytest.approx(ring.length, abs=1e-6)


def test_a_street_around_a_corner_with_a_junction_beyond_it_has_no_hole():
    # the junction lies nearer to one side of the corner than to the other
    north, east = [(0, 128), (228, 128), (228, 126)], [(228, 126), (228, 0)]
    found = frontage(SITE, net(north, east, [(228, 126), (400, 126)]), 30)
    assert beside_all(found, north, east) < 6


def test_a_street_that_leaves_at_a_corner_and_comes_back_later_has_a_hole():
    # 200 m out into the land and back again: no street along the edge there
    road = [(0, 110), (212, 110), (400, 310), (410, 300), (212, 90), (210, 0)]
    found = frontage(SITE, net(road), 30)
    assert max(x for s in found.streets for x, _ in s.line.coords) < 250


def test_a_street_far_from_the_last_one_is_not_joined_to_it():
    # both sides of the corner have their street, and these meet far away only
    lines = [(0, 110), (190, 110), (190, 400)], [(190, 400), (210, 400), (210, 0)]
    found = frontage(SITE, net(*lines), 30)
    assert max(y for s in found.streets for _, y in s.line.coords) < 150
