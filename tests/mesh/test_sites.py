"""The mesher on real sites; skipped where the data are absent."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from platwright.mesh import quadrangulate, quality, subdivide
from shapely.geometry import LineString

SITES = ("01", "02", "03", "04", "05", "06", "07", "08", "09", "10", "11", "12")
#: Sites with ponds at the edge, necks narrower than a block and sharp ends.
RAGGED = {"03", "04", "06", "07"}


def polygon_of(folder, number):
    (path,) = sorted((folder / "sites").glob(f"{number}_*.gpkg"))
    return gpd.read_file(path, layer="site").geometry.iloc[0]


@pytest.mark.parametrize("number", SITES)
def test_sites_at_block_size(shared_data, number):
    site = polygon_of(shared_data, number)
    mesh = quadrangulate(site, 72.0)
    figures = quality(mesh, site)
    assert figures.inverted == 0
    assert figures.min_scaled_jacobian >= 0.45
    assert figures.inner_valence_4 >= 0.97
    assert figures.mean_edge_ratio == pytest.approx(1, abs=0.16 if number in RAGGED else 0.1)
    assert figures.angle_deviation < 11
    for i in np.flatnonzero(~mesh.foreign).tolist():
        ground = site.buffer(5) if mesh.boundary_edges[i] else site
        assert LineString(mesh.edge_line(i)).difference(ground).length <= 5.01


@pytest.mark.parametrize("number", ["01", "08", "11"])
def test_regular_sites_at_lot_size(shared_data, number):
    site = polygon_of(shared_data, number)
    figures = quality(quadrangulate(site, 24.0), site)
    assert figures.inverted == 0
    assert figures.inner_valence_4 == 1
    assert figures.min_scaled_jacobian > 0.75
    assert figures.within_15_percent > 0.8


def test_subdivided_site(shared_data):
    site = polygon_of(shared_data, "10")
    coarse = quadrangulate(site, 72.0)
    fine = subdivide(coarse, site)
    assert len(fine.faces) == 4 * len(coarse.faces)
    assert quality(fine).inverted == 0
    assert fine.lengths[fine.boundary_edges].sum() == pytest.approx(
        coarse.lengths[coarse.boundary_edges].sum()
    )
