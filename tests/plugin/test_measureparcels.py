"""Measure parcels, on a block of a few lots by hand, through real QGIS."""

from __future__ import annotations

import math
import shutil
import sysconfig

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import FailedError, Listener, RefusedError, X, Y, box, layer, line  # noqa: E402

FIELDS = "field=lot:string(10)&field=AREA_M2:double&field=use:string(20)"


def lots(uses=("parcel",) * 4, **options):
    """Two lots of 18 x 30 m, one of 36 x 30 m behind them, one of 18 x 30 m across a street."""
    shapes = [box(0, 0, 18, 30), box(18, 0, 18, 30), box(0, 30, 36, 30), box(0, -45, 18, 30)]
    values = [[f"lot {k}", 1.0, use] for k, use in enumerate(uses)]
    return layer(shapes, name="lots", fields=FIELDS, values=values, **options)


def measure(toolbox, made=None, **given):
    return toolbox.run("measureparcels", INPUT=made or lots(), **given)


def test_parcels_keep_their_fields_and_get_measures(toolbox):
    made = lots()
    run = measure(toolbox, made)
    names = [field.name() for field in run.layers["OUTPUT"].fields()]
    assert names == [
        "lot", "use", "area_m2", "frontage_m", "depth_m", "width_m", "p_angle", "p_area",
        "p_ideal", "p_similarity", "undesirable", "access",
    ]  # fmt: skip
    rows = run.rows("OUTPUT")
    assert [row["lot"] for row in rows] == ["lot 0", "lot 1", "lot 2", "lot 3"]
    assert [row["area_m2"] for row in rows] == pytest.approx([540, 540, 1080, 540])
    # the outer edges of the layer are streets: 18 + 30, likewise, 30 + 36 + 30, all four
    assert [row["frontage_m"] for row in rows] == pytest.approx([48, 48, 96, 96])
    assert [row["p_ideal"] for row in rows] == pytest.approx([1, 1, 2, 1])
    assert [row["p_area"] for row in rows] == pytest.approx([1] * 4)
    assert rows[0]["p_similarity"] == pytest.approx(0, abs=1e-3)
    assert [row["access"] for row in rows] == [True] * 4
    assert made.fields().names() == ["lot", "AREA_M2", "use"]
    assert [f["AREA_M2"] for f in made.getFeatures()] == [1.0] * 4
    assert run.results["COUNT"] == 4
    assert run.results["MEAN_AREA"] == pytest.approx(675)
    assert run.results["CV_AREA"] == pytest.approx(math.sqrt(3 * 135**2 + 405**2) / 2 / 675)
    # two blocks of 36 x 60 m and 18 x 30 m with a street of 15 m between
    assert run.results["GROUND_HA"] == pytest.approx((36 * 60 + 18 * 30 + 18 * 15) / 1e4, rel=0.2)


def test_streets_tell_where_frontage_is(toolbox):
    street = layer([line((-100, -7.5), (100, -7.5))], kind="LineString", name="street")
    run = measure(toolbox, STREETS=street)
    assert [row["frontage_m"] for row in run.rows("OUTPUT")] == pytest.approx([18, 18, 0, 18])
    assert [row["access"] for row in run.rows("OUTPUT")] == [True, True, False, True]
    assert (run.results["NO_ACCESS"], run.results["ACCESS_PCT"]) == (1, 75)
    polygon = layer([box(-100, -15, 200, 15)], name="street space")
    again = measure(toolbox, STREETS=polygon, STREET_DISTANCE=0.5)
    assert [r["frontage_m"] for r in again.rows("OUTPUT")] == pytest.approx([18, 18, 0, 18])
    narrow = measure(toolbox, STREETS=street, STREET_DISTANCE=7)
    assert narrow.results["ACCESS_PCT"] == 0


def test_streets_and_parks_of_the_layer_are_no_parcels(toolbox):
    run = measure(toolbox, lots(("parcel", "lane", "parcel", "green")))
    rows = run.rows("OUTPUT")
    # lot 0 has the lane along 30 m, and 18 + 30 m of the outer edge; lot 2 is beside the lane too
    assert [rows[k]["frontage_m"] for k in (0, 2)] == pytest.approx([78, 114])
    for k in (1, 3):
        assert rows[k]["area_m2"] == pytest.approx(540)
        assert not isinstance(rows[k]["p_angle"], float)
        assert not isinstance(rows[k]["undesirable"], bool)
    assert run.results["COUNT"] == 2
    assert any("field use tells" in text for text in run.said.infos)


def test_only_parcels_of_the_site_count(toolbox):
    run = measure(toolbox, SITE=layer([box(0, 0, 40, 25)], name="site"))
    assert len(run.rows("OUTPUT")) == 4
    assert run.results["COUNT"] == 2
    assert run.results["PER_KM2"] == pytest.approx(2 / 1000e-6)


