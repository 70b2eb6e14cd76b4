"""How much travels from where to where, counted by hand."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.site.repair import Problems
from platwright.traffic.demand import DemandLayers, DemandRules, place_points, read_demand
from platwright.traffic.network import read_network
from platwright.traffic.types import KINDS
from shapely.geometry import LineString, Point, box
from trafficworld import grid, layer, moved, sites

OUT, IN, WITHIN, THROUGH = KINDS
#: A site of 1 km by 500 m with a street through its middle from edge to edge.
SITE = sites(box(0, 0, 1000, 500))
STREET = layer([[(0, 250), (1000, 250)]])
GATES = sites(Point(0, 250), Point(1000, 250), name=["West", "East"])


def demand_of(streets=STREET, rules=None, problems=None, **given_layers):
    network, _ = read_network(streets)
    layers = DemandLayers(**{"site": SITE, **given_layers})
    return network, read_demand(network, layers, rules or DemandRules(), problems)


def test_the_density_is_that_of_the_area():
    _, demand = demand_of()
    assert demand.total.sum() == pytest.approx(250 * 0.5)
    assert {k: t.sum() for k, t in demand.trips.items()} == pytest.approx(
        {OUT: 50, IN: 50, WITHIN: 25}
    )
    assert demand.places.weight.sum() == pytest.approx(1)
    assert demand.places.weight[~demand.places.gates] == pytest.approx([1 / 20] * 20)


def test_trips_take_the_nearest_gate_or_all_gates():
    rules = DemandRules(shares={OUT: 1.0})
    _, near = demand_of(rules=rules, gates=GATES)
    gates = near.places.gates
    west, east = np.flatnonzero(gates)
    half = near.places.along[~gates] < 500
    assert near.total[np.flatnonzero(~gates)[half], west].sum() == pytest.approx(62.5)
    assert near.total[np.flatnonzero(~gates)[~half], west].sum() == 0
    _, every = demand_of(rules=DemandRules(shares={OUT: 1.0}, nearest_gate=False), gates=GATES)
    assert every.total[:, [west, east]].sum(axis=0) == pytest.approx([62.5, 62.5])
    assert near.places.name[gates].tolist() == ["West", "East"]


def test_one_way_streets_decide_the_nearest_gate_by_direction():
    streets = STREET.assign(oneway=["yes"])
    _, out = demand_of(streets, DemandRules(shares={OUT: 1.0}), gates=GATES)
    _, into = demand_of(streets, DemandRules(shares={IN: 1.0}), gates=GATES)
    west, east = np.flatnonzero(out.places.gates)
    assert out.total[:, east].sum() == pytest.approx(125)
    assert into.total[west].sum() == pytest.approx(125)


def test_within_no_trip_ends_where_it_begins():
    _, demand = demand_of(rules=DemandRules(shares={WITHIN: 1.0}))
    trips = demand.trips[WITHIN]
    assert not np.diag(trips).any()
    assert trips.sum() == pytest.approx(125)
    assert trips == pytest.approx(trips.T)


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 6), st.integers(1, 6), st.floats(20, 200))
def test_all_designs_of_a_site_have_the_same_traffic(columns, rows, part):
    streets = grid(columns, rows, 1000 / max(columns, rows, 2))
    _, demand = demand_of(streets, DemandRules(part_m=part))
    assert demand.total.sum() == pytest.approx(125)
    assert demand.places.weight.sum() == pytest.approx(1)
    assert (demand.total >= 0).all()


def test_ground_goes_to_the_nearest_street():
    # Two parallel streets a quarter and three quarters up, and one far outside.
    streets = layer(
        [[(0, 100), (1000, 100)], [(0, 300), (1000, 300)], [(0, 100), (0, 300)],
         [(0, 2000), (1000, 2000)]]
    )  # fmt: skip
    network, demand = demand_of(streets, DemandRules(shares={WITHIN: 1.0}))
    share = np.bincount(demand.places.piece, demand.places.weight, minlength=4)
    y = np.array([line.coords[0][1] - 5_500_000 for line in network.lines])
    upper = share[(y > 299) & (y < 301) & (network.length > 900)].sum()
    assert upper == pytest.approx(0.6, abs=0.01)
    assert share[y > 1000].sum() == 0


def test_streets_on_the_edge_do_not_serve_the_inside():
    ring = layer(
        [[(0, 0), (1000, 0), (1000, 500), (0, 500), (0, 250), (0, 0)], [(0, 250), (1000, 250)]],
        status=["existing", "new"],
    )
    network, demand = demand_of(ring)
    inner = ~demand.places.gates
    assert not network.existing[demand.places.piece[inner]].any()
    # Where the street meets the ring, which has a vertex there in the west only.
    assert demand.places.gates.sum() == 2


def test_without_a_site_the_hull_of_the_streets_counts():
    network, _ = read_network(grid(10, 10))
    demand = read_demand(network)
    assert demand.total.sum() == pytest.approx(250)
    assert demand.places.gates.sum() == 40


def test_weights_stand_in_for_the_area():
    houses = sites(Point(100, 300), Point(900, 200), flats=[3, 1])
    rules = DemandRules(shares={OUT: 1.0})
    network, demand = demand_of(rules=rules, weights=houses, weight_field="flats")
    inner = ~demand.places.gates
    assert demand.places.weight[inner].tolist() == [0.75, 0.25]
    points = place_points(network, demand.places)[inner]
    assert points[0].distance(moved(Point(100, 250))) < 1e-6
    assert points[1].distance(moved(Point(900, 250))) < 1e-6
    areas = sites(box(90, 290, 110, 310), box(890, 200, 900, 210))
    _, demand = demand_of(rules=rules, weights=areas)
    assert demand.places.weight[:2].tolist() == pytest.approx([0.8, 0.2])
    with pytest.raises(InputError, match="no field"):
        demand_of(weights=houses, weight_field="rooms")


def test_gates_far_from_streets_are_left_out_and_told():
    problems = Problems()
    gates = sites(Point(3, 252), Point(500, 0), name=["A", "B"])
    _, demand = demand_of(problems=problems, gates=gates)
    assert demand.places.name[demand.places.gates].tolist() == ["A"]
    assert problems.to_frame(SITE.crs)["feature"].tolist() == ["1"]
    with pytest.raises(InputError, match="no point within"):
        demand_of(gates=sites(Point(500, 0)))


def test_of_junctions_only_exits_are_gates():
    gates = sites(Point(0, 250), Point(1000, 250), is_sink=[False, True])
    _, demand = demand_of(gates=gates)
    assert demand.places.gates.sum() == 1


def test_traffic_between_gates_is_even_over_pairs():
    rules = DemandRules(density=0.0, through=1000.0)
    _, demand = demand_of(grid(2, 2, 250.0), rules, gates=sites(
        Point(0, 0), Point(500, 0), Point(0, 500)))  # fmt: skip
    assert list(demand.trips) == [THROUGH]
    trips = demand.total[demand.places.gates][:, demand.places.gates]
    assert trips == pytest.approx(1000 / 6 * (1 - np.eye(3)))


def test_flows_of_a_table_are_added():
    table = pd.DataFrame(
        {"from": ["west", "Interior", "east"], "to": ["EAST", "West", "interior"],
         "vehicles_h": [100, 40.0, "30"]}
    )  # fmt: skip
    rules = DemandRules(density=0.0)
    _, demand = demand_of(rules=rules, gates=GATES, flows=table)
    assert {k: t.sum() for k, t in demand.trips.items()} == pytest.approx(
        {OUT: 40, IN: 30, THROUGH: 100}
    )
    west, east = np.flatnonzero(demand.places.gates)
    assert demand.trips[THROUGH][west, east] == pytest.approx(100)


def test_zones_are_named_by_a_table():
    zones = sites(box(0, 0, 200, 500), box(800, 0, 1000, 500), name=["Old town", "Docks"])
    table = pd.DataFrame({"from": ["old town"], "to": ["docks"], "vehicles_h": [60]})
    rules = DemandRules(density=0.0)
    _, demand = demand_of(rules=rules, flows=table, zones=zones)
    trips = demand.trips[WITHIN]
    begin, end = np.nonzero(trips)
    assert trips.sum() == pytest.approx(60)
    assert demand.places.along[begin].max() <= 200
    assert demand.places.along[end].min() >= 800


def test_flows_along_lines_join_the_nearest_gates():
    lines = gpd.GeoDataFrame(
        {"vehicles_h": [70]}, geometry=[moved(LineString([(900, 300), (10, 10)]))], crs=32633
    )
    _, demand = demand_of(rules=DemandRules(density=0.0), gates=GATES, flows=lines.to_crs(4326))
    west, east = np.flatnonzero(demand.places.gates)
    assert demand.total[east, west] == pytest.approx(70)
    assert demand.total.sum() == pytest.approx(70)


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"from": ["west"], "to": ["nowhere"], "vehicles_h": [1]}, "no gate or zone 'nowhere'"),
        ({"from": ["west"], "to": ["east"]}, "no field 'vehicles_h'"),
        ({"from": ["west"], "to": ["east"], "vehicles_h": [-1]}, "no number of 0 or more"),
        ({"from": ["west"], "to": ["east"], "vehicles_h": ["many"]}, "no number of 0 or more"),
        ({"vehicles_h": [1]}, "neither the fields"),
    ],
)
def test_bad_tables_are_refused(table, text):
    with pytest.raises(InputError, match=text):
        demand_of(gates=GATES, flows=pd.DataFrame(table))


def test_a_flow_from_a_gate_to_itself_is_told():
    problems = Problems()
    table = pd.DataFrame({"from": ["west"], "to": ["west"], "vehicles_h": [9]})
    _, demand = demand_of(
        rules=DemandRules(density=0.0), problems=problems, gates=GATES, flows=table
    )
    assert demand.total.sum() == 0
    assert "same place" in problems.to_frame(SITE.crs)["problem"].iloc[0]


def test_what_cannot_be_is_refused():
    lonely = layer([[(300, 250), (700, 250)]])
    with pytest.raises(InputError, match="No gate"):
        demand_of(lonely)
    _, demand = demand_of(lonely, DemandRules(shares={WITHIN: 1.0}))
    assert demand.total.sum() == pytest.approx(125)
    with pytest.raises(InputError, match="No street lies in the site"):
        demand_of(site=sites(box(5000, 5000, 5100, 5100)))
    with pytest.raises(InputError, match="one line"):
        read_demand(read_network(STREET)[0])


@pytest.mark.parametrize(
    "wrong", [{"density": -1}, {"density": np.nan}, {"part_m": 0}, {"shares": {OUT: 0}},
              {"shares": {"walks": 1}}, {"through": np.inf}],
)  # fmt: skip
def test_rules_out_of_range_are_refused(wrong):
    with pytest.raises(InputError):
        demand_of(rules=DemandRules(**wrong))


def test_a_large_town_has_no_more_places_than_can_be_kept():
    from platwright.traffic.ground import MOST_PLACES

    network, _ = read_network(grid(35, 35))
    demand = read_demand(network)
    assert (~demand.places.gates).sum() <= MOST_PLACES
    assert demand.total.sum() == pytest.approx(250 * 3.5**2)
