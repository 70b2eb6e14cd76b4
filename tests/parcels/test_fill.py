"""The whole chain from blocks to plots: deep blocks, fallbacks, bad input, the guard."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.parcels.fill import fill_blocks, methods
from platwright.parcels.fill.deep import stitch
from platwright.parcels.fill.guard import BEHIND, faults
from platwright.parcels.fill.lanes import cut_lane
from platwright.parcels.fill.mend import sound_parts
from platwright.parcels.rules import ParcelRules
from platwright.parcels.types import Block, Plot
from platwright.progress import Silent
from shapely.geometry import MultiLineString, Polygon, box

RULES = ParcelRules(method="skeleton")
#: 150 m across, 30 parcels of 540 m2.
PENTAGON = Polygon([(29, 0), (134, -9), (167, 69), (82, 140), (6, 87)])
#: 200 x 100 m: 30 m rows all around, and 140 x 40 m in the middle.
DEEP = Block(box(0, 0, 200, 100))


def check(block, plots, rules):
    """Prove tiling and access by lines and overlays, not by shared vertices."""
    pieces = [plot.polygon for plot in plots]
    assert all(piece.is_valid for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(block.polygon.area, rel=1e-6)
    for one, two in itertools.combinations(pieces, 2):
        assert one.intersection(two).area < 1e-4
    rim = block.polygon.boundary.difference(block.closed.buffer(0.02))
    ways = [plot.polygon.boundary for plot in plots if plot.use in ("lane", "street")]
    streets = shapely.union_all([rim, *ways]).buffer(0.01)
    for plot in plots:
        if plot.use == "parcel":
            least = rules.flag_width if plot.note == BEHIND else rules.min_frontage
            assert plot.polygon.boundary.intersection(streets).length >= 0.97 * least


def count(plots, use="parcel"):
    return sum(plot.use == use for plot in plots)


def test_a_shallow_block_has_all_that_was_requested():
    filled = fill_blocks([Block(box(0, 0, 200, 60))], RULES, refine=False)
    assert (filled.requested, filled.achieved, filled.problems) == (22, 22, [])


def test_a_court_gets_a_way_and_a_word_about_a_street():
    filled = fill_blocks([DEEP], RULES, refine=False)
    (plots,) = filled.plots
    check(DEEP, plots, RULES)
    (court,) = [plot.polygon for plot in plots if plot.use == "court"]
    # 140 x 40 m and a strip of 4 x 30 m
    assert court.area == pytest.approx(5600 + 120)
    assert court.boundary.intersection(DEEP.polygon.boundary).length == pytest.approx(4)
    # the rows: 200 x 100 m less the court, in parcels of about 540 m2
    assert filled.requested == 37
    assert filled.achieved == count(plots) == 26
    street = next(p for p in filled.problems if "street through it" in p.reason)
    # (5720 - 15 * (140 + 60)) / 540 = 5.04
    assert "100 m deep" in street.reason
    assert "5 more" in street.reason
    assert street.place.within(DEEP.polygon)
    assert any(p.reason.startswith("26 of 37 parcels: 5720 m2 too far") for p in filled.problems)


def test_a_lane_uses_the_court_up():
    rules = replace(RULES, deep="lane")
    filled = fill_blocks([DEEP], rules, refine=False)
    (plots,) = filled.plots
    check(DEEP, plots, rules)
    assert count(plots, "court") == 0
    lanes = [plot.polygon for plot in plots if plot.use == "lane"]
    assert lanes
    ends = sum(lane.boundary.intersection(DEEP.polygon.boundary).length for lane in lanes)
    assert ends >= 6 - 1e-6
    # 20000 m2 less at most 2 lanes of 6 m, by 540 m2, is at least 30
    assert filled.achieved >= 30


def test_flags_reach_the_street_by_strips_of_their_own():
    rules = replace(RULES, deep="flag")
    filled = fill_blocks([DEEP], rules, refine=False)
    (plots,) = filled.plots
    check(DEEP, plots, rules)
    behind = [plot.polygon for plot in plots if plot.note == BEHIND]
    # 5600 m2: halves of 140 x 40 down to 35 x 20 = 700 m2, each with 4 x 30 m
    assert len(behind) == 8
    assert [lot.area for lot in behind] == pytest.approx([820] * 8)
    assert filled.achieved == 26 + 8


@pytest.mark.parametrize("deep", ["court", "lane", "flag"])
@pytest.mark.parametrize("method", ["strips", "skeleton", "halving"])
def test_a_pentagon_with_each_choice(method, deep):
    rules = ParcelRules(method=method, deep=deep)
    block = Block(PENTAGON)
    filled = fill_blocks([block], rules)
    check(block, filled.plots[0], rules)
    assert filled.achieved >= 0.55 * filled.requested
    if method != "halving" and deep != "court":
        court = fill_blocks([block], replace(rules, deep="court"))
        assert filled.achieved > court.achieved


def test_closed_sides_give_no_frontage_and_lanes_start_at_open_ones():
    shape = box(0, 0, 200, 100)
    closed = MultiLineString([[(0, 0), (0, 100), (200, 100)]])
    block = Block(shape, closed)
    for deep in ("court", "lane", "flag"):
        rules = replace(RULES, deep=deep)
        (plots,) = fill_blocks([block], rules, refine=False).plots
        check(block, plots, rules)
    assert cut_lane(block, (100, 50), (1, 0), 6).lanes[0].area == pytest.approx(1200)
    shut = Block(shape, MultiLineString([shape.exterior]))
    assert cut_lane(shut, (100, 50), (1, 0), 6) is None
    filled = fill_blocks([shut], RULES)
    assert [plot.use for plot in filled.plots[0]] == ["green"]


def test_what_fails_is_replaced_and_told(monkeypatch):
    def broken(blocks, rules, progress=None):
        if any(block.block_id == 2 for block in blocks):
            msg = "no such luck"
            raise ValueError(msg)
        return [[Plot(block.polygon.buffer(-1))] for block in blocks]

    monkeypatch.setattr(methods, "cut_blocks", broken)
    blocks = [Block(box(0, 0, 200, 60), block_id=1), Block(box(0, 80, 200, 140), block_id=2)]
    filled = fill_blocks(blocks, ParcelRules(), refine=False)
    reasons = {problem.block_id: problem.reason for problem in filled.problems}
    assert "less than the block" in reasons[1]
    assert "no such luck" in reasons[2]
    assert all("skeleton" in problem.done for problem in filled.problems)
    assert filled.achieved == 44
    # when all else fails, one green
    monkeypatch.setattr(methods, "skeleton_block", lambda *_: [])
    monkeypatch.setattr(methods, "halve_block", lambda *_: [])
    filled = fill_blocks(blocks, ParcelRules(), refine=False)
    assert [[plot.use for plot in row] for row in filled.plots] == [["green"], ["green"]]
    assert sum("could not be cut" in problem.reason for problem in filled.problems) == 6


def test_refinement_that_breaks_a_block_is_not_taken(monkeypatch):
    monkeypatch.setattr(methods, "refine_blocks", lambda _, plots, *__: [row[1:] for row in plots])
    filled = fill_blocks([Block(box(0, 0, 200, 60))], RULES)
    assert filled.achieved == 22


class TestGuard:
    BLOCK = Block(box(0, 0, 36, 30))

    def told(self, *plots, block=None, rules=RULES):
        (fault,) = faults([block or self.BLOCK], [list(plots)], rules)
        return "" if fault is None else fault.reason

    def test_a_sound_block_passes_with_and_without_shared_vertices(self):
        left, right = Plot(box(0, 0, 18, 30)), Plot(box(18, 0, 36, 30))
        assert self.told(left, right) == ""
        lower, upper = Plot(box(18, 0, 36, 15)), Plot(box(18, 15, 36, 30))
        assert self.told(left, lower, upper) == ""

    def test_gaps_overlaps_and_crossings_are_found(self):
        left, right = Plot(box(0, 0, 18, 30)), Plot(box(18, 0, 36, 30))
        assert "540 m2 less" in self.told(left)
        assert "overlap" in self.told(
            Plot(box(0, 0, 24, 30)), Plot(box(24, 0, 36, 15)), Plot(box(12, 15, 24, 30))
        )
        assert "crosses itself" in self.told(
            left, Plot(Polygon([(18, 0), (36, 30), (36, 0), (18, 30)])), right
        )
        assert "overlap" in self.told(left, left)

    def test_access_counts_open_edges_and_lanes_only(self):
        closed = MultiLineString([[(18, 0), (36, 0), (36, 30), (18, 30)]])
        block = replace(self.BLOCK, closed=closed)
        left, right = Plot(box(0, 0, 18, 30)), Plot(box(18, 0, 36, 30))
        assert "0.0 m along streets" in self.told(left, right, block=block)
        assert self.told(replace(left, use="lane"), right, block=block) == ""
        assert self.told(left, replace(right, use="green"), block=block) == ""

    def test_parcels_behind_others_need_the_width_of_their_strip(self):
        closed = MultiLineString([[(4, 0), (36, 0), (36, 30), (0, 30), (0, 0)]])
        block = replace(self.BLOCK, closed=closed)
        plot = Plot(self.BLOCK.polygon)
        assert "4.0 m" in self.told(plot, block=block)
        assert self.told(replace(plot, note=BEHIND), block=block) == ""


def test_stitching_gives_plots_the_vertices_of_their_neighbours():
    plots = [Plot(box(0, 0, 10, 20)), Plot(box(10, 0, 20, 10)), Plot(box(10, 10, 20, 20))]
    assert not shapely.coverage_is_valid([plot.polygon for plot in plots])
    found = [plot.polygon for plot in stitch(plots)]
    assert shapely.coverage_is_valid(found)
    assert [shape.area for shape in found] == [200, 100, 100]


def test_bad_outlines_are_repaired_left_out_and_told():
    bow = Polygon([(0, 0), (60, 60), (60, 0), (0, 60)])
    spike = Polygon([(0, 0), (100, 0), (100, 60), (50, 60), (50, 300), (50, 60), (0, 60)])
    with np.errstate(invalid="ignore"):
        nowhere = Polygon([(0, 0), (math.nan, 0), (20, 20)])
    blocks = [
        Block(bow, block_id=1),
        Block(spike, block_id=2),
        Block(Polygon(), block_id=3),
        Block(Polygon([(0, 0), (10, 0), (20, 0)]), block_id=4),
        Block(Polygon([(0, 0, 5), (200, 0, 5), (200, 60, 5), (0, 60, 5)]), block_id=5),
        Block(nowhere, block_id=6),
        Block(box(0, 0, 300, 0.01), block_id=7),
    ]
    filled = fill_blocks(blocks, RULES, refine=False)
    area = [sum(plot.polygon.area for plot in row) for row in filled.plots]
    assert area == pytest.approx([1800, 6000, 0, 0, 12000, 0, 3], rel=1e-6)
    assert {problem.block_id for problem in filled.problems} >= {1, 2, 3, 4, 6}
    assert count(filled.plots[4]) == 22
    parts, _ = sound_parts(blocks[0])
    assert [part.polygon.area for part in parts] == pytest.approx([900, 900])


@st.composite
def messy(draw):
    """Outlines as they come: some cross themselves, some have holes, some sides are closed."""
    size = draw(st.integers(4, 9))
    xy = draw(
        st.lists(st.tuples(st.integers(0, 160), st.integers(0, 120)), min_size=size, max_size=size)
    )
    shape = Polygon(xy)
    if draw(st.booleans()):
        shape = shape.buffer(0)
        shape = max(shapely.get_parts(shape), key=lambda part: part.area, default=Polygon())
        hole = shapely.Point(shape.representative_point()).buffer(4) if shape.area else Polygon()
        shape = shape.difference(hole) if shape.contains(hole) else shape
    return shape


@given(st.lists(messy(), min_size=1, max_size=3), st.sampled_from(["court", "lane", "flag"]),
       st.sampled_from(["strips", "skeleton"]))  # fmt: skip
@settings(max_examples=15)
def test_whatever_comes_is_tiled_with_access(shapes, deep, method):
    rules = ParcelRules(deep=deep, method=method)
    blocks = [Block(shape, block_id=i + 1) for i, shape in enumerate(shapes)]
    filled = fill_blocks(blocks, rules)
    for block, plots in zip(blocks, filled.plots):
        land = block.polygon
        if not land.is_valid:
            land = shapely.make_valid(land, method="structure", keep_collapsed=False)
        check(replace(block, polygon=land), plots, rules)
    assert filled.achieved == sum(map(count, filled.plots))


def test_same_seed_same_bytes_and_order_does_not_matter():
    blocks = [Block(PENTAGON, block_id=1), replace(DEEP, block_id=2)]
    rules = replace(RULES, deep="flag")
    found = [fill_blocks(each, rules).plots for each in (blocks, blocks, blocks[::-1])]
    as_bytes = [[[plot.polygon.wkb for plot in row] for row in plots] for plots in found]
    assert as_bytes[0] == as_bytes[1] == as_bytes[2][::-1]


def test_cancel():
    class Stop(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        fill_blocks([DEEP], RULES, progress=Stop())


@pytest.mark.slow
@pytest.mark.parametrize("deep", ["court", "lane", "flag"])
def test_real_outlines_are_tiled_with_access(shared_data, deep):
    gpd = pytest.importorskip("geopandas")
    shapes = []
    for name, layer in (
        ("cambridge_invalid_parcels", "parcels"),
        ("cambridge_slivers", "slivers_and_neighbours"),
        ("derived_bowtie_spike", "site"),
    ):
        read = gpd.read_file(shared_data / "bad" / f"{name}.gpkg", layer=layer)
        parts = shapely.get_parts(read.geometry.dropna().to_numpy())
        shapes += [part for part in parts if part.geom_type == "Polygon"]
    rules = ParcelRules(deep=deep)
    blocks = [Block(shape, block_id=i + 1) for i, shape in enumerate(shapes)]
    filled = fill_blocks(blocks, rules)
    for block, plots in zip(blocks, filled.plots):
        land = block.polygon
        if not land.is_valid:
            land = shapely.make_valid(land, method="structure", keep_collapsed=False)
        # a spike of no width cannot be cut off without a plot that has one
        pieces = np.array([plot.polygon for plot in plots], dtype=object)
        assert shapely.area(pieces).sum() == pytest.approx(land.area, rel=1e-6)
        if shapely.is_valid(pieces).all():
            check(replace(block, polygon=land), plots, rules)
        else:
            assert len(pieces) == 1


def test_parcels_that_no_house_suits_become_greens():
    from platwright.parcels.fill.houses import without_oddities

    rules = ParcelRules()
    # 540 m2 are asked for, at most 1,188; 18 m wide
    good, large, slim = box(0, 0, 18, 30), box(0, 0, 50, 60), box(0, 0, 5, 60)
    rows = [[Plot(good), Plot(large)], [Plot(slim), Plot(slim, "lane")]]
    found = without_oddities(rows, rules)
    assert [[p.use for p in row] for row in found] == [["parcel", "green"], ["green", "lane"]]
    assert [p.note for p in (found[0][1], found[1][0])] == [
        "too large for a parcel",
        "too narrow for a house",
    ]
    assert without_oddities(rows, ParcelRules(greens=False)) == rows
