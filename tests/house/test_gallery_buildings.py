"""The gallery of residential zones: pictures and figures are all there; how a plan is mixed."""

from __future__ import annotations

import importlib
import re

import geopandas as gpd
import pytest
from PIL import Image
from shapely.geometry import box

from house import ROOT

PAGE = ROOT / "docs" / "residential.md"
PICTURES = ROOT / "docs" / "images" / "buildings"


@pytest.fixture
def places(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module("_gallery_building_places")


def wanted(places):
    """Give the pictures that there should be."""
    names = {zone.key for zone in places.ZONES}
    names |= {f"{zone.key}_{end}" for zone in places.ZONES for end in zone.styles}
    names |= {f"{zone.key}_3d" for zone in places.ZONES if zone.shown}
    return {f"{name}.png" for name in names}


def test_every_picture_is_there_and_small_and_shown(places):
    shown = set(re.findall(r"images/buildings/([\w-]+\.png)", PAGE.read_text(encoding="utf-8")))
    assert shown == {path.name for path in PICTURES.iterdir()} == wanted(places)
    for path in PICTURES.iterdir():
        assert path.stat().st_size <= 250_000
        with Image.open(path) as picture:
            assert picture.mode == "P", path.name
            assert max(picture.size) <= 1260


def test_every_zone_has_its_figures_in_six_patterns(places):
    page = PAGE.read_text(encoding="utf-8")
    told = dict(re.findall(r"<!-- figures (\w+):[^>]*-->(.*?)<!-- end \1 -->", page, re.DOTALL))
    assert set(told) == {zone.key for zone in places.ZONES}
    assert len(places.TITLES) == 6
    for zone in places.ZONES:
        text = told[zone.key]
        assert f"types *{zone.types}*" in text
        rows = re.findall(r"^\| ([a-z, ]+) \| (\d\.\d\d) \|", text, re.MULTILINE)
        assert [name for name, _ in rows] == list(places.TITLES.values())
        assert all(float(far) > 0 for _, far in rows)


def test_two_zones_are_in_three_dimensions(places):
    assert sum(bool(zone.shown) for zone in places.ZONES) == 2


def test_a_mixed_plan_has_one_park_in_the_middle_and_every_pattern(places, tmp_path):
    script = importlib.import_module("_gallery_buildings")
    sizes = {k: (100.0 if k % 2 else 90.0) for k in range(7)}
    shapes = [box(100 * k, 0, 100 * k + size, 100) for k, size in sizes.items()]
    plan = gpd.GeoDataFrame(
        {"area_m2": [shape.area for shape in shapes], "residences": "rows", "facilities": "rows"},
        geometry=shapes,
        crs="EPSG:32632",
    )
    plan.to_file(tmp_path / "plan.gpkg", layer="patches")
    script.mix(tmp_path / "plan.gpkg", tmp_path / "mixed.gpkg")
    made = gpd.read_file(tmp_path / "mixed.gpkg", layer="patches")
    parks = made[made["residences"] == "empty"]
    assert len(made) == 7
    assert len(parks) == 1
    assert parks.geometry.iloc[0].contains(plan.union_all().centroid)
    assert list(parks["facilities"]) == ["empty"]
    assert set(made["residences"]) == {*places.MIX, "empty"}


def test_the_page_says_whose_the_data_is():
    page = PAGE.read_text(encoding="utf-8")
    assert "© OpenStreetMap contributors, ODbL 1.0" in page
    assert "City of Cambridge GIS, public domain" in page
