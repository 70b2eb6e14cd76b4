"""The gallery of layouts: its pictures and tables are all there, its sites are cleared rightly."""

from __future__ import annotations

import importlib
import re
import subprocess

import geopandas as gpd
import pytest
import shapely
from PIL import Image

from house import ROOT

CRS = 26986
X, Y = 232000, 901000
PAGE = ROOT / "docs" / "parcels.md"
PICTURES = ROOT / "docs" / "images" / "parcels"


@pytest.fixture
def gallery(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module("_gallery")


@pytest.fixture
def places(gallery):
    return importlib.import_module("_gallery_places")


@pytest.fixture
def region(places):
    """Return two blocks of two parcels each, and the street between them."""
    boxes = [
        shapely.box(X + a, Y + 5, X + a + 90, Y + 95) for a in (5, 100, 205, 300)
    ]  # fmt: skip
    parcels = gpd.GeoDataFrame(
        {"use": ["parcel", "parcel", "parcel", "other"]}, geometry=boxes, crs=CRS
    )
    return importlib.import_module("_parcel_regions").Region(
        "Test town", shapely.box(X, Y, X + 400, Y + 100), parcels, None, on_centre=True
    )


def wanted(places):
    """Give the pictures that there should be."""
    names = set()
    for where in places.PLACES:
        ways = ["", "_templates"] if where.templates else [""]
        names |= {f"{where.key}{way}_{k}.png" for way in ways for k in (1, 2, 3)}
        if not where.file:
            names.add(f"{where.key}_map.png")
    return names


def test_every_picture_is_there_and_small_and_shown(places):
    page = PAGE.read_text(encoding="utf-8")
    shown = set(re.findall(r"images/parcels/([\w-]+\.png)", page))
    assert shown == {path.name for path in PICTURES.iterdir()} == wanted(places)
    sizes = [path.stat().st_size for path in PICTURES.iterdir()]
    assert max(sizes) <= 250_000
    assert sum(sizes) <= 3_000_000
    for path in PICTURES.iterdir():
        with Image.open(path) as picture:
            assert picture.mode == "P", path.name
            assert max(picture.size) <= 860


def test_every_site_has_its_figures_on_the_page(places):
    page = PAGE.read_text(encoding="utf-8")
    for where in places.PLACES:
        (table,) = re.findall(
            rf"<!-- figures {where.key}:[^>]*-->(.*?)<!-- end {where.key} -->", page, re.DOTALL
        )
        rows = re.findall(r"^\| [1-9].*\|$", table, re.MULTILINE)
        assert len(rows) == (6 if where.templates else 3), where.key
        assert ("| real" in table) == (not where.file)
        assert " ha. " in table


def test_the_page_says_whose_the_data_is():
    page = PAGE.read_text(encoding="utf-8")
    assert "© OpenStreetMap contributors, ODbL 1.0" in page
    assert "City of Cambridge GIS, public domain" in page


def test_a_table_is_put_between_its_marks_and_nowhere_else(gallery, tmp_path):
    page = tmp_path / "page.md"
    begin, end = "<!-- figures a: written by scripts/gallery -->", "<!-- end a -->"
    page.write_text(f"before\n{begin}\nold\n{end}\nafter \\1\n", encoding="utf-8")
    gallery.write(page, "a", ["| \\1 | new |"])
    assert page.read_text(encoding="utf-8") == (
        f"before\n{begin}\n\n| \\1 | new |\n\n{end}\nafter \\1\n"
    )
    with pytest.raises(ValueError, match="no place for the figures of b"):
        gallery.write(page, "b", [])


def test_a_suburb_loses_its_own_streets_and_keeps_those_around(places, region):
    lines = [
        shapely.LineString([(X, Y), (X + 400, Y)]),  # on the edge
        shapely.LineString([(X + 197, Y - 60), (X + 197, Y + 160)]),  # through it
        shapely.LineString([(X, Y + 500), (X + 400, Y + 500)]),  # far away
    ]
    where = places.Where("town", "Test town", "", "nobody")
    place = places.suburb(where, region, gpd.GeoDataFrame(geometry=lines, crs=CRS))
    assert place.site.area.sum() == pytest.approx(400 * 100)
    # of the one through it, what lies outside and up to 3 m inside at both ends
    assert place.roads.length.sum() == pytest.approx(400 + 63 + 63, abs=0.01)
    assert not place.roads.intersects(shapely.box(X + 10, Y + 10, X + 390, Y + 90)).any()
    assert len(place.parcels) == 4


def test_what_has_no_data_is_named(places, monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("PLATWRIGHT_TEST_DATA", str(tmp_path))
    found = [places.read(where) for where in places.PLACES]
    # the sample is in the repository
    assert [place is not None for place in found] == [True] + [False] * (len(found) - 1)
    said = capsys.readouterr().out
    assert said.count("SKIPPED: ") == len(found) - 1
    assert "PLATWRIGHT_TEST_DATA says where" in said


@pytest.mark.slow
@pytest.mark.qgis
def test_the_sample_is_laid_out_and_drawn(tmp_path):
    pytest.importorskip("qgis.core", reason="QGIS is not installed")
    command = [ROOT / "scripts" / "gallery", "helsinki", "--variations", "1", "--folder", tmp_path]
    page = PAGE.read_bytes()
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    # the page is left alone, the table is told
    assert PAGE.read_bytes() == page
    (row,) = re.findall(r"^\| 1 \| (\d+) \|", done.stdout, re.MULTILINE)
    parcels = gpd.read_file(tmp_path / "helsinki.gpkg", layer="parcels")
    assert int(row) == (parcels["land_use"] == "parcel").sum() > 100
    with Image.open(tmp_path / "helsinki_1.png") as picture:
        colours = {colour for _, colour in picture.convert("RGB").getcolors(1 << 20)}
    # parcels, local streets and greens, where there are any, as the styles have them, up to the
    # palette
    wanted = [(0xF3, 0xE3, 0xBF), (0xE5, 0x8A, 0x3A)]
    if (parcels.loc[parcels["land_use"] == "green", "area_m2"] > 500).any():
        wanted.append((0xB3, 0xD1, 0x95))
    for wanted_colour in wanted:
        near = min(max(abs(a - b) for a, b in zip(c, wanted_colour)) for c in colours)
        assert near <= 8, wanted_colour
