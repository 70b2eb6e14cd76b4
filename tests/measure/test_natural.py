"""Natural streets on streets drawn by hand, under any order, and on a real town."""

from __future__ import annotations

import math
import time

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.measure.graph import StreetGraph, build_graph
from platwright.measure.natural import continuations, meetings, natural_lines, natural_streets
from shapely.geometry import LineString


def arms(*degrees, length=100.0, at=(0.0, 0.0)):
    """Straight streets out of one node; degrees counter-clockwise from the east."""
    x, y = at
    return [
        LineString(
            [at, (x + length * math.cos(math.radians(d)), y + length * math.sin(math.radians(d)))]
        )
        for d in degrees
    ]


def grid(columns, rows, step=100.0):
    """Streets of a grid of columns x rows nodes, cut at the nodes."""
    across = [
        LineString([(i * step, j * step), ((i + 1) * step, j * step)])
        for j in range(rows)
        for i in range(columns - 1)
    ]
    along = [
        LineString([(i * step, j * step), (i * step, (j + 1) * step)])
        for i in range(columns)
        for j in range(rows - 1)
    ]
    return across + along


def grouped(lines, **options):
    """Sets of input lines that are one natural street."""
    graph = build_graph(lines)
    label = natural_streets(graph, **options)
    return {frozenset(graph.street[label == k].tolist()) for k in set(label.tolist())}


def sets(*groups):
    return {frozenset(group) for group in groups}


def test_a_crossing_is_two_streets_and_a_t_is_two():
    assert grouped(arms(0, 90, 180, 270)) == sets({0, 2}, {1, 3})
    assert grouped(arms(0, 90, 180)) == sets({0, 2}, {1})


def test_a_fork_of_120_degrees_is_three_streets():
    # Every way on turns by 60 degrees.
    assert grouped(arms(0, 120, 240)) == sets({0}, {1}, {2})
    assert len(grouped(arms(0, 120, 240), max_turn=60.0)) == 2


def test_the_greatest_turn_is_a_bound():
    assert grouped(arms(0, 180 - 45)) == sets({0, 1})
    assert grouped(arms(0, 180 - 46)) == sets({0}, {1})
    # A corner without a junction goes on if that is asked for, one at a junction does not.
    assert grouped(arms(0, 90), max_bend=180.0) == sets({0, 1})
    assert grouped(arms(0, 90, 215), max_bend=180.0) == sets({0, 2}, {1})


def test_what_is_left_over_at_a_junction_is_joined_too():
    # 0 and 1 go straight on. 2 would go on best in 0 (14 degrees) but gets 3 (turn of 22).
    assert grouped(arms(0, 180, 166, 324)) == sets({0, 1}, {2, 3})


def test_each_end_goes_on_in_one_other_and_back():
    graph = build_graph([*grid(4, 3), *arms(30, 75, at=(100, 100), length=50)])
    partner = continuations(graph)
    joined = np.flatnonzero(partner >= 0)
    assert (partner[partner[joined]] == joined).all()
    node = graph.ends.ravel()
    assert (node[joined] == node[partner[joined]]).all()


def test_of_two_equal_turns_the_longer_edge_goes_on():
    stem, left, right = *arms(180), *arms(20, length=80), *arms(-20, length=90)
    assert grouped([stem, left, right]) == sets({0, 2}, {1})
    assert grouped([right, left, stem]) == sets({0, 2}, {1})


@pytest.mark.parametrize(("columns", "rows"), [(2, 2), (5, 3), (6, 7)])
def test_a_grid_has_a_street_for_each_row_and_column(columns, rows):
    graph = build_graph(grid(columns, rows))
    label = natural_streets(graph)
    found = natural_lines(graph, label)
    # The four outer corners of the grid are right angles.
    assert len(found.lines) == columns + rows
    expected = sorted([100.0 * (columns - 1)] * rows + [100.0 * (rows - 1)] * columns)
    assert sorted(found.length.tolist()) == pytest.approx(expected)
    assert (np.diff(found.length) <= 1e-6).all()
    assert all(line.geom_type == "LineString" for line in found.lines)
    assert shapely.length(found.lines) == pytest.approx(found.length)
    # Each row meets every column, and each column every row.
    level = np.array([line.coords[0][1] == line.coords[-1][1] for line in found.lines])
    assert (found.connectivity == np.where(level, columns, rows)).all()
    assert (found.segments == np.where(level, columns - 1, rows - 1)).all()


