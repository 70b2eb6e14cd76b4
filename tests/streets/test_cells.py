"""Cells as long as blocks need, plans judged by their streets, and ends square to the edge."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.mesh import quadrangulate
from platwright.network.specification import Specification
from platwright.streets import design_streets
from platwright.streets.align import REACH, align
from platwright.streets.cells import LONGEST, SHORTEST, SQUARE, cell_ratio, stretched_mesh
from platwright.streets.fitting import mesh_choices, street_misfit
from shapely import affinity

from .conftest import make_site


@given(st.floats(30, 200), st.floats(30, 600))
def test_blocks_are_whole_cells_and_not_longer_than_asked(width, length):
    ratio = cell_ratio(width, max(width, length))
    assert ratio == 1 or SHORTEST <= ratio <= LONGEST
    if ratio != 1:
        cells = max(width, length) / (ratio * width)
        assert cells == pytest.approx(round(cells))
        assert abs(ratio - 1) > SQUARE


@pytest.mark.parametrize("angle", [0.0, 25.0])
@pytest.mark.parametrize("across", [False, True])
def test_cells_are_stretched_along_or_across_the_site(angle, across):
    site = affinity.rotate(shapely.box(0, 0, 600, 300), angle, origin=(0, 0))
    mesh = stretched_mesh(site, 60.0, 1.25, across, np.zeros((0, 2)))
    # 600 / 75 x 300 / 60 cells along it, 600 / 60 x 300 / 75 across it
    assert len(mesh.faces) == 40
    sizes = sorted({round(float(length)) for length in mesh.lengths})
    assert sizes == [60, 75]
    step = mesh.vertices[mesh.edges[:, 1]] - mesh.vertices[mesh.edges[:, 0]]
    main = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    long = mesh.lengths > 70
    along = np.abs(step[long] @ main) / mesh.lengths[long]
    assert along == pytest.approx(0.0 if across else 1.0, abs=1e-6)
    assert float(shapely.area(shapely.polygons(mesh.vertices[mesh.faces])).sum()) == pytest.approx(
        site.area, rel=1e-6
    )


def test_a_stretched_mesh_meets_the_streets_that_arrive():
    site = shapely.box(0, 0, 600, 300)
    mesh = stretched_mesh(site, 60.0, 1.25, False, np.array([[155.0, 0.0]]))
    (vertex,) = mesh.attracted
    assert mesh.vertices[vertex] == pytest.approx([155, 0], abs=0.01)


def test_square_cells_where_a_block_is_two_of_them():
    site = make_site(shapely.box(0, 0, 500, 300))
    assert len(mesh_choices(site, Specification())) == 5
    assert len(mesh_choices(site, Specification(block_width=60, block_length=110))) == 7
    assert len(mesh_choices(site, Specification(block_width=60, edge_length=50))) == 1


def test_streets_that_wobble_or_are_too_many_count_against_a_plan():
    asked = Specification(block_width=100, block_length=200)
    straight = [np.array([[0.0, 0.0], [100.0, 0.0], [200.0, 0.0]])]
    wobbling = [np.array([[0.0, 0.0], [100.0, 20.0], [200.0, 0.0]])]
    assert street_misfit(straight, 1e5, asked) == 0
    assert street_misfit(wobbling, 1e5, asked) > 0
    # 1 ha needs 150 m
    assert street_misfit(straight, 1e4, asked) == pytest.approx(0.3 * (200 / 150 - 1))
    assert street_misfit([], 1e4, asked) == 0


def test_streets_are_drawn_square_to_an_oblique_edge(monkeypatch):
    # the right side leans by 22 degrees, and straight streets that end there are as much off
    ground = shapely.Polygon([(0, 0), (400, 0), (520, 300), (0, 300)])
    site = make_site(ground)
    mesh = quadrangulate(ground, 100.0)
    level = np.where(mesh.boundary_edges, 0, 3)
    lean = np.array([120.0, 300.0]) / math.hypot(120, 300)

    def skew(drawn):
        found = []
        for way in drawn.chains:
            for end, nxt in ((way[0], way[1]), (way[-1], way[-2])):
                x, y = mesh.vertices[end]
                if mesh.boundary_vertices[end] and abs(x - (400 + 0.4 * y)) < 1:
                    leg = drawn.positions[nxt] - drawn.positions[end]
                    found.append(math.asin(abs(float(leg @ lean)) / float(np.hypot(*leg))))
        assert len(found) == 2
        return math.degrees(np.mean(found))

    drawn = align(site, mesh, level, {})
    monkeypatch.setattr("platwright.streets.align.EDGE_SQUARE", 0.0)
    assert skew(drawn) < skew(align(site, mesh, level, {})) - 1
    moved = np.hypot(*(drawn.positions - mesh.vertices).T)
    assert moved.max() <= REACH * mesh.edge_length + 1e-9
    # ends slide along the edge, and do not leave it
    ends = [way[k] for way in drawn.chains for k in (0, -1)]
    gaps = shapely.distance(shapely.points(drawn.positions[ends]), ground.exterior)
    assert gaps.max() < 0.5


def test_blocks_that_are_no_whole_number_of_widths_long():
    # three by three blocks of 60 x 108 m fit: squares of 60 m would make some of 60 or 120 m
    site = make_site(shapely.box(0, 0, 180, 324))
    asked = Specification(block_width=60, block_length=112, levels=1, time_limit=10)
    (plan,) = design_streets([site], asked).plans
    sizes = sorted({(round(b.width), round(b.length)) for b in plan.blocks})
    assert len(plan.blocks) == 9, sizes
    assert sizes == [(60, 108)]
