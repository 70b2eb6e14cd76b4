"""Bad input of every kind, through real QGIS: a clear sentence or a repair, never a traceback."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import (  # noqa: E402
    FailedError,
    Listener,
    RefusedError,
    X,
    Y,
    box,
    layer,
    line,
    point,
    roads,
    site,
)

ON_THE_SITE = ("preparesite", "candidatemesh", "designstreets")
SHORT = {"designstreets": {"TIME_LIMIT": 2}}


def run(toolbox, name, **parameters):
    return toolbox.run(name, **{**SHORT.get(name, {}), **parameters})


def complaint(toolbox, name, **parameters):
    """Return what the tool says when it refuses or stops, and make sure that it is readable."""
    with pytest.raises((RefusedError, FailedError)) as caught:
        run(toolbox, name, **parameters)
    text = str(caught.value)
    assert len(text) > 20
    assert text.rstrip().endswith((".", ")"))
    for stray in ("Traceback", 'File "', "something went wrong", "NoneType", "Error:"):
        assert stray not in text
    return text


def area(made):
    return sum(s["area_m2"] for s in made.rows("SITE"))


# Coordinate reference systems


@pytest.mark.parametrize("name", ON_THE_SITE)
def test_a_layer_without_crs_is_refused_with_the_way_out(toolbox, name):
    text = complaint(toolbox, name, INPUT=site(crs=""))
    assert "'my site'" in text
    assert "coordinate reference system" in text
    assert "Set CRS" in text


def test_roads_without_crs_are_refused_too(toolbox):
    text = complaint(toolbox, "designstreets", INPUT=site(), ROADS=roads(crs=""))
    assert "'my roads'" in text


def in_crs(made, authid):
    """Return a copy of a layer in another CRS."""
    from qgis.core import (
        QgsCoordinateReferenceSystem,
        QgsCoordinateTransform,
        QgsFeature,
        QgsProject,
        QgsVectorLayer,
        QgsWkbTypes,
    )

    target = QgsCoordinateReferenceSystem(authid)
    turn = QgsCoordinateTransform(made.crs(), target, QgsProject.instance())
    kind = QgsWkbTypes.displayString(made.wkbType())
    copy = QgsVectorLayer(f"{kind}?crs={authid}", made.name(), "memory")
    copy.dataProvider().addAttributes(list(made.fields()))
    copy.updateFields()
    features = []
    for old in made.getFeatures():
        feature, shape = QgsFeature(old), old.geometry()
        shape.transform(turn)
        feature.setGeometry(shape)
        features.append(feature)
    copy.dataProvider().addFeatures(features)
    copy.updateExtents()
    return copy


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857", "EPSG:2249"])
def test_degrees_feet_and_web_mercator_are_measured_in_metres(toolbox, crs):
    if crs == "EPSG:2249":  # Massachusetts, US feet: build the site there
        a, b, k = 770000.0, 2950000.0, 0.3048006096
        w, h = 300 / k, 200 / k
        ring = f"{a} {b},{a + w} {b},{a + w} {b + h},{a} {b + h},{a} {b}"
        ground = layer([f"POLYGON(({ring}))"], crs=crs)
    else:
        ground = in_crs(site(), crs)
    made = run(toolbox, "preparesite", INPUT=ground)
    assert area(made) == pytest.approx(60000, rel=0.005)
    assert made.layers["SITE"].crs().authid() == crs


def test_layers_in_different_crs_are_brought_together(toolbox):
    made = run(
        toolbox,
        "designstreets",
        INPUT=in_crs(site(), "EPSG:4326"),
        ROADS=in_crs(roads(), "EPSG:3857"),
        OBSTACLES=in_crs(layer([box(200, 20, 40, 40)]), "EPSG:32635"),
    )
    assert made.layers["STREETS"].crs().authid() == "EPSG:4326"
    names = {s["name"] for s in made.rows("STREETS") if s["status"] == "existing"}
    assert names & {"South Street", "East Street", "North Street", "West Street"}
    length = sum(s["length_m"] for s in made.rows("STREETS") if s["status"] == "new")
    assert 200 < length < 3000


# Geometry


BOW_TIE = f"POLYGON(({X} {Y},{X + 300} {Y + 200},{X + 300} {Y},{X} {Y + 200},{X} {Y}))"
TOUCHING_HOLES = (
    f"POLYGON(({X} {Y},{X + 400} {Y},{X + 400} {Y + 300},{X} {Y + 300},{X} {Y}),"
    f"({X + 100} {Y + 100},{X + 200} {Y + 100},{X + 200} {Y + 200},{X + 100} {Y + 200},"
    f"{X + 100} {Y + 100}),"
    f"({X + 200} {Y + 200},{X + 300} {Y + 200},{X + 300} {Y + 250},{X + 200} {Y + 250},"
    f"{X + 200} {Y + 200}))"
)


def test_invalid_geometry_is_repaired_and_reported(toolbox):
    made = run(toolbox, "preparesite", INPUT=layer([BOW_TIE]))
    assert area(made) == pytest.approx(30000, rel=0.02)
    assert made.rows("PROBLEMS")


def test_processing_s_own_check_for_invalid_geometry_does_not_stop_the_run(toolbox):
    """The planner's setting 'stop on invalid geometry' would forbid any repair."""
    from qgis.core import QgsProcessingContext, QgsProcessingFeedback

    tool = toolbox.tool("preparesite")
    context = QgsProcessingContext()
    context.setInvalidGeometryCheck(type(context.invalidGeometryCheck())(2))
    results, good = tool.run(
        {"INPUT": layer([BOW_TIE]), "SITE": "TEMPORARY_OUTPUT"}, context, QgsProcessingFeedback()
    )
    assert good
    assert results["SITES"] >= 1


