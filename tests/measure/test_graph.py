from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.measure.distances import distances_to_sinks, mean_along
from platwright.measure.graph import build_graph, chains
from shapely.geometry import LineString


def test_a_line_is_cut_where_another_ends_on_it():
    graph = build_graph([LineString([(0, 0), (100, 0)]), LineString([(40, 0.3), (40, 60)])])
    assert sorted(graph.degrees.tolist()) == [1, 1, 1, 3]
    assert sorted(np.round(graph.lengths).tolist()) == [40, 60, 60]
    assert graph.street.tolist().count(0) == 2
    assert not graph.crossings


def test_lines_that_cross_are_joined_only_at_a_shared_vertex():
    cross = [LineString([(0, 0), (100, 0)]), LineString([(50, -50), (50, 50)])]
    graph = build_graph(cross)
    assert len(graph.lines) == 2
    assert [c.streets for c in graph.crossings] == [(0, 1)]
    assert graph.crossings[0].geometry.coords[0] == (50, 0)

    noded = [
        LineString([(0, 0), (50, 0), (100, 0)]),
        LineString([(50, -50), (50, 0), (50, 50)]),
    ]
    graph = build_graph(noded)
    assert len(graph.lines) == 4
    assert graph.degrees.max() == 4
    assert not graph.crossings


def test_a_line_past_its_junction_is_a_crossing():
    graph = build_graph([LineString([(0, 0), (100, 0)]), LineString([(50, 50), (50, -5)])])
    assert len(graph.crossings) == 1


def test_doubled_streets_are_listed():
    graph = build_graph([LineString([(0, 0), (100, 0)]), LineString([(50, 0.01), (150, 0.01)])])
    assert len(graph.overlaps) == 1
    assert graph.overlaps[0].geometry.length == pytest.approx(50, abs=1)


def test_a_line_that_crosses_itself():
    graph = build_graph([LineString([(0, 0), (100, 0), (100, 50), (50, 50), (50, -50)])])
    assert [c.streets for c in graph.crossings] == [(0, 0)]


def test_a_ring_on_a_stem_is_cut_where_it_meets_itself():
    line = LineString([(0, 0), (50, 0), (50, 50), (100, 50), (100, 0), (50, 0)])
    graph = build_graph([line])
    assert not graph.crossings
    assert sorted(graph.degrees.tolist()) == [1, 3]


def test_chains_run_from_junction_to_junction_and_round_rings():
    lines = [
        LineString([(0, 0), (50, 0)]),
        LineString([(100, 0), (50, 0)]),
        LineString([(100, 0), (150, 0)]),
        LineString([(100, 0), (100, 50)]),
        LineString([(0, 200), (50, 200), (50, 250)]),
        LineString([(50, 250), (0, 200)]),
    ]
    graph = build_graph(lines)
    found = chains(graph, np.ones(6, dtype=bool), np.zeros(len(graph.nodes), dtype=bool))
    assert sorted(round(c.line.length) for c in found) == [50, 50, 100, 171]
    ring = max(found, key=lambda c: c.line.length)
    assert ring.ends[0] == ring.ends[1]
    assert ring.line.is_ring
    stops = graph.near(LineString([(50, -1), (50, 1)]), 0.1)
    found = chains(graph, np.ones(6, dtype=bool), stops)
    assert sorted(round(c.line.length) for c in found) == [50, 50, 50, 50, 171]


def test_no_lines_make_an_empty_graph():
    graph = build_graph([])
    assert graph.nodes.shape == (0, 2)
    assert chains(graph, np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)) == []
    assert distances_to_sinks(graph, np.zeros(0, dtype=bool)).shape == (0,)


def test_distances_take_the_shorter_of_two_parallel_streets():
    graph = build_graph(
        [LineString([(0, 0), (100, 0)]), LineString([(0, 0), (0, 80), (100, 80), (100, 0)])]
    )
    sinks = np.hypot(*graph.nodes.T) < 1
    distance = distances_to_sinks(graph, sinks)
    assert sorted(np.round(distance, 6).tolist()) == [0, 100]
    # 50 m on the straight one; up to (0 + 100 + 260) / 2 = 180 m on the way round.
    assert mean_along(graph, distance, np.array([True, False])) == pytest.approx(50)
    expected = (180**2 / 2 + (180**2 - 100**2) / 2) / 260
    assert mean_along(graph, distance, np.array([False, True])) == pytest.approx(expected)


@given(
    st.integers(1, 5),
    st.integers(1, 5),
    st.floats(0, 6.3),
    st.randoms(use_true_random=False),
)
def test_a_grid_is_recovered_from_its_pieces(nx, ny, angle, shuffle):
    c, s = np.cos(angle), np.sin(angle)

    def at(x, y):
        return (60 * (c * x - s * y), 60 * (s * x + c * y))

    lines = [LineString([at(i, j), at(i + 1, j)]) for i in range(nx) for j in range(ny + 1)]
    lines += [LineString([at(i, j), at(i, j + 1)]) for i in range(nx + 1) for j in range(ny)]
    shuffle.shuffle(lines)
    graph = build_graph([line if k % 2 else line.reverse() for k, line in enumerate(lines)])
    assert len(graph.lines) == len(lines)
    assert len(graph.nodes) == (nx + 1) * (ny + 1)
    assert not graph.crossings
    assert not graph.overlaps
    assert len(set(graph.components().tolist())) == 1
    # The same streets as whole lines without shared vertices only cross.
    rows = [LineString([at(0, j), at(nx, j)]) for j in range(ny + 1)]
    columns = [LineString([at(i, 0), at(i, ny)]) for i in range(nx + 1)]
    whole = build_graph(rows + columns)
    assert len(whole.crossings) == (nx - 1) * (ny - 1)
