"""The benchmarks: what they compare, that they say what they skip, and that they run."""

from __future__ import annotations

import importlib.util
import math
import sys
from types import ModuleType

import geopandas as gpd
import pytest
import shapely

from house import ROOT


@pytest.fixture
def script(monkeypatch):
    """Return a function that loads a benchmark as a module."""

    def load(name: str) -> ModuleType:
        path = ROOT / "scripts" / f"_benchmark_{name}.py"
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, path.stem, module)
        spec.loader.exec_module(module)
        return module

    return load


def test_two_sets_of_rows_are_compared_by_what_is_better(script):
    #       s, bends, continued, width, good, thin, longest
    ours = [(2, 0, 0.9, 70, 0.8, 0.1, 140), (9, 0, 0.5, 60, 0.6, 0.0, 170)]
    theirs = [(4, 0, 0.8, 60, 0.8, 0.0, 120), (4, 1, 0.5, 76, 0.7, 0.2, 180)]
    found = script("sites").compared_columns(list(zip(ours, theirs, strict=True)), 72, 150)
    assert {name: (as_good, count) for name, _, _, as_good, count in found} == {
        "seconds": (False, 1),
        "bends": (True, 2),
        "share continued": (True, 2),
        "width off by": (True, 1),  # 2 and 12 m off, against 12 and 4
        "share good": (False, 1),
        "share thin": (True, 1),
        # 140 m is as good as 120 m where 150 m were asked, but the mean is not
        "longest": (False, 2),
    }
    means = {name: (mine, theirs) for name, mine, theirs, _, _ in found}
    assert means["width off by"] == (7, 8)
    assert means["longest"] == (155, 150)


def test_an_outcome_is_what_was_known_at_a_time(script):
    made = script("reference").Outcome(((0.5, 30.0), (3.0, 20.0)), 15.0, 9.0)
    assert [made.at(t) for t in (0.1, 0.5, 2.9, 3.0, 99)] == [math.inf, 30, 30, 20, 20]
    assert made.value == 20
    assert made.gap == pytest.approx(0.25)
    nothing = script("reference").Outcome((), 15.0, 9.0)
    assert nothing.gap == 1
    unproven = script("reference").Outcome(((0.5, 30.0),), -math.inf, 9.0)
    assert unproven.gap == 1


def test_sites_are_blown_up_to_a_square_kilometre(script):
    site = gpd.GeoDataFrame(geometry=[shapely.box(24.93, 60.17, 24.94, 60.18)], crs="EPSG:4326")
    road = gpd.GeoDataFrame(
        geometry=[shapely.LineString([(24.93, 60.17), (24.94, 60.18)])], crs="EPSG:4326"
    )
    large, roads = script("io").blown_up([site, road])
    assert large.area.sum() == pytest.approx(1e6)
    # the diagonal is still one
    ends = shapely.points(shapely.get_coordinates(roads.geometry.to_numpy()))
    assert shapely.distance(ends, large.union_all().boundary) == pytest.approx(0, abs=1e-6)


def test_input_and_output_are_timed_on_whatever_is_there(script, capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_TEST_DATA", str(tmp_path))
    (tmp_path / "sites").mkdir()
    for layer, shape in (
        ("site", shapely.box(25496000, 6673000, 25496300, 6673200)),
        ("streets", shapely.LineString([(25495900, 6672995), (25496400, 6672995)])),
    ):
        frame = gpd.GeoDataFrame(geometry=[shape], crs="EPSG:3879")
        frame.to_file(tmp_path / "sites" / "plain.gpkg", layer=layer, driver="GPKG")
    words = ["--runs", "1", "--only", "plain", "--limit"]
    assert script("io").main([*words, "600"]) == 0
    assert script("io").main([*words, "0.001"]) == 1
    said = capsys.readouterr().out
    assert f"SKIPPED: real sites, which are not in {tmp_path}" in said
    assert "over 600 s: none" in said
    assert "over 0.001 s: plain" in said
    row = next(line for line in said.splitlines() if line.startswith("| plain"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    read, prepare, mesh, layers, write, total, *_ = map(float, cells[1:9])
    assert total == pytest.approx(read + prepare + mesh + layers + write, abs=0.03)
    assert "100 ha, " in cells[-1]
    assert ", 2 features in, " in cells[-1]


@pytest.mark.slow
def test_both_models_are_given_the_same_problem(script, capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_TEST_DATA", str(tmp_path))
    rows = script("reference").main(["--seconds", "15", "--block-width", "110"])
    assert "SKIPPED: there are no real sites" in capsys.readouterr().out
    found = {name: outcome for _, name, outcome in rows}
    assert {"search", "fast model", "paper's model"} <= set(found)
    # however good a design is, no bound is above it: they are the same problem
    best = min(outcome.value for outcome in found.values())
    assert math.isfinite(best)
    for outcome in found.values():
        assert outcome.bound <= best + 1e-6
        values = [value for _, value in outcome.history]
        assert values == sorted(values, reverse=True)
