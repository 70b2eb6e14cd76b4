"""The report through real QGIS; the page is read back by a parser that knows nothing of it."""

from __future__ import annotations

import base64
import json
import threading
import time
from pathlib import Path

import pytest
from clock import allowed

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import QgsPrintLayout, QgsProject, QgsReadWriteContext, QgsVectorLayer  # noqa: E402
from qgis.PyQt.QtGui import QImage  # noqa: E402
from qgis.PyQt.QtXml import QDomDocument  # noqa: E402
from report_browser import opened, program  # noqa: E402
from report_reading import cells, fetched, parsed  # noqa: E402
from support import Listener, box, complaints_of, layer, line, point, roads, site  # noqa: E402
from test_threads import in_a_thread  # noqa: E402

complaint = complaints_of("designreport")
SMALL = {"PICTURE_WIDTH": 500}


@pytest.fixture(scope="module")
def designs(toolbox, tmp_path_factory):
    """Two designs of the site in folders of their own, with parcels and measures."""
    folder = tmp_path_factory.mktemp("designs")
    for name, width in (("narrow", 60.0), ("wide", 110.0)):
        own = folder / name
        own.mkdir()
        outputs = {
            key: str(own / f"{key.lower()}.gpkg") for key in ("STREETS", "BLOCKS", "PROBLEMS")
        }
        toolbox.run(
            "designstreets", INPUT=site(), ROADS=roads(), BLOCK_WIDTH=width, TIME_LIMIT=3, **outputs
        )
        toolbox.run(
            "parcelblocks", INPUT=outputs["BLOCKS"], STREETS=outputs["STREETS"],
            PARCELS=str(own / "parcels.gpkg"),
        )  # fmt: skip
        toolbox.run("measurestreets", INPUT=outputs["STREETS"], OUTPUT=str(own / "measured.gpkg"))
    return folder


def layers_of(folder, *names):
    return [str(folder / name / f"{key}.gpkg") for name in names
            for key in ("streets", "blocks", "parcels", "measured", "problems")]  # fmt: skip


def written(toolbox, folder, **given):
    """Run the tool; return the run, the page as elements, and where it is."""
    path = folder / "report.html"
    made = toolbox.run("designreport", OUTPUT=str(path), **{**SMALL, **given})
    return made, parsed(path.read_text(encoding="utf-8")), path


@pytest.fixture(scope="module")
def made(toolbox, designs, tmp_path_factory):
    return written(
        toolbox, tmp_path_factory.mktemp("report"), TITLE="Two <designs>", PLACE="Yard",
        LAYERS=[*layers_of(designs, "narrow", "wide"), site()],
        TARGETS="VIOLATIONS = 0\nTOTAL_LENGTH <= 1 m",
        LAYOUT=str(tmp_path_factory.mktemp("layout") / "sheet.qpt"),
    )  # fmt: skip


def recorded(path):
    """Return the result that a file carries, read by GDAL."""
    from osgeo import ogr

    dataset = ogr.Open(str(path))
    return json.loads(dataset.GetLayer(0).GetMetadata()["platwright_result"])


def table_of(page, caption):
    return next(cells(own) for own in page.all("table") if caption in own.all("caption")[0].text)


def image_of(element):
    kind, _, data = element.attributes["src"].partition(",")
    assert kind == "data:image/png;base64"
    image = QImage()
    assert image.loadFromData(base64.b64decode(data), "PNG")
    return image


def test_designs_are_told_apart_by_their_folders(made):
    run, page, _ = made
    assert run.results["DESIGNS_FOUND"] == 2
    headings = [own.text for own in page.all("h2")]
    assert headings[:4] == ["Summary", "Comparison", "narrow", "wide"]
    assert page.all("h1")[0].text == "Two <designs>"
    # the plan and the measured streets of each
    assert run.results["PICTURES"] == 4


def test_figures_are_those_that_the_files_carry(made, designs):
    rows = {row[0]: row[1:] for row in table_of(made[1], "Figures of the designs")}
    for at, name in enumerate(("narrow", "wide")):
        result = recorded(designs / name / "streets.gpkg")
        shown = rows["Length of the new streets"][at].strip("★ ").partition(" m")[0]
        assert float(shown.replace(",", "")) == pytest.approx(result["TOTAL_LENGTH"], rel=5e-3)
        parcels = recorded(designs / name / "parcels.gpkg")
        assert float(rows["Parcels"][at].strip("★ ").split()[0]) == parcels["ACHIEVED"]


