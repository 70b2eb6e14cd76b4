"""Betweenness and closeness: values by hand, and those of networkx."""

from __future__ import annotations

import time

import networkx as nx
import numpy as np
import pytest
from clock import allowed
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.measure.centrality import EXACT, centrality
from platwright.progress import Silent


def lattice(columns, rows):
    """Return the nodes and edges of a grid."""
    number = np.arange(columns * rows).reshape(rows, columns)
    along = np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()])
    up = np.column_stack([number[:-1].ravel(), number[1:].ravel()])
    return number.size, np.vstack([along, up])


def by_networkx(count, ends, lengths):
    """Return betweenness of nodes and edges and closeness per km, in whole millimetres.

    Of parallel edges networkx sees the shortest only.
    """
    graph = nx.Graph()
    graph.add_nodes_from(range(count))
    for (u, v), length in zip(ends.tolist(), lengths):
        own = round(length * 1000)
        if u != v and own < graph.get_edge_data(u, v, {"mm": 10**12})["mm"]:
            graph.add_edge(u, v, mm=own)
    nodes = nx.betweenness_centrality(graph, weight="mm")
    edges = nx.edge_betweenness_centrality(graph, weight="mm")
    near = nx.closeness_centrality(graph, distance="mm")
    return nodes, edges, {node: value * 1e6 for node, value in near.items()}


def compare(count, ends, lengths):
    found = centrality(count, ends, lengths)
    nodes, edges, near = by_networkx(count, ends, lengths)
    assert found.nodes == pytest.approx([nodes[k] for k in range(count)], abs=1e-12)
    assert found.closeness == pytest.approx([near[k] for k in range(count)], rel=1e-9)
    assert found.sources <= count
    return found, edges


@pytest.mark.parametrize(("columns", "rows"), [(9, 9), (2, 40), (17, 5)])
def test_a_grid_full_of_ties_is_as_networkx_has_it(columns, rows):
    count, ends = lattice(columns, rows)
    # Lengths that are not exact as binary fractions: sums differ by the order of adding.
    found, edges = compare(count, ends, np.full(len(ends), 0.1 + 0.2))
    assert found.edges == pytest.approx([edges[tuple(pair)] for pair in ends.tolist()], abs=1e-12)


@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_random_networks_are_as_networkx_has_them(seed):
    """Several parts, loops, parallel streets, single nodes, ties."""
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 30))
    ends = random.integers(0, count, (int(random.integers(0, 50)), 2))
    lengths = random.choice([10.0, 20.0, 33.3, 50.0], len(ends))
    # of streets of equal length side by side each is a path of its own: keep them apart
    lengths = lengths + np.arange(len(ends)) * 1000.0 * (random.random() < 0.5)
    kept = {}
    for k, (pair, length) in enumerate(zip(np.sort(ends, axis=1).tolist(), lengths)):
        kept.setdefault((*pair, length), k)
    at = sorted(kept.values())
    found, edges = compare(count, ends[at], lengths[at])
    shortest = {}
    for k, pair in enumerate(np.sort(ends[at], axis=1).tolist()):
        shortest[tuple(pair)] = min(shortest.get(tuple(pair), k), k, key=lambda e: lengths[at][e])
    for k, pair in enumerate(np.sort(ends[at], axis=1).tolist()):
        best = shortest[tuple(pair)] == k and pair[0] != pair[1]
        assert found.edges[k] == pytest.approx(edges[tuple(pair)] if best else 0.0, abs=1e-12)


def test_two_ways_of_equal_length_share_the_traffic():
    """A square of four nodes: between opposite corners half goes each way."""
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    found = centrality(4, ends, [100.0] * 4)
    # of the 3 pairs of others, one is opposite: half of its traffic
    assert found.nodes == pytest.approx([1 / 6] * 4)
    # of 6 pairs: its own, and half of both diagonals
    assert found.edges == pytest.approx([2 / 6] * 4)
    assert found.closeness == pytest.approx([3 / 0.4] * 4)


