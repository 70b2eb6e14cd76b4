"""OpenStreetMap layers: as Processing runs it, in the real program, and on to a design."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytest.importorskip("osmnx")
pytest.importorskip("osmium")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from server import SHIPPED, Server  # noqa: E402
from support import FailedError, Listener, RefusedError, layer  # noqa: E402

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process

KEYS = ("STREETS", "INTERSECTIONS", "BUILDINGS", "LANDUSE", "OBSTACLES")
#: A rectangle of some 180 by 220 m at the east end of Monaco's beach.
EXTENT = "7.4300,7.4322,43.7430,43.7450"
RECTANGLE = "POLYGON((7.43 43.743,7.4322 43.743,7.4322 43.745,7.43 43.745,7.43 43.743))"


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


@pytest.fixture
def addresses(server, monkeypatch, tmp_path):
    """Lead the plugin to the server, or to broken answers of it."""

    def lead(broken=""):
        found = {
            "PLATWRIGHT_OVERPASS_URL": server.addresses(broken)["overpass_url"],
            "PLATWRIGHT_TIMEOUT": "3",
            "PLATWRIGHT_RATE_LIMIT": "false",
            "PLATWRIGHT_CACHE": str(tmp_path / "cache"),
        }
        for name, text in found.items():
            monkeypatch.setenv(name, text)
        return found

    return lead


def area(crs="EPSG:4326", shape=RECTANGLE, **options):
    made = layer([shape], crs="EPSG:4326", name="my area", **options)
    if crs == "EPSG:4326":
        return made
    import processing

    return processing.run(
        "native:reprojectlayer", {"INPUT": made, "TARGET_CRS": crs, "OUTPUT": "memory:my area"}
    )["OUTPUT"]


@pytest.fixture(scope="module")
def run(toolbox):
    return toolbox.run("osmlayers", INPUT=area(), SOURCE_FILE=str(SHIPPED))


def test_layers_are_ready_to_design_with(run):
    assert set(run.layers) == set(KEYS)
    for key in KEYS:
        assert run.layers[key].crs().authid() == "EPSG:32632", "metres, in the zone of the place"
        assert run.layers[key].featureCount() > 0, key
        assert all(row["geometry"].isGeosValid() for row in run.rows(key)), key
    rows = run.rows("STREETS")
    assert run.results["STREET_COUNT"] == len(rows)
    assert run.results["LENGTH"] == pytest.approx(sum(row["length_m"] for row in rows))
    # Length on the ground against length in the CRS, which is true to 0.1 % there.
    for row in rows:
        assert row["geometry"].length() == pytest.approx(row["length_m"], rel=1e-3, abs=0.01)
    assert {row["level"] for row in rows} <= {1, 2, 3, 4}
    assert "primary" in {row["highway"] for row in rows}
    assert run.results["AREA"] == pytest.approx(3.93, abs=0.05)
    assert any("© OpenStreetMap contributors" in text for text in run.said.infos)


def test_fields_are_those_declared(run, toolbox, package):
    compat = package("plugin.compat")
    for key, kind in toolbox.tool("osmlayers").layers.items():
        fields = run.layers[key].fields()
        assert [f.name() for f in fields] == [f.name for f in kind.fields], key
        assert [f.type() for f in fields] == [compat.FIELD_TYPES[f.kind] for f in kind.fields]
        assert run.layers[key].wkbType() == kind.wkb


def test_what_is_not_mapped_is_null(run):
    speeds = [row["speed_kmh"] for row in run.rows("STREETS")]
    assert any(isinstance(speed, float) for speed in speeds)
    assert all(speed is None or speed == speed for speed in speeds), "NULL, never NaN"
    assert {row["oneway"] for row in run.rows("STREETS")} <= {True, False}


def test_every_layer_has_its_style(run, package):
    from qgis.core import NULL, QgsRenderContext

    styles = package("plugin.styles")
    kinds = package("plugin.tools.osmlayers").OsmLayers.layers
    for key, kind in kinds.items():
        made = run.layers[key]
        styles.apply(made, kind)
        context = QgsRenderContext()
        renderer = made.renderer()
        renderer.startRender(context, made.fields())
        for feature in made.getFeatures():
            context.expressionContext().setFeature(feature)
            assert renderer.symbolForFeature(feature, context) is not None, (key, feature[1])
        renderer.stopRender(context)
    assert NULL is not None


@pytest.mark.parametrize(
    ("crs", "expected"),
    [
        ("EPSG:32632", "EPSG:32632"),
        ("EPSG:25832", "EPSG:25832"),
        ("EPSG:2154", "EPSG:2154"),
        ("EPSG:3857", "EPSG:32632"),
        ("EPSG:3035", "EPSG:32632"),
    ],
)
def test_the_crs_is_that_of_the_input_where_lengths_are_true(toolbox, crs, expected):
    run = toolbox.run("osmlayers", INPUT=area(crs), SOURCE_FILE=str(SHIPPED))
    assert run.layers["STREETS"].crs().authid() == expected
    assert run.results["STREET_COUNT"] > 5


def test_an_extent_instead_of_a_layer(toolbox, run):
    other = toolbox.run("osmlayers", EXTENT=f"{EXTENT} [EPSG:4326]", SOURCE_FILE=str(SHIPPED))
    ids = [sorted(row["osm_id"] for row in found.rows("STREETS")) for found in (run, other)]
    assert ids[0] == ids[1]
    assert other.layers["STREETS"].crs().authid() == "EPSG:32632"


def test_a_selection_and_several_polygons_are_one_area(toolbox):
    west, east = (f"POLYGON(({a} 43.743,{b} 43.743,{b} 43.745,{a} 43.745,{a} 43.743))"
                  for a, b in ((7.43, 7.4311), (7.4311, 7.4322)))  # fmt: skip
    both = layer([west, east, None], crs="EPSG:4326")
    run = toolbox.run("osmlayers", INPUT=both, SOURCE_FILE=str(SHIPPED))
    assert run.results["AREA"] == pytest.approx(3.93, abs=0.05)


def test_reach_and_network_type(toolbox, run):
    near = toolbox.run("osmlayers", INPUT=area(), SOURCE_FILE=str(SHIPPED), REACH=0)
    assert near.results["LENGTH"] < run.results["LENGTH"]
    walk = toolbox.run("osmlayers", INPUT=area(), SOURCE_FILE=str(SHIPPED), NETWORK_TYPE="walk")
    assert "footway" in {row["highway"] for row in walk.rows("STREETS")}
    assert "footway" not in {row["highway"] for row in run.rows("STREETS")}


def test_from_the_server(toolbox, run, addresses):
    addresses()
    online = toolbox.run("osmlayers", INPUT=area())
    for key in KEYS:
        ids = [sorted(str(row["osm_id"]) for row in found.rows(key)) for found in (run, online)]
        assert ids[0] == ids[1], key


@pytest.mark.parametrize(
    ("broken", "text"),
    [("html", "web page"), ("429", "too many requests"), ("hang", "no answer within 3")],
)
def test_a_broken_server_is_a_sentence(toolbox, addresses, broken, text):
    addresses(broken)
    with pytest.raises(FailedError, match=text):
        toolbox.run("osmlayers", INPUT=area())


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({}, "No area is given"),
        ({"EXTENT": "385000,385100,6672000,6672100 [EPSG:4326]"}, "do not fit"),
        ({"EXTENT": "7,7,43,43 [EPSG:4326]"}, "no area|Extent"),
        ({"EXTENT": "nonsense"}, "EXTENT|cannot be read"),
        ({"EXTENT": EXTENT}, "no coordinate reference system"),
        ({"EXTENT": "5,15,40,50 [EPSG:4326]"}, "at most 1,000 km2"),
        ({"EXTENT": "10,10.01,10,10.01 [EPSG:4326]"}, "nothing inside the polygon"),
        ({"EXTENT": f"{EXTENT} [EPSG:4326]", "SOURCE_FILE": "/nowhere/x.osm"}, "There is no file"),
        ({"EXTENT": f"{EXTENT} [EPSG:4326]", "SOURCE_FILE": __file__}, "no OpenStreetMap file"),
    ],
)
def test_bad_input_is_a_sentence(toolbox, given, text):
    given = {"SOURCE_FILE": str(SHIPPED), **given}
    with pytest.raises((RefusedError, FailedError), match=text):
        toolbox.run("osmlayers", **given)
    with pytest.raises(FailedError, match=text):
        toolbox.run("osmlayers", check=False, **given)


def test_both_an_area_and_an_extent(toolbox):
    with pytest.raises(RefusedError, match="Clear one of them"):
        toolbox.run("osmlayers", INPUT=area(), EXTENT=f"{EXTENT} [EPSG:4326]")


def test_layers_that_are_no_area(toolbox):
    flat = layer(["POLYGON((7.43 43.743,7.44 43.743,7.43 43.743))"], crs="EPSG:4326", name="flat")
    with pytest.raises(FailedError, match=r"flat.*no polygon with an area"):
        toolbox.run("osmlayers", INPUT=flat, SOURCE_FILE=str(SHIPPED))
    none = layer([RECTANGLE], crs="", name="nowhere")
    with pytest.raises(RefusedError, match="no coordinate reference system"):
        toolbox.run("osmlayers", INPUT=none, SOURCE_FILE=str(SHIPPED))


def test_a_damaged_file(toolbox, tmp_path):
    path = tmp_path / "half.osm.pbf"
    path.write_bytes(SHIPPED.read_bytes()[:50000])
    with pytest.raises(FailedError, match=r"half\.osm\.pbf cannot be read: it is damaged"):
        toolbox.run("osmlayers", INPUT=area(), SOURCE_FILE=str(path))


def test_cancel_leaves_nothing(toolbox):
    listener = Listener(cancel_at="Simplifying")
    run = toolbox.run("osmlayers", listener=listener, INPUT=area(), SOURCE_FILE=str(SHIPPED))
    assert run.layers == {}
    assert "Cancelled before" in run.said.warnings[-1]


def test_in_the_real_program_with_credits(qgis_process, package, tmp_path):
    from qgis.core import QgsVectorLayer

    outputs = {key: tmp_path / f"{key.lower()}.gpkg" for key in KEYS}
    outputs["BUILDINGS"] = tmp_path / "buildings.geojson"
    said = qgis_process(
        *binary.tool("osmlayers", EXTENT=f"{EXTENT} [EPSG:4326]", SOURCE_FILE=SHIPPED, **outputs)
    )
    assert "© OpenStreetMap contributors" in said
    read_record = package("plugin.record").read_record
    for key, path in outputs.items():
        assert binary.rows(path), key
        made = QgsVectorLayer(str(path), key, "ogr")
        credit = json.loads(read_record(made)["credits"])
        assert credit["attribution"] == "© OpenStreetMap contributors", key
        assert "ODbL" in credit["licence"]
        assert (credit["date"], credit["source"]) == ("2023-12-26", "monaco.osm.pbf")
    assert made.metadata().type() in ("dataset", "")


def test_in_the_real_program_from_the_server(qgis_process, addresses, tmp_path):
    path = tmp_path / "streets.gpkg"
    said = qgis_process(
        *binary.tool("osmlayers", EXTENT=f"{EXTENT} [EPSG:4326]", STREETS=path), **addresses()
    )
    assert "Fetching streets from OpenStreetMap" in said
    assert len(binary.rows(path)) > 5
    said = qgis_process(
        *binary.tool("osmlayers", EXTENT=f"{EXTENT} [EPSG:4326]", STREETS=path), **addresses("html")
    )
    assert "web page" in said


@pytest.mark.slow
def test_from_a_place_to_a_design(toolbox):
    """The chain of the tutorial: boundary, layers, site, streets."""
    place = toolbox.run("osmboundary", PLACE="L'Anse du Portier", SOURCE_FILE=str(SHIPPED))
    site = place.layers["BOUNDARIES"]
    osm = toolbox.run("osmlayers", INPUT=site, SOURCE_FILE=str(SHIPPED))
    given = {"ROADS": osm.layers["STREETS"], "OBSTACLES": osm.layers["OBSTACLES"]}
    ready = toolbox.run("preparesite", INPUT=site, **given)
    assert ready.results["SITES"] == 1
    names = {row["name"] for row in ready.rows("BOUNDARY_STREETS")}
    assert "Avenue Princesse Grace" in names
    assert ready.rows("ACCESS_POINTS")
    design = toolbox.run(
        "designstreets", INPUT=site, BLOCK_WIDTH=50, BLOCK_LENGTH=100, TIME_LIMIT=20, **given
    )
    assert design.results["TOTAL_LENGTH"] > 300
    assert design.results["VIOLATIONS"] == 0


def test_the_extract_that_comes_along_is_small(root: Path):
    assert SHIPPED.stat().st_size < 300_000
    notice = (root / "data" / "osm" / "NOTICE.md").read_text(encoding="utf-8")
    assert "© OpenStreetMap contributors" in notice
    assert "Open Database License" in notice
