"""Layers of laid out zones, and the indices that are told of them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import shapely
from platwright.buildings.layers import COLUMNS, indices, layout_layers, zone_layers
from platwright.buildings.layers.built import rule_text
from platwright.buildings.rules import SunRule
from platwright.errors import InputError
from pyproj import CRS

from .hand_made import ORIGIN, RULES, SIZE, TYPES, UTM, finding, make_layout, make_zone

LAYOUT = make_layout()
#: Slabs, towers and shops of the plan, counted on a drawing.
SLABS, TOWERS, SHOPS = 28, 8, 2
AREA = SIZE[0] * SIZE[1]


@pytest.fixture(scope="module")
def layers():
    return layout_layers(LAYOUT, RULES)


def test_layers_have_their_fields_in_order(layers):
    assert list(layers) == list(COLUMNS)
    for name, frame in layers.items():
        assert [c for c in frame.columns if c != "geometry"] == list(COLUMNS[name])
        assert frame.crs == UTM
        assert frame.geometry.is_valid.all()


def test_measures_are_those_of_the_geometries(layers):
    for name, field in (
        ("zone", "area_m2"), ("buildings", "footprint_m2"), ("shadows", "area_m2"),
        ("parking", "area_m2"), ("green", "area_m2"), ("patches", "area_m2"),
    ):  # fmt: skip
        frame = layers[name]
        assert frame[field].to_numpy() == pytest.approx(frame.geometry.area.to_numpy())
    for name in ("paths", "corridors"):
        frame = layers[name]
        assert frame["length_m"].to_numpy() == pytest.approx(frame.geometry.length.to_numpy())
    built = layers["buildings"]
    floors = built["footprint_m2"] * built["storeys"]
    assert built["floor_area_m2"].to_numpy() == pytest.approx(floors.to_numpy())


def test_buildings_tell_their_type_and_their_group(layers):
    built = layers["buildings"]
    assert built["type"].value_counts().to_dict() == {
        "slab": SLABS, "tower": TOWERS, "shop": SHOPS,
    }  # fmt: skip
    assert set(built.loc[built["type"] == "shop", "use"]) == {"facility"}
    for _, own in built.groupby("group"):
        assert shapely.union_all(own.geometry.buffer(0.01).to_numpy()).geom_type == "Polygon"
    groups = built.dissolve("group").geometry
    apart = shapely.distance(groups.to_numpy()[:, None], groups.to_numpy()[None])
    assert (apart + 99 * np.eye(len(groups))).min() > 0.5


def test_buildings_lie_in_the_patch_that_they_name(layers):
    patches = layers["patches"].set_index("patch_id").geometry
    for _, row in layers["buildings"].iterrows():
        assert patches[row["patch_id"]].contains(row.geometry)


def test_patches_count_what_stands_in_them(layers):
    built = layers["buildings"]
    for _, row in layers["patches"].iterrows():
        inside = built[built.within(row.geometry)]
        assert row["buildings"] == len(inside)
        assert row["far"] == pytest.approx(inside["floor_area_m2"].sum() / row.geometry.area)
        assert row["density"] == pytest.approx(inside.area.sum() / row.geometry.area)
        assert (row["residences"], row["facilities"], row["paths"]) == ("rows", "empty", "direct")


@pytest.mark.parametrize("code", [32633, 4326, 3857, 31468])
def test_a_symbol_turned_by_the_rotation_has_its_balconies_where_they_are(code):
    source = CRS.from_epsg(code)
    layout = make_layout(source=source)
    # any direction will do here
    turned = dataclasses.replace(
        layout.placements, facing=np.linspace(0.0, 350.0, len(layout.placements))
    )
    frame = layout_layers(dataclasses.replace(layout, placements=turned), RULES)["buildings"]
    assert frame.crs == source
    if code == 4326:
        # degrees of longitude are shorter: the map is drawn with north above in metres
        frame = frame.to_crs(frame.estimate_utm_crs())
    for _, row in frame.iterrows():
        ring = np.array(row.geometry.exterior.coords)
        out = (ring[0] + ring[1]) / 2 - ring[:4].mean(axis=0)
        angle = math.radians(row["rotation"])
        # below on the symbol, turned clockwise
        symbol = np.array([-math.sin(angle), -math.cos(angle)])
        cosine = out @ symbol / np.hypot(*out)
        assert cosine > math.cos(math.radians(0.5 if code == 4326 else 0.01))


def test_azimuths_are_true(layers):
    frame = layers["buildings"]
    # grid north of the zone looks 0.4 degrees west of true north
    assert frame["facing_deg"].to_numpy() == pytest.approx(179.6)
    assert frame["rotation"].to_numpy() == pytest.approx(0.0)


def test_indices_are_those_worked_out_by_hand(layers):
    found = indices(layers, RULES)
    homes = SLABS * 288 + TOWERS * 256
    assert found["zone_ha"] == pytest.approx(7.04)
    floor = SLABS * 288 * 6 + TOWERS * 256 * 11 + SHOPS * 420 * 2
    assert found["far_reached"] == pytest.approx(floor / AREA)
    assert found["density_reached"] == pytest.approx((homes + SHOPS * 420) / AREA)
    assert found["residence_share"] == pytest.approx(100 * homes / AREA)
    assert found["facility_share"] == pytest.approx(100 * SHOPS * 420 / AREA)
    dwellings = SLABS * 24 + TOWERS * 44
    assert found["dwellings"] == dwellings
    assert found["dwellings_ha"] == pytest.approx(dwellings / 7.04)
    assert found["building_count"] == SLABS + TOWERS + SHOPS
    # half a place for each dwelling, one for each 100 m2 of the shops
    assert found["parking_asked"] == pytest.approx(dwellings / 2 + SHOPS * 8.4)
    assert (found["far_asked"], found["density_asked"], found["green_asked"]) == (1.1, 0.28, 0.35)


def test_indices_are_those_recomputed_from_the_layers(layers):
    found = indices(layers, RULES)
    area = layers["zone"].geometry.area.sum()
    assert found["green_reached"] == pytest.approx(layers["green"].geometry.area.sum() / area)
    assert found["parking_share"] == pytest.approx(100 * layers["parking"]["area_m2"].sum() / area)
    places = layers["parking"]["places"].sum()
    assert found["parking_places"] == places
    assert found["parking_per_dwelling"] == pytest.approx(places / found["dwellings"])
    homes = layers["buildings"].query("use == 'residence'")
    assert found["mean_sun"] == pytest.approx(homes["sun_hours"].mean())
    assert found["least_sun"] == pytest.approx(homes["sun_hours"].min())
    assert found["shaded"] == homes["shaded"].sum() == 0
    assert found["mean_way"] == pytest.approx(layers["buildings"]["way_m"].mean())
    # streets and paths by throwing points
    rng = np.random.default_rng(3)
    xy = rng.uniform(ORIGIN, np.add(ORIGIN, SIZE), (40_000, 2))
    points = shapely.points(xy)
    off = shapely.distance(points, shapely.union_all(layers["buildings"].geometry.to_numpy())) > 0
    for name, half, key in (("corridors", 6.0, "street_share"), ("paths", 1.5, "path_share")):
        near = shapely.distance(points, shapely.union_all(layers[name].geometry.to_numpy())) < half
        assert found[key] == pytest.approx(100 * (near & off).mean(), abs=0.5)


@pytest.mark.parametrize("code", [4326, 3857])
def test_indices_do_not_depend_on_the_crs_of_the_layers(code, layers):
    here = indices(layers, RULES)
    there = indices(layout_layers(make_layout(source=CRS.from_epsg(code)), RULES), RULES)
    assert there.keys() == here.keys()
    for key, value in here.items():
        assert there[key] == pytest.approx(value, rel=1e-5), key


def test_numbers_go_through_all_zones():
    two = make_layout(site_id=2)
    layers = zone_layers([LAYOUT, two], RULES)
    count = len(LAYOUT.placements)
    built = layers["buildings"]
    assert built["building_id"].tolist() == list(range(1, 2 * count + 1))
    assert built["site_id"].tolist() == [1] * count + [2] * count
    assert set(built.loc[: count - 1, "group"]).isdisjoint(built.loc[count:, "group"])
    assert set(built.loc[count:, "patch_id"]) == {3, 4}
    assert set(layers["paths"].loc[lambda f: f["site_id"] == 2, "patch_id"]) == {3, 4}
    assert layers["shadows"]["building_id"].tolist() == built["building_id"].tolist()
    for name, number in (
        ("paths", "path_id"), ("corridors", "corridor_id"), ("parking", "parking_id"),
        ("green", "green_id"), ("trees", "tree_id"), ("patches", "patch_id"),
    ):  # fmt: skip
        assert layers[name][number].tolist() == list(range(1, len(layers[name]) + 1))
    assert len(layers["zone"]) == 2
    # both zones are in the same place, so their ground counts once but their floors twice
    assert indices(layers, RULES)["far_reached"] == pytest.approx(
        2 * indices(layout_layers(LAYOUT, RULES), RULES)["far_reached"]
    )


def test_what_could_not_be_done_is_told_with_its_place():
    told = finding(make_zone())
    frame = layout_layers(make_layout(findings=(told,)), RULES)["problems"]
    row = frame.iloc[0]
    assert (row["layer"], row["feature"]) == ("Zones", "1")
    assert (row["problem"], row["action"]) == ("A corner is steep.", "Look at it.")
    assert row["severity"] == "warning"
    assert row.geometry.equals(told.place)


def test_a_building_that_is_not_reached_has_no_way():
    reached = np.ones(len(LAYOUT.placements), dtype=bool)
    reached[5] = False
    paths = dataclasses.replace(LAYOUT.paths, reached=reached)
    layers = layout_layers(dataclasses.replace(LAYOUT, paths=paths), RULES)
    row = layers["buildings"].iloc[5]
    assert not row["reached"]
    assert math.isnan(row["way_m"])
    assert row["turns"] is None or math.isnan(row["turns"])
    others = layers["buildings"]["way_m"].drop(5).mean()
    assert indices(layers, RULES)["mean_way"] == pytest.approx(others)


def test_a_residence_behind_a_high_one_is_told_to_be_shaded():
    rules = dataclasses.replace(RULES, sun=SunRule(coefficient=3.0))
    frame = layout_layers(LAYOUT, rules)["buildings"]
    # rows are 42 m apart and slabs 18 m high: three times their height reach the next row
    assert frame.loc[frame["type"] == "slab", "shaded"].any()
    assert not frame.loc[frame["use"] == "facility", "shaded"].any()
    assert indices(layout_layers(LAYOUT, rules), rules)["shaded"] == frame["shaded"].sum()


def test_an_empty_plan_has_empty_layers():
    none = np.zeros(0, dtype=np.int64)
    layout = dataclasses.replace(
        LAYOUT,
        placements=LAYOUT.placements.take(none), group=none, sun_hours=np.zeros(0), shadows=(),
        paths=dataclasses.replace(
            LAYOUT.paths, paths=(), reached=none.astype(bool), length_m=np.zeros(0),
            turns=np.zeros(0), roomy=np.zeros(0), exits=np.zeros(0),
        ),
        details=dataclasses.replace(
            LAYOUT.details, green=(), trees=np.zeros((0, 2)), tree_of=(), parking=(), places=(),
        ),
    )  # fmt: skip
    layers = layout_layers(layout, RULES)
    assert len(layers["buildings"]) == 0
    assert layers["trees"].crs == UTM
    found = indices(layers, RULES)
    assert found["far_reached"] == 0.0
    assert math.isnan(found["mean_sun"])
    assert math.isnan(found["parking_per_dwelling"])


def test_there_must_be_a_zone():
    with pytest.raises(InputError, match="no zone"):
        zone_layers([], RULES)


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        (SunRule(coefficient=1.0), "1 x height behind the building"),
        (
            SunRule(hours=1.5, month=12, day=21, start=8.5, end=15.0),
            "1.5 h of sun between 8:30 and 15:00 on 21 December",
        ),
    ],
)
def test_the_rule_of_shadows_is_told(rule, text):
    assert rule_text(rule) == text
    assert len(TYPES) == 3
