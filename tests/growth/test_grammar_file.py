"""Grammars from files: what is read, and what is refused with which words."""

from __future__ import annotations

import copy
import json
import math
import time
from pathlib import Path

import pytest
from platwright.errors import InputError
from platwright.growth.grammar import Child, Rule, State
from platwright.growth.grammars.check import grammar_remarks, possible_states
from platwright.growth.grammars.file import parse_grammar, read_grammar
from platwright.growth.grammars.jsontext import MOST_BYTES

FORK = {
    "occurProb": 2,
    "changeNodeTo": "B",
    "thetas": [0, [30, 60]],
    "randDirection": [False, True],
    "lengths": [1, [2, 3]],
    "newRoadTypes": ["m", "l"],
    "newNodeTypes": ["L", "L"],
    "newRoad": [False, True],
    "minDistances": {"mB": 3},
}
AHEAD = {
    "changeNodeTo": "T",
    "thetas": 0,
    "lengths": 1,
    "newRoadTypes": "m",
    "newNodeTypes": "L",
}
PLAIN = {
    "name": "plain",
    "angles": "degrees",
    "rules": {"mStart": [AHEAD], "mL": [FORK, AHEAD]},
}


def parse(data):
    return parse_grammar(json.dumps(data), "my.json")


def refusal(data):
    """Return what is said about a grammar that must be refused."""
    with pytest.raises(InputError) as refused:
        parse(data) if isinstance(data, dict) else parse_grammar(data, "my.json")
    assert "my.json" in str(refused.value)
    return str(refused.value)


def changed(**fields):
    """Return the plain grammar with other fields in the second state's first rule."""
    data = copy.deepcopy(PLAIN)
    rule = data["rules"]["mL"][0]
    for name, value in fields.items():
        if value is None:
            rule.pop(name)
        else:
            rule[name] = value
    return data


def test_every_field_is_read():
    grammar = parse({**PLAIN, "text": "A fork.", "credit": "Ours.", "$schema": "schema.json"})
    assert (grammar.name, grammar.text, grammar.credit) == ("plain", "A fork.", "Ours.")
    ahead = Rule(1.0, "T", (Child((0, 0), (1, 1), State("m", "L")),), {})
    left = Child((math.pi / 6, math.pi / 3), (2, 3), State("l", "L"), True, True)
    fork = Rule(2.0, "B", (Child((0, 0), (1, 1), State("m", "L")), left), {State("m", "B"): 3.0})
    assert grammar.rules[State("m", "Start")] == (ahead,)
    (child,) = grammar.rules[State("m", "L")][0].children[1:]
    assert child.angle == pytest.approx(left.angle, abs=1e-15)
    assert grammar.rules[State("m", "L")][1] == ahead
    assert grammar.rules[State("m", "L")][0].children[0] == fork.children[0]
    assert grammar.rules[State("m", "L")][0].min_distances == fork.min_distances
    assert (child.length, child.state, child.mirrored, child.new_road) == (
        left.length, left.state, True, True,
    )  # fmt: skip


def test_angles_may_be_radians():
    data = {**changed(thetas=[0, [0.5, 1.5]]), "angles": "radians"}
    assert parse(data).rules[State("m", "L")][0].children[1].angle == (0.5, 1.5)


def test_one_value_stands_for_all_streets():
    grammar = parse(changed(lengths=4, newRoadTypes="s", newNodeTypes="T", newRoad=True))
    children = grammar.rules[State("m", "L")][0].children
    assert [c.angle[0] for c in children] == pytest.approx([0, math.pi / 6])
    assert {(c.length, c.state, c.new_road) for c in children} == {
        ((4.0, 4.0), State("s", "T"), True)
    }


def test_a_list_is_streets_and_a_list_inside_is_a_range():
    rule = {**AHEAD, "thetas": [[-10, 20]], "lengths": [[1, 2]]}
    grammar = parse({**PLAIN, "rules": {"mStart": [rule]}})
    (child,) = grammar.rules[grammar.start][0].children
    assert child.angle == pytest.approx((math.radians(-10), math.radians(20)))
    assert child.length == (1.0, 2.0)
    three = {**AHEAD, "thetas": [0, 120, 240]}
    grammar = parse({**PLAIN, "rules": {"mStart": [three]}})
    assert len(grammar.rules[grammar.start][0].children) == 3


@pytest.mark.parametrize(
    "rule",
    [
        {"changeNodeTo": "K"},
        {"changeNodeTo": "K", "minDistances": {}},
        {
            "changeNodeTo": "K", "thetas": [], "randDirection": [], "lengths": [],
            "newRoadTypes": [], "newNodeTypes": [], "newRoad": [],
        },
        {
            "changeNodeTo": "K", "thetas": [], "lengths": 1, "newRoadTypes": "m",
            "newNodeTypes": "L",
        },
    ],
)  # fmt: skip
def test_a_rule_may_draw_no_street(rule):
    grammar = parse({**PLAIN, "rules": {"mStart": [AHEAD], "mL": [rule]}})
    assert grammar.rules[State("m", "L")] == (Rule(1.0, "K"),)


