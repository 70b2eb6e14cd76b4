"""A simulation on the map: features made of several pieces, and points of trouble."""

from __future__ import annotations

import dataclasses

import pytest
from platwright.traffic.sumo import (
    SimulationOptions,
    problem_points,
    simulate,
    street_columns,
)

ONCE = SimulationOptions(routes="shortest", warm_up=5.0, seed=4)


@pytest.mark.usefixtures("sumo")
def test_a_piece_has_the_flow_of_both_directions_and_their_mean_seconds(make_streets, make_demand):
    line = make_streets([(0, 0), (300, 0), (400, 0), (300, 100)], [(0, 1), (1, 2), (1, 3)])
    found = simulate(line, make_demand({(0, 1): 200.0, (1, 0): 100.0}, gates=[0, 2]), ONCE)
    table = street_columns(line, found)
    assert table["length_m"].tolist() == pytest.approx([300.0, 100.0, 100.0])
    assert table["flow_veh_h"].tolist() == pytest.approx([300.0, 300.0, 0.0], rel=0.1)
    assert table["flow_ahead"][0] == pytest.approx(200.0, rel=0.1)
    assert table["flow_back"][0] == pytest.approx(100.0, rel=0.1)
    assert table.loc[2, ["travel_kmh", "waiting_s", "loss_s"]].isna().all()
    # nobody drives faster than 10 m/s = 36 km/h, and nothing is in the way
    assert ((table["travel_kmh"][:2] > 28.0) & (table["travel_kmh"][:2] <= 36.0)).all()
    lost = 300.0 / (table["travel_kmh"][0] / 3.6) - 30.0
    assert table["loss_s"][0] == pytest.approx(lost, abs=1.0)
    assert table["waiting_s"][0] == pytest.approx(0.0, abs=0.5)


@pytest.mark.usefixtures("sumo")
def test_troubles_are_points_where_they_are(make_streets, make_demand):
    nodes = [(0, 0), (300, 0), (300, -250), (300, 250), (900, 900), (1000, 900)]
    network = make_streets(nodes, [(0, 1), (2, 1), (1, 3), (4, 5)], level=[4, 1, 1, 3])
    trips = {(0, 1): 600.0, (2, 1): 1700.0, (3, 0): 5.0}
    demand = make_demand(trips, gates=[0, 3, 2, 4])
    options = dataclasses.replace(ONCE, patience=60.0, clearing=10.0)
    found = simulate(network, demand, options)
    table = problem_points(network, demand.places, found, "streets")
    assert table.crs == network.crs
    assert set(table["layer"]) == {"streets"}
    near = {
        words: table[table["problem"].str.contains(words)]
        for words in ("find no way", "wait .* to enter", "moved them on")
    }
    assert [p.coords[0] for p in near["find no way"].geometry] == [tuple(network.nodes[4])]
    assert near["find no way"]["problem"].iloc[0].endswith(f": {found.counts.unserved}.")
    assert tuple(network.nodes[0]) in [p.coords[0] for p in near["wait .* to enter"].geometry]
    # the minor street gets no gap before the junction
    assert len(found.teleports) == found.counts.teleports > 0
    spots = {p.coords[0] for p in near["moved them on"].geometry}
    assert tuple(network.nodes[1]) in spots


@pytest.mark.usefixtures("sumo")
def test_no_trouble_is_an_empty_layer(make_streets, make_demand):
    network = make_streets([(0, 0), (300, 0)], [(0, 1)])
    demand = make_demand({(0, 1): 20.0}, gates=[0, 1])
    table = problem_points(network, demand.places, simulate(network, demand, ONCE), "streets")
    assert len(table) == 0
    assert list(table.columns) == [
        "layer", "feature", "problem", "action", "severity", "geometry",
    ]  # fmt: skip