def test_a_ring_is_one_street_and_closed():
    ring = shapely.Point(0, 0).buffer(100, quad_segs=32).exterior
    pieces = [shapely.ops.substring(ring, a / 8, (a + 1) / 8, normalized=True) for a in range(8)]
    graph = build_graph([*pieces, LineString([(100, 0), (300, 0)])])
    label = natural_streets(graph)
    assert np.bincount(label).tolist() == [8, 1]
    found = natural_lines(graph, label)
    assert found.lines[0].is_ring
    assert found.lines[0].length == pytest.approx(ring.length)
    assert found.connectivity.tolist() == [1, 1]


def test_a_ring_of_one_edge_goes_on_in_itself():
    ring = shapely.Point(0, 8).buffer(8, quad_segs=32).exterior
    start = ring.interpolate(0.75, normalized=True)
    round_it = LineString(
        [
            *shapely.ops.substring(ring, 0.75, 1, normalized=True).coords,
            *shapely.ops.substring(ring, 0, 0.75, normalized=True).coords,
        ]
    )
    x, y = round_it.coords[0]
    assert start.distance(shapely.Point(x, y)) < 1
    graph = build_graph([round_it, LineString([(x, y), (x + 90, y - 200)])])
    assert sorted(natural_lines(graph, natural_streets(graph)).segments.tolist()) == [1, 1]


def test_a_street_that_crosses_itself_is_one_line():
    # A loop like that of a figure of eight, each bend 30 degrees at most.
    at = np.linspace(0, 2 * np.pi, 33)
    eight = np.column_stack([300 * np.sin(at), 150 * np.sin(2 * at)])
    eight[[0, 16, 32]] = 0
    graph = build_graph([LineString(pair) for pair in zip(eight, eight[1:])])
    assert graph.degrees.max() == 4
    label = natural_streets(graph)
    assert set(label.tolist()) == {0}
    (line,) = natural_lines(graph, label).lines
    assert line.geom_type == "LineString"
    assert line.length == pytest.approx(graph.lengths.sum())
    assert len(line.coords) == 33


def test_direction_is_that_of_some_metres_and_not_of_the_last_vertex():
    # The last 2 m of the first line turn aside by 60 degrees.
    hooked = LineString([(-100, 0), (-1, -1.73), (0, 0)])
    lines = [hooked, *arms(0, 60)]
    assert grouped(lines) == sets({0, 1}, {2})
    assert grouped(lines, reach=1.0) == sets({0, 2}, {1})


def test_roads_of_other_numbers_keep_them_and_may_branch():
    graph = build_graph(arms(0, 90, 180, 270))
    found = natural_lines(graph, np.array([7, 7, 7, 3]))
    assert found.number.tolist() == [3, 7]
    assert found.segments.tolist() == [1, 3]
    assert found.lines[0].geom_type == "LineString"
    assert found.lines[1].geom_type == "MultiLineString"
    assert shapely.length(found.lines[1]) == pytest.approx(300)
    assert found.connectivity.tolist() == [1, 1]


def test_streets_meet_once_per_node():
    # Streets 0 and 1 meet at nodes 1 and 2; 2 meets both at node 1.
    ends = np.array([[0, 1], [1, 2], [2, 3], [1, 2], [1, 4]])
    label = np.array([0, 0, 0, 1, 2])
    assert meetings(ends, label).tolist() == [[0, 1], [0, 1], [0, 2], [1, 2]]


def test_nothing_in_nothing_out():
    graph = build_graph([])
    label = natural_streets(graph)
    assert label.shape == (0,)
    assert len(natural_lines(graph, label).lines) == 0
    assert meetings(graph.ends, label).shape == (0, 2)


