"""Partitions of meshes into patches, and the links that follow from them."""

import dataclasses
import math
import time

import networkx as nx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.mesh.grids import fan, grid
from platwright.network.examples import paper_problem
from platwright.network.partition import (
    adjacent_patches,
    broken_patches,
    face_areas,
    link_limit,
    patches,
    point_to_point,
    sample_vertices,
)

SOME = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def face_graph(mesh) -> nx.Graph:
    """Join faces that have two vertices in common."""
    graph = nx.Graph()
    at = {}
    for f, quad in enumerate(mesh.faces.tolist()):
        graph.add_node(f)
        for k in range(4):
            side = frozenset((quad[k], quad[(k + 1) % 4]))
            for g in at.setdefault(side, []):
                graph.add_edge(f, g)
            at[side].append(f)
    return graph


@SOME
@given(data=st.data())
def test_patches_are_connected_and_of_about_the_wished_size(small, data):
    mesh = small.draw_mesh(data)
    size = data.draw(st.sampled_from([1, 2, 5, 8, 13, 500]))
    patch = patches(mesh, size, seed=data.draw(st.integers(0, 99)))
    assert patch.shape == (len(mesh.faces),)
    held = np.bincount(patch)
    count = max(1, round(len(mesh.faces) / size))
    assert len(held) == count
    graph = face_graph(mesh)
    for number in range(count):
        assert nx.is_connected(graph.subgraph(np.flatnonzero(patch == number).tolist()))
    mean = len(mesh.faces) / count
    assert held.min() >= 0.5 * mean - 1
    assert held.max() <= 1.5 * mean + 1
    # numbered in the order of their first faces
    firsts = [int(np.flatnonzero(patch == number)[0]) for number in range(count)]
    assert firsts == sorted(firsts)


def test_patches_of_a_square_grid_are_squares():
    patch = patches(grid(12, 12), 16).reshape(12, 12)
    expected = np.kron(np.arange(9).reshape(3, 3), np.ones((4, 4), dtype=int))
    assert (patch == expected).all()


def test_the_same_seed_makes_the_same_patches():
    mesh = grid(17, 11)
    assert (patches(mesh, 14, seed=3) == patches(mesh, 14, seed=3)).all()


def test_patches_share_out_weights_and_not_faces():
    mesh = grid(20, 10)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    weight = np.where(x < 10, 3.0, 1.0)  # dense in the west
    patch = patches(mesh, 40.0, weight=weight)
    held = np.bincount(patch, weights=weight)
    assert len(held) == 10
    assert held.min() >= 30
    assert held.max() <= 50
    assert np.bincount(patch).max() >= 1.8 * np.bincount(patch).min()


def test_parts_of_a_mesh_that_do_not_touch_share_no_patch():
    mesh = grid(9, 4, keep=lambda i, _: i != 4)
    patch = patches(mesh, 8)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    assert not set(patch[x < 4]) & set(patch[x > 5])
    assert not broken_patches(mesh, patch)


def test_broken_patches_are_found():
    mesh = grid(5, 1)
    assert broken_patches(mesh, np.array([0, 1, 0, 2, 2])) == [0]
    assert broken_patches(mesh, np.array([-1, 1, -1, 2, 2])) == []


@pytest.mark.parametrize("size", [0, -3, math.nan, math.inf])
def test_impossible_sizes_are_refused(size):
    with pytest.raises(InputError, match="size"):
        patches(grid(3, 3), size)


def test_impossible_weights_are_refused():
    with pytest.raises(InputError, match="9 numbers"):
        patches(grid(3, 3), 2, weight=np.ones(4))
    with pytest.raises(InputError, match="at least 0"):
        patches(grid(3, 3), 2, weight=-np.ones(9))


