"""Refinement of parcels on shapes whose best layout is known."""

from __future__ import annotations

import doctest
import importlib
import time

import numpy as np
import pytest
import shapely
from clock import allowed
from platwright.errors import InputError
from platwright.measure.parcel_shape import corner_deviation, rectangle_ratio
from platwright.parcels.refine import block_scores, refine_blocks
from platwright.parcels.rules import ParcelRules
from platwright.parcels.types import Block, Plot
from platwright.progress import Silent
from shapely import MultiLineString, Polygon, box

RULES = ParcelRules()


class Told(Silent):
    """Keeps warnings; is cancelled after so many questions."""

    def __init__(self, questions: float = np.inf) -> None:
        self.warnings: list[str] = []
        self.left = questions
        self.since = 0.0

    def warn(self, text: str) -> None:
        self.warnings.append(text)

    def cancelled(self) -> bool:
        self.left -= 1
        if self.left < 0 and not self.since:
            self.since = time.perf_counter()
        return self.left < 0


def strip(bottom: list[float], top: list[float], depth: float = 30.0) -> list[Plot]:
    """Cut a strip from bottom to top."""
    return [
        Plot(Polygon([(a, 0), (b, 0), (d, depth), (c, depth)]))
        for a, b, c, d in zip(bottom[:-1], bottom[1:], top[:-1], top[1:])
    ]


def leaning(count: int, by: float, width: float = 18.0) -> tuple[Block, list[Plot]]:
    """Make a strip whose cuts lean to both sides in turn."""
    bottom = [width * i for i in range(count + 1)]
    top = [x + by * (-1) ** i for i, x in enumerate(bottom)]
    top[0], top[-1] = bottom[0], bottom[-1]
    return Block(box(0, 0, bottom[-1], 30)), strip(bottom, top)


def polygons(plots: list[Plot]) -> np.ndarray:
    return np.array([p.polygon for p in plots], dtype=object)


@pytest.mark.parametrize("by", [1.0, 4.0, 8.0])
def test_leaning_cuts_of_a_rectangle_become_square(by):
    block, plots = leaning(6, by)
    found = polygons(refine_blocks([block], [plots], RULES)[0])
    # equal in closed form: every corner is square, every parcel its own rectangle
    assert corner_deviation(polygons(plots)).mean() > by
    assert corner_deviation(found).max() < 0.2
    assert rectangle_ratio(found).max() < 1.005


def test_two_rows_with_a_bent_rear_line_become_a_grid():
    x = [0, 18, 36, 54, 72]
    rear = [30, 33, 28, 31, 30]
    plots = []
    for i in range(4):
        a, b, c, d = x[i], x[i + 1], rear[i], rear[i + 1]
        plots.append(Plot(Polygon([(a, 0), (b, 0), (b, d), (a, c)])))
        plots.append(Plot(Polygon([(a, c), (b, d), (b, 60), (a, 60)])))
    found = polygons(refine_blocks([Block(box(0, 0, 72, 60))], [plots], RULES)[0])
    assert corner_deviation(found).max() < 0.5
    assert shapely.area(found) == pytest.approx(540, rel=0.06)
    assert shapely.coverage_is_valid(found)


def test_cut_ends_slide_past_the_bends_of_an_arc():
    t = np.linspace(0, 0.9, 40)
    way = np.stack([np.cos(t), np.sin(t)], axis=1)
    block = Block(shapely.orient_polygons(Polygon(np.vstack([way * 130, way[::-1] * 100]))))
    cuts = np.linspace(0, 0.9, 8)
    lean = np.array([0, 0.05, -0.04, 0.05, -0.05, 0.04, -0.05, 0])
    lines = []
    for angle, off in zip(cuts[1:-1], lean[1:-1]):
        inner, outer = angle - off / 2, angle + off / 2
        ends = [
            (95 * np.cos(inner), 95 * np.sin(inner)),
            (135 * np.cos(outer), 135 * np.sin(outer)),
        ]
        lines.append(shapely.LineString(ends))
    whole = shapely.union_all([block.polygon.boundary, *lines])
    pieces = [
        p
        for p in shapely.get_parts(shapely.polygonize([whole]))
        if block.polygon.contains(p.representative_point())
    ]
    assert len(pieces) == 7
    plots = [Plot(p) for p in pieces]
    found = polygons(refine_blocks([block], [plots], RULES)[0])
    assert corner_deviation(polygons(plots)).mean() > 2.5
    assert corner_deviation(found).mean() < 1.5
    corners = {tuple(c) for c in shapely.get_coordinates(found)}
    assert {tuple(c) for c in shapely.get_coordinates(block.polygon)} <= corners
    assert shapely.coverage_is_valid(found)


