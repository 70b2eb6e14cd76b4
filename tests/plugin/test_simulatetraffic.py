"""Simulate traffic through real QGIS and the real simulator; the demand is made by hand."""

from __future__ import annotations

import json
import sys
import types

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

import geopandas as gpd  # noqa: E402
import numpy as np  # noqa: E402
import shapely  # noqa: E402
from platwright.errors import MissingDependencyError  # noqa: E402
from platwright.traffic.sumo import find_sumo  # noqa: E402
from qgis.core import NULL  # noqa: E402
from support import RefusedError, layer, line  # noqa: E402

#: A main street with a side street, and one that is not connected.
PROBLEM = ("layer", "feature", "problem", "action", "severity")
STREETS = [
    line((0, 0), (300, 0)), line((300, 0), (600, 0)), line((300, 0), (300, 200)),
    line((0, 500), (300, 500)),
]  # fmt: skip


@pytest.fixture
def sumo():
    """Skip, visibly, where SUMO is missing."""
    try:
        return find_sumo()
    except MissingDependencyError:
        pytest.skip("Eclipse SUMO absent: pip install eclipse-sumo")


@pytest.fixture
def given(package, monkeypatch):
    """Let the tool have a demand of one's own: trips per hour from end to end of the streets."""
    inputs = package("plugin.tools.trafficinputs")
    kinds = package("algorithms.traffic.types")

    def give(trips, asked=None):
        def read(request, progress):
            frame = request.frame("INPUT", progress)
            ends = shapely.get_coordinates(
                [g.geoms[0] if hasattr(g, "geoms") else g for g in frame.geometry]
            )
            nodes, at = np.unique(np.round(ends, 2), axis=0, return_inverse=True)
            pairs = at.reshape(-1, 2)
            size, count = len(frame), len(nodes)
            lines = np.empty(size, dtype=object)
            lines[:] = [shapely.LineString(nodes[pair]) for pair in pairs]
            network = kinds.TrafficNetwork(
                nodes=nodes, ends=pairs, lines=lines, feature=np.arange(size),
                direction=np.zeros(size, int), speed=np.full(size, 10.0),
                capacity=np.full(size, 800.0), lanes=np.ones(size, int),
                level=np.array([1, 1, 3, 3])[:size], existing=np.zeros(size, bool),
                crs=frame.crs,
            )  # fmt: skip
            places = kinds.Places(
                piece=np.zeros(count, int), along=np.zeros(count), node=np.arange(count),
                weight=np.zeros(count), name=np.array([""] * count, dtype=object),
            )  # fmt: skip
            matrix = np.zeros((count, count))
            for (one, other), number in trips.items():
                a, b = (pairs[feature][end] for feature, end in (one, other))
                matrix[a, b] = number
            demand = kinds.Demand(places, {kinds.BOUNDARY_BOUNDARY: matrix})
            return types.SimpleNamespace(
                streets=frame,
                network=network,
                demand=demand,
                asked=asked or {},
                problems=gpd.GeoDataFrame(columns=[*PROBLEM, "geometry"], crs=frame.crs),
                crs=request.crs("INPUT"),
            )

        monkeypatch.setattr(inputs, "read", read)

    return give


def streets(count=4, **more):
    return layer(
        STREETS[:count], kind="LineString", name="streets", fields="field=name:string(20)",
        values=[[f"street {k}"] for k in range(count)], **more,
    )  # fmt: skip


