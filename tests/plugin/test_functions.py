"""How streets should function, asked through Processing: traffic, exits, the ground, the start."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import (  # noqa: E402
    METRES,
    FailedError,
    RefusedError,
    X,
    Y,
    box,
    layer,
    line,
    roads,
    site,
)

WIDE = box(0, 0, 432, 360)


def run(toolbox, **parameters):
    asked = {"INPUT": layer([WIDE], name="wide"), "SINK_MODE": "whole boundary", "TIME_LIMIT": 6}
    return toolbox.run("designstreets", **{**asked, **parameters})


def new(found):
    return [s for s in found.rows("STREETS") if s["status"] == "new"]


def ends_on_edge(found):
    """Places where new streets meet the edge of the site."""
    places = set()
    for street in new(found):
        points = street["geometry"].asPolyline()
        for p in (points[0], points[-1]):
            x, y = p.x() - X, p.y() - Y
            if min(abs(x), abs(x - 432), abs(y), abs(y - 360)) < 1:
                places.add((round(x), round(y)))
    return places


def heights(folder: Path, west: float) -> str:
    """Write a raster that is steep west of x = 216 and flat beyond; return its path."""
    import numpy as np
    from osgeo import gdal, osr

    path = str(folder / "heights.tif")
    raster = gdal.GetDriverByName("GTiff").Create(path, 60, 50, 1, gdal.GDT_Float32)
    raster.SetGeoTransform((X + west - 50, 10, 0, Y + 430, 0, -10))
    crs = osr.SpatialReference()
    crs.ImportFromEPSG(int(METRES.split(":")[1]))
    raster.SetProjection(crs.ExportToWkt())
    x = np.arange(60) * 10 - 45.0
    y = 425.0 - np.arange(50) * 10
    raster.GetRasterBand(1).WriteArray(np.where(x < 216, 0.3 * y[:, None] + 0.3 * x, 0.0))
    raster.FlushCache()
    return path


def test_the_number_of_exits_is_kept(toolbox):
    free, few = run(toolbox), run(toolbox, EXITS=2)
    assert len(ends_on_edge(free)) > 2
    assert len(ends_on_edge(few)) == 2
    assert few.results["VIOLATIONS"] == 0


def test_traffic_through_leads_from_edge_to_edge(toolbox):
    route = layer([line((216, -3), (216, 365))], kind="LineString", name="route")
    found = run(toolbox, TRAFFIC="through the site", ROUTES=route, LEVELS=1)
    across = [s for s in new(found) if abs(s["geometry"].boundingBox().center().x() - X - 216) < 45]
    assert sum(s["length_m"] for s in across) > 300


def test_a_route_that_ends_inside_names_layer_and_feature(toolbox):
    route = layer([line((216, 0), (216, 180))], kind="LineString", name="half a route")
    with pytest.raises(FailedError, match="half a route") as caught:
        run(toolbox, TRAFFIC="through the site", ROUTES=route)
    assert "edge of the site" in str(caught.value)


def test_traffic_within_takes_drawn_parts(toolbox):
    halves = layer([box(0, 0, 216, 360), box(216, 0, 216, 360)], name="halves")
    found = run(toolbox, TRAFFIC="within the site", PARTITION=halves)
    assert new(found)
    assert found.results["VIOLATIONS"] == 0


def test_parts_that_leave_ground_out_are_refused(toolbox):
    half = layer([box(0, 0, 216, 360)], name="one half")
    with pytest.raises(FailedError, match="one half"):
        run(toolbox, TRAFFIC="within the site", PARTITION=half)


def test_one_way_streets_say_so(toolbox):
    found = run(toolbox, ONE_WAY="all new streets")
    single = [s for s in new(found) if s["oneway"]]
    assert len(single) > len(new(found)) / 2
    assert all(s["direction"] == 1 for s in single)
    assert not any(s["oneway"] for s in new(run(toolbox)))


def test_a_budget_makes_streets_shorter(toolbox):
    whole = run(toolbox).results["TOTAL_LENGTH"]
    assert run(toolbox, LENGTH_BUDGET=whole / 2).results["TOTAL_LENGTH"] < 0.6 * whole


def test_less_dense_areas_have_fewer_streets(toolbox):
    zones = layer(
        [box(216, -10, 230, 400), box(-10, -10, 226, 400)],
        fields="field=reach:double&field=note:string(9)",
        values=[[220.0, "few"], [None, "usual"]],
        name="density",
    )
    found = run(toolbox, DENSITY=zones, DENSITY_FIELD="reach", LEVELS=1)
    half = [0.0, 0.0]
    for s in new(found):
        middle = s["geometry"].boundingBox().center().x() - X
        half[int(middle > 216)] += s["length_m"]
    assert half[1] < 0.8 * half[0]


def test_a_field_that_is_missing_is_named_before_the_run(toolbox):
    zones = layer([WIDE], name="density", fields="field=other:double", values=[[1.0]])
    with pytest.raises(RefusedError, match="coverage_m") as caught:
        run(toolbox, DENSITY=zones)
    assert "density" in str(caught.value)


@pytest.mark.parametrize("value", [0.0, -2.0])
def test_prices_that_make_no_sense_name_the_feature(toolbox, value):
    dear = layer([WIDE], name="ground", fields="field=price:double", values=[[value]])
    with pytest.raises(FailedError, match="ground") as caught:
        run(toolbox, PRICES=dear)
    assert "greater than 0" in str(caught.value)


def test_steep_ground_is_dear(toolbox, tmp_path):
    found = run(toolbox, ELEVATION=heights(tmp_path, 0.0), SLOPE_WEIGHT=3, LEVELS=1)
    plain = run(toolbox, LEVELS=1)
    assert found.results["OBJECTIVE"] > 1.2 * plain.results["OBJECTIVE"]


def test_heights_elsewhere_are_refused(toolbox, tmp_path):
    with pytest.raises(FailedError, match="no height in this site"):
        run(toolbox, ELEVATION=heights(tmp_path, 5000.0))


def test_an_earlier_design_is_a_start(toolbox):
    first = toolbox.run("designstreets", INPUT=site(), ROADS=roads(), TIME_LIMIT=6)
    again = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        START=first.layers["STREETS"],
        TIME_LIMIT=6,
    )
    assert again.results["OBJECTIVE"] == pytest.approx(first.results["OBJECTIVE"])
    assert again.results["TOTAL_LENGTH"] == pytest.approx(first.results["TOTAL_LENGTH"])


def test_the_design_of_another_site_is_no_start(toolbox):
    far = layer([line((3000, 0), (3000, 300))], kind="LineString", name="elsewhere")
    with pytest.raises(FailedError, match="elsewhere"):
        run(toolbox, START=far)


def test_a_selected_part_of_a_design_is_frozen(toolbox):
    from qgis.core import QgsProcessingFeatureSourceDefinition, QgsProject

    first = run(toolbox)
    streets = first.layers["STREETS"]
    assert {s["level"] for s in new(first)} == {2, 3}
    kept = {
        f.id(): (f["level"], f.geometry())
        for f in streets.getFeatures()
        if f["status"] == "new" and f.geometry().boundingBox().xMaximum() < X + 230
    }
    assert {level for level, _ in kept.values()} >= {3}
    streets.selectByIds(list(kept))
    QgsProject.instance().addMapLayer(streets, False)
    try:
        frozen = QgsProcessingFeatureSourceDefinition(streets.id(), True)
        # another wish for the rest
        found = run(toolbox, REQUIRED=frozen, START=streets.id(), MAX_DISTANCE=200)
    finally:
        QgsProject.instance().removeMapLayer(streets.id())
    for level, shape in kept.values():
        near = shape.buffer(8, 8)
        same = [s for s in new(found) if s["geometry"].intersection(near).length() > 5]
        along = sum(s["geometry"].intersection(near).length() for s in same)
        assert along > 0.9 * shape.length()
        assert level in {s["level"] for s in same}
    assert found.results["VIOLATIONS"] == 0


def test_a_wish_that_cannot_be_kept_is_told_on_a_map(toolbox):
    found = run(
        toolbox,
        RULES="as in the paper",
        LEVELS=1,
        BLOCK_WIDTH=120,
        REQUIRED=layer([line((216, 0), (216, 360))], kind="LineString", name="axis"),
        LENGTH_BUDGET=60,
        TIME_LIMIT=20,
    )
    assert not found.rows("STREETS") or not new(found)
    problems = found.rows("PROBLEMS")
    assert [p for p in problems if p["severity"] == "error"]
    assert any("length budget" in p["problem"] + p["action"] for p in problems)
    assert found.said.warnings


def test_a_given_street_stays_and_divides_the_site(toolbox):
    axis = layer(
        [line((216, -5), (216, 365))],
        kind="LineString",
        name="axis",
        fields="field=level:integer",
        values=[[2]],
    )
    found = run(toolbox, GIVEN=axis)
    given = [s for s in found.rows("STREETS") if s["status"] == "given"]
    assert sum(s["length_m"] for s in given) == pytest.approx(360, abs=15)
    assert {s["level"] for s in given} == {2}
    assert {s["level"] for s in new(found)} == {3}
    assert found.results["VIOLATIONS"] == 0


def test_a_level_that_is_none_names_the_feature(toolbox):
    axis = layer(
        [line((216, -5), (216, 365))],
        kind="LineString",
        name="axis",
        fields="field=level:integer",
        values=[[7]],
    )
    with pytest.raises(FailedError, match="axis") as caught:
        run(toolbox, GIVEN=axis)
    assert "level is 7" in str(caught.value)


def test_deep_blocks_get_culs_de_sac(toolbox):
    deep = layer([box(0, 0, 432, 130)], name="deep")
    south = layer([line((-50, -8), (480, -8))], kind="LineString", name="south")
    asked = {"INPUT": deep, "ROADS": south, "SINK_MODE": "existing streets"}
    with_them = run(toolbox, **asked, CUL_DE_SACS=True)
    blind = [s for s in new(with_them) if s["level"] == 4]
    assert blind
    assert all(s["turning_m"] > 0 for s in blind)
    assert with_them.results["VIOLATIONS"] == 0


def test_a_raster_reaches_a_process_of_its_own(toolbox, tmp_path, monkeypatch):
    import sysconfig

    from osgeo import gdal
    from qgis.core import QgsCoordinateReferenceSystem, QgsProject, QgsRasterLayer

    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    file = gdal.Open(heights(tmp_path, west=5000.0), gdal.GA_Update)
    path = file.GetDescription()
    file.SetProjection("")
    file = None
    hill = QgsRasterLayer(path, "far hill")
    # set for the layer alone
    hill.setCrs(QgsCoordinateReferenceSystem(METRES))
    QgsProject.instance().addMapLayer(hill)
    try:
        # it is read there: its heights are elsewhere
        with pytest.raises(FailedError, match="no height"):
            run(toolbox, ELEVATION=hill.id())
    finally:
        QgsProject.instance().removeMapLayer(hill.id())


def test_what_has_no_effect_is_said(toolbox):
    route = layer([line((216, -3), (216, 365))], kind="LineString", name="route")
    found = run(toolbox, ROUTES=route, CUL_DE_SACS=True, LENGTH_BUDGET=1000, TIME_LIMIT=2)
    said = " ".join(found.said.warnings)
    assert "'Through routes' counts only where Traffic is 'through the site'" in said
    assert "No culs-de-sac" in said


def test_a_field_called_status_is_not_always_that_of_a_design(toolbox):
    major = layer(
        [line((216, -5), (216, 365))],
        fields="field=status:string",
        values=[["planned"]],
        kind="LineString",
        name="main road",
    )
    found = run(toolbox, GIVEN=major)
    given = [s for s in found.rows("STREETS") if s["status"] == "given"]
    assert sum(s["length_m"] for s in given) == pytest.approx(360, abs=15)


def test_a_torn_area_is_repaired(toolbox):
    bowtie = "POLYGON((500000 6700000,500432 6700360,500432 6700000,500000 6700360,500000 6700000))"
    dear = layer([bowtie], fields="field=price:double", values=[[3.0]], name="bow tie")
    assert new(run(toolbox, PRICES=dear))


def test_heights_are_those_of_the_cells(toolbox, package, tmp_path):
    import numpy as np
    from qgis.core import QgsRasterLayer, QgsRectangle

    hill = QgsRasterLayer(heights(tmp_path, 0.0), "hill")
    # cut between the middles of cells, and off their edges
    around = QgsRectangle(X + 53, Y + 47, X + 157, Y + 142)
    at = package("plugin.bridge").read_raster(hill, around).seen_from(METRES)
    x, y = np.meshgrid([57.5, 101.0, 153.5], [51.0, 99.5, 140.0])
    found = at(np.column_stack([X + x.ravel(), Y + y.ravel()]))
    # the plane that was written, with cells whose middles are half a cell from their corners
    assert found == pytest.approx(0.3 * (x + y).ravel(), abs=0.01)
