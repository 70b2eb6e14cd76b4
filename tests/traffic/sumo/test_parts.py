"""Pieces cut at places: nothing is lost, every place is at a node near where it was."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.traffic.sumo.parts import MARGIN, TOGETHER, cut


@given(
    length=st.floats(1.0, 500.0),
    shares=st.lists(st.floats(0.0, 1.0), max_size=8),
    bend=st.floats(-200.0, 200.0),
)
def test_parts_are_the_piece_and_places_are_near(make_streets, make_demand, length, shares, bend):
    middle = [(0.0, 0.0), (length / 2, bend), (length, 0.0)]
    network = make_streets([(0, 0), (length, 0)], [(0, 1)], lines={0: middle})
    whole = float(network.length[0])
    demand = make_demand({}, [(0, share * whole) for share in shares])
    parts = cut(network, demand.places)
    assert set(parts.piece) == {0}
    assert shapely.length(parts.lines).sum() == pytest.approx(whole)
    for (one, other), line in zip(parts.ends, parts.lines):
        assert line.coords[0] == pytest.approx(tuple(parts.nodes[one]))
        assert line.coords[-1] == pytest.approx(tuple(parts.nodes[other]))
    assert list(parts.ends[1:, 0]) == list(parts.ends[:-1, 1])
    assert (parts.ends[0, 0], parts.ends[-1, 1]) == (0, 1)
    # along the street nobody is moved farther than a junction reaches, and to the next place
    at = dict(zip(parts.ends[:, 1], np.cumsum(shapely.length(parts.lines)))) | {0: 0.0}
    for share, stop in zip(shares, parts.stops):
        assert abs(at[stop] - share * whole) <= MARGIN + TOGETHER + 1e-6
    assert (shapely.length(parts.lines) > min(whole, TOGETHER) / 4 - 1e-9).all()


@given(shares=st.lists(st.floats(0.0, 1.0), max_size=4))
def test_a_loop_becomes_edges_between_different_nodes(make_streets, make_demand, shares):
    ring = [(100.0, 0.0), (200.0, 0.0), (200.0, 80.0), (100.0, 80.0), (100.0, 0.0)]
    network = make_streets([(0, 0), (100, 0)], [(0, 1), (1, 1)], lines={1: ring})
    demand = make_demand({}, [(1, share * 360.0) for share in shares])
    parts = cut(network, demand.places)
    loop = parts.piece == 1
    assert loop.sum() >= 3
    assert (parts.ends[:, 0] != parts.ends[:, 1]).all()
    assert shapely.length(parts.lines[loop]).sum() == pytest.approx(360.0)
    graph = nx.MultiGraph([tuple(pair) for pair in parts.ends[loop]])
    assert all(degree == 2 for _, degree in graph.degree())
    for share, stop in zip(shares, parts.stops):
        was = shapely.line_interpolate_point(network.lines[1], share * 360.0)
        now = shapely.Point(parts.nodes[stop] + parts.origin)
        assert was.distance(now) <= MARGIN + TOGETHER + 1e-6


def test_gates_stay_at_their_nodes_and_places_on_short_streets_go_to_the_nearer_end(
    make_streets, make_demand
):
    network = make_streets([(0, 0), (20, 0), (120, 0)], [(0, 1), (1, 2)])
    parts = cut(network, make_demand({}, [(0, 4.0), (0, 18.0), (1, 50.0)], gates=[2]).places)
    assert list(parts.stops) == [0, 1, 3, 2]
    assert len(parts.piece) == 3


def test_streets_without_length_and_places_on_no_street_are_told(make_streets, make_demand):
    broken = make_streets([(0, 0), (50, 0), (50, 0)], [(0, 1), (1, 2)])
    with pytest.raises(InputError, match="101"):
        cut(broken, make_demand({}, [(0, 10.0)]).places)
    good = make_streets([(0, 0), (50, 0)], [(0, 1)])
    with pytest.raises(InputError, match="lies on no street"):
        cut(good, make_demand({}, [(7, 10.0)]).places)