def test_holes_that_touch_are_kept(toolbox):
    made = run(toolbox, "preparesite", INPUT=layer([TOUCHING_HOLES]))
    assert area(made) == pytest.approx(120000 - 10000 - 5000, rel=0.01)
    streets = run(toolbox, "designstreets", INPUT=layer([TOUCHING_HOLES]), BLOCK_WIDTH=60)
    assert streets.rows("STREETS")


def test_empty_and_null_geometries_are_left_out_and_reported(toolbox):
    made = run(toolbox, "preparesite", INPUT=layer([box(0, 0, 300, 200), None, "POLYGON EMPTY"]))
    assert made.results["SITES"] == 1
    assert len(made.rows("PROBLEMS")) >= 2
    assert {p["feature"] for p in made.rows("PROBLEMS")} >= {"2", "3"}


@pytest.mark.parametrize("name", ON_THE_SITE)
def test_nothing_but_null_geometry_is_refused(toolbox, name):
    complaint(toolbox, name, INPUT=layer([None]))


def test_null_roads_and_obstacles_do_no_harm(toolbox):
    nothing = layer([None, "LINESTRING EMPTY"], kind="LineString")
    made = run(
        toolbox, "designstreets", INPUT=site(), ROADS=nothing, OBSTACLES=layer([None]),
        SINK_MODE="whole boundary",
    )  # fmt: skip
    assert made.rows("STREETS")


def test_multipart_sites_become_several(toolbox):
    both = f"MULTIPOLYGON({box(0, 0, 300, 200)[7:]},{box(900, 0, 200, 200)[7:]})"
    made = run(toolbox, "preparesite", INPUT=layer([both], kind="MultiPolygon"))
    assert sorted(round(s["area_m2"], -2) for s in made.rows("SITE")) == [40000, 60000]


