"""Parts of layouts made anew, through real QGIS: nothing else changes."""

from __future__ import annotations

import sysconfig

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from qgis.core import (  # noqa: E402
    QgsGeometry,
    QgsProcessingFeatureSourceDefinition,
    QgsProject,
    QgsVectorLayer,
)
from support import Listener, box, complaints_of, layer, line, site  # noqa: E402

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process


@pytest.fixture(scope="module")
def layout(toolbox):
    return toolbox.run("splitsite", INPUT=site(), VARIATIONS=1, EFFORT=2)


def given(layout, **more):
    return {"INPUT": layout.layers["PARCELS"], "INPUT_STREETS": layout.layers["STREETS"], **more}


def rows_of(made):
    names = made.fields().names()
    return {
        f["parcel_id"]: (f.geometry().asWkb(), dict(zip(names, f.attributes())))
        for f in made.getFeatures()
    }


def unchanged(layout, run, gone):
    """All parcels but those of some numbers are as they were, bit by bit."""
    before, after = rows_of(layout.layers["PARCELS"]), rows_of(run.layers["PARCELS"])
    kept = [number for number in before if number not in gone]
    assert kept
    for number in kept:
        assert before[number][0] == after[number][0]
        own = after[number][1]
        assert own["change"] == "kept"
        for name, value in before[number][1].items():
            assert own[name] == value, (number, name)
    return {number: row for number, row in after.items() if row[1]["change"] != "kept"}


def land(layout, numbers):
    rows = rows_of(layout.layers["PARCELS"])
    shapes = []
    for number in numbers:
        shapes.append(QgsGeometry())
        shapes[-1].fromWkb(rows[number][0])
    return QgsGeometry.unaryUnion(shapes)


def of_block(layout, block):
    return [r["parcel_id"] for r in layout.rows("PARCELS") if r["block_id"] == block]


complaint = complaints_of("resplitlayout")


def test_a_block_is_cut_anew(toolbox, layout):
    gone = of_block(layout, 2)
    run = toolbox.run("resplitlayout", **given(layout, WHERE="block_id = 2", PARCEL_WIDTH=25))
    new = unchanged(layout, run, gone)
    assert (run.results["CHOSEN"], run.results["MADE"]) == (len(gone), len(new))
    assert run.results["KEPT"] == len(run.rows("PARCELS")) - len(new)
    made = QgsGeometry.unaryUnion(
        [row["geometry"] for row in run.rows("PARCELS") if row["change"] == "new"]
    )
    before = land(layout, gone)
    assert made.symDifference(before).area() < 1e-3
    lots = [row for _, row in new.values() if row["land_use"] == "parcel"]
    assert 0 < len(lots) < len(gone)
    for row in lots:
        assert row["block_id"] == 2
        assert row["site_id"] == 1
        assert row["frontage_m"] >= 6
        assert row["p_angle"] >= 0
        assert row["undesirable"] in (True, False)
    assert min(new) > max(rows_of(layout.layers["PARCELS"]))
    # fields of the input come first, in their order and with their types
    names = [f.name() for f in layout.layers["PARCELS"].fields()]
    after = [f.name() for f in run.layers["PARCELS"].fields()]
    assert [n for n in after if n not in ("land_use", "note", "change")] == [
        n for n in names if n not in ("land_use", "note")
    ]
    for f in layout.layers["PARCELS"].fields():
        assert run.layers["PARCELS"].fields().field(f.name()).type() == f.type()
    assert len(run.rows("STREETS")) == len(layout.rows("STREETS"))


def test_an_area_chooses_and_streets_are_laid_anew(toolbox, layout):
    area = layer([box(60, 30, 180, 140)], name="my area")
    run = toolbox.run(
        "resplitlayout", **given(layout, AREA=area, ACTION="streets", SEED=3, EFFORT=1)
    )
    frame = QgsGeometry.fromWkt(box(60, 30, 180, 140))
    gone = [
        r["parcel_id"] for r in layout.rows("PARCELS")
        if r["geometry"].intersection(frame).area() > 0.5 * r["geometry"].area()
    ]  # fmt: skip
    assert run.results["CHOSEN"] == len(gone) > 5
    unchanged(layout, run, gone)
    before = {r["street_id"]: r["geometry"].asWkb() for r in layout.rows("STREETS")}
    for row in run.rows("STREETS"):
        if row["change"] == "kept":
            assert row["geometry"].asWkb() == before[row["street_id"]]
        else:
            assert row["street_id"] not in before
            assert row["width_m"] == 15
            assert row["length_m"] > 0
    shapes = [row["geometry"] for row in run.rows("PARCELS")]
    whole = QgsGeometry.unaryUnion(shapes)
    assert whole.area() == pytest.approx(sum(s.area() for s in shapes), rel=1e-6)


