"""The real simulator on small streets: against free flow, shortest ways and bookkeeping."""

from __future__ import annotations

import dataclasses
import itertools

import networkx as nx
import numpy as np
import pytest
from platwright.errors import InputError
from platwright.traffic.sumo import ROUTES, SimulationOptions, simulate
from platwright.traffic.types import (
    BOUNDARY_BOUNDARY,
    INTERIOR_BOUNDARY,
    INTERIOR_INTERIOR,
    Demand,
)

ONCE = SimulationOptions(routes="shortest", warm_up=5.0, seed=4)
#: A way of three pieces with a branch at each inner node: there is one way between any two ends.
TREE = [(0, 0), (300, 0), (600, 0), (900, 0), (300, 250), (600, -200)]
BRANCHES = [(0, 1), (1, 2), (2, 3), (1, 4), (2, 5)]


def graph_of(network):
    """Return the streets as a directed graph with metres and seconds; independent of the code."""
    graph = nx.DiGraph()
    for (one, other), way, line, speed in zip(
        network.ends, network.direction, network.lines, network.speed
    ):
        for tail, head, closed in ((one, other, way == -1), (other, one, way == 1)):
            if not closed:
                graph.add_edge(int(tail), int(head), length=line.length, time=line.length / speed)
    return graph


@pytest.mark.usefixtures("sumo")
@pytest.mark.parametrize("routes", ROUTES)
def test_the_only_way_has_its_length_and_takes_about_the_free_time(
    make_streets, make_demand, routes
):
    network = make_streets(TREE, BRANCHES, speed=[14.0, 14.0, 14.0, 8.0, 8.0])
    graph = graph_of(network)
    options = dataclasses.replace(ONCE, routes=routes, iterations=2)
    for one, other in ((0, 3), (4, 5), (5, 0)):
        demand = make_demand({(0, 1): 40.0}, gates=[one, other], kind=BOUNDARY_BOUNDARY)
        found = simulate(network, demand, options)
        length = nx.dijkstra_path_length(graph, one, other, "length")
        free = nx.dijkstra_path_length(graph, one, other, "time")
        flows = found.flows
        # turns cut corners, and a vehicle begins with its back at the node: 5 m
        assert length - 30.0 < flows.distance[BOUNDARY_BOUNDARY] < length + 10.0
        fastest = (length - flows.distance[BOUNDARY_BOUNDARY]) / 8.0
        assert free - fastest <= flows.time[BOUNDARY_BOUNDARY] <= 2.0 * free
        assert found.finished == pytest.approx(
            {**dict.fromkeys(found.finished, np.nan), BOUNDARY_BOUNDARY: 1.0, "all": 1.0},
            nan_ok=True,
        )
        assert found.flows.trips["all"] == pytest.approx(40.0, abs=10.0)
        assert np.isnan(flows.time[INTERIOR_INTERIOR])


@pytest.mark.usefixtures("sumo")
def test_who_is_there_already_has_arrived_without_a_way(make_streets, make_demand):
    network = make_streets([(0, 0), (4, 0), (304, 0)], [(0, 1), (1, 2)])
    # on so short a piece the place is the gate itself
    demand = make_demand({(0, 1): 60.0, (2, 1): 60.0}, interior=[(0, 1.0)], gates=[0, 2])
    found = simulate(network, demand, ONCE)
    half = simulate(network, make_demand({(0, 1): 60.0}, gates=[2, 0]), ONCE)
    assert found.counts.nowhere > 0
    assert found.finished["all"] == 1.0
    assert found.flows.trips["all"] == pytest.approx(120.0, abs=20.0)
    way = half.flows.distance["all"]
    assert found.flows.distance["all"] == pytest.approx(way / 2, rel=0.1)


@pytest.mark.usefixtures("sumo")
def test_flows_are_those_of_the_trips_on_the_way_and_none_elsewhere(make_streets, make_demand):
    network = make_streets(TREE, BRANCHES)
    demand = make_demand({(0, 1): 300.0}, gates=[4, 3])
    flows = simulate(network, demand, ONCE).flows
    assert flows.back[3] == pytest.approx(300.0, rel=0.12)
    assert flows.ahead[[1, 2]] == pytest.approx([300.0, 300.0], rel=0.12)
    assert flows.ahead[[0, 3, 4]] == pytest.approx([0.0, 0.0, 0.0])
    assert flows.back[[0, 1, 2, 4]] == pytest.approx([0.0] * 4)
    # what is not used takes its free time
    assert flows.time_ahead[0] == pytest.approx(30.0)
    assert flows.time_ahead[1] >= 30.0


