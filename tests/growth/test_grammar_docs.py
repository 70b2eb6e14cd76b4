"""The page about grammars: its example is a grammar, its tables name what there is."""

from __future__ import annotations

import re

import numpy as np
import pytest
from platwright.growth.grammar import NODE_TYPES, ROAD_TYPES, STATES, Child
from platwright.growth.grammars.check import grammar_remarks
from platwright.growth.grammars.file import GRAMMAR_FIELDS, parse_grammar
from platwright.growth.grammars.rule import RULE_FIELDS
from platwright.growth.grammars.shipped import GRAMMARS
from platwright.growth.grow import grow
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Start


@pytest.fixture(scope="module")
def page(root):
    return (root / "docs" / "grammars.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def example(page):
    (block,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    return parse_grammar(block, "docs/grammars.md")


def rows(page, heading):
    """Return the first cells of the tables under a heading."""
    part = re.split(rf"^#+ {heading}$", page, maxsplit=1, flags=re.MULTILINE)[1]
    part = re.split(r"^#+ ", part, maxsplit=1, flags=re.MULTILINE)[0]
    return re.findall(r"^\| `([^`\"]+)` \|", part, re.MULTILINE)


def test_the_example_is_what_the_page_says(example):
    assert grammar_remarks(example) == ()
    assert [state.label for state in example.rules] == ["mStart", "mL", "sL"]
    (start,) = example.rules[STATES["mStart"]]
    assert len(start.children) == 2
    bend, branch = example.rules[STATES["mL"]]
    assert bend.probability / (bend.probability + branch.probability) == 0.25
    assert branch.min_distances == {STATES["mB"]: 1.5}
    assert branch.children[1] == Child(
        (np.radians(75), np.radians(105)), (1.0, 1.5), STATES["sL"], True, True
    )


def test_the_example_grows(example):
    start = Start((0.0, 0.0), (0.0, 1.0), example.start)
    growth = grow(Ground((start,)), GrowthRules(example, iterations=20))
    main, small = (growth.edge_type == kind for kind in "ms")
    assert main.sum() >= 30
    assert small.sum() >= 20
    ends = growth.degrees == 1
    assert (growth.node_type[ends] == "K").sum() >= 10
    # the road goes on along the direction of the start
    assert np.ptp(growth.xy[:, 1]) > np.ptp(growth.xy[:, 0])


def test_every_grammar_field_and_state_has_a_row(page):
    assert rows(page, "What comes along") == list(GRAMMARS)
    assert set(rows(page, "The file")) == set(GRAMMAR_FIELDS)
    assert set(rows(page, "States")) == {*ROAD_TYPES, *NODE_TYPES}
    assert set(rows(page, "Rules")) == set(RULE_FIELDS)


def test_the_lists_of_the_page_mean_what_it_says(page):
    written = {
        "90": [(90, 90)] * 2,
        "[90]": [(90, 90)],
        "[0, 90]": [(0, 0), (90, 90)],
        "[[0, 90]]": [(0, 90)],
        "[0, [60, 120]]": [(0, 0), (60, 120)],
    }
    assert re.findall(r"^\| `\"thetas\": (.*?)` \|", page, re.MULTILINE) == list(written)
    for text, angles in written.items():
        types = ", ".join(['"L"'] * len(angles))
        grammar = parse_grammar(
            '{"name": "a", "angles": "degrees", "rules": {"mStart": [{"changeNodeTo": "K", '
            f'"thetas": {text}, "lengths": 1, "newRoadTypes": "m", "newNodeTypes": [{types}]'
            "}]}}",
            "page",
        )
        found = [np.degrees(child.angle) for child in grammar.rules[grammar.start][0].children]
        np.testing.assert_allclose(found, angles, atol=1e-9)
