"""Tables of building types: what is read, what stands in for what, what is refused."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.buildings.tables import TYPE_SETS, building_types, shipped_types
from platwright.errors import InputError
from shapely.geometry import Point


def table(**columns) -> pd.DataFrame:
    """Return a table of two plain types, with columns changed or added."""
    plain = {"length": [20, 30], "width": [12, 10], "height": [18, 9]}
    plain.update(columns)
    return pd.DataFrame({k: v for k, v in plain.items() if v is not None}, index=[7, 9])


def refused(frame: pd.DataFrame, layer: str = "my types") -> InputError:
    with pytest.raises(InputError) as caught:
        building_types(frame, layer)
    assert caught.value.layer == layer
    assert caught.value.remedy
    assert layer in str(caught.value)
    return caught.value


# --- what is read


def test_the_shipped_sets_are_those_of_the_paper():
    """RZ Table 4; a dimension is length, height, width, and a storey three metres."""
    homes = [(10.8, 18, 10.2), (16, 24, 13), (18.8, 18, 15.4), (20, 9, 18)]
    halls = [(30, 9, 30), (15, 6, 10)]
    towers = [(16.3, 60, 12.3), (13.9, 36, 13), (13.8, 60, 14.5)]
    for name, wanted, others in (
        ("multistorey", homes, halls), ("highrise", towers, [(15, 6, 10)])
    ):  # fmt: skip
        kinds = shipped_types(name)
        for use, sizes in (("residence", wanted), ("facility", others)):
            found = [k for k in kinds if k.use == use]
            assert [(k.length_m, k.height_m, k.width_m) for k in found] == sizes
            assert all(k.storeys == k.height_m / 3 for k in found)


@pytest.mark.parametrize("name", TYPE_SETS)
def test_every_shipped_set_is_sensible(name):
    kinds = shipped_types(name)
    homes = [k for k in kinds if k.use == "residence"]
    assert homes
    assert len(kinds) > len(homes), "a zone has facilities, too"
    for kind in kinds:
        assert 2.2 <= kind.height_m / kind.storeys <= 5
        assert kind.width_m <= kind.length_m + 1
    for kind in homes:
        assert 60 <= kind.floor_area_m2 / kind.dwellings <= 200


def test_the_sets_are_the_files_that_are_shipped(root):
    folder = root / "algorithms" / "buildings" / "tables"
    assert {path.stem for path in folder.glob("*.csv")} == set(TYPE_SETS)
    storeys = {name: [k.storeys for k in shipped_types(name) if k.use == "residence"]
               for name in TYPE_SETS}  # fmt: skip
    assert set(storeys["slabs"]) == {4, 5}
    assert set(storeys["terraced"]) == {2, 3}
    with pytest.raises(InputError, match="multistorey, highrise, slabs, terraced, mixed"):
        shipped_types("castles")


def test_height_and_storeys_stand_in_for_each_other():
    by_height = building_types(table(height=[18, 10]))
    assert [(k.height_m, k.storeys) for k in by_height] == [(18, 6), (10, 3)]
    by_storeys = building_types(table(height=None, storeys=[5, 1]))
    assert [(k.height_m, k.storeys) for k in by_storeys] == [(15, 5), (3, 1)]
    mixed = building_types(table(height=[None, 9.5], storeys=["4", np.nan]))
    assert [(k.height_m, k.storeys) for k in mixed] == [(12, 4), (9.5, 3)]
    both = building_types(table(height=[20, 2.5], storeys=[5, 1]))
    assert [(k.height_m, k.storeys) for k in both] == [(20, 5), (2.5, 1)]
    assert building_types(table(height=[2.0, 9]))[0].storeys == 1


def test_what_is_left_away_is_sensible():
    house, shop = building_types(table(use=["", "Public facility"]))
    assert (house.use, shop.use) == ("residence", "facility")
    assert (house.entrance, house.share, house.count, house.parking) == (
        "opposite",
        None,
        None,
        0.3,
    )
    # 20 x 12 x 6 storeys are 1440 m2 of floor; a facility has no dwellings.
    assert (house.dwellings, shop.dwellings) == (14, 0)
    assert house.name != shop.name
    hut = building_types(table(length=[5, 6], width=[4, 5], height=[3, 3]))[0]
    assert hut.dwellings == 1


@pytest.mark.parametrize(
    ("field", "spelling"),
    [
        ("length", "Length"), ("length", "LENGTH_M"), ("length", "Length (m)"),
        ("width", "Depth"), ("height", "height [m]"), ("height", "Floors"),
        ("height", "building:levels"), ("height", "Stories"),
    ],
)  # fmt: skip
def test_fields_go_by_many_names(field, spelling):
    frame = table().rename(columns={field: spelling})
    assert len(building_types(frame)) == 2


def test_every_field_is_read():
    frame = table(
        Name=["slab", "shop"], USE=["Residential", "facility"], Share=["60 %", None],
        count=[None, "2"], Entrance=["Same", " opposite "], Units=[24.0, None],
        parking_per_dwelling=["0,5", 2],
    )  # fmt: skip
    slab, shop = building_types(frame)
    assert (slab.name, slab.use, slab.share, slab.count) == ("slab", "residence", 0.6, None)
    assert (slab.entrance, slab.dwellings, slab.parking) == ("same", 24, 0.5)
    assert (shop.name, shop.count, shop.entrance, shop.parking) == ("shop", 2, "opposite", 2.0)


@pytest.mark.parametrize("text", ["20.5", "20,5", " 20.5 m", "20.5M", "2.05e1"])
def test_numbers_may_be_text(text):
    assert building_types(table(length=[text, "30"]))[0].length_m == 20.5


@given(st.lists(st.floats(0.02, 1), min_size=2, max_size=2))
def test_shares_and_percent_are_the_same(parts):
    total = sum(parts)
    shares = [part / total for part in parts]
    one = building_types(table(share=shares))
    hundred = building_types(table(share=[100 * share for share in shares]))
    assert [k.share for k in one] == pytest.approx(shares)
    assert [k.share for k in hundred] == pytest.approx(shares)


def test_shares_are_of_a_use():
    frame = table(share=[100, 100], use=["residence", "facility"])
    assert [k.share for k in building_types(frame)] == [1, 1]


def test_a_layer_with_geometry_will_do():
    frame = gpd.GeoDataFrame(table(), geometry=[Point(0, 0), None], crs=4326)
    assert len(building_types(frame)) == 2


# --- what is refused


@pytest.mark.parametrize(
    ("missing", "named"),
    [("length", "length"), ("width", "width"), ("height", "height or storeys")],
)
def test_a_missing_field_is_named_with_those_that_are_there(missing, named):
    error = refused(table(**{missing: None}))
    assert f"The field {named} is missing" in error.problem
    assert all(there in error.problem for there in {"length", "width", "height"} - {missing})


def test_all_missing_fields_are_named_at_once():
    error = refused(pd.DataFrame({"house": ["a"]}))
    assert "length and width and height or storeys are missing" in error.problem
    assert refused(table().iloc[:0]).problem == "The table has no row."


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"length": [20, 0]}, "The length is 0"),
        ({"width": [12, -3]}, "The width is -3"),
        ({"height": [18, "0"]}, "The height is 0"),
        ({"storeys": [6, 0]}, "number of storeys is 0"),
        ({"length": [20, None]}, "The length is missing"),
        ({"width": [12, "wide"]}, "The width is 'wide', which is no number"),
        ({"width": [12, "inf"]}, "which is no number"),
        ({"height": [18, None]}, "Both height and storeys are missing"),
        ({"height": [18, ""]}, "Both height and storeys are missing"),
        ({"storeys": [6, 2.5]}, "2.5, which is no whole number"),
        ({"storeys": [6, 30]}, "30 storeys in 9 m"),
        ({"length": [20, 30_000]}, "30000 m, more than 500 m"),
        ({"use": ["residence", "volcano"]}, "The use is 'volcano'"),
        ({"entrance": ["same", "roof"]}, "is 'roof'"),
        ({"count": [1, -1]}, "is -1"),
        ({"count": [1, 1.5]}, "no whole number"),
        ({"share": [0.5, -0.1]}, "is -0.1"),
        ({"share": [0.5, "half"]}, "'half', which is no number"),
        ({"dwellings": [1, -2]}, "is -2"),
        ({"parking": [1, -2]}, "is -2"),
        ({"name": ["slab", "slab"]}, "that of feature 7, too"),
    ],
)
def test_a_bad_cell_is_told_with_layer_and_feature(columns, words):
    error = refused(table(**columns))
    assert words in error.problem
    assert error.feature == 9
    assert "feature 9" in str(error)


def test_shares_beyond_the_whole_and_plans_without_homes():
    assert "add up to 120%" in refused(table(share=[0.6, 0.6])).problem
    assert "add up to 120%" in refused(table(share=[60, 60])).problem
    assert "No kind of building is a residence" in refused(table(use=["facility"] * 2)).problem
