"""Layouts improved through real QGIS: never worse, connected, in models and on their own."""

from __future__ import annotations

import sysconfig
import time

import pytest
from clock import allowed

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from qgis.core import QgsGeometry, QgsVectorLayer  # noqa: E402
from support import (  # noqa: E402
    Listener,
    RefusedError,
    X,
    Y,
    box,
    complaints_of,
    layer,
    line,
    roads,
    site,
)

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process


def ground():
    return layer([box(0, 0, 300, 225)], name="my site")


def streets(**options):
    return layer(
        [line((0, 70), (150, 62), (300, 68)), line((0, 140), (150, 152), (300, 147))],
        kind="LineString", name="my streets",
        fields="field=width_m:double&field=name:string(20)&field=length_m:double",
        values=[[15.0, "A Street", 300.0], [15.0, None, 300.0]], **options,
    )  # fmt: skip


def area(rows):
    return sum(row["geometry"].area() for row in rows)


complaint = complaints_of("optimiselayout")


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run("optimiselayout", INPUT_STREETS=streets(), SITE=ground())


def test_streets_move_and_parcels_are_better(made):
    told = made.results
    assert told["P_ANGLE_AFTER"] < told["P_ANGLE_BEFORE"]
    assert told["P_AREA_AFTER"] <= told["P_AREA_BEFORE"] + 1e-3
    assert told["BETTER"] == 1
    rows = made.rows("STREETS")
    assert [row["name"] or None for row in rows] == ["A Street", None]
    assert told["LARGEST_MOVE"] == pytest.approx(max(row["moved_m"] for row in rows))
    assert 1 < told["LARGEST_MOVE"] < 15
    for row in rows:
        assert row["length_m"] == pytest.approx(row["geometry"].length())
    lots = [row for row in made.rows("PARCELS") if row["land_use"] == "parcel"]
    assert told["PARCELS_AFTER"] == len(lots) > 80
    assert told["P_ANGLE_AFTER"] == pytest.approx(sum(r["p_angle"] for r in lots) / len(lots))
    space = QgsGeometry.unaryUnion([row["geometry"].buffer(7.49, 8) for row in rows])
    whole = QgsGeometry.unaryUnion([row["geometry"] for row in made.rows("PARCELS")])
    assert whole.intersection(space).area() < 30
    assert whole.area() == pytest.approx(area(made.rows("PARCELS")), rel=1e-6)