def test_the_histogram_counts_every_parcel_once(toolbox):
    run = measure(toolbox)
    table = run.rows("HISTOGRAM")
    assert not run.layers["HISTOGRAM"].isSpatial()
    measures = {row["measure"] for row in table}
    assert measures >= {"area_m2", "p_angle", "p_area", "p_ideal", "p_similarity", "frontage_m"}
    for name in measures:
        assert sum(row["count"] for row in table if row["measure"] == name) == 4
    area = {(r["bin_from"], r["count"]) for r in table if r["measure"] == "area_m2" and r["count"]}
    assert area == {(500, 3), (1000, 1)}
    ideal = {r["bin_from"]: r["share_pct"] for r in table if r["measure"] == "p_ideal"}
    assert (ideal[1], ideal[2]) == (75, 25)


def test_the_page_holds_all_that_it_needs(toolbox, tmp_path):
    path = tmp_path / "page.html"
    made = lots()
    made.setName("<lots> & more")
    run = measure(toolbox, made, HISTOGRAM_HTML=str(path))
    assert run.results["HISTOGRAM_HTML"] == str(path)
    text = path.read_text(encoding="utf-8")
    assert "&lt;lots&gt; &amp; more" in text
    assert text.count("<svg") == 8
    assert "500 to 600 m2: 3 (75.0 %)" in text
    for outside in ("http", "src=", "@import", "<script"):
        assert outside not in text


def test_no_page_is_written_unless_one_is_named(toolbox):
    assert "HISTOGRAM_HTML" not in measure(toolbox).results


def test_a_page_that_cannot_be_written_is_refused(toolbox, tmp_path):
    with pytest.raises(RefusedError, match="Output 'Histogram page'"):
        measure(toolbox, HISTOGRAM_HTML=str(tmp_path / "nowhere" / "page.html"))


def test_where_the_page_fails_no_layer_is_kept(toolbox, package, monkeypatch, tmp_path):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(package("plugin.files"), "write", fail)
    with pytest.raises(FailedError, match="none was kept"):
        measure(toolbox, OUTPUT=str(tmp_path / "p.gpkg"), HISTOGRAM_HTML=str(tmp_path / "p.html"))
    assert list(tmp_path.iterdir()) == []


def test_in_a_process_of_its_own_all_is_the_same(toolbox, monkeypatch, tmp_path):
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])
    made, pages, runs = lots(), [], []
    for where in ("never", "always"):
        monkeypatch.setenv("PLATWRIGHT_WORKER", where)
        pages.append(tmp_path / f"{where}.html")
        runs.append(measure(toolbox, made, HISTOGRAM_HTML=str(pages[-1])))
    here, there = ([str(row) for row in _plain(run)] for run in runs)
    assert here == there
    assert pages[0].read_text("utf-8") == pages[1].read_text("utf-8")
    assert runs[0].results["P_AREA"] == runs[1].results["P_AREA"]


def _plain(run):
    """Return all rows of a run without geometry and number of order."""
    keys = ("OUTPUT", "HISTOGRAM", "PROBLEMS")
    return [
        {k: v for k, v in row.items() if k not in ("geometry", "fid")}
        for key in keys
        for row in run.rows(key)
    ]


def test_the_style_runs_from_blue_to_red(toolbox, package, tmp_path):
    from qgis.core import QgsRenderContext, QgsVectorLayer

    corner = f"POLYGON(({X} {Y},{X + 30} {Y},{X} {Y + 30},{X} {Y}))"
    run = measure(toolbox, layer([box(50, 0, 18, 30), corner]), OUTPUT=str(tmp_path / "p.gpkg"))
    made = QgsVectorLayer(str(tmp_path / "p.gpkg"), "p", "ogr")
    renderer, context = made.renderer(), QgsRenderContext()
    context.expressionContext().setFields(made.fields())
    colours = []
    renderer.startRender(context, made.fields())
    for feature in made.getFeatures():
        context.expressionContext().setFeature(feature)
        colours.append(renderer.symbolForFeature(feature, context).color().name())
    renderer.stopRender(context)
    blue_red = package("plugin.parcel_renderers").BLUE_RED
    # the triangle: corners 0, 45 and 45 degrees off, rectangle twice its area
    assert colours == [blue_red[0], blue_red[-1]]
    assert run.results["P_ANGLE"] == pytest.approx(15)
    assert run.results["UNDESIRABLE"] == 1


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:3857", "EPSG:2249"])
def test_degrees_feet_and_web_mercator_are_measured_in_metres(toolbox, crs):
    from test_bad_input import in_crs

    if crs == "EPSG:2249":
        k = 0.3048006096
        a, b, c, d = 770000.0, 2950000.0, 770000.0 + 18 / k, 2950000.0 + 30 / k
        made = layer([f"POLYGON(({a} {b},{c} {b},{c} {d},{a} {d},{a} {b}))"], crs=crs)
    else:
        made = in_crs(layer([box(0, 0, 18, 30)]), crs)
    (row,) = measure(toolbox, made).rows("OUTPUT")
    assert row["area_m2"] == pytest.approx(540, rel=0.003)
    assert row["frontage_m"] == pytest.approx(96, rel=0.003)
    assert row["p_area"] == pytest.approx(1, abs=1e-4)