@pytest.mark.usefixtures("sumo")
def test_interior_trips_begin_and_end_at_their_places(make_streets, make_demand):
    network = make_streets([(0, 0), (800, 0)], [(0, 1)])
    demand = make_demand({(0, 1): 60.0}, [(0, 200.0), (0, 500.0)])
    found = simulate(network, demand, ONCE)
    # the front of a vehicle of 5 m, whose back is at the place
    assert found.flows.distance[INTERIOR_INTERIOR] == pytest.approx(295.0, abs=2.0)
    # starting from rest costs some seconds
    assert 30.0 < found.flows.time[INTERIOR_INTERIOR] < 40.0
    # three eighths of the piece are used
    assert found.flows.ahead[0] == pytest.approx(60.0 * 3 / 8, rel=0.2)
    assert found.flows.back[0] == 0.0


@pytest.mark.usefixtures("sumo")
def test_one_way_streets_are_driven_one_way(make_streets, make_demand):
    square = [(0, 0), (200, 0), (200, 200), (0, 200)]
    ring = make_streets(square, [(0, 1), (2, 1), (2, 3), (3, 0)], direction=[1, -1, 1, 1])
    back_again = make_demand({(0, 1): 60.0}, gates=[1, 0])
    found = simulate(ring, back_again, ONCE)
    assert found.flows.distance["all"] == pytest.approx(600.0, abs=30.0)
    assert (found.flows.ahead[[2, 3]] > 0).all()
    assert found.flows.back[1] > 0
    assert found.flows.ahead[[0, 1]] == pytest.approx([0.0, 0.0])


@pytest.mark.usefixtures("sumo")
def test_trips_without_a_way_are_counted_and_the_others_are_driven(make_streets, make_demand):
    network = make_streets([(0, 0), (200, 0), (0, 900), (200, 900)], [(0, 1), (2, 3)])
    demand = make_demand({(0, 1): 60.0, (0, 2): 20.0, (3, 0): 8.0}, gates=[0, 1, 2, 3])
    found = simulate(network, demand, ONCE)
    lost = found.counts.unserved
    assert lost == pytest.approx(28.0 * 65 / 60, abs=2.0)
    assert found.lost.sum() == lost
    assert set(np.flatnonzero(found.lost)) == {0, 3}
    assert found.flows.unserved == pytest.approx(28.0, abs=12.0)
    assert found.counts.arrived == found.counts.drawn - lost
    with pytest.raises(InputError, match=r"None of the 3[23] trips finds a way"):
        simulate(network, make_demand({(0, 1): 30.0}, gates=[0, 3]), ONCE)


@pytest.mark.usefixtures("sumo")
def test_the_minor_street_waits_and_the_major_does_not(make_streets, make_demand):
    cross = [(0, 0), (-400, 0), (400, 0), (0, -400), (0, 400)]
    network = make_streets(cross, [(1, 0), (0, 2), (3, 0), (0, 4)], level=[1, 1, 3, 3])
    demand = make_demand({(0, 1): 700.0, (2, 3): 200.0}, gates=[1, 2, 3, 4])
    found = simulate(network, demand, ONCE)
    assert found.waiting_ahead[0] < 0.2
    assert found.waiting_ahead[2] > 1.0
    assert found.loss_ahead[2] > found.loss_ahead[0] + 1.0
    assert found.speed_ahead[2] < found.speed_ahead[0]
    assert np.isnan(found.speed_back).all()


