"""Shares of land use, blocks and street figures: values by hand, and by networkx."""

from __future__ import annotations

import math

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.measure.landuse import measure_land_use
from platwright.measure.uses import USES, WORDS, plain_word, read_uses, use_field, use_of
from shapely import affinity
from shapely.geometry import LineString, box

CRS = 32633


def frame(shapes, **columns):
    """Return a layer, its origin where lengths in this CRS are true."""
    moved = [affinity.translate(shape, 500_000, 6_000_000) for shape in shapes]
    return gpd.GeoDataFrame(columns, geometry=moved, crs=CRS)


def grid(columns, rows, side=60.0, street=15.0):
    """Return blocks in a grid, and the centre lines between and around them."""
    step = side + street
    blocks = [
        box(i * step, j * step, i * step + side, j * step + side)
        for i in range(columns)
        for j in range(rows)
    ]
    half, wide, tall = street / 2, columns * step, rows * step
    lines = [
        LineString([(i * step - half, j * step - half), (i * step - half, (j + 1) * step - half)])
        for i in range(columns + 1)
        for j in range(rows)
    ] + [
        LineString([(i * step - half, j * step - half), ((i + 1) * step - half, j * step - half)])
        for i in range(columns)
        for j in range(rows + 1)
    ]
    return blocks, lines, box(-half, -half, wide - half, tall - half)


def test_a_grid_of_blocks_by_hand():
    blocks, lines, site = grid(4, 3)
    uses = ["park", "school", *["residential"] * 10]
    found = measure_land_use(
        frame(blocks, land_use=uses), streets=frame(lines), site=frame([site])
    ).figures
    km2 = 300 * 225 / 1e6
    assert found.ground_ha == pytest.approx(6.75)
    assert found.parcels_pct == pytest.approx(100 * 10 * 3600 / 67500)
    assert found.parks_pct == pytest.approx(100 * 3600 / 67500)
    assert found.other_pct == pytest.approx(100 * 3600 / 67500)
    assert found.streets_pct == pytest.approx(100 * (67500 - 12 * 3600) / 67500)
    assert (found.blocks, found.blocks_km2) == pytest.approx((12, 12 / km2))
    assert (found.block_max, found.block_mean, found.block_min) == pytest.approx((240, 240, 240))
    assert found.street_km_km2 == pytest.approx((5 * 225 + 4 * 300) / 1000 / km2)
    # all nodes but the four corners
    assert found.intersections == 5 * 4 - 4
    assert found.dead_ends == 0
    assert found.parcels_km2 == pytest.approx(10 / km2)


@given(st.integers(0, 10_000))
@settings(max_examples=30)
def test_intersections_and_dead_ends_are_those_of_networkx(seed):
    """Streets of a grid are taken away at random."""
    random = np.random.default_rng(seed)
    blocks, lines, site = grid(4, 4)
    kept = [line for line in lines if random.random() < 0.6] or lines[:1]
    graph = nx.Graph([tuple(tuple(np.round(p, 3)) for p in line.coords) for line in kept])
    inner = {node for node in graph if shapely.Point(node).distance(site.exterior) > 10}
    found = measure_land_use(frame(blocks), streets=frame(kept), site=frame([site])).figures
    assert found.intersections == sum(degree >= 3 for _, degree in graph.degree)
    assert found.dead_ends == sum(graph.degree[node] == 1 for node in inner)
    length = sum(line.length for line in kept)
    assert found.street_km_km2 == pytest.approx(length / 1000 / (site.area / 1e6))


def test_parcels_that_touch_are_one_block():
    lots = [box(18 * k, 30 * r, 18 * k + 18, 30 * r + 30) for k in range(10) for r in range(2)]
    # the survey leaves half a metre in the middle of the next block
    other = [box(0, 75, 90, 135), box(90.5, 75, 180, 135)]
    found = measure_land_use(frame([*lots, *other])).figures
    assert found.blocks == 2
    assert (found.block_max, found.block_min) == pytest.approx((480, 480))
    assert found.parcels == 22
    # the street of 15 m is filled: 180 x 135 m
    assert found.ground_ha == pytest.approx(2.43)
    assert found.streets_pct == pytest.approx(100 * (180 * 15 + 0.5 * 60) / 24300, rel=1e-3)
    assert math.isnan(found.street_km_km2)


def test_thin_and_small_pieces_are_no_blocks():
    land = [box(0, 0, 60, 60), box(100, 0, 109, 60), box(200, 0, 206, 6)]
    assert measure_land_use(frame(land)).figures.blocks == 1