BOW_TIE = f"POLYGON(({X} {Y},{X + 20} {Y + 30},{X + 20} {Y},{X} {Y + 30},{X} {Y}))"


def test_broken_geometry_is_measured_or_reported(toolbox):
    curve = f"CURVEPOLYGON(CIRCULARSTRING({X + 90} {Y},{X + 100} {Y + 10},{X + 110} {Y},"
    curve += f"{X + 100} {Y - 10},{X + 90} {Y}))"
    made = layer([BOW_TIE, None, "POLYGON EMPTY", box(50, 0, 18, 30)], name="broken")
    rows = measure(toolbox, made).rows("OUTPUT")
    assert [r["area_m2"] if isinstance(r["area_m2"], float) else None for r in rows] == [
        pytest.approx(300), None, None, pytest.approx(540),
    ]  # fmt: skip
    (round_,) = measure(toolbox, layer([curve], kind="CurvePolygon")).rows("OUTPUT")
    assert round_["area_m2"] == pytest.approx(math.pi * 100, rel=0.002)
    run = measure(toolbox, made)
    said = {row["feature"]: row["problem"] for row in run.rows("PROBLEMS")}
    assert sorted(said.values())[:2] == ["geometry is EMPTY", "geometry is NULL"]
    assert any(text.startswith("invalid") for text in said.values())
    assert run.results["COUNT"] == 2


def test_a_parcel_of_several_parts_stays_one_feature(toolbox):
    both = f"MULTIPOLYGON({box(0, 0, 18, 30)[7:]},{box(60, 0, 5, 5)[7:]})"
    (row,) = measure(toolbox, layer([both], kind="MultiPolygon")).rows("OUTPUT")
    assert row["area_m2"] == pytest.approx(565)
    assert row["frontage_m"] == pytest.approx(96 + 20)
    assert row["p_area"] == pytest.approx(1)


@pytest.mark.parametrize(
    ("made", "text"),
    [
        (lambda: lots(crs=""), "coordinate reference system"),
        (lambda: layer([], name="void"), "no features"),
        (lambda: layer([None, "POLYGON EMPTY"], name="nothing"), "no polygons"),
        (lambda: lots(("street",) * 4), "none of its polygons is a parcel"),
    ],
)
def test_layers_that_cannot_be_measured_are_refused_in_words(toolbox, made, text):
    with pytest.raises((RefusedError, FailedError), match=text) as caught:
        measure(toolbox, made())
    assert "something went wrong" not in str(caught.value)


def test_a_field_that_is_not_there_is_named(toolbox):
    with pytest.raises((RefusedError, FailedError), match="zone"):
        measure(toolbox, USE_FIELD="zone")


def test_surveyed_outlines_are_told(toolbox):
    # jogs of 0.3 m in every long side
    x, y = X, Y
    ring = [(0, 0), (18, 0), (18, 10), (17.7, 10), (17.7, 20), (18, 20), (18, 30), (0, 30)]
    text = ",".join(
        f"{x + a} {y + b}" for a, b in [*ring[:2], (18, 10), (17, 10.6), *ring[4:], ring[0]]
    )
    made = layer([f"POLYGON(({text}))"])
    assert any("surveyed" in w for w in measure(toolbox, made).said.warnings)
    assert not any("surveyed" in w for w in measure(toolbox, made, SIMPLIFY=1).said.warnings)
    assert not any("surveyed" in w for w in measure(toolbox).said.warnings)


@pytest.mark.parametrize("stage", ["Reading", "Finding frontage", "Measuring"])
def test_cancel_leaves_nothing(toolbox, stage):
    run = measure(toolbox, listener=Listener(cancel_at=stage))
    assert run.results == {}
    assert run.said.warnings


def test_real_bad_layers(toolbox, shared_data, tmp_path):
    bad = shared_data / "bad"
    for name, table in (
        ("cambridge_invalid_parcels", "parcels"),
        ("cambridge_multipart_parcels", "parcels"),
        ("cambridge_slivers", "slivers_and_neighbours"),
        ("flanders_invalid_buildings", "2100_gbg_filter"),
        ("flanders_parcels_one_empty", "parcels"),
        ("curvepolygon", "curvepolygon"),
        ("derived_bowtie_spike", "site"),
        ("derived_empty_null_zeroarea", "site"),
        ("derived_near_duplicate_vertices", "site"),
        ("derived_far_crs", "plots_negative_krovak"),
    ):
        path = tmp_path / f"{name}.gpkg"
        shutil.copyfile(bad / f"{name}.gpkg", path)
        run = measure(toolbox, f"{path}|layername={table}")
        rows = run.rows("OUTPUT")
        measured = [row for row in rows if isinstance(row["p_area"], float)]
        assert run.results["COUNT"] == len(measured) > 0, name
        for row in measured:
            assert row["p_area"] > 0.999, (name, row)
            assert (
                row["frontage_m"] <= row["geometry"].length() * 1.01 + 1 or name == "curvepolygon"
            )
