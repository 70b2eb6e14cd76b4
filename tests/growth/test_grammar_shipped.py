"""The grammars that come along: what they say, and that it is what CitySprout says."""

from __future__ import annotations

import importlib.util
import json
import math
from importlib import resources

import pytest
from platwright.errors import InputError
from platwright.growth.grammar import NODE_TYPES, ROAD_TYPES, STATES, Child, Rule
from platwright.growth.grammars import shipped
from platwright.growth.grammars.check import grammar_remarks
from platwright.growth.grammars.file import GRAMMAR_FIELDS, grammar_text, parse_grammar
from platwright.growth.grammars.rule import CHILD_FIELDS, RULE_FIELDS
from platwright.growth.grammars.shipped import GRAMMARS, shipped_grammar

CITYSPROUT = ("organic", "grid", "hex", "line")
FOLDER = resources.files("platwright.growth") / "grammars"
RIGHT = (math.pi / 2, math.pi / 2)
AHEAD, BACK, ONE = (0.0, 0.0), (math.pi, math.pi), (1.0, 1.0)


def schema():
    return json.loads((FOLDER / "schema.json").read_text(encoding="utf-8"))


def test_every_file_is_listed_and_every_name_has_a_file():
    files = {path.name for path in FOLDER.iterdir() if path.name.endswith(".json")}
    assert files == {f"{name}.json" for name in GRAMMARS} | {"schema.json"}
    assert GRAMMARS[:4] == CITYSPROUT


@pytest.mark.parametrize("name", GRAMMARS)
def test_a_grammar_comes_along(name):
    grammar = shipped_grammar(name)
    assert grammar.name == name
    assert grammar.text.endswith(".")
    assert grammar_remarks(grammar) == ()
    assert shipped_grammar(f" {name.upper()} ") == grammar
    written = grammar_text(grammar)
    assert '"degrees"' in written, "written in what planners read"
    assert parse_grammar(written, name) == grammar
    # The file is written as the library writes it, plus the schema for editors.
    text = (FOLDER / f"{name}.json").read_text(encoding="utf-8")
    assert text == written.replace("{\n", '{\n  "$schema": "schema.json",\n', 1)


def test_others_are_refused():
    with pytest.raises(InputError, match=r"'organik'.*Did you mean organic\? Give organic, grid"):
        shipped_grammar("organik")
    with pytest.raises(InputError, match="no grammar '/etc/passwd'"):
        shipped_grammar("/etc/passwd")
    with pytest.raises(InputError, match="no grammar 'schema'"):
        shipped_grammar("schema")


@pytest.mark.parametrize("name", CITYSPROUT)
def test_credit_is_given(name):
    credit = shipped_grammar(name).credit
    assert f"CitySprout's {name.title()} grammar" in credit
    assert "C. Dobbie, A. Johansson" in credit


def test_the_leaf_of_each_is_that_of_a_main_road():
    for name in CITYSPROUT:
        assert shipped_grammar(name).leaf == STATES["mL"]


def test_grid_by_hand():
    grid = shipped_grammar("grid")
    assert {state.label for state in grid.rules} == {"mStart", "mL", "lL", "sL"}
    (small,) = grid.rules[STATES["sL"]]
    assert small == Rule(
        1.0,
        "K",
        (Child(AHEAD, ONE, STATES["sL"]), Child(RIGHT, ONE, STATES["sL"], True, True)),
    )
    straight, main, large = grid.rules[STATES["mL"]]
    assert straight == Rule(0.1, "K", (Child(AHEAD, ONE, STATES["mL"]),))
    assert [rule.probability for rule in (straight, main, large)] == [0.1, 0.3, 1.0]
    assert large.min_distances == {STATES["mB"]: 3.0, STATES["lB"]: 3.0}
    assert large.children[1] == Child(RIGHT, ONE, STATES["lL"], True, True)
    assert grid.longest == 1.0


def test_organic_by_hand():
    organic = shipped_grammar("organic")
    (start,) = organic.rules[STATES["mStart"]]
    assert start == Rule(
        1.0, "T", (Child(AHEAD, ONE, STATES["mL"]), Child(BACK, ONE, STATES["mL"]))
    )
    bend, main, large, wait = organic.rules[STATES["mL"]]
    (child,) = bend.children
    assert child.angle == pytest.approx((0, 0.2), abs=1e-10)
    assert (child.mirrored, child.length, child.new_road) == (True, (3.0, 3.0), False)
    assert wait == Rule(1.5, "L")
    assert main.min_distances == {STATES["mB"]: 5.0, STATES["lB"]: 3.0}
    assert main.children[1].angle == pytest.approx((math.pi / 5, 4 * math.pi / 5), abs=1e-15)
    assert main.children[1].state == STATES["mL"]
    assert large.children[1].state == STATES["lL"]
    assert organic.rules[STATES["sL"]][0].children[1].angle == pytest.approx((-0.1, 0.1))
    assert organic.longest == 3.0


