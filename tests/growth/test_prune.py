"""Streets that end blind go, those that lead out of the domain stay."""

from __future__ import annotations

import time
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.growth.layers import growth_layers
from platwright.growth.layers.prune import without_dead_ends

from .hand_made import ORIGIN, Edge, given_street, lattice, make_growth, make_real, rules

#: A square of streets with a stem of two streets to the right, and one to the left.
SQUARE = [(0, 0), (100, 0), (100, 100), (0, 100), (200, 0), (300, 0), (-100, 0)]
EDGES = [Edge(0, 1), Edge(1, 2), Edge(2, 3), Edge(3, 0), Edge(1, 4), Edge(4, 5), Edge(0, 6)]


def positions(growth):
    return {tuple(at) for at in (growth.xy - ORIGIN).round(6).tolist()}


def edge_set(growth):
    """Edges as pairs of positions, whatever the numbers are."""
    places = [tuple(at) for at in (growth.xy - ORIGIN).round(6).tolist()]
    return {frozenset((places[u], places[v])) for u, v in growth.ends.tolist()}


def test_blind_streets_go_again_and_again():
    growth = make_growth(SQUARE, EDGES)
    left = without_dead_ends(growth, make_real(growth))
    assert positions(left) == {(0, 0), (100, 0), (100, 100), (0, 100)}
    assert len(left.ends) == 4
    assert (left.degrees == 2).all()
    assert left.steps == growth.steps


def test_a_street_that_ends_at_the_outer_edge_stays_and_one_at_an_obstacle_goes():
    growth = make_growth(SQUARE, EDGES)
    growth.node_type[[5, 6]] = "BOUNDARY"
    # the pond lies to the left: its shore is the edge of an obstacle
    pond = shapely.box(-150, -50, -100, 50)
    domain = shapely.box(-200, -200, 300, 300).difference(pond)
    left = without_dead_ends(growth, make_real(growth, domain))
    assert positions(left) == positions(growth) - {(-100, 0)}
    assert edge_set(left) == edge_set(growth) - {frozenset([(0.0, 0.0), (-100.0, 0.0)])}


def test_a_start_at_the_outer_edge_leads_out():
    growth = make_growth([(0, 50), (50, 50), (100, 50)], [Edge(0, 1), Edge(1, 2)])
    growth.node_type[2] = "BOUNDARY"
    growth.node_type[0] = "Start"
    left = without_dead_ends(growth, make_real(growth, shapely.box(0, 0, 100, 100)))
    assert len(left.ends) == 2


def test_without_a_domain_a_tree_is_nothing_but_dead_ends():
    growth = make_growth(
        [(0, 0), (0, 50), (30, 80), (-30, 80)], [Edge(0, 1), Edge(1, 2), Edge(1, 3)]
    )
    left = without_dead_ends(growth, make_real(growth))
    assert len(left.ends) == 0
    assert len(left.xy) == 0


def test_existing_streets_stay_and_bend_again_where_a_street_joined():
    # an existing street over a bend, with a grown street at the bend and one between nodes
    xy = [(0, 0), (100, 0), (100, 100), (100, 50), (200, 0), (200, 50)]
    edges = [
        Edge(0, 1, street=0),
        Edge(1, 3, street=0),
        Edge(3, 2, street=0),
        Edge(1, 4),
        Edge(3, 5),
    ]
    growth = make_growth(xy, edges)
    street = given_street([(0, 0), (100, 0), (100, 100)], "Long Lane")
    real = make_real(growth, streets=(street,), given=3)
    real.ground.bends[1] = True  # before anything joined
    left = without_dead_ends(growth, real)
    assert positions(left) == {(0, 0), (100, 0), (100, 100), (100, 50)}
    assert left.street.tolist() == [0, 0, 0]
    assert left.bends.tolist() == [False, True, False, True]
    layers = growth_layers(left, real, rules())
    assert layers["streets"]["length_m"].tolist() == [200.0]
    assert len(layers["nodes"]) == 2


