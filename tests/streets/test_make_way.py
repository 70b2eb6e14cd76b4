"""Mesh lines step aside for buildings, and nothing else changes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.mesh import grid, quality
from platwright.streets.make_way import make_way

from .conftest import make_site

H = 72.0


def barred(mesh, obstacles) -> int:
    """Inner edges that run through an obstacle for more than two metres."""
    lines = shapely.linestrings(mesh.vertices[mesh.edges[~mesh.boundary_edges]])
    inside = shapely.length(shapely.intersection(lines, shapely.union_all(obstacles)))
    return int((inside > 2.0).sum())


def field(obstacles):
    return make_site(shapely.box(0, 0, 4 * H, 4 * H), obstacles=tuple(obstacles))


def test_a_house_on_a_mesh_line_is_passed_by():
    house = shapely.box(134, 170, 154, 190)
    mesh = grid(4, 4, H)
    moved = make_way(mesh, field([house]))
    assert barred(mesh, [house]) == 1
    assert barred(moved, [house]) == 0
    shift = np.hypot(*(moved.vertices - mesh.vertices).T)
    assert 2 < shift.max() < 20


def test_free_ground_changes_nothing():
    mesh = grid(4, 4, H)
    assert make_way(mesh, field([])) is mesh
    corner = shapely.box(30, 30, 42, 42)
    assert make_way(mesh, field([corner])) is mesh


def test_a_park_wider_than_a_block_is_left_in_place():
    park = shapely.box(80, 80, 210, 210)
    mesh = grid(4, 4, H)
    moved = make_way(mesh, field([park]))
    assert barred(moved, [park]) <= barred(mesh, [park])


def test_held_vertices_stay():
    house = shapely.box(134, 134, 154, 154)
    mesh = grid(4, 4, H)
    centre = int(np.hypot(*(mesh.vertices - 2 * H).T).argmin())
    fixed = np.zeros(len(mesh.vertices), dtype=bool)
    fixed[centre] = True
    moved = make_way(dataclasses.replace(mesh, fixed=fixed), field([house]))
    assert moved.vertices[centre] == pytest.approx([2 * H, 2 * H])


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(
        st.tuples(st.floats(20, 260), st.floats(20, 260), st.floats(6, 40), st.floats(6, 40)),
        min_size=1,
        max_size=6,
    )
)
def test_never_worse_never_inverted(houses):
    obstacles = [shapely.box(x, y, x + w, y + h) for x, y, w, h in houses]
    obstacles = [o for o in obstacles if shapely.box(0, 0, 4 * H, 4 * H).contains(o)]
    mesh = grid(4, 4, H)
    moved = make_way(mesh, field(obstacles))
    edge = mesh.boundary_vertices
    assert (moved.vertices[edge] == mesh.vertices[edge]).all()
    assert quality(moved).inverted == 0
    if obstacles:
        assert barred(moved, obstacles) <= barred(mesh, obstacles)
