"""Names that given flows may use, and tables as large as origin-destination matrices."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from platwright.errors import CancelledError
from platwright.progress import Silent
from platwright.site.repair import Problems
from platwright.traffic.demand import DemandLayers, DemandRules, read_demand
from platwright.traffic.network import read_network
from platwright.traffic.types import KINDS
from shapely.geometry import Point, box
from trafficworld import grid, layer, sites

OUT, _IN, WITHIN, THROUGH = KINDS
#: A site of 1 km by 500 m with a street through its middle from edge to edge.
SITE = sites(box(0, 0, 1000, 500))
STREET = layer([[(0, 250), (1000, 250)]])


def demand_of(begin, end, streets=STREET, problems=None, **given):
    """Sixty vehicles an hour from one name to another, and nothing else."""
    table = pd.DataFrame({"from": [begin], "to": [end], "vehicles_h": [60.0]})
    layers = DemandLayers(**{"site": SITE, "flows": table, **given})
    network, _ = read_network(streets)
    return read_demand(network, layers, DemandRules(density=0.0), problems)


def along(demand, kind, axis):
    """Metres along the street of the places where trips begin (axis 0) or end (axis 1)."""
    return demand.places.along[np.unique(np.nonzero(demand.trips[kind])[axis])]


def test_zones_of_one_name_are_one_zone():
    shapes = box(0, 0, 200, 500), box(400, 0, 600, 500), box(800, 0, 1000, 500)
    demand = demand_of("a", "b", zones=sites(*shapes, name=["A", "A", "B"]))
    begin = along(demand, WITHIN, 0)
    assert begin.min() < 200
    assert begin.max() > 400
    west = demand.places.along < 300
    assert demand.total[west].sum() == pytest.approx(30)


def test_zones_and_gates_may_be_numbers_of_which_some_are_missing():
    # A missing number makes a column of decimals; gates without a name are numbered as well.
    shapes = box(0, 0, 200, 500), box(400, 0, 600, 500), box(800, 0, 1000, 500)
    problems = Problems()
    demand = demand_of("1", 2.0, zones=sites(*shapes, name=[1, 2, None]), problems=problems)
    assert list(demand.trips) == [WITHIN]
    assert along(demand, WITHIN, 0).max() < 200
    told = problems.to_frame(SITE.crs)["problem"]
    assert told.str.contains("also .* gate").sum() == 2
    gates = sites(Point(0, 250), Point(1000, 250), Point(1000, 251), name=[7, 8, None])
    demand = demand_of("7", "8", gates=gates)
    assert demand.places.name[demand.places.gates].tolist() == ["7", "8"]
    gates["name"] = pd.array([7, 8, None], dtype="Int64")
    assert demand_of("7", "8", gates=gates).trips[THROUGH].sum() == pytest.approx(60)


def test_a_gate_without_a_name_does_not_take_that_of_another():
    gates = sites(Point(0, 250), Point(1000, 250), name=["", "1"])
    demand = demand_of("1", "interior", gates=gates)
    west, east = np.flatnonzero(demand.places.gates)
    assert demand.places.name[west] != demand.places.name[east]
    assert demand.total[east].sum() == pytest.approx(60)


def test_gates_that_share_a_junction_keep_their_names():
    gates = sites(Point(0, 250), Point(2, 250), Point(1000, 250), name=["A", "B", "C"])
    for name in ("A", "b", "a / B"):
        demand = demand_of(name, "C", gates=gates)
        west, east = np.flatnonzero(demand.places.gates)
        assert demand.total[west, east] == pytest.approx(60)


def matrix(blocks):
    """A square kilometre of streets, its zones, and flows from each to each."""
    side = 1000 / blocks
    cells = [(i, j) for i in range(blocks) for j in range(blocks)]
    shapes = [box(i * side, j * side, (i + 1) * side, (j + 1) * side) for i, j in cells]
    names = [f"z{i}{j}" for i, j in cells]
    rows = [(a, b, 1.0 + k) for a in names for k, b in enumerate(names)]
    table = pd.DataFrame(rows, columns=["from", "to", "vehicles_h"])
    return DemandLayers(
        site=sites(box(0, 0, 1000, 1000)), zones=sites(*shapes, name=names), flows=table
    )


def test_a_matrix_gives_each_pair_of_zones_its_vehicles():
    layers = matrix(3)
    network, _ = read_network(grid(10, 10))
    demand = read_demand(network, layers, DemandRules(density=0.0))
    assert demand.total.sum() == pytest.approx(layers.flows["vehicles_h"].sum())
    assert not np.diag(demand.total).any()
    # Places on the border of two zones belong to both, so sums by zone hold for origins only
    # where no street runs along a border: thirds of 1 km do not fall on streets 100 m apart.
    points = np.array([
        network.lines[piece].interpolate(at).coords[0]
        for piece, at in zip(demand.places.piece, demand.places.along)
    ])  # fmt: skip
    x, y = ((points - (500_000, 5_500_000)) // (1000 / 3)).astype(int).T
    inner = ~demand.places.gates
    for i, j, name in ((0, 0, "z00"), (1, 2, "z12"), (2, 1, "z21")):
        own = inner & (x == i) & (y == j)
        asked = layers.flows.loc[layers.flows["from"] == name, "vehicles_h"].sum()
        assert demand.total[own].sum() == pytest.approx(asked)


def test_reading_a_matrix_can_be_cancelled():
    class Impatient(Silent):
        asked = 0

        def cancelled(self):
            self.asked += 1
            return self.asked > 20

    network, _ = read_network(grid(10, 10))
    progress = Impatient()
    with pytest.raises(CancelledError):
        read_demand(network, matrix(3), DemandRules(density=0.0), progress=progress)
    assert progress.asked == 21
