"""Candidate mesh: every output filled, drawn meshes taken back."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import ROADS, FailedError, box, layer, line, point, roads, site  # noqa: E402


def test_nothing_is_said_about_roads_that_nobody_could_give(mesh):
    assert not [text for text in mesh.said.infos if "road" in text]


def test_an_arriving_street_goes_on_along_a_drawn_mesh_too(toolbox):
    """Prepare, mesh and design continue a street as one run of Design streets does."""
    lane = [*ROADS[:4], line((118, -8), (118, -120))]
    around = layer(lane, kind="LineString")
    ready = toolbox.run("preparesite", INPUT=site(), ROADS=around).layers
    drawn = toolbox.run(
        "candidatemesh", INPUT=ready["SITE"], ACCESS_POINTS=ready["ACCESS_POINTS"]
    ).layers["EDGES"]
    run = toolbox.run("designstreets", INPUT=site(), ROADS=around, MESH_EDGES=drawn, TIME_LIMIT=3)
    met = [j for j in run.rows("JUNCTIONS") if j["kind"] == "continues street"]
    assert len(met) == 1
    assert met[0]["geometry"].asPoint().x() == pytest.approx(500118, abs=3)


def test_a_face_that_is_no_quad_is_placed_in_the_crs_of_the_layer(toolbox, mesh):
    from qgis.core import (
        QgsCoordinateReferenceSystem,
        QgsCoordinateTransform,
        QgsGeometry,
        QgsProject,
    )

    turn = QgsCoordinateTransform(
        QgsCoordinateReferenceSystem("EPSG:3067"),
        QgsCoordinateReferenceSystem("EPSG:4326"),
        QgsProject.instance(),
    )
    shapes = [e["geometry"] for e in mesh.rows("EDGES")]
    middle = turn.transform(500150, 6700100)
    for shape in shapes:
        shape.transform(turn)
    gone = min(shapes, key=lambda s: s.centroid().asPoint().distance(middle))
    drawn = layer([s for s in shapes if s is not gone], kind="LineString", crs="EPSG:4326")
    shape = QgsGeometry.fromWkt(box(0, 0, 300, 200))
    shape.transform(turn)
    with pytest.raises(FailedError, match="6 corners") as caught:
        toolbox.run("designstreets", INPUT=layer([shape], crs="EPSG:4326"), MESH_EDGES=drawn)
    x, y = (float(n) for n in re.search(r"at \((.+?), (.+?)\)", str(caught.value)).groups())
    assert x == pytest.approx(middle.x(), abs=0.001)
    assert y == pytest.approx(middle.y(), abs=0.001)


def test_the_block_width_sets_the_size_of_the_cells(toolbox):
    run = toolbox.run("candidatemesh", INPUT=site(), BLOCK_WIDTH=66)
    assert run.results["MEAN_EDGE_LENGTH"] == pytest.approx(66, rel=0.1)


@pytest.fixture(scope="module")
def mesh(toolbox):
    return toolbox.run("candidatemesh", INPUT=site(), EDGE_LENGTH=50)


def test_the_faces_fill_the_site(mesh):
    faces = mesh.rows("FACES")
    assert mesh.results["FACE_COUNT"] == len(faces) == 24
    assert sum(f["area_m2"] for f in faces) == pytest.approx(60000, rel=0.01)
    assert {f["site_id"] for f in faces} == {1}


def test_euler_holds(mesh):
    counts = {key: made.featureCount() for key, made in mesh.layers.items()}
    assert counts["VERTICES"] - counts["EDGES"] + counts["FACES"] == 1


def test_a_rectangle_gets_a_grid(mesh):
    assert mesh.results["REGULAR_SHARE"] == 1
    assert mesh.results["WORST_QUALITY"] > 0.95
    assert mesh.results["MEAN_EDGE_LENGTH"] == pytest.approx(50, rel=0.03)
    lengths = [e["length_m"] for e in mesh.rows("EDGES")]
    assert lengths == pytest.approx([50] * len(lengths), rel=0.1)


def test_corners_stay_vertices(mesh):
    places = {
        (round(v["geometry"].asPoint().x()) - 500000, round(v["geometry"].asPoint().y()) - 6700000)
        for v in mesh.rows("VERTICES")
        if v["role"] == "corner"
    }
    assert places == {(0, 0), (300, 0), (300, 200), (0, 200)}


def test_vertices_tell_their_valence(mesh):
    for vertex in mesh.rows("VERTICES"):
        assert vertex["valence"] == {"corner": 2, "boundary": 3, "inner": 4}[vertex["role"]]


def test_access_points_pull_at_the_mesh(toolbox):
    run = toolbox.run(
        "candidatemesh",
        INPUT=site(),
        ACCESS_POINTS=layer([point(112, 0)], kind="Point"),
        EDGE_LENGTH=50,
    )
    nearest = min(
        abs(v["geometry"].asPoint().x() - 500112)
        for v in run.rows("VERTICES")
        if v["geometry"].asPoint().y() < 6700001
    )
    assert nearest < 6


def test_edges_over_obstacles_are_marked(toolbox):
    run = toolbox.run(
        "candidatemesh", INPUT=site(), OBSTACLES=layer([box(60, 60, 30, 80)]), EDGE_LENGTH=50
    )
    over = [e for e in run.rows("EDGES") if e["blocked"]]
    # the edge at y = 100 from x = 50 to 100
    assert len(over) == 1
    assert over[0]["geometry"].boundingBox().center().x() == pytest.approx(500075, abs=3)


def test_every_site_gets_its_mesh(toolbox):
    two = layer([box(0, 0, 300, 200), box(900, 0, 200, 200)])
    run = toolbox.run("candidatemesh", INPUT=two, EDGE_LENGTH=50)
    counts = {n: sum(f["site_id"] == n for f in run.rows("FACES")) for n in (1, 2)}
    assert counts == {1: 24, 2: 16}


def test_a_turned_guide_is_heard(toolbox):
    run = toolbox.run(
        "candidatemesh", INPUT=layer([box(0, 0, 400, 400)]), EDGE_LENGTH=50, DIRECTION=0
    )
    assert run.results["FACE_COUNT"] == pytest.approx(64, abs=8)


def test_streets_are_designed_on_a_drawn_mesh(toolbox, mesh):
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        MESH_EDGES=mesh.layers["EDGES"],
        BLOCK_WIDTH=50,
        TIME_LIMIT=3,
    )
    streets = [s for s in run.rows("STREETS") if s["status"] == "new"]
    assert streets
    grid = mesh.layers["EDGES"]
    from qgis.core import QgsGeometry

    edges = QgsGeometry.unaryUnion([f.geometry() for f in grid.getFeatures()]).buffer(20, 4)
    for street in streets:
        assert edges.contains(street["geometry"])