@pytest.mark.parametrize("kind", ["PolygonZ", "PolygonM", "PolygonZM"])
def test_heights_and_measures_do_no_harm(toolbox, kind):
    from qgis.core import QgsGeometry

    shape = QgsGeometry.fromWkt(box(0, 0, 300, 200))
    if "Z" in kind:
        shape.get().addZValue(12.5)
    if "M" in kind:
        shape.get().addMValue(3)
    made = run(toolbox, "preparesite", INPUT=layer([shape], kind=kind))
    assert area(made) == pytest.approx(60000, rel=0.001)


def test_curves_become_segments(toolbox):
    r = 100
    circle = (
        f"CURVEPOLYGON(CIRCULARSTRING({X - r} {Y},{X} {Y + r},{X + r} {Y},{X} {Y - r},{X - r} {Y}))"
    )
    made = run(toolbox, "preparesite", INPUT=layer([circle], kind="CurvePolygon"))
    assert area(made) == pytest.approx(math.pi * r * r, rel=0.002)


def test_curved_roads_are_roads(toolbox):
    curve = f"COMPOUNDCURVE(CIRCULARSTRING({X} {Y - 8},{X + 150} {Y - 12},{X + 300} {Y - 8}))"
    made = run(
        toolbox, "preparesite", INPUT=site(), ROADS=layer([curve], kind="CompoundCurve")
    )  # fmt: skip
    assert made.rows("BOUNDARY_STREETS")


@pytest.mark.parametrize("name", ["candidatemesh", "designstreets"])
def test_a_site_smaller_than_a_cell_is_refused_in_words(toolbox, name):
    text = complaint(toolbox, name, INPUT=layer([box(0, 0, 8, 6)]))
    assert "small" in text or "narrow" in text


# Wishes that cannot be met


def test_coverage_that_obstacles_make_impossible_is_reported(toolbox):
    moat = f"POLYGON(({box(20, 20, 260, 160)[9:-2]}),({box(50, 50, 200, 100)[9:-2]}))"
    made = run(
        toolbox, "designstreets", INPUT=site(), ROADS=roads(), OBSTACLES=layer([moat]),
        BLOCK_WIDTH=40,
    )  # fmt: skip
    assert any(
        p["severity"] == "warning" and "street" in p["problem"].lower()
        for p in made.rows("PROBLEMS")
    )


def test_a_sink_on_an_obstacle_is_refused(toolbox):
    text = complaint(
        toolbox, "designstreets", INPUT=site(), ROADS=roads(), SINK_MODE="given points",
        SINKS=layer([point(150, 100)], kind="Point"), OBSTACLES=layer([box(100, 50, 100, 100)]),
    )  # fmt: skip
    assert "obstacle" in text


def test_a_sink_outside_is_refused(toolbox):
    text = complaint(
        toolbox, "designstreets", INPUT=site(), ROADS=roads(), SINK_MODE="given points",
        SINKS=layer([point(5000, 5000)], kind="Point"),
    )  # fmt: skip
    assert "outside" in text


def test_given_points_without_a_layer_are_refused_before_the_run(toolbox):
    with pytest.raises(RefusedError, match="no layer of points"):
        run(toolbox, "designstreets", INPUT=site(), SINK_MODE="given points")


def test_a_required_street_inside_an_obstacle_is_refused(toolbox):
    text = complaint(
        toolbox, "designstreets", INPUT=site(), ROADS=roads(),
        REQUIRED=layer([line((120, 100), (180, 100))], kind="LineString"),
        OBSTACLES=layer([box(80, 40, 140, 120)]),
    )  # fmt: skip
    assert "required" in text.lower()


def test_roads_that_do_not_reach_the_site_are_named(toolbox):
    far = layer([line((0, -900), (300, -900))], kind="LineString", name="far roads")
    made = run(toolbox, "preparesite", INPUT=site(), ROADS=far)
    warnings = [p for p in made.rows("PROBLEMS") if p["severity"] == "warning"]
    assert any("far roads" in p["problem"] or "road" in p["problem"] for p in warnings)
    text = complaint(toolbox, "designstreets", INPUT=site(), ROADS=far)
    assert "whole boundary" in text


