"""Figures, wishes, targets and the solver in words."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.report import (
    Figure,
    InputFacts,
    check_targets,
    figure_text,
    figures_of,
    parse_targets,
    solver_facts,
    split_unit,
    target_of,
    wishes_of,
)
from platwright.report.pictures import scale_length, scale_text
from platwright.report.sections import best_of


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (1996.352, "m", "1,996 m"), (75.304, "m", "75.3 m"), (0.04567, "", "0.0457"),
        (1.0, "", "1"), (-3.25, "%", "-3.25 %"), (99.96, "", "100"), (-0.0, "", "0"),
        (math.nan, "m", "not known"), (math.inf, "", "not known"), (None, "", "not known"),
        (1e-9, "", "0"),
    ],
)  # fmt: skip
def test_numbers_have_three_digits_that_matter(value, unit, text):
    assert figure_text(value, unit) == text


@given(st.floats(min_value=1e-3, max_value=1e9))
def test_what_is_written_is_near_the_value(value):
    assert float(figure_text(value).replace(",", "")) == pytest.approx(value, rel=5.1e-3)


def test_units_are_parted_from_names():
    assert split_unit("Share of the ground (%)") == ("Share of the ground", "%")
    assert split_unit("Mean closeness of junctions (per km)")[1] == "per km"
    assert split_unit("Blocks of 76 to 111 % of the asked width, in %")[1] == "%"
    assert split_unit("Loops (alpha index), 0 to 1") == ("Loops (alpha index), 0 to 1", "")


def test_figures_come_in_the_order_of_their_labels():
    found = figures_of({"B": 1, "C": None, "A": 2.5, "T": "words"}, {"A": "An a (m)", "B": "A b"})
    assert [(own.key, own.label, own.value, own.unit) for own in found] == [
        ("A", "An a", 2.5, "m"), ("B", "A b", 1.0, ""), ("C", "C", None, ""),
    ]  # fmt: skip


INPUTS = {
    "block_width": InputFacts("Block width (m)"),
    "dead_ends": InputFacts("Dead ends", "forbid"),
    "solver": InputFacts("Solver", "automatic"),
    "seed": InputFacts("Seed", 1),
}


def test_what_differs_comes_first():
    asked = {"seed": 1, "dead_ends": 3.0, "block_width": 72.0, "solver": "auto", "other": False}
    found = wishes_of(json.dumps(asked), INPUTS)
    assert [(own.label, own.text, own.usual) for own in found] == [
        ("Dead ends", "3", False), ("Block width", "72 m", False),
        ("Seed", "1", True), ("Solver", "auto", True), ("Other", "no", True),
    ]  # fmt: skip


def test_wishes_of_sites_are_told_once_or_site_by_site():
    sites = {"1": {"seed": 1, "block_width": 60.0}, "2": {"seed": 1, "block_width": 80.0}}
    found = wishes_of(json.dumps({"sites": sites}), INPUTS)
    assert [(own.label, own.text) for own in found] == [
        ("Block width, site 1", "60 m"), ("Block width, site 2", "80 m"), ("Seed", "1"),
    ]  # fmt: skip


def test_nested_and_listed_wishes_are_readable():
    asked = {"rules": {"edge_case": 2}, "types": [{"name": "tower"}, {"name": "slab"}], "w": [1, 2]}
    found = {own.label: own.text for own in wishes_of(json.dumps(asked), {})}
    assert found == {"Rules: Edge case": "2", "Types": "tower, slab", "W": "1, 2"}


@pytest.mark.parametrize("text", ["", "{", "[1]", "null", "NaN", "[" * 5000, '{"a":' * 3000])
def test_what_is_no_specification_gives_no_wishes(text):
    assert wishes_of(text, INPUTS) == ()


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=12,
)


@given(st.dictionaries(st.text(max_size=8), JSON, max_size=5))
def test_any_specification_gives_words(asked):
    for own in wishes_of(json.dumps(asked), INPUTS):
        assert own.label == str(own.label)
        assert own.text


FIGURES = {
    "a": (Figure("TOTAL_LENGTH", "Length", 5000.0, "m"), Figure("DEAD_ENDS", "Dead ends", None)),
    "b": (Figure("TOTAL_LENGTH", "Length", 5000.1, "m"),),
}


@pytest.mark.parametrize(
    ("text", "met"),
    [
        ("TOTAL_LENGTH <= 5000", [True, False]), ("TOTAL_LENGTH < 5000", [False, False]),
        ("total_length >= 5 000.05 m", [False, True]), ("Length > 4,999", [True, True]),
        ("length ≤ 5e3", [True, False]), ("TOTAL_LENGTH = 5000", [True, False]),
        ("DEAD_ENDS = 0", [None, None]), ("# a remark", []), ("  ", []),
        ("Length >= 1 # remark; Length <= 1", [True, True, False, False]),
    ],
)  # fmt: skip
def test_targets_hold_or_not(text, met):
    assert [own.met for own in check_targets(parse_targets(text), FIGURES)] == met


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("TOTAL_LENGTH", "is no target"), ("<= 5", "is no target"), ("A <= many", "is no number"),
        ("A <= 1,5", "comma"), ("LENGHT <= 5", "no design has such a figure"),
        ("TOTAL_LENGTH <= 5 km", "is in km, but the figure is in m"), ("A <= 1e999", "no number"),
    ],
)  # fmt: skip
def test_targets_that_say_nothing_are_refused(text, words):
    with pytest.raises(InputError, match=words):
        check_targets(parse_targets(text), FIGURES)


def test_a_row_of_a_table_has_two_limits():
    assert [own.words("m") for own in target_of("A", 1.0, 20.0)] == ["at least 1 m", "at most 20 m"]
    assert target_of("A", None, None) == ()


def figures(**values):
    return [Figure(key.upper(), key, value) for key, value in values.items()]


def test_the_gap_is_that_of_price_and_bound():
    facts = solver_facts(figures(objective=50.0, bound=40.0, gap=99.0, seconds=3.0))
    assert facts.gap == pytest.approx(0.2)
    assert "20.0 % less" in facts.sentence
    assert not facts.proven
    assert solver_facts(figures(objective=5.0, bound=5.0)).proven
    # told in percent, or as a share, where there is no bound
    assert solver_facts(figures(objective=5.0, bound=None, gap=25.0)).gap == pytest.approx(0.25)
    assert solver_facts(figures(objective=5.0, bound=None, achieved_gap=0.25)).gap == 0.25
    assert solver_facts(figures(objective=0.0, bound=-5.0)).gap is None
    assert solver_facts(figures(objective=0.0, bound=0.0)).proven
    assert solver_facts(figures(objective=5.0)) is None
    assert solver_facts(figures(bound=5.0)) is None


def test_the_best_is_what_planners_want():
    row = [Figure("TOTAL_LENGTH", "", value) for value in (3.0, 2.0, 2.0, None)]
    assert best_of(row[0], row) == {1, 2}
    more = [Figure("WITH_ACCESS", "", value) for value in (90.0, 100.0)]
    assert best_of(more[0], [*more, None]) == {1}
    assert best_of(row[0], row[1:3]) == set()
    # nobody can say whether a price is good that others did not pay
    price = [Figure("OBJECTIVE", "", value) for value in (1.0, 2.0)]
    assert best_of(price[0], price) == set()


@given(st.floats(min_value=0.5, max_value=1e6))
def test_scale_bars_are_round_and_neither_short_nor_long(ground):
    length = scale_length(ground)
    assert 0.1 * ground < length <= 0.2801 * ground
    assert f"{length:e}"[0] in "125"
    number, unit = scale_text(length).split()
    metres = {"km": 1000.0, "m": 1.0, "cm": 0.01}[unit]
    assert float(number) * metres == pytest.approx(length)


def test_no_ground_has_no_scale():
    assert scale_length(0.0) == scale_length(math.nan) == 0.0
