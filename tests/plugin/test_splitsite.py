"""Streets and parcels of a site together, through real QGIS."""

from __future__ import annotations

import json
import sysconfig
import time

import pytest
from clock import allowed

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from qgis.core import QgsGeometry, QgsVectorLayer  # noqa: E402
from support import (  # noqa: E402
    METRES,
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

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process

QUICK = {"VARIATIONS": 1, "EFFORT": 2}


def skew():
    ring = [(0, 0), (320, 30), (300, 240), (0, 200), (0, 0)]
    return layer([f"POLYGON(({','.join(f'{X + x} {Y + y}' for x, y in ring)}))"])


def area(rows):
    return sum(row["geometry"].area() for row in rows)


def union(rows):
    return QgsGeometry.unaryUnion([row["geometry"] for row in rows])


def shapes(run, key):
    return [row["geometry"].asWkb() for row in run.rows(key)]


def complaint(toolbox, **parameters):
    with pytest.raises((RefusedError, FailedError)) as caught:
        toolbox.run("splitsite", **{**QUICK, **parameters})
    text = str(caught.value)
    assert text.rstrip().endswith((".", ")"))
    for stray in ("Traceback", 'File "', "something went wrong", "NoneType", "Error:"):
        assert stray not in text
    return text


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run("splitsite", INPUT=site(), ROADS=roads(), **QUICK)


@pytest.fixture(scope="module")
def several(toolbox):
    return toolbox.run("splitsite", INPUT=skew(), VARIATIONS=3, KEEP=3, EFFORT=1, SEED=5)


def test_parcels_and_streets_tile_the_site(made):
    rows, streets = made.rows("PARCELS"), made.rows("STREETS")
    assert union(rows).area() == pytest.approx(area(rows), rel=1e-6)
    assert union(rows).difference(QgsGeometry.fromWkt(box(0, 0, 300, 200))).area() < 0.1
    space = QgsGeometry.unaryUnion(
        [row["geometry"].buffer(row["width_m"] / 2 - 0.02, 8) for row in streets]
    )
    assert union(rows).intersection(space).area() < 30
    lots = [row for row in rows if row["land_use"] == "parcel"]
    assert len(lots) > 60
    assert all(row["access"] for row in lots)
    assert {row["variation"] for row in rows} == {1}
    blocks = made.rows("BLOCKS")
    assert area(blocks) == pytest.approx(area(rows), rel=1e-6)
    assert sum(row["parcels"] for row in blocks) == len(lots)


def test_numbers_tell_of_the_best_variation(made):
    told = made.results
    lots = [row for row in made.rows("PARCELS") if row["land_use"] == "parcel"]
    assert told["PARCEL_COUNT"] == len(lots)
    assert told["MEAN_P_ANGLE"] == pytest.approx(sum(r["p_angle"] for r in lots) / len(lots))
    assert told["UNDESIRABLE"] == pytest.approx(
        100 * sum(r["undesirable"] for r in lots) / len(lots)
    )
    inner = sum(r["geometry"].length() for r in made.rows("STREETS") if r["status"] == "new")
    assert told["STREET_LENGTH"] >= inner - 0.1
    assert told["STREET_SHARE"] == pytest.approx(
        100 - 100 * area(made.rows("PARCELS")) / 60000, abs=0.1
    )
    assert told["MADE"] == 1
    (row,) = made.rows("VARIATION_TABLE")
    assert row["score"] == pytest.approx(told["SCORE"])
    assert row["parcels"] == len(lots)


def test_the_log_tells_of_every_variation(several):
    rows = several.rows("VARIATION_TABLE")
    lines = [text for text in several.said.infos if text.startswith("Variation ")]
    assert [text.split(" parcels")[0] for text in lines] == [
        f"Variation {row['variation']}: {row['parcels']}" for row in rows
    ]


def test_a_site_without_any_parcel_is_told_loudly(toolbox):
    run = toolbox.run("splitsite", INPUT=layer([box(0, 0, 12, 9)]), **QUICK)
    assert run.results["PARCEL_COUNT"] == 0
    assert any("No parcel fits" in text for text in run.said.warnings)


def test_variations_lie_on_each_other_and_the_best_is_shown(several, package):
    from qgis.core import QgsRenderContext

    count = int(several.results["MADE"])
    assert count > 1
    numbers = {row["variation"] for row in several.rows("PARCELS")}
    assert (
        numbers == {row["variation"] for row in several.rows("STREETS")} == set(range(1, count + 1))
    )
    table = several.rows("VARIATION_TABLE")
    assert [row["score"] for row in table] == sorted(row["score"] for row in table)
    styles, kinds = package("plugin.styles"), package("plugin.parcel_fields")
    for key, kind in (("PARCELS", kinds.LAYOUT_PARCELS), ("STREETS", kinds.LAYOUT_STREETS),
                      ("BLOCKS", kinds.LAYOUT_BLOCKS)):  # fmt: skip
        shown = several.layers[key]
        styles.apply(shown, kind)
        styles.offer_others(shown, kind)
        assert shown.renderer().type() == "RuleRenderer"
        rules = shown.renderer().rootRule().children()
        assert [rule.active() for rule in rules] == [True] + [False] * (count - 1)
        assert all(rule.children() for rule in rules)
        context = QgsRenderContext()
        context.setExtent(shown.extent())
        context.expressionContext().appendScope(shown.createExpressionContextScope())
        renderer = shown.renderer().clone()
        renderer.startRender(context, shown.fields())
        for feature in shown.getFeatures():
            context.expressionContext().setFeature(feature)
            drawn = bool(renderer.symbolsForFeature(feature, context))
            assert drawn == (feature["variation"] == 1), (key, feature.attributes())
        renderer.stopRender(context)
    styled = several.layers["PARCELS"].styleManager()
    assert "Quality" in styled.styles()


def test_one_variation_has_the_plain_style(made, package):
    styles, kinds = package("plugin.styles"), package("plugin.parcel_fields")
    shown = made.layers["PARCELS"]
    styles.apply(shown, kinds.LAYOUT_PARCELS)
    assert shown.renderer().type() == "categorizedSymbol"


def test_the_table_compares_all_and_the_layers_keep_the_best(toolbox):
    run = toolbox.run("splitsite", INPUT=skew(), VARIATIONS=3, EFFORT=1, SEED=5)
    assert {row["variation"] for row in run.rows("PARCELS")} == {1}
    assert len(run.rows("VARIATION_TABLE")) == run.results["MADE"] > 1


def test_why_is_shown_where_it_is_asked_for(made, toolbox, package):
    crosses, candidates = made.rows("CROSS_FIELD"), made.rows("CANDIDATES")
    ground = QgsGeometry.fromWkt(box(-20, -20, 340, 240))
    assert len(crosses) > 50
    for row in crosses:
        assert ground.contains(row["geometry"])
        # the field of a rectangle is parallel to it
        assert min(row["angle_deg"], 90 - row["angle_deg"]) < 1
    ranks = [row["rank"] for row in candidates if row["rank"]]
    assert sorted(ranks) == list(range(1, len(ranks) + 1))
    assert all(bool(row["reason"]) == (row["rank"] == 0) for row in candidates)
    by_rank = sorted((row for row in candidates if row["rank"]), key=lambda row: row["rank"])
    assert [row["quality"] for row in by_rank] == sorted(row["quality"] for row in by_rank)
    for row in candidates:
        assert row["length_m"] == pytest.approx(row["geometry"].length(), rel=1e-3)
    tool = toolbox.tool("splitsite")
    for key in ("CROSS_FIELD", "CANDIDATES"):
        assert tool.parameterDefinition(key).createByDefault() is False
    assert tool.parameterDefinition("PARCELS").createByDefault() is True
    styles, kinds = package("plugin.styles"), package("plugin.parcel_fields")
    styles.apply(made.layers["CANDIDATES"], kinds.CANDIDATES)
    assert made.layers["CANDIDATES"].renderer().type() == "graduatedSymbol"
    without = toolbox.run("splitsite", INPUT=site(), CROSS_FIELD=None, CANDIDATES=None, **QUICK)
    assert {"CROSS_FIELD", "CANDIDATES"}.isdisjoint(without.layers)


def test_key_areas_main_streets_and_obstacles_are_heard(toolbox):
    keys = layer(
        [box(120, 110, 50, 40), box(20, 20, 30, 30)],
        fields="field=use:string(20)&field=around:string(5)",
        values=[["school", None], ["lake", "no"]], name="keys",
    )  # fmt: skip
    main = layer(
        [line((0, 80), (300, 80))], kind="LineString", name="main",
        fields="field=width_m:double&field=name:string(20)", values=[[20.0, "High Street"]],
    )  # fmt: skip
    house = layer([box(250, 150, 20, 20)], name="house")
    run = toolbox.run(
        "splitsite", INPUT=site(), KEY_ELEMENTS=keys, KEY_STREETS=main, OBSTACLES=house, **QUICK
    )
    rows = run.rows("PARCELS")
    uses = [row["land_use"] for row in rows]
    assert uses.count("school") == uses.count("lake") == 1
    (lake,) = [row for row in rows if row["land_use"] == "lake"]
    assert lake["geometry"].area() == pytest.approx(900)
    assert union(rows).intersection(QgsGeometry.fromWkt(box(250, 150, 20, 20))).area() < 0.1
    high = [row for row in run.rows("STREETS") if row["name"] == "High Street"]
    assert sum(row["geometry"].length() for row in high) == pytest.approx(300)
    lots = [row for row in rows if row["land_use"] == "parcel"]
    way = QgsGeometry.fromWkt(line((0, 80), (300, 80))).buffer(9.9, 8)
    assert union(lots).intersection(way).area() < 0.5


def test_guide_lines_lead_the_streets(toolbox):
    guides = layer([line((0, 0), (300, 200))], kind="LineString", name="guides")
    run = toolbox.run("splitsite", INPUT=site(), FIELD="guided", GUIDES=guides, **QUICK)
    crosses = run.rows("CROSS_FIELD")
    slanted = [row for row in crosses if 15 < row["angle_deg"] < 75]
    assert len(slanted) > 10


def test_any_crs_and_odd_polygons(toolbox, made):
    from test_parcelblocks import in_crs

    run = toolbox.run(
        "splitsite", INPUT=in_crs(site(), "EPSG:4326", "Polygon"),
        ROADS=in_crs(roads(), "EPSG:3857", "LineString"), **QUICK,
    )  # fmt: skip
    assert run.layers["PARCELS"].crs().authid() == "EPSG:4326"
    assert run.results["PARCEL_COUNT"] == pytest.approx(made.results["PARCEL_COUNT"], rel=0.1)
    odd = QgsGeometry.fromWkt(box(0, 0, 200, 150)).combine(
        QgsGeometry.fromWkt(box(300, 0, 180, 140))
    )
    odd.get().addZValue(3.0)
    two = toolbox.run(
        "splitsite", INPUT=layer([odd, None, "POLYGON EMPTY"], kind="MultiPolygonZ"), **QUICK
    )
    assert {row["site_id"] for row in two.rows("PARCELS")} == {1, 2}
    told = {row["problem"].split(":")[0] for row in two.rows("PROBLEMS")}
    assert {"has 2 parts", "geometry is NULL"} <= told


def test_the_same_seed_gives_the_same(toolbox, made):
    again = toolbox.run("splitsite", INPUT=site(), ROADS=roads(), **QUICK)
    assert shapes(made, "PARCELS") == shapes(again, "PARCELS")
    assert shapes(made, "STREETS") == shapes(again, "STREETS")


def test_inputs_are_not_modified(toolbox):
    given = site()
    before = [f.geometry().asWkb() for f in given.getFeatures()]
    toolbox.run("splitsite", INPUT=given, **QUICK)
    assert [f.geometry().asWkb() for f in given.getFeatures()] == before
    assert not given.isEditable()


def test_what_cannot_be_used_is_refused_with_the_way_out(toolbox):
    assert "'my site'" in complaint(toolbox, INPUT=site(crs=""))
    assert "'empty'" in complaint(toolbox, INPUT=layer([], name="empty"))
    assert "'hollow'" in complaint(toolbox, INPUT=layer([None], name="hollow"))
    spots = layer([point(0, 0)], kind="Point", name="spots")
    assert "'spots'" in complaint(toolbox, INPUT=site(), KEY_ELEMENTS=spots)
    wide = layer([line((0, 80), (300, 80))], kind="LineString", name="main",
                 fields="field=width_m:double", values=[[-3.0]])  # fmt: skip
    assert "'main'" in complaint(toolbox, INPUT=site(), KEY_STREETS=wide)
    lake = layer([box(-5, -5, 310, 210)], name="lake")
    assert "leave no land" in complaint(toolbox, INPUT=site(), KEY_ELEMENTS=lake)
    assert "least area" in complaint(toolbox, INPUT=site(), MIN_AREA=900, MAX_AREA=800)
    with pytest.raises(RefusedError):
        toolbox.run("splitsite", INPUT=site(), VARIATIONS=0)


@pytest.mark.parametrize("stage", ["laying streets", "refining parcels"])
def test_cancelling_keeps_the_variations_that_are_there(toolbox, stage):
    watch = Listener(cancel_at=f"Variation 2 of 3: {stage}")
    pressed = []
    watch.canceled.connect(lambda: pressed.append(time.monotonic()))
    run = toolbox.run("splitsite", INPUT=site(), VARIATIONS=3, KEEP=3, EFFORT=1, listener=watch)
    assert time.monotonic() - pressed[0] < allowed(1.5)
    assert any(stage.startswith("Variation 1 of 3") for stage in watch.stages)
    assert len(run.rows("PARCELS")) > 50
    assert run.results["MADE"] >= 1
    assert any("variations were made" in text or "not improved" in text for text in watch.warnings)


def test_cancelling_before_there_is_anything_writes_nothing(toolbox):
    watch = Listener(cancel_at="aying streets")
    run = toolbox.run("splitsite", INPUT=site(), VARIATIONS=1, listener=watch)
    assert run.layers == {}


def test_all_layers_are_written_or_none(toolbox, tmp_path):
    path = tmp_path / "parcels.gpkg"
    toolbox.run("splitsite", INPUT=site(), PARCELS=str(path), **QUICK)
    stored = QgsVectorLayer(str(path), "stored", "ogr")
    assert stored.renderer().type() == "categorizedSymbol"
    text = complaint(toolbox, INPUT=site(), PARCELS=str(tmp_path / "a.gpkg"),
                     BLOCKS=str(tmp_path / "missing" / "b.gpkg"))  # fmt: skip
    assert "no folder" in text
    assert not (tmp_path / "a.gpkg").exists()


def test_in_a_process_of_its_own_it_gives_the_same(toolbox, made, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    there = toolbox.run("splitsite", INPUT=site(), ROADS=roads(), **QUICK)
    assert any("a process of its own" in text for text in there.said.warnings)
    assert len(there.rows("PARCELS")) == len(made.rows("PARCELS"))
    for one, other in zip(made.rows("PARCELS"), there.rows("PARCELS")):
        assert one["geometry"].asWkt(6) == other["geometry"].asWkt(6)
    assert there.results["SCORE"] == pytest.approx(made.results["SCORE"])


def test_through_qgis_process(qgis_process, tmp_path):
    given = tmp_path / "site.geojson"
    ring = [[X, Y], [X + 240, Y], [X + 240, Y + 160], [X, Y + 160], [X, Y]]
    given.write_text(json.dumps({
        "type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": METRES}},
        "features": [{"type": "Feature", "properties": {}, "geometry": {
            "type": "Polygon", "coordinates": [ring],
        }}],
    }))  # fmt: skip
    made, why = tmp_path / "parcels.gpkg", tmp_path / "why.gpkg"
    said = qgis_process(
        "run", "platwright:splitsite", "--", f"INPUT={given}", "VARIATIONS=1", "EFFORT=1",
        f"STREETS={tmp_path / 'streets.gpkg'}", f"PARCELS={made}", f"CANDIDATES={why}",
    )  # fmt: skip
    assert "PARCEL_COUNT" in said
    assert QgsVectorLayer(str(made), "stored", "ogr").featureCount() > 30
    assert QgsVectorLayer(str(why), "stored", "ogr").featureCount() > 3
