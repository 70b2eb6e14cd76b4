"""Grammars written as text read back as the same, bit by bit."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.growth.grammar import (
    DONE,
    EDGE,
    NEVER_GROW,
    NODE_TYPES,
    STATES,
    Child,
    Grammar,
    Rule,
    State,
)
from platwright.growth.grammars.file import grammar_text, parse_grammar, read_grammar

PRINTABLE = st.characters(exclude_categories=["C", "Z"])
LINES = st.text(PRINTABLE, max_size=40)
GIVEN_TYPES = [node for node in NODE_TYPES if node != EDGE]
GROWING = [state for state in STATES.values() if state.node not in NEVER_GROW]


def spans(low, high):
    return st.lists(st.floats(low, high), min_size=1, max_size=2).map(
        lambda found: (min(found), max(found))
    )


ROUND_ANGLES = st.integers(-3600, 3600).map(lambda tenth: math.radians(tenth / 10))
ANGLES = st.one_of(
    spans(-math.tau, math.tau),
    st.tuples(ROUND_ANGLES, ROUND_ANGLES).map(lambda pair: (min(pair), max(pair))),
)
STATES_AT_ENDS = st.builds(State, st.sampled_from("mls"), st.sampled_from(GIVEN_TYPES))
CHILDREN = st.builds(
    Child,
    angle=ANGLES,
    length=spans(1e-6, 1e6),
    state=STATES_AT_ENDS,
    mirrored=st.booleans(),
    new_road=st.booleans(),
)
DISTANCES = st.dictionaries(
    st.sampled_from(list(STATES.values())), st.floats(1e-6, 1e6), max_size=3
)
RULES = st.builds(
    Rule,
    probability=st.floats(1e-9, 1e9),
    becomes=st.sampled_from(GIVEN_TYPES),
    children=st.lists(CHILDREN, max_size=4).map(tuple),
    min_distances=DISTANCES,
)
#: What makes every state sound: a rule without distances that ends in rest.
REST = st.builds(Rule, probability=st.floats(1e-9, 1e9), becomes=st.just(DONE))


@st.composite
def grammars(draw):
    states = draw(st.sets(st.sampled_from(GROWING), max_size=5)) | {STATES["mStart"]}
    rules = {
        state: (*draw(st.lists(RULES, max_size=3)), draw(REST)) for state in draw(order(states))
    }
    name = draw(LINES.filter(str.strip))
    return Grammar(name, rules, draw(LINES), draw(LINES))


def order(states):
    return st.permutations(sorted(states))


@given(grammars())
def test_a_grammar_reads_back_as_the_same(grammar):
    text = grammar_text(grammar)
    again = parse_grammar(text, "again")
    assert again == grammar
    assert list(again.rules) == list(grammar.rules)
    assert grammar_text(again) == text


@given(st.floats(-360, 360))
def test_degrees_of_a_file_stay_degrees(angle):
    data = {
        "name": "one", "angles": "degrees",
        "rules": {"mStart": [{
            "changeNodeTo": "K", "thetas": angle, "lengths": 1, "newRoadTypes": "m",
            "newNodeTypes": "K",
        }]},
    }  # fmt: skip
    grammar = parse_grammar(json.dumps(data), "one")
    written = json.loads(grammar_text(grammar))
    assert written["angles"] == "degrees"
    assert parse_grammar(json.dumps(written), "one") == grammar


def fan(*angles):
    """Return a grammar that draws streets at angles, radians."""
    children = tuple(Child((a, a), (1.0, 1.0), STATES["mL"]) for a in angles)
    return Grammar("fan", {STATES["mStart"]: (Rule(1.0, "K", children),)})


@pytest.mark.parametrize(
    ("angle", "shown"),
    [
        (0.0, 0), (math.pi, 180), (math.pi / 2, 90), (math.pi / 3, 60), (2 * math.pi / 3, 120),
        (4 * math.pi / 3, 240), (5 * math.pi / 3, 300), (-math.pi / 4, -45), (math.tau, 360),
        (math.radians(22.5), 22.5), (math.radians(0.1), 0.1),
    ],
)  # fmt: skip
def test_round_angles_are_written_round(angle, shown):
    written = json.loads(grammar_text(fan(angle)))
    assert written["rules"]["mStart"][0]["thetas"] == [shown]


def test_angles_that_no_degrees_become_are_written_in_radians():
    # 2.7 lies between the radians of two neighbouring numbers of degrees.
    near = math.degrees(2.7)
    around = [math.radians(math.nextafter(near, way)) for way in (-math.inf, near, math.inf)]
    assert min(around) < 2.7 < max(around)
    assert 2.7 not in around
    text = grammar_text(fan(2.7, math.pi / 2))
    assert '"angles": "radians"' in text
    assert '"thetas": [2.7, 1.5707963267948966]' in text
    assert parse_grammar(text, "fan") == fan(2.7, math.pi / 2)


def test_the_text_is_short_and_readable(tmp_path):
    child = Child((-math.pi / 6, math.pi / 6), (1.0, 2.5), STATES["lL"], mirrored=True)
    rules = {
        STATES["mStart"]: (
            Rule(1.0, "B", (child,), {STATES["mB"]: 3.0}),
            Rule(0.5, "K"),
        )
    }
    text = grammar_text(Grammar("Kanalstraße", rules, "One street.", "Ours."))
    assert (
        text
        == """{
  "name": "Kanalstraße",
  "text": "One street.",
  "credit": "Ours.",
  "angles": "degrees",
  "rules": {
    "mStart": [
      {
        "occurProb": 1,
        "changeNodeTo": "B",
        "thetas": [[-30, 30]],
        "randDirection": [true],
        "lengths": [[1, 2.5]],
        "newRoadTypes": ["l"],
        "newNodeTypes": ["L"],
        "minDistances": {"mB": 3}
      },
      {
        "occurProb": 0.5,
        "changeNodeTo": "K"
      }
    ]
  }
}
"""
    )
    path = tmp_path / "street.json"
    path.write_text(text, encoding="utf-8")
    assert grammar_text(read_grammar(path)) == text


def test_whole_numbers_may_stand_for_lengths():
    children = (Child((0, 0), (2, 3), STATES["mL"]),)
    rules = (Rule(1, "K", children, {STATES["mB"]: 4}), Rule(2, "K"))
    grammar = Grammar("whole", {STATES["mStart"]: rules})
    assert parse_grammar(grammar_text(grammar), "whole") == grammar
