"""Candidate mesh: every output filled, drawn meshes taken back."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import box, layer, point, roads, site  # noqa: E402


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
