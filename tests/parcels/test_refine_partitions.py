"""Refined plots of random blocks: they tile, keep the outline and their frontage, get no worse."""

from __future__ import annotations

import math
import os
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.measure.parcel_shape import corner_deviation, rectangle_ratio
from platwright.parcels.refine import refine_blocks
from platwright.parcels.rules import ParcelRules
from platwright.parcels.types import Block, Plot
from shapely import LineString, MultiLineString, Polygon, affinity, box
from shapely.ops import split

RULES = ParcelRules()
#: More are looked at where new examples are explored.
EXAMPLES = 200 if os.environ.get("PLATWRIGHT_HYPOTHESIS") == "explore" else 10
FAR = (233_000.0, 901_000.0)


def outline(kind: str, rng: np.random.Generator) -> Polygon:
    """Draw a block of a kind."""
    if kind == "quad":
        xy = np.array([(0, 0), (90, 0), (90, 60), (0, 60)]) + rng.uniform(-9, 9, (4, 2))
        return Polygon(xy)
    if kind == "bent":
        t = np.linspace(0, math.pi * rng.uniform(0.3, 0.9), int(rng.integers(4, 25)))
        way = np.stack([np.cos(t), np.sin(t)], axis=1)
        return Polygon(np.vstack([way * 95, way[::-1] * 45]))
    if kind == "round":
        return shapely.Point(0, 0).buffer(50, quad_segs=int(rng.integers(5, 9)))
    if kind == "ring":
        return box(0, 0, 110, 100).difference(box(40, 38, 75, 60))
    return Polygon([(0, 0), (100, 0), (100, 40), (45, 45), (40, 90), (0, 90)])


def cut(block: Polygon, rng: np.random.Generator, wish: float) -> list[Polygon]:
    """Halve with lines that are somewhat off, until the pieces are small."""
    done, rest = [], [block]
    while rest:
        piece = rest.pop()
        if piece.area < 1.6 * wish:
            done.append(piece)
            continue
        x0, y0, x1, y1 = piece.bounds
        across = rng.uniform(-0.5, 0.5) + (0 if x1 - x0 > y1 - y0 else math.pi / 2)
        middle = piece.representative_point()
        at = np.array([middle.x, middle.y]) + rng.uniform(-3, 3, 2)
        way = 300 * np.array([-math.sin(across), math.cos(across)])
        parts = list(split(piece, LineString([at - way, at + way])).geoms)
        if len(parts) < 2 or min(p.area for p in parts) < 20:
            done.append(piece)
        else:
            rest += parts
    return done


KINDS = ("quad", "bent", "round", "ring", "angle")


@st.composite
def cut_blocks(draw: st.DrawFn) -> tuple[Block, list[Plot]]:
    """Draw a block and its plots."""
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    shape = shapely.orient_polygons(outline(draw(st.sampled_from(KINDS)), rng))
    pieces = cut(shape, rng, draw(st.sampled_from([350.0, 600.0])))
    uses = ["parcel"] * len(pieces)
    for other in ("green", "court", "lane"):
        if draw(st.booleans()):
            uses[int(rng.integers(len(pieces)))] = other
    closed = MultiLineString()
    if draw(st.booleans()):
        a, b = np.sort(rng.uniform(0, 1, 2)) * shape.exterior.length
        closed = MultiLineString([shapely.ops.substring(shape.exterior, a, b)])
    far = draw(st.booleans())
    if far:
        shape, *pieces = (affinity.translate(p, *FAR) for p in (shape, *pieces))
        closed = affinity.translate(closed, *FAR)
    plots = [
        Plot(p, use, note=f"note {i}", template="drawn" if i % 3 == 0 else "")
        for i, (p, use) in enumerate(zip(pieces, uses))
    ]
    return Block(shape, closed, 7), plots


