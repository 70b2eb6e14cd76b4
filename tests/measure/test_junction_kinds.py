"""Kinds of junctions: streets that leave at angles by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.measure.graph import build_graph
from platwright.measure.junction_kinds import junction_kinds
from shapely.geometry import LineString


def star(*angles, size=100.0):
    """Return streets that leave one point at angles, in degrees."""
    return [
        LineString([(0, 0), (size * math.cos(math.radians(a)), size * math.sin(math.radians(a)))])
        for a in angles
    ]


def at_centre(lines):
    graph = build_graph(lines)
    found = junction_kinds(graph)
    centre = int(np.hypot(*graph.nodes.T).argmin())
    return found.kind[centre], int(found.degree[centre]), found.deviation[centre]


@pytest.mark.parametrize(
    ("angles", "kind", "deviation"),
    [
        ((0, 180, 90), "T", 0.0),
        ((0, 175, 270), "T", (5 + 0 + 5) / 3),
        ((0, 160, 80), "T", (10 + 10 + 20) / 3),
        ((0, 120, 240), "Y", 0.0),
        ((0, 40, 80), "Y", (80 + 80 + 160) / 3),
        ((0, 149, 270), "Y", (29 + 1 + 30) / 3),
        ((0, 90, 180, 270), "X", 0.0),
        ((0, 60, 180, 240), "X", 30.0),
        ((0, 50, 100, 150), "K", (40 * 3 + 120) / 4),
        ((0, 180, 45, 90), "K", (45 + 45 + 0 + 90) / 4),
        ((0, 72, 144, 216, 288), "star", 0.0),
        ((0, 180), "", 0.0),
        ((0, 90), "", 90.0),
    ],
)
@pytest.mark.parametrize("turn", [0, 33, 200])
def test_kinds_by_hand(angles, kind, deviation, turn):
    found = at_centre(star(*(a + turn for a in angles)))
    assert found[:2] == (kind, len(angles))
    assert found[2] == pytest.approx(deviation, abs=0.1)


def test_a_blind_end_is_a_dead_end():
    graph = build_graph(star(0, 180, 90))
    found = junction_kinds(graph)
    assert sorted(found.kind) == ["T", "dead end", "dead end", "dead end"]
    assert np.isnan(found.deviation[found.degree == 1]).all()


def test_the_direction_is_that_of_the_first_metres():
    """A street that leaves straight and bends after 60 m still goes straight on."""
    lines = star(0, 90)
    lines.append(LineString([(0, 0), (-60, 0), (-60, -100)]))
    assert at_centre(lines)[0] == "T"
    # and a kink of a few metres, as surveyed lines have it, changes little
    wiggly = [*star(0, 90), LineString([(0, 0), (-2, 1), (-100, 0)])]
    assert at_centre(wiggly)[0] == "T"


def test_a_ring_counts_twice():
    ring = LineString([(0, 0), (80, 0), (80, 80), (0, 80), (0, 0)])
    # leaves to the east and to the north; the street comes from the west
    assert at_centre([ring, *star(180)])[:2] == ("T", 3)


@given(st.lists(st.integers(0, 71), min_size=1, max_size=8, unique=True), st.integers(0, 359))
@settings(max_examples=80, deadline=None)
def test_kinds_do_not_depend_on_order_or_turn(steps, turn):
    angles = [5 * s for s in steps]
    one = at_centre(star(*angles))
    other = at_centre(star(*(a + turn for a in reversed(angles))))
    if len(steps) < 3 or all(abs(a % 30) > 2 for a in angles):
        assert one[:2] == other[:2]
    assert one[1] == len(angles)
    if len(angles) > 1:
        assert other[2] == pytest.approx(one[2], abs=0.1)


def test_no_streets():
    found = junction_kinds(build_graph([]))
    assert found.kind.shape == found.degree.shape == (0,)
