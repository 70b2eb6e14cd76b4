"""Blocks from streets and from polygons: they tile the land, and their access is where streets are.

What is expected is worked out by hand, or by plain distances from centre lines.
"""

from __future__ import annotations

import math

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.parcels.blocks import blocks_from_polygons, blocks_from_streets
from platwright.parcels.streetspace import StreetWidths, widths_of
from platwright.progress import Silent
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box

CRS = "EPSG:3067"
X, Y = 500000.0, 6700000.0


def at(shape):
    return shapely.transform(shape, lambda xy: xy + np.array([X, Y]))


def back(shape):
    return shapely.transform(shape, lambda xy: xy - np.array([X, Y]))


def frame(shapes, crs=CRS, **columns):
    moved = [None if s is None else at(s) for s in shapes]
    return gpd.GeoDataFrame(columns, geometry=gpd.GeoSeries(moved, crs=crs), crs=crs)


def streets(*lines, crs=CRS, **columns):
    return frame([LineString(line) for line in lines], crs, **columns)


SITE = box(0, 0, 200, 120)
CROSS = ([(100, -8), (100, 128)], [(-8, 60), (208, 60)])
#: Along the south side, 8 m outside.
SOUTH = [(-50, -8), (250, -8)]


def tiles(made, land, obstacles=()):
    """Land is covered once by blocks, thin land, street space and obstacles."""
    pieces = [back(b.polygon) for b in made.all_blocks]
    pieces += [back(space) for space, _ in made.space] + list(obstacles)
    whole = shapely.union_all(pieces)
    assert sum(p.area for p in pieces) == pytest.approx(land.area, rel=1e-6)
    assert whole.symmetric_difference(land).area < 1e-6 * land.area + 0.05


def test_a_cross_of_streets_makes_four_blocks():
    made = blocks_from_streets(frame([SITE]), streets(*CROSS, SOUTH), StreetWidths(every=12.0))
    assert [b.block_id for b in made.blocks] == [1, 2, 3, 4]
    assert [b.polygon.area for b in made.blocks] == pytest.approx([94 * 54] * 4)
    # north before south, west before east
    middles = [back(b.polygon.centroid).coords[0] for b in made.blocks]
    assert middles == [(47, 93), (153, 93), (47, 27), (153, 27)]
    # The edge along the street in the south is a property line: nothing off, and access.
    assert back(made.blocks[2].polygon).bounds == (0, 0, 94, 54)
    assert [b.closed.length for b in made.blocks] == pytest.approx([148, 148, 54, 54], abs=0.2)
    west = back(made.blocks[2].closed)
    assert west.bounds == pytest.approx((0, 0, 0, 54), abs=0.1)
    ((space, place),) = made.space
    assert space.area == pytest.approx(12 * 200 + 12 * 120 - 144)
    assert (place.site_id, place.feature) == (1, "0")
    assert len(made.problems) == 0
    tiles(made, SITE)
    for block in made.blocks:
        assert block.polygon.exterior.is_ccw
        assert len(block.polygon.exterior.coords) == 5


def test_half_a_street_is_taken_off_where_the_edge_is_its_centre_line():
    ring = streets([(0, 0), (200, 0), (200, 120), (0, 120), (0, 0)], [(100, 0), (100, 120)])
    made = blocks_from_streets(frame([SITE]), ring, StreetWidths(every=10.0))
    shapes = [back(b.polygon).bounds for b in made.blocks]
    assert shapes == [(5, 5, 95, 115), (105, 5, 195, 115)]
    assert all(b.closed.is_empty for b in made.blocks)
    tiles(made, SITE)


def test_without_a_site_the_land_that_streets_enclose_is_parted():
    ring = streets(
        [(0, 0), (200, 0), (200, 120), (0, 120), (0, 0)], [(100, -40), (100, 160)],
        [(40, 0), (40, 50)],
    )  # fmt: skip
    made = blocks_from_streets(None, ring, StreetWidths(every=10.0))
    assert [b.polygon.area for b in made.blocks] == pytest.approx([90 * 110 - 10 * 45, 90 * 110])
    assert all(b.closed.is_empty for b in made.blocks)
    with pytest.raises(InputError, match="enclose no land"):
        blocks_from_streets(None, streets([(0, 0), (10, 0)]))


