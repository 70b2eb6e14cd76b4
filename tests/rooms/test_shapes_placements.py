"""Where shapes fit on meshes: against coordinates on grids, by counting elsewhere."""

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.mesh.grids import fan, grid
from platwright.mesh.quadmesh import QuadMesh
from platwright.rooms.shapes import enumerate_placements, orientations, shipped_templates
from platwright.rooms.shapes.text import parse_templates
from platwright.rooms.types import Template

from .shape_oracle import fits_by_coordinates, pinched, polyominoes, poses, templates


def shape(*rows, **values):
    """Make a template from rows, from top to bottom."""
    high = len(rows)
    cells = {(x, high - 1 - y) for y, r in enumerate(rows) for x, c in enumerate(r) if c == "#"}
    return Template(values.pop("name", "any"), frozenset(cells), **values)


def all_faces(mesh):
    return np.ones(len(mesh.faces), dtype=bool)


def fits(mesh, template, allowed=None, **options):
    """Enumerate one template; refuse doubles."""
    allowed = all_faces(mesh) if allowed is None else allowed
    faces = enumerate_placements(mesh, [template], allowed, **options).faces
    assert len(set(faces)) == len(faces)
    return set(faces)


def rolled(mesh, starts):
    """Number the sides of every face from another corner."""
    rows = [np.roll(face, k % 4) for face, k in zip(mesh.faces, starts)]
    return QuadMesh(mesh.vertices, np.array(rows), mesh.edge_length)


def bent(mesh, function):
    """Move the vertices of a mesh."""
    return QuadMesh(function(mesh.vertices), mesh.faces, mesh.edge_length)


BLOCK, PAIR = shape("##", "##"), shape("##")
CORNER, RING = shape("#.", "##"), shape("###", "#.#", "###")
TEE, HOOK = shape("###", ".#."), shape("#.#", "###")


@settings(max_examples=150)
@given(templates, st.integers(1, 6), st.integers(1, 6), st.data())
@example(RING, 5, 4, None)
def test_the_same_as_by_coordinates_on_parts_of_grids(template, nx, ny, data):
    squares = [(x, y) for x in range(nx) for y in range(ny)]
    out = data.draw(st.sets(st.sampled_from(squares), max_size=4)) if data else {(2, 1)}
    try:
        mesh = grid(nx, ny, keep=lambda x, y: (x, y) not in out)
    except InputError:  # nothing left, or squares that touch in a corner only
        assume(False)
    m = len(mesh.faces)
    allowed = np.array(
        data.draw(st.lists(st.sampled_from([True, True, True, False]), min_size=m, max_size=m))
        if data
        else [True] * m
    )
    starts = data.draw(st.lists(st.integers(0, 3), min_size=m, max_size=m)) if data else [0] * m
    expected = fits_by_coordinates(mesh, template, allowed)
    assert fits(rolled(mesh, starts), template, allowed) == expected
    # Where a grid is regular there is nothing to tolerate.
    assert fits(mesh, template, allowed, irregular=False) == expected
    if data is None:
        assert expected


@given(templates)
def test_orientations_are_those_of_matrices(template):
    found = orientations(template)
    assert set(found) == poses(template)
    assert len(set(found)) == len(found)


@settings(max_examples=60)
@given(polyominoes(), st.booleans(), st.floats(-3, 3), st.floats(0, 0.19))
def test_sheared_and_curved_grids_hold_the_same(cells, mirror, shear, curl):
    template = Template("any", cells, mirror=mirror)
    straight = grid(6, 5)

    def move(points):
        x, y = points.T
        x, angle = x + shear * y, curl * points[:, 0]
        return np.column_stack([(9 + y) * np.sin(angle) + x, (9 + y) * np.cos(angle)])

    assert fits(bent(straight, move), template) == fits_by_coordinates(
        straight, template, all_faces(straight)
    )


