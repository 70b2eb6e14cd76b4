"""Circuity by hand, against networkx, and from a draw."""

from __future__ import annotations

import math
import time

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.measure.circuity import edge_circuity, mean_circuity, sinuosity
from platwright.measure.graph import StreetGraph, build_graph
from platwright.progress import Silent
from shapely.geometry import LineString


def lattice(n, step=100.0, jitter=0.0, seed=1):
    node = np.arange(n * n).reshape(n, n)
    ends = np.concatenate(
        [
            np.column_stack([node[:-1].ravel(), node[1:].ravel()]),
            np.column_stack([node[:, :-1].ravel(), node[:, 1:].ravel()]),
        ]
    )
    xy = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2)
    xy = xy * step + np.random.default_rng(seed).uniform(-jitter, jitter, (n * n, 2))
    return StreetGraph(xy, ends, tuple(shapely.linestrings(xy[ends])), np.arange(len(ends)))


def test_a_square():
    # Four sides (ratio 1) and two diagonals (ratio root 2).
    found = mean_circuity(lattice(2))
    assert found.mean_of_ratios == pytest.approx((4 + 2 * math.sqrt(2)) / 6)
    assert found.ratio_of_sums == pytest.approx(8 / (4 + 2 * math.sqrt(2)))
    assert (found.sources, found.nodes, found.error) == (4, 4, 0.0)


def test_a_straight_street_has_no_detour_and_a_bent_one_has():
    straight = build_graph([LineString([(0, 0), (100, 0)]), LineString([(100, 0), (300, 0)])])
    assert mean_circuity(straight).mean_of_ratios == 1.0
    assert sinuosity(straight) == 1.0
    bent = build_graph([LineString([(0, 0), (100, 0), (100, 100)])])
    assert mean_circuity(bent).mean_of_ratios == pytest.approx(math.sqrt(2))
    assert sinuosity(bent) == pytest.approx(math.sqrt(2))
    assert edge_circuity(bent).tolist() == pytest.approx([math.sqrt(2)])


def test_nodes_may_be_chosen():
    bent = build_graph([LineString([(0, 0), (100, 0)]), LineString([(100, 0), (100, 100)])])
    assert mean_circuity(bent).mean_of_ratios == pytest.approx((2 + math.sqrt(2)) / 3)
    ends = mean_circuity(bent, at=bent.degrees != 2)
    assert ends.mean_of_ratios == pytest.approx(math.sqrt(2))
    assert ends.nodes == 2


def test_only_the_largest_part_counts():
    far = LineString([(9000, 0), (9100, 0), (9100, 900)])
    graph = lattice(3)
    both = build_graph([*graph.lines, far])
    assert mean_circuity(both) == mean_circuity(graph)


def test_nodes_that_are_near_are_no_pair():
    # A ring of 999 m with a gap of 2 m: the ends are neighbours across it.
    gap = LineString([(0, 0), (0, 300), (300, 300), (300, -99), (2, -99), (2, 0)])
    graph = build_graph([gap, LineString([(0, 0), (-50, 0)]), LineString([(2, 0), (40, 0)])])
    close = mean_circuity(graph, apart=1.0)
    assert close.mean_of_ratios > 100
    assert mean_circuity(graph).mean_of_ratios < close.mean_of_ratios / 2


def test_of_parallel_streets_the_shorter_one_is_walked():
    short, long = LineString([(0, 0), (100, 0)]), LineString([(0, 0), (50, 400), (100, 0)])
    graph = build_graph([long, short])
    assert mean_circuity(graph).mean_of_ratios == 1.0


def test_nothing_to_measure():
    none = mean_circuity(build_graph([]))
    assert math.isnan(none.mean_of_ratios)
    assert none.nodes == 0
    assert math.isnan(sinuosity(build_graph([])))
    ring = build_graph([LineString([(0, 0), (100, 0), (100, 100), (0, 0)])])
    assert math.isnan(mean_circuity(ring).ratio_of_sums)
    assert np.isnan(edge_circuity(ring)).all()
    assert math.isnan(sinuosity(ring))


@given(st.integers(0, 10_000), st.floats(0.5, 20))
def test_all_pairs_are_those_of_networkx(seed, scale):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 1000, (12, 2))
    ends = rng.integers(0, 12, (24, 2))
    ends = ends[ends[:, 0] != ends[:, 1]]
    graph = StreetGraph(xy, ends, tuple(shapely.linestrings(xy[ends])), np.arange(len(ends)))
    net = nx.MultiGraph()
    net.add_weighted_edges_from((*e, d) for e, d in zip(ends.tolist(), graph.lengths.tolist()))
    biggest = max(len(part) for part in nx.connected_components(net))
    parts = [part for part in nx.connected_components(net) if len(part) == biggest]
    ratios = []
    for part in parts:
        ways = dict(nx.all_pairs_dijkstra_path_length(net.subgraph(part)))
        pairs = [(a, b, math.dist(xy[a], xy[b])) for a in part for b in part if a < b]
        pairs = [(ways[a][b], d) for a, b, d in pairs if d > 5]
        ratios.append(
            (
                sum(w / d for w, d in pairs) / len(pairs),
                sum(w for w, _ in pairs) / sum(d for _, d in pairs),
            )
        )
    found = mean_circuity(graph)
    assert any(
        (found.mean_of_ratios, found.ratio_of_sums) == pytest.approx(expected)
        for expected in ratios
    )
    big = StreetGraph(
        scale * xy, ends, tuple(shapely.linestrings(scale * xy[ends])), np.arange(len(ends))
    )
    assert mean_circuity(big, apart=5 * scale).mean_of_ratios == pytest.approx(found.mean_of_ratios)


def test_a_draw_comes_near_and_says_how_near():
    graph = lattice(30, jitter=30)
    exact = mean_circuity(graph)
    assert exact.sources == 900
    off = []
    for seed in range(20):
        drawn = mean_circuity(graph, pairs=45_000, seed=seed)
        assert drawn.sources == 50
        assert drawn.mean_of_ratios == pytest.approx(exact.mean_of_ratios, rel=0.02)
        off.append((drawn.mean_of_ratios - exact.mean_of_ratios) / drawn.error)
    # As far off as the standard error says, neither ten times more nor less.
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.7


def test_the_draw_depends_on_the_seed_and_not_on_the_order():
    graph = lattice(20, jitter=30)
    order = np.random.default_rng(0).permutation(400)
    back = np.argsort(order)
    mixed = StreetGraph(graph.nodes[order], back[graph.ends][::-1], graph.lines[::-1], graph.street)
    one = mean_circuity(graph, pairs=8000, seed=3)
    assert mean_circuity(graph, pairs=8000, seed=3) == one
    other = mean_circuity(mixed, pairs=8000, seed=3)
    assert other.mean_of_ratios == pytest.approx(one.mean_of_ratios, abs=1e-12)
    assert mean_circuity(graph, pairs=8000, seed=4) != one


def test_twenty_thousand_nodes_take_seconds():
    graph = lattice(142, jitter=20)
    start = time.process_time()
    found = mean_circuity(graph)
    assert time.process_time() - start < 5.0
    assert found.error < 0.01


def test_a_cancelled_measure_stops():
    class Stop(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        mean_circuity(lattice(3), progress=Stop())