@pytest.mark.usefixtures("sumo")
def test_fields_layers_and_numbers(toolbox, given):
    given({((0, 0), (1, 1)): 200.0, ((2, 1), (0, 0)): 60.0, ((0, 0), (3, 0)): 12.0})
    run = toolbox.run("simulatetraffic", INPUT=streets(), SEED=3)
    rows = run.rows("STREETS")
    assert [row["name"] for row in rows] == [f"street {k}" for k in range(4)]
    flows = [row["flow_veh_h"] for row in rows]
    assert flows == pytest.approx([260.0, 200.0, 60.0, 0.0], rel=0.15)
    assert all(20.0 < row["travel_kmh"] <= 36.0 for row in rows[:3])
    assert rows[3]["travel_kmh"] == NULL
    # the side street gives way
    assert rows[2]["loss_s"] / 200.0 > rows[1]["loss_s"] / 300.0

    found = run.results
    assert found["TRIPS"] == pytest.approx(272 * 1.25, abs=1.0)
    assert found["NO_WAY"] == pytest.approx(15.0, abs=2.0)
    assert found["ARRIVED"] == found["TRIPS"] - found["NO_WAY"]
    assert found["RUNNING"] == found["NOT_ENTERED"] == found["NOWHERE"] == 0
    assert found["MEAN_DISTANCE"] == found["DISTANCE_THROUGH"]
    assert 500.0 < found["MEAN_DISTANCE"] < 600.0
    assert 50.0 < found["MEAN_TIME"] < 75.0
    assert 90.0 < found["MEAN_FINISHED"] < 100.0
    assert found["DISTANCE_WITHIN"] is None

    problems = run.rows("PROBLEMS")
    assert len(problems) == 1
    assert problems[0]["problem"] == f"Trips that begin here and find no way: {found['NO_WAY']:g}."
    assert problems[0]["layer"] == "streets"
    assert any("trips find no way" in text for text in run.said.warnings)


@pytest.mark.usefixtures("sumo")
def test_the_options_reach_the_simulator(toolbox, given):
    given({((0, 0), (1, 1)): 100.0})
    usual = {"INPUT": streets(), "HOURS": 0.5, "WARM_UP": 0.0}
    once = toolbox.run("simulatetraffic", ROUTES="fastest when empty", **usual)
    same = toolbox.run("simulatetraffic", ROUTES="fastest when empty", **usual)
    other = toolbox.run("simulatetraffic", ROUTES="fastest when empty", SEED=9, **usual)
    learned = toolbox.run("simulatetraffic", ITERATIONS=3, **usual)
    assert once.results["TRIPS"] == 50
    assert once.results["MEAN_TIME"] == same.results["MEAN_TIME"]
    assert once.results["MEAN_TIME"] != other.results["MEAN_TIME"]
    assert not any("each time it was driven" in text for text in once.said.infos)
    said = next(text for text in learned.said.infos if "each time it was driven" in text)
    assert said.count(",") == 2


@pytest.mark.usefixtures("sumo")
def test_what_was_asked_is_recorded(toolbox, given, package):
    given({((0, 0), (1, 1)): 50.0}, asked={"density": 250.0})
    run = toolbox.run("simulatetraffic", INPUT=streets(), HOURS=0.25, SEED=5)
    assert run.results["TRIPS"] == pytest.approx(25.0)
    assert len(run.rows("STREETS")) == 4
    record = package("plugin.record").read_record(run.layers["STREETS"])
    asked = json.loads(record["specification"])
    assert asked["density"] == 250.0
    assert (asked["hours"], asked["seed"], asked["routes"]) == (0.25, 5, "learned")
    tool = toolbox.tool("simulatetraffic")
    known = {one.name().lower() for one in tool.parameterDefinitions()}
    assert set(asked) <= known


def test_where_sumo_is_missing_it_says_before_the_run_what_to_do(toolbox, monkeypatch, tmp_path):
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    finder = "importlib.machinery.PathFinder.find_spec"
    monkeypatch.setattr(finder, lambda *_: None)
    with pytest.raises(RefusedError, match="Eclipse SUMO was not found") as error:
        toolbox.run("simulatetraffic", INPUT=streets())
    assert "--SUMO=true" in str(error.value)
    assert "sumo" not in sys.modules


@pytest.mark.usefixtures("sumo")
def test_an_error_calls_the_street_by_its_id(toolbox, given, package):
    inner = package("plugin.tools.simulatetraffic")
    errors = package("algorithms.errors")
    frame = gpd.GeoDataFrame(index=[11, 12, 13])
    told = inner._of_layer(errors.InputError("It is broken.", "Mend it.", feature=1), frame, "mine")
    assert str(told) == "Layer 'mine', feature 12: It is broken. Mend it."
    same = errors.InputError("No trips.")
    assert inner._of_layer(same, frame, "mine") is same