def test_a_dead_end_gives_access_on_all_its_sides():
    stub = streets(SOUTH, [(100, -8), (100, 50)])
    made = blocks_from_streets(frame([SITE]), stub, StreetWidths(every=12.0))
    (block,) = made.blocks
    assert back(block.polygon).equals(SITE - box(94, 0, 106, 50))
    open_edges = block.polygon.boundary.length - block.closed.length
    assert open_edges == pytest.approx(200 - 12 + 50 + 12 + 50, abs=0.2)
    tiles(made, SITE)
    circle = streets(SOUTH, [(100, -8), (100, 50)], turning_m=[np.nan, 10.0])
    (round_one,) = blocks_from_streets(frame([SITE]), circle, StreetWidths(every=12.0)).blocks
    taken = SITE - back(round_one.polygon)
    assert taken.hausdorff_distance(box(94, 0, 106, 50) | Point(100, 50).buffer(10)) < 0.1
    # the circle is at the blind end, not where the street begins
    assert taken.bounds == pytest.approx((90, 0, 110, 60), abs=0.01)


def test_no_sliver_stays_where_a_street_ends_at_the_edge():
    """It meets the edge at 45 degrees and ends exactly there."""
    aslant = streets(SOUTH, [(60, 0), (180, 120)])
    made = blocks_from_streets(frame([SITE]), aslant, StreetWidths(every=12.0))
    assert len(made.blocks) == 2
    assert len(made.thin) == 0
    strip = LineString([(0, -60), (240, 180)]).buffer(6, cap_style="flat") & SITE
    assert sum(space.area for space, _ in made.space) == pytest.approx(strip.area, rel=1e-4)


def test_a_street_on_the_edge_goes_no_further_than_it_does():
    """It ends half-way along the edge, which is its centre line."""
    half = streets([(-50, 0), (100, 0)])
    made = blocks_from_streets(frame([SITE]), half, StreetWidths(every=12.0))
    (block,) = made.blocks
    assert back(block.polygon).equals(SITE - box(0, 0, 100, 6))
    assert block.polygon.length - block.closed.length == pytest.approx(106, abs=0.2)


def test_a_street_that_bends_outside_is_followed_there():
    """It leaves the site at its corner at a small angle and turns away."""
    aslant = streets([(20, 120), (190, 0), (215.5, -18), (260, -18)])
    made = blocks_from_streets(frame([SITE]), aslant, StreetWidths(every=20.0))
    strip = LineString([(3, 132), (224, -24)]).buffer(10, cap_style="flat") & SITE
    space = shapely.union_all([back(own) for own, _ in made.space])
    assert space.symmetric_difference(strip).area < 1


def test_corners_of_street_space_are_pointed():
    """Two streets of different widths that meet in a bend of 90 degrees."""
    bend = streets([(0, 60), (100, 60)], [(100, 60), (100, 0)], width_m=[20.0, 12.0])
    made = blocks_from_streets(frame([SITE]), bend)
    inner, outer = sorted(made.blocks, key=lambda b: b.polygon.area)
    assert back(inner.polygon).normalize() == box(0, 0, 94, 50).normalize()
    expected = SITE - box(0, 0, 106, 70)
    assert back(outer.polygon).symmetric_difference(expected).area < 1e-6
    tiles(made, SITE)


@pytest.mark.parametrize("turn", [0.0, 0.3, -0.9, 1.7, 4.0])
def test_no_slit_stays_between_two_streets_that_nearly_go_straight_on(turn):
    """Strips with flat ends would leave a wedge a few centimetres wide on the outer side."""
    end = (100 + 120 * math.cos(math.radians(turn)), 60 + 120 * math.sin(math.radians(turn)))
    bend = streets([(-8, 60), (100, 60)], [(100, 60), end], width_m=[12.0, 16.0])
    made = blocks_from_streets(frame([SITE]), bend)
    assert len(made.blocks) == 2
    for block in made.blocks:
        closed_up = block.polygon.buffer(0.2, join_style="mitre").buffer(-0.2, join_style="mitre")
        assert closed_up.area - block.polygon.area < 0.05
        depth = [abs(y - 60) for x, y in back(block.polygon).exterior.coords if 90 < x < 110]
        assert min(depth) > 5.9
    tiles(made, SITE)


