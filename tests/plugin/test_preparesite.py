"""Prepare site: expected layers, selection, filters, many sites."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import ROADS, box, layer, line, roads, site  # noqa: E402


def test_the_expected_layers_come_out(toolbox):
    run = toolbox.run("preparesite", INPUT=site(), ROADS=roads())
    (ground,) = run.rows("SITE")
    assert ground["site_id"] == 1
    assert ground["area_ha"] == pytest.approx(6.0, rel=0.01)
    assert ground["area_m2"] == pytest.approx(60000, rel=0.01)
    assert ground["perimeter_m"] == pytest.approx(1000, rel=0.01)
    streets = run.rows("BOUNDARY_STREETS")
    assert {s["name"] for s in streets} == {
        "South Street", "East Street", "North Street", "West Street",
    }  # fmt: skip
    # cut where Mill Lane arrives
    assert sum(s["name"] == "South Street" for s in streets) == 2
    for street in streets:
        assert street["geometry"].length() == pytest.approx(street["length_m"], rel=0.002)
    (arrival,) = run.rows("ACCESS_POINTS")
    assert arrival["name"] == "Mill Lane"
    assert min(arrival["bearing_deg"], 360 - arrival["bearing_deg"]) == pytest.approx(0, abs=1)
    assert arrival["geometry"].asPoint().x() == pytest.approx(500150, abs=1)
    assert run.results["SITES"] == 1
    assert run.results["AREA"] == pytest.approx(6.0, rel=0.01)
    assert run.results["REPAIRS"] == len(run.rows("PROBLEMS"))


def test_outputs_keep_the_crs_of_the_site(toolbox):
    run = toolbox.run("preparesite", INPUT=site(), ROADS=roads())
    assert {made.crs().authid() for made in run.layers.values()} == {"EPSG:3067"}


def test_every_declared_field_is_there_in_its_kind(toolbox, package):
    run = toolbox.run("preparesite", INPUT=site(), ROADS=roads())
    compat = package("plugin.compat")
    for key, kind in toolbox.tool("preparesite").layers.items():
        fields = run.layers[key].fields()
        assert [f.name() for f in fields] == [f.name for f in kind.fields]
        assert [f.type() for f in fields] == [compat.FIELD_TYPES[f.kind] for f in kind.fields]
        assert run.layers[key].wkbType() == kind.wkb


def test_only_selected_features_are_sites(toolbox):
    from qgis.core import QgsProcessingFeatureSourceDefinition, QgsProject

    parcels = layer([box(0, 0, 300, 200), box(2000, 0, 100, 100)])
    QgsProject.instance().addMapLayer(parcels)
    try:
        (chosen,) = [f.id() for f in parcels.getFeatures() if f.geometry().area() < 20000]
        parcels.selectByIds([chosen])
        source = QgsProcessingFeatureSourceDefinition(parcels.id(), True)
        run = toolbox.run("preparesite", INPUT=source)
        (ground,) = run.rows("SITE")
        assert ground["area_m2"] == pytest.approx(10000, rel=0.01)
    finally:
        QgsProject.instance().removeMapLayer(parcels.id())


def test_adjoining_parcels_become_one_site_and_others_their_own(toolbox):
    parcels = layer([box(0, 0, 100, 200), box(100, 0, 200, 200), box(2000, 0, 300, 100)])
    run = toolbox.run("preparesite", INPUT=parcels)
    areas = {s["site_id"]: s["area_m2"] for s in run.rows("SITE")}
    assert areas == pytest.approx({1: 60000, 2: 30000}, rel=0.01)


def test_roads_inside_are_kept_on_request(toolbox):
    inside = layer([*ROADS, line((0, 60), (300, 60))], kind="LineString")
    kept = toolbox.run("preparesite", INPUT=site(), ROADS=inside, INNER_ROADS="keep")
    ignored = toolbox.run("preparesite", INPUT=site(), ROADS=inside, INNER_ROADS="ignore")
    more = {
        round(s["geometry"].boundingBox().center().y() - 6700000)
        for s in kept.rows("BOUNDARY_STREETS")
    } - {
        round(s["geometry"].boundingBox().center().y() - 6700000)
        for s in ignored.rows("BOUNDARY_STREETS")
    }
    assert more == {60}


def test_obstacles_are_clipped_to_the_site(toolbox):
    run = toolbox.run("preparesite", INPUT=site(), OBSTACLES=layer([box(250, 50, 100, 40)]))
    (obstacle,) = run.rows("SITE_OBSTACLES")
    assert obstacle["area_m2"] == pytest.approx(50 * 40, rel=0.01)
    assert obstacle["site_id"] == 1


def test_a_prepared_site_prepared_again_stays(toolbox):
    once = toolbox.run("preparesite", INPUT=site(), ROADS=roads())
    twice = toolbox.run(
        "preparesite", INPUT=once.layers["SITE"], ROADS=once.layers["BOUNDARY_STREETS"]
    )
    (first,), (second,) = once.rows("SITE"), twice.rows("SITE")
    assert first["geometry"].hausdorffDistance(second["geometry"]) < 0.05


def test_the_specification_is_on_record(toolbox, package):
    read_record = package("plugin.record").read_record
    run = toolbox.run("preparesite", INPUT=site(), ROADS=roads(), SNAP_DISTANCE=25)
    # also that of a temporary layer, which the next tool of a model may read
    own = json.loads(read_record(run.layers["SITE"])["specification"])
    assert own["snap_distance"] == 25.0
    record = package("plugin.record").Record("platwright:preparesite", "Site", '{"a": 1}', "{}")
    record.attach(run.layers["SITE"])
    assert json.loads(read_record(run.layers["SITE"])["specification"]) == {"a": 1}
    assert "platwright:preparesite" in run.layers["SITE"].metadata().abstract()