def test_targets_are_counted(made):
    run, page, _ = made
    assert (run.results["TARGETS_MET"], run.results["TARGETS_MISSED"]) == (2, 2)
    rows = table_of(page, "targets")
    assert rows[2][1] == "at most 1 m"
    assert all(own.endswith("✗ not met") for own in rows[2][2:])
    assert any("narrow: Length of the new streets" in own for own in run.said.infos)


def test_wishes_are_in_the_words_of_the_dialog(made):
    asked = [cells(own) for own in made[1].all("table") if "asked of Design streets" in own.text]
    assert [dict(row[:2] for row in own)["Block width"] for own in asked] == ["60 m", "110 m"]
    usual = next(own for own in made[1].all("details") if "Design streets did as usual" in own.text)
    words = [row[0] for row in cells(usual.all("table")[0])]
    assert "Longest cul-de-sac" in words
    assert "Where streets may leave the site" in words


def test_maps_show_the_styles_of_the_files(made):
    maps = [own for own in made[1].all("div") if own.attributes.get("class") == "map"]
    assert len(maps) == 4
    image = image_of(maps[0].all("img")[0])
    assert image.width() == 500
    counts: dict[str, int] = {}
    for x in range(0, image.width(), 2):
        for y in range(0, image.height(), 2):
            name = image.pixelColor(x, y).name()
            counts[name] = counts.get(name, 0) + 1
    # local streets, existing ones and paper
    assert counts.get("#e58a3a", 0) + counts.get("#c8442c", 0) > 20
    assert counts.get("#8c867c", 0) > 20
    assert counts.get("#ffffff", 0) > 100


def test_legends_show_what_is_on_the_map_only(made):
    figure = made[1].all("figure")[0]
    words = [own.text for own in figure.all("li")]
    assert "Streets" in words
    assert "existing" in words
    # the class is in the style, but no such street is on the map
    assert "major" not in words
    for own in figure.all("ul")[0].all("img"):
        image = image_of(own)
        colours = {image.pixel(x, y) for x in range(image.width()) for y in range(image.height())}
        assert len(colours) > 1


def test_the_scale_bar_is_true(made):
    figure = made[1].all("figure")[0]
    (marks,) = figure.all("svg")
    halves = [own for own in marks.all("rect") if own.attributes.get("stroke")]
    long = sum(float(own.attributes["width"]) for own in halves)
    said = float(next(own.text for own in marks.all("text") if own.text.endswith(" m"))[:-2])
    # streets run 8 m around a site of 300 m, with 6 % of 316 m on each side
    ground = 316 * 1.12
    assert said / ground == pytest.approx(long / 500, rel=0.02)


def test_nothing_is_fetched_and_a_browser_agrees(made, tmp_path):
    _, page, path = made
    assert all(own.startswith("data:image/png") for own in fetched(page))
    if program() is None:
        pytest.skip("no Chromium here: apt-get install chromium-headless-shell")
    assert opened(path, tmp_path, "--dump-dom") == ([], [])


def test_no_folder_is_told(made, designs):
    text = made[2].read_text(encoding="utf-8")
    assert str(designs) not in text
    assert "streets.gpkg" in text


def test_the_layout_opens_in_qgis_and_shows_the_ground(made, designs, tmp_path):
    text = Path(made[0].results["LAYOUT"]).read_text(encoding="utf-8")
    document = QDomDocument()
    assert document.setContent(text)[0]
    project = QgsProject()
    project.addMapLayer(QgsVectorLayer(layers_of(designs, "wide")[0], "streets", "ogr"))
    layout = QgsPrintLayout(project)
    _, good = layout.loadFromTemplate(document, QgsReadWriteContext())
    assert good
    assert layout.itemById("title").text() == "Two <designs>"
    assert "Yard" in layout.itemById("subtitle").currentText()
    shown = layout.itemById("map")
    assert shown.crs().authid() == "EPSG:3067"
    assert shown.extent().contains(layout.project().mapLayersByName("streets")[0].extent())
    for name in ("legend", "scale bar", "north arrow", "crs", "sources", "date"):
        assert layout.itemById(name) is not None
    assert "EPSG:3067" in layout.itemById("crs").currentText()
    exported = export(layout, tmp_path / "sheet.png")
    colours = {exported.pixel(x, y) for x in range(0, exported.width(), 3)
               for y in range(0, exported.height(), 3)}  # fmt: skip
    assert len(colours) > 20


