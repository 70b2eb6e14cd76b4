"""What was asked travels as JSON: for all sites, or for each its own."""

from __future__ import annotations

import pytest
from platwright.errors import InputError
from platwright.network.specification import FORBID, Specification, sites_json

WIDE, NARROW = Specification(block_width=100.0, zigzags=FORBID), Specification(block_width=60.0)


def test_one_for_all_sites_is_read_for_each():
    text = WIDE.to_json()
    assert Specification.from_json(text) == WIDE
    assert Specification.from_json(text, site_id=7) == WIDE


def test_each_site_gets_its_own_back():
    text = sites_json({1: WIDE, 2: NARROW})
    assert Specification.from_json(text, site_id=1) == WIDE
    assert Specification.from_json(text, site_id=2) == NARROW


@pytest.mark.parametrize("site_id", [None, 3])
def test_a_site_that_is_not_there_is_told(site_id):
    with pytest.raises(InputError, match=r"1, 2.*site_id"):
        Specification.from_json(sites_json({2: NARROW, 1: WIDE}), site_id=site_id)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '{"sites": 3}', '{"sites": {"1": 3}}'])
def test_what_is_no_specification_is_told(text):
    with pytest.raises(InputError, match="no specification"):
        Specification.from_json(text, site_id=1)


def test_unknown_keys_are_told():
    with pytest.raises(InputError, match="block_wdth"):
        Specification.from_json('{"block_wdth": 60}')


def test_a_value_of_a_wrong_type_is_told():
    with pytest.raises(InputError):
        Specification.from_json('{"block_width": "wide"}')
