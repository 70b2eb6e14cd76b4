"""Subdivision: counts, parents, arcs, flags."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.mesh import QuadMesh, fan, grid, subdivide


@given(st.integers(1, 4), st.integers(1, 4), st.integers(1, 3))
def test_every_face_becomes_four(nx, ny, rounds):
    mesh = coarse = grid(nx, ny, 8.0)
    for _ in range(rounds):
        mesh = subdivide(mesh)
    assert len(mesh.faces) == 4**rounds * nx * ny
    assert mesh.edge_length == 8.0 / 2**rounds
    assert mesh.lengths == pytest.approx(8.0 / 2**rounds)
    assert (mesh.vertices[: len(coarse.vertices)] == coarse.vertices).all()


def test_irregular_vertices_stay_the_only_ones():
    fine = subdivide(subdivide(fan(5)))
    inner = ~fine.boundary_vertices
    assert (fine.valences[inner] != 4).sum() == 1
    assert fine.valences[0] == 5


def test_parents():
    coarse = grid(2, 1)
    fine = subdivide(coarse)
    n, e = len(coarse.vertices), len(coarse.edges)
    assert fine.parent_vertices.tolist() == [*range(n), *[-1] * (e + 2)]
    assert np.bincount(fine.parent_edges[fine.parent_edges >= 0]).tolist() == [2] * e
    for i, parent in enumerate(fine.parent_edges.tolist()):
        if parent >= 0:
            assert fine.edges[i, 1] == n + parent
            assert fine.edges[i, 0] in coarse.edges[parent]


def bent() -> QuadMesh:
    """Return two quads; the lower side of the first is bent: 3 m along x, then up 1 m."""
    vertices = np.array([[0.0, 0], [3, 1], [6, 0], [0, 4], [3, 4], [6, 4]])
    faces = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
    arc = np.array([[0.0, 0], [3, 0], [3, 1]])
    return QuadMesh(
        vertices,
        faces,
        3.0,
        boundary_arcs={0: arc},
        fixed=np.array([True, *[False] * 5]),
        foreign=np.array([True, *[False] * 6]),
        attracted={1: 4},
    )


def test_middles_lie_on_arcs_and_chords():
    coarse = bent()
    fine = subdivide(coarse)
    assert fine.vertices[6].tolist() == [2.0, 0.0]  # half of 4 m along the arc
    inner = coarse.edge_between(1, 4)
    assert fine.vertices[6 + inner].tolist() == [3.0, 2.5]
    first, second = fine.edge_between(0, 6), fine.edge_between(1, 6)
    assert fine.edge_line(first).tolist() == [[0, 0], [2, 0]]
    assert fine.edge_line(second).tolist() == [[3, 1], [3, 0], [2, 0]]
    assert fine.lengths[[first, second]].tolist() == [2.0, 2.0]
    assert subdivide(fine).lengths[subdivide(fine).boundary_edges].sum() == pytest.approx(
        coarse.lengths[coarse.boundary_edges].sum()
    )


def test_flags_are_carried_on():
    fine = subdivide(bent())
    halves = fine.parent_edges == 0
    assert fine.foreign[halves].all()
    assert not fine.foreign[~halves].any()
    assert fine.fixed.tolist() == [True] + [False] * (len(fine.fixed) - 1)
    assert fine.attracted == {1: 4}


def test_new_edges_between_foreign_ones_are_foreign():
    coarse = grid(1, 1, 100.0)
    left, right = coarse.edge_between(0, 2), coarse.edge_between(1, 3)
    flags = np.isin(np.arange(4), [left, right])
    fine = subdivide(QuadMesh(coarse.vertices, coarse.faces, 100.0, foreign=flags))
    upright = np.abs(np.diff(fine.vertices[fine.edges][..., 0], axis=1)).ravel() < 1e-9
    assert (fine.foreign == upright).all()


def test_a_site_decides_about_new_edges():
    coarse = grid(1, 1, 100.0)
    site = shapely.box(0, 0, 100, 100) - shapely.box(40, 40, 60, 60)
    fine = subdivide(coarse, site)
    centre = len(fine.vertices) - 1
    assert (fine.foreign == (fine.edges == centre).any(axis=1)).all()
