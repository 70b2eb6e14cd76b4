"""Parcels in blocks, through real QGIS: they tile the land, whatever it is made of."""

from __future__ import annotations

import json
import sysconfig
import time

import pytest
from clock import allowed

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from qgis.core import (  # noqa: E402
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsGeometry,
    QgsProcessingFeatureSourceDefinition,
    QgsProject,
    QgsVectorLayer,
)
from support import (  # noqa: E402
    Listener,
    RefusedError,
    X,
    Y,
    box,
    complaints_of,
    layer,
    line,
    point,
    roads,
    site,
)

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process

#: Streets that part the site of 300 by 200 m into four blocks, and those around it.
CROSS = [line((150, -8), (150, 208)), line((-8, 100), (308, 100))]


def streets(**options):
    ring = [feature.geometry() for feature in roads().getFeatures()][:4]
    return layer([*CROSS, *ring], kind="LineString", name="my streets", **options)


def in_crs(made, authid, kind):
    target = QgsCoordinateReferenceSystem(authid)
    turn = QgsCoordinateTransform(made.crs(), target, QgsProject.instance())
    shapes = [feature.geometry() for feature in made.getFeatures()]
    for shape in shapes:
        shape.transform(turn)
    return layer(shapes, kind=kind, crs=authid, name=made.name())


def area(rows):
    return sum(row["geometry"].area() for row in rows)


complaint = complaints_of("parcelblocks")


@pytest.fixture(scope="module")
def made(toolbox):
    return toolbox.run("parcelblocks", STREETS=streets(), SITE=site(), STREET_WIDTH=12)


def test_parcels_and_street_space_tile_the_site(made):
    parcels, space = made.rows("PARCELS"), made.rows("STREET_SPACE")
    assert area(space) == pytest.approx(12 * 300 + 12 * 200 - 144, abs=0.1)
    assert area(parcels) + area(space) == pytest.approx(60000, rel=1e-6)
    blocks = made.rows("BLOCKS")
    assert [b["area_m2"] for b in blocks] == pytest.approx([144 * 94] * 4)
    assert area(blocks) == pytest.approx(area(parcels), rel=1e-6)
    whole = QgsGeometry.unaryUnion([row["geometry"] for row in [*parcels, *space]])
    assert whole.area() == pytest.approx(60000, rel=1e-6)


def test_fields_and_numbers_tell_of_the_parcels(made):
    rows = made.rows("PARCELS")
    assert [row["parcel_id"] for row in rows] == list(range(1, len(rows) + 1))
    lots = [row for row in rows if row["land_use"] == "parcel"]
    told = made.results
    assert told["ACHIEVED"] == len(lots)
    assert told["REQUESTED"] >= 0.9 * told["ACHIEVED"]
    assert len(lots) > 40
    for row in rows:
        assert row["area_m2"] == pytest.approx(row["geometry"].area(), rel=1e-6)
        assert (row["site_id"], row["feature"]) == (1, "1")
        assert row["block_id"] in (1, 2, 3, 4)
    for row in lots:
        assert row["frontage_m"] >= 6
        assert row["width_m"] * row["depth_m"] == pytest.approx(row["area_m2"])
        assert row["access"] is True
    assert any(row["corner"] for row in lots)
    mean = sum(row["p_angle"] for row in lots) / len(lots)
    assert told["MEAN_P_ANGLE"] == pytest.approx(mean)
    bad = sum(row["undesirable"] for row in lots) / len(lots)
    assert told["UNDESIRABLE"] == pytest.approx(100 * bad)
    assert told["WITH_ACCESS"] == 100
    assert told["SECONDS"] < 60
    # rectangular blocks make rectangular parcels
    assert told["MEAN_P_ANGLE"] < 1
    assert told["MEAN_P_AREA"] < 1.02