def test_streets_go_round_a_block_not_through_its_court():
    ring = box(0, 0, 100, 100).difference(box(40, 40, 60, 60))
    assert measure_land_use(frame([ring])).figures.block_max == pytest.approx(400)


def test_ground_that_is_covered_twice_goes_to_the_first_of_its_uses():
    land = [box(0, 0, 100, 100), box(0, 0, 60, 100), box(0, 0, 20, 100)]
    report = measure_land_use(frame(land, use=["lot", "park", "road"]))
    found = report.figures
    assert (found.streets_pct, found.parks_pct, found.parcels_pct) == pytest.approx((20, 40, 40))
    assert "overlap on 8000 m2" in report.problems["problem"].iloc[0]


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_shares_add_up_and_no_use_is_lost(seed):
    random = np.random.default_rng(seed)
    corner = random.uniform(0, 300, (12, 2))
    size = random.uniform(10, 90, (12, 2))
    land = [box(x, y, x + w, y + h) for (x, y), (w, h) in zip(corner, size, strict=True)]
    uses = random.choice(["lot", "park", "school", "road"], 12).tolist()
    report = measure_land_use(frame(land, use=uses))
    table = report.table.set_index("land_use")
    shares = table["share_pct"]
    assert shares[list(USES)].sum() == pytest.approx(100)
    ground = report.figures.ground_ha * 1e4
    assert table.loc["all", "area_m2"] == pytest.approx(ground, rel=1e-6)
    park = shapely.union_all([s for s, use in zip(land, uses, strict=True) if use == "park"])
    road = shapely.union_all([s for s, use in zip(land, uses, strict=True) if use == "road"])
    assert table.loc["parks", "area_m2"] == pytest.approx(park.difference(road).area, abs=1e-3)


def test_given_blocks_count_as_they_are():
    found = measure_land_use(
        frame([box(0, 0, 100, 100)]), blocks=frame([box(0, 0, 50, 100), box(50, 0, 100, 100)])
    ).figures
    assert (found.blocks, found.block_mean) == pytest.approx((2, 300))


def test_layers_are_not_changed():
    land = frame([box(0, 0, 50, 50), box(0, 0, 80, 80)], use=["park", "lot"])
    before = land.copy()
    measure_land_use(land, site=frame([box(0, 0, 60, 60)]))
    assert land.equals(before)


# Words


def test_every_word_has_one_class():
    seen = {}
    for use in USES:
        for word in " ".join(WORDS[use].split()).split(", "):
            assert seen.setdefault(word, use) == use, word
            assert plain_word(word) == word
            assert use_of(word) == use
    assert len(seen) > 90


@pytest.mark.parametrize(
    ("word", "use"),
    [
        ("Parcels", "parcels"), ("single-family", "parcels"), ("GREEN", "parks"),
        ("streets", "streets"), ("rear_lane", "streets"), ("churches", "other"),
        ("Mixed  use", "other"), ("R-2", None), ("", None), (None, None), (math.nan, None),
        (7, None),
    ],
)  # fmt: skip
def test_words_as_they_are_written(word, use):
    assert use_of(plain_word(word)) == use


def test_a_field_counts_only_if_it_tells_uses():
    shapes = [box(0, 0, 1, 1), box(2, 0, 3, 1)]
    assert use_field(frame(shapes, label=["12/3", "12/4"], LANDUSE=["park", "x"])) == "LANDUSE"
    assert use_field(frame(shapes, use=["lot", None], land_use=["A1", "A2"])) == "use"
    assert use_field(frame(shapes, use=[1, 2])) == ""


def test_a_missing_field_is_named():
    with pytest.raises(InputError, match=r"'Zoning'.*'zone'"):
        read_uses(frame([box(0, 0, 1, 1)]), "zone", "Zoning")


def test_the_same_code_on_real_land(shared_data):
    file = shared_data / "parcels" / "cambridge_ma_cambridgeport_grid.gpkg"
    lots, lines = (gpd.read_file(file, layer=name) for name in ("parcels", "streets"))
    found = measure_land_use(lots, streets=lines).figures
    # the paper's real suburbs: 28-29 % streets, 42-78 intersections and 22-46 blocks per km2;
    # this is a denser grid of the 19th century
    assert 20 < found.streets_pct < 30
    assert 60 < found.blocks_km2 < 120
    assert 12 < found.street_km_km2 < 25
    assert found.parcels == len(lots)
