"""The mesh class on shapes small enough to count by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.mesh import QuadMesh, fan, grid


@pytest.fixture(scope="module")
def two_by_two():
    # 6 7 8
    # 3 4 5
    # 0 1 2
    return grid(2, 2, 10.0)


def test_edges_are_sorted_and_counted(two_by_two):
    assert two_by_two.edges.tolist() == [
        [0, 1], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 6], [4, 5], [4, 7], [5, 8], [6, 7],
        [7, 8],
    ]  # fmt: skip
    assert two_by_two.boundary_edges.sum() == 8
    assert two_by_two.boundary_vertices.tolist() == [True] * 4 + [False] + [True] * 4
    assert two_by_two.valences.tolist() == [2, 3, 2, 3, 4, 3, 2, 3, 2]
    assert two_by_two.lengths.tolist() == [10.0] * 12


def test_faces_know_their_edges_and_neighbours(two_by_two):
    assert two_by_two.faces[0].tolist() == [0, 1, 4, 3]
    assert two_by_two.face_edges[0].tolist() == [0, 3, 5, 1]
    assert two_by_two.edge_faces[3].tolist() == [0, 1]
    assert two_by_two.edge_faces[0].tolist() == [0, -1]
    half = 4 * 0 + 1  # 1 -> 4 in face 0; its twin is 4 -> 1 in face 1, side 3
    assert two_by_two.twins[half] == 4 * 1 + 3
    assert two_by_two.twins[4 * 1 + 3] == half
    assert two_by_two.twins[0] == -1


def test_fans_run_counter_clockwise(two_by_two):
    between = two_by_two.edge_between
    assert two_by_two.vertex_edges[1].tolist() == [between(1, 2), between(1, 4), between(0, 1)]
    inner = two_by_two.vertex_edges[4].tolist()
    ring = [between(4, 5), between(4, 7), between(3, 4), between(1, 4)]
    start = ring.index(inner[0])
    assert inner == ring[start:] + ring[:start]


def test_edge_between(two_by_two):
    assert two_by_two.edge_between(4, 1) == two_by_two.edge_between(1, 4) == 3
    assert two_by_two.edge_between(0, 4) == -1


def test_opposite_pairs(two_by_two):
    pairs = two_by_two.opposite_pairs()
    assert pairs.shape == (8, 2)
    assert pairs[:2].tolist() == [[0, 5], [3, 1]]


def test_strips_of_a_grid(two_by_two):
    strips = [s.tolist() for s in two_by_two.strips()]
    between = two_by_two.edge_between
    assert [between(0, 1), between(3, 4), between(6, 7)] in strips
    assert len(strips) == 4
    assert sorted(e for s in strips for e in s) == list(range(12))


def test_closed_strip_repeats_its_first_rung():
    ring = grid(3, 3, keep=lambda i, j: (i, j) != (1, 1))
    closed = [s for s in ring.strips() if s[0] == s[-1]]
    # the four corner quads turn the strip through opposite sides: it leaves the ring
    assert closed == []
    angle = np.arange(6) * np.pi / 3
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    faces = [[k, k + 6, (k + 1) % 6 + 6, (k + 1) % 6] for k in range(6)]
    annulus = QuadMesh(np.vstack([circle, 2 * circle]), np.array(faces), 1.0)
    closed = [s for s in annulus.strips() if s[0] == s[-1]]
    assert len(closed) == 1
    assert len(closed[0]) == 7
    assert len(annulus.strips()) == 7


def test_continuations(two_by_two):
    between = two_by_two.edge_between
    assert two_by_two.continuation(4, between(3, 4)) == between(4, 5)
    assert two_by_two.continuation(1, between(0, 1)) == between(1, 2)
    assert two_by_two.continuation(1, between(1, 4)) == -1
    assert two_by_two.continuation(0, between(0, 1)) == -1
    with pytest.raises(InputError, match="does not touch"):
        two_by_two.continuation(0, between(7, 8))


def test_continuations_at_a_reflex_corner():
    corner = grid(2, 2, keep=lambda i, j: (i, j) != (1, 1))
    # 6 7
    # 3 4 5
    # 0 1 2
    between = corner.edge_between
    assert corner.valences[4] == 4
    assert corner.boundary_vertices[4]
    assert corner.continuation(4, between(4, 5)) == between(3, 4)
    assert corner.continuation(4, between(1, 4)) == between(4, 7)


def test_nothing_continues_at_irregular_vertices():
    star = fan(5)
    assert star.valences[0] == 5
    assert star.continuation(0, int(star.vertex_edges[0][0])) == -1


def test_arcs_give_length_and_line():
    arc = np.array([[0.0, 0], [0.5, -1], [1, 0]])
    mesh = QuadMesh(
        np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]),
        np.array([[0, 1, 2, 3]]),
        1.0,
        boundary_arcs={0: arc},
    )
    assert mesh.lengths[0] == pytest.approx(2 * np.hypot(0.5, 1))
    assert mesh.edge_line(0).tolist() == arc.tolist()
    assert mesh.edge_line(3).tolist() == [[1, 1], [0, 1]]


def test_defaults_and_read_only(two_by_two):
    assert not two_by_two.fixed.any()
    assert not two_by_two.foreign.any()
    assert (two_by_two.parent_edges == -1).all()
    assert (two_by_two.parent_vertices == -1).all()
    assert two_by_two.attracted == {}
    with pytest.raises(ValueError, match="read-only"):
        two_by_two.vertices[0] = 1


SQUARE = [[0.0, 0], [1, 0], [1, 1], [0, 1]]


@pytest.mark.parametrize(
    ("vertices", "faces", "text"),
    [
        (SQUARE, [[0, 1, 2, 4]], "do not exist"),
        (SQUARE, [[0, 1, 2, 2]], "twice"),
        ([*SQUARE, [9, 9]], [[0, 1, 2, 3]], "belongs to no face"),
        (SQUARE, [[0, 1, 2, 3], [0, 1, 2, 3]], "opposite directions"),
        ([[0.0, np.nan], *SQUARE[1:]], [[0, 1, 2, 3]], "finite"),
        (SQUARE, [[0, 1, 2]], r"\(m, 4\)"),
    ],
)
def test_bad_arrays_are_refused(vertices, faces, text):
    with pytest.raises(InputError, match=text):
        QuadMesh(np.array(vertices), np.array(faces), 1.0)


def test_neighbours_of_opposite_orientation_are_refused():
    vertices = grid(2, 1).vertices
    with pytest.raises(InputError, match="opposite directions"):
        QuadMesh(vertices, np.array([[0, 1, 4, 3], [1, 4, 5, 2]]), 1.0)


def test_three_faces_at_an_edge_are_refused():
    vertices = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1], [0, 2], [1, 2], [0, 3], [1, 3]])
    with pytest.raises(InputError, match="more than two faces"):
        QuadMesh(vertices, np.array([[0, 1, 3, 2], [0, 1, 5, 4], [1, 0, 6, 7]]), 1.0)


def test_parts_that_touch_at_a_vertex_are_refused():
    with pytest.raises(InputError, match="touch only at vertex"):
        grid(2, 2, keep=lambda i, j: (i + j) % 2 == 0)


def test_wrong_lengths_and_arcs_are_refused():
    faces = np.array([[0, 1, 2, 3]])
    with pytest.raises(InputError, match="'fixed' has shape"):
        QuadMesh(np.array(SQUARE), faces, 1.0, fixed=np.ones(3, dtype=bool))
    with pytest.raises(InputError, match="not on the boundary"):
        QuadMesh(np.array(SQUARE), faces, 1.0, boundary_arcs={7: np.zeros((2, 2))})
    with pytest.raises(InputError, match="greater than 0"):
        QuadMesh(np.array(SQUARE), faces, 0.0)


@given(st.integers(1, 7), st.integers(1, 7))
def test_grid_counts(nx, ny):
    mesh = grid(nx, ny)
    assert len(mesh.faces) == nx * ny
    assert len(mesh.edges) == nx * (ny + 1) + ny * (nx + 1)
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.faces) == 1
    assert len(mesh.strips()) == nx + ny
    assert (np.bincount(mesh.face_edges.ravel()) == 2 - mesh.boundary_edges).all()


@given(st.integers(3, 8), st.integers(1, 4))
def test_fan_counts(count, k):
    mesh = fan(count, k)
    assert len(mesh.faces) == count * k**2
    assert mesh.valences[0] == count
    inner = ~mesh.boundary_vertices
    inner[0] = False
    assert (mesh.valences[inner] == 4).all()


def test_paper_sizes():
    assert [len(grid(n, n).edges) for n in (12, 22, 24)] == [312, 1012, 1200]


def test_grids_refuse_nothing():
    with pytest.raises(InputError, match="at least one square"):
        grid(0, 3)
    with pytest.raises(InputError, match="No square"):
        grid(2, 2, keep=lambda *_: False)
    with pytest.raises(InputError, match="at least three"):
        fan(2)