def test_three_streets_in_a_fan_leave_no_notch():
    fan = streets([(100, 60), (200, 60)], [(100, 60), (180, 120)], [(100, 60), (180, 0)])
    made = blocks_from_streets(frame([SITE]), fan, StreetWidths(every=12.0))
    west = max(made.blocks, key=lambda b: b.polygon.area)
    # beyond the junction the two outer lines meet in a point
    tip = max(x for x, y in back(west.polygon).exterior.coords if abs(y - 60) < 1e-6)
    assert tip == pytest.approx(100 - 6 / math.sin(math.atan2(60, 80)), abs=0.01)
    tiles(made, SITE)


@pytest.mark.parametrize(
    ("columns", "options", "expected"),
    [
        ({}, {}, [12, 12]),
        ({"level": [1, 4]}, {}, [20, 10]),
        ({"level": [2, None]}, {}, [16, 12]),
        ({"highway": ["primary_link", "tertiary"]}, {}, [20, 16]),
        ({"HIGHWAY": ["service", None]}, {"cul_de_sac": 7}, [7, 12]),
        ({"level": [1, 1], "width_m": [None, 7.5]}, {}, [20, 7.5]),
        ({"level": [1, 1], "width_m": ["9", "wide"]}, {"major": 30}, [9, 30]),
        ({"width_m": [5.0, 5.0]}, {"every": 9}, [9, 9]),
        ({"width_m": [-1.0, 0.0]}, {}, [12, 12]),
    ],
)
def test_widths_by_field_level_or_class(columns, options, expected):
    two = streets([(0, 0), (1, 0)], [(0, 1), (1, 1)], **columns)
    assert widths_of(two, StreetWidths(**options)).tolist() == expected
    given = np.array([np.nan, 3.0])
    assert widths_of(two, StreetWidths(**options), given).tolist() == [expected[0], 3]


def test_widths_are_honoured_in_the_blocks():
    two = streets([(60, -8), (60, 128)], [(140, -8), (140, 128)], level=[1, 4])
    made = blocks_from_streets(frame([SITE]), two)
    assert [back(b.polygon).bounds for b in made.blocks] == [
        (0, 0, 50, 120), (70, 0, 135, 120), (145, 0, 200, 120),
    ]  # fmt: skip
    made = blocks_from_streets(frame([SITE]), two, given_widths=np.array([8.0, np.nan]))
    assert back(made.blocks[0].polygon).bounds == (0, 0, 56, 120)


def test_obstacles_are_closed_holes():
    pond = box(20, 20, 40, 40)
    made = blocks_from_streets(frame([SITE]), streets(*CROSS), obstacles=frame([pond]))
    (block,) = [b for b in made.blocks if len(b.polygon.interiors)]
    ring = LineString(block.polygon.interiors[0].coords)
    assert ring.length == 80
    assert ring.difference(block.closed.buffer(0.01)).is_empty
    tiles(made, SITE, [pond])


def test_land_that_is_too_thin_is_left_as_a_green_and_told():
    near = streets([(-8, 9), (208, 9)])
    made = blocks_from_streets(frame([SITE]), near, StreetWidths(every=12.0))
    (thin,) = made.thin
    assert back(thin.polygon).equals(box(0, 0, 200, 3))
    assert thin.block_id == len(made.blocks) + 1 == 2
    (row,) = [r for r in made.problems.to_dict("records") if "600 m2" in r["problem"]]
    assert (row["severity"], row["layer"], row["feature"]) == ("info", "Site", "0")
    ((plot,),) = made.with_thin([[]])[1:]
    assert (plot.use, plot.polygon) == ("green", thin.polygon)
    tiles(made, SITE)


