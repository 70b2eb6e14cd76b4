"""Equilibrium on published instances with known flows, and by Wardrop's condition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.progress import Silent
from platwright.traffic.equilibrium import EquilibriumRules, equilibrium
from platwright.traffic.types import Demand
from trafficworld import between_nodes, network, surplus

#: Links of Sioux Falls, from (first node) to, with capacity (vehicles per hour), free time
#: (minutes) and the flow of the best known equilibrium: LeBlanc, Morlok and Pierskalla 1975, as
#: published by the Transportation Networks for Research Core Team
#: (github.com/bstabler/TransportationNetworks, SiouxFalls_net.tntp and SiouxFalls_flow.tntp).
SIOUX_FALLS = """
1 2 25900.20064 6 4494.657646
1 3 23403.47319 4 8119.079948
2 1 25900.20064 6 4519.079948
2 6 4958.180928 5 5967.336396
3 1 23403.47319 4 8094.657646
3 4 17110.52372 4 14006.371020
3 12 23403.47319 4 10022.319346
4 3 17110.52372 4 14030.564879
4 5 17782.7941 2 18006.371020
4 11 4908.82673 6 5200.000000
5 4 17782.7941 2 18030.564879
5 6 4947.995469 4 8798.267632
5 9 10000 5 15780.780520
6 2 4958.180928 5 5991.758697
6 5 4947.995469 4 8806.498678
6 8 4898.587646 2 12492.926150
7 8 7841.81131 3 12101.538520
7 18 23403.47319 2 15794.012490
8 6 4898.587646 2 12525.579500
8 7 7841.81131 3 12040.894240
8 9 5050.193156 10 6882.664920
8 16 5045.822583 5 8388.713230
9 5 10000 5 15796.741480
9 8 5050.193156 10 6836.704750
9 10 13915.78842 3 21744.093810
10 9 13915.78842 3 21814.076370
10 11 10000 5 17726.623640
10 15 13512.00155 6 23125.816450
10 16 4854.917717 4 11047.101940
10 17 4993.510694 8 8100.000000
11 4 4908.82673 6 5300.000000
11 10 10000 5 17604.216400
11 12 4908.82673 6 8365.284790
11 14 4876.508287 4 9776.133580
12 3 23403.47319 4 9973.705060
12 11 4908.82673 6 8404.863930
12 13 25900.20064 3 12287.623700
13 12 25900.20064 3 12378.588430
13 24 5091.256152 4 11121.370130
14 11 4876.508287 4 9814.084450
14 15 5127.526119 5 9036.331890
14 23 4924.790605 4 8400.262480
15 10 13512.00155 6 23192.330270
15 14 5127.526119 5 9079.828310
15 19 14564.75315 3 19083.285190
15 22 9599.180565 3 18409.902390
16 8 5045.822583 5 8406.671110
16 10 4854.917717 4 11072.955100
16 17 5229.910063 2 11694.998940
16 18 19679.89671 3 15278.336220
17 10 4993.510694 8 8100.000000
17 16 5229.910063 2 11683.837930
17 19 4823.950831 2 9953.064690
18 7 23403.47319 2 15854.656770
18 16 19679.89671 3 15333.402780
18 20 23403.47319 4 18976.767980
19 15 14564.75315 3 19116.716670
19 17 4823.950831 2 9941.905480
19 20 5002.607563 4 8688.326330
20 18 23403.47319 4 18992.477910
20 19 5002.607563 4 8710.661860
20 21 5059.91234 6 6302.028310
20 22 5075.697193 5 7000.000000
21 20 5059.91234 6 6239.960310
21 22 5229.910063 2 8619.540600
21 24 4885.357564 3 10309.421440
22 15 9599.180565 3 18386.483220
22 20 5075.697193 5 7000.000000
22 21 5229.910063 2 8607.408690
22 23 5000 4 9661.787310
23 14 4924.790605 4 8394.876360
23 22 5000 4 9626.235060
23 24 5078.508436 2 7902.986960
24 13 5091.256152 4 11112.395590
24 21 4885.357564 3 10259.524720
24 23 5078.508436 2 7861.793020
"""
#: Trips between its 24 nodes in hundreds of vehicles, from the node of the row.
SIOUX_TRIPS = """
0 1 1 5 2 3 5 8 5 13 5 2 5 3 5 5 4 1 3 3 1 4 3 1
1 0 1 2 1 4 2 4 2 6 2 1 3 1 1 4 2 0 1 1 0 1 0 0
1 1 0 2 1 3 1 2 1 3 3 2 1 1 1 2 1 0 0 0 0 1 1 0
5 2 2 0 5 4 4 7 7 12 14 6 6 5 5 8 5 1 2 3 2 4 5 2
2 1 1 5 0 2 2 5 8 10 5 2 2 1 2 5 2 0 1 1 1 2 1 0
3 4 3 4 2 0 4 8 4 8 4 2 2 1 2 9 5 1 2 3 1 2 1 1
5 2 1 4 2 4 0 10 6 19 5 7 4 2 5 14 10 2 4 5 2 5 2 1
8 4 2 7 5 8 10 0 8 16 8 6 6 4 6 22 14 3 7 9 4 5 3 2
5 2 1 7 8 4 6 8 0 28 14 6 6 6 9 14 9 2 4 6 3 7 5 2
13 6 3 12 10 8 19 16 28 0 40 20 19 21 40 44 39 7 18 25 12 26 18 8
5 2 3 15 5 4 5 8 14 39 0 14 10 16 14 14 10 1 4 6 4 11 13 6
2 1 2 6 2 2 7 6 6 20 14 0 13 7 7 7 6 2 3 4 3 7 7 5
5 3 1 6 2 2 4 6 6 19 10 13 0 6 7 6 5 1 3 6 6 13 8 8
3 1 1 5 1 1 2 4 6 21 16 7 6 0 13 7 7 1 3 5 4 12 11 4
5 1 1 5 2 2 5 6 10 40 14 7 7 13 0 12 15 2 8 11 8 26 10 4
5 4 2 8 5 9 14 22 14 44 14 7 6 7 12 0 28 5 13 16 6 12 5 3
4 2 1 5 2 5 10 14 9 39 10 6 5 7 15 28 0 6 17 17 6 17 6 3
1 0 0 1 0 1 2 3 2 7 2 2 1 1 2 5 6 0 3 4 1 3 1 0
3 1 0 2 1 2 4 7 4 18 4 3 3 3 8 13 17 3 0 12 4 12 3 1
3 1 0 3 1 3 5 9 6 25 6 5 6 5 11 16 17 4 12 0 12 24 7 4
1 0 0 2 1 1 2 4 3 12 4 3 6 4 8 6 6 1 4 12 0 18 7 5
4 1 1 4 2 2 5 5 7 26 11 7 13 12 26 12 17 3 12 24 18 0 21 11
3 0 1 5 1 1 2 3 5 18 13 7 8 11 10 5 6 1 3 7 7 21 0 7
1 0 0 2 0 1 1 2 2 8 6 5 7 4 4 3 3 0 1 4 5 11 7 0
"""


def sioux_falls():
    rows = np.array([line.split() for line in SIOUX_FALLS.split("\n") if line], dtype=float)
    streets = network(24, rows[:, :2].astype(int) - 1, rows[:, 3] * 60, rows[:, 2])
    trips = np.array([line.split() for line in SIOUX_TRIPS.split("\n") if line], dtype=float) * 100
    table = {(i, j): trips[i, j] for i in range(24) for j in range(24)}
    return streets, between_nodes(streets, table), rows[:, 4]


def test_sioux_falls_has_the_published_equilibrium():
    streets, demand, published = sioux_falls()
    assert demand.total.sum() == 360_600
    found = equilibrium(streets, demand, EquilibriumRules(gap=1e-5))
    assert found.gap <= 1e-5
    assert found.flows.ahead == pytest.approx(published, rel=0.01)
    # Total travel time, minutes, of the best known solution.
    spent = float(found.flows.ahead @ found.flows.time_ahead) / 60
    assert spent == pytest.approx(7_480_225, rel=1e-4)


def braess(*, bridge):
    """Braess, Ueber ein Paradoxon aus der Verkehrsplanung, 1968, with delays of power 1.

    Free times of 1 and 50 s, curves t = 1 + 10 x and 50 + x, 6 vehicles; the bridge 10 + x.
    """
    links = [(0, 1), (0, 2), (1, 3), (2, 3)] + ([(1, 2)] if bridge else [])
    free = np.array([1e-3, 50.0, 50.0, 1e-3] + ([10.0] if bridge else []))
    rise = np.array([10.0, 1.0, 1.0, 10.0] + ([1.0] if bridge else []))
    # t = free (1 + alpha x / capacity) with alpha 1.
    streets = network(4, links, free, free / rise)
    return streets, between_nodes(streets, {(0, 3): 6.0})


@pytest.mark.parametrize(
    ("bridge", "flows", "seconds"),
    [(False, [3, 3, 3, 3], 83.0), (True, [4, 2, 2, 4, 2], 92.0)],
)
def test_braess_paradox(bridge, flows, seconds):
    streets, demand = braess(bridge=bridge)
    found = equilibrium(streets, demand, EquilibriumRules(alpha=1, beta=1, gap=1e-9))
    assert found.flows.ahead == pytest.approx(flows, abs=1e-3)
    assert found.flows.time["all"] == pytest.approx(seconds, abs=0.02)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6))
def test_nobody_has_a_quicker_way_and_nobody_is_lost(seed):
    draw = np.random.default_rng(seed)
    count = 8
    pairs = [(i, j) for i in range(count) for j in range(count) if i != j]
    ring = [(i, (i + 1) % count) for i in range(count)]
    links = ring + [pairs[k] for k in draw.choice(len(pairs), 14, replace=False)]
    streets = network(
        count, links, draw.uniform(5, 60, len(links)), draw.uniform(50, 400, len(links))
    )
    table = {pairs[k]: float(draw.uniform(20, 300)) for k in draw.choice(len(pairs), 10, False)}
    demand = between_nodes(streets, table)
    found = equilibrium(streets, demand, EquilibriumRules(gap=1e-5, rounds=3000))
    out, asked = surplus(found.sections, found.loads, demand)
    np.testing.assert_allclose(out, asked, atol=1e-6)
    assert found.gap <= 1e-5
    # Wardrop, by networkx on the times that came out: what all spend is what quickest ways take.
    import networkx as nx

    graph = nx.MultiDiGraph()
    for (u, v), seconds in zip(streets.ends.tolist(), found.flows.time_ahead):
        graph.add_edge(u, v, seconds=float(seconds))
    least = sum(
        vehicles * nx.dijkstra_path_length(graph, u, v, weight="seconds")
        for (u, v), vehicles in table.items()
    )
    spent = float(found.flows.ahead @ found.flows.time_ahead)
    assert spent >= least - 1e-6 * least
    assert (spent - least) / spent <= 1.1e-5


def test_little_traffic_takes_the_quickest_ways():
    streets = network(3, [(0, 1), (1, 2), (0, 2)], [10, 10, 30], [1e6] * 3)
    found = equilibrium(streets, between_nodes(streets, {(0, 2): 5.0}))
    assert found.flows.ahead == pytest.approx([5, 5, 0])
    assert found.flows.time["all"] == pytest.approx(20)


def test_a_cancel_keeps_the_best_flows():
    class After(Silent):
        def __init__(self, questions):
            self.left, self.warned = questions, []

        def cancelled(self):
            self.left -= 1
            return self.left < 0

        def warn(self, text):
            self.warned.append(text)

    streets, demand, _ = sioux_falls()
    progress = After(6)
    found = equilibrium(streets, demand, EquilibriumRules(gap=1e-8), progress)
    assert 1e-8 < found.gap < 1
    assert progress.warned
    out, asked = surplus(found.sections, found.loads, demand)
    np.testing.assert_allclose(out, asked, atol=1e-5)
    with pytest.raises(CancelledError):
        equilibrium(streets, demand, progress=After(0))


def test_no_trips_are_in_equilibrium():
    streets = network(2, [(0, 1)], [10])
    places = between_nodes(streets, {(0, 1): 1.0}).places
    found = equilibrium(streets, Demand(places, {"boundary-boundary": np.zeros((2, 2))}))
    assert found.gap == 0.0


@pytest.mark.parametrize("wrong", [{"alpha": -1}, {"beta": 0.5}, {"gap": 0.0}, {"rounds": 0}])
def test_rules_out_of_range_are_refused(wrong):
    streets = network(2, [(0, 1)], [10])
    with pytest.raises(InputError):
        equilibrium(streets, between_nodes(streets, {(0, 1): 1.0}), EquilibriumRules(**wrong))
