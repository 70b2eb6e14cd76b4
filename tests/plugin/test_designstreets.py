"""Design streets: every output filled, modes and wishes heard, cancel keeps the best."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import (  # noqa: E402
    ROADS,
    FailedError,
    Listener,
    RefusedError,
    box,
    layer,
    line,
    point,
    roads,
    site,
)


@pytest.fixture(scope="module")
def design(toolbox):
    return toolbox.run("designstreets", INPUT=site(), ROADS=roads(), TIME_LIMIT=3)


def new(run):
    return [s for s in run.rows("STREETS") if s["status"] == "new"]


def test_a_raw_site_and_raw_roads_will_do(design):
    streets = new(design)
    assert len(streets) >= 4
    assert {s["level"] for s in streets} <= {2, 3}
    total = sum(s["length_m"] for s in streets)
    assert design.results["TOTAL_LENGTH"] == pytest.approx(total, rel=0.001)
    for street in streets:
        assert street["geometry"].length() == pytest.approx(street["length_m"], rel=0.002)
        assert street["site_id"] == 1
        assert street["speed_kmh"] > 0


def test_the_distances_fit_the_numbers_and_the_direction(design):
    streets = new(design)
    far = max(max(s["dist_start_m"], s["dist_end_m"]) for s in streets)
    assert far <= design.results["MAX_DISTANCE"] + 0.5
    for s in streets:
        fall = s["dist_start_m"] - s["dist_end_m"]
        assert s["direction"] in (-1, 0, 1)
        if s["direction"]:
            assert fall * s["direction"] > -0.5


def test_existing_streets_come_along(design):
    names = {s["name"] for s in design.rows("STREETS") if s["status"] == "existing"}
    assert names & {"South Street", "East Street", "North Street", "West Street"}


def test_blocks_fill_the_site(design):
    blocks = design.rows("BLOCKS")
    assert len(blocks) >= 4
    assert sum(b["area_m2"] for b in blocks) == pytest.approx(60000, rel=0.15)
    for block in blocks:
        assert 0 < block["width_m"] <= block["length_m"]
        assert block["geometry"].area() == pytest.approx(block["area_m2"], rel=0.01)


def test_junctions_lie_on_the_streets(design):
    from qgis.core import QgsGeometry

    streets = QgsGeometry.unaryUnion([s["geometry"] for s in design.rows("STREETS")])
    junctions = design.rows("JUNCTIONS")
    assert any(j["is_sink"] for j in junctions)
    for junction in junctions:
        assert junction["geometry"].distance(streets) < 0.5
        assert junction["valence"] >= 1
        assert junction["kind"]


def test_all_numbers_are_given_and_no_rule_is_broken(design, toolbox):
    for key in toolbox.tool("designstreets").numbers:
        assert isinstance(design.results[key], (int, float)), key
    assert design.results["BOUND"] <= design.results["OBJECTIVE"] + 1e-6
    assert design.results["VIOLATIONS"] == 0, [
        p["problem"] for p in design.rows("PROBLEMS") if p["severity"] == "error"
    ]


def test_the_log_tells_the_search(design):
    lines = [text for text in design.said.infos if text.startswith("Best design")]
    assert lines
    assert "bound" in lines[-1]
    assert "gap" in lines[-1]
    assert not design.said.errors


def test_all_sites_of_a_layer_are_designed(toolbox):
    two = layer([box(0, 0, 300, 200), box(2000, 0, 260, 200)])
    run = toolbox.run("designstreets", INPUT=two, TIME_LIMIT=4)
    assert {s["site_id"] for s in new(run)} == {1, 2}
    assert {b["site_id"] for b in run.rows("BLOCKS")} == {1, 2}
    ids = [s["street_id"] for s in run.rows("STREETS")]
    assert len(set(ids)) == len(ids)


def test_sites_that_were_prepared_work_as_well(toolbox):
    ready = toolbox.run("preparesite", INPUT=site(), ROADS=roads()).layers
    run = toolbox.run(
        "designstreets",
        INPUT=ready["SITE"],
        ROADS=ready["BOUNDARY_STREETS"],
        ACCESS_POINTS=ready["ACCESS_POINTS"],
        TIME_LIMIT=3,
    )
    assert len(new(run)) >= 4


def test_streets_keep_off_obstacles_and_forbidden_places(toolbox):
    from qgis.core import QgsGeometry

    pond, line_of_trees = box(110, 60, 80, 80), line((20, 150), (90, 150))
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        OBSTACLES=layer([pond]),
        FORBIDDEN=layer([line_of_trees], kind="LineString"),
        TIME_LIMIT=3,
    )
    ground = QgsGeometry.fromWkt(pond)
    trees = QgsGeometry.fromWkt(line_of_trees)
    for street in new(run):
        assert street["geometry"].intersection(ground).length() < 2
        assert not street["geometry"].crosses(trees)


def test_a_required_street_is_there(toolbox):
    from qgis.core import QgsGeometry

    wish = line((75, 5), (75, 195))
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        REQUIRED=layer([wish], kind="LineString"),
        TIME_LIMIT=3,
    )
    streets = QgsGeometry.unaryUnion([s["geometry"] for s in new(run)])
    along = streets.buffer(40, 8).intersection(QgsGeometry.fromWkt(wish)).length()
    assert along > 170


def test_given_exits_are_the_only_ones(toolbox):
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        SINK_MODE="given points",
        SINKS=layer([point(150, 0)], kind="Point"),
        TIME_LIMIT=3,
    )
    sinks = [j["geometry"].asPoint() for j in run.rows("JUNCTIONS") if j["is_sink"]]
    assert sinks
    for sink in sinks:
        assert abs(sink.x() - 500150) < 45
        assert abs(sink.y() - 6700000) < 45


@pytest.mark.parametrize("mode", ["whole boundary", "access points"])
def test_other_ways_out(toolbox, mode):
    run = toolbox.run("designstreets", INPUT=site(), ROADS=roads(), SINK_MODE=mode, TIME_LIMIT=3)
    assert len(new(run)) >= 3
    assert run.results["VIOLATIONS"] == 0


@pytest.mark.parametrize(
    ("wish", "shapes", "kind"),
    [
        ("SINKS", [point(150, 0), point(150, 900)], "Point"),
        ("REQUIRED", [line((75, 5), (75, 195)), line((75, 900), (75, 999))], "LineString"),
    ],
)
def test_a_wish_that_cannot_be_is_named_by_layer_and_feature(toolbox, wish, shapes, kind):
    wishes = layer(shapes, kind=kind, name="my wishes")
    feature = sorted(f.id() for f in wishes.getFeatures())[1]
    mode = {"SINK_MODE": "given points"} if wish == "SINKS" else {}
    with pytest.raises(FailedError, match=f"'my wishes', feature {feature}"):
        toolbox.run(
            "designstreets", INPUT=site(), ROADS=roads(), TIME_LIMIT=2, **mode, **{wish: wishes}
        )


def test_roads_inside_that_are_left_out_are_told(toolbox):
    inner = layer([*ROADS, line((100, -8), (100, 208))], kind="LineString")
    run = toolbox.run("designstreets", INPUT=site(), ROADS=inner, TIME_LIMIT=2)
    (told,) = [text for text in run.said.infos if "inside the site" in text]
    assert 190 < float(told.split(" over ")[1].split(" m ")[0]) <= 200
    run = toolbox.run("designstreets", INPUT=site(), ROADS=roads(), TIME_LIMIT=2)
    assert not [text for text in run.said.infos if "inside the site" in text]


@pytest.mark.parametrize("sink", [0, "0", 0.0])
def test_choices_may_be_given_by_number(toolbox, package, sink):
    """As the help of qgis_process asks for them."""
    tool = toolbox.tool("designstreets")
    given = {"SINK_MODE": sink, "RULES": "1", "SOLVER": "HiGHS", "TIME_LIMIT": 1}
    words = package("plugin.request").with_words(given, tool.parameterDefinitions())
    assert words == {
        "SINK_MODE": "existing streets",
        "RULES": "as in the paper",
        "SOLVER": "HiGHS",
        "TIME_LIMIT": 1,
    }
    run = toolbox.run(
        "designstreets", INPUT=site(), ROADS=roads(), SINK_MODE=sink, LEVELS=1, TIME_LIMIT=2
    )
    assert new(run)
    with pytest.raises(RefusedError, match=r"SINK_MODE|Where streets may leave"):
        toolbox.run("designstreets", INPUT=site(), SINK_MODE=9, TIME_LIMIT=2)


def test_the_paper_s_rules_can_be_had(toolbox):
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        RULES="as in the paper",
        LEVELS=1,
        BLOCK_WIDTH=100,
        TIME_LIMIT=3,
    )
    assert new(run)


def test_the_rules_reach_the_library(toolbox, package, monkeypatch):
    """What every parameter becomes in the specification."""
    from qgis.core import QgsProcessingContext

    request = package("plugin.request").Request(
        toolbox.tool("designstreets"),
        {
            "BLOCK_WIDTH": 60,
            "BLOCK_LENGTH": 120,
            "EDGE_LENGTH": 30,
            "COVERAGE": 90,
            "COVERAGE_UNIT": "metres",
            "WEIGHT_LENGTH": 2,
            "WEIGHT_DISTANCE": 0.5,
            "WEIGHT_STRAIGHT": 3,
            "WEIGHT_CONTINUE": 4,
            "DEAD_ENDS": "allow",
            "ZIGZAGS": "forbid",
            "TOO_CLOSE": "discourage",
            "T_JUNCTIONS": "discourage",
            "BRANCHES": "forbid",
            "SINK_MODE": "whole boundary",
            "RULES": "as in the paper",
            "LEVELS": 1,
            "TIME_LIMIT": 7,
            "GAP": 0.05,
            "SEED": 9,
            "SOLVER": "HiGHS",
            "CUL_DE_SACS": True,
            "TRAFFIC": "through the site",
            "PATCH_SIZE": 300,
            "DETOUR": 1,
            "EXITS": 3,
            "LENGTH_BUDGET": 5000,
            "MAX_DISTANCE": 400,
            "JUNCTION_SPACING": 50,
            "ONE_WAY": "local streets",
            "SLOPE_WEIGHT": 2,
        },
        QgsProcessingContext(),
    )
    made = json.loads(package("plugin.tools.designstreets").specification_of(request).to_json())
    assert made == {
        "block_width": 60,
        "block_length": 120,
        "edge_length": 30,
        "coverage": 90,
        "coverage_unit": "metres",
        "weight_length": 2,
        "weight_distance": 0.5,
        "weight_straight": 3,
        "weight_continue": 4,
        "dead_ends": 0,
        "zigzags": "forbid",
        "too_close": 6,
        "t_junctions": 1,
        "branches": "forbid",
        "sink_mode": "boundary",
        "rules": "paper",
        "levels": 1,
        "time_limit": 7,
        "gap": 0.05,
        "seed": 9,
        "solver": "highs",
        "cul_de_sacs": True,
        "cul_de_sac_length": 150,
        "turning_radius": 9,
        "level_settings": {},
        "traffic": "through",
        "patch_size": 300,
        "detour": 1,
        "links": None,
        "exits": 3,
        "length_budget": 5000,
        "max_distance": 400,
        "junction_spacing": 50,
        "one_way": "local",
        "slope_weight": 2,
        "effort": None,
    }


def test_defaults_are_those_of_the_library(toolbox, package):
    from qgis.core import QgsProcessingContext

    request = package("plugin.request").Request(
        toolbox.tool("designstreets"), {}, QgsProcessingContext()
    )
    specification = package("algorithms.network.specification").Specification
    assert package("plugin.tools.designstreets").specification_of(request) == specification()


def test_outputs_that_nobody_wants_are_not_made(toolbox):
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        TIME_LIMIT=2,
        JUNCTIONS=None,
        BLOCKS=None,
        PROBLEMS=None,
    )
    assert set(run.layers) == {"STREETS"}


def test_files_carry_style_and_record(toolbox, package, tmp_path: Path):
    from qgis.core import QgsVectorLayer

    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        TIME_LIMIT=2,
        STREETS=f"ogr:dbname='{tmp_path / 'plan.gpkg'}' table=\"streets\" (geom)",
        BLOCKS=str(tmp_path / "blocks.shp"),
        JUNCTIONS=f"ogr:dbname='{tmp_path / 'plan.gpkg'}' table=\"junctions\" (geom)",
    )
    other = QgsVectorLayer(f"{tmp_path / 'plan.gpkg'}|layername=junctions", "j", "ogr")
    again = QgsVectorLayer(f"{tmp_path / 'plan.gpkg'}|layername=streets", "s", "ogr")
    assert again.renderer().type() == "categorizedSymbol"
    record = package("plugin.record").read_record(again)
    assert json.loads(record["specification"])["block_width"] == 72
    assert json.loads(record["result"])["TOTAL_LENGTH"] == pytest.approx(
        run.results["TOTAL_LENGTH"]
    )
    blocks = QgsVectorLayer(str(tmp_path / "blocks.shp"), "b", "ogr")
    assert blocks.renderer().type() == "graduatedSymbol"
    assert other.renderer().type() == "categorizedSymbol"
    assert package("plugin.record").read_record(blocks)["tool"] == "platwright:designstreets"
    assert other.featureCount() == run.layers["JUNCTIONS"].featureCount() > 0


def test_cancel_keeps_the_best_design_and_names_its_gap(toolbox):
    listener = Listener(cancel_at="Best design")
    run = toolbox.run(
        "designstreets",
        listener=listener,
        INPUT=layer([box(0, 0, 900, 700)]),
        TIME_LIMIT=60,
        LEVELS=1,
    )
    assert new(run)
    (warning,) = [text for text in listener.warnings if "Cancelled" in text]
    assert "gap" in warning
    assert "%" in warning


@pytest.mark.parametrize("stage", ["Reading", "Preparing", "mesh"])
def test_cancel_before_there_is_a_design_writes_nothing(toolbox, stage, tmp_path: Path):
    listener = Listener(cancel_at=stage)
    path = tmp_path / "streets.gpkg"
    run = toolbox.run(
        "designstreets", listener=listener, INPUT=site(), ROADS=roads(), STREETS=str(path)
    )
    assert run.results == {}
    assert not path.exists()
    assert any("nothing" in text or "no layer" in text for text in listener.warnings)