def test_pointed_ends_and_necks_are_cut_off():
    dumbbell = box(0, 0, 60, 60) | box(60, 28, 100, 31) | box(100, 0, 160, 60)
    made = blocks_from_polygons(frame([dumbbell]))
    assert sorted(b.polygon.area for b in made.blocks) == pytest.approx([3600, 3600], abs=1)
    assert sum(b.polygon.area for b in made.thin) == pytest.approx(120, abs=1)
    tiles(made, dumbbell)
    needle = Polygon([(0, 0), (100, 0), (0, 20)])
    made = blocks_from_polygons(frame([needle]))
    (block,) = made.blocks
    # some way from where it is 4 m wide, a fifth of its length from the tip
    assert 80 < back(block.polygon).bounds[2] < 92
    tiles(made, needle)


@pytest.mark.parametrize(("edge", "shut"), [("streets", 108), ("open", 0), ("closed", 296)])
def test_the_edge_may_be_open_or_closed_as_a_whole(edge, shut):
    """Both streets end at the edge; one runs along the south, one along the north."""
    lines = streets(*CROSS, SOUTH, [(-50, 128), (250, 128)])
    made = blocks_from_streets(frame([SITE]), lines, edge=edge)
    sides = sum(b.closed.length for b in made.blocks)
    assert sides == pytest.approx({108: 4 * 54, 0: 0, 296: 4 * (94 + 54)}[shut], abs=0.5)


def test_a_street_beyond_the_snap_distance_gives_no_access():
    far = streets(*CROSS, [(-50, -25), (250, -25)])
    near = blocks_from_streets(frame([SITE]), far)
    beyond = blocks_from_streets(frame([SITE]), far, snap_distance=20)
    shut = [sum(b.closed.length for b in made.blocks) for made in (near, beyond)]
    assert shut[1] - shut[0] == pytest.approx(188, abs=0.5)


def test_inner_streets_beside_the_edge_do_not_open_it():
    """A street 20 m inside the site is nearer to its edge than the snap distance."""
    inner = streets([(-8, 20), (208, 20)])
    made = blocks_from_streets(frame([SITE]), inner, StreetWidths(every=12.0))
    south = made.blocks[1]
    assert back(south.polygon).bounds == (0, 0, 200, 14)
    assert south.closed.length == pytest.approx(200 + 2 * 14, abs=0.2)


def test_lines_without_access_close_edges_and_streets():
    wall = [LineString([(0, 54), (94, 54)]), LineString([(100, -20), (100, 140)])]
    made = blocks_from_streets(
        frame([SITE]), streets(*CROSS), StreetWidths(every=12.0), closed_lines=frame(wall)
    )
    south_west = made.blocks[2]
    # the wall in the north, the closed street in the east, the edge of the site
    assert south_west.closed.length == pytest.approx(2 * 94 + 2 * 54, abs=0.3)
    north_west = made.blocks[0]
    open_edge = back(north_west.polygon.boundary - north_west.closed.buffer(0.05))
    assert open_edge.bounds == pytest.approx((0, 66, 94, 66), abs=0.1)
    tiles(made, SITE)


def test_motorways_take_land_and_give_no_access():
    road = streets(*CROSS, highway=["motorway", "residential"])
    made = blocks_from_streets(frame([SITE]), road)
    assert back(made.blocks[0].polygon).bounds == (0, 66, 90, 120)
    for block in made.blocks:
        assert block.closed.length == pytest.approx(2 * 54 + 90, abs=0.2)


def test_paths_and_tunnels_part_no_land():
    lines = streets(*CROSS, highway=["footway", "residential"], tunnel=["", ""])
    assert len(blocks_from_streets(frame([SITE]), lines).blocks) == 2
    lines = streets(*CROSS, tunnel=["yes", "no"])
    assert len(blocks_from_streets(frame([SITE]), lines).blocks) == 2


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857", "EPSG:2249"])
def test_any_crs_is_worked_on_in_metres(crs):
    if crs == "EPSG:2249":  # feet, Massachusetts
        foot = 0.3048006096

        def turn(shapes):
            moved = [
                shapely.transform(s, lambda xy: xy / foot + [770000.0, 2950000.0]) for s in shapes
            ]
            return gpd.GeoDataFrame(geometry=gpd.GeoSeries(moved, crs=crs))

        site, lines = turn([SITE]), turn([LineString(c) for c in CROSS])
    else:
        site, lines = frame([SITE]).to_crs(crs), streets(*CROSS).to_crs(crs)
    made = blocks_from_streets(site, lines, StreetWidths(every=12.0))
    assert [b.polygon.area for b in made.blocks] == pytest.approx([94 * 54] * 4, rel=2e-3)
    assert made.source_crs == crs
    assert all(place.crs.is_projected for place in made.places)
    taken = blocks_from_polygons(site)
    assert taken.blocks[0].polygon.area == pytest.approx(24000, rel=2e-3)


