"""Real and derived bad layers: each is prepared or refused in words, none ends in a traceback."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import FailedError, RefusedError  # noqa: E402

POLYGONS = [
    "cambridge_invalid_parcels.gpkg|layername=parcels",
    "cambridge_multipart_parcels.gpkg|layername=parcels",
    "cambridge_slivers.gpkg|layername=slivers",
    "cambridge_slivers.gpkg|layername=slivers_and_neighbours",
    "curvepolygon.gpkg|layername=curvepolygon",
    "derived_bowtie_spike.gpkg|layername=site",
    "derived_empty_null_zeroarea.gpkg|layername=site",
    "derived_far_crs.gpkg|layername=site_zone_prefixed_easting",
    "derived_far_crs.gpkg|layername=plots_negative_krovak",
    "derived_near_duplicate_vertices.gpkg|layername=site",
    "flanders_invalid_buildings.gpkg|layername=2100_gbg_filter",
    "flanders_parcels_one_empty.gpkg|layername=parcels",
    "fr_zoning_z_one_empty.gpkg|layername=zoning2",
    "momepy_tests_broken_networks.gpkg|layername=os",
]


@pytest.fixture
def open_layer(shared_data):
    from qgis.core import QgsVectorLayer

    def open_layer(source):
        made = QgsVectorLayer(str(shared_data / "bad" / source), "bad", "ogr")
        assert made.isValid(), source
        return made

    return open_layer


@pytest.mark.parametrize("source", POLYGONS)
def test_bad_polygons_are_prepared_or_refused(toolbox, open_layer, source):
    given = open_layer(source)
    try:
        run = toolbox.run("preparesite", INPUT=given)
    except (RefusedError, FailedError) as refused:
        text = str(refused)
        assert "went wrong" not in text
        assert "'bad'" in text
        return
    sites = run.rows("SITE")
    assert len(sites) == run.results["SITES"] > 0
    for one in sites:
        assert one["geometry"].isGeosValid()
        assert one["area_m2"] > 0
    broken = any(
        not f.hasGeometry() or f.geometry().isEmpty() or not f.geometry().isGeosValid()
        for f in given.getFeatures()
    )
    assert not broken or run.results["REPAIRS"] > 0


@pytest.mark.parametrize("streets", ["streets_metres", "streets_us_feet"])
def test_a_site_in_degrees_finds_its_streets_in_metres_and_feet(toolbox, open_layer, streets):
    run = toolbox.run(
        "preparesite",
        INPUT=open_layer("derived_mixed_crs.gpkg|layername=site_degrees"),
        ROADS=open_layer(f"derived_mixed_crs.gpkg|layername={streets}"),
    )
    assert run.results["AREA"] == pytest.approx(10.97, abs=0.1)
    assert len(run.rows("BOUNDARY_STREETS")) >= 4
    assert len(run.rows("ACCESS_POINTS")) >= 4


@pytest.mark.parametrize("streets", ["streets_zm", "streets_m"])
def test_streets_with_heights_and_measures_are_streets(toolbox, open_layer, shared_data, streets):
    run = toolbox.run(
        "preparesite",
        INPUT=str(shared_data / "sites" / "01_rect_brownfield_baltimore.gpkg") + "|layername=site",
        ROADS=open_layer(f"derived_m_zm_streets.gpkg|layername={streets}"),
    )
    assert run.rows("BOUNDARY_STREETS")


def test_a_shapefile_without_prj_is_refused(toolbox, shared_data):
    source = f"/vsizip/{shared_data / 'bad' / 'zone_urba_no_prj.zip'}"
    from osgeo import gdal
    from qgis.core import QgsCoordinateReferenceSystem, QgsVectorLayer

    (name,) = [n for n in gdal.ReadDirRecursive(source) if n.lower().endswith(".shp")]
    made = QgsVectorLayer(f"{source}/{name}", "zone urba", "ogr")
    made.setCrs(QgsCoordinateReferenceSystem())
    with pytest.raises(RefusedError, match="coordinate reference system"):
        toolbox.run("preparesite", INPUT=made)


def test_a_broken_street_network_is_validated(toolbox, open_layer):
    run = toolbox.run(
        "validatenetwork",
        INPUT=open_layer("momepy_tests_broken_networks.gpkg|layername=broken_network"),
    )
    assert run.results["VIOLATIONS"] > 0
