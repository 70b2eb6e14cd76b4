"""Templates as JSON: there and back, and what is refused."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.rooms.shapes import (
    read_templates,
    shipped_templates,
    template_sets,
    templates_text,
)
from platwright.rooms.types import Template

from .shape_oracle import pinched, polyominoes

words = st.text(st.characters(categories=("L", "N", "P", "S")), max_size=12)


@st.composite
def sound(draw):
    """Draw a template that nothing is wrong with."""
    cells = draw(polyominoes())
    assume(not pinched(cells))
    least = draw(st.integers(0, 5))
    share = draw(st.sampled_from([0.0, 0.1, 0.3]))
    return Template(
        draw(words.filter(bool)),
        cells,
        tuple(sorted(draw(st.sets(st.integers(0, 3), min_size=1)))),
        draw(st.booleans()),
        least,
        draw(st.none() | st.integers(least, 9)),
        share,
        draw(st.none() | st.floats(share, 1)),
        draw(st.from_regex(r"#[0-9a-f]{6}", fullmatch=True)),
        draw(words),
    )


@given(st.lists(sound(), min_size=1, max_size=3, unique_by=lambda t: t.name.casefold()))
def test_there_and_back(templates):
    most = [1.0 if t.most_share is None else t.most_share for t in templates]
    assume(sum(most) >= 1)
    assert read_templates(templates_text(templates)) == tuple(templates)


def test_reads_a_file_and_what_it_draws(tmp_path):
    path = tmp_path / "rooms.json"
    entry = {
        "name": "corner", "cells": ["....", "#. .", "##", ""], "rotations": [270, 0],
        "mirror": False, "min": 2, "max": 5, "min_share": 0.1, "max_share": 0.5,
        "colour": "#8FB8de", "use": "ward",
    }  # fmt: skip
    other = {"name": "one", "cells": ["#"], "max": None, "max_share": None}
    path.write_text(json.dumps({"text": "two", "templates": [entry, other]}), encoding="utf-8-sig")
    corner = frozenset({(0, 0), (1, 0), (0, 1)})
    expected = (
        Template("corner", corner, (0, 3), False, 2, 5, 0.1, 0.5, "#8FB8de", "ward"),
        Template("one", frozenset({(0, 0)})),
    )
    assert read_templates(path) == read_templates(str(path)) == expected


def one(**values):
    """Write a file of one template, some of its values changed."""
    entry = {"name": "a", "cells": ["##"]}
    return json.dumps({"templates": [{**entry, **values}]})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "Not JSON: line 1, column 2"),
        ("[1]", "no object"),
        ("[" * 100_000, "Not JSON"),
        ('{"templates": {}}', "no list of templates"),
        ('{"templates": []}', "no templates"),
        ('{"templates": ["##"]}', "template 1: It is no object"),
        ('{"templats": []}', "'templats' is unknown. Did you mean templates?"),
        (one(color="#ffffff"), "template 1 'a': The key 'color' is unknown. Did you mean colour?"),
        ('{"templates": [{"name": "a", "name": "b", "cells": ["#"]}]}', "'name' is given twice"),
        (one(name=" "), "no name"),
        (one(name=3), "name is not a text"),
        (one(name="x" * 61), "name is too long"),
        (one(use="a\nb"), "use is too long or has line breaks"),
        (one(cells=[]), "no filled square"),
        (one(cells=["..", "  "]), "no filled square"),
        (one(cells="##"), "not given as rows"),
        (one(cells=["#x"]), "the character 'x'"),
        (one(cells=["#.#"]), "do not hang together"),
        (one(cells=["#.", ".#"]), "columns 1 and 2 of rows 1 and 2"),
        (one(cells=["##.", "#.#", "###"]), "columns 2 and 3 of rows 2 and 3"),
        (one(rotations=[]), "rotations are unknown"),
        (one(rotations=[45]), "rotations are unknown"),
        (one(rotations=[True]), "rotations are unknown"),
        (one(mirror="yes"), "mirror is neither true nor false"),
        (one(min=-1), "below 0"),
        (one(max=-1), "below 0"),
        (one(min=1.5), "min is no whole number"),
        (one(min="2"), "min is no number"),
        (one(min=True), "min is no number"),
        (one(max=10**400), "max is no number"),
        (one(min=3, max=2), "at least 3 and at most 2"),
        (one(min_share=0.6, max_share=0.5), "at least 0.6 and at most 0.5 of the area"),
        (one(max_share=40), "not between 0 and 1"),
        (one(min_share=-0.1), "not between 0 and 1"),
        (one(min_share=float("nan")), "min_share is no number"),
        (one(max_share=0.5), "largest shares of the area add up to 0.5 only"),
        (one(colour="red"), "colour is 'red'"),
        (one(colour="#12345"), "colour is '#12345'"),
        (one(colour=7), "colour is not a text"),
    ],
)  # fmt: skip
def test_faults_are_told(text, says):
    with pytest.raises(InputError, match=re.escape(says)) as caught:
        read_templates(text)
    assert str(caught.value).startswith("Room templates 'given as text'")
    assert caught.value.remedy


def test_faults_of_a_set_are_told():
    corner = frozenset({(0, 0)})
    with pytest.raises(InputError, match="Two templates are called 'A'"):
        read_templates(templates_text([Template("a", corner), Template("A", corner)]))
    with pytest.raises(InputError, match=r"least shares of the area add up to 1\.2"):
        read_templates(templates_text([Template(n, corner, least_share=0.6) for n in ("a", "b")]))


def test_holes_are_allowed():
    (ring,) = read_templates(one(cells=["###", "#.#", "###"]))
    assert len(ring.cells) == 8


def test_files_that_cannot_be_read_are_told(tmp_path):
    with pytest.raises(InputError, match=r"'none\.json' cannot be read: No such file"):
        read_templates(tmp_path / "none.json")
    bad = tmp_path / "bad.json"
    bad.write_bytes(b'{"templates": "\xff"}')
    with pytest.raises(InputError, match="not text in UTF-8"):
        read_templates(bad)
    bad.write_bytes(b" " * 1_000_001)
    with pytest.raises(InputError, match="more than 1,000,000 characters"):
        read_templates(bad)


# ---------------------------------------------------------------------- shipped sets
def oklab(rgb):
    """Convert linear sRGB to OKLab (Ottosson 2020)."""
    lms = rgb @ np.array(
        [[0.4122, 0.2119, 0.0883], [0.5363, 0.6807, 0.2817], [0.0514, 0.1074, 0.6300]]
    )
    return np.cbrt(lms) @ np.array(
        [[0.2105, 1.9780, 0.0259], [0.7936, -2.4286, 0.7828], [-0.0041, 0.4506, -0.8087]]
    )


#: How people without red or green cones see linear sRGB (Machado et al. 2009, severity 1).
BLIND = {
    "none": np.eye(3),
    "protan": [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.0520]],
    "deutan": [[0.3673, 0.8606, -0.2280], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]],
}


@pytest.mark.parametrize("name", list(template_sets()))
@pytest.mark.parametrize("sight", list(BLIND))
def test_colours_are_soft_and_told_apart_by_everyone(name, sight):
    colours = [t.colour for t in shipped_templates(name)]
    coded = np.array([[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in colours])
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    seen = oklab(np.clip(linear @ np.array(BLIND[sight]).T, 0, 1))
    distance = np.linalg.norm(seen[:, None] - seen[None], axis=2) + 9 * np.eye(len(seen))
    # A difference of 0.02 can just be seen side by side.
    assert distance.min() > 0.08
    if sight == "none":
        assert seen[:, 0].min() > 0.6  # black names stay readable
        assert np.hypot(seen[:, 1], seen[:, 2]).max() < 0.15


def test_shipped_sets():
    sets = template_sets()
    assert list(sets) == ["basic", "hotel", "office", "school", "hospital", "caves"]
    assert all(text and "\n" not in text and len(text) < 100 for text in sets.values())
    shapes = {t.name: t.cells for t in shipped_templates("Basic ")}
    sizes = {"2x2": 4, "3x2": 6, "2x3": 6, "4x2": 8, "L": 3, "T": 4, "U": 5}
    sizes |= {"1x2": 2, "1x3": 3, "1x4": 4}
    assert {name: len(cells) for name, cells in shapes.items()} == sizes
    for name in ("hotel", "office", "school", "hospital", "caves"):
        assert all(t.use for t in shipped_templates(name))


def test_blocks_of_levels_have_room_for_a_route():
    # CND-x eq. 19: an inner edge must be active. Every block is 3 squares long or 2 x 2.
    for template in shipped_templates("caves"):
        assert len(template.cells) >= 4


def test_an_unknown_set_is_told():
    with pytest.raises(InputError, match=r"'ofice'\. Did you mean office\?"):
        shipped_templates("ofice")
