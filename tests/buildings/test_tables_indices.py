"""Planning indices against building types and the size of the zone."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.buildings.rules import LayoutRules
from platwright.buildings.tables import check_indices, shipped_types
from platwright.buildings.types import BuildingType
from platwright.errors import InputError

AREA = 108_000.0


def home(storeys: int, *, count=None, share=None, side: float = 15.0) -> BuildingType:
    return BuildingType(
        f"{storeys} storeys", side, side, 3.0 * storeys, storeys, count=count, share=share
    )


def refused(types, rules, area=AREA) -> InputError:
    with pytest.raises(InputError) as caught:
        check_indices(types, rules, area)
    assert caught.value.remedy
    return caught.value


@pytest.mark.parametrize(
    ("name", "far", "density"),
    [("multistorey", 1.1, 0.28), ("highrise", 1.8, 0.25), ("slabs", 0.9, 0.25),
     ("terraced", 0.6, 0.3), ("mixed", 1.2, 0.25)],
)  # fmt: skip
def test_the_shipped_sets_reach_what_is_asked_of_them(name, far, density):
    assert check_indices(shipped_types(name), LayoutRules(far=far, density=density), AREA) == []


def test_indices_in_conflict_are_told_with_numbers_and_three_ways_out():
    # At most 28 % x 1.05 = 29.4 % of the ground, three storeys: 0.882.
    error = refused((home(3), home(2)), LayoutRules(far=1.5))
    assert "contradict" in error.problem
    assert all(number in error.problem for number in ("29.4%", "3 storeys", "0.88", "1.5"))
    assert "Lower the floor area ratio to 0.88" in error.remedy
    assert "density to 50%" in error.remedy
    assert "at least 6 storeys" in error.remedy


@given(st.integers(1, 30), st.floats(0.05, 0.6), st.floats(0.2, 4))
def test_the_way_out_is_one(storeys, density, far):
    rules = LayoutRules(far=far, density=density, green=0.2)
    if rules.most_density * storeys >= far:
        check_indices((home(storeys),), rules, AREA)
        return
    remedy = refused((home(storeys),), rules).remedy
    lower = float(re.search(r"ratio to ([\d.]+)", remedy).group(1))
    higher = int(re.search(r"at least (\d+) storeys", remedy).group(1))
    if lower > 0:
        check_indices((home(storeys),), LayoutRules(far=lower, density=density, green=0.2), AREA)
    check_indices((home(higher),), rules, AREA)
    denser = re.search(r"density to (\d+)%", remedy)
    if denser:
        limit = max(density, int(denser.group(1)) / 100)
        freed = LayoutRules(far=far, density=density, density_limit=limit, green=0.2)
        check_indices((home(storeys),), freed, AREA)


def test_a_limit_of_its_own_counts_and_not_the_wish():
    rules = LayoutRules(far=1.5, density=0.28, density_limit=0.5)
    assert check_indices((home(3),), rules, AREA) == []
    refused((home(3),), LayoutRules(far=1.5, density=0.28, density_limit=0.49))


def test_counts_bound_what_high_buildings_give():
    # Two towers of 225 m2 x 20 storeys on 10,000 m2 are 0.9; the rest has two storeys.
    types = (home(20, count=2), home(2))
    reachable = 0.9 + (0.294 - 0.045) * 2
    check_indices(types, LayoutRules(far=round(reachable - 0.01, 3)), 10_000.0)
    refused(types, LayoutRules(far=round(reachable + 0.01, 3)), 10_000.0)
    (text,) = check_indices((home(20, count=2),), LayoutRules(far=1.2), 10_000.0)
    assert "0.90" in text
    assert "Raise the counts" in text


def test_types_of_which_none_are_wished_reach_nothing():
    error = refused((home(12, share=0.0), home(3, share=1.0)), LayoutRules(far=1.5))
    assert "3 storeys" in error.problem
    assert "share" in refused((home(12, share=0.0),), LayoutRules()).remedy


def test_near_misses_are_warnings():
    (text,) = check_indices((home(6), home(2)), LayoutRules(far=1.3), AREA)
    assert "mostly the highest" in text
    assert "4.0 storeys in the mean" in text
    assert "1.18" in text
    # By their shares the high ones are nearly all.
    assert check_indices((home(6, share=0.9), home(2, share=0.1)), LayoutRules(far=1.3), AREA) == []
    (text,) = check_indices((home(2),), LayoutRules(far=0.7, density=0.4, green=0.55), AREA)
    assert "little is left" in text


def test_a_zone_too_small_for_a_building():
    error = refused((home(3), home(6, side=20)), LayoutRules(), 200.0)
    assert "200 m2) is smaller" in error.problem
    assert "225 m2" in error.problem
    assert "limit of the density" in refused((home(3),), LayoutRules(), 700.0).problem
    assert "limit of the floor area ratio" in refused((home(6),), LayoutRules(), 1000.0).problem
    assert check_indices((home(6), home(3)), LayoutRules(far=0.9), 1000.0) == []


def test_without_homes_there_is_nothing_to_check():
    shop = BuildingType("shop", 10, 10, 3, 1, use="facility")
    for types in ((shop,), (shop, home(6, count=0))):
        assert "residence" in refused(types, LayoutRules()).problem
