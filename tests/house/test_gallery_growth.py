"""The gallery of growth: pictures and figures are all there, and what it marks are faults."""

from __future__ import annotations

import importlib
import re
import subprocess

import geopandas as gpd
import pytest
import shapely
from PIL import Image

from house import ROOT

PAGE = ROOT / "docs" / "growth.md"
PICTURES = ROOT / "docs" / "images" / "growth"
#: Pictures of more than one map, or of a part of one.
OTHERS = ("grammars", "published", "planar", "played")


@pytest.fixture
def places(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module("_gallery_growth_places")


@pytest.fixture
def measures(places):
    return importlib.import_module("_gallery_growth_measures")


def wanted(places):
    """Give the pictures that there should be."""
    names = {*places.GRAMMARS, *(site.key for site in places.SITES), *OTHERS}
    return {f"{name}.png" for name in names} | {
        f"{places.SHOWN}_{what}.png" for what in ("natural", "betweenness")
    }


def test_every_picture_is_there_and_small_and_shown(places):
    pages = PAGE.read_text(encoding="utf-8") + (ROOT / "docs" / "grammars.md").read_text("utf-8")
    shown = set(re.findall(r"images/growth/([\w-]+\.png)", pages))
    assert shown == {path.name for path in PICTURES.iterdir()} == wanted(places)
    sizes = [path.stat().st_size for path in PICTURES.iterdir()]
    assert max(sizes) <= 250_000
    assert sum(sizes) <= 1_500_000
    for path in PICTURES.iterdir():
        with Image.open(path) as picture:
            assert picture.mode == "P", path.name
            assert max(picture.size) <= 1260


def test_everything_has_its_figures_on_the_page(places):
    page = PAGE.read_text(encoding="utf-8")
    told = dict(re.findall(r"<!-- figures (\w+):[^>]*-->(.*?)<!-- end \1 -->", page, re.DOTALL))
    keys = {site.key for site in places.SITES}
    assert set(told) == keys | {"grammars", "pair", "played", "measured", "published"}
    for site in places.SITES:
        text = told[site.key]
        assert f"*{site.words()}:* " in text
        assert re.search(r"\d+ streets, \d+\.\d km, \d+ blocks, .* dead ends?; \d+\.\d s\.", text)
    for name in places.GRAMMARS:
        assert f"| {name} |" in told["grammars"]
    for row in (*(town.name for town in places.TOWNS), *places.MEASURED):
        assert row in told["measured"]
    assert re.search(r"\| planar \|.*\| 0 \|", told["pair"])
    assert re.search(r"\| as published \|.*\| [1-9]\d* \|", told["pair"])
    days = [int(day) for day in re.findall(r"day (\d+)", told["played"])]
    assert days == sorted(set(days))
    assert len(days) == len(places.FRAMES)


def test_the_page_says_whose_the_data_is():
    page = PAGE.read_text(encoding="utf-8")
    assert "© OpenStreetMap contributors, ODbL 1.0" in page
    assert "City of Cambridge GIS, public domain" in page


@pytest.mark.parametrize(
    ("lines", "places_of_faults"),
    [
        # meets at ends: none
        ([[(0, 0), (100, 0)], [(100, 0), (200, 0)], [(100, 0), (100, 90)]], []),
        # crosses
        ([[(0, 0), (100, 0)], [(50, -40), (50, 40)]], [(50, 0)]),
        # touches
        ([[(0, 0), (100, 0)], [(50, 0), (50, 40)]], [(50, 0)]),
        # covers a part
        ([[(0, 0), (100, 0)], [(100, 0), (40, 0)]], [(70, 0), (40, 0)]),
    ],
)
def test_what_is_no_junction_is_marked(measures, lines, places_of_faults):
    frame = gpd.GeoDataFrame(geometry=[shapely.LineString(line) for line in lines], crs=32632)
    found = measures.faults(frame)
    assert {(point.x, point.y) for point in found.geometry} <= {
        (x, y) for x, y in places_of_faults
    } | {(x, 0) for x in range(40, 101)}
    assert bool(len(found)) == bool(places_of_faults)
    if len(places_of_faults) == 1:
        ((x, y),) = places_of_faults
        assert [(point.x, point.y) for point in found.geometry] == [(x, y)]


@pytest.mark.slow
@pytest.mark.qgis
def test_the_sample_and_the_grammars_are_grown_and_drawn(tmp_path):
    pytest.importorskip("qgis.core", reason="QGIS is not installed")
    parts = ["growth", "helsinki", "grammars", "--folder", tmp_path]
    page = PAGE.read_bytes()
    done = subprocess.run(
        [str(part) for part in (ROOT / "scripts" / "gallery", *parts)],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    # the page is left alone, the figures are told
    assert PAGE.read_bytes() == page
    (count,) = re.findall(r":\* (\d+) streets", done.stdout)
    streets = gpd.read_file(tmp_path / "helsinki.gpkg", layer="streets")
    assert int(count) == (streets["iteration"] > 0).sum() > 20
    with Image.open(tmp_path / "organic.png") as picture:
        colours = {colour for _, colour in picture.convert("RGB").getcolors(1 << 20)}
    # main, large and small, as the style has them, up to the palette
    for shade in ((0x8E, 0x2B, 0x1D), (0xC8, 0x44, 0x2C), (0xE5, 0x8A, 0x3A)):
        assert min(max(abs(a - b) for a, b in zip(c, shade)) for c in colours) <= 8, shade