def export(layout, path):
    from qgis.core import QgsLayoutExporter

    settings = QgsLayoutExporter.ImageExportSettings()
    settings.dpi = 60
    result = QgsLayoutExporter(layout).exportToImage(str(path), settings)
    assert result == QgsLayoutExporter.ExportResult.Success
    return QImage(str(path))


def test_words_in_percent_brackets_are_not_evaluated(toolbox, tmp_path):
    path = tmp_path / "sheet.qpt"
    title = '[% 1 + 1 %] & "quoted" <b>'
    written(toolbox, tmp_path, LAYERS=[site()], TITLE=title, LAYOUT=str(path))
    document = QDomDocument()
    assert document.setContent(path.read_text(encoding="utf-8"))[0]
    project = QgsProject()
    layout = QgsPrintLayout(project)
    assert layout.loadFromTemplate(document, QgsReadWriteContext())[1]
    assert layout.itemById("title").currentText() == title.replace("[%", "[ %")


def test_data_alone_is_drawn_and_named(toolbox, tmp_path):
    trees = layer([point(20, 20)], kind="Point", name="my <trees>", fields="field=osm_id:string")
    made, page, _ = written(toolbox, tmp_path, LAYERS=[site(), trees])
    assert (made.results["DESIGNS_FOUND"], made.results["PICTURES"]) == (0, 1)
    assert ["my <trees>", "data", "1", "memory layer", "EPSG:3067"] in table_of(page, "given")
    assert "OpenStreetMap contributors" in page.text


def test_rights_of_layers_are_sources(toolbox, tmp_path):
    from qgis.core import QgsLayerMetadata

    own = site()
    metadata = QgsLayerMetadata()
    metadata.setRights(["© City & Sons"])
    metadata.setLicenses(["CC BY 4.0"])
    own.setMetadata(metadata)
    _, page, _ = written(toolbox, tmp_path, LAYERS=[own])
    assert ["my site", "© City & Sons", "CC BY 4.0", "", "", ""] in table_of(page, "Whose")


def two_in_one():
    return layer(
        [line((0, 0), (200, 0)), line((0, 50), (0, 150)), line((0, 60), (20, 100))],
        kind="LineString", name="all",
        fields="field=design:string(40)&field=level:integer",
        values=[["it's \"red\"", 2], ["it's \"red\"", 2], ["blue", 3]],
    )  # fmt: skip


def test_a_field_parts_one_layer_into_designs(toolbox, tmp_path):
    table = layer(
        [None, None], kind="NoGeometry", name="compared", crs="EPSG:4326",
        fields="field=design:string(40)&field=length_m:double&field=note:string(9)",
        values=[["blue", 44.7, "x"], ["it's \"red\"", 300.0, "y"]],
    )  # fmt: skip
    made, page, _ = written(
        toolbox, tmp_path, LAYERS=[two_in_one(), table], TARGETS="length_m >= 100"
    )
    assert made.results["DESIGNS_FOUND"] == made.results["PICTURES"] == 2
    assert (made.results["TARGETS_MET"], made.results["TARGETS_MISSED"]) == (1, 1)
    assert ["Length m", "300 m", "44.7 m"] in table_of(page, "Figures of the designs")
    red, blue = (image_of(own.all("img")[0]) for own in page.all("figure"))
    assert inked(red) > 1.5 * inked(blue)


def inked(image):
    white = 0xFFFFFFFF
    return sum(
        image.pixel(x, y) != white for x in range(image.width()) for y in range(image.height())
    )


