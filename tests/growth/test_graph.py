"""The graph of networkx tells what the arrays tell, with CitySprout's names."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from platwright.growth.layers.graph import to_networkx

from .hand_made import ORIGIN, Edge, lattice, make_growth


def test_nodes_and_edges_have_the_names_of_the_supplement():
    growth = make_growth(
        [(0, 0), (0, 300), (100, 300)],
        [Edge(0, 1, road=1, kind="m"), Edge(1, 2, road=2, kind="l", step=2)],
        node_type=np.array(["T", "B", "BOUNDARY"]),
        road_type=np.array(["m", "m", "l"]),
        incoming=np.array([[0.0, 1.0], [0.0, 1.0], [1.0, 0.0]]),
        incoming_road=np.array([0, 1, 2]),
    )
    graph = to_networkx(growth)
    x, y = ORIGIN
    assert graph.nodes[2] == {
        "roadType": "l",
        "nodeType": "BOUNDARY",
        "pos": (x + 100, y + 300),
        "incEdge": (1.0, 0.0),
        "incRoadNumber": 2,
    }
    assert graph.edges[0, 1] == {
        "weight": 1.0,
        "boundaryBox": (x, y, x, y + 300),
        "roadNumber": 1,
        "length": 300.0,
        "iteration": 1,
    }
    assert graph.edges[1, 2]["weight"] == 0.5
    assert graph.edges[1, 2]["boundaryBox"] == (x, y + 300, x + 100, y + 300)


def test_streets_that_were_there_are_road_0():
    growth = make_growth([(0, 0), (50, 0), (50, 50)], [Edge(0, 1, street=0), Edge(1, 2)])
    graph = to_networkx(growth)
    assert graph.edges[0, 1]["roadNumber"] == 0
    assert graph.edges[0, 1]["iteration"] == 0
    assert graph.nodes[0]["roadType"] == ""
    assert graph.edges[1, 2]["weight"] == 0.25


def test_a_whole_network_has_its_size_and_ways():
    graph = to_networkx(lattice(7, 4))
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (28, 6 * 4 + 7 * 3)
    assert nx.shortest_path_length(graph, 0, 27, weight="length") == pytest.approx(900.0)
    assert all(isinstance(k, int) for _, _, k in graph.edges(data="roadNumber"))
