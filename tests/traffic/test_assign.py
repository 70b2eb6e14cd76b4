"""All-or-nothing against networkx, conservation, one-way streets, islands."""

from __future__ import annotations

import time

import numpy as np
import pytest
from clock import allowed
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.progress import Silent
from platwright.traffic.assign import assign
from platwright.traffic.demand import DemandRules, read_demand
from platwright.traffic.network import read_network
from platwright.traffic.sections import cut_at_places
from platwright.traffic.types import Demand, Places
from trafficworld import between_nodes, grid, layer, network, slow_times, surplus


def random_case(seed):
    """A random network with loops, doubled and one-way pieces, with places on it and at nodes."""
    draw = np.random.default_rng(seed)
    count, many = int(draw.integers(3, 12)), int(draw.integers(3, 25))
    links = draw.integers(0, count, (many, 2))
    links = links[links[:, 0] != links[:, 1]]
    if not len(links):
        links = np.array([[0, 1]])
    made = network(count, links, draw.uniform(5, 50, len(links)))
    made.direction[:] = draw.integers(-1, 2, len(links))
    inner = int(draw.integers(1, 8))
    piece = draw.integers(0, len(links), inner)
    nodes = np.unique(links.ravel())[:3]
    ends = [np.argwhere(made.ends == node)[0] for node in nodes]
    places = Places(
        np.concatenate([piece, [e for e, _ in ends]]).astype(np.int64),
        np.concatenate([draw.uniform(0, 1, inner) * made.length[piece], np.zeros(len(nodes))]),
        np.concatenate([np.full(inner, -1), nodes]),
        np.concatenate([np.full(inner, 1 / inner), np.zeros(len(nodes))]),
        np.full(inner + len(nodes), "", dtype=object),
    )
    size = inner + len(nodes)
    trips = {}
    for kind in ("interior-interior", "boundary-boundary"):
        own = draw.uniform(0, 10, (size, size)) * (draw.random((size, size)) < 0.5)
        np.fill_diagonal(own, 0.0)
        trips[kind] = own
    return made, Demand(places, trips)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_times_and_unserved_are_those_of_networkx(seed):
    streets, demand = random_case(seed)
    found = assign(streets, demand)
    times = slow_times(streets, demand.places)
    reach = np.isfinite(times)
    assert found.flows.unserved == pytest.approx(demand.total[~reach].sum())
    for kind, trips in demand.trips.items():
        arrive = trips[reach].sum()
        assert found.flows.trips[kind] == pytest.approx(arrive)
        if arrive > 0:
            mean = (trips[reach] * times[reach]).sum() / arrive
            assert found.flows.time[kind] == pytest.approx(mean, rel=1e-6, abs=1e-4)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_vehicles_are_conserved_at_every_node(seed):
    streets, demand = random_case(seed)
    times = slow_times(streets, demand.places)
    served = {kind: np.where(np.isfinite(times), t, 0) for kind, t in demand.trips.items()}
    found = assign(streets, demand)
    out, asked = surplus(found.sections, found.loads, Demand(demand.places, served))
    np.testing.assert_allclose(out, asked, atol=1e-9)
    assert (found.loads.flow >= 0).all()
    # Vehicle-metres of the pieces are those of the links.
    both = found.flows.ahead + found.flows.back
    links = found.loads.flow.sum(axis=0) @ found.sections.length
    assert both @ streets.length == pytest.approx(links)


def test_nobody_drives_against_a_one_way_street():
    streets = network(3, [(0, 1), (1, 2), (2, 0)], [10, 10, 10])
    found = assign(streets, between_nodes(streets, {(0, 1): 5.0, (1, 0): 7.0}))
    assert found.flows.ahead == pytest.approx([5, 7, 7])
    assert not found.flows.back.any()
    assert np.isnan(found.flows.time_back).all()
    assert found.flows.time["all"] == pytest.approx((5 * 10 + 7 * 20) / 12)


def test_a_street_against_its_line_carries_traffic_back():
    streets, problems = read_network(layer([[(0, 0), (100, 0)]], oneway=["-1"]))
    found = assign(streets, between_nodes(streets, {(1, 0): 5.0, (0, 1): 3.0}))
    start = int(np.argmin(streets.nodes[:, 0]))
    assert streets.direction.tolist() == [-1]
    assert found.flows.unserved == (3.0 if start == 0 else 5.0)
    assert found.flows.ahead.tolist() == [0.0]
    assert len(problems)