def test_face_areas_are_those_of_the_cells():
    mesh = fan(5, 2)
    assert face_areas(grid(3, 2)) == pytest.approx(np.ones(6) * grid(3, 2).edge_length ** 2)
    corners = mesh.vertices[mesh.faces[0]]
    a, b = corners[2] - corners[0], corners[3] - corners[1]
    assert face_areas(mesh)[0] == pytest.approx(abs(a[0] * b[1] - a[1] * b[0]) / 2)


@SOME
@given(data=st.data())
def test_sampled_vertices_lie_in_their_patch_alone_where_they_can(small, data):
    mesh = small.draw_mesh(data)
    patch = patches(mesh, data.draw(st.sampled_from([1, 4, 9])))
    patch[patch == data.draw(st.integers(0, 3))] = -1
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    able = rng.random(len(mesh.vertices)) < 0.7
    drawn = sample_vertices(mesh, patch, able, seed=data.draw(st.integers(0, 99)))
    owners = {v: set() for v in range(len(mesh.vertices))}
    for f, quad in enumerate(mesh.faces.tolist()):
        for v in quad:
            owners[v].add(int(patch[f]))
    for v in owners:
        owners[v].discard(-1)
    for number, v in enumerate(drawn.tolist()):
        mine = [w for w, own in owners.items() if number in own and able[w]]
        alone = [w for w in mine if owners[w] == {number}]
        assert (v in (alone or mine)) if mine else v == -1


def test_links_join_adjacent_patches_within_the_tolerance():
    mesh = grid(12, 12)
    problem = paper_problem(mesh, "inner")
    patch = patches(mesh, 16)
    # three by three squares, that do not touch at their corners only
    assert len(adjacent_patches(mesh, patch)) == 12
    links = point_to_point(problem, patch, seed=4)
    assert len(links) == 12
    x, y = mesh.vertices.T
    for link in links:
        apart = abs(x[link.start] - x[link.end]) + abs(y[link.start] - y[link.end])
        assert link.limit == pytest.approx(apart / mesh.edge_length + 2)
        assert link.hops
        assert not link.private
        assert link.hard
    assert point_to_point(problem, patch, seed=4) == links
    assert point_to_point(problem, patch, seed=5) != links


def test_links_in_metres_and_shares():
    mesh = grid(8, 4)
    problem = paper_problem(mesh, "inner")
    problem = dataclasses.replace(problem, length=1.5 * problem.length)
    patch = patches(mesh, 16)
    (hops,) = point_to_point(problem, patch, tolerance=0)
    (share,) = point_to_point(problem, patch, tolerance=0.2, measure="share", penalty=3.0)
    (metres,) = point_to_point(
        problem, patch, tolerance=2 * mesh.edge_length, measure="metres", penalty=3.0
    )
    assert share.limit == pytest.approx(hops.limit * 1.5 * 1.2)
    assert metres.limit == pytest.approx(hops.limit * 1.5 + 2)
    assert (share.hops, share.penalty, hops.hops) == (False, 3.0, True)
    with pytest.raises(InputError, match="tolerance"):
        link_limit(3.0, -1.0, "hops", 1.0)


def test_patches_where_no_street_can_be_have_no_links():
    mesh = grid(8, 4)
    problem = paper_problem(mesh, "inner")
    x = mesh.vertices[:, 0]
    problem = dataclasses.replace(
        problem, candidate=problem.candidate & (x[mesh.edges] <= 3).all(axis=1)
    )
    assert point_to_point(problem, patches(mesh, 16)) == []


def test_a_partition_of_another_mesh_is_refused():
    with pytest.raises(InputError, match="12 faces, the mesh has 9"):
        point_to_point(paper_problem(grid(3, 3)), patches(grid(4, 3), 4))


@pytest.mark.slow
def test_large_meshes_are_divided_in_seconds():
    mesh = grid(100, 100)
    began = time.process_time()
    patch = patches(mesh, 64)
    assert time.process_time() - began < 20
    held = np.bincount(patch)
    assert held.min() >= 50
    assert held.max() <= 80
