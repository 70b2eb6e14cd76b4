"""Patches drawn as polygons become groups of mesh faces."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.mesh.quadmesh import QuadMesh
from platwright.network.examples import paper_problem
from platwright.network.partition import broken_patches
from platwright.network.requirements.links import Link
from platwright.streets.levels import restrict
from platwright.streets.partition import patches_from_polygons
from platwright.streets.preferences import Preferences
from shapely.geometry import Polygon, box

from .conftest import make_site

EDGE = 20.0


def mesh_of(nx=8, ny=6, keep=None) -> QuadMesh:
    """A grid of cells of 20 m x 20 m."""
    plain = grid(nx, ny) if keep is None else grid(nx, ny, keep=keep)
    scale = EDGE / plain.edge_length
    return QuadMesh(plain.vertices * scale, plain.faces, EDGE)


def outline(mesh) -> Polygon:
    """The ground of a mesh."""
    return shapely.union_all(shapely.polygons(mesh.vertices[mesh.faces]))


def divided(mesh, *polygons, site=None):
    """Divide a mesh by polygons with the ids 10, 11, ..."""
    site = site or make_site(outline(mesh))
    drawn = [(polygon, 10 + i) for i, polygon in enumerate(polygons)]
    return patches_from_polygons(mesh, site, Preferences(partition=drawn, partition_layer="Areas"))


def middles(mesh):
    return mesh.vertices[mesh.faces].mean(axis=1)


def test_faces_go_to_the_polygon_that_holds_them():
    mesh = mesh_of()
    patch = divided(mesh, box(0, 0, 67, 120), box(67, 0, 160, 55), box(67, 55, 160, 120))
    x, y = middles(mesh).T
    assert (patch == np.where(x < 67, 0, np.where(y < 55, 1, 2))).all()


def test_one_layer_serves_several_sites():
    # polygons beyond the site, and one that reaches into it with less than a cell
    mesh = mesh_of()
    patch = divided(
        mesh, box(500, 0, 600, 100), box(-90, -50, 84, 200), box(84, 0, 155, 120),
        box(155, -10, 300, 130),
    )  # fmt: skip
    assert sorted(set(patch.tolist())) == [0, 1]
    assert (patch == (middles(mesh)[:, 0] > 84)).all()


def test_slivers_between_and_over_polygons_do_not_matter():
    mesh = mesh_of()
    patch = divided(mesh, box(1, 1, 79, 119), box(78, 0, 119, 120), box(121, 0, 160, 118))
    x = middles(mesh)[:, 0]
    assert (patch == np.searchsorted([79, 120], x)).all()


def test_polygons_that_overlap_are_refused():
    with pytest.raises(InputError, match="overlaps that of feature 12 by 1200 m²") as caught:
        divided(mesh_of(), box(0, 0, 40, 120), box(40, 0, 90, 120), box(80, 0, 160, 120))
    assert (caught.value.layer, caught.value.feature) == ("Areas", 11)
    assert "Cut one of them back" in str(caught.value)


def test_ground_without_a_patch_is_refused():
    with pytest.raises(
        InputError, match="2400 m² of site 1 belong to no patch, at x 150"
    ) as caught:
        divided(mesh_of(), box(0, 0, 60, 120), box(60, 0, 140, 120))
    assert (caught.value.layer, caught.value.feature) == ("Areas", 11)


def test_obstacles_need_no_patch():
    mesh = mesh_of()
    park = box(140, 0, 160, 120)
    site = make_site(outline(mesh), obstacles=(park,))
    patch = divided(mesh, box(0, 0, 60, 120), box(60, 0, 140, 120), site=site)
    x = middles(mesh)[:, 0]
    assert (patch == np.select([x < 60, x < 140], [0, 1], -1)).all()


def test_a_patch_smaller_than_a_cell_is_refused():
    mesh = mesh_of()
    tiny = box(36, 36, 44, 44)
    rest = outline(mesh).difference(tiny)
    with pytest.raises(
        InputError, match="holds no cell of the mesh, whose edges are 20 m"
    ) as caught:
        divided(mesh, rest, tiny)
    assert (caught.value.layer, caught.value.feature) == ("Areas", 11)


def test_a_patch_in_two_pieces_is_refused():
    # a U-shaped site: a polygon across the gap holds both arms
    mesh = mesh_of(9, 6, keep=lambda i, j: not (3 <= i < 6 and j >= 2))
    with pytest.raises(InputError, match="not in one piece") as caught:
        divided(mesh, box(0, 0, 180, 60), box(0, 60, 180, 120))
    assert (caught.value.layer, caught.value.feature) == ("Areas", 11)


def test_a_crumb_goes_to_the_neighbour():
    # a narrow neck leaves one cell of the first polygon behind the second
    mesh = mesh_of()
    neck = box(0, 0, 80, 120).union(box(80, 68, 160, 74))
    tip = box(140, 60, 160, 80)
    first = neck.union(tip)
    second = outline(mesh).difference(first)
    south, north = second.geoms
    patch = divided(mesh, first, south, north)
    assert not broken_patches(mesh, patch)
    assert set(patch.tolist()) == {0, 1, 2}
    x, y = middles(mesh).T
    assert patch[(x > 140) & (y > 60) & (y < 80)] != 0


def test_patches_of_another_site_are_refused():
    with pytest.raises(InputError, match="No patch lies in site 1"):
        divided(mesh_of(), box(500, 500, 600, 600))


def test_a_part_of_a_site_keeps_the_links_that_it_can_make():
    mesh = grid(6, 3)
    problem = paper_problem(mesh)
    x, y = mesh.vertices.T
    ends = [int(np.flatnonzero((x == i) & (y == 1))[0]) for i in (1, 2, 5)]
    near, far = (Link(ends[0], other, 4.0, hops=True) for other in ends[1:])
    problem = dataclasses.replace(problem, requirements=(near, far))
    west = np.flatnonzero(middles(mesh)[:, 0] < 3)
    assert restrict(problem, frozenset(west.tolist())).requirements == (near,)
    assert restrict(problem, frozenset(range(len(mesh.faces)))).requirements == (near, far)
