"""A small town through real QGIS, its geometry judged by QGIS itself."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import QgsGeometry, QgsPointXY, QgsVectorLayer  # noqa: E402
from support import Listener, X, Y, box, complaints_of, layer  # noqa: E402

#: A little search in this process.
QUICK = {"EFFORT": 5, "WORKERS": 1}


def roads():
    """Two major roads that cross, a street that meets one."""
    rows = [
        ("primary", [(0, 300), (800, 300)]),
        ("secondary", [(400, 0), (400, 600)]),
        ("residential", [(200, 300), (200, 420)]),
    ]
    shapes = [
        QgsGeometry.fromPolylineXY([QgsPointXY(X + x, Y + y) for x, y in xy]) for _, xy in rows
    ]
    return layer(
        shapes, kind="LineString", name="osm", fields="field=highway:string",
        values=[[kind] for kind, _ in rows],
    )  # fmt: skip


def town():
    return layer([box(0, 0, 800, 600)], name="town")


complaint = complaints_of("designcity")


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run("designcity", INPUT=town(), ROADS=roads(), **QUICK)


def test_four_sub_regions_are_designed(made):
    rows = made.rows("SUB_REGIONS")
    assert [row["sub_region"] for row in rows] == [1, 2, 3, 4]
    assert {row["state"] for row in rows} == {"done"}
    assert QgsGeometry.unaryUnion([row["geometry"] for row in rows]).area() == pytest.approx(
        480_000, rel=1e-6
    )
    assert (made.results["REGION_COUNT"], made.results["DONE"]) == (4, 4)


def test_streets_lie_in_their_sub_region_and_meet_across_the_roads(made):
    ground = {row["sub_region"]: row["geometry"] for row in made.rows("SUB_REGIONS")}
    new = [row for row in made.rows("STREETS") if row["status"] == "new"]
    assert {row["sub_region"] for row in new} == {1, 2, 3, 4}
    for row in new:
        assert ground[row["sub_region"]].buffer(0.01, 2).contains(row["geometry"])
    assert made.results["TOTAL_LENGTH"] == pytest.approx(
        sum(row["geometry"].length() for row in new), rel=0.02
    )
    crossings = [row for row in made.rows("JUNCTIONS") if row["state"] == "crossing"]
    assert len(crossings) == made.results["CROSSINGS"] >= 1
    for row in crossings:
        sides = {s["sub_region"] for s in new if s["geometry"].distance(row["geometry"]) < 1e-6}
        assert len(sides) == 2
    assert made.results["AGREEMENT"] == 100


def test_a_file_keeps_what_is_finished(toolbox, tmp_path):
    path = str(tmp_path / "finished.gpkg")
    asked = {"INPUT": town(), "ROADS": roads(), "FINISHED": path, **QUICK}
    first = toolbox.run("designcity", listener=Listener(cancel_at="1 of 4 done"), **asked)
    assert 1 <= first.results["DONE"] < 4
    assert any("Cancelled" in text for text in first.said.warnings)
    again = toolbox.run("designcity", **asked)
    assert again.results["RESUMED"] == first.results["DONE"]
    assert again.results["DONE"] == 4
    assert QgsVectorLayer(f"{path}|layername=finished_sub_regions", "x", "ogr").featureCount() == 4


def test_a_resumed_run_gives_the_streets_of_one_that_went_through(toolbox, made, tmp_path):
    path = str(tmp_path / "finished.gpkg")
    asked = {"INPUT": town(), "ROADS": roads(), "FINISHED": path, **QUICK}
    toolbox.run("designcity", listener=Listener(cancel_at="2 of 4 done"), **asked)
    again = toolbox.run("designcity", **asked)
    shapes = [[row["geometry"].asWkb().data() for row in run.rows("STREETS")]
              for run in (made, again)]  # fmt: skip
    assert shapes[0] == shapes[1]


def test_processes_give_the_same(toolbox, made):
    there = toolbox.run("designcity", INPUT=town(), ROADS=roads(), EFFORT=5, WORKERS=2)
    shapes = [[row["geometry"].asWkb().data() for row in run.rows("STREETS")]
              for run in (made, there)]  # fmt: skip
    assert shapes[0] == shapes[1]


def test_chosen_classes_divide(toolbox):
    asked = {"INPUT": town(), "ROADS": roads(), **QUICK}
    found = toolbox.run(
        "designcity", MAJOR_ROADS="other classes", ROAD_CLASSES="Secondary", **asked
    )
    assert found.results["REGION_COUNT"] == 2


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"ROAD_CLASSES": "primary"}, "other classes"),
        ({"LEAST_AREA": 50}, "less than twice"),
        ({"FINISHED": "/nowhere/at/all/x.gpkg"}, "folder"),
        ({"MAJOR_ROADS": "other classes", "ROAD_CLASSES": "motorway"}, "divides the municipality"),
    ],
)
def test_what_cannot_be_is_refused_with_a_remedy(toolbox, asked, said):
    assert said in complaint(toolbox, INPUT=town(), ROADS=roads(), **asked)


@pytest.mark.parametrize("key", ["STREETS", "PROBLEMS"])
def test_the_file_of_finished_sub_regions_is_not_replaced_by_layers(toolbox, tmp_path, key):
    path = tmp_path / "city.gpkg"
    asked = {"INPUT": town(), "ROADS": roads(), "FINISHED": str(path), **QUICK}
    text = complaint(toolbox, **asked, **{key: str(path)})
    assert "would replace city.gpkg" in text
    assert not path.exists()
    kept = toolbox.run("designcity", **asked, **{key: f"ogr:dbname='{path}' table=\"own\" (geom)"})
    assert kept.results["DONE"] == 4
    stored = QgsVectorLayer(f"{path}|layername=finished_sub_regions", "x", "ogr")
    assert stored.featureCount() == 4
