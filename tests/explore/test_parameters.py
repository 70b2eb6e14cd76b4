"""What is varied: values as text, combinations, and lists of runs in files."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest
from platwright.errors import InputError
from platwright.explore import PARAMETERS, grid, listed, parsed, read_rows, runs_of
from platwright.network.specification import Specification


def test_every_parameter_is_a_field_of_the_specification():
    fields = {f.name for f in dataclasses.fields(Specification)}
    assert set(PARAMETERS) <= fields
    # every rule, weight and range of it can be varied, but for how it is searched
    left = fields - set(PARAMETERS)
    assert left == {"level_settings", "turning_radius", "time_limit", "gap", "solver", "effort"}


def test_every_word_of_a_choice_is_one_of_the_specification():
    for key, own in PARAMETERS.items():
        for word in own.words:
            assert getattr(dataclasses.replace(Specification(), **{key: word}), key) == word


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("weight_distance", "0.5", 0.5), ("weight_distance", 1, 1.0), ("exits", " 3 ", 3),
        ("dead_ends", "forbid", math.inf), ("dead_ends", "Allow", 0.0), ("dead_ends", "7", 7.0),
        ("traffic", "WITHIN", "within"), ("cul_de_sacs", "yes", True),
        ("cul_de_sacs", False, False),
    ],
)  # fmt: skip
def test_values_are_read(key, text, value):
    found = parsed(key, text)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("key", "text", "says"),
    [
        ("weight_distance", "much", "weight_distance is much. Give a number."),
        ("exits", "2.5", "Give a whole number"),
        ("exits", "nan", "Give a whole number"),
        ("dead_ends", "never", "or forbid, discourage, allow"),
        ("traffic", "all", "one of out, within, through"),
        ("colour", "1", "colour is nothing that can be varied"),
        ("solver", "highs", "solver is nothing that can be varied"),
    ],
)
def test_values_that_cannot_be_are_refused(key, text, says):
    with pytest.raises(InputError, match=says):
        parsed(key, text)


def test_lists_have_semicolons():
    assert listed("weight_distance", " 0;0.5 ; 1;") == [0.0, 0.5, 1.0]
    for text, says in ((" ; ", "no values are given"), ("1; 1.0", "twice")):
        with pytest.raises(InputError, match=says):
            listed("weight_distance", text)


def test_a_grid_has_every_combination_once():
    base = Specification(rules="paper", time_limit=7.0)
    runs = grid(base, {"weight_length": [1.0, 5.0], "dead_ends": [0.0, math.inf, 2.0]})
    assert [run.number for run in runs] == [1, 2, 3, 4, 5, 6]
    pairs = [(r.specification.weight_length, r.specification.dead_ends) for r in runs]
    assert pairs == [
        (1.0, 0.0),
        (1.0, math.inf),
        (1.0, 2.0),
        (5.0, 0.0),
        (5.0, math.inf),
        (5.0, 2.0),
    ]
    assert {(r.specification.rules, r.specification.time_limit) for r in runs} == {("paper", 7.0)}
    assert runs[1].name == "weight of street length 1, dead ends forbidden"


def test_what_contradicts_itself_names_its_run():
    with pytest.raises(InputError, match=r"Run 2: Block length \(150 m\) is less than block width"):
        grid(Specification(), {"block_width": [72.0, 200.0]})
    with pytest.raises(InputError, match="at most 400"):
        grid(Specification(), {"seed": list(range(401))})


def test_lists_of_runs_from_files(tmp_path):
    rows = [
        {"name": "short", "weight_distance": 0, "dead_ends": "allow"},
        {"name": "", "traffic": "within", "sinks": "north"},
    ]
    (tmp_path / "runs.json").write_text(json.dumps(rows))
    comma = "name,weight_distance,dead_ends,traffic,sinks\nshort,0,allow,,\n,,,within,north\n"
    (tmp_path / "runs.csv").write_text("\ufeff" + comma)
    (tmp_path / "other.csv").write_text(comma.replace(",", ";"))
    for name in ("runs.json", "runs.csv", "other.csv"):
        first, second = runs_of(Specification(), read_rows(tmp_path / name))
        assert (first.name, first.specification.dead_ends) == ("short", 0.0)
        assert first.specification.traffic == "out"
        assert second.name == "traffic within, exits north"
        # a set of exits means that streets leave there
        assert (second.sinks, second.specification.sink_mode) == ("north", "points")


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("runs.json", "{", "no JSON"),
        ("runs.json", '{"a": 1}', "no list of objects"),
        ("runs.json", "[]", "No runs are given"),
        ("runs.csv", "", "No runs are given"),
        ("runs.csv", "exits\n1,2\n", "more values than the head line"),
        ("runs.csv", "exits\nmany\n", "Run 1: exits is many"),
        ("gone.csv", None, "cannot be read"),
    ],
)
def test_files_that_are_no_lists_are_refused(tmp_path, name, text, says):
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=says):
        runs_of(Specification(), read_rows(path))
