"""The gallery of floor plans and game levels: pictures, figures, and what it does without data."""

from __future__ import annotations

import importlib
import json
import re

import geopandas as gpd
import pytest
from PIL import Image

from house import ROOT

PAGES = {
    "designfloor": (ROOT / "docs" / "floors.md", "floors"),
    "designgamelevel": (ROOT / "docs" / "levels.md", "levels"),
}
PICTURES = ROOT / "docs" / "images" / "rooms"


@pytest.fixture
def places(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module("_gallery_rooms_places")


@pytest.fixture
def script(places):
    return importlib.import_module("_gallery_rooms")


def test_every_picture_is_there_and_small_and_shown(places):
    wanted = {f"{room.key}.png" for room in places.ROOMS}
    text = "".join(page.read_text(encoding="utf-8") for page, _ in PAGES.values())
    shown = set(re.findall(r"images/rooms/([\w-]+\.png)", text))
    assert shown == {path.name for path in PICTURES.iterdir()} == wanted
    for path in PICTURES.iterdir():
        assert path.stat().st_size <= 250_000
        with Image.open(path) as picture:
            assert picture.mode == "P", path.name
            assert max(picture.size) <= 1600


@pytest.mark.parametrize("tool", sorted(PAGES))
def test_every_plan_has_its_figures(places, script, tool):
    page, key = PAGES[tool]
    text = page.read_text(encoding="utf-8")
    (told,) = re.findall(rf"<!-- figures {key}:[^>]*-->(.*?)<!-- end {key} -->", text, re.DOTALL)
    head, _, *rows = told.strip().splitlines()
    assert head == script.HEADS[tool][0]
    assert [row.split("|")[1].strip() for row in rows] == [
        room.name for room in places.ROOMS if room.tool == tool
    ]
    for row in rows:
        assert row.count("|") == head.count("|")
        objective, bound = map(float, re.findall(r"\| (\d+) \((\d+)\) \|", row)[0])
        gap = float(re.findall(r"\| (\d+) % \| [\d.]+ \| \d+ \|$", row)[0])
        assert 0 < bound <= objective
        # both are rounded, and so is the gap
        assert abs(gap - 100 * (1 - bound / objective)) < 1 + 150 / objective


def test_what_the_issue_asks_for_is_there(places):
    asked = {room.key: room.asked for room in places.ROOMS}
    assert asked["office"]["STOREYS"] == 4
    levels = [own["LEVEL_TYPE"] for own in asked.values() if "LEVEL_TYPE" in own]
    assert sorted(levels) == ["branching", "circular", "linear"]


def test_a_building_that_is_not_there_is_told(places, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PLATWRIGHT_TEST_DATA", str(tmp_path))
    assert places.hospital() is None
    assert places.novotel() is None
    assert "town/monaco.gpkg" in capsys.readouterr().out
    assert places.office() is not None


def test_what_a_tool_is_given_is_written_storey_by_storey(places, tmp_path):
    given = places.office().write(tmp_path / "given.gpkg", "office")
    assert set(given) == {"INPUT", "SINKS", "OBSTACLES", "CORRIDORS_GIVEN", "TEMPLATE_FILE"}
    exits = gpd.read_file(tmp_path / "given.gpkg", layer="exits")
    assert sorted(exits["floor"].isna()) == [False, True, True]
    shapes = json.loads((tmp_path / "given.json").read_text(encoding="utf-8"))["templates"]
    shares = {own["name"]: own.get("min_share") for own in shapes}
    assert shares["office"] == 0.3


def test_rows_of_other_plans_stay(places, script, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("| cave, linear | 1 |\n| castle, branching | 2 |\n", encoding="utf-8")
    new = {"cave, linear": "| cave, linear | 9 |"}
    lines = script.table(page, "designgamelevel", new)
    assert lines[2:] == ["| castle, branching | 2 |", "| cave, linear | 9 |"]


def test_the_first_plan_is_that_of_the_slowest_storey(script):
    best = "Best design 5.0, bound 1.0, gap 80.0 %, after {} s"
    said = ["Storey 0", best.format(0.4), best.format(9.0), "Storey 1", best.format(2.5)]
    assert script.first_plan(said) == 2.5