def test_streets_side_by_side_share_too_and_loops_carry_nothing():
    ends = np.array([[0, 1], [0, 1], [1, 1], [1, 2]])
    found = centrality(3, ends, [100.0, 100.0, 50.0, 100.0])
    assert found.edges == pytest.approx([1 / 3, 1 / 3, 0.0, 2 / 3])
    assert found.nodes == pytest.approx([0.0, 1.0, 0.0])


def test_parts_that_are_not_joined_count_less():
    """Wasserman and Faust: times the share of nodes that can be reached."""
    found = centrality(5, np.array([[0, 1], [2, 3]]), [1000.0, 500.0])
    assert found.closeness == pytest.approx([0.25, 0.25, 0.5, 0.5, 0.0])
    assert found.nodes.tolist() == [0.0] * 5


@pytest.mark.parametrize("count", [0, 1, 2])
def test_hardly_any_network(count):
    found = centrality(count, np.zeros((0, 2), dtype=np.int64), [])
    assert found.nodes.tolist() == found.closeness.tolist() == [0.0] * count
    assert found.edges.shape == (0,)


def test_a_sample_comes_near_and_is_the_same_for_a_seed():
    random = np.random.default_rng(3)
    count, ends = lattice(40, 40)
    lengths = random.uniform(80, 120, len(ends))
    whole = centrality(count, ends, lengths)
    assert whole.sources == count
    some = centrality(count, ends, lengths, exact=1000, sources=300, seed=1)
    assert some.sources == 300
    again = centrality(count, ends, lengths, exact=1000, sources=300, seed=1)
    other = centrality(count, ends, lengths, exact=1000, sources=300, seed=2)
    assert (some.nodes == again.nodes).all()
    assert (some.nodes != other.nodes).any()
    assert np.corrcoef(whole.nodes, some.nodes)[0, 1] > 0.97
    assert np.corrcoef(whole.edges, some.edges)[0, 1] > 0.95
    assert some.nodes.mean() == pytest.approx(whole.nodes.mean(), rel=0.05)
    assert some.closeness == pytest.approx(whole.closeness, rel=0.12)


def test_more_shortest_paths_than_a_float_can_count():
    """A chain of 1100 squares has 2 to the 1100 ways from end to end."""
    many = 1100
    first = np.arange(many) * 3
    ends = np.vstack([
        np.column_stack([first, first + 1]), np.column_stack([first, first + 2]),
        np.column_stack([first + 1, first + 3]), np.column_stack([first + 2, first + 3]),
    ])  # fmt: skip
    found = centrality(3 * many + 1, ends, np.full(len(ends), 100.0), exact=10, sources=20)
    assert np.isfinite(found.nodes).all()
    assert np.isfinite(found.edges).all()


class Cancels(Silent):
    """Cancels after a while and remembers when."""

    def __init__(self, after):
        self.start, self.after = time.monotonic(), after

    def cancelled(self):
        return time.monotonic() - self.start > self.after


def test_it_can_be_cancelled_at_once():
    count, ends = lattice(70, 70)
    listener = Cancels(0.3)
    with pytest.raises(CancelledError):
        centrality(count, ends, np.full(len(ends), 100.0), progress=listener)
    assert time.monotonic() - listener.start < allowed(3.0)


@pytest.mark.slow
def test_cities_are_measured_in_time():
    """As fast as was promised, with room for a busy machine."""
    random = np.random.default_rng(1)
    for side, most in ((70, 30.0), (224, 60.0)):
        count, ends = lattice(side, side)
        ends = ends[random.random(len(ends)) < 0.8]
        before = time.process_time()
        found = centrality(count, ends, random.uniform(60, 140, len(ends)))
        assert time.process_time() - before < most
        assert found.sources < count / 10 or count <= EXACT
