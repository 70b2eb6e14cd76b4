"""Field and candidates of the first split: as large as the site, ranked, on request only."""

from __future__ import annotations

import numpy as np
import pytest
from platwright.parcels.rules import ParcelRules
from platwright.parcels.split import Elements, SplitRules, first_splits, lay_out_sites
from platwright.site import Site
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, box

UTM = CRS.from_epsg(25832)
LAND = box(500000, 5200000, 500320, 5200210)
RULES, QUICK = ParcelRules(), SplitRules(tries=0)


def site(polygon, number=1):
    return Site(
        name="Test site", feature=7, polygon=polygon, crs=UTM, source_crs=UTM, site_id=number,
        street_frontage=MultiLineString([LineString(polygon.exterior)]),
    )  # fmt: skip


def test_the_best_candidate_leaves_whole_rows():
    done = lay_out_sites([site(LAND)], RULES, QUICK)
    found = first_splits(done, RULES, QUICK, UTM)
    crosses, lines = found["cross_field"], found["candidates"]
    assert crosses.geometry.within(LAND.buffer(15)).all()
    off = np.minimum(crosses["angle_deg"], 90 - crosses["angle_deg"])
    assert off.max() < 1
    assert lines["length_m"].to_numpy() == pytest.approx(lines.length.to_numpy(), rel=1e-3)
    good = lines[lines["rank"] > 0].sort_values("rank")
    assert good["rank"].tolist() == list(range(1, len(good) + 1))
    assert good["quality"].is_monotonic_increasing
    assert (good["reason"] == "").all()
    assert (lines.loc[lines["rank"] == 0, "reason"] != "").all()
    # one of the ends of the best is 60 + 7.5 m, two rows and half a street, from an edge
    best = good.geometry.iloc[0]
    x, y = np.array(best.coords).T
    steps = np.r_[x - 500000, 500320 - x, y - 5200000, 5200210 - y]
    assert np.abs(steps - 67.5).min() < 3


def test_several_sites_are_told_apart_in_any_crs_and_small_ones_are_left_out():
    small = box(500400, 5200000, 500430, 5200030)
    done = lay_out_sites([site(LAND), site(small, 2)], RULES, QUICK)
    found = first_splits(done, RULES, QUICK, CRS.from_epsg(4326))
    for layer in found.values():
        assert layer.crs.to_epsg() == 4326
        assert set(layer["site_id"]) == {1}
    none = first_splits(done[1:], RULES, QUICK, UTM)
    assert [len(layer) for layer in none.values()] == [0, 0]


def test_guide_lines_turn_the_crosses():
    guided = SplitRules(tries=0, field_kind="guided")
    guide = LineString([(500000, 5200000), (500320, 5200210)])

    def elements(_):
        return Elements(guides=[guide])

    done = lay_out_sites([site(LAND)], RULES, guided, elements=elements)
    found = first_splits(done, RULES, guided, UTM, elements=elements)["cross_field"]
    near = found[found.geometry.distance(guide) < 5]
    # the guide leads 56.7 degrees clockwise from north
    assert np.abs(near["angle_deg"].median() - np.degrees(np.arctan2(320, 210))) < 6