def test_parcels_say_how_large_they_are_to_be(toolbox, made):
    run = toolbox.run(
        "optimiselayout", INPUT_STREETS=streets(), INPUT_PARCELS=made.layers["PARCELS"],
        SITE=ground(),
    )  # fmt: skip
    assert run.results["P_ANGLE_BEFORE"] == pytest.approx(made.results["P_ANGLE_AFTER"])
    size = next(text for text in run.said.infos if "m wide" in text)
    lots = [row for row in made.rows("PARCELS") if row["land_use"] == "parcel"]
    widths = sorted(row["width_m"] for row in lots)
    middle = (widths[(len(widths) - 1) // 2] + widths[len(widths) // 2]) / 2
    assert f"{middle:.1f} m wide" in size


def test_a_good_layout_stays_as_it_is(toolbox, made):
    run = toolbox.run(
        "optimiselayout", INPUT_STREETS=made.layers["STREETS"],
        INPUT_PARCELS=made.layers["PARCELS"], SITE=ground(), PARCEL_WIDTH=18, PARCEL_DEPTH=30,
    )  # fmt: skip
    assert run.results["P_ANGLE_AFTER"] <= run.results["P_ANGLE_BEFORE"] + 0.2
    if not run.results["BETTER"]:
        for key in ("PARCELS", "STREETS"):
            one, other = ([row["geometry"].asWkb() for row in own.rows(key)] for own in (made, run))
            assert one == other
        assert run.results["LARGEST_MOVE"] == 0
        assert any("as it was" in text for text in run.said.infos)


def test_obstacles_stay_free(toolbox):
    pond = box(120, 80, 180, 130)
    run = toolbox.run(
        "optimiselayout", INPUT_STREETS=streets(), SITE=ground(), OBSTACLES=layer([pond])
    )
    whole = QgsGeometry.unaryUnion([row["geometry"] for row in run.rows("PARCELS")])
    assert whole.intersection(QgsGeometry.fromWkt(pond)).area() < 0.1
    assert run.results["PARCELS_AFTER"] > 60


def test_parcels_alone_keep_their_block(toolbox):
    lean = [0, 3, -3, 3, -3, 0]
    rows = []
    for k in range(5):
        ring = [(18 * k + lean[k], 0), (18 * (k + 1) + lean[k + 1], 0),
                (18 * (k + 1) - lean[k + 1], 30), (18 * k - lean[k], 30)]  # fmt: skip
        ring.append(ring[0])
        rows.append(f"POLYGON(({','.join(f'{X + x} {Y + y}' for x, y in ring)}))")
    given = layer(rows, name="lots", fields="field=parcel_id:integer&field=owner:string(9)",
                  values=[[k + 5, f"owner {k}"] for k in range(5)])  # fmt: skip
    run = toolbox.run("optimiselayout", INPUT_PARCELS=given)
    assert run.results["P_ANGLE_AFTER"] < 0.5 * run.results["P_ANGLE_BEFORE"]
    after = run.rows("PARCELS")
    assert [row["parcel_id"] for row in after] == [5, 6, 7, 8, 9]
    assert [row["owner"] for row in after] == [f"owner {k}" for k in range(5)]
    whole = QgsGeometry.unaryUnion([row["geometry"] for row in after])
    assert whole.symDifference(QgsGeometry.fromWkt(box(0, 0, 90, 30))).area() < 1e-3
    assert run.layers["STREETS"].featureCount() == 0


def test_streets_of_a_design_are_improved(toolbox):
    design = toolbox.run("designstreets", INPUT=site(), ROADS=roads(), TIME_LIMIT=2)
    run = toolbox.run(
        "optimiselayout", INPUT_STREETS=design.layers["STREETS"], SITE=site(), ROADS=roads()
    )
    assert len(run.rows("STREETS")) == len(design.rows("STREETS"))
    before = design.rows("STREETS")
    for one, other in zip(before, run.rows("STREETS")):
        assert one["street_id"] == other["street_id"]
        if one["status"] != "new":
            assert one["geometry"].asWkb() == other["geometry"].asWkb()
    lines = QgsGeometry.unaryUnion([row["geometry"] for row in run.rows("STREETS")])
    first = QgsGeometry.unaryUnion([row["geometry"] for row in before])
    assert lines.length() == pytest.approx(first.length(), rel=0.05)
    assert run.results["P_ANGLE_AFTER"] <= run.results["P_ANGLE_BEFORE"] + 0.5


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857"])
def test_any_crs(toolbox, made, crs):
    from test_parcelblocks import in_crs

    plain = layer([f.geometry() for f in streets().getFeatures()], kind="LineString")
    run = toolbox.run(
        "optimiselayout", INPUT_STREETS=in_crs(plain, crs, "LineString"),
        SITE=in_crs(ground(), "EPSG:4326", "Polygon"), WIDTH_LOCAL=15,
    )  # fmt: skip
    assert run.layers["STREETS"].crs().authid() == crs
    assert run.layers["PARCELS"].crs().authid() == crs
    assert run.results["PARCELS_AFTER"] == pytest.approx(made.results["PARCELS_AFTER"], abs=6)


def test_inputs_are_not_modified(toolbox):
    lines, land = streets(), ground()
    before = [[f.geometry().asWkb() for f in own.getFeatures()] for own in (lines, land)]
    toolbox.run("optimiselayout", INPUT_STREETS=lines, SITE=land)
    after = [[f.geometry().asWkb() for f in own.getFeatures()] for own in (lines, land)]
    assert before == after


def test_what_cannot_be_used_is_refused_with_the_way_out(toolbox):
    assert "nothing to improve" in complaint(toolbox)
    assert "nothing to improve" in complaint(toolbox, SITE=ground())
    assert "how far the land" in complaint(toolbox, INPUT_STREETS=streets())
    assert "'my streets'" in complaint(toolbox, INPUT_STREETS=streets(crs=""), SITE=ground())
    none = layer([], kind="LineString", name="none")
    assert "'none'" in complaint(toolbox, INPUT_STREETS=none, SITE=ground())
    hollow = layer([None], name="hollow")
    assert "'hollow'" in complaint(toolbox, INPUT_PARCELS=hollow)
    assert "'hollow'" in complaint(toolbox, INPUT_STREETS=streets(), SITE=hollow)
    twice = layer([box(0, 0, 9, 9)] * 2, fields="field=variation:integer", values=[[1], [2]])
    assert "2 variations" in complaint(toolbox, INPUT_PARCELS=twice)
    with pytest.raises(RefusedError):
        toolbox.run("optimiselayout", INPUT_STREETS=streets(), SITE=ground(), PARCEL_WIDTH=0)


def test_odd_streets_are_left_alone(toolbox):
    two = QgsGeometry.fromWkt(line((0, 75), (300, 75))).combine(
        QgsGeometry.fromWkt(line((20, 150), (280, 150)))
    )
    odd = layer(
        [two, None, line((150, 75), (150, 110)), "LINESTRING EMPTY"], kind="MultiLineString"
    )
    run = toolbox.run("optimiselayout", INPUT_STREETS=odd, SITE=ground(), WIDTH_LOCAL=15)
    assert run.results["PARCELS_AFTER"] > 40


@pytest.mark.parametrize("stage", ["Cutting blocks", "Improving streets"])
def test_a_cancelled_run_stops_soon(toolbox, stage):
    watch = Listener(cancel_at=stage)
    pressed = []
    watch.canceled.connect(lambda: pressed.append(time.monotonic()))
    run = toolbox.run("optimiselayout", INPUT_STREETS=streets(), SITE=ground(), listener=watch)
    assert time.monotonic() - pressed[0] < allowed(1.5)
    if run.layers:
        assert run.results["P_ANGLE_AFTER"] <= run.results["P_ANGLE_BEFORE"] + 0.5


def test_in_a_process_of_its_own_it_gives_the_same(toolbox, made, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    there = toolbox.run("optimiselayout", INPUT_STREETS=streets(), SITE=ground())
    assert any("a process of its own" in text for text in there.said.warnings)
    for key in ("STREETS", "PARCELS"):
        for one, other in zip(made.rows(key), there.rows(key)):
            # another process sums in another order: the last of 16 digits may differ
            assert one["geometry"].constGet().nCoordinates() == (
                other["geometry"].constGet().nCoordinates()
            )
            assert one["geometry"].hausdorffDistance(other["geometry"]) < 1e-6


def test_in_a_model_behind_designstreets_and_parcelblocks(toolbox):
    from qgis.core import (
        QgsProcessingModelAlgorithm,
        QgsProcessingModelChildAlgorithm,
        QgsProcessingModelChildParameterSource,
        QgsProcessingModelOutput,
        QgsProcessingModelParameter,
        QgsProcessingParameterFeatureSource,
    )
    from test_models import run

    source = QgsProcessingModelChildParameterSource
    model = QgsProcessingModelAlgorithm("layout", "tests")
    for name in ("ground", "around"):
        parameter = QgsProcessingParameterFeatureSource(name, name)
        model.addModelParameter(parameter, QgsProcessingModelParameter(name))

    def child(name, values, **inputs):
        made = QgsProcessingModelChildAlgorithm(f"platwright:{name}")
        made.setChildId(name)
        for key, given in inputs.items():
            made.addParameterSources(key, [given])
        for key, value in values.items():
            made.addParameterSources(key, [source.fromStaticValue(value)])
        return made

    ground_, around = source.fromModelParameter("ground"), source.fromModelParameter("around")
    lines = source.fromChildOutput("designstreets", "STREETS")
    lots = source.fromChildOutput("parcelblocks", "PARCELS")
    better = source.fromChildOutput("optimiselayout", "PARCELS")
    ways = source.fromChildOutput("optimiselayout", "STREETS")
    model.addChildAlgorithm(child("designstreets", {"TIME_LIMIT": 2}, INPUT=ground_, ROADS=around))
    model.addChildAlgorithm(child("parcelblocks", {}, STREETS=lines, SITE=ground_))
    model.addChildAlgorithm(
        child("optimiselayout", {}, INPUT_STREETS=lines, INPUT_PARCELS=lots, SITE=ground_)
    )
    last = child(
        "resplitlayout", {"WHERE": "block_id = 1", "PARCEL_WIDTH": 25.0},
        INPUT=better, INPUT_STREETS=ways,
    )  # fmt: skip
    output = QgsProcessingModelOutput("parcels", "Parcels")
    output.setChildId("resplitlayout")
    output.setChildOutputName("PARCELS")
    last.setModelOutputs({"parcels": output})
    model.addChildAlgorithm(last)
    made, said = run(model, ground=site(), around=roads())
    assert made is not None, said.errors
    changes = [f["change"] for f in made.getFeatures()]
    assert {"kept", "new"} == set(changes)


def test_through_qgis_process(qgis_process, toolbox, tmp_path):
    from qgis.core import QgsCoordinateTransformContext, QgsVectorFileWriter

    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = "GPKG"
    paths = {}
    for key, own in (("INPUT_STREETS", streets()), ("SITE", ground())):
        paths[key] = tmp_path / f"{key}.gpkg"
        QgsVectorFileWriter.writeAsVectorFormatV3(
            own, str(paths[key]), QgsCoordinateTransformContext(), options
        )
    made = tmp_path / "made.gpkg"
    said = qgis_process(
        "run", "platwright:optimiselayout", "--",
        *(f"{key}={path}" for key, path in paths.items()), f"STREETS={made}",
    )  # fmt: skip
    assert "LARGEST_MOVE" in said
    assert QgsVectorLayer(str(made), "stored", "ogr").featureCount() == 2