def test_targets_of_a_table(toolbox, tmp_path, designs):
    table = layer(
        [None, None], kind="NoGeometry", name="limits",
        fields="field=Figure:string(40)&field=at_least:double&field=at_most:double",
        values=[["TOTAL_LENGTH", 1.0, 100000.0], ["VIOLATIONS", None, 0.0]],
    )  # fmt: skip
    made, _, _ = written(toolbox, tmp_path, LAYERS=layers_of(designs, "wide"), TARGET_TABLE=table)
    assert (made.results["TARGETS_MET"], made.results["TARGETS_MISSED"]) == (3, 0)


def test_layers_far_apart_have_sheets_of_their_own(toolbox, tmp_path):
    shapes = layer(
        [box(0, 0, 100, 100), box(50000, 0, 1000, 500)], name="two",
        fields="field=design:string(9)", values=[["here"], ["there"]],
    )  # fmt: skip
    _, page, _ = written(toolbox, tmp_path, LAYERS=[shapes])
    labels = [own.all("svg")[0].attributes["aria-label"] for own in page.all("figure")]
    assert labels == ["Scale bar of 20 m; north arrow", "Scale bar of 200 m; north arrow"]


def test_degrees_are_drawn_in_metres(toolbox, tmp_path):
    ground = layer(["POLYGON((24 60,24.02 60,24.02 60.01,24 60.01,24 60))"], crs="EPSG:4326")
    _, page, _ = written(toolbox, tmp_path, LAYERS=[ground])
    figure = page.all("figure")[0]
    # 0.02 degrees are 1,115 m at 60 degrees of latitude
    assert "Scale bar of 200 m" in figure.all("svg")[0].attributes["aria-label"]
    assert "metres around the middle" in figure.text


def test_a_style_in_the_project_counts(toolbox, tmp_path):
    from qgis.core import QgsFillSymbol, QgsSingleSymbolRenderer

    own = site()
    symbol = QgsFillSymbol.createSimple({"color": "#00ff00", "outline_color": "#00ff00"})
    own.setRenderer(QgsSingleSymbolRenderer(symbol))
    own.selectAll()
    project = QgsProject.instance()
    project.addMapLayer(own, False)
    try:
        _, page, _ = written(toolbox, tmp_path, LAYERS=[own.id()])
        image = image_of(page.all("figure")[0].all("img")[0])
        # neither the selection nor a plain style is drawn
        assert image.pixelColor(image.width() // 2, image.height() // 2).name() == "#00ff00"
        assert own.selectedFeatureCount() == 1
    finally:
        project.removeMapLayer(own.id())


def test_a_background_lies_below(toolbox, tmp_path):
    from osgeo import gdal, osr
    from support import X, Y

    path = str(tmp_path / "ground.tif")
    raster = gdal.GetDriverByName("GTiff").Create(path, 4, 4, 3)
    raster.SetGeoTransform((X - 500, 400, 0, Y + 800, 0, -400))
    reference = osr.SpatialReference()
    reference.ImportFromEPSG(3067)
    raster.SetProjection(reference.ExportToWkt())
    for band in (1, 2, 3):
        raster.GetRasterBand(band).Fill(60 * band)
    del raster
    lines = roads()
    _, page, _ = written(toolbox, tmp_path, LAYERS=[lines], BACKGROUND=path)
    image = image_of(page.all("figure")[0].all("img")[0])
    assert image.pixelColor(2, 2).name() != "#ffffff"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"LAYERS": []}, "LAYERS|no layers"),
        ({"TARGETS": "LENGHT <= 5"}, "no design has such a figure"),
        ({"TARGETS": "so long"}, "is no target"),
        ({"DESIGNS": "quiet"}, "does not say which layers"),
        ({"DESIGNS": "quiet = nothing"}, "which is not among"),
        ({"OUTPUT": "/no/such/folder/x.html"}, "no folder"),
    ],
)
def test_what_cannot_be_is_refused_in_words(toolbox, tmp_path, given, words):
    import re

    asked = {"LAYERS": [site()], "OUTPUT": str(tmp_path / "r.html"), **SMALL, **given}
    assert re.search(words, complaint(toolbox, **asked))
    assert not (tmp_path / "r.html").exists()


def test_a_table_without_the_fields_is_refused(toolbox, tmp_path):
    table = layer([None], kind="NoGeometry", name="odd", fields="field=a:integer", values=[[1]])
    text = complaint(
        toolbox, LAYERS=[site()], TARGET_TABLE=table, OUTPUT=str(tmp_path / "r.html"), **SMALL
    )
    assert "odd" in text
    assert "figure" in text