@pytest.mark.usefixtures("sumo")
@pytest.mark.parametrize("rate", [150.0, 8000.0])
@pytest.mark.parametrize("routes", ["shortest", "rerouting"])
def test_no_vehicle_is_lost_and_none_is_counted_twice(make_grid, rate, routes):
    network, demand = make_grid(4, rate)
    options = SimulationOptions(hours=0.25, warm_up=5.0, clearing=0.0, routes=routes, patience=60.0)
    found = simulate(network, demand, options)
    counts = found.counts
    assert counts.drawn == pytest.approx(rate / 3.0, abs=1.0)
    assert counts.drawn == counts.nowhere + counts.unserved + counts.waiting + counts.inserted
    assert counts.inserted == counts.running + counts.arrived
    assert counts.unserved == counts.nowhere == counts.collisions == 0
    assert min(dataclasses.astuple(counts)) >= 0
    if rate > 1000.0:
        # as much as this cannot be driven there
        assert counts.running > 10
        assert counts.waiting > 10
        assert found.finished["all"] < 0.95
        assert len(found.teleports) == counts.teleports
        assert found.delay["all"] > 5.0
    else:
        assert found.finished["all"] > 0.8


@pytest.mark.usefixtures("sumo")
@pytest.mark.parametrize("routes", ROUTES)
def test_the_same_seed_gives_the_same_traffic(make_grid, routes):
    network, demand = make_grid(4, 400.0)
    options = SimulationOptions(hours=0.25, warm_up=0.0, routes=routes, iterations=3, seed=7)
    one, same = (simulate(network, demand, options) for _ in range(2))
    other = simulate(network, demand, dataclasses.replace(options, seed=8))
    for name in ("speed_ahead", "waiting_back", "loss_ahead"):
        assert np.array_equal(getattr(one, name), getattr(same, name), equal_nan=True)
    assert np.array_equal(one.flows.ahead, same.flows.ahead)
    assert one.flows.time == pytest.approx(same.flows.time, rel=0, abs=0, nan_ok=True)
    assert one.history == same.history
    assert one.counts == same.counts
    assert not np.array_equal(one.flows.ahead, other.flows.ahead)


@pytest.mark.usefixtures("sumo")
def test_iterations_find_ways_around_a_bottleneck(make_streets, make_demand):
    """Two ways: the shorter one must give way to heavy traffic, the longer one need not."""
    nodes = [(0, 0), (400, 0), (800, 0), (400, -300), (400, 300), (400, 600), (-200, 0)]
    pieces = [(0, 1), (1, 2), (3, 1), (1, 4), (0, 5), (5, 2), (6, 0)]
    network = make_streets(nodes, pieces, level=[4, 4, 1, 1, 3, 3, 3], speed=14.0)
    trips = {(0, 1): 400.0, (2, 3): 900.0}
    demand = make_demand(trips, gates=[6, 2, 3, 4])
    shortest = simulate(network, demand, ONCE)
    iterated = simulate(network, demand, dataclasses.replace(ONCE, routes="iterated", iterations=4))
    assert shortest.flows.ahead[4] == 0.0
    assert iterated.flows.ahead[4] > 20.0
    assert iterated.flows.time["all"] < shortest.flows.time["all"]
    assert len(iterated.history) == 4
    assert iterated.history[0] == pytest.approx(shortest.history[0])


@pytest.mark.usefixtures("sumo")
def test_loops_short_streets_and_doubles_are_driven(make_streets, make_demand):
    ring = [(200, 0), (300, 0), (300, 90), (200, 90), (200, 0)]
    bow = [(200, 0), (100, 60), (0, 0)]
    nodes = [(0, 0), (200, 0), (203, 1), (340, -80)]
    network = make_streets(nodes, [(0, 1), (1, 1), (1, 0), (1, 2), (2, 3)], lines={1: ring, 2: bow})
    demand = make_demand(
        {(0, 1): 40.0, (1, 2): 40.0, (2, 0): 40.0}, [(0, 100.0), (1, 190.0), (4, 120.0)]
    )
    found = simulate(network, demand, ONCE)
    assert found.counts.arrived == found.counts.drawn
    assert found.flows.ahead[4] + found.flows.back[4] > 60.0
    # all of them drive the 3 m between, and no more; beyond they drive 120 m
    share = 120.0 / network.length[4]
    assert found.flows.ahead[3] * share == pytest.approx(found.flows.ahead[4], abs=2.0)
    assert found.flows.back[3] * share == pytest.approx(found.flows.back[4], abs=2.0)
    assert found.flows.ahead[1] + found.flows.back[1] > 40.0


