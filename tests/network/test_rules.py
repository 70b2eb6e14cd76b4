"""The planner's rules on meshes that can be checked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from platwright.mesh import QuadMesh, grid
from platwright.network import rules
from platwright.network.coverage import coverage_balls


def everything(mesh):
    return np.ones(len(mesh.edges), dtype=bool)


def inner(mesh):
    return ~mesh.boundary_edges


def ring(count: int = 12, radius: float = 150.0, width: float = 72.0) -> QuadMesh:
    """A closed row of quads."""
    angle = 2 * np.pi * np.arange(count) / count
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    vertices = np.vstack([circle * radius, circle * (radius + width)])
    here, following = np.arange(count), (np.arange(count) + 1) % count
    faces = np.column_stack([here, here + count, following + count, following])
    return QuadMesh(vertices, faces, width)


def test_windows_ask_for_a_street_within_the_block_length():
    mesh = grid(5, 1, 70.0)
    # five cells in a row, blocks of at most two cells: of two neighbouring rungs one is on
    clauses = rules.block_length_windows(mesh, inner(mesh), 150.0, 1.0)
    rungs = [e for e in range(len(mesh.edges)) if inner(mesh)[e]]
    middles = {e: mesh.vertices[mesh.edges[e]].mean(axis=0)[0] for e in rungs}
    found = sorted(tuple(sorted(round(middles[e]) for e in c.edges)) for c in clauses)
    assert found == [(70, 140), (140, 210), (210, 280)]


def test_windows_reach_over_the_seam_of_a_ring():
    mesh = ring()
    strip = max(mesh.strips(), key=len)
    assert strip[0] == strip[-1]
    clauses = rules.block_length_windows(mesh, everything(mesh), 296.0, 1.0)
    windows = [c for c in clauses if set(c.edges) <= set(strip.tolist())]
    assert len(windows) == 12
    assert {len(c.edges) for c in windows} == {3}


def test_corners_forbid_blocks_two_cells_wide():
    mesh = grid(2, 2, 70.0)
    closed = np.zeros(len(mesh.edges), dtype=bool)
    clauses = rules.block_width_corners(mesh, inner(mesh), closed, 70.0, 1.0)
    # the middle vertex is a corner of four cells; elsewhere boundary edges cannot be chosen
    pairs = {c.edges for c in clauses if len(c.edges) == 2}
    assert len(pairs) == 4


def test_an_existing_street_is_continued_straight_on():
    mesh = grid(3, 3, 70.0)
    v = int(np.flatnonzero((mesh.vertices == [70.0, 0.0]).all(axis=1))[0])
    (clause,) = rules.continuations(mesh, {v: (0.1, 0.99)}, inner(mesh), 2.0)
    (edge,) = clause.edges
    assert mesh.vertices[mesh.edges[edge]].tolist() == [[70.0, 0.0], [70.0, 70.0]]
    assert rules.continuations(mesh, {v: (1.0, 0.0)}, inner(mesh), 2.0) == []


def test_straight_streets_cost_nothing_bends_two_ends():
    mesh = grid(2, 2, 70.0)
    patterns = rules.straightness(mesh, inner(mesh), inner(mesh), end_weight=1.0, bend_weight=0.5)
    spokes = {e: mesh.vertices[mesh.edges[e]].mean(axis=0) for e in np.flatnonzero(inner(mesh))}
    west, east, south = (
        next(e for e, m in spokes.items() if tuple(m) == at)
        for at in ((35, 70), (105, 70), (70, 35))
    )

    def cost(active):
        return sum(p.weight for p in patterns if set(p.on) <= active and not set(p.off) & active)

    assert cost({west, east}) == 0
    assert cost({west, south}) == pytest.approx(2 * 1.0 + 0.5)
    assert cost({west, east, south}) == pytest.approx(1.0)
    assert cost(set(spokes)) == 0


def test_balls_by_edges_and_by_metres():
    mesh = grid(4, 4, 10.0)
    centre = (
        12
        if tuple(mesh.vertices[12]) == (20.0, 20.0)
        else int(np.flatnonzero((mesh.vertices == [20.0, 20.0]).all(axis=1))[0])
    )
    none = np.zeros(len(mesh.vertices), dtype=bool)
    assert len(coverage_balls(mesh, [centre], none, edges=1)[centre]) == 5
    assert len(coverage_balls(mesh, [centre], none, metres=20.0)[centre]) == 13
    covered = none.copy()
    covered[centre] = True
    assert coverage_balls(mesh, [centre], covered, edges=1) == {}


def test_a_small_cell_inside_is_priced_one_in_an_arm_is_not():
    mesh = grid(3, 1, 40.0)
    wide = grid(3, 3, 40.0)
    assert rules.small_blocks(mesh, everything(mesh), inner(mesh), 72.0, 4.0) == []
    assert len(rules.small_blocks(wide, everything(wide), inner(wide), 72.0, 4.0)) == 5
