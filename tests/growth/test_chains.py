"""Edges that follow one another become lines, whatever direction they have."""

from __future__ import annotations

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.growth.layers.chains import chains


def as_array(pairs):
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def test_a_chain_runs_from_end_to_end():
    found = chains(as_array([(0, 1), (1, 2), (2, 3)]), np.ones(4, dtype=bool))
    assert found.nodes.tolist() == [0, 1, 2, 3]
    assert found.ends.tolist() == [[0, 3]]
    assert found.first.tolist() == [0]
    assert found.of_edge.tolist() == [0, 0, 0]


def test_a_chain_stops_where_it_is_told_to_and_where_three_meet():
    ends = as_array([(0, 1), (1, 2), (2, 3), (3, 4), (3, 5)])
    passing = np.ones(6, dtype=bool)
    passing[1] = False
    found = chains(ends, passing)
    assert found.ends.tolist() == [[0, 1], [1, 3], [3, 4], [3, 5]]
    assert found.of_edge.tolist() == [0, 1, 1, 2, 3]


def test_a_ring_on_a_stem_begins_and_ends_at_the_stem():
    # a ring 1-2-3 that hangs on 0-1
    found = chains(as_array([(2, 3), (0, 1), (1, 2), (3, 1)]), np.ones(4, dtype=bool))
    assert sorted(map(tuple, found.ends.tolist())) == [(0, 1), (1, 1)]
    xy = np.array([[0, 0], [1, 0], [2, 0], [2, 1]], dtype=float)
    ring = found.lines(xy)[found.of_edge[0]]
    assert ring.is_ring
    assert ring.coords[0] == (1, 0)


def test_a_ring_that_meets_nothing_begins_with_its_first_edge():
    found = chains(as_array([(2, 0), (0, 1), (1, 2)]), np.ones(3, dtype=bool))
    assert found.nodes.tolist() == [2, 0, 1, 2]


def test_nothing_makes_no_chain():
    found = chains(as_array([]), np.zeros(0, dtype=bool))
    assert len(found.first) == 0
    assert len(found.lines(np.zeros((0, 2)))) == 0


@given(
    st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), max_size=25, unique=True),
    st.lists(st.booleans(), min_size=13, max_size=13),
)
def test_chains_cover_every_edge_once_and_meet_at_their_stops_only(pairs, passing):
    pairs = list({(min(p), max(p)): p for p in pairs if p[0] != p[1]}.values())
    ends, allowed = as_array(pairs), np.array(passing)
    angle = np.linspace(0, 2 * np.pi, 14)[:13]
    xy = np.column_stack([np.cos(angle), np.sin(angle)])
    found = chains(ends, allowed)
    lines = found.lines(xy)
    # each line is exactly its edges
    for k, line in enumerate(lines):
        own = {tuple(sorted(pairs[e])) for e in np.flatnonzero(found.of_edge == k)}
        nodes = found.nodes[found.owner == k].tolist()
        assert {tuple(sorted(p)) for p in zip(nodes, nodes[1:])} == own
        assert len(nodes) == len(own) + 1
        assert shapely.get_num_points(line) == len(nodes)
        assert [nodes[0], nodes[-1]] == found.ends[k].tolist()
        degree = np.bincount(ends.ravel(), minlength=13)
        assert all(allowed[n] and degree[n] == 2 for n in nodes[1:-1])
        free = nodes[0] == nodes[-1] and allowed[nodes[0]] and degree[nodes[0]] == 2
        assert free or not any(allowed[n] and degree[n] == 2 for n in (nodes[0], nodes[-1]))
        # along its first edge, where an edge at one of its ends allows it
        first = found.first[k]
        assert found.of_edge[first] == k
        tails = [e for e in np.flatnonzero(found.of_edge == k) if nodes[-1] in pairs[e]]
        assert pairs[first][0] == nodes[0] or not any(pairs[e][0] == nodes[-1] for e in tails)
    assert found.first.tolist() == sorted(found.first.tolist())
