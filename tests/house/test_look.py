"""The benchmark of looks: how places are cut out, compared, skipped, and that it runs."""

from __future__ import annotations

import dataclasses
import importlib

import geopandas as gpd
import pytest
import shapely
from platwright.measure.pattern import PatternMetrics
from platwright.network.specification import Specification

from house import ROOT

CRS = 3067
ORIGIN = 386000, 6672000


@pytest.fixture
def look(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module("_benchmark_look")


@pytest.fixture
def places(look):
    return importlib.import_module("_look_places")


@pytest.fixture
def town():
    """Streets every 80 m from west to east and every 160 m from south to north; two main ones."""
    x, y = ORIGIN
    lines = [shapely.LineString([(x, y + 80 * k), (x + 640, y + 80 * k)]) for k in range(7)]
    lines += [shapely.LineString([(x + 160 * k, y), (x + 160 * k, y + 480)]) for k in range(5)]
    return gpd.GeoDataFrame(geometry=lines, crs=CRS)


def figures(**values) -> PatternMetrics:
    names = [field.name for field in dataclasses.fields(PatternMetrics)]
    return PatternMetrics(**{**dict.fromkeys(names, 1.0), **values})


def test_a_place_is_what_main_streets_enclose_or_the_blocks_around_a_point(places, town):
    x, y = ORIGIN
    main = town.iloc[[0, 4, 7, 10]]
    at = places.Where("Between", "", (x + 170, y + 170))
    whole = places.place_of(at, town, main)
    assert whole.site.area.sum() == pytest.approx(480 * 320)
    # 3 streets of 480 m, 2 of 320 m inside; the rest is around, up to 120 m
    assert whole.own.length.sum() == pytest.approx(3 * 480 + 2 * 320)
    assert not whole.around.union_all().crosses(whole.site.geometry.iloc[0])
    assert whole.around.total_bounds == pytest.approx([x, y, x + 600, y + 440])
    assert (whole.grain.width, whole.grain.length) == pytest.approx((80, 160))
    near = places.place_of(dataclasses.replace(at, at=(x + 320, y + 240), radius=100), town, main)
    # four blocks have their middle within 100 m
    assert near.site.area.sum() == pytest.approx(4 * 80 * 160)


def test_ours_is_as_good_where_it_is_not_worse(look):
    real, ours = figures(), figures(continued=0.9, thin=0.5, way_out=1.9, good=1.2)
    good = look.as_good(real, ours)
    assert set(good) == set(look.MEASURES)
    # less is better of thin blocks and ways out (a metre counts as none), more of the others
    assert [name for name, yes in good.items() if not yes] == ["continued"]
    rows = look.summary([(real, ours), (real, real)])
    row = next(r for r in rows if r.startswith("continued"))
    assert row.split() == ["continued", "1.00", "0.95", "more", "no", "1", "of", "2"]
    assert rows[-1].startswith(f"As good on {2 * len(good) - 1} of {2 * len(good)} measures")
    assert look.summary([]) == ["There is no place to compare."]


def test_what_has_no_data_is_named(look, capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("PLATWRIGHT_TEST_DATA", str(tmp_path))
    assert look.main(["--only", "Kluuvi"]) == 0
    said = capsys.readouterr().out
    assert f"SKIPPED: Kluuvi, whose streets are not in {tmp_path}" in said
    assert "SKIPPED: the empty sites" in said


@pytest.mark.slow
def test_a_place_is_designed_measured_and_drawn(look, places, town, tmp_path):
    x, y = ORIGIN
    where = places.Where("Test town", "", (x + 170, y + 170))
    place = places.place_of(where, town, town.iloc[[0, 4, 7, 10]])
    one = look.compare(place, Specification(time_limit=5))
    # the real pattern is what was asked for
    assert (one.real.width_off, one.real.length_off) == pytest.approx((0, 0), abs=1e-3)
    assert one.real.crossings == 1
    assert one.real.continued == 1
    assert one.ours.blocks >= 4
    assert one.ours.dead_ends_per_km == 0
    rows = look.rows_of(one)
    assert rows[0].startswith("Test town: 15.4 ha, blocks of 80 by 160 m")
    look.draw(one, tmp_path / "town.png")
    assert 2_000 < (tmp_path / "town.png").stat().st_size < 60_000
