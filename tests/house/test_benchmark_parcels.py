"""The benchmark of parcels: how regions are cut out, and that every row is measured alike."""

from __future__ import annotations

import importlib
import sys

import geopandas as gpd
import numpy as np
import pytest
from shapely.affinity import translate
from shapely.geometry import LineString, box

from house import ROOT

X, Y = 500_000.0, 6_700_000.0


@pytest.fixture(scope="module")
def scripts():
    """Import the benchmark and what cuts its regions out."""
    sys.path.insert(0, str(ROOT / "scripts"))
    yield [importlib.import_module(name) for name in ("_parcel_regions", "_benchmark_parcels")]
    sys.path.remove(str(ROOT / "scripts"))


def suburb():
    """Two blocks of 12 lots of 18 x 30 m, a school beside them, streets of 15 m around."""
    lots = [
        box(x + 18 * k, 30 * r, x + 18 * k + 18, 30 * r + 30)
        for x in (0, 123)
        for k in range(6)
        for r in range(2)
    ]
    lots.append(box(246, 0, 400, 60))
    xs, ys = (-7.5, 115.5, 238.5, 407.5), (-7.5, 67.5)
    lines = [LineString([(x, ys[0]), (x, ys[1])]) for x in xs]
    lines += [LineString([(a, y), (b, y)]) for y in ys for a, b in zip(xs, xs[1:], strict=False)]
    return [
        gpd.GeoDataFrame(geometry=[translate(s, X, Y) for s in shapes], crs=3067)
        for shapes in (lots, lines)
    ]


def test_a_region_is_the_blocks_of_housing(scripts):
    cut, _ = scripts
    lots, lines = suburb()
    region = cut.cut_out("Suburb", lots, lines)
    assert region.polygon.area == pytest.approx(246 * 75)
    assert len(region.parcels) == 24
    assert set(region.parcels["use"]) == {"parcel"}
    assert region.streets.length.sum() == pytest.approx(2 * 246 + 3 * 75, abs=4)
    assert region.median_size == pytest.approx((18, 30))
    without = cut.cut_out("Suburb", lots.iloc[:24], None)
    assert without.polygon.area == pytest.approx(231 * 60)
    assert not without.on_centre


def test_every_row_is_measured_by_the_same_code(scripts):
    cut, benchmark = scripts
    region = cut.cut_out("Suburb", *suburb())
    asked = benchmark.Asked(18, 30, 15)
    found = {
        name: benchmark.measure(method(region, asked), region, asked)
        for name, method in benchmark.methods_of(["Map", "Refill"]).items()
    }
    lots = 24 * 540
    for row in found.values():
        assert row["streets_pct"] == pytest.approx(100 * (1 - lots / (246 * 75)), abs=0.5)
        assert (row["blocks"], row["count"]) == (2, 24)
        assert row["p_angle"] == pytest.approx(0, abs=0.3)
        assert row["p_area"] == pytest.approx(1, abs=0.01)
        assert (row["undesirable"], row["access_pct"]) == (0, 100)
        assert all(name in row for _, name, _ in benchmark.COLUMNS)
    assert np.isnan(found["Map"]["seconds"])


def test_regions_that_are_not_there_are_told(scripts, tmp_path, capsys):
    cut, _ = scripts
    assert cut.regions(tmp_path, "West") == []
    assert "SKIPPED: West Cambridge" in capsys.readouterr().out