@pytest.mark.usefixtures("sumo")
def test_vehicles_turn_round_only_at_dead_ends(make_streets, make_demand):
    """Against a one-way way in, one must go on to the end of the street and come back."""
    nodes = [(0, 0), (200, 0), (400, 0), (200, 200)]
    network = make_streets(nodes, [(0, 1), (1, 2), (1, 3)], direction=[0, 0, 0])
    there = simulate(network, make_demand({(0, 1): 40.0}, gates=[0, 3]), ONCE)
    assert there.flows.ahead[1] == 0.0
    # from the node before the junction straight back: the vehicle starts in either direction
    back = simulate(network, make_demand({(0, 1): 40.0}, [(0, 150.0)], gates=[0]), ONCE)
    assert back.flows.distance["all"] == pytest.approx(145.0, abs=5.0)
    assert back.flows.ahead[1] == 0.0


@pytest.mark.usefixtures("sumo")
def test_distances_differ_little_from_centre_lines(make_grid):
    """What junctions cost: the mean of all trips on a grid against its centre lines."""
    network, demand = make_grid(5, 300.0)
    pairs = nx.Graph()
    for piece, (one, other) in enumerate(network.ends):
        if network.level[piece] > 1:
            pairs.add_edge(int(one), ("place", piece), length=50.0)
            pairs.add_edge(("place", piece), int(other), length=50.0)
        else:
            pairs.add_edge(int(one), int(other), length=100.0)
    places = [("place", int(piece)) for piece in demand.places.piece]
    shortest = dict(nx.all_pairs_dijkstra_path_length(pairs, weight="length"))
    mean = np.mean([shortest[a][b] for a, b in itertools.permutations(places, 2)])
    found = simulate(network, demand, ONCE)
    assert found.flows.distance["all"] == pytest.approx(mean, rel=0.05)


@pytest.mark.usefixtures("sumo")
def test_demand_that_does_not_fit_and_a_short_time_limit_are_told(make_grid):
    network, demand = make_grid(4, 3000.0)
    wrong = Demand(demand.places, {INTERIOR_BOUNDARY: np.ones((2, 2))})
    with pytest.raises(InputError, match="does not fit its places"):
        simulate(network, wrong)
    with pytest.raises(InputError, match="not done after 1 s"):
        simulate(network, demand, SimulationOptions(hours=10.0, time_limit=1.0))


@pytest.mark.usefixtures("sumo")
@pytest.mark.parametrize("left_hand", [False, True])
def test_one_drives_on_the_side_that_is_asked_for(make_streets, make_demand, left_hand):
    """At a T of equals the turn across the other traffic waits, that on the near side does not."""
    nodes = [(0, 0), (-400, 0), (400, 0), (0, -400)]
    network = make_streets(nodes, [(1, 0), (0, 2), (0, 3)], level=[1, 1, 3])
    # heavy traffic from east to west, and turns into the side street from the west
    demand = make_demand({(1, 0): 900.0, (0, 2): 150.0}, gates=[1, 2, 3])
    options = dataclasses.replace(ONCE, left_hand=left_hand)
    found = simulate(network, demand, options)
    assert found.counts.collisions == 0
    # the side street is on the right of those who come from the west
    if left_hand:
        assert found.loss_ahead[0] > 4.0
    else:
        assert found.loss_ahead[0] < 4.0


@pytest.mark.usefixtures("sumo")
def test_two_lanes_carry_more_than_one(make_grid):
    options = SimulationOptions(
        hours=0.25, warm_up=5.0, clearing=0.0, routes="shortest", patience=60.0
    )
    arrived = [
        simulate(*make_grid(4, 5000.0, lanes=lanes), options).counts.arrived for lanes in (1, 2)
    ]
    assert arrived[1] > 1.2 * arrived[0]


@pytest.mark.usefixtures("sumo")
def test_inputs_are_never_modified(make_grid):
    network, demand = make_grid(4, 300.0)
    before = [np.array(getattr(network, name)) for name in ("nodes", "ends", "speed")]
    trips = {kind: array.copy() for kind, array in demand.trips.items()}
    shapes = [line.wkb for line in network.lines]
    simulate(network, demand, ONCE)
    for name, was in zip(("nodes", "ends", "speed"), before):
        assert np.array_equal(getattr(network, name), was)
    assert all(np.array_equal(demand.trips[kind], trips[kind]) for kind in trips)
    assert [line.wkb for line in network.lines] == shapes