def test_an_existing_street_that_ends_blind_stays():
    growth = make_growth([(0, 0), (100, 0), (150, 0)], [Edge(0, 1, street=0), Edge(1, 2)])
    real = make_real(growth, streets=(given_street([(0, 0), (100, 0)]),), given=2)
    left = without_dead_ends(growth, real)
    assert edge_set(left) == {frozenset([(0.0, 0.0), (100.0, 0.0)])}


@settings(max_examples=60)
@given(st.data())
def test_what_is_left_is_what_a_slow_search_leaves(data):
    count = data.draw(st.integers(2, 14))
    pairs = st.tuples(st.integers(0, count - 1), st.integers(0, count - 1))
    drawn = data.draw(st.lists(pairs, min_size=1, max_size=25))
    pairs = sorted({(min(p), max(p)) for p in drawn if p[0] != p[1]})
    given_too = data.draw(st.sets(st.sampled_from(range(len(pairs))))) if pairs else set()
    open_ends = data.draw(st.sets(st.integers(0, count - 1)))
    angle = np.linspace(0, 2 * np.pi, count + 1)[:-1]
    out = np.array([k in open_ends for k in range(count)])
    # open ends lie at the edge of a domain that is a polygon through them
    radius = np.where(out, 100.0, 50.0)
    xy = np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None]
    edges = [Edge(u, v, street=0 if k in given_too else -1) for k, (u, v) in enumerate(pairs)]
    growth = make_growth(xy, edges, node_type=np.where(out, "BOUNDARY", "L"))
    ring = shapely.Point(0, 0).buffer(100 / np.cos(np.pi / 64), quad_segs=16)
    real = make_real(growth, ring)
    left = without_dead_ends(growth, real)

    graph = nx.MultiGraph()
    graph.add_nodes_from(range(count))
    graph.add_edges_from((u, v, {"given": k in given_too}) for k, (u, v) in enumerate(pairs))
    while True:
        blind = [
            n
            for n in graph
            if graph.degree(n) == 1
            and n not in open_ends
            and not next(iter(graph.edges(n, data="given")))[2]
        ]
        if not blind:
            break
        graph.remove_edges_from(list(graph.edges(blind[0])))
    places = [tuple(at) for at in xy.round(6).tolist()]
    assert edge_set(left) == {frozenset((places[u], places[v])) for u, v in graph.edges()}
    # nothing else is lost, and doing it again changes nothing
    assert without_dead_ends(left, real).ends.tolist() == left.ends.tolist()
    assert sorted(left.street.tolist()) == sorted(
        0 if data_["given"] else -1 for *_, data_ in graph.edges(data=True)
    )


@pytest.mark.parametrize("shape", ["one long tail", "many short ones"])
def test_long_tails_take_no_longer_than_short_ones(shape):
    count = 30_000
    if shape == "one long tail":
        ends = np.column_stack([np.arange(count), np.arange(1, count + 1)])
    else:
        ends = np.column_stack([np.zeros(count, dtype=np.int64), np.arange(1, count + 1)])
    base = make_growth(np.zeros((count + 1, 2)), [Edge(0, 1)])
    growth = replace(
        base,
        ends=ends,
        road=np.ones(count, dtype=np.int64),
        edge_type=np.full(count, "s"),
        step=np.ones(count, dtype=np.int64),
        street=np.full(count, -1),
    )
    begin = time.process_time()
    left = without_dead_ends(growth, make_real(growth))
    assert len(left.ends) == 0
    assert time.process_time() - begin < 5.0


def test_blocks_are_the_same_without_dead_ends():
    growth = lattice(6, 5, seed=3)
    kept = np.ones(len(growth.ends), dtype=bool)
    kept[[0, 7, 20, 21]] = False
    own = ("ends", "road", "edge_type", "step", "street")
    some = replace(growth, **{name: getattr(growth, name)[kept] for name in own})
    real = make_real(some)
    before = growth_layers(some, real, rules(iterations=9))
    after = growth_layers(without_dead_ends(some, real), real, rules(iterations=9))
    assert before["blocks"].equals(after["blocks"])
