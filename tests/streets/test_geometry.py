"""Segments, blocks, chains and adopted streets on hand-computed cases."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.mesh import grid
from platwright.site import BoundaryStreet
from platwright.streets.adopt import adopt_streets
from platwright.streets.blocks import block_size, blocks, reach_edge
from platwright.streets.chains import chains
from platwright.streets.segments import Segment
from shapely.geometry import LineString

from .conftest import make_site


def segment(length: float, start: float, end: float) -> Segment:
    return Segment(LineString([(0, 0), (length, 0)]), 3, 0, 1, start, end)


def test_mean_distance_of_a_street_with_one_way_out():
    # from 100 m at the start to 160 m at the end: on average 130 m
    assert segment(60, 100, 160).mean_distance == pytest.approx(130)


def test_mean_distance_of_a_street_with_two_ways_out():
    # both ends are sinks: nobody is further than half way
    s = segment(60, 0, 0)
    assert s.mean_distance == pytest.approx(15)
    assert s.furthest == pytest.approx(30)
    assert s.direction == 0


@given(st.floats(1, 200), st.floats(0, 500), st.floats(-1, 1))
def test_mean_distance_agrees_with_sampling(length, start, share):
    end = max(0.0, start + share * length)
    s = segment(length, start, end)
    at = (np.arange(2000) + 0.5) / 2000 * length
    sampled = np.minimum(start + at, end + length - at).mean()
    assert s.mean_distance == pytest.approx(sampled, rel=1e-3, abs=1e-2)


def test_chains_run_straight_through_a_crossing():
    mesh = grid(4, 4, h=50)
    level = (~mesh.boundary_edges).astype(np.int64) * 3
    found = chains(mesh, level)
    assert len(found) == 6
    for chain in found:
        spread = np.ptp(mesh.vertices[chain], axis=0)
        assert sorted(spread.tolist()) == [0.0, 200.0]


def test_blocks_of_a_cross():
    site = make_site(shapely.box(0, 0, 100, 60))
    found = blocks(site, [LineString([(50, 0), (50, 60)]), LineString([(0, 30), (100, 30)])])
    assert sorted(b.polygon.area for b in found) == [1500.0] * 4
    assert {(b.width, b.length) for b in found} == {(30.0, 50.0)}


def test_a_pointed_block_is_not_flattered():
    width, length = block_size(shapely.Polygon([(0, 0), (100, 0), (0, 50)]))
    assert (width, length) == pytest.approx((25.0, 100.0))


def test_a_street_that_ends_short_reaches_the_edge():
    site = make_site(shapely.box(0, 0, 100, 60))
    piece = reach_edge(site, (50, 57), (50, 30))
    assert piece.crosses(site.polygon.exterior)
    assert piece.length == pytest.approx(3.05)


def test_a_kept_road_draws_a_mesh_line_onto_itself():
    mesh = grid(4, 4, h=72)
    road = LineString([(0, 130), (288, 150)])
    site = make_site(shapely.box(0, 0, 288, 288), inner=(BoundaryStreet(road),))
    moved, adopted = adopt_streets(mesh, site)
    assert adopted.sum() == 4
    ends = np.unique(moved.edges[adopted])
    inner = ends[~moved.boundary_vertices[ends]]
    assert shapely.distance(shapely.points(moved.vertices[inner]), road).max() < 1e-9
    assert (moved.vertices[moved.boundary_vertices] == mesh.vertices[mesh.boundary_vertices]).all()
