"""An earlier design is found again on its mesh, and refused where it belongs elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.mesh.grids import grid
from platwright.network.specification import Specification
from platwright.streets import Wishes, design_streets
from platwright.streets.earlier import mesh_misfit, start_edges, start_levels
from shapely import affinity
from shapely.geometry import LineString

from .conftest import make_site


def test_the_edges_along_a_street_are_found_not_those_across():
    mesh = grid(4, 4, 10.0)
    found = start_edges(mesh, [LineString([(0, 20.5), (30, 20.5)])])
    ends = mesh.vertices[mesh.edges[found]]
    assert np.isclose(ends[:, :, 1], 20).all()
    assert sorted(ends[:, :, 0].min(axis=1)) == [0, 10, 20]


def test_the_mesh_of_a_design_fits_it_best():
    lines = [LineString([(20, 0), (20, 120)]), LineString([(0, 60), (120, 60)])]
    sizes = [20.0, 24.0, 17.0]
    misfits = [mesh_misfit(grid(6, 6, size), lines) for size in sizes]
    assert int(np.argmin(misfits)) == 0
    assert misfits[0] == pytest.approx(0)


@pytest.mark.parametrize(
    "outline",
    [[(0, 0), (288, 0), (288, 216), (0, 216)], [(0, 0), (430, 20), (400, 330), (-20, 290)]],
)
def test_a_design_is_its_own_best_start(outline):
    site = make_site(shapely.Polygon(outline))
    spec = Specification()
    first = design_streets([site], spec).plans[0]
    old: dict[int, list[LineString]] = {}
    for s in first.segments:
        old.setdefault(s.level, []).append(s.line)
    wishes = Wishes(start=old)
    again = design_streets([site], spec, wishes=wishes).plans[0]
    assert again.network.objective == pytest.approx(first.network.objective)
    marked = start_levels(first.network.ground.mesh, old)
    streets = first.network.level > 0
    assert (marked == first.network.level)[streets].mean() >= 0.9


def test_the_design_of_another_site_is_refused(square):
    design = design_streets([square], Specification()).plans[0]
    lines = [affinity.translate(s.line, 900, 0) for s in design.segments]
    with pytest.raises(InputError, match="design of another one") as caught:
        design_streets(
            [square], Specification(), wishes=Wishes(start={0: lines}, start_layer="Old")
        )
    assert "Old" in str(caught.value)