@pytest.mark.parametrize(("degrees", "quarters"), [(0, 0), (30, 0), (60, 1), (100, 1), (200, 2)])
def test_turned_maps_turn_the_drawing(degrees, quarters):
    # Seen from east a grid that is turned by 60 degrees is nearer to a quarter turn than to none.
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    mesh = grid(4, 3)
    drawn = shape("#..", "###", rotations=(0,), mirror=False)
    on_grid = Template("any", drawn.cells, ((-quarters) % 4,), False)
    assert fits(bent(mesh, lambda p: p @ turn), drawn) == fits_by_coordinates(
        mesh, on_grid, all_faces(mesh)
    )


def test_halfway_between_two_turns_counts_as_both():
    turn = np.array([[1.0, 1.0], [-1.0, 1.0]])
    mesh = grid(3, 3)
    flat = shape("###", rotations=(0,))
    assert len(fits(mesh, flat)) == 3
    assert len(fits(bent(mesh, lambda p: p @ turn), flat)) == 6


def counts_by_vertices(mesh):
    """Count pairs, blocks and corners from valences alone."""
    inside = ~mesh.boundary_vertices
    around = np.bincount(mesh.faces.ravel(), minlength=len(mesh.vertices))
    corners = np.where(inside, np.where(around == 3, 1, around), np.maximum(around - 2, 0))
    return {
        "pairs": int((~mesh.boundary_edges).sum()),
        "blocks": int((inside & (mesh.valences == 4)).sum()),
        "corners": int(corners.sum()),
        "open corners": int(corners[~(inside & (around == 3))].sum()),
    }


@pytest.mark.parametrize("valence", [3, 4, 5, 6])
@pytest.mark.parametrize("k", [1, 2, 3])
def test_around_irregular_vertices(valence, k):
    mesh = fan(valence, k)
    expected = counts_by_vertices(mesh)
    assert len(fits(mesh, PAIR)) == expected["pairs"]
    assert len(fits(mesh, BLOCK)) == expected["blocks"]
    assert len(fits(mesh, CORNER)) == expected["corners"]
    assert len(fits(mesh, CORNER, irregular=False)) == expected["open corners"]


def test_three_faces_around_a_vertex_are_a_corner_room_with_three_inner_edges():
    mesh = fan(3)
    found = enumerate_placements(mesh, [CORNER], all_faces(mesh))
    assert found.faces == ((0, 1, 2),)
    assert [mesh.edges[e].tolist()[0] for e in found.inner[0]] == [0, 0, 0]
    assert len(found.rim[0]) == 6
    assert enumerate_placements(mesh, [CORNER], all_faces(mesh), irregular=False).faces == ()


def test_no_block_leaves_a_wedge_open():
    assert fits(fan(3), BLOCK) == fits(fan(5), BLOCK) == set()
    # 3 x 2 needs two regular vertices that an edge joins; those of a fan lie off its centre.
    mesh = fan(5, 3)
    regular = ~mesh.boundary_vertices & (mesh.valences == 4)
    assert len(fits(mesh, shape("###", "###"))) == int(regular[mesh.edges].all(axis=1).sum())


@settings(max_examples=80)
@given(polyominoes(6), st.sampled_from([3, 5, 6]), st.booleans())
@example(HOOK.cells, 3, True)
def test_rooms_on_irregular_meshes_are_whole(cells, valence, irregular):
    assume(not pinched(cells))
    mesh = fan(valence, 3)
    squares = shapely.union_all([shapely.box(x, y, x + 1, y + 1) for x, y in cells])
    pairs = sum((x + 1, y) in cells for x, y in cells) + sum((x, y + 1) in cells for x, y in cells)
    template = Template("any", cells)
    found = enumerate_placements(mesh, [template], all_faces(mesh), irregular=irregular)
    assert found.faces
    polygons = shapely.polygons(mesh.vertices[mesh.faces])
    for faces, inner, rim in zip(found.faces, found.inner, found.rim):
        room = shapely.union_all(polygons[list(faces)], grid_size=1e-9)
        assert room.geom_type == "Polygon"
        assert room.is_valid
        assert len(room.interiors) == len(squares.interiors)
        assert len(set(faces)) == len(faces) == len(cells)
        members = np.isin(mesh.edge_faces, faces).sum(axis=1)
        assert inner == tuple(np.flatnonzero(members == 2).tolist())
        assert rim == tuple(np.flatnonzero(members == 1).tolist())
        assert len(inner) == pairs or (irregular and len(inner) > pairs)