def test_a_block_longer_than_wide_is_asked_for(toolbox):
    with pytest.raises(RefusedError, match="Block length"):
        run(toolbox, "designstreets", INPUT=site(), BLOCK_WIDTH=200, BLOCK_LENGTH=100)


@pytest.mark.parametrize(
    ("key", "value"),
    [("BLOCK_WIDTH", -5), ("TIME_LIMIT", 0), ("SINK_MODE", "nowhere"), ("LEVELS", 7)],
)
def test_values_out_of_range_are_refused(toolbox, key, value):
    with pytest.raises(RefusedError):
        run(toolbox, "designstreets", INPUT=site(), **{key: value})


# Numbers of features


@pytest.mark.parametrize("name", [*ON_THE_SITE, "validatenetwork"])
def test_a_layer_without_features_is_refused(toolbox, name):
    kind = "LineString" if name == "validatenetwork" else "Polygon"
    text = complaint(toolbox, name, INPUT=layer([], kind=kind, name="void"))
    assert "'void'" in text
    assert "no features" in text


def test_no_layer_at_all_is_refused(toolbox):
    with pytest.raises(RefusedError, match="Could not load source layer for INPUT"):
        run(toolbox, "designstreets", INPUT="/nowhere/at/all.gpkg")


@pytest.mark.slow
def test_a_hundred_thousand_features_are_prepared(toolbox):
    """Parcels of a whole county: 100,000 lots in a grid, one site per block of 50."""
    lots = [
        box(60 * (i // 50) + (i % 50) // 25 * 20, 30 * (i % 25), 20, 30) for i in range(100_000)
    ]
    made = layer(lots)
    began = time.monotonic()
    result = run(toolbox, "preparesite", INPUT=made)
    assert result.results["SITES"] == 2000
    assert time.monotonic() - began < 60


# Outputs


def test_an_output_that_cannot_be_written_is_refused_before_the_run(toolbox, tmp_path: Path):
    (tmp_path / "file").write_text("no folder")
    for path in (tmp_path / "nowhere" / "s.gpkg", tmp_path / "file" / "s.gpkg"):
        with pytest.raises(RefusedError, match="Output 'Streets'"):
            run(toolbox, "designstreets", INPUT=site(), STREETS=str(path))


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="no /proc here")
def test_a_folder_without_permission_is_refused(toolbox):
    with pytest.raises(RefusedError, match="cannot be written"):
        run(toolbox, "designstreets", INPUT=site(), STREETS="/proc/streets.gpkg")


def test_a_folder_that_may_not_even_be_looked_at_is_refused(toolbox, monkeypatch):
    look = Path.is_dir

    def forbidden(path):
        if path.name == "away":
            raise PermissionError(13, "Permission denied", str(path))
        return look(path)

    monkeypatch.setattr(Path, "is_dir", forbidden)
    with pytest.raises(RefusedError, match=r"cannot be written .Permission denied"):
        run(toolbox, "designstreets", INPUT=site(), STREETS="/shut/away/streets.gpkg")


@pytest.mark.skipif(os.name == "posix" and os.geteuid() == 0, reason="root may write anything")
def test_a_read_only_file_is_refused(toolbox, tmp_path: Path):
    path = tmp_path / "streets.gpkg"
    path.write_bytes(b"")
    path.chmod(0o400)
    with pytest.raises(RefusedError, match="cannot be written"):
        run(toolbox, "designstreets", INPUT=site(), STREETS=str(path))


def test_an_input_is_not_overwritten(toolbox, tmp_path: Path):
    first = run(toolbox, "preparesite", INPUT=site(), SITE=str(tmp_path / "site.gpkg"))
    assert first.layers["SITE"].featureCount() == 1
    with pytest.raises(RefusedError, match="would overwrite"):
        run(
            toolbox,
            "preparesite",
            INPUT=str(tmp_path / "site.gpkg"),
            SITE=str(tmp_path / "site.gpkg"),
        )


def test_a_table_that_is_read_is_not_overwritten(toolbox, tmp_path: Path):
    def table(name):
        return f"ogr:dbname='{tmp_path / 'all.gpkg'}' table=\"{name}\" (geom)"

    run(toolbox, "preparesite", INPUT=site(), SITE=table("mine"))
    for source in (f"{tmp_path / 'all.gpkg'}|layername=mine", str(tmp_path / "all.gpkg")):
        with pytest.raises(RefusedError, match="would overwrite"):
            run(toolbox, "preparesite", INPUT=source, SITE=table("mine"))
    with pytest.raises(RefusedError, match="same file"):
        run(toolbox, "preparesite", INPUT=site(), SITE=table("two"), PROBLEMS=table("two"))
    made = run(toolbox, "preparesite", INPUT=source, SITE=table("two"))
    assert made.layers["SITE"].featureCount() == 1


def test_two_outputs_do_not_share_a_file(toolbox, tmp_path: Path):
    path = str(tmp_path / "all.gpkg")
    with pytest.raises(RefusedError, match="same file"):
        run(toolbox, "designstreets", INPUT=site(), STREETS=path, BLOCKS=path)


def test_where_one_output_fails_none_is_kept(toolbox, tmp_path: Path):
    """As when the disk is full: the second sink refuses, the first is taken back."""
    streets, blocks = tmp_path / "s.gpkg", tmp_path / "b.nothing"
    with pytest.raises(FailedError, match="none was kept"):
        toolbox.run(
            "designstreets",
            check=False,
            INPUT=site(),
            TIME_LIMIT=2,
            STREETS=str(streets),
            BLOCKS=f"postgres:dbname='nobody' host=127.0.0.1 port=1 table=\"b\" ({blocks.stem})",
        )
    assert not streets.exists()


@pytest.mark.parametrize("error", [KeyError, KeyboardInterrupt, OSError])
def test_whatever_fails_while_writing_nothing_is_left(
    toolbox, package, monkeypatch, tmp_path: Path, error
):
    writer = package("plugin.outputs").Writer

    def fail(*_):
        raise error

    monkeypatch.setattr(writer, "_dress", fail)
    shapes, tables = tmp_path / "s.shp", tmp_path / "b.gpkg"
    with pytest.raises((FailedError, error)):
        toolbox.run("preparesite", INPUT=site(), SITE=str(shapes), BOUNDARY_STREETS=str(tables))
    assert list(tmp_path.iterdir()) == []


# Inside a model nobody checks before the run


@pytest.mark.parametrize("name", ON_THE_SITE)
def test_a_run_without_the_check_before_says_the_same(toolbox, name):
    with pytest.raises(FailedError, match="coordinate reference system"):
        toolbox.run(name, check=False, INPUT=site(crs=""))


def test_the_unforeseen_is_told_in_one_sentence(toolbox, package, monkeypatch):
    library = package("algorithms.site")

    def fall_over(*_args, **_options):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(library, "prepare_sites", fall_over)
    with pytest.raises(FailedError) as caught:
        run(toolbox, "preparesite", INPUT=site())
    text = str(caught.value)
    assert "ZeroDivisionError: division by zero" in text
    assert "Traceback" not in text
    assert "report" in text


# Cancel


@pytest.mark.parametrize("stage", ["Reading", "Preparing"])
@pytest.mark.parametrize("name", ON_THE_SITE)
def test_cancel_while_the_site_is_read_leaves_nothing(toolbox, name, stage):
    listener = Listener(cancel_at=stage)
    made = run(toolbox, name, listener=listener, INPUT=site())
    assert made.results == {}
    assert listener.warnings


def test_cancel_before_the_first_feature(toolbox):
    listener = Listener()
    listener.cancel()
    assert run(toolbox, "preparesite", listener=listener, INPUT=site()).results == {}