def test_the_selection_of_the_map_is_an_area(toolbox, layout):
    parcels = layout.layers["PARCELS"]
    QgsProject.instance().addMapLayer(parcels, False)
    try:
        parcels.selectByExpression("block_id = 1")
        chosen = QgsProcessingFeatureSourceDefinition(parcels.id(), True)
        run = toolbox.run(
            "resplitlayout", INPUT=parcels.id(), AREA=chosen, ACTION="use", USE="school"
        )
        text = complaint(toolbox, INPUT=chosen, WHERE="true")
        assert "Selected features only" in text
    finally:
        parcels.removeSelection()
        QgsProject.instance().takeMapLayer(parcels)
    changed = unchanged(layout, run, of_block(layout, 1))
    assert set(changed) == set(of_block(layout, 1))
    assert {row["land_use"] for _, row in changed.values()} == {"school"}
    assert {row["change"] for _, row in changed.values()} == {"use"}
    before = rows_of(parcels)
    for number, (shape, _) in changed.items():
        assert shape == before[number][0]


def test_parcels_are_merged(toolbox, layout):
    gone = of_block(layout, 1)
    run = toolbox.run("resplitlayout", **given(layout, WHERE="block_id = 1", ACTION="merge"))
    ((_, row),) = unchanged(layout, run, gone).values()
    assert row["change"] == "merged"
    assert row["area_m2"] == pytest.approx(land(layout, gone).area())
    park = toolbox.run(
        "resplitlayout", **given(layout, WHERE="block_id = 1", ACTION="merge", USE="park")
    )
    ((_, row),) = unchanged(layout, park, gone).values()
    assert row["land_use"] == "park"
    assert park.results["MADE"] == 1


def test_foreign_fields_and_parts_stay(toolbox):
    one = [QgsGeometry.fromWkt(own) for own in (box(0, 0, 120, 60), box(120, 0, 60, 60))]
    for own in one:
        own.convertToMultiType()
    two = QgsGeometry.fromWkt(box(200, 0, 20, 30)).combine(QgsGeometry.fromWkt(box(240, 0, 20, 30)))
    parcels = layer(
        [*one, two, None], kind="MultiPolygon",
        fields="field=parcel_id:string(10)&field=owner:string(20)&field=area_m2:integer",
        values=[["A1", "Ann", 7200], ["A2", "Bob", 3600], ["A3", None, None], ["A4", "Eve", 1]],
        name="cadastre",
    )  # fmt: skip
    before = [(f.geometry().asWkb(), f.attributes()) for f in parcels.getFeatures()]
    run = toolbox.run("resplitlayout", INPUT=parcels, WHERE="\"owner\" = 'Ann'")
    rows = run.rows("PARCELS")
    kept = [row for row in rows if row["change"] == "kept"]
    assert [row["parcel_id"] for row in kept] == ["A2", "A3", "A4"]
    assert [row["owner"] or None for row in kept] == ["Bob", None, "Eve"]
    for row, (shape, _) in zip(kept, before[1:]):
        assert row["geometry"].asWkb() == shape or row["geometry"].isNull()
    new = [row for row in rows if row["change"] == "new"]
    assert len(new) > 6
    assert {row["land_use"] for row in new} <= {"parcel", "green", "court", "lane"}
    assert sum(row["geometry"].area() for row in new) == pytest.approx(7200)
    # a whole number takes no decimals, and words no numbers of ours
    assert all(row["area_m2"] is None or isinstance(row["area_m2"], int) or not row["area_m2"]
               for row in new)  # fmt: skip
    after = [(f.geometry().asWkb(), f.attributes()) for f in parcels.getFeatures()]
    assert before == after


def test_degrees_are_measured_in_metres(toolbox, layout):
    from test_parcelblocks import in_crs

    parcels = layer([box(0, 0, 120, 60), box(120, 0, 60, 60)], name="parcels")
    there = in_crs(parcels, "EPSG:4326", "Polygon")
    run = toolbox.run("resplitlayout", INPUT=there, WHERE="$id = 1")
    here = toolbox.run("resplitlayout", INPUT=parcels, WHERE="$id = 1")
    assert run.layers["PARCELS"].crs().authid() == "EPSG:4326"
    assert run.results["MADE"] == pytest.approx(here.results["MADE"], abs=2)
    second = [f.geometry().asWkb() for f in there.getFeatures()][1]
    assert second in [row["geometry"].asWkb() for row in run.rows("PARCELS")]