def test_hex_by_hand():
    hexagons = shipped_grammar("hex")
    (start,) = hexagons.rules[STATES["mStart"]]
    turns = [math.degrees(child.angle[0]) for child in start.children]
    assert turns == pytest.approx([0, 60, 120, 180, 240, 300])
    assert all(child.new_road for child in start.children)
    fork = hexagons.rules[STATES["mL"]][2].children[1]
    assert math.degrees(fork.angle[0]) == pytest.approx(120)


def test_line_by_hand():
    line = shipped_grammar("line")
    assert list(map(len, line.rules.values())) == [1, 2, 2, 1, 1, 3]
    # CitySprout says B, but a rule that draws nothing leaves its node as it is there
    assert line.rules[STATES["mT"]][1] == Rule(10.0, "T")
    assert line.rules[STATES["sL"]][2] == Rule(0.5, "L")
    (sides,) = line.rules[STATES["lB"]]
    turns = [math.degrees(child.angle[0]) for child in sides.children]
    assert turns == pytest.approx([90, 270])
    assert line.rules[STATES["mL"]][1].children[1].state == STATES["lB"]
    assert line.longest == 8.0


@pytest.fixture(scope="module")
def facts(root):
    path = root.parent / "shared" / "peers" / "citysprout_rules.json"
    if not path.is_file():
        pytest.skip("facts of CitySprout absent: put them in ../shared/peers")
    return json.loads(path.read_text(encoding="utf-8"))["rules"]


def flat(value):
    """Return a value of the facts as least and greatest."""
    return tuple(value) if isinstance(value, list) else (value, value)


@pytest.mark.parametrize("name", CITYSPROUT)
def test_every_value_is_that_of_citysprout(name, facts):
    grammar = shipped_grammar(name)
    known = facts[name.title()]
    assert [state.label for state in grammar.rules] == list(known)
    for state, rules in grammar.rules.items():
        assert len(rules) == len(known[state.label])
        for rule, fact in zip(rules, known[state.label]):
            assert rule.probability == fact["occurProb"]
            becomes = fact["changeNodeTo"] if fact["thetas"] else state.node
            assert rule.becomes == becomes
            distances = {s.label: d for s, d in rule.min_distances.items()}
            assert distances == fact["minDistances"]
            children = rule.children
            assert [c.length for c in children] == list(map(flat, fact["lengths"]))
            assert [c.state.road for c in children] == fact["newRoadTypes"]
            assert [c.state.node for c in children] == fact["newNodeTypes"]
            assert [c.mirrored for c in children] == fact["randDirection"]
            assert [c.new_road for c in children] == fact["newRoad"]
            assert len(children) == len(fact["thetas"])
            for child, theta in zip(children, fact["thetas"]):
                # 0.1, 0.2 and 0.3 radians are written as degrees with nine decimals.
                assert child.angle == pytest.approx(flat(theta), abs=1e-11)


@pytest.mark.parametrize("name", CITYSPROUT)
def test_a_grammar_of_citysprout_carries_over(name, facts):
    # What a user of CitySprout has, written as JSON, with a name and the unit of angles.
    text = json.dumps({"name": name, "angles": "radians", "rules": facts[name.title()]})
    given, ours = parse_grammar(text, name), shipped_grammar(name)
    assert list(given.rules) == list(ours.rules)
    assert parse_grammar(grammar_text(given), name) == given


def test_the_schema_has_the_fields_and_names_of_the_code():
    described = schema()
    assert set(described["properties"]) == set(GRAMMAR_FIELDS)
    rule = described["$defs"]["rule"]
    assert list(rule["properties"]) == list(RULE_FIELDS)
    assert set(rule["dependentRequired"]) == set(CHILD_FIELDS)
    assert described["$defs"]["roadType"]["enum"] == list(ROAD_TYPES)
    assert {*described["$defs"]["nodeType"]["enum"], "BOUNDARY"} == set(NODE_TYPES)
    assert all("description" in field for field in rule["properties"].values())


@pytest.mark.skipif(importlib.util.find_spec("jsonschema") is None, reason="no jsonschema here")
@pytest.mark.parametrize("name", GRAMMARS)
def test_the_schema_accepts_what_comes_along(name):
    import jsonschema

    validator = jsonschema.Draft202012Validator(schema())
    data = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    assert list(validator.iter_errors(data)) == []
    data["rules"]["mStart"][0]["thetas"] = "pi"
    assert len(list(validator.iter_errors(data))) == 1


def test_the_files_are_found_from_the_package():
    assert (resources.files(shipped.__package__) / "grid.json").is_file()
