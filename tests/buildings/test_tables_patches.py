"""Fields of patches: patterns, paths, and where the balconies look."""

from __future__ import annotations

import geopandas as gpd
import pytest
from platwright.buildings.tables import PatchChoice, patch_choices
from platwright.buildings.types import BUILDING_PATTERNS, PATH_PATTERNS
from platwright.errors import InputError
from shapely.geometry import box


def patches(**columns) -> gpd.GeoDataFrame:
    """Return patches with the ids 11, 12... and some fields."""
    count = max((len(values) for values in columns.values()), default=2)
    squares = [box(10 * k, 0, 10 * k + 10, 10) for k in range(count)]
    return gpd.GeoDataFrame(columns, geometry=squares, index=range(11, 11 + count), crs=32633)


def test_without_fields_the_defaults_hold():
    usual = PatchChoice(residences=3, facilities=0, paths=1, path_direction=0, facing_deg=90.0)
    assert patch_choices(patches(), "Patches", usual) == [usual, usual]
    assert patch_choices(patches(), "Patches") == [PatchChoice()] * 2
    empty = patches(
        pattern=[None, ""], paths=[float("nan"), "NULL"], facing=["", None], direction=[None, ""]
    )
    assert patch_choices(empty, "Patches", usual) == [usual, usual]


@pytest.mark.parametrize(
    "field", ["residences", "Pattern", "BUILDING_PATTERN", "residence pattern"]
)
def test_patterns_are_numbers_or_words(field):
    numbers = patch_choices(patches(**{field: list(range(6))}), "Patches")
    assert [choice.residences for choice in numbers] == list(range(6))
    words = patch_choices(patches(**{field: [w.title() for w in BUILDING_PATTERNS]}), "Patches")
    assert [choice.residences for choice in words] == list(range(6))
    texts = patch_choices(patches(**{field: ["0", "1.0", " 5 ", "determinant", "none"]}), "Patches")
    assert [choice.residences for choice in texts] == [0, 1, 5, 1, 0]


def test_paths_directions_and_facilities():
    frame = patches(
        facilities=["dotted", 0.0, None], paths=["circle", 2, "Ending"],
        path_direction=["outside", 1, "opposite"],
    )  # fmt: skip
    found = patch_choices(frame, "Patches")
    assert [choice.facilities for choice in found] == [5, 0, 1]
    assert [choice.paths for choice in found] == [1, 2, 3]
    assert [choice.path_direction for choice in found] == [0, 1, 0]


def test_the_three_numbers_of_the_paper():
    """RZ Table 4, demo 2: residences 1/3/0 1/2/0 2/2/1 2/2/1, facilities 1/2/0."""
    frame = patches(residences=["1/3/0", "1/2/0", "2/2/1", "0/0/0"], facilities=["1/2/0"] * 4)
    found = patch_choices(frame, "Patches", PatchChoice(facilities=4))
    assert [(c.residences, c.paths, c.path_direction) for c in found] == [
        (1, 3, 0), (1, 2, 0), (2, 2, 1), (0, 2, 0),
    ]  # fmt: skip
    assert {c.facilities for c in found} == {1}
    # A field of its own says more than the three numbers.
    own = patch_choices(patches(residences=["5/1/0"], paths=["ending"], direction=[1]), "Patches")
    assert (own[0].residences, own[0].paths, own[0].path_direction) == (5, 3, 1)


def test_facing_is_an_azimuth_or_a_word():
    frame = patches(facing=["south", "NE", "North-West", 200, "359,5°", -90, 360])
    found = [choice.facing_deg for choice in patch_choices(frame, "Patches")]
    assert found == [180.0, 45.0, 315.0, 200.0, 359.5, 270.0, 0.0]


@pytest.mark.parametrize(
    ("columns", "words", "way_out"),
    [
        ({"pattern": ["rows", 6]}, "pattern of residences is '6'", "5 (dotted)"),
        ({"pattern": ["rows", "spiral"]}, "'spiral'", "1 (rows)"),
        ({"facilities": [1, "1.5"]}, "pattern of facilities is '1.5'", "0 (empty)"),
        ({"paths": [1, 0]}, "pattern of paths is '0'", "1 (circle), 2 (direct), 3 (ending)"),
        ({"direction": [1, 2]}, "direction of paths is '2'", "1 (same, inside)"),
        ({"facing": [1, "uphill"]}, "'uphill', which is no number", "clockwise from north"),
        ({"facing": [1, 1000]}, "1000 degrees", "from 0 to 360"),
        ({"residences": ["rows", "1/9/1"]}, "pattern of paths is '9'", "2 (direct)"),
    ],
)
def test_a_bad_cell_is_told_with_layer_and_feature(columns, words, way_out):
    with pytest.raises(InputError) as caught:
        patch_choices(patches(**columns), "My patches")
    assert words in caught.value.problem
    assert way_out in caught.value.remedy
    assert (caught.value.layer, caught.value.feature) == ("My patches", 12)


@pytest.mark.parametrize(
    "wrong", [{"residences": 6}, {"facilities": -1}, {"paths": 0}, {"paths": len(PATH_PATTERNS)},
              {"path_direction": 2}, {"facing_deg": 400.0}, {"facing_deg": float("nan")}],
)  # fmt: skip
def test_a_choice_out_of_bounds_is_refused(wrong):
    with pytest.raises(InputError):
        PatchChoice(**wrong)