def wild(seed, count=14):
    """Streets between random points, some on a raster so that angles and lengths tie."""
    rng = np.random.default_rng(seed)
    xy = rng.integers(0, 6, (count, 2)) * 60.0 + np.where(
        seed % 2, rng.uniform(0, 9, (count, 2)), 0
    )
    xy = np.unique(xy, axis=0)
    pairs = {tuple(sorted(p)) for p in rng.integers(0, len(xy), (2 * count, 2)).tolist()}
    ends = np.array([p for p in sorted(pairs) if p[0] != p[1]])
    return xy, ends


def as_graph(xy, ends):
    return StreetGraph(xy, ends, tuple(LineString(xy[e]) for e in ends), np.arange(len(ends)))


@given(st.integers(0, 10_000))
def test_order_direction_scale_and_place_do_not_matter(seed):
    xy, ends = wild(seed)
    label = natural_streets(as_graph(xy, ends))
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(ends))
    turned = np.where(rng.random(len(ends))[:, None] < 0.5, ends, ends[:, ::-1])[order]
    assert natural_streets(as_graph(xy, turned)).tolist() == label[order].tolist()
    bigger = natural_streets(as_graph(4 * xy + [1000, -2000], ends), reach=60.0)
    assert bigger.tolist() == label.tolist()


@given(st.integers(0, 10_000))
def test_streets_are_ways_and_turn_no_more_than_asked(seed):
    xy, ends = wild(seed)
    graph = as_graph(xy, ends)
    label = natural_streets(graph)
    found = natural_lines(graph, label)
    assert found.segments.sum() == len(ends)
    assert found.length == pytest.approx(np.bincount(label, graph.lengths))
    met = nx.Graph()
    for node in range(len(xy)):
        here = sorted(set(label[(ends == node).any(axis=1)].tolist()))
        met.add_edges_from((a, b) for a in here for b in here if a < b)
    assert found.connectivity.tolist() == [
        met.degree(k) if k in met else 0 for k in range(len(found.lines))
    ]
    for line in found.lines:
        assert line.geom_type == "LineString"
        step = np.diff(np.asarray(line.coords), axis=0)
        heading = np.degrees(np.arctan2(step[:, 1], step[:, 0]))
        turn = np.abs((np.diff(heading) + 180) % 360 - 180)
        assert (turn <= 45 + 1e-5).all()


def test_fifty_thousand_edges_take_seconds():
    n = 160
    node = np.arange(n * n).reshape(n, n)
    ends = np.concatenate(
        [
            np.column_stack([node[:-1].ravel(), node[1:].ravel()]),
            np.column_stack([node[:, :-1].ravel(), node[:, 1:].ravel()]),
        ]
    )
    xy = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2) * 80.0
    xy += np.random.default_rng(1).uniform(-12, 12, xy.shape)
    graph = StreetGraph(xy, ends, tuple(shapely.linestrings(xy[ends])), np.arange(len(ends)))
    start = time.process_time()
    label = natural_streets(graph)
    found = natural_lines(graph, label)
    assert time.process_time() - start < 5.0
    assert len(found.lines) < 2.5 * n


def test_a_real_town(shared_data):
    """Long streets of Baltimore run through, and have one name for the most part."""
    streets = gpd.read_file(shared_data / "town" / "baltimore_se_md.gpkg", layer="streets")
    kinds = {"primary", "secondary", "tertiary", "residential"}
    streets = streets[streets.highway.isin(kinds)].explode(index_parts=False)
    graph = build_graph(list(streets.geometry))
    label = natural_streets(graph)
    found = natural_lines(graph, label)
    assert all(line.geom_type == "LineString" for line in found.lines)
    assert found.length[0] > 3000
    assert found.connectivity.max() > 30
    # North and South Broadway are one street.
    names = streets["name"].str.replace(r"^(North|South|East|West) ", "", regex=True)
    names = names.to_numpy()[graph.street]
    shares = []
    for k in range(20):
        own = (label == k) & (names != None)  # noqa: E711
        size: dict[str, float] = {}
        for name, length in zip(names[own], graph.lengths[own]):
            size[name] = size.get(name, 0.0) + length
        shares.append(max(size.values()) / sum(size.values()))
    assert np.median(shares) > 0.9
