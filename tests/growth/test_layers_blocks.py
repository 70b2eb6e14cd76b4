"""Blocks tile the ground, know what closes them, and are the ones that a slow search finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.growth.layers import growth_layers
from platwright.growth.layers.blocks import grown_blocks
from platwright.measure.polygons import block_sizes
from platwright.streets.blocks import block_size

from .hand_made import ORIGIN, Edge, given_street, lattice, make_growth, make_real, rules


def blocks_of(growth, real):
    return growth_layers(growth, real, rules(iterations=99))["blocks"]


def test_a_block_of_a_grid_by_hand():
    blocks = blocks_of(growth := lattice(2, 2, size=80.0), make_real(growth))
    assert len(blocks) == 1
    row = blocks.iloc[0]
    assert (row.area_m2, row.perimeter_m) == (6400.0, 320.0)
    assert (row.width_m, row.length_m) == (80.0, 80.0)
    assert row.sides == 4
    assert row.enclosed == "streets"
    assert row.compactness == pytest.approx(np.pi / 4)
    # its upper right corner is two steps away
    assert row.iteration == 2


def test_the_size_of_a_block_is_that_of_designed_streets():
    shapes = np.array(
        [
            shapely.box(0, 0, 150, 72),
            shapely.Polygon([(0, 0), (100, 0), (0, 50)]),
            shapely.Polygon([(0, 0), (90, 20), (70, 80), (20, 60), (-10, 30)]),
            shapely.Point(0, 0).buffer(50).difference(shapely.Point(0, 0).buffer(20)),
        ],
        dtype=object,
    )
    width, length = block_sizes(shapes)
    expected = [block_size(shape) for shape in shapes]
    assert np.column_stack([width, length]) == pytest.approx(np.array(expected), abs=1e-5)


def test_a_blind_street_does_not_cut_a_block_and_a_later_street_does():
    xy = [(0, 0), (200, 0), (200, 100), (0, 100), (100, 0), (100, 60), (100, 100)]
    ring = [Edge(0, 4), Edge(4, 1), Edge(1, 2), Edge(2, 6), Edge(6, 3), Edge(3, 0)]
    blind = [*ring, Edge(4, 5, road=2, step=4)]
    growth = make_growth(xy, blind)
    assert blocks_of(growth, make_real(growth))["iteration"].tolist() == [1]
    through = [*blind, Edge(5, 6, road=2, step=9)]
    growth = make_growth(xy, through)
    blocks = blocks_of(growth, make_real(growth))
    assert blocks["area_m2"].tolist() == [10_000, 10_000]
    assert blocks["iteration"].tolist() == [9, 9]
    assert blocks["sides"].tolist() == [2, 2]


def test_the_edge_of_the_domain_closes_blocks_and_holes_are_none():
    # a street from the left edge to a pond, and one from the pond to the right edge
    xy = [(0, 50), (40, 50), (60, 50), (100, 50)]
    growth = make_growth(xy, [Edge(0, 1), Edge(2, 3, road=2)], node_type=np.full(4, "BOUNDARY"))
    domain = shapely.box(0, 0, 100, 100).difference(shapely.box(40, 40, 60, 60))
    blocks = blocks_of(growth, make_real(growth, domain))
    assert blocks["area_m2"].tolist() == [4800.0, 4800.0]
    assert blocks["enclosed"].tolist() == ["edge", "edge"]
    assert blocks["sides"].tolist() == [2, 2]


def test_a_ring_of_streets_inside_a_block_is_a_block_in_a_hole():
    xy = [(0, 0), (300, 0), (300, 300), (0, 300), (100, 100), (200, 100), (200, 200), (100, 200)]
    edges = [Edge(0, 1), Edge(1, 2), Edge(2, 3), Edge(3, 0)]
    edges += [Edge(u, v, road=2, step=5) for u, v in ((4, 5), (5, 6), (6, 7), (7, 4))]
    growth = make_growth(xy, edges)
    blocks = blocks_of(growth, make_real(growth))
    assert blocks["area_m2"].tolist() == [80_000, 10_000]
    assert blocks["iteration"].tolist() == [5, 5]
    assert blocks["sides"].tolist() == [2, 1]


def test_existing_streets_of_one_name_are_one_side():
    xy = [(0, 0), (100, 0), (200, 0), (200, 100), (0, 100)]
    edges = [Edge(0, 1, street=0), Edge(1, 2, street=1), Edge(2, 3, street=2)]
    growth = make_growth(xy, [*edges, Edge(3, 4), Edge(4, 0)])
    streets = (
        given_street([(0, 0), (100, 0)], "High Street"),
        given_street([(100, 0), (200, 0)], "High Street"),
        given_street([(200, 0), (200, 100)]),
    )
    blocks = blocks_of(growth, make_real(growth, streets=streets, given=4))
    assert blocks["sides"].tolist() == [3]
    assert blocks["iteration"].tolist() == [1]


def test_a_street_hardly_beside_the_edge_leaves_no_strip_as_a_block():
    xy = [(0, 0.4), (100, 0.4)]
    growth = make_growth(xy, [Edge(0, 1)], node_type=np.full(2, "BOUNDARY"))
    blocks = blocks_of(growth, make_real(growth, shapely.box(0, 0, 100, 100)))
    assert blocks["area_m2"].tolist() == [pytest.approx(9960.0)]


def test_streets_that_cross_without_a_node_still_part_blocks():
    # as published: a street put on another one does not split it
    xy = [(0, 0), (100, 0), (100, 100), (0, 100), (50, 0), (50, 100)]
    ring = [Edge(0, 1), Edge(1, 2), Edge(2, 3), Edge(3, 0)]
    growth = make_growth(xy, [*ring, Edge(4, 5, road=2)])
    blocks = blocks_of(growth, make_real(growth))
    assert blocks["area_m2"].tolist() == [5000.0, 5000.0]
    assert blocks["enclosed"].tolist() == ["streets", "streets"]


@settings(max_examples=25)
@given(st.integers(2, 7), st.integers(2, 7), st.integers(0, 10_000), st.floats(0.0, 0.6))
def test_blocks_tile_the_domain(columns, rows, seed, share):
    growth = lattice(columns, rows, seed=seed)
    rng = np.random.default_rng(seed)
    kept = rng.random(len(growth.ends)) >= share
    own = ("ends", "road", "edge_type", "step", "street")
    growth = replace(growth, **{name: getattr(growth, name)[kept] for name in own})
    hull = shapely.convex_hull(shapely.multipoints(growth.xy - ORIGIN))
    domain = hull.buffer(30, join_style="mitre").difference(shapely.Point(50, 50).buffer(8))
    real = make_real(growth, domain)
    blocks = blocks_of(growth, real)
    shapes = blocks.geometry.to_numpy()
    # a ring of the domain that no street meets is an edge as well
    assert blocks["area_m2"].sum() == pytest.approx(domain.area, abs=0.01 + 1e-3 * domain.length)
    assert shapely.coverage_is_valid(shapes)
    assert shapely.is_valid(shapes).all()
    assert real.ground.domain.buffer(0.01).covers(shapely.union_all(shapes))
    # independently: the ground cut by thin streets falls into as many large pieces, but for
    # streets that end blind, which part nothing
    lines = shapely.linestrings(growth.xy[growth.ends])
    left = real.ground.domain.difference(shapely.union_all(shapely.buffer(lines, 0.01)))
    assert len(blocks) == sum(piece.area > 1 for piece in shapely.get_parts(left))
    # what closes them, piece by piece along the outline
    streets = shapely.union_all(lines)
    for shape, enclosed, sides in zip(shapes, blocks["enclosed"], blocks["sides"]):
        bare = shape.boundary.difference(streets.buffer(0.01)).length
        assert (enclosed == "edge") == (bare > 0.1)
        beside = shapely.length(shapely.intersection(lines, shape.boundary.buffer(0.01))) > 1.0
        assert sides <= len(set(growth.road[beside].tolist()))


def test_a_block_at_a_start_of_coordinates_far_away_has_all_its_sides():
    growth = lattice(4, 4, seed=1)
    far = replace(growth, xy=growth.xy + np.array([3e6, 3e6]))
    near, there = (grown_blocks(g, make_real(g)) for g in (growth, far))
    assert there.closed.all()
    assert there.sides.tolist() == near.sides.tolist()
