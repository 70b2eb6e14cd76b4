"""The models that come with the plugin: up to date, explained, and run as a planner runs them."""

from __future__ import annotations

import contextlib
import csv
import os
import sqlite3
import subprocess
import sys

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

import test_binary as binary  # noqa: E402
from qgis.core import Qgis, QgsProcessingOutputLayerDefinition, QgsProject  # noqa: E402
from report_reading import parsed  # noqa: E402
from support import FailedError, Listener, RefusedError, layer, line, roads, site  # noqa: E402

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process

NAMES = (
    "comparedesigns", "floorplan", "growstreetsandparcels", "parcelstodesign", "placetodesign",
    "placetoreport", "residentialzone",
    "streetsandparcels",
)  # fmt: skip
#: What saved settings and other models may depend on.
KEYS = {
    "placetodesign": {
        "PLACE", "RANK", "SOURCE_FILE", "BUILT_ON", "PRESET", "BLOCK_WIDTH", "BLOCK_LENGTH",
        "SINK_MODE", "SNAP_DISTANCE", "INNER_ROADS", "TIME_LIMIT", "map:STREETS",
        "map:BUILDINGS", "map:OBSTACLES", "site:SITE", "site:BOUNDARY_STREETS",
        "site:ACCESS_POINTS", "site:SITE_OBSTACLES", "site:PROBLEMS", "design:STREETS",
        "design:JUNCTIONS", "design:BLOCKS", "design:PROBLEMS", "check:PROBLEMS",
    },
    "parcelstodesign": {
        "INPUT", "ROADS", "OBSTACLES", "PRESET", "BLOCK_WIDTH", "BLOCK_LENGTH", "SINK_MODE",
        "SNAP_DISTANCE", "INNER_ROADS", "TIME_LIMIT", "MESH_EDGES", "site:SITE",
        "site:BOUNDARY_STREETS", "site:ACCESS_POINTS", "site:SITE_OBSTACLES", "site:PROBLEMS",
        "design:STREETS", "design:JUNCTIONS", "design:BLOCKS", "design:PROBLEMS",
        "check:PROBLEMS",
    },
    "streetsandparcels": {
        "INPUT", "ROADS", "OBSTACLES", "BLOCK_WIDTH", "PARCEL_WIDTH", "PARCEL_DEPTH", "METHOD",
        "DEEP_BLOCKS", "PRESET", "SINK_MODE", "TIME_LIMIT", "SNAP_DISTANCE", "site:SITE",
        "site:PROBLEMS", "streets:STREETS", "streets:PROBLEMS", "parcels:PARCELS",
        "parcels:BLOCKS", "parcels:STREET_SPACE", "parcels:PROBLEMS",
    },
    "growstreetsandparcels": {
        "INPUT", "ROADS", "OBSTACLES", "GRAMMAR", "SCALE", "SEED", "PARCEL_WIDTH", "PARCEL_DEPTH",
        "LARGEST_BLOCK", "GRAMMAR_FILE", "MAX_LENGTH", "EDGE", "DEAD_ENDS", "INNER_ROADS",
        "METHOD", "DEEP_BLOCKS",
        "SNAP_DISTANCE", "site:SITE", "site:PROBLEMS", "streets:STREETS", "streets:NODES",
        "streets:PROBLEMS", "parcels:PARCELS", "parcels:BLOCKS", "parcels:STREET_SPACE",
        "parcels:PROBLEMS", "measures:HISTOGRAM",
    },
    "placetoreport": {
        "PLACE", "RANK", "SOURCE_FILE", "BUILT_ON", "PRESET", "BLOCK_WIDTH", "BLOCK_LENGTH",
        "SINK_MODE", "SNAP_DISTANCE", "INNER_ROADS", "TIME_LIMIT", "DENSITY", "TARGETS",
        "map:STREETS", "map:BUILDINGS", "map:OBSTACLES", "site:SITE", "site:BOUNDARY_STREETS",
        "site:ACCESS_POINTS", "site:SITE_OBSTACLES", "site:PROBLEMS", "design:STREETS",
        "design:JUNCTIONS", "design:BLOCKS", "design:PROBLEMS", "check:PROBLEMS",
        "parcels:PARCELS", "traffic:STREETS", "report:OUTPUT",
    },
    "residentialzone": {
        "INPUT", "ROADS", "OBSTACLES", "BLOCK_WIDTH", "BLOCK_LENGTH", "TYPE_SET", "PATTERN", "FAR",
        "SUN_COEFFICIENT", "BUILDING_TYPES", "DENSITY", "GREEN_RATIO", "SUN_HOURS",
        "PATH_PATTERN", "METHOD", "SEED", "SNAP_DISTANCE", "site:SITE", "site:PROBLEMS",
        "streets:STREETS", "streets:PROBLEMS", "zone:BUILDINGS", "zone:SHADOWS", "zone:PATHS",
        "zone:PARKING_BAYS", "zone:GREEN", "zone:TREES", "zone:PATCHES_USED",
        "zone:CORRIDORS_USED", "zone:PROBLEMS",
    },
    "floorplan": {
        "INPUT", "SINKS", "OBSTACLES", "TEMPLATE_SET", "MODULE", "STOREYS", "CORRIDOR_WIDTH",
        "TEMPLATES", "TEMPLATE_FILE", "DEAD_ENDS", "CORRIDORS_GIVEN", "TIME_LIMIT", "SEED",
        "plan:ROOMS", "plan:CORRIDORS", "plan:CORRIDOR_LINES", "plan:DOORS", "plan:SHAFTS",
        "plan:PROBLEMS", "schedule:OUTPUT",
    },
    "comparedesigns": {
        "FIRST", "SECOND", "SITE", "ROADS", "OBSTACLES", "BLOCK_WIDTH", "SNAP_DISTANCE",
        "NAME_1", "NAME_2", "check1:PROBLEMS", "check2:PROBLEMS", "compared:OUTPUT",
    },
}  # fmt: skip
PLACE = "L'Anse du Portier"