# Block polygons


def test_block_polygons_stay_by_themselves_and_keep_their_ids():
    shapes = [box(0, 0, 90, 50), MultiPolygon([box(100, 0, 190, 50), box(0, 80, 90, 130)]), None]
    given_blocks = frame(shapes).set_index(np.array([7, 9, 11]))
    made = blocks_from_polygons(given_blocks, polygon_layer="my blocks")
    assert [place.feature for place in made.places] == ["7", "9", "9"]
    assert all(b.closed.is_empty for b in made.blocks)
    assert made.space == ()
    told = made.problems.set_index("feature")["problem"].to_dict()
    assert told == {"11": "geometry is NULL", "9": "has 2 parts"}


def test_edges_that_two_blocks_share_are_no_streets():
    heard = []

    class Ear(Silent):
        def warn(self, text):
            heard.append(text)

    two = frame([box(0, 0, 90, 50), box(90, 0, 180, 50)])
    made = blocks_from_polygons(two, progress=Ear())
    assert [b.closed.length for b in made.blocks] == pytest.approx([50, 50], abs=0.2)
    assert "'Blocks'" in heard[0]
    # with the street between them half its width is taken off
    between = streets([(90, 0), (90, 50)])
    made = blocks_from_polygons(two, between, StreetWidths(every=10.0))
    assert [back(b.polygon).bounds for b in made.blocks] == [(0, 0, 85, 50), (95, 0, 180, 50)]
    assert [b.closed.length for b in made.blocks] == pytest.approx([220, 220], abs=0.2)


def test_overlapping_blocks_are_parted_and_told():
    made = blocks_from_polygons(frame([box(0, 0, 90, 50), box(80, 0, 180, 50)]))
    assert [b.polygon.area for b in made.blocks] == pytest.approx([4500, 4500])
    (row,) = made.problems.to_dict("records")
    assert row["severity"] == "warning"
    assert "500.0 m2 with feature 0" in row["problem"]


def test_invalid_block_polygons_are_repaired():
    bow = Polygon([(0, 0), (60, 60), (60, 0), (0, 60)])
    high = shapely.force_3d(box(100, 0, 160, 60), 12.0)
    made = blocks_from_polygons(frame([bow, high]))
    assert sum(b.polygon.area for b in made.all_blocks) == pytest.approx(1800 + 3600, rel=1e-3)
    assert not any(b.polygon.has_z for b in made.blocks)
    with pytest.raises(InputError, match=r"'hollow'.*is a block"):
        blocks_from_polygons(frame([None, Point(0, 0)]), polygon_layer="hollow")


def test_what_cannot_be_used_is_refused_by_its_name():
    with pytest.raises(InputError, match=r"'roads'.*line that is a street"):
        blocks_from_streets(frame([SITE]), frame([None, Point(1, 1)]), street_layer="roads")
    with pytest.raises(InputError, match=r"'Streets'.*coordinate reference system"):
        blocks_from_streets(frame([SITE]), streets(*CROSS).set_crs(None, allow_override=True))
    with pytest.raises(InputError, match="snap distance"):
        blocks_from_streets(frame([SITE]), streets(*CROSS), snap_distance=0)
    with pytest.raises(InputError, match="no choice for the edge"):
        blocks_from_polygons(frame([SITE]), edge="ajar")
    with pytest.raises(InputError, match="cul-de-sac streets is 0"):
        StreetWidths(cul_de_sac=0.0)
    with pytest.raises(InputError, match="width of streets is nan"):
        StreetWidths(every=math.nan)