@pytest.mark.parametrize("method", ["strips", "halving", "skeleton"])
def test_every_method_cuts_block_polygons(toolbox, method):
    ground = layer([box(0, 0, 140, 60), box(200, 0, 90, 50)], name="my blocks")
    run = toolbox.run("parcelblocks", INPUT=ground, METHOD=method)
    rows = run.rows("PARCELS")
    assert area(rows) == pytest.approx(140 * 60 + 90 * 50, rel=1e-6)
    assert {row["feature"] for row in rows} == {"1", "2"}
    assert len(rows) > 12
    assert run.layers["STREET_SPACE"].featureCount() == 0


def test_size_and_shape_are_asked_for(toolbox):
    ground = layer([box(0, 0, 180, 60)])
    few = toolbox.run("parcelblocks", INPUT=ground, PARCEL_WIDTH=30).results["ACHIEVED"]
    many = toolbox.run("parcelblocks", INPUT=ground, PARCEL_WIDTH=12).results["ACHIEVED"]
    assert few == pytest.approx(12, abs=2)
    assert many == pytest.approx(30, abs=3)


def test_the_width_of_streets_by_field_expression_or_level(toolbox):
    from qgis.core import QgsProperty

    wide = streets(
        fields="field=level:integer&field=w:double", values=[[1, 14.0], [4, None]] + [[3, None]] * 4
    )

    def gap(**asked):
        run = toolbox.run("parcelblocks", STREETS=wide, SITE=site(), **asked)
        boxes = [row["geometry"].boundingBox() for row in run.rows("BLOCKS")]
        left = max(b.xMaximum() for b in boxes if b.xMaximum() < X + 151)
        low = max(b.yMaximum() for b in boxes if b.yMaximum() < Y + 101)
        return 2 * (X + 150 - left), 2 * (Y + 100 - low)

    assert gap() == pytest.approx((20, 10), abs=0.01)
    assert gap(WIDTH_MAJOR=30, WIDTH_CUL_DE_SAC=8) == pytest.approx((30, 8), abs=0.01)
    assert gap(STREET_WIDTH=QgsProperty.fromField("w")) == pytest.approx((14, 10), abs=0.01)
    twice = QgsProperty.fromExpression('4 * "level"')
    assert gap(STREET_WIDTH=twice) == pytest.approx((4, 16), abs=0.01)


def test_streets_alone_part_the_land_that_they_enclose(toolbox):
    run = toolbox.run("parcelblocks", STREETS=streets(), STREET_WIDTH=12)
    assert area(run.rows("PARCELS")) + area(run.rows("STREET_SPACE")) == pytest.approx(316 * 216)


def test_blocks_of_a_design_lose_half_the_width_of_its_streets(toolbox):
    design = toolbox.run("designstreets", INPUT=site(), ROADS=roads(), TIME_LIMIT=2)
    run = toolbox.run(
        "parcelblocks", INPUT=design.layers["BLOCKS"], STREETS=design.layers["STREETS"]
    )
    other = toolbox.run("parcelblocks", STREETS=design.layers["STREETS"], SITE=site())
    assert area(run.rows("PARCELS")) == pytest.approx(area(other.rows("PARCELS")), rel=1e-3)
    assert run.results["WITH_ACCESS"] == 100


def test_lines_without_access_and_obstacles_are_heard(toolbox, made):
    wall = layer([line((150, -50), (150, 250))], kind="LineString", name="wall")
    pond = layer([box(40, 30, 30, 30)], name="pond")
    run = toolbox.run(
        "parcelblocks", STREETS=streets(), SITE=site(), STREET_WIDTH=12, CLOSED=wall,
        OBSTACLES=pond,
    )  # fmt: skip
    assert area(run.rows("PARCELS")) == pytest.approx(area(made.rows("PARCELS")) - 900, rel=1e-6)
    before = sum(b["open_m"] for b in made.rows("BLOCKS"))
    after = sum(b["open_m"] for b in run.rows("BLOCKS"))
    assert before - after == pytest.approx(4 * 94, abs=1)


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857"])
def test_degrees_are_measured_in_metres(toolbox, made, crs):
    run = toolbox.run(
        "parcelblocks", STREETS=in_crs(streets(), "EPSG:4326", "LineString"),
        SITE=in_crs(site(), crs, "Polygon"), STREET_WIDTH=12,
    )  # fmt: skip
    assert run.layers["PARCELS"].crs().authid() == crs
    assert sum(row["area_m2"] for row in run.rows("PARCELS")) == pytest.approx(
        area(made.rows("PARCELS")), rel=2e-3
    )
    assert run.results["ACHIEVED"] == pytest.approx(made.results["ACHIEVED"], abs=4)


