"""Meshes as layers, and meshes made of drawn lines and faces."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.errors import InputError
from platwright.mesh import (
    fan,
    grid,
    mesh_from_edges,
    mesh_from_faces,
    mesh_layers,
    quadrangulate,
)

CRS = "EPSG:26986"


def test_layers_have_their_fields():
    layers = mesh_layers(grid(2, 2, 50.0), CRS, CRS)
    assert list(layers) == ["edges", "vertices", "faces"]
    columns = {name: list(layer.columns) for name, layer in layers.items()}
    assert columns == {
        "edges": ["edge_id", "length_m", "boundary", "foreign", "geometry"],
        "vertices": ["vertex_id", "role", "valence", "geometry"],
        "faces": ["face_id", "area_m2", "scaled_jacobian", "geometry"],
    }
    assert layers["edges"]["length_m"].tolist() == [50.0] * 12
    assert layers["edges"]["boundary"].sum() == 8
    assert layers["faces"]["area_m2"].tolist() == [2500.0] * 4
    assert layers["vertices"]["role"].tolist() == [
        "corner", "boundary", "corner", "boundary", "inner", "boundary", "corner", "boundary",
        "corner",
    ]  # fmt: skip


def test_irregular_vertices_are_named():
    roles = mesh_layers(fan(5), CRS, CRS)["vertices"]["role"]
    assert roles[0] == "irregular"
    assert (roles == "irregular").sum() == 1


def test_layers_return_to_the_source_crs():
    mesh = quadrangulate(shapely.box(2.3e5, 9.0e5, 2.305e5, 9.003e5), 100)
    layers = mesh_layers(mesh, CRS, "EPSG:4326")
    assert layers["edges"].crs.to_epsg() == 4326
    x0, y0, x1, y1 = layers["faces"].total_bounds
    assert -72 < x0 < x1 < -71
    assert 42 < y0 < y1 < 43


def test_faces_follow_the_arcs():
    disc = shapely.Point(0, 0).buffer(200, quad_segs=24)
    layers = mesh_layers(quadrangulate(disc, 60), CRS, CRS)
    assert layers["faces"].area.sum() == pytest.approx(disc.area, rel=3e-3)
    assert layers["faces"].is_valid.all()


@pytest.mark.parametrize("kind", ["grid", "disc"])
def test_there_and_back(kind):
    mesh = (
        grid(3, 2, 60.0)
        if kind == "grid"
        else quadrangulate(shapely.Point(0, 0).buffer(200, quad_segs=24), 60)
    )
    layers = mesh_layers(mesh, CRS, CRS)
    for made in (mesh_from_edges(layers["edges"]), mesh_from_faces(layers["faces"])):
        assert len(made.faces) == len(mesh.faces)
        assert len(made.edges) == len(mesh.edges)
        assert np.sort(made.lengths) == pytest.approx(np.sort(mesh.lengths), rel=1e-3)
        assert np.bincount(made.valences).tolist() == np.bincount(mesh.valences).tolist()


def test_lines_are_noded_and_the_mean_length_is_taken():
    lines = [
        *(shapely.LineString([(0, y), (200, y)]) for y in (0, 100, 200)),
        *(shapely.LineString([(x, 0), (x, 200)]) for x in (0, 100, 200)),
    ]
    mesh = mesh_from_edges(gpd.GeoDataFrame(geometry=lines, crs=CRS))
    assert len(mesh.faces) == 4
    assert mesh.edge_length == 100
    assert mesh.boundary_arcs == {}


def test_small_gaps_are_snapped():
    a = shapely.box(0, 0, 100, 100)
    b = shapely.box(100.02, 0.01, 200, 100)
    mesh = mesh_from_faces(gpd.GeoDataFrame(geometry=[a, b], crs=CRS))
    assert len(mesh.vertices) == 6


def test_foreign_flags_of_drawn_meshes():
    faces = mesh_layers(grid(2, 1, 100.0), CRS, CRS)["faces"]
    site = shapely.box(0, 0, 200, 100) - shapely.box(80, 30, 120, 70)
    mesh = mesh_from_faces(faces, site_polygon=site, edge_length=90)
    (crossing,) = np.flatnonzero(mesh.foreign)
    assert mesh.vertices[mesh.edges[crossing], 0].tolist() == [100, 100]
    assert mesh.edge_length == 90


def table(*geometries, crs=CRS):
    return gpd.GeoDataFrame(geometry=list(geometries), crs=crs, index=range(7, 7 + len(geometries)))


def test_bad_faces_are_named():
    triangle = shapely.Polygon([(0, 0), (10, 0), (0, 10)])
    with pytest.raises(InputError, match=r"Layer 'Mesh faces'.*feature 8 has 3 corners"):
        mesh_from_faces(table(shapely.box(50, 50, 60, 60), triangle))
    lines = [triangle.exterior]
    with pytest.raises(InputError, match=r"Layer 'Drawn'.*face at \(3\.3, 3\.3\) has 3 corners"):
        mesh_from_edges(table(*(shapely.LineString(r) for r in lines)), layer="Drawn")


@pytest.mark.parametrize(
    ("layer", "text"),
    [
        (table(), "is empty"),
        (table(shapely.box(0, 0, 1, 1), crs="EPSG:4326"), "degrees"),
        (table(shapely.box(0, 0, 1, 1), None), "feature 8: It has no geometry"),
        (table(shapely.Point(0, 0)), "not a polygon"),
    ],
)
def test_unusable_layers_are_refused(layer, text):
    with pytest.raises(InputError, match=text):
        mesh_from_faces(layer)


def test_open_lines_enclose_nothing():
    with pytest.raises(InputError, match="enclose no face"):
        mesh_from_edges(table(shapely.LineString([(0, 0), (1, 1)])))
    with pytest.raises(InputError, match="other than lines"):
        mesh_from_edges(table(shapely.Point(0, 0)))