def test_ends_never_pass_a_corner_nor_take_frontage_away():
    # the square answer for the left parcel lies beyond the corner at (0, 0)
    block = Block(Polygon([(0, 0), (60, 0), (60, 30), (-25, 30)]))
    plots = strip([0, 8, 34, 60], [-25, 0, 34, 60])
    found = refine_blocks([block], [plots], RULES)[0]
    fronts = [p.polygon.intersection(shapely.LineString([(0, 0), (60, 0)])).length for p in found]
    assert min(fronts) >= RULES.min_frontage - 1e-9
    assert shapely.coverage_is_valid(polygons(found))


def test_an_end_on_a_closed_side_slides_and_open_frontage_stays():
    _, plots = leaning(5, 5.0)
    # only 7 m of the second parcel, from 29 to 36, lie along a street at the bottom
    closed = MultiLineString([[(0, 30), (90, 30)], [(0, 0), (29, 0)]])
    block = Block(box(0, 0, 90, 30), closed)
    found = refine_blocks([block], [plots], RULES)[0]
    street = shapely.LineString([(29, 0), (90, 0)])
    fronts = [p.polygon.intersection(street).length for p in found]
    assert fronts[0] == 0.0
    assert min(fronts[1:]) >= 6.0 - 1e-6
    assert corner_deviation(polygons(found)).mean() < corner_deviation(polygons(plots)).mean() / 2
    tops = [shapely.get_coordinates(p.polygon)[:, 0].max() for p in found]
    assert tops != [shapely.get_coordinates(p.polygon)[:, 0].max() for p in plots]


def test_courts_and_lanes_hold_still_and_cut_ends_slide_along_them():
    court = box(30, 30, 90, 60)
    lines = [box(0, 0, 120, 90).boundary, court.boundary]
    # cuts from the court to the outline, some leaning
    for a, b in [
        ((45, 30), (38, 0)), ((75, 30), (81, 0)), ((45, 60), (52, 90)), ((75, 60), (70, 90)),
        ((30, 45), (0, 50)), ((90, 45), (120, 39)), ((30, 30), (0, 20)), ((90, 30), (120, 24)),
        ((30, 60), (0, 70)), ((90, 60), (120, 66)),
    ]:  # fmt: skip
        lines.append(shapely.LineString([a, b]))
    pieces = shapely.get_parts(shapely.polygonize([shapely.union_all(lines)]))
    plots = [Plot(p, "court" if p.equals(court) else "parcel") for p in pieces]
    assert sum(p.use == "court" for p in plots) == 1
    block = Block(box(0, 0, 120, 90))
    found = refine_blocks([block], [plots], RULES)[0]
    before, after = (
        corner_deviation(polygons([p for p in some if p.use == "parcel"])).mean()
        for some in (plots, found)
    )
    assert after < 0.8 * before
    middle = next(p.polygon for p in found if p.use == "court")
    assert middle.symmetric_difference(court).area < 1e-6
    assert shapely.coverage_is_valid(polygons(found))
    assert shapely.area(polygons(found)).sum() == pytest.approx(120 * 90, rel=1e-9)


def test_a_green_gives_way():
    block, plots = leaning(5, 6.0)
    plots[2] = Plot(plots[2].polygon, "green", "pointed corner")
    found = refine_blocks([block], [plots], RULES)[0]
    assert corner_deviation(polygons(found)).max() < 1.0
    assert found[2].note == "pointed corner"


def test_a_green_is_not_pinched():
    # the second parcel could become square by pushing its corner almost through the green
    green = Polygon([(0, 0), (50, 0), (50, 12), (30, 12), (30, 5), (0, 40)])
    corner = Polygon([(0, 40), (30, 5), (30, 12), (30, 40)])
    beside = Polygon([(30, 12), (50, 12), (50, 40), (30, 40)])
    plots = [Plot(green, "green"), Plot(corner), Plot(beside)]
    found = refine_blocks([Block(box(0, 0, 50, 40))], [plots], RULES)[0]
    assert found[0].polygon.buffer(-1.5).geom_type == "Polygon"


def test_needles_do_not_fold():
    # cuts that almost touch, and one that would cross its neighbour if it became square
    bottom = [0, 10, 10.4, 40, 60]
    top = [0, 38, 38.3, 40, 60]
    block = Block(box(0, 0, 60, 30))
    plots = strip(bottom, top)
    found = polygons(refine_blocks([block], [plots], RULES)[0])
    assert shapely.is_valid(found).all()
    assert shapely.coverage_is_valid(found)
    assert shapely.area(found).min() > 0
    assert shapely.area(found).sum() == pytest.approx(1800, rel=1e-9)