def test_it_runs_in_a_thread_as_from_the_dialog(toolbox, tmp_path, designs):
    path = tmp_path / "report.html"
    for _ in range(3):
        good, results = in_a_thread(
            toolbox, "designreport", OUTPUT=str(path), **SMALL,
            LAYERS=[*layers_of(designs, "narrow", "wide"), site()],
        )  # fmt: skip
        assert good
        assert results["PICTURES"] == 4
        assert path.stat().st_size > 50_000
        path.unlink()


class Impatient(Listener):
    """Presses Cancel some time after the drawing has begun, from another thread."""

    def __init__(self, seconds):
        super().__init__()
        self.seconds = seconds
        self.at = None

    def setProgressText(self, text):  # noqa: N802 - names of QGIS
        super().setProgressText(text)
        if text.startswith("Drawing") and self.at is None:
            self.at = time.monotonic() + self.seconds
            threading.Timer(self.seconds, self.cancel).start()


@pytest.mark.parametrize("seconds", [0.0, 0.2, 0.5])
def test_cancel_stops_within_a_second_and_leaves_no_page(toolbox, tmp_path, seconds):
    many = layer(
        [box(7 * (k % 300), 7 * (k // 300), 6, 6) for k in range(60_000)], name="many",
        fields="field=design:string(9)", values=[["one"]] * 60_000,
    )  # fmt: skip
    listener, path = Impatient(seconds), tmp_path / "report.html"
    made = toolbox.run(
        "designreport", listener=listener, LAYERS=[many], OUTPUT=str(path), PICTURE_WIDTH=6000
    )
    assert time.monotonic() - listener.at < allowed(3.0)  # a second on a quiet machine
    assert made.results == {}
    assert not path.exists()
    assert any("Cancelled" in text for text in listener.warnings)


def test_layers_of_a_model_need_no_file(toolbox, tmp_path):
    """In a model the layers of one tool go into the next before QGIS loads or styles them."""
    from qgis.core import QgsProcessingContext

    context, said = QgsProcessingContext(), Listener()
    asked = {"INPUT": site(), "ROADS": roads(), "TIME_LIMIT": 3}
    outputs = dict.fromkeys(("STREETS", "BLOCKS"), "TEMPORARY_OUTPUT")
    first, good = toolbox.tool("designstreets").run({**asked, **outputs}, context, said)
    assert good
    path = tmp_path / "report.html"
    given = {"LAYERS": [first["STREETS"], first["BLOCKS"]], "OUTPUT": str(path), **SMALL}
    results, good = toolbox.tool("designreport").run(given, context, said)
    assert good
    assert results["DESIGNS_FOUND"] == 1
    page = parsed(path.read_text(encoding="utf-8"))
    assert dict(row[:2] for row in table_of(page, "asked of Design streets"))["Time limit"] == "3 s"
    assert "existing" in [own.text for own in page.all("figure")[0].all("li")]


def test_a_source_with_a_password_is_not_told(package):
    from qgis.core import QgsRasterLayer

    facts = package("plugin.report_facts")
    source = "crs=EPSG:3857&url=https://user:secret@example.org/{z}&type=xyz"
    shown = facts.Shown(QgsRasterLayer(source, "tiles", "wms"), "1", source=source, name="tiles")
    assert "secret" not in str((shown.row(), shown.facts(), facts.credits_of([shown])))


def test_usual_values_are_those_of_the_library(package):
    import dataclasses

    from platwright.network.specification import Specification
    from platwright.parcels.rules import ParcelRules

    usual = package("plugin.report_words").USUAL
    asked = json.loads(Specification().to_json())
    assert {key: asked[key] for key in usual["designstreets"]} == usual["designstreets"]
    rules = dataclasses.asdict(ParcelRules())
    assert {key: rules[key] for key in usual["parcelblocks"]} == usual["parcelblocks"]


def test_words_for_inputs_name_inputs_that_exist(package, toolbox):
    for name, pairs in package("plugin.report_words").INPUTS.items():
        tool = toolbox.tool(name)
        keys = {own.name() for own in tool.parameterDefinitions()}
        assert set(pairs.values()) <= keys