def test_trips_to_an_island_are_told_as_unserved():
    streets = network(4, [(0, 1), (2, 3)], [10, 10], one_way=False)
    found = assign(streets, between_nodes(streets, {(0, 1): 5.0, (0, 3): 2.0, (2, 3): 1.0}))
    assert found.flows.unserved == 2.0
    assert found.loads.missed.tolist() == [2.0, 0.0, 0.0, 0.0]
    assert found.flows.trips["all"] == 6.0


def test_of_two_streets_between_the_same_ends_the_quicker_one_is_taken():
    streets = network(2, [(0, 1), (0, 1), (0, 1)], [30, 10, 20])
    found = assign(streets, between_nodes(streets, {(0, 1): 9.0}))
    assert found.flows.ahead.tolist() == [0.0, 9.0, 0.0]
    assert found.flows.time_ahead == pytest.approx([30, 10, 20])


def test_symmetric_trips_on_two_way_streets_are_as_long_there_as_back():
    streets, _ = read_network(grid(4, 3))
    demand = read_demand(streets, rules=DemandRules(shares={"interior-interior": 1.0}))
    assert demand.total == pytest.approx(demand.total.T)
    there = assign(streets, Demand(demand.places, {"all": np.triu(demand.total)})).flows
    back = assign(streets, Demand(demand.places, {"all": np.tril(demand.total)})).flows
    assert there.trips["all"] > 0
    assert there.trips["all"] == pytest.approx(back.trips["all"])
    # Of ways of one length another may be taken back, so flows may differ, not what they add to.
    for one, other in ((there.distance, back.distance), (there.time, back.time)):
        assert one["all"] == pytest.approx(other["all"])


def test_the_same_twice_is_the_same_bit_for_bit():
    one, other = (assign(*case) for case in (random_case(7), random_case(7)))
    assert np.array_equal(one.loads.flow, other.loads.flow)
    assert np.array_equal(one.flows.ahead, other.flows.ahead)


def test_zero_trips_are_no_error():
    streets = network(2, [(0, 1)], [10])
    found = assign(streets, between_nodes(streets, {(0, 1): 0.0}))
    assert found.flows.trips["all"] == 0.0
    assert np.isnan(found.flows.time["all"])


def test_a_cancel_stops_it():
    class Cancelled(Silent):
        def cancelled(self):
            return True

    streets = network(2, [(0, 1)], [10])
    with pytest.raises(CancelledError):
        assign(streets, between_nodes(streets, {(0, 1): 1.0}), Cancelled())


def test_places_on_a_loop_are_reached_the_short_way_round():
    loop = [(0, 50), (100, 50), (100, 150), (0, 150), (0, 50)]
    loop = layer([[(0, 0), (0, 50)], loop])
    streets, _ = read_network(loop)
    ring = int(np.argmax(streets.length))
    gate = int(np.argmin(streets.nodes[:, 1]))
    stem = 1 - ring
    places = Places(
        np.array([ring, ring, stem]), np.array([30.0, 390.0, 0.0]), np.array([-1, -1, gate]),
        np.array([0.5, 0.5, 0.0]), np.array(["", "", "out"], dtype=object),
    )  # fmt: skip
    trips = np.zeros((3, 3))
    trips[:2, 2] = 1.0
    found = assign(streets, Demand(places, {"interior-boundary": trips}))
    assert found.flows.distance["all"] == pytest.approx(50 + (30 + 10) / 2)


def test_a_lone_place_on_a_loop_may_go_round_either_way():
    loop = [(0, 0), (100, 0), (100, 100), (0, 100), (0, 0)]
    streets, _ = read_network(layer([loop, [(0, 0), (-50, 0)]]))
    ring = int(np.argmax(streets.length))
    gate = int(np.argmin(streets.nodes[:, 0]))
    places = Places(
        np.array([ring, 1 - ring]), np.array([390.0, 0.0]), np.array([-1, gate]),
        np.array([1.0, 0.0]), np.array(["", "out"], dtype=object),
    )  # fmt: skip
    found = assign(streets, Demand(places, {"interior-boundary": np.array([[0.0, 1.0], [0, 0]])}))
    assert found.flows.distance["all"] == pytest.approx(60)
    # Both ways round join the same two nodes: one of them has a node in its middle.
    assert cut_at_places(streets, places).nodes == len(streets.nodes) + 2


@pytest.mark.slow
def test_a_square_kilometre_takes_less_than_a_second():
    streets, _ = read_network(grid(12, 12, 83.0))
    demand = read_demand(streets)
    assert len(demand.places.piece) > 250
    start = time.perf_counter()
    assign(streets, demand)
    assert time.perf_counter() - start < allowed(1.0)