def score(plots: list[Plot]) -> float:
    """Score of a block, written out."""
    parcels = np.array([p.polygon for p in plots if p.use == "parcel"], dtype=object)
    if not len(parcels):
        return 0.0
    angle, ratio = corner_deviation(parcels), rectangle_ratio(parcels)
    area = shapely.area(parcels)
    bad = np.mean((angle > 15) | (ratio > 1.2))
    return float(
        30 * bad + angle.mean() + 50 * (ratio.mean() - 1) + 8 * np.std(area) / np.mean(area)
    )


def assert_tiled(block: Block, plots: list[Plot]) -> None:
    """Check with GEOS that plots cover the block once, with shared vertices."""
    shapes = [p.polygon for p in plots]
    assert shapely.is_valid(shapes).all()
    size = block.polygon.area
    assert sum(p.area for p in shapes) == pytest.approx(size, rel=1e-6)
    assert shapely.coverage_is_valid(shapes)
    whole = shapely.union_all(shapes)
    assert whole.symmetric_difference(block.polygon).area < 1e-6 * size
    assert shapely.hausdorff_distance(whole.boundary, block.polygon.boundary) < 2e-3
    corners = {tuple(c) for p in shapes for c in shapely.get_coordinates(p)}
    assert {tuple(c) for c in shapely.get_coordinates(block.polygon)} <= corners


def fronts(block: Block, plots: list[Plot]) -> np.ndarray:
    """Length of each plot along streets."""
    streets = block.polygon.boundary
    if not block.closed.is_empty:
        streets = streets.difference(block.closed.buffer(0.02, cap_style="flat"))
    near = streets.buffer(0.005, cap_style="flat")
    return np.array([p.polygon.boundary.intersection(near).length for p in plots])


@settings(max_examples=EXAMPLES)
@given(cut_blocks())
def test_plots_tile_the_block_and_get_no_worse(case):
    block, plots = case
    found = refine_blocks([block], [plots], RULES)[0]
    assert_tiled(block, found)
    assert score(found) <= score(plots) + 1e-6
    assert [(p.use, p.note, p.template) for p in found] == [
        (p.use, p.note, p.template) for p in plots
    ]
    before, after = fronts(block, plots), fronts(block, found)
    parcel = np.array([p.use == "parcel" for p in plots])
    assert (after >= np.minimum(before, RULES.min_frontage) - 0.03)[parcel].all()
    old = np.array([p.polygon.area for p in plots])
    new = np.array([p.polygon.area for p in found])
    assert (new >= np.minimum(old, RULES.least_area) - 0.2)[parcel].all()
    assert (new <= np.maximum(old, RULES.largest_area) + 0.2)[parcel].all()
    common = np.where(parcel, np.median(old[parcel]) if parcel.any() else 0.0, old)
    loose = np.array([p.use in ("parcel", "green") for p in plots])
    assert (new >= 0.7 * np.minimum(old, common) - 0.2)[loose].all()
    assert (new <= 1.4 * np.maximum(old, common) + 0.2)[loose].all()
    for a, b in zip(plots, found):
        if a.use in ("court", "lane"):
            assert a.polygon.symmetric_difference(b.polygon).area < 0.2


@settings(max_examples=max(3, EXAMPLES // 5))
@given(st.lists(cut_blocks(), min_size=2, max_size=3))
def test_a_block_does_not_depend_on_the_others(cases):
    blocks = [replace(block, block_id=i + 1) for i, (block, _) in enumerate(cases)]
    plots = [group for _, group in cases]
    together = refine_blocks(blocks, plots, RULES)
    again = refine_blocks(blocks, plots, RULES)
    for block, group, found, same in zip(blocks, plots, together, again):
        alone = refine_blocks([block], [group], RULES)[0]
        coordinates = [shapely.to_wkb([p.polygon for p in some]) for some in (alone, found, same)]
        assert (coordinates[0] == coordinates[1]).all()
        assert (coordinates[0] == coordinates[2]).all()
