"""Many designs of one site through Processing: layers, table, plot and picture."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import QgsGeometry  # noqa: E402
from support import (  # noqa: E402
    ROADS,
    SITE,
    Listener,
    RefusedError,
    box,
    complaints_of,
    layer,
    point,
    roads,
    site,
)

#: Quick designs.
QUICK = {
    "RULES": "as in the paper", "LEVELS": 1, "EDGE_LENGTH": 50, "EFFORT": 5, "TIME_LIMIT": 20,
    "WORKERS": 1, "VALUES_X": "1", "VALUES_Y": "0; 0.5",
}  # fmt: skip
complaint = complaints_of("exploretradeoffs")


def explored(toolbox, **others):
    """Design a small site in two ways, or as said."""
    asked = {"INPUT": site(), "ROADS": roads(), **QUICK, **others}
    return toolbox.run("exploretradeoffs", **asked)


def shapes(run):
    """Return what was designed, without the time that it took."""
    rows = [(row["design"], row["geometry"].asWkt(6)) for row in run.rows("STREETS")]
    table = [
        {k: str(v) for k, v in row.items() if k not in ("geometry", "seconds", "fid")}
        for row in run.rows("DESIGNS")
    ]
    return sorted(rows), table


def test_designs_are_told_apart_and_compared(toolbox, tmp_path):
    places = {"PLOT": str(tmp_path / "plot.svg"), "PICTURE": str(tmp_path / "plans.png")}
    run = explored(toolbox, **places)
    table = run.rows("DESIGNS")
    assert [row["design"] for row in table] == [1, 2]
    assert [row["value_x"] for row in table] == ["0", "0.5"]
    assert {row["parameter_x"] for row in table} == {"weight of the way out"}
    assert {row["state"] for row in table} == {"done"}
    for row in table:
        own = [s for s in run.rows("STREETS") if s["design"] == row["design"]]
        new = sum(s["geometry"].length() for s in own if s["status"] == "new")
        assert new == pytest.approx(row["length_m"], rel=1e-3)
        assert {s["design_name"] for s in own} == {row["name"]}
        assert {s["pareto"] for s in own} == {row["pareto"]}
    assert run.results["REQUESTED"] == run.results["ACHIEVED"] == 2
    assert run.results["FRONT"] == sum(row["pareto"] for row in table) >= 1
    assert run.results["SHORTEST"] == pytest.approx(min(row["length_m"] for row in table))
    assert run.results["PLOT"] == places["PLOT"]
    assert Path(places["PLOT"]).read_text().lstrip().startswith("<?xml")
    assert Path(places["PICTURE"]).read_bytes().startswith(b"\x89PNG")


def test_processes_give_the_same_as_one_after_the_other(toolbox):
    assert shapes(explored(toolbox, WORKERS=2)) == shapes(explored(toolbox))


def test_the_layer_shows_one_design_at_a_time(toolbox, package):
    run = explored(toolbox)
    streets = run.layers["STREETS"]
    package("plugin.styles").apply(streets, package("plugin.explore_fields").EXPLORED_STREETS)
    rules = streets.renderer().rootRule().children()
    assert [rule.label() for rule in rules] == ["design 1", "design 2"]
    assert [rule.active() for rule in rules] == [True, False]


def test_a_list_of_runs_with_sets_of_exits(toolbox, tmp_path):
    path = tmp_path / "runs.csv"
    path.write_text("name,sinks,dead_ends\nsouth,s,\nnorth,n,allow\n")
    exits = layer(
        [point(150, 0), point(150, 200), point(60, 200)],
        kind="Point", fields="field=set:string", values=[["s"], ["n"], ["n"]], name="exits",
    )  # fmt: skip
    run = explored(toolbox, SPECIFICATIONS=str(path), SINKS=exits, PLOT=str(tmp_path / "page.html"))
    assert [row["name"] for row in run.rows("DESIGNS")] == ["south", "north"]
    page = (tmp_path / "page.html").read_text()
    assert re.findall(r"<td>(\w+)</td><td>(\w+)</td>", page)[:1]
    text = complaint(
        toolbox, INPUT=site(), ROADS=roads(), **QUICK, SPECIFICATIONS=str(path),
        SINKS=layer([point(150, 0)], kind="Point"),
    )  # fmt: skip
    assert "no layer of given exits has a field 'set'" in text


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"VALUES_Y": "much"}, "weight_distance is much"),
        ({"VALUES_Y": ""}, "no values are given"),
        ({"PARAMETER_Y": "weight of street length"}, "Both parameters are"),
        ({"PARAMETER_X": "block width", "VALUES_X": "400"}, "is less than block width"),
        ({"PARAMETER_X": "where streets leave", "VALUES_X": "points"}, "Given exits"),
        ({"SPECIFICATIONS": "/no/such.csv"}, "cannot be read"),
        ({"PLOT": "plot.gif"}, "Let its name end in svg, png, html"),
        ({"PICTURE": "plans.html"}, "Let its name end in png, svg"),
    ],
)
def test_what_cannot_be_is_refused_before_the_run(toolbox, tmp_path, asked, says):
    asked = {k: str(tmp_path / v) if k in ("PLOT", "PICTURE") else v for k, v in asked.items()}
    with pytest.raises(RefusedError, match=says):
        explored(toolbox, **asked)


def test_where_nothing_can_be_designed_the_first_reason_is_told(toolbox):
    text = complaint(toolbox, INPUT=site(), ROADS=roads(), **{**QUICK, "EDGE_LENGTH": 1.5})
    assert "None of the designs could be made. The first: " in text
    assert "streets are designed for up to" in text


def test_cancel_keeps_the_designs_that_are_ready(toolbox):
    run = explored(toolbox, listener=Listener(cancel_at="1 of 3 done"), VALUES_Y="0;0.5;1")
    assert [row["state"] for row in run.rows("DESIGNS")] == ["done", "cancelled", "cancelled"]
    assert {row["design"] for row in run.rows("STREETS")} == {1}


def test_a_cluster_that_does_not_answer_is_told(toolbox):
    pytest.importorskip("distributed", reason="the Python package distributed is not installed")
    text = complaint(toolbox, INPUT=site(), ROADS=roads(), **QUICK, CLUSTER="tcp://127.0.0.1:1")
    assert "No Dask scheduler answers" in text


def test_what_can_be_varied_is_known_to_the_library(toolbox, package):
    axes = package("plugin.tools.exploretradeoffs").AXES
    assert {key for key, _ in axes.values()} <= set(package("algorithms.explore").PARAMETERS)


PROGRAM = shutil.which("qgis_process.bin") or shutil.which("qgis_process")


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="qgis_process is not installed")
def test_through_the_program_on_a_real_site(plugin_folder, root, tmp_path):
    import os
    import sysconfig

    (tmp_path / "runtime").mkdir(mode=0o700)
    environment = {
        **{k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")},
        "QGIS_PLUGINPATH": str(plugin_folder), "QGIS_CUSTOM_CONFIG_PATH": str(tmp_path),
        "QT_QPA_PLATFORM": "offscreen", "XDG_RUNTIME_DIR": str(tmp_path / "runtime"),
        "PLATWRIGHT_DEPS": sysconfig.get_paths()["purelib"], "OMP_NUM_THREADS": "1",
    }  # fmt: skip
    ours = next(plugin_folder.iterdir())
    sample = root / "data" / "helsinki" / "helsinki_yard.gpkg"
    words = [
        "run", "platwright:exploretradeoffs", f"--INPUT={sample}|layername=site",
        f"--ROADS={sample}|layername=streets", "--VALUES_X=1", "--VALUES_Y=0;1", "--LEVELS=1",
        "--EFFORT=5", "--RULES=as in the paper", f"--STREETS={tmp_path / 'streets.gpkg'}",
        f"--DESIGNS={tmp_path / 'designs.gpkg'}", f"--PICTURE={tmp_path / 'plans.png'}",
    ]  # fmt: skip
    for command in (["plugins", "enable", ours.name], words):
        done = subprocess.run([PROGRAM, *command], env=environment, text=True,
                              capture_output=True, timeout=200, check=False)  # fmt: skip
    said = done.stdout + done.stderr
    assert "Traceback" not in said
    assert "ERROR" not in said, said[-2000:]
    assert re.search(r"ACHIEVED:\s+2", said), said[-2000:]
    assert (tmp_path / "plans.png").stat().st_size > 5000


def test_exits_may_have_dates(toolbox):
    exits = layer(
        [point(150, 0)], kind="Point", name="exits", fields="field=seen:date&field=at:datetime",
        values=[["2020-02-29", "2020-02-29T12:00:00"]],
    )  # fmt: skip
    run = explored(toolbox, SINK_MODE="given points", SINKS=exits)
    assert {row["state"] for row in run.rows("DESIGNS")} == {"done"}


def test_problems_name_each_broken_rule_of_each_design(toolbox):
    # a tongue too narrow for a street lies further from all streets than the rules allow
    tongue = QgsGeometry.fromWkt(SITE).combine(QgsGeometry.fromWkt(box(300, 90, 600, 102)))
    ways = layer([ROADS[0], ROADS[2], ROADS[3]], kind="LineString")
    run = explored(toolbox, INPUT=layer([tongue]), ROADS=ways)
    for row in run.rows("DESIGNS"):
        own = [told for told in run.rows("PROBLEMS") if told["design"] == row["design"]]
        broken = [told for told in own if told["severity"] == "error"]
        assert len(broken) == row["violations"] >= 1
        assert any("further than" in told["problem"] for told in broken)


def test_pictures_that_cannot_be_drawn_are_refused_before_the_run(toolbox, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    for asked in ({"PICTURE": str(tmp_path / "plans.png")}, {"PLOT": str(tmp_path / "plot.html")}):
        with pytest.raises(RefusedError, match="matplotlib"):
            explored(toolbox, **asked)
    assert explored(toolbox).results["ACHIEVED"] == 2