def test_feet_are_metres_too(toolbox):
    a, b, k = 770000.0, 2950000.0, 0.3048006096
    w, h = 140 / k, 60 / k
    ring = f"{a} {b},{a + w} {b},{a + w} {b + h},{a} {b + h},{a} {b}"
    run = toolbox.run("parcelblocks", INPUT=layer([f"POLYGON(({ring}))"], crs="EPSG:2249"))
    assert sum(row["area_m2"] for row in run.rows("PARCELS")) == pytest.approx(8400, rel=2e-3)


def test_odd_polygons_are_mended_and_told(toolbox):
    two = QgsGeometry.fromWkt(box(0, 0, 140, 60)).combine(QgsGeometry.fromWkt(box(200, 0, 90, 50)))
    two.get().addZValue(3.0)
    a, b = Y + 200, Y + 300
    bow = f"POLYGON(({X} {a},{X + 100} {b},{X + 100} {a},{X} {b},{X} {a}))"
    empty = "POLYGON EMPTY"
    odd = layer([two, bow, None, empty], kind="MultiPolygonZ")
    run = toolbox.run("parcelblocks", INPUT=odd)
    assert area(run.rows("PARCELS")) == pytest.approx(140 * 60 + 90 * 50 + 5000, rel=1e-3)
    told = {row["problem"].split(":")[0] for row in run.rows("PROBLEMS")}
    assert {"has 2 parts", "invalid", "geometry is NULL"} <= told


def test_only_selected_blocks_are_cut(toolbox):
    ground = layer([box(0, 0, 140, 60), box(200, 0, 90, 50)])
    QgsProject.instance().addMapLayer(ground)
    try:
        ground.selectByIds([2])
        chosen = QgsProcessingFeatureSourceDefinition(ground.id(), True)
        run = toolbox.run("parcelblocks", INPUT=chosen)
    finally:
        QgsProject.instance().removeMapLayer(ground.id())
    assert area(run.rows("PARCELS")) == pytest.approx(4500)


def test_the_same_seed_gives_the_same_parcels(toolbox, made):
    again = toolbox.run("parcelblocks", STREETS=streets(), SITE=site(), STREET_WIDTH=12)
    shapes = [[r["geometry"].asWkb() for r in run.rows("PARCELS")] for run in (made, again)]
    assert shapes[0] == shapes[1]


def test_what_cannot_be_used_is_refused_with_the_way_out(toolbox):
    assert "no land to cut" in complaint(toolbox)
    assert "no land to cut" in complaint(toolbox, SITE=site())
    assert "Both blocks and a site" in complaint(
        toolbox, INPUT=site(), SITE=site(), STREETS=streets()
    )
    assert "'my site'" in complaint(toolbox, INPUT=site(crs=""))
    bare = layer([], kind="LineString", name="bare")
    assert "'bare'" in complaint(toolbox, STREETS=bare, SITE=site())
    assert "'empty'" in complaint(toolbox, STREETS=streets(), SITE=layer([], name="empty"))
    assert "'empty'" in complaint(toolbox, INPUT=layer([], name="empty"))
    hollow = layer([None], name="hollow")
    assert "'hollow'" in complaint(toolbox, INPUT=hollow)
    assert "'hollow'" in complaint(toolbox, STREETS=streets(), SITE=hollow)
    away = layer([line((0, 0), (10, 0))], kind="LineString", name="away")
    assert "enclose no land" in complaint(toolbox, STREETS=away)
    spots = layer([point(0, 0)], kind="Point", name="spots")
    assert "'spots'" in complaint(toolbox, STREETS=spots, SITE=site())
    assert "least area" in complaint(toolbox, INPUT=site(), MIN_AREA=900, MAX_AREA=800)
    assert "frontage" in complaint(toolbox, INPUT=site(), MIN_FRONTAGE=30)