def test_a_strip_does_not_close_to_a_ring():
    angle = np.arange(4) * np.pi / 2
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    k = np.arange(4)
    faces = np.column_stack([k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4])
    mesh = QuadMesh(np.vstack([circle, 2 * circle]), faces, 1.0)
    assert len(fits(mesh, shape("##"))) == len(fits(mesh, shape("###"))) == 4
    assert fits(mesh, shape("####")) == fits(mesh, shape("#####")) == set()


def test_templates_share_faces_only_where_it_makes_a_difference():
    pair = PAIR.cells
    one, same = Template("one", pair), Template("same", pair, colour="#123456")
    other, few = Template("other", pair, use="store"), Template("few", pair, most=1)
    few_too = Template("few too", pair, most=1)
    mesh = grid(2, 1)
    found = enumerate_placements(mesh, [one, same, other, few, few_too], all_faces(mesh))
    assert found.template.tolist() == [0, 2, 3, 4]
    assert found.faces == ((0, 1),) * 4


def test_order_is_by_template_then_faces():
    mesh = grid(4, 3)
    found = enumerate_placements(mesh, [TEE, PAIR, BLOCK], all_faces(mesh))
    keys = list(zip(found.template.tolist(), found.faces))
    assert keys == sorted(keys)
    assert set(found.template.tolist()) == {0, 1, 2}


def test_nothing_fits_and_nothing_asked():
    mesh = grid(2, 2)
    for kinds, allowed in [
        ([RING], all_faces(mesh)),
        ([], all_faces(mesh)),
        ([PAIR], np.zeros(4, bool)),
    ]:
        found = enumerate_placements(mesh, kinds, allowed)
        assert found.template.dtype == np.int64
        assert (len(found.template), found.faces, found.inner, found.rim) == (0, (), (), ())


def test_wrong_input_is_told():
    mesh = grid(2, 2)
    with pytest.raises(InputError, match=r"'allowed' has shape \(3,\), expected \(4,\)"):
        enumerate_placements(mesh, [PAIR], np.ones(3, dtype=bool))
    with pytest.raises(InputError, match="'apart' is no connected shape"):
        enumerate_placements(
            mesh, [Template("apart", frozenset({(0, 0), (1, 1)}))], all_faces(mesh)
        )
    with pytest.raises(InputError, match="no connected shape"):
        enumerate_placements(mesh, [Template("none", frozenset())], all_faces(mesh))


def test_it_stops_where_it_is_told_to():
    def stop():
        raise CancelledError

    with pytest.raises(CancelledError):
        enumerate_placements(grid(2, 2), [PAIR], np.ones(4, dtype=bool), stop)


def test_a_thousand_edges_take_less_than_half_a_second():
    mesh = grid(22, 22)
    assert len(mesh.edges) == 1012
    basic = shipped_templates("basic")
    begin = time.process_time()
    found = enumerate_placements(mesh, basic, all_faces(mesh))
    assert time.process_time() - begin < 0.5
    # Blocks of a by b: (23 - a) (23 - b) for each way round.
    block = {(t.name, n) for t, n in zip(basic, np.bincount(found.template).tolist())}
    assert {("2x2", 441), ("3x2", 420), ("4x2", 2 * 399), ("1x4", 2 * 418), ("U", 4 * 420)} <= block


def test_text_draws_what_is_laid():
    (hook,) = parse_templates(
        '{"templates": [{"name": "J", "cells": [".#", ".#", "##"], "rotations": [0], '
        '"mirror": false}]}',
        "J",
    )
    assert fits(grid(2, 3), hook) == {(0, 1, 3, 5)}
    assert fits(grid(3, 2), hook) == set()