def test_lines_that_cannot_be_used_are_told():
    odd = frame([LineString(CROSS[0]), None, Point(3, 3), LineString([(0, 0), (math.inf, 1)])])
    made = blocks_from_streets(frame([SITE]), odd, street_layer="odd")
    told = made.problems.set_index("feature")["problem"].to_dict()
    assert set(told) == {"0", "1", "2", "3"}
    assert len(made.blocks) == 2


def test_a_site_without_streets_in_it_is_one_block_and_that_is_told():
    made = blocks_from_streets(frame([SITE]), streets([(900, 900), (999, 900)]))
    assert len(made.blocks) == 1
    assert made.blocks[0].closed.length == pytest.approx(640)
    assert "no street of layer 'Streets'" in made.problems["problem"].iloc[0]


def test_streets_that_end_at_the_edge_do_not_run_along_it_and_that_is_told():
    made = blocks_from_streets(frame([SITE]), streets(*CROSS))
    (row,) = made.problems.to_dict("records")
    assert "runs along its edge" in row["problem"]
    assert row["severity"] == "warning"
    assert len(blocks_from_streets(frame([SITE]), streets(*CROSS), edge="open").problems) == 0
    on_edge = blocks_from_streets(frame([SITE]), streets(*CROSS, [(0, 0), (200, 0)]))
    assert len(on_edge.problems) == 0


def test_several_sites_keep_their_numbers():
    two = frame([SITE, box(300, 0, 400, 100)])
    made = blocks_from_streets(two, streets(*CROSS, [(350, -20), (350, 120)]))
    assert [place.site_id for place in made.places] == [1, 1, 1, 1, 2, 2]
    assert [place.site_id for _, place in made.space] == [1, 2]


def test_a_cancelled_run_stops():
    class Stop(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        blocks_from_streets(frame([SITE]), streets(*CROSS), progress=Stop())
    with pytest.raises(CancelledError):
        blocks_from_polygons(frame([SITE]), progress=Stop())


# Any streets


@st.composite
def plans(draw):
    """Lines across a site, and dead ends in it, with widths."""
    lines = []
    for _ in range(draw(st.integers(1, 4))):
        angle, offset = draw(st.floats(0, math.pi)), draw(st.floats(-50, 50))
        way = np.array([math.cos(angle), math.sin(angle)])
        middle = np.array([100, 60]) + offset * np.array([-way[1], way[0]])
        ends = (-300, 300) if draw(st.booleans()) else (-300, draw(st.floats(-60, 60)))
        lines.append([tuple(middle + t * way) for t in ends])
    return lines, [draw(st.sampled_from([6.0, 10.0, 14.0, 22.0])) for _ in lines]


@settings(max_examples=40)
@given(plans())
def test_any_streets_part_the_land_without_gap_or_overlap(plan):
    lines, widths = plan
    made = blocks_from_streets(frame([SITE]), streets(*lines, width_m=widths))
    tiles(made, SITE)
    shapes = [LineString(line) for line in lines]
    for block in made.blocks:
        polygon, closed = back(block.polygon), back(block.closed)
        assert polygon.is_valid
        # closed lines lie on the rings
        assert closed.difference(polygon.boundary.buffer(0.01)).length < 1e-9
        # nothing of a block lies in a street
        for shape, width in zip(shapes, widths):
            assert polygon.intersection(shape.buffer(width / 2 - 0.01, cap_style="flat")).area < 1.0
        ring = polygon.boundary
        for s in np.arange(0.5, ring.length, 3.0):
            here = ring.interpolate(s)
            gaps = [shape.distance(here) - w / 2 for shape, w in zip(shapes, widths)]
            shut = closed.distance(here) < 0.005
            inside = SITE.boundary.distance(here) > 0.1
            if min(gaps) > 0.1 and not inside:
                # at the edge of the site, away from streets: no access
                assert shut or min(gaps) < 30
            if abs(min(gaps)) < 0.02 and closed.distance(here) > 0.2:
                assert not shut
            if inside and shut:
                # shut inside the site: only where land was cut off as too thin
                assert any(back(t.polygon).distance(here) < 0.1 for t in made.thin)