@pytest.fixture(params=NAMES)
def model(request, toolbox):
    return toolbox.tool(request.param)


@pytest.mark.skipif(
    Qgis.QGIS_VERSION_INT >= 32300, reason="the files are written by QGIS 3.22, as others differ"
)
def test_the_files_are_what_the_tools_imply(root):
    done = subprocess.run(
        [sys.executable, str(root / "scripts" / "_models.py"), "--check"],
        env={**os.environ, "QT_HASH_SEED": "0", "QT_QPA_PLATFORM": "offscreen"},
        capture_output=True, text=True, timeout=100, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"Run scripts/make_models.\n{done.stdout}{done.stderr}"


def test_they_are_in_a_group_of_their_own(provider):
    groups = {a.name(): a.group() for a in provider.algorithms() if a.groupId() == "models"}
    assert groups == dict.fromkeys(NAMES, "Models")


def test_keys_stay(model):
    assert {p.name() for p in model.parameterDefinitions()} == KEYS[model.name()]


def test_every_step_is_known_and_its_packages_are_there(model):
    good, text = model.canExecute()
    assert good, text
    assert {"shapely", "geopandas"} <= set(model.needs)
    steps = {child.algorithmId() for child in model.childAlgorithms().values()}
    if "platwright:designstreets" in steps:
        assert "networkx" in model.needs


def test_missing_packages_are_said(model, package, monkeypatch):
    deps = package("plugin.deps")
    monkeypatch.setattr(deps, "missing_text", lambda names: f"lacks {len(names)}")
    good, text = model.canExecute()
    assert not good
    assert text == f"lacks {len(model.needs)}"


def test_every_input_is_explained_and_eight_are_basic(model):
    told = model.described().inputs
    assert all(own.text.endswith(".") and len(own.text) > 15 for own in told)
    assert len([own for own in told if not own.advanced]) <= 8
    assert model.shortDescription().endswith(".")
    text = model.shortHelpString()
    assert all(own.title in text for own in told)


def test_inputs_are_asked_for_in_the_order_of_the_work(toolbox):
    keys = [own.key for own in toolbox.tool("placetodesign").described().inputs]
    assert keys[:4] == ["PLACE", "RANK", "SOURCE_FILE", "BUILT_ON"]
    keys = [own.key for own in toolbox.tool("parcelstodesign").described().inputs]
    assert keys[:3] == ["INPUT", "ROADS", "OBSTACLES"]


def test_only_the_main_layer_must_be_made(model):
    from qgis.core import QgsProcessingParameterDefinition

    optional = QgsProcessingParameterDefinition.Flag.FlagOptional
    needed = [p.name() for p in model.destinationParameterDefinitions() if not p.flags() & optional]
    assert len(needed) == 1
    main = (
        "design:STREETS", "compared:OUTPUT", "parcels:PARCELS", "zone:BUILDINGS", "plan:ROOMS",
        "report:OUTPUT",
    )  # fmt: skip
    assert needed[0] in main


def test_the_files_open_in_the_model_designer(package, toolbox):
    from qgis.core import QgsProcessingModelAlgorithm

    for path in package("plugin.models").FOLDER.glob("*.model3"):
        plain = QgsProcessingModelAlgorithm()
        assert plain.fromFile(str(path))
        good, why = plain.validate()
        assert good, why
        places = [(c.position().x(), c.position().y()) for c in plain.childAlgorithms().values()]
        assert len(set(places)) == len(places)


def test_from_parcels_and_roads(toolbox):
    run = toolbox.run("parcelstodesign", INPUT=site(), ROADS=roads(), TIME_LIMIT=3)
    assert any(row["status"] == "new" for row in run.rows("design:STREETS"))
    (ground,) = run.rows("site:SITE")
    assert ground["area_m2"] == pytest.approx(60000, rel=0.01)
    assert not [row for row in run.rows("check:PROBLEMS") if row["severity"] == "error"]
    # There are no obstacles here: the empty layer of them goes into the next steps.
    assert run.rows("site:SITE_OBSTACLES") == []


def test_streets_and_parcels_of_a_site(toolbox):
    run = toolbox.run("streetsandparcels", INPUT=site(), ROADS=roads(), TIME_LIMIT=3)
    parcels, space = run.rows("parcels:PARCELS"), run.rows("parcels:STREET_SPACE")
    land = sum(row["area_m2"] for row in [*parcels, *space])
    assert land == pytest.approx(60000, rel=1e-4)
    lots = [row for row in parcels if row["land_use"] == "parcel"]
    assert len(lots) > 50
    assert all(row["access"] for row in lots)
    assert any(row["status"] == "new" for row in run.rows("streets:STREETS"))


def test_streets_and_parcels_of_a_site_grown(toolbox):
    run = toolbox.run("growstreetsandparcels", INPUT=site(), ROADS=roads(), GRAMMAR="grid")
    parcels, space = run.rows("parcels:PARCELS"), run.rows("parcels:STREET_SPACE")
    land = sum(row["area_m2"] for row in [*parcels, *space])
    assert land == pytest.approx(sum(row["area_m2"] for row in run.rows("site:SITE")), rel=1e-3)
    assert len([row for row in parcels if row["land_use"] == "parcel"]) > 40
    assert any(row["status"] == "new" for row in run.rows("streets:STREETS"))
    assert {row["measure"] for row in run.rows("measures:HISTOGRAM")} >= {"p_angle", "p_area"}


def test_floor_plan_of_a_footprint(toolbox):
    run = toolbox.run("floorplan", INPUT=site(), MODULE=25, CORRIDOR_WIDTH=5, STOREYS=2,
                      TEMPLATE_SET="basic", TIME_LIMIT=3)  # fmt: skip
    rooms, corridors = run.rows("plan:ROOMS"), run.rows("plan:CORRIDORS")
    assert {row["floor"] for row in rooms} == {0, 1}
    covered = sum(row["area_m2"] for row in [*rooms, *corridors])
    assert covered == pytest.approx(2 * 60000, rel=1e-3)
    listed = {(row["floor"], row["template"]): row for row in run.rows("schedule:OUTPUT")}
    assert set(listed) == {(row["floor"], row["template"]) for row in rooms}
    for (storey, template), row in listed.items():
        own = [r for r in rooms if (r["floor"], r["template"]) == (storey, template)]
        ways = [r["distance_m"] for r in own]
        assert row["rooms"] == len(own)
        assert row["area_m2"] == pytest.approx(sum(r["area_m2"] for r in own), abs=0.02)
        assert row["mean_way_m"] == pytest.approx(sum(ways) / len(ways), abs=0.02)
        assert row["longest_way_m"] == pytest.approx(max(ways), abs=0.02)


def test_choices_may_be_numbers(toolbox):
    good = {"INPUT": site(), "PRESET": "2", "SINK_MODE": 1, "TIME_LIMIT": 2}
    run = toolbox.run("parcelstodesign", **good)
    assert len(run.rows("design:BLOCKS")) >= 6
    with pytest.raises(RefusedError):
        toolbox.run("parcelstodesign", INPUT=site(), PRESET="nothing of the sort")


def test_errors_of_a_step_are_sentences(toolbox):
    with pytest.raises(FailedError) as found:
        toolbox.run("parcelstodesign", INPUT=site(crs=""), ROADS=roads())
    assert "coordinate reference system" in str(found.value)
    assert "Traceback" not in str(found.value)


def test_loaded_layers_have_our_styles_and_readable_names(toolbox):
    from qgis.core import QgsProcessingContext, QgsProcessingUtils

    model = toolbox.tool("parcelstodesign")
    project = QgsProject()
    wanted = {
        key: QgsProcessingOutputLayerDefinition("TEMPORARY_OUTPUT", project)
        for key in ("design:STREETS", "design:BLOCKS", "site:SITE")
    }
    context, said = QgsProcessingContext(), Listener()
    context.setProject(project)
    given = {"INPUT": site(), "ROADS": roads(), "TIME_LIMIT": 2, **wanted}
    results, good = model.run(given, context, said)
    assert good, said.errors
    titles, looks = {}, {}
    for key in wanted:
        assert context.willLoadLayerOnCompletion(results[key])
        details = context.layerToLoadOnCompletionDetails(results[key])
        made = QgsProcessingUtils.mapLayerFromString(results[key], context)
        titles[key] = details.name
        details.postProcessor().postProcessLayer(made, context, said)
        looks[key] = made.renderer().type()
    assert titles == {"design:STREETS": "Streets", "design:BLOCKS": "Blocks", "site:SITE": "Site"}
    assert looks["design:STREETS"] == "categorizedSymbol"
    assert looks["design:BLOCKS"] == "graduatedSymbol"


def drawn(*lines, name):
    return layer(
        list(lines), kind="LineString", name=name, fields="field=status:string(20)",
        values=[["new"]] * len(lines),
    )  # fmt: skip


def test_compare_two_designs(toolbox):
    """A street through the middle, and one that ends there."""
    through = drawn(line((150, 0), (150, 100), (150, 200)), name="through")
    ending = drawn(line((150, 0), (150, 100)), name="ending")
    given = {"FIRST": through, "SECOND": ending, "SITE": site(), "ROADS": roads(), "NAME_2": "stub"}
    run = toolbox.run("comparedesigns", **given)
    first, second = run.rows("compared:OUTPUT")
    assert (first["design"], second["design"]) == ("through", "stub")
    assert "layer" not in first
    assert (first["length_m"], second["length_m"]) == pytest.approx((200, 100))
    assert (first["blocks"], second["blocks"]) == (2, 1)
    assert first["violations"] == 0
    assert second["violations"] == 1
    assert run.rows("check1:PROBLEMS") == []
    (found,) = run.rows("check2:PROBLEMS")
    assert found["kind"] == "dead end"
    # The same figures as the tool gives alone.
    alone = toolbox.run("measuredesign", INPUT=through, SITE=site(), BOUNDARY_STREETS=roads())
    assert alone.results["LENGTH_M"] == pytest.approx(first["length_m"])


# In the real program


def arguments(name, **given):
    return ["run", f"platwright:{name}", *(f"--{key}={text}" for key, text in given.items())]


def designed(path):
    """Read the streets of a design back, and check that they carry style and record."""
    from qgis.core import QgsVectorLayer

    made = QgsVectorLayer(str(path), "made", "ogr")
    assert made.isValid()
    assert made.renderer().type() == "categorizedSymbol"
    return made


@pytest.mark.slow
def test_a_place_without_a_network(qgis_process, root, tmp_path, package):
    given = {
        "PLACE": PLACE, "SOURCE_FILE": root / "data" / "osm" / "monaco.osm.pbf",
        "SINK_MODE": "whole boundary", "TIME_LIMIT": 5,
        "design:STREETS": tmp_path / "streets.gpkg", "check:PROBLEMS": tmp_path / "check.gpkg",
        "map:STREETS": tmp_path / "osm.gpkg",
    }  # fmt: skip
    said = qgis_process(*arguments("placetodesign", **given), timeout=200)
    made = designed(tmp_path / "streets.gpkg")
    assert made.crs().authid() == "EPSG:32632"
    assert sum(f["length_m"] for f in made.getFeatures() if f["status"] == "new") > 700
    assert not [r for r in binary.rows(tmp_path / "check.gpkg") if r["severity"] == "error"], said
    record = package("plugin.record").read_record(made)
    assert record["tool"] == "platwright:designstreets"
    from qgis.core import QgsVectorLayer

    around = QgsVectorLayer(str(tmp_path / "osm.gpkg"), "osm", "ogr")
    assert "OpenStreetMap" in package("plugin.record").read_record(around)["credits"]


@pytest.mark.slow
def test_a_place_and_a_page_about_its_design(qgis_process, root, tmp_path):
    given = {
        "PLACE": PLACE, "SOURCE_FILE": root / "data" / "osm" / "monaco.osm.pbf",
        "SINK_MODE": "whole boundary", "TIME_LIMIT": 5, "BUILT_ON": "green",
        "TARGETS": "TOTAL_LENGTH <= 5000; VIOLATIONS = 0; MEAN_TIME <= 0.1",
        "report:OUTPUT": tmp_path / "page.html", "design:STREETS": tmp_path / "streets.gpkg",
        "parcels:PARCELS": tmp_path / "parcels.gpkg",
    }  # fmt: skip
    said = qgis_process(*arguments("placetoreport", **given), timeout=200)
    page = parsed((tmp_path / "page.html").read_text("utf-8"))
    words = " ".join(page.text.split())
    assert "One design for L'Anse du Portier" in words, said
    assert "2 of 3 targets are met" in words
    assert {own.text for own in page.all("h3")} >= {
        "Design streets", "Parcels in blocks", "Assign traffic",
    }  # fmt: skip
    assert "Open Database License" in words
    # what the tools on the way complain about is on the page
    assert "Problems found" in words
    assert "find no way" in words
    new = sum(f["length_m"] for f in designed(tmp_path / "streets.gpkg").getFeatures()
              if f["status"] == "new")  # fmt: skip
    assert f"{new:,.0f} m" in words
    lots = [r for r in binary.rows(tmp_path / "parcels.gpkg") if r["land_use"] == "parcel"]
    assert f"Parcels{len(lots)}" in words.replace(" ", "")


@pytest.mark.slow
@pytest.mark.parametrize(("rank", "hectares"), [(None, 6.6), (2, 0.43)])
def test_one_of_several_candidates_is_the_site(qgis_process, root, tmp_path, rank, hectares):
    given = {
        "PLACE": "Portier", "SOURCE_FILE": root / "data" / "osm" / "monaco.osm.pbf",
        "SINK_MODE": "whole boundary", "TIME_LIMIT": 2, "BLOCK_WIDTH": 50, "BLOCK_LENGTH": 60,
        "design:STREETS": tmp_path / "streets.gpkg", "site:SITE": tmp_path / "site.gpkg",
    }  # fmt: skip
    if rank is not None:
        given["RANK"] = rank
    qgis_process(*arguments("placetodesign", **given), timeout=200)
    (site,) = binary.rows(tmp_path / "site.gpkg")
    assert site["area_ha"] == pytest.approx(hectares, rel=0.02)


@pytest.mark.slow
def test_a_place_from_a_server(qgis_process, tmp_path):
    pytest.importorskip("requests")
    pytest.importorskip("osmium")
    from server import Server

    with Server() as server:
        urls = server.addresses()
        given = {
            "PLACE": PLACE, "PRESET": "dense grid", "BUILT_ON": "green", "TIME_LIMIT": 5,
            "design:STREETS": tmp_path / "streets.gpkg",
            "site:SITE_OBSTACLES": tmp_path / "obstacles.gpkg",
        }  # fmt: skip
        said = qgis_process(
            *arguments("placetodesign", **given),
            timeout=200,
            PLATWRIGHT_NOMINATIM_URL=urls["nominatim_url"],
            PLATWRIGHT_OVERPASS_URL=urls["overpass_url"],
            PLATWRIGHT_RATE_LIMIT="false",
            PLATWRIGHT_CACHE=str(tmp_path / "cache"),
        )
    assert designed(tmp_path / "streets.gpkg").featureCount() > 0, said
    assert "Preset 'dense grid' sets" in said


@pytest.mark.slow
def test_an_unknown_place_is_a_sentence(qgis_process, root, tmp_path):
    given = {
        "PLACE": "Nowhere at all", "SOURCE_FILE": root / "data" / "osm" / "monaco.osm.pbf",
        "design:STREETS": tmp_path / "streets.gpkg",
    }  # fmt: skip
    said = qgis_process(*arguments("placetodesign", **given))
    assert "Nowhere at all" in said
    assert not (tmp_path / "streets.gpkg").exists()


@pytest.mark.slow
def test_the_sample_and_a_table_of_two_designs(qgis_process, root, tmp_path):
    sample = root / "data" / "helsinki" / "helsinki_yard.gpkg"
    given = {
        "INPUT": f"{sample}|layername=site", "ROADS": f"{sample}|layername=streets",
        "OBSTACLES": f"{sample}|layername=obstacles", "SNAP_DISTANCE": 60,
        "BLOCK_WIDTH": 90, "TIME_LIMIT": 8, "design:STREETS": tmp_path / "wide.gpkg",
    }  # fmt: skip
    qgis_process(*arguments("parcelstodesign", **given), timeout=200)
    finished = root / "data" / "helsinki" / "helsinki_design.gpkg"
    compared = {
        "FIRST": tmp_path / "wide.gpkg", "SECOND": f"{finished}|layername=streets",
        "SITE": given["INPUT"], "ROADS": given["ROADS"], "OBSTACLES": given["OBSTACLES"],
        "SNAP_DISTANCE": 60, "compared:OUTPUT": tmp_path / "table.csv",
    }  # fmt: skip
    said = qgis_process(*arguments("comparedesigns", **compared))
    with (tmp_path / "table.csv").open(encoding="utf-8", newline="") as opened:
        wide, narrow = csv.DictReader(opened)
    assert (wide["design"], narrow["design"]) == ("wide", "streets"), said
    for row, path, table in ((wide, tmp_path / "wide.gpkg", "wide"), (narrow, finished, "streets")):
        with contextlib.closing(sqlite3.connect(path)) as file:
            rows = file.execute(f"select status, length_m from {table}").fetchall()  # noqa: S608
        length = sum(metres for status, metres in rows if status == "new")
        assert float(row["length_m"]) == pytest.approx(length, rel=1e-3)
    assert int(narrow["violations"]) == 0
