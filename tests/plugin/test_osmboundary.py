"""Find boundary of a place: as Processing runs it, and in the real program, on a local server."""

from __future__ import annotations

import re
import time

import pytest
from clock import allowed

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytest.importorskip("requests")
pytest.importorskip("osmium")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from server import SHIPPED, Server  # noqa: E402
from support import FailedError, Listener, RefusedError  # noqa: E402

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process

PORTIER = "7.4325,43.7415 [EPSG:4326]"


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


@pytest.fixture
def addresses(server, monkeypatch, tmp_path):
    """Lead the plugin to the server, or to broken answers of it."""

    def lead(broken="", **more):
        found = {
            "PLATWRIGHT_OVERPASS_URL": server.addresses(broken)["overpass_url"],
            "PLATWRIGHT_NOMINATIM_URL": server.addresses(broken)["nominatim_url"],
            "PLATWRIGHT_TIMEOUT": "3",
            "PLATWRIGHT_RATE_LIMIT": "false",
            "PLATWRIGHT_CACHE": str(tmp_path / "cache"),
            **more,
        }
        for name, text in found.items():
            monkeypatch.setenv(name, text)
        return found

    lead()
    return lead


def test_a_place(toolbox, addresses):
    run = toolbox.run("osmboundary", PLACE="larvotto")
    (row,) = run.rows("BOUNDARIES")
    assert (row["rank"], row["name"], row["osm_id"]) == (1, "Larvotto", "R5986437")
    assert (row["kind"], row["admin_level"]) == ("administrative", 10)
    assert row["area_ha"] == pytest.approx(23.5, abs=0.1)
    assert row["geometry"].isMultipart()
    assert run.layers["BOUNDARIES"].crs().authid() == "EPSG:4326"
    assert run.results["FOUND"] == 1
    assert run.results["AREA"] == pytest.approx(row["area_ha"])
    assert run.results["OSM_ID"] == "R5986437"
    assert "Larvotto" in run.results["NAME"]


def test_fields_are_those_declared(toolbox, addresses, package):
    compat = package("plugin.compat")
    run = toolbox.run("osmboundary", PLACE="Larvotto")
    (kind,) = toolbox.tool("osmboundary").layers.values()
    fields = run.layers["BOUNDARIES"].fields()
    assert [f.name() for f in fields] == [f.name for f in kind.fields]
    assert [f.type() for f in fields] == [compat.FIELD_TYPES[f.kind] for f in kind.fields]
    assert run.layers["BOUNDARIES"].wkbType() == kind.wkb


def test_candidates_are_told_and_one_can_be_chosen(toolbox, addresses):
    run = toolbox.run("osmboundary", PLACE="Twinbrook")
    assert [row["rank"] for row in run.rows("BOUNDARIES")] == [1, 2]
    assert any("2 areas are listed for 'Twinbrook'" in text for text in run.said.warnings)
    assert any("2. Twinbrook, County 1" in text for text in run.said.infos)
    run = toolbox.run("osmboundary", PLACE="Twinbrook", RANK=2)
    (row,) = run.rows("BOUNDARIES")
    assert (row["rank"], row["display_name"]) == (2, "Twinbrook, County 1")
    assert run.results["FOUND"] == 2
    with pytest.raises(FailedError, match="no candidate of rank 3: 2 were found"):
        toolbox.run("osmboundary", PLACE="Twinbrook", RANK=3)


def test_a_rank_beyond_the_number_that_is_listed(toolbox, addresses):
    run = toolbox.run("osmboundary", PLACE="Twinbrook", LIMIT=1, RANK=2)
    (row,) = run.rows("BOUNDARIES")
    assert (row["rank"], row["display_name"]) == (2, "Twinbrook, County 1")


def test_a_point_in_the_crs_of_the_map(toolbox, addresses):
    from qgis.core import QgsCoordinateReferenceSystem, QgsPointXY, QgsReferencedPointXY

    degrees = toolbox.run("osmboundary", POINT=PORTIER)
    metres = toolbox.run(
        "osmboundary",
        POINT=QgsReferencedPointXY(
            QgsPointXY(827382.1, 5425525.5), QgsCoordinateReferenceSystem("EPSG:3857")
        ),
    )
    ids = [row["osm_id"] for row in degrees.rows("BOUNDARIES")]
    assert ids == ["W686693023", "R5986438", "W1034851198"]
    assert [row["osm_id"] for row in metres.rows("BOUNDARIES")] == ids


def test_a_file_needs_no_network(toolbox, addresses):
    addresses("hang")
    run = toolbox.run("osmboundary", PLACE="W686693023", SOURCE_FILE=str(SHIPPED))
    (row,) = run.rows("BOUNDARIES")
    assert row["name"] == "L'Anse du Portier"


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({}, "neither a place nor a point"),
        ({"PLACE": "Larvotto", "SOURCE_FILE": "/nowhere/x.osm.pbf"}, "There is no file"),
        ({"PLACE": "Larvotto", "SOURCE_FILE": __file__}, "no OpenStreetMap file"),
        ({"POINT": "7.4,143.7 [EPSG:4326]"}, "not on the globe|Point"),
        ({"PLACE": "https://www.openstreetmap.org/about"}, "names nothing in OpenStreetMap"),
        ({"PLACE": "Larvotto", "LIMIT": 0}, "LIMIT|Most candidates|candidates"),
    ],
)
def test_what_cannot_be_is_refused_before_the_run(toolbox, addresses, given, text):
    with pytest.raises(RefusedError, match=text):
        toolbox.run("osmboundary", **given)