FAULTS = {
    "misspelt field": ({"minDistance": {"mB": 1}}, ("minDistance'", "Did you mean minDistances?")),
    "capitals": ({"Thetas": 0}, ("'Thetas'", "Did you mean thetas?")),
    "missing field": ({"lengths": None}, ("lengths is missing", "the rule has thetas")),
    "no change": ({"changeNodeTo": None}, ("changeNodeTo is missing",)),
    "unequal lists": ({"thetas": [0, 1, 2]}, ("differ in length", "thetas 3", "lengths 2")),
    "a range as a list": ({"lengths": [[1, 2]]}, ("lengths 1", "such as [[0, 20]]")),
    "zero length": ({"lengths": [1, 0]}, ("lengths, street 2", "is 0", "1e-06 to")),
    "negative length": ({"lengths": -1}, ("lengths: The value is -1.",)),
    "endless length": ({"lengths": 1e999}, ("lengths", "is inf")),
    "range turned round": ({"lengths": [1, [3, 2]]}, ("begins with 3 and ends with 2",)),
    "range of three": ({"thetas": [0, [1, 2, 3]]}, ("thetas, street 2", "range has 3 values")),
    "range of ranges": ({"thetas": [0, [1, [2, 3]]]}, ("thetas, street 2", "a list of 2")),
    "more than a turn": ({"thetas": [0, 361]}, ("361 is more than a full turn", "-360 to 360")),
    "NaN": ({"thetas": [0, math.nan]}, ("thetas, street 2", "The value is nan")),
    "a calculation": ({"thetas": [0, "pi/2"]}, ("'pi/2'", "nothing in a grammar is calculated")),
    "true as a number": ({"occurProb": True}, ("occurProb: The value is true.",)),
    "null": ({"occurProb": [None]}, ("occurProb: The value is a list of 1.",)),
    "no probability": ({"occurProb": 0}, ("occurProb: The value is 0.", "1e-09")),
    "minus": ({"occurProb": -2}, ("occurProb: The value is -2.",)),
    "infinite": ({"occurProb": math.inf}, ("occurProb: The value is inf.",)),
    "text for true": ({"newRoad": "true"}, ("newRoad: ", "true or false, without quotes")),
    "number for true": (
        {"randDirection": [0, True]},
        ("randDirection, street 1: The value is 0.",),
    ),
    "road type in words": ({"newRoadTypes": ["main", "l"]}, ("'main'", "Did you mean m?")),
    "no road type": ({"newRoadTypes": ["x", "l"]}, ("newRoadTypes, street 1", "m, l, s")),
    "node type in words": ({"newNodeTypes": ["L", "leaf"]}, ("street 2", "Did you mean L?")),
    "small letter": ({"changeNodeTo": "b"}, ("changeNodeTo", "Did you mean B?")),
    "node type a number": ({"changeNodeTo": 1}, ("changeNodeTo: The value is 1.",)),
    "edge": ({"newNodeTypes": "BOUNDARY"}, ("by themselves", "Give K")),
    "unknown state": ({"minDistances": {"mb": 1}}, ("'mb'", "Did you mean mB?")),
    "state in words": ({"minDistances": {"main branch": 1}}, ("Did you mean mB?",)),
    "distance": ({"minDistances": {"mB": 0}}, ("minDistances, mB: The value is 0.",)),
    "list of distances": ({"minDistances": [{"mB": 1}]}, ("minDistances: ", "a list of 1")),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_a_field_is_named(name):
    fields, words = FAULTS[name]
    said = refusal(changed(**fields))
    assert said.startswith("Grammar 'my.json', state mL, rule 1"), said
    for word in words:
        assert word in said


def test_radians_that_are_degrees_are_asked_about():
    said = refusal({**PLAIN, "angles": "radians"})
    assert "60 is more than a full turn" in said
    assert "-6.283 to 6.283" in said
    assert "are the angles in degrees?" in said


@pytest.mark.parametrize(
    "fields",
    [
        {"thetas": [0, 20]},
        {"thetas": [0, 20], "lengths": [1, 2]},
        {"lengths": [1, 2]},
    ],
)
def test_two_streets_or_a_range_is_asked_about(fields):
    said = refusal({**PLAIN, "rules": {"mStart": [{**AHEAD, **fields}]}})
    assert "state mStart, rule 1" in said
    assert " and ".join(fields) in said
    assert "two streets or one street of a range" in said
    clear = {**AHEAD, **fields, "newNodeTypes": ["L", "L"]}
    grammar = parse({**PLAIN, "rules": {"mStart": [clear]}})
    assert len(grammar.rules[grammar.start][0].children) == 2


OUTSIDE = {
    "a list": ("[1, 2]", ("a list of 2", "name, angles and rules")),
    "rules only": (json.dumps(PLAIN["rules"]), ("rules only", "radians")),
    "no unit": ({k: v for k, v in PLAIN.items() if k != "angles"}, ("angles is missing",)),
    "grads": ({**PLAIN, "angles": "grad"}, ("angles: ", "'grad'", '"degrees" or "radians"')),
    "unit in a list": ({**PLAIN, "angles": ["degrees"]}, ("angles: ", "a list of 1")),
    "no name": ({**PLAIN, "name": " "}, ("name: ", "empty")),
    "name a number": ({**PLAIN, "name": 3}, ("name: The value is 3.",)),
    "long name": ({**PLAIN, "name": "x" * 61}, ("61 characters", "at most 60")),
    "lines": ({**PLAIN, "text": "a\nb"}, ("text: ", "line breaks")),
    "half a character": ({**PLAIN, "name": "\ud800"}, ("name: ", "cannot be shown")),
    "another field": ({**PLAIN, "rule": {}}, ("'rule'", "Did you mean rules?")),
    "rules a list": ({**PLAIN, "rules": []}, ("rules: The value is a list of 0.",)),
    "rules null": ({**PLAIN, "rules": None}, ("rules: The value is null.",)),
    "no list": ({**PLAIN, "rules": {"mStart": AHEAD}}, ("state mStart", "a list of rules")),
    "empty list": ({**PLAIN, "rules": {"mStart": []}}, ("state mStart", "empty")),
    "rule a text": ({**PLAIN, "rules": {"mStart": ["x"]}}, ("state mStart, rule 1", "'x'")),
    "unknown state": ({**PLAIN, "rules": {"mstart": [AHEAD]}}, ("Did you mean mStart?",)),
    "field twice": (
        '{"name": "a", "name": "b", "angles": "degrees", "rules": {"mStart": '
        '[{"changeNodeTo": "K"}]}}',
        ("'name' is given more than once", "Keep one"),
    ),
    "state twice": (
        '{"name": "a", "angles": "degrees", "rules": {"mStart": [{"changeNodeTo": "K"}], '
        '"mStart": [{"changeNodeTo": "K"}]}}',
        ("state 'mStart' is given more than once", "in one list"),
    ),
    "distance twice": (
        '{"name": "a", "angles": "degrees", "rules": {"mStart": [{"changeNodeTo": "K", '
        '"minDistances": {"mB": 1, "mB": 2}}]}}',
        ("state mStart, rule 1, minDistances", "'mB' is given more than once"),
    ),
}


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_fault_outside_of_rules_is_named(name):
    data, words = OUTSIDE[name]
    said = refusal(data)
    for word in words:
        assert word in said


def test_the_start_must_have_a_rule():
    said = refusal({**PLAIN, "rules": {"mL": [AHEAD]}})
    assert "mStart has no rule" in said
    assert "draws the first streets" in said


@pytest.mark.parametrize("label", ["lK", "mBOUNDARY"])
def test_what_never_grows_has_no_rules(label):
    rules = {**PLAIN["rules"], label: [AHEAD]}
    said = refusal({**PLAIN, "rules": rules})
    assert f"state {label}" in said
    assert "never grow" in said


def test_a_state_that_occurs_has_a_rule_without_distances():
    near = {**AHEAD, "minDistances": {"mL": 1}}
    rules = {"mStart": [AHEAD], "mL": [near, near]}
    said = refusal({**PLAIN, "rules": rules})
    assert "state mL" in said
    assert "Every rule has minDistances" in said
    # A state that never occurs may be as it likes, and is remarked upon.
    grammar = parse({**PLAIN, "rules": {"mStart": [AHEAD], "mL": [AHEAD], "sT": [near]}})
    assert State("s", "T") not in possible_states(grammar)
    assert "sT" in grammar_remarks(grammar)[0]


def test_a_type_that_a_node_changes_to_occurs():
    near = {**AHEAD, "minDistances": {"mL": 1}}
    rules = {"mStart": [AHEAD], "mL": [AHEAD], "mT": [near]}
    assert "state mT" in refusal({**PLAIN, "rules": rules})


def test_the_leaf_of_existing_roads_occurs():
    near = {**AHEAD, "minDistances": {"mL": 1}, "newRoadTypes": "l"}
    start = {**AHEAD, "newNodeTypes": "K"}
    said = refusal({**PLAIN, "rules": {"mStart": [start], "lL": [near]}})
    assert "state lL" in said


def test_nodes_that_wait_for_ever_are_refused():
    wait = {"changeNodeTo": "T"}
    back = {"changeNodeTo": "L"}
    rules = {"mStart": [AHEAD], "mL": [wait], "mT": [back]}
    said = refusal({**PLAIN, "rules": rules})
    assert "state mL" in said
    assert "state mT" in said
    assert said.count("wait for ever") == 2
    assert parse({**PLAIN, "rules": {**rules, "mT": [back, {"changeNodeTo": "K"}]}})


def test_a_good_grammar_has_no_remarks():
    assert grammar_remarks(parse(PLAIN)) == ()


def test_degrees_that_look_like_radians_are_remarked_upon():
    (remark,) = grammar_remarks(parse(changed(thetas=[0, 1.57])))
    assert "1.57 degrees" in remark
    assert "radians?" in remark


def test_all_faults_are_told_at_once():
    data = changed(thetas=[0, "a"], occurProb=0)
    data["rules"]["mL"][1] = {"changeNodeTo": "X"}
    said = refusal(data).split("\n")
    assert said[0] == "Grammar 'my.json' has 3 faults."
    assert said[1].startswith("- state mL, rule 1, occurProb: ")
    assert said[2].startswith("- state mL, rule 1, thetas, street 2: ")
    assert said[3].startswith("- state mL, rule 2, changeNodeTo: ")


def test_of_many_faults_ten_are_told():
    data = {**PLAIN, "rules": {"mStart": [{"changeNodeTo": "X"}] * 24}}
    said = refusal(data).split("\n")
    assert said[0].endswith("24 faults.")
    assert len(said) == 12
    assert said[-1] == "- And 14 more."


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('{"name": "a",\n "angles": }', "line 2, column 12"),
        ("{'name': 'a'}", "line 1, column 2"),
        ('{"name": "a"', "line 1, column 13"),
        ('{"thetas": [0, pi/2]}', "line 1, column 16"),
        ('{"a": 1} {"b": 2}', "line 1, column 10"),
    ],
)
def test_what_is_not_json_is_told_by_line_and_column(text, place):
    said = refusal(text)
    assert place in said
    assert "not JSON" in said


