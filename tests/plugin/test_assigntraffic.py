"""Assign traffic, counted by hand on small streets, through real QGIS."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import FailedError, RefusedError, box, layer, line, point  # noqa: E402

#: A street of 400 m through the middle of a site of 16 ha, and one beside it from end to end.
MIDDLE = line((0, 200), (400, 200))
ROUND = line((0, 200), (0, 300), (400, 300), (400, 200))


def streets(shapes=(MIDDLE,), fields="field=name:string(20)&field=speed_kmh:double", values=None):
    values = values or [[f"street {k}", 36.0] for k in range(len(shapes))]
    return layer(list(shapes), kind="LineString", name="streets", fields=fields, values=values)


def site():
    return layer([box(0, 0, 400, 400)], kind="Polygon", name="site")


def gates():
    return layer(
        [point(0, 200), point(400, 200)], kind="Point", name="gates",
        fields="field=name:string(20)", values=[["West"], ["East"]],
    )  # fmt: skip


def table(rows):
    """A table of flows."""
    fields = "field=from:string(10)&field=to:string(10)&field=vehicles_h:double"
    return layer([None] * len(rows), kind="NoGeometry", name="flows", fields=fields, values=rows)


def assign(toolbox, **given):
    return toolbox.run("assigntraffic", **{"INPUT": streets(), "SITE": site(), **given})


def test_fields_places_and_numbers(toolbox):
    run = assign(
        toolbox, DENSITY=250, SHARE_OUT=100, SHARE_IN=0, SHARE_WITHIN=0, PART_LENGTH=5,
        GATES=gates(),
    )  # fmt: skip
    (row,) = run.rows("STREETS")
    assert row["name"] == "street 0"
    assert row["length_m"] == pytest.approx(400)
    # 40 vehicles an hour, half to each end: 20 pass there, 10 on the mean.
    assert row["flow_veh_h"] == pytest.approx(10, rel=0.01)
    assert row["flow_ahead"] == pytest.approx(row["flow_back"], rel=0.02)
    assert row["through_veh_h"] == 0
    assert row["time_s"] == pytest.approx(40)
    assert row["free_kmh"] == pytest.approx(36)
    assert row["travel_kmh"] == pytest.approx(36)
    assert row["v_c"] == pytest.approx(20 / 500, rel=0.03)
    told = run.results
    assert told["VEHICLES"] == pytest.approx(40)
    assert told["DISTANCE_OUT"] == told["MEAN_DISTANCE"] == pytest.approx(100, rel=0.01)
    assert told["TIME_OUT"] == pytest.approx(10, rel=0.01)
    assert told["TOTAL_LENGTH"] == told["DESIGN_LENGTH"] == pytest.approx(400)
    assert told["GATES_FOUND"] == 2
    assert told["UNSERVED"] == 0
    assert told["DISTANCE_WITHIN"] is None
    assert told["ACHIEVED_GAP"] is None
    places = run.rows("PLACES")
    assert [p["name"] for p in places if p["kind"] == "gate"] == ["West", "East"]
    assert sum(p["from_veh_h"] for p in places) == pytest.approx(40)
    assert sum(p["to_veh_h"] for p in places) == pytest.approx(40)
    assert not run.rows("PROBLEMS")


def test_a_table_of_flows_and_the_equilibrium(toolbox):
    flows = table([["west", "east", 1500.0]])
    given = {"INPUT": streets((MIDDLE, ROUND)), "GATES": gates(), "FLOWS": flows, "DENSITY": 0}
    free = assign(toolbox, **given)
    assert [row["flow_veh_h"] for row in free.rows("STREETS")] == pytest.approx([1500, 0])
    full = assign(toolbox, METHOD="equilibrium", **given)
    rows = full.rows("STREETS")
    assert sum(row["flow_veh_h"] for row in rows) == pytest.approx(1500)
    assert rows[1]["flow_veh_h"] > 100
    assert rows[0]["time_s"] == pytest.approx(rows[1]["time_s"], rel=0.02)
    assert [row["through_veh_h"] for row in rows] == pytest.approx(
        [row["flow_veh_h"] for row in rows]
    )
    assert 0 <= full.results["ACHIEVED_GAP"] <= 1e-4
    assert any("Equilibrium after" in text for text in full.said.infos)


def test_flows_drawn_as_lines(toolbox):
    flows = layer(
        [line((390, 210), (10, 190))], kind="LineString", name="flows",
        fields="field=vehicles_h:integer", values=[[70]],
    )  # fmt: skip
    run = assign(toolbox, GATES=gates(), FLOWS=flows, DENSITY=0)
    assert run.rows("STREETS")[0]["flow_back"] == pytest.approx(70)


def test_without_site_and_gates_and_in_degrees(toolbox):
    shapes = [MIDDLE, ROUND, line((0, 200), (0, 0)), line((400, 200), (400, 0))]
    run = toolbox.run("assigntraffic", INPUT=streets(shapes))
    assert run.results["GATES_FOUND"] >= 2
    assert run.results["VEHICLES"] == pytest.approx(250 * 0.12)


def test_speeds_by_level(toolbox):
    made = streets(fields="field=level:integer&field=speed_kmh:double", values=[[1, 36.0]])
    own = assign(toolbox, INPUT=made).rows("STREETS")
    assert own[0]["free_kmh"] == pytest.approx(36)
    run = assign(toolbox, INPUT=made, SPEEDS="level", SPEED_MAJOR=72, CAPACITY_MAJOR=1000)
    assert run.rows("STREETS")[0]["free_kmh"] == pytest.approx(72)
    assert run.rows("STREETS")[0]["speed_kmh"] == pytest.approx(36)


def test_islands_are_told(toolbox):
    run = assign(toolbox, INPUT=streets((MIDDLE, line((100, 300), (300, 300)))))
    texts = [row["problem"] for row in run.rows("PROBLEMS")]
    assert any("not connected" in text for text in texts)
    assert any("find no way" in text for text in texts)
    assert run.results["UNSERVED"] > 0
    assert any("find no way" in text for text in run.said.warnings)


def test_bad_input_is_refused_in_words(toolbox):
    lonely = streets((line((100, 200), (300, 200)),))
    with pytest.raises((RefusedError, FailedError), match="No gate was found"):
        assign(toolbox, INPUT=lonely)
    flows = table([["west", "moon", 5.0]])
    with pytest.raises((RefusedError, FailedError), match="no gate or zone 'moon'"):
        assign(toolbox, GATES=gates(), FLOWS=flows)
    with pytest.raises((RefusedError, FailedError), match="All shares of trips are 0"):
        assign(toolbox, SHARE_OUT=0, SHARE_IN=0, SHARE_WITHIN=0)


def test_the_record_calls_what_was_asked_by_the_keys_of_the_inputs(toolbox, package, tmp_path):
    tool = toolbox.tool("assigntraffic")
    known = {one.name().lower() for one in tool.parameterDefinitions()}
    run = assign(toolbox, DENSITY=90, SPEED_LOCAL=20, STREETS=str(tmp_path / "loaded.gpkg"))
    record = package("plugin.record").read_record(run.layers["STREETS"])
    asked = json.loads(record["specification"])
    assert set(asked) <= known
    assert (asked["density"], asked["speed_local"]) == (90, 20)
