"""Parcels by halving, and the mosaic that every cut keeps whole."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.parcels.halving import halve_blocks, skeleton_blocks
from platwright.parcels.halving.mosaic import Mosaic
from platwright.parcels.halving.rectangle import smallest_rectangle
from platwright.parcels.rules import ParcelRules
from platwright.parcels.types import Block
from platwright.progress import Silent
from shapely.affinity import rotate, translate
from shapely.geometry import LineString, MultiLineString, Polygon, box

RULES = ParcelRules()
PENTAGON = Polygon([(20, 0), (125, -9), (153, 67), (78, 130), (0, 78)])


def check_tiling(polygon, plots):
    """Prove by other means than the library's that plots tile a polygon."""
    pieces = [plot.polygon for plot in plots]
    assert all(piece.is_valid for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(polygon.area, rel=1e-6)
    assert shapely.union_all(pieces).symmetric_difference(polygon).area < 1e-6 * polygon.area
    for one, two in itertools.combinations(pieces, 2):
        assert one.intersection(two).area < 1e-6
    if shapely.geos_version >= (3, 12, 0) and hasattr(shapely, "coverage_is_valid"):
        assert shapely.coverage_is_valid(pieces)


def check_access(block, plots, least):
    """Prove that every parcel lies along the open rim, by lines alone."""
    rim = block.polygon.boundary.difference(block.closed.buffer(0.02)).buffer(0.01)
    for plot in plots:
        if plot.use == "parcel":
            assert plot.polygon.boundary.intersection(rim).length >= 0.98 * least


@st.composite
def stars(draw):
    """Star-shaped outlines, often concave, 40 to 280 m across."""
    count = draw(st.integers(4, 14))
    radii = draw(st.lists(st.floats(20, 140), min_size=count, max_size=count))
    shift = draw(st.floats(0, 1))
    angles = 2 * math.pi * (np.arange(count) + shift) / count
    xy = np.stack([np.cos(angles), np.sin(angles)], axis=1) * np.array(radii)[:, None]
    return Polygon(xy)


def test_a_rectangle_is_halved_into_sixteen_equal_parcels():
    # 200 x 60 -> 100 x 60 -> 50 x 60 -> 50 x 30 -> 25 x 30 = 750 m2, below sqrt(2) * 540
    (plots,) = halve_blocks([Block(box(0, 0, 200, 60))], RULES)
    assert len(plots) == 16
    assert [plot.polygon.area for plot in plots] == pytest.approx([750.0] * 16)
    assert all(
        sorted(np.ptp(plot.polygon.exterior.coords, axis=0).tolist()) == pytest.approx([25, 30])
        for plot in plots
    )


def test_a_closed_side_turns_the_cuts():
    # only the long side at the bottom gives access: halves across the depth would lose it
    # 72 x 40 -> 36 x 40 -> 18 x 40 = 720 m2, below sqrt(2) * 540
    closed = MultiLineString([[(72, 0), (72, 40), (0, 40), (0, 0)]])
    block = Block(box(0, 0, 72, 40), closed)
    (plots,) = halve_blocks([block], RULES)
    assert len(plots) == 4
    assert all(plot.polygon.bounds[1] == 0 and plot.polygon.bounds[3] == 40 for plot in plots)
    check_access(block, plots, 18)


@pytest.mark.parametrize("cut", [halve_blocks, skeleton_blocks])
def test_no_access_and_no_room_become_green(cut):
    shut = Block(box(0, 0, 80, 40), MultiLineString([box(0, 0, 80, 40).exterior]))
    tiny = Block(box(0, 0, 10, 10))
    found = cut([shut, tiny], RULES)
    assert [[(plot.use, plot.note) for plot in row] for row in found] == [
        [("green", "no street access")],
        [("green", "too small for a parcel")],
    ]


def test_a_piece_without_a_fitting_cut_stays_whole_and_says_so():
    # 8 m of street on a long lot: halves would have 4 m
    shape = box(0, 0, 8, 300)
    closed = shape.boundary.difference(LineString([(-1, 0), (9, 0)]).buffer(0.001))
    block = Block(shape, MultiLineString([line.coords for line in shapely.get_parts(closed)]))
    (plots,) = halve_blocks([block], RULES)
    assert [(plot.use, plot.note) for plot in plots] == [("parcel", "no cut keeps street access")]


@given(stars(), st.floats(0, 0.3))
@settings(max_examples=40)
def test_any_outline_is_tiled_with_access(shape, irregularity):
    block = Block(shape)
    (plots,) = halve_blocks([block], RULES, seed=1, irregularity=irregularity)
    check_tiling(shape, plots)
    check_access(block, plots, RULES.min_frontage)
    assert all(p.polygon.area >= RULES.least_area - 1e-6 for p in plots if p.use == "parcel")


def test_holes_far_coordinates_and_many_vertices_are_tiled():
    ring = shapely.Point(0, 0).buffer(90, quad_segs=400)
    pond = box(-30, -20, 10, 25)
    for shape in (
        PENTAGON.difference(box(50, 40, 80, 70)),
        ring.difference(pond),
        translate(PENTAGON, 4e6, 5e6),
    ):
        (plots,) = halve_blocks([Block(shape)], RULES)
        check_tiling(shape, plots)
        assert len(plots) > 10


def test_same_seed_same_parcels_whatever_the_company():
    blocks = [Block(PENTAGON, block_id=7), Block(box(0, 0, 200, 60), block_id=8)]
    one = halve_blocks(blocks, RULES, seed=3, irregularity=0.2)
    two = halve_blocks(blocks[::-1], RULES, seed=3, irregularity=0.2)[::-1]
    other = halve_blocks(blocks, RULES, seed=4, irregularity=0.2)
    as_text = [[[plot.polygon.wkb for plot in row] for row in found] for found in (one, two, other)]
    assert as_text[0] == as_text[1]
    assert as_text[0] != as_text[2]


@pytest.mark.parametrize("cut", [halve_blocks, skeleton_blocks])
def test_cancel_stops_at_once(cut):
    class Stop(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        cut([Block(PENTAGON)], RULES, 0, Stop())


class TestMosaic:
    def test_a_cut_gives_its_vertex_to_the_neighbour(self):
        mosaic = Mosaic(box(0, 0, 10, 10))
        lower, upper = mosaic.cut(0, (0, 5), (1, 0))
        parts = mosaic.cut(lower, (4, 0), (0, 1))
        assert len(parts) == 2
        shapes = mosaic.polygons([*parts, upper])
        other = next(shape for shape in shapes if shape.area == pytest.approx(50))
        assert (4.0, 5.0) in set(other.exterior.coords)
        assert shapely.coverage_is_valid(shapes)

    def test_undo_restores_everything(self):
        mosaic = Mosaic(box(0, 0, 10, 10))
        before = (list(mosaic.xy), dict(mosaic.faces), set(mosaic.fronts))
        mosaic.undo(mosaic.cut(0, (0, 5), (1, 0)))
        assert (mosaic.xy, mosaic.faces, mosaic.fronts) == before

    def test_join_takes_a_cut_back(self):
        mosaic = Mosaic(PENTAGON)
        joined = mosaic.join(mosaic.cut(0, (70, 60), (1, 0)))
        (shape,) = mosaic.polygons([joined])
        assert shape.symmetric_difference(PENTAGON).area < 1e-9
        # nothing but the two vertices that the cut put on the outline
        assert len(shape.exterior.coords) == len(PENTAGON.exterior.coords) + 2

    def test_a_line_through_arms_cuts_off_each(self):
        comb = shapely.union_all(
            [box(0, 0, 50, 10), *(box(20 * i, 0, 20 * i + 10, 40) for i in range(3))]
        )
        mosaic = Mosaic(comb)
        areas = sorted(mosaic.area(part) for part in mosaic.cut(0, (0, 20), (1, 0)))
        assert areas == pytest.approx([200, 200, 200, comb.area - 600])

    def test_only_at_leaves_other_arms(self):
        comb = shapely.union_all(
            [box(0, 0, 50, 10), *(box(20 * i, 0, 20 * i + 10, 40) for i in range(3))]
        )
        mosaic = Mosaic(comb)
        parts = mosaic.cut(0, (20, 20), (1, 0), only_at=True)
        assert sorted(map(mosaic.area, parts)) == pytest.approx([200, comb.area - 200])

    def test_a_cut_through_a_hole_parts_the_face_around_it(self):
        mosaic = Mosaic(box(0, 0, 30, 30).difference(box(10, 10, 20, 20)))
        parts = mosaic.cut(0, (0, 15), (1, 0))
        assert [mosaic.area(part) for part in parts] == pytest.approx([400, 400])

    def test_a_line_beside_leaves_a_hole_in_its_part(self):
        mosaic = Mosaic(box(0, 0, 30, 30).difference(box(10, 10, 20, 20)))
        parts = mosaic.cut(0, (0, 5), (1, 0))
        holes = {len(shape.interiors): shape.area for shape in mosaic.polygons(parts)}
        assert holes == pytest.approx({0: 150, 1: 650})

    def test_frontage_leaves_out_closed_parts_that_end_within_an_edge(self):
        mosaic = Mosaic(box(0, 0, 30, 20), MultiLineString([[(10, 0), (25, 0)]]))
        assert mosaic.frontage(0) == pytest.approx(100 - 15)
        mosaic.cut(0, (15, 0), (0, 1))
        assert sum(mosaic.frontage(face) for face in mosaic.faces) == pytest.approx(85)


@given(st.floats(0, 180), st.floats(5, 80), st.floats(5, 80))
@settings(max_examples=30)
def test_the_smallest_rectangle_of_a_rectangle_is_itself(angle, width, height):
    shape = rotate(box(0, 0, width, height), angle, origin=(3, 4))
    found = smallest_rectangle(shapely.get_coordinates(shape.exterior)[:-1])
    assert (found.long, found.short) == pytest.approx((max(width, height), min(width, height)))
    assert found.centre == pytest.approx((shape.centroid.x, shape.centroid.y))