def test_blocks_with_nothing_to_do_come_back():
    square = Block(box(0, 0, 30, 30))
    one = Plot(square.polygon, note="alone")
    assert refine_blocks([], [], RULES) == []
    assert refine_blocks([square, square], [[], [one]], RULES) == [[], [one]]
    assert refine_blocks([square], [[]], RULES) == [[]]


def test_a_plot_round_a_hole_and_one_inside_another():
    ring = box(0, 0, 90, 80).difference(box(40, 35, 50, 45))
    island = box(10, 10, 25, 25)
    plots = [Plot(ring.difference(island)), Plot(island, "green")]
    found = refine_blocks([Block(shapely.orient_polygons(ring))], [plots], RULES)[0]
    assert shapely.coverage_is_valid(polygons(found))
    assert [len(p.polygon.interiors) for p in found] == [2, 0]
    assert shapely.area(polygons(found)).sum() == pytest.approx(ring.area, rel=1e-9)


def test_best_plots_stay_to_the_last_bit():
    block, plots = leaning(5, 0.0)
    found = refine_blocks([block], [plots], RULES)[0]
    assert all(a is b for a, b in zip(plots, found))


def test_plots_that_do_not_tile_stay_with_a_warning():
    block, plots = leaning(5, 4.0)
    other, fine = leaning(4, 4.0)
    told = Told()
    gap, good = refine_blocks([block, other], [plots[1:], fine], RULES, told)
    assert gap == plots[1:]
    assert corner_deviation(polygons(good)).max() < 0.2
    assert told.warnings == ["The plots of block 1 overlap or leave gaps; they stay as they are."]
    overlapping = [*plots, plots[2]]
    assert refine_blocks([block], [overlapping], RULES)[0] == overlapping


def test_lists_of_different_length_are_told():
    block, plots = leaning(5, 4.0)
    with pytest.raises(InputError, match="plots of 1 blocks, but 2 blocks"):
        refine_blocks([block, block], [plots], RULES)


def test_areas_stay_in_their_bounds():
    block, plots = leaning(5, 8.0)
    area = shapely.area(polygons(plots))
    rules = ParcelRules(min_area=float(area.min()), max_area=float(area.max()))
    found = shapely.area(polygons(refine_blocks([block], [plots], rules)[0]))
    assert found.min() >= area.min() - 1e-6
    assert found.max() <= area.max() + 1e-6


def test_no_iterations_change_nothing():
    block, plots = leaning(5, 8.0)
    assert refine_blocks([block], [plots], RULES, iterations=0)[0] == plots


def many(count: int) -> tuple[list[Block], list[list[Plot]]]:
    """Make strips of 20 parcels."""
    cases = [leaning(20, 3.0 + i % 5) for i in range(count)]
    return [block for block, _ in cases], [plots for _, plots in cases]


@pytest.mark.parametrize("questions", [0, 4, 6])
def test_a_cancel_returns_the_best_so_far_within_a_second(questions):
    blocks, plots = many(100)
    told = Told(questions)
    found = refine_blocks(blocks, plots, RULES, told)
    assert time.perf_counter() - told.since < allowed(1.0)
    assert [len(group) for group in found] == [20] * 100
    for group in found[::7]:
        assert shapely.coverage_is_valid(polygons(group))
    deviation = corner_deviation(polygons(found[0]))
    assert (deviation.mean() < 5.0) == (questions > 0)
    # the second thousand of parcels has its turn only after the first
    assert found[-1] == plots[-1]


def test_scores_are_those_of_the_definition():
    shapes = np.array([box(0, 0, 18, 30), box(18, 0, 54, 30), Polygon([(0, 0), (9, 0), (0, 9)])])
    # equal in closed form: CV of (540, 1080); a triangle with corners 90, 45, 45 and ratio 2
    assert block_scores(shapes[:2], np.array([0, 0]), 1) == pytest.approx([8 / 3])
    assert block_scores(shapes, np.array([0, 0, 2]), 3)[1] == 0.0
    assert block_scores(shapes, np.array([0, 0, 2]), 3)[2] == pytest.approx(30 + 30 + 50)


def test_the_examples_are_true():
    result = doctest.testmod(importlib.import_module("platwright.parcels.refine.scores"))
    assert result.attempted > 0
    assert result.failed == 0


@pytest.mark.slow
def test_ten_thousand_parcels():
    blocks, plots = many(500)
    begin = time.process_time()
    found = refine_blocks(blocks, plots, RULES)
    assert time.process_time() - begin < 14.0
    flat = np.array([p.polygon for group in found for p in group], dtype=object)
    assert len(flat) == 10_000
    assert corner_deviation(flat).mean() < 0.2
