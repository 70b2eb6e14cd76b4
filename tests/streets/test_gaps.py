"""Junctions keep their distance when streets are drawn."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from platwright.mesh.grids import grid
from platwright.streets.align import align
from platwright.streets.chains import chains
from platwright.streets.gaps import keeps_gaps

from .conftest import make_site


def crossing():
    """Return a mesh of 3 x 3 cells of 100 m, its streets and their lines: two cross two."""
    mesh = grid(3, 3, 100.0)
    level = np.where(mesh.boundary_edges, 0, 3)
    lines = {e: mesh.vertices[mesh.edges[e]].copy() for e in np.flatnonzero(level).tolist()}
    return mesh, level, chains(mesh, level), lines


def moved(mesh, lines, place, by):
    """Move the vertex at a place, with what is drawn to it."""
    vertex = int(np.argmin(np.hypot(*(mesh.vertices - place).T)))
    return {
        e: np.where((mesh.edges[e] == vertex)[:, None], line + np.array(by), line)
        for e, line in lines.items()
    }


@pytest.mark.parametrize(
    ("place", "by", "least", "kept"),
    [
        ((100, 100), (0.0, 0.0), 100.0, True),
        # one gap shrinks to 85 m
        ((100, 100), (15.0, 0.0), 100.0, False),
        ((100, 100), (15.0, 0.0), 80.0, True),
        # two streets end at the edge, 85 m apart, though each is long enough
        ((0, 100), (0.0, 15.0), 100.0, False),
        ((0, 100), (0.0, -15.0), 100.0, True),
        # all gaps were too short before
        ((100, 100), (0.0, 0.0), 150.0, True),
    ],
)
def test_gaps_between_junctions_are_kept_or_not(place, by, least, kept):
    mesh, _, ways, lines = crossing()
    assert keeps_gaps(mesh, ways, moved(mesh, lines, place, by), least) is kept


def test_streets_are_not_pulled_together():
    # ends that turn square to the leaning side come nearer to one another inside
    ground = shapely.Polygon([(0, 0), (300, 0), (420, 300), (0, 300)])
    square, level, ways, _ = crossing()
    x, y = square.vertices.T
    mesh = dataclasses.replace(square, vertices=np.column_stack([x + 0.4 * y * x / 300, y]))
    free = align(make_site(ground), mesh, level, {})
    assert not keeps_gaps(mesh, ways, free.lines, 100.0)
    held = align(make_site(ground), mesh, level, {}, least_gap=100.0)
    assert keeps_gaps(mesh, ways, held.lines, 100.0)