def test_numbers_out_of_range_are_refused(toolbox):
    for key, value in (("PARCEL_WIDTH", 0), ("STREET_WIDTH", -3), ("CORNER_WIDTH", 9)):
        with pytest.raises(RefusedError):
            toolbox.run("parcelblocks", INPUT=site(), **{key: value})


@pytest.mark.parametrize(
    "stage", ["Preparing block 2 ", "Cutting blocks into parcels", "Refining parcels"]
)
def test_a_cancelled_run_writes_nothing_and_stops_soon(toolbox, stage):
    many = layer([box(200 * i, 100 * j, 180, 80) for i in range(8) for j in range(8)])
    watch = Listener(cancel_at=stage)
    pressed = []
    watch.canceled.connect(lambda: pressed.append(time.monotonic()))
    run = toolbox.run("parcelblocks", INPUT=many, listener=watch)
    assert time.monotonic() - pressed[0] < allowed(1.5)
    assert run.layers == {}
    assert any("Cancelled before" in text for text in watch.warnings)


def test_all_layers_are_written_with_their_styles_or_none(toolbox, tmp_path):
    path = tmp_path / "parcels.gpkg"
    run = toolbox.run("parcelblocks", INPUT=layer([box(0, 0, 140, 60)]), PARCELS=str(path))
    stored = QgsVectorLayer(str(path), "stored", "ogr")
    assert stored.featureCount() == run.results["ACHIEVED"]
    assert stored.renderer().type() == "categorizedSymbol"
    nowhere = tmp_path / "blocks.gpkg"
    text = complaint(toolbox, INPUT=layer([box(0, 0, 140, 60)]), PARCELS=str(tmp_path / "a.gpkg"),
                     BLOCKS=str(nowhere / "missing" / "b.gpkg"))  # fmt: skip
    assert "no folder" in text
    assert not (tmp_path / "a.gpkg").exists()


def test_styles_show_land_use_and_quality(made, package):
    styles, kinds = package("plugin.styles"), package("plugin.parcel_fields")
    shown = made.layers["PARCELS"]
    styles.apply(shown, kinds.PARCELS)
    styles.offer_others(shown, kinds.PARCELS)
    assert {"Quality", "Corners", "Rectangle"} <= set(shown.styleManager().styles())
    uses = {row["land_use"] for row in made.rows("PARCELS")}
    assert uses <= {category.value() for category in shown.renderer().categories()}


def test_in_a_process_of_its_own_it_gives_the_same(toolbox, made, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    there = toolbox.run("parcelblocks", STREETS=streets(), SITE=site(), STREET_WIDTH=12)
    assert any("a process of its own" in text for text in there.said.warnings)
    for one, other in zip(made.rows("PARCELS"), there.rows("PARCELS")):
        assert one["geometry"].asWkt(6) == other["geometry"].asWkt(6)
    assert there.results["ACHIEVED"] == made.results["ACHIEVED"]


def test_through_qgis_process(qgis_process, tmp_path):
    from support import METRES

    given = tmp_path / "site.geojson"
    given.write_text(json.dumps({
        "type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": METRES}},
        "features": [{"type": "Feature", "properties": {}, "geometry": {
            "type": "Polygon",
            "coordinates": [[[X, Y], [X + 140, Y], [X + 140, Y + 60], [X, Y + 60], [X, Y]]],
        }}],
    }))  # fmt: skip
    made = tmp_path / "parcels.gpkg"
    said = qgis_process(
        "run", "platwright:parcelblocks", "--", f"INPUT={given}", "METHOD=halving",
        f"PARCELS={made}",
    )  # fmt: skip
    assert "ACHIEVED" in said
    stored = QgsVectorLayer(str(made), "stored", "ogr")
    assert stored.featureCount() == 16