def test_roads_say_where_the_edge_has_access(toolbox):
    parcels = layer([box(0, 0, 120, 60)])
    road = layer([line((-50, -8), (170, -8))], kind="LineString", name="road")
    run = toolbox.run("resplitlayout", INPUT=parcels, WHERE="true", ROADS=road)
    south = QgsGeometry.fromWkt(box(0, -1, 120, 1.1))
    for row in run.rows("PARCELS"):
        if row["land_use"] == "parcel":
            outline = QgsGeometry(row["geometry"].constGet().boundary())
            assert outline.intersection(south).length() > 5


def test_the_same_seed_gives_the_same(toolbox, layout):
    runs = [
        toolbox.run("resplitlayout", **given(layout, WHERE="block_id < 3", SEED=9))
        for _ in range(2)
    ]
    shapes = [[r["geometry"].asWkb() for r in run.rows("PARCELS")] for run in runs]
    assert shapes[0] == shapes[1]


def test_what_cannot_be_done_is_refused_with_the_way_out(toolbox, layout):
    parcels = layout.layers["PARCELS"]
    assert "Nothing says which" in complaint(toolbox, INPUT=parcels)
    assert "no layer of streets" in complaint(
        toolbox, INPUT=parcels, WHERE="true", ACTION="streets"
    )
    assert "No use is given" in complaint(toolbox, INPUT=parcels, WHERE="true", ACTION="use")
    assert "Nothing is chosen" in complaint(toolbox, INPUT=parcels, WHERE="block_id = 999")
    assert "colour" in complaint(toolbox, INPUT=parcels, WHERE="colour = 2")
    assert "no condition" in complaint(toolbox, INPUT=parcels, WHERE="block_id = = 2")
    assert "'bare'" in complaint(toolbox, INPUT=layer([box(0, 0, 9, 9)], crs="", name="bare"),
                                 WHERE="true")  # fmt: skip
    assert "'none'" in complaint(toolbox, INPUT=layer([], name="none"), WHERE="true")
    assert "'hollow'" in complaint(toolbox, INPUT=layer([None], name="hollow"), WHERE="true")
    assert "least area" in complaint(
        toolbox, INPUT=parcels, WHERE="true", MIN_AREA=900, MAX_AREA=800
    )


def test_several_variations_are_told_apart(toolbox):
    twice = layer(
        [box(0, 0, 120, 60), box(0, 0, 120, 60)], fields="field=variation:integer",
        values=[[1], [2]],
    )  # fmt: skip
    assert "2 variations" in complaint(toolbox, INPUT=twice, WHERE="true")
    run = toolbox.run("resplitlayout", INPUT=twice, WHERE="variation = 2")
    rows = run.rows("PARCELS")
    assert [row["variation"] for row in rows if row["change"] == "kept"] == [1]
    assert {row["variation"] for row in rows if row["change"] == "new"} == {2}


def test_a_cancelled_run_writes_nothing(toolbox, layout):
    watch = Listener(cancel_at="utting blocks")
    run = toolbox.run("resplitlayout", **given(layout, WHERE="true"), listener=watch)
    assert run.layers == {}


def test_in_a_process_of_its_own_it_gives_the_same(toolbox, layout, monkeypatch):
    asked = given(layout, WHERE="block_id = 2", PARCEL_WIDTH=25)
    here = toolbox.run("resplitlayout", **asked)
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    there = toolbox.run("resplitlayout", **asked)
    assert any("a process of its own" in text for text in there.said.warnings)
    unchanged(layout, there, of_block(layout, 2))
    assert len(here.rows("PARCELS")) == len(there.rows("PARCELS"))


def test_through_qgis_process(qgis_process, layout, tmp_path, toolbox):
    files = {key: tmp_path / f"{key}.gpkg" for key in ("PARCELS", "STREETS")}
    toolbox.run(
        "splitsite", INPUT=site(), VARIATIONS=1, EFFORT=2,
        **{key: str(path) for key, path in files.items()},
    )  # fmt: skip
    made = tmp_path / "made.gpkg"
    said = qgis_process(
        "run", "platwright:resplitlayout", "--", f"INPUT={files['PARCELS']}",
        f"INPUT_STREETS={files['STREETS']}", "WHERE=block_id = 2", "PARCEL_WIDTH=25",
        f"PARCELS={made}",
    )  # fmt: skip
    assert "CHOSEN" in said
    stored = QgsVectorLayer(str(made), "stored", "ogr")
    changes = {f["change"] for f in stored.getFeatures()}
    assert changes == {"kept", "new"}
    before = {f["parcel_id"]: f.geometry().asWkb() for f in
              QgsVectorLayer(str(files["PARCELS"]), "before", "ogr").getFeatures()}  # fmt: skip
    for f in stored.getFeatures():
        if f["change"] == "kept":
            assert f.geometry().asWkb() == before[f["parcel_id"]]
