"""The study of promised and simulated traffic: its tables, its pictures, and one scenario of it."""

from __future__ import annotations

import importlib
import json
import re

import geopandas as gpd
import pytest
from PIL import Image
from platwright.errors import MissingDependencyError
from platwright.traffic.sumo import find_sumo

from house import ROOT

PAGE = ROOT / "docs" / "traffic.md"
FILES = sorted((ROOT / "figures" / "traffic").glob("*.json"))


@pytest.fixture
def scripts(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module("_correlation"), importlib.import_module("_correlation_study")


@pytest.fixture
def found(scripts):
    """Rows of which the ways within fall where the ways out rise, and the ground as it is."""
    _, study = scripts

    def kind(metres):
        return study.Kind(metres, metres / 10, metres - 5, metres / 8, 100, 1.0)

    empty = gpd.GeoDataFrame(geometry=[])
    rows = [study.Row("b", "today", 0.0, float("nan"), 9.0, {"within": kind(600.0)}, empty, empty)]
    for at, name in enumerate("cde"):
        kinds = {"out": kind(100.0 + 10 * at), "within": kind(500.0 - 50 * at)}
        rows.append(
            study.Row(name, f"says {name}", 1000.0 * at, 90.0 + at, 9.0, kinds, empty, empty)
        )
    return rows


def test_ranks_and_correlations(scripts, found):
    main, _ = scripts
    rows = [line for line in main.table(found) if re.match(r"\| [b-h]:", line)]
    assert [line[2] for line in rows] == ["c", "d", "e", "b"]
    cells = [part.strip() for part in rows[2].split("|")]
    assert cells[6] == "3 / 3"
    assert cells[9] == "1 / 1"
    (text,) = main.words(found)
    assert "ranks agree by 1.00 (Spearman)" in text
    assert "Best for trips within is e: the next, d, has 13% longer ways" in text
    assert "the streets that are there 51%" in text
    up, down = [1.0, 2.0, 4.0], [9.0, 5.0, 4.0]
    assert main.agreement(up, down).spearman == pytest.approx(-1.0)
    assert -1.0 < main.agreement(up, down).pearson < -0.8


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_site_is_on_the_page_with_its_pictures(path):
    asked = json.loads(path.read_text(encoding="utf-8"))
    page = PAGE.read_text(encoding="utf-8")
    (table,) = re.findall(
        rf"<!-- figures {path.stem}:[^>]*-->(.*?)<!-- end {path.stem} -->", page, re.DOTALL
    )
    names = re.findall(r"^\| ([a-h]): ", table, re.MULTILINE)
    assert names == [*(own["name"] for own in asked["scenarios"]), "b"]
    for kind in ("plans", "plot"):
        picture = PAGE.parent / "images" / "traffic" / f"correlation_{path.stem}_{kind}.png"
        with Image.open(picture) as opened:
            assert opened.width > 800


@pytest.mark.slow
def test_one_scenario_from_the_design_to_the_simulator(scripts):
    """The ground as it is and the network for trips within, for two hours."""
    try:
        # importing the package would set PROJ_LIB for all tests after this one
        find_sumo()
    except MissingDependencyError:
        pytest.skip("Eclipse SUMO absent: pip install eclipse-sumo")
    _, study = scripts
    try:
        asked = study.read(ROOT / "figures" / "traffic" / "locust_point.json")
    except FileNotFoundError:
        pytest.skip("the shared data folder is not here")
    asked["scenarios"] = [own for own in asked["scenarios"] if own["name"] == "h"]
    today, made = study.rows(asked, hours=2.0)
    assert not today.has_exits
    assert made.has_exits
    for row in (today, made):
        for kind in row.kinds.values():
            assert kind.arrived > 0.99
            assert kind.driven_metres == pytest.approx(kind.metres, rel=0.25)
            assert kind.driven_seconds > kind.seconds
    assert made.kinds["within"].driven_metres < 0.6 * today.kinds["within"].driven_metres
    assert made.streets["flow_veh_h"].max() > 0