@pytest.mark.parametrize("text", ["", " \n"])
def test_nothing_is_refused(text):
    assert "empty" in refusal(text)


HOSTILE = {
    "deep lists": "[" * 10_000 + "]" * 10_000,
    "deep objects": '{"a":' * 10_000,
    "very deep": "[" * 900_000,
    "large": " " * (MOST_BYTES + 1),
    "quotes": '"\\' * 400_000,
    "half a text": '"' + "a" * 900_000,
    "a long number": '{"name": "a", "angles": "degrees", "rules": ' + "1" * 900_000 + "}",
    "many fields": "{" + ",".join(f'"field{i}": 1' for i in range(50_000)) + "}",
    "one field often": "{" + ",".join(['"a": 1'] * 100_000) + "}",
    "a long field": '{"' + "x" * 900_000 + '": 1}',
    "many rules": json.dumps({**PLAIN, "rules": {"mStart": [{"changeNodeTo": "X"}] * 30_000}}),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_quickly(name):
    began = time.process_time()
    said = refusal(HOSTILE[name])
    assert time.process_time() - began < 5
    assert len(said) < 4000


def test_deep_nesting_is_told_by_its_line():
    assert "line 3" in refusal('{"a": \n [\n' + "[" * 30)


def test_files(tmp_path):
    path = tmp_path / "my grammar.json"
    path.write_text(json.dumps(PLAIN), encoding="utf-8-sig")
    assert read_grammar(path) == read_grammar(str(path)) == parse(PLAIN)


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (json.dumps(PLAIN).encode("utf-16"), "UTF-8"),
        (b"\xff\xfe\x00{", "UTF-8"),
        (b" " * (MOST_BYTES + 1), "more than 1,000,000"),
        (b"{", "not JSON"),
        (b"", "empty"),
    ],
)
def test_files_that_are_refused(tmp_path, data, word):
    path = tmp_path / "bad.json"
    path.write_bytes(data)
    with pytest.raises(InputError, match=word) as refused:
        read_grammar(path)
    assert "'bad.json'" in str(refused.value)


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(InputError, match=r"'no\.json' cannot be read: No such file"):
        read_grammar(tmp_path / "no.json")
    with pytest.raises(InputError, match="cannot be read: Is a directory"):
        read_grammar(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        read_grammar("a\0b")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no file without end here")
def test_a_file_without_end_is_refused():
    with pytest.raises(InputError, match="more than 1,000,000"):
        read_grammar("/dev/zero")
