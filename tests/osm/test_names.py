"""Ids and names, as planners type them."""

from __future__ import annotations

import doctest

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.osm import names
from platwright.osm.names import OsmId, fold, match_name, parse_osm_id


def test_examples():
    assert doctest.testmod(names).failed == 0
    assert doctest.testmod(names).attempted >= 3


@pytest.mark.parametrize(
    "text",
    [
        "R34914", "r34914", "relation/34914", "relation 34914", "rel:34914", " R 34914 ",
        "https://www.openstreetmap.org/relation/34914",
        "http://openstreetmap.org/relation/34914#map=11/60.1/25.0",
        "https://osm.org/relation/34914?locale=fi",
        "www.openstreetmap.org/relation/34914/history",
        "https://nominatim.openstreetmap.org/ui/details.html?osmtype=R&osmid=34914&class=boundary",
    ],
)  # fmt: skip
def test_ids_in_all_forms(text):
    assert parse_osm_id(text) == OsmId("relation", 34914)


@pytest.mark.parametrize("text", ["Helsinki", "00100", "R", "R12 Road", "Way", "n/a", "W1 London"])
def test_names_are_no_ids(text):
    assert parse_osm_id(text) is None


@pytest.mark.parametrize("text", ["R0", f"W{2**64}", "https://www.openstreetmap.org/#map=5/60/25"])
def test_what_cannot_be_an_id_is_refused(text):
    with pytest.raises(InputError, match=r"openstreetmap\.org/relation|cannot be an"):
        parse_osm_id(text)


@given(st.sampled_from(["node", "way", "relation"]), st.integers(1, 2**63 - 1))
def test_every_id_survives_being_written(kind, number):
    made = OsmId(kind, number)
    assert parse_osm_id(str(made)) == made
    assert parse_osm_id(f"https://www.openstreetmap.org/{kind}/{number}") == made


@given(st.text(max_size=50))
def test_any_text_is_an_id_a_name_or_refused_with_a_sentence(text):
    try:
        found = parse_osm_id(text)
    except InputError as error:
        said = str(error)
    else:
        said = "an id." if found is None or found.number > 0 else "nonsense"
    assert said.endswith(".")


@given(st.text(max_size=40))
def test_folding_twice_is_folding_once(text):
    assert fold(fold(text)) == fold(text)


@pytest.mark.parametrize(
    ("wanted", "name", "others", "grade"),
    [
        ("Larvotto", "Larvotto", (), 0),
        ("sainte devote", "Sainte-Dévote", (), 1),
        ("KOBENHAVN", "København", (), 1),
        ("Kopenhagen", "København", ("Copenhagen", "Kopenhagen"), 2),
        ("Monte", "Monte-Carlo", (), 3),
        ("Copen", "København", ("Copenhagen",), 4),
        ("Carlo", "Monte-Carlo", (), 5),
    ],
)
def test_grades_of_matches(wanted, name, others, grade):
    assert match_name(wanted, name, others).grade == grade


@pytest.mark.parametrize("wanted", ["", "  ", "--", "Nice", "Montecarlo"])
def test_what_does_not_fit_is_no_match(wanted):
    assert match_name(wanted, "Monte-Carlo", ("Monte Carlo",)) is None