def test_a_setting_that_cannot_be_is_refused_before_the_run(toolbox, addresses):
    addresses(PLATWRIGHT_NOMINATIM_URL="no address")
    with pytest.raises(RefusedError, match="no address"):
        toolbox.run("osmboundary", PLACE="Larvotto")


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("429", "too many requests"),
        ("html", "web page instead of data"),
        ("half", "broke off"),
        ("hang", "no answer within 3 seconds"),
    ],
)
def test_failures_are_sentences(toolbox, addresses, kind, text):
    addresses(kind)
    with pytest.raises(FailedError, match=text):
        toolbox.run("osmboundary", PLACE="Larvotto")


def test_cancelled_within_a_second(toolbox, addresses):
    import threading

    addresses("hang", PLATWRIGHT_TIMEOUT="30")
    said = Listener()
    threading.Timer(0.5, said.cancel).start()
    start = time.monotonic()
    run = toolbox.run("osmboundary", PLACE="Larvotto", listener=said)
    assert time.monotonic() - start < allowed(1.6)
    assert run.results == {}
    assert any("Cancelled" in text for text in said.warnings)


def test_whose_the_data_is_stands_in_the_metadata(toolbox, addresses, package, tmp_path):
    path = tmp_path / "boundary.gpkg"
    run = toolbox.run("osmboundary", PLACE="Larvotto", BOUNDARIES=str(path))
    record = package("plugin.record").read_record(run.layers["BOUNDARIES"])
    assert "OpenStreetMap contributors" in record["credits"]
    assert "2023-12-26" in record["credits"]
    assert "Data of 2023-12-26: © OpenStreetMap contributors" in (
        run.layers["BOUNDARIES"].dataProvider().layerMetadata().abstract()
        or run.layers["BOUNDARIES"].htmlMetadata()
    )
    made = package("plugin.record").Record(
        "platwright:osmboundary", "Boundaries", "{}", "{}", {"attribution": "© me", "licence": "L"}
    )
    assert made.metadata().rights() == ["© me"]
    assert made.metadata().licenses() == ["L"]


def test_the_candidates_look_different_and_are_labelled(toolbox, addresses, package, artefacts):
    from qgis.core import QgsMapRendererParallelJob, QgsMapSettings
    from qgis.PyQt.QtCore import QSize

    run = toolbox.run("osmboundary", POINT=PORTIER)
    layer = run.layers["BOUNDARIES"]
    (kind,) = toolbox.tool("osmboundary").layers.values()
    package("plugin.styles").apply(layer, kind)
    assert layer.labelsEnabled()
    colours = {
        category.value(): category.symbol().symbolLayer(0).strokeColor().name()
        for category in layer.renderer().categories()
    }
    assert len({colours[rank] for rank in (1, 2, 3)}) == 3
    settings = QgsMapSettings()
    settings.setLayers([layer])
    settings.setExtent(layer.extent().buffered(0.001))
    settings.setDestinationCrs(layer.crs())
    settings.setOutputSize(QSize(700, 560))
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    image = job.renderedImage()
    image.save(str(artefacts / "osmboundary.png"))
    seen = {image.pixelColor(x, y).name() for x in range(0, 700, 2) for y in range(0, 560, 2)}
    assert all(any(near(colour, other) for other in seen) for colour in list(colours.values())[:3])


def near(one, other):
    pairs = [(int(one[k : k + 2], 16), int(other[k : k + 2], 16)) for k in (1, 3, 5)]
    return all(abs(a - b) < 24 for a, b in pairs)


# The real program.

needs_program = pytest.mark.skipif(binary.PROGRAM is None, reason="qgis_process is not installed")


@needs_program
def test_the_program_finds_a_place_and_works_offline_afterwards(
    qgis_process, addresses, server, tmp_path
):
    path = tmp_path / "portier.gpkg"
    words = binary.tool("osmboundary", PLACE="L'Anse du Portier", BOUNDARIES=path)
    said = qgis_process(*words, **addresses())
    assert re.search(r"^OSM_ID:\tW686693023$", said, re.MULTILINE), said
    (row,) = binary.rows(path)
    assert row["area_ha"] == pytest.approx(6.6, abs=0.1)
    before = len(server.log)
    path.unlink()
    said = qgis_process(*words, **addresses(PLATWRIGHT_ONLY_CACHE="true"))
    assert len(binary.rows(path)) == 1
    assert len(server.log) == before


@needs_program
def test_the_program_says_what_went_wrong(qgis_process, addresses, tmp_path):
    path = tmp_path / "none.gpkg"
    words = binary.tool("osmboundary", PLACE="Larvotto", BOUNDARIES=path)
    said = qgis_process(*words, **addresses("504"))
    assert "too busy, or the area too large for it (HTTP 504)" in said
    said = qgis_process(
        *words, **addresses(PLATWRIGHT_NOMINATIM_URL="http://no-such-host.invalid/")
    )
    assert "its name is not known here (DNS)" in said
    said = qgis_process(
        *binary.tool("osmboundary", PLACE="Nowhere at all", BOUNDARIES=path), **addresses()
    )
    assert "knows no place called 'Nowhere at all'. Check the spelling" in said
    assert not path.exists()


@needs_program
def test_an_interrupt_while_the_server_keeps_silent(environment, addresses, tmp_path):
    path = tmp_path / "none.gpkg"
    words = binary.tool("osmboundary", PLACE="Larvotto", BOUNDARIES=path)
    silent = {**environment, **addresses("hang", PLATWRIGHT_TIMEOUT="60")}
    said, seconds = binary.interrupted(silent, words, "Looking for")
    assert "no layer was written" in said
    assert seconds < 5
    assert not path.exists()
