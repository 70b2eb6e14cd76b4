"""The independent check that closes every design: asked as the planner asked, never costly."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import Listener, box, layer, line, point, roads, site  # noqa: E402


def new(run):
    return [s for s in run.rows("STREETS") if s["status"] == "new"]


@pytest.fixture
def asked_of_checker(package, monkeypatch):
    """What the independent checker is asked, as a dictionary that fills."""
    measure = package("algorithms.measure")
    asked, check = {}, measure.validate_network

    def listen(streets, **options):
        asked.update(options)
        return check(streets, **options)

    monkeypatch.setattr(measure, "validate_network", listen)
    return asked


def test_the_checker_is_told_the_planner_s_own_exits_and_wishes(toolbox, asked_of_checker):
    """Not the exits of the design: that a street leads to no given one must show."""
    toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        SINK_MODE="given points",
        SINKS=layer([point(150, 0), point(160, 200)], kind="Point"),
        REQUIRED=layer([line((75, 5), (75, 195))], kind="LineString"),
        FORBIDDEN=layer([line((20, 150), (90, 151))], kind="LineString"),
        TIME_LIMIT=3,
    )
    exits = [(p.x - 500000, p.y - 6700000) for p in asked_of_checker["sinks"].geometry]
    assert len(exits) == 2
    assert exits[0] == pytest.approx((150, 0), abs=5)
    assert exits[1] == pytest.approx((160, 200), abs=5)
    assert asked_of_checker["required"].length.sum() == pytest.approx(190)
    assert asked_of_checker["forbidden"].length.sum() == pytest.approx(70, abs=0.1)


@pytest.mark.parametrize(
    ("rules", "close", "zigzags"), [("planner", 0, 0), ("as in the paper", float("inf"), 5)]
)
def test_rules_left_to_the_set_are_checked_as_it_has_them(
    toolbox, asked_of_checker, rules, close, zigzags
):
    run = toolbox.run(
        "designstreets", INPUT=site(), ROADS=roads(), RULES=rules, BLOCK_WIDTH=100, TIME_LIMIT=3
    )
    assert asked_of_checker["too_close"] == close
    assert asked_of_checker["zigzags"] == zigzags
    assert (asked_of_checker["coverage_m"] is None) == (rules == "planner")
    assert run.results["VIOLATIONS"] == 0


@pytest.mark.parametrize(("rules", "weight"), [("planner", 1.0), ("as in the paper", float("inf"))])
def test_limits_of_the_whole_network_are_checked_as_they_were_asked(
    toolbox, asked_of_checker, rules, weight
):
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        RULES=rules,
        BLOCK_WIDTH=100,
        LEVELS=1,
        EXITS=4,
        LENGTH_BUDGET=1500,
        MAX_DISTANCE=400,
        JUNCTION_SPACING=30,
        TIME_LIMIT=3,
    )
    limits = {
        "exits_most": 4,
        "length_budget_m": 1500,
        "max_distance_m": 400,
        "junction_spacing_m": 30,
        "functions": weight,
    }
    assert {key: asked_of_checker[key] for key in limits} == limits
    assert run.results["VIOLATIONS"] == 0


def test_ranges_in_metres_and_by_area_reach_the_checker(toolbox, asked_of_checker):
    density = layer(
        [box(0, 0, 150, 200)], kind="Polygon", fields="field=coverage_m:double", values=[[50.0]]
    )
    run = toolbox.run(
        "designstreets",
        INPUT=site(),
        ROADS=roads(),
        RULES="as in the paper",
        BLOCK_WIDTH=100,
        COVERAGE=120,
        COVERAGE_UNIT="metres straight",
        DENSITY=density,
        TIME_LIMIT=3,
    )
    slack = asked_of_checker["coverage_slack_m"]
    assert 0 < slack < 150
    assert asked_of_checker["coverage_m"] == pytest.approx(120 + slack)
    areas = asked_of_checker["coverage_areas"]
    assert areas["coverage_m"].tolist() == [50.0]
    assert areas.area.tolist() == pytest.approx([30000], rel=0.01)
    assert run.results["VIOLATIONS"] == 0


def test_an_edge_without_roads_counts_as_street_for_the_checker_too(toolbox):
    run = toolbox.run(
        "designstreets",
        INPUT=layer([box(0, 0, 600, 500)]),
        RULES="as in the paper",
        BLOCK_WIDTH=150,
        TIME_LIMIT=3,
    )
    assert run.results["VIOLATIONS"] == 0


def test_a_check_that_is_cancelled_does_not_cost_the_design(toolbox):
    listener = Listener(cancel_at="Checking the streets")
    run = toolbox.run("designstreets", listener=listener, INPUT=site(), ROADS=roads(), TIME_LIMIT=3)
    assert new(run)
    assert run.results["VIOLATIONS"] is None
    assert any("not checked" in text for text in listener.warnings)
