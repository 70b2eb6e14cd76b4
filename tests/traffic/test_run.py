"""From layers to traffic, with layers and numbers that must agree."""

from __future__ import annotations

import numpy as np
import pytest
from platwright.errors import CancelledError, InputError
from platwright.progress import Silent
from platwright.traffic.demand import DemandLayers, DemandRules
from platwright.traffic.run import TrafficOptions, assign_traffic
from platwright.traffic.types import KINDS
from shapely.geometry import Point, box
from trafficworld import grid, layer, sites

OUT, IN, WITHIN, THROUGH = KINDS
SITE = sites(box(0, 0, 400, 400))


def test_layers_and_numbers_agree():
    frame = grid(4, 4)
    frame["name"] = [f"street {k}" for k in range(len(frame))]
    before = frame.copy()
    rules = DemandRules(density=2000.0, through=300.0)
    report = assign_traffic(frame, DemandLayers(site=SITE), TrafficOptions(demand=rules))
    streets, numbers = report.streets, report.numbers
    assert frame.equals(before)
    assert list(streets["name"]) == [frame.loc[k, "name"] for k in streets.index]
    assert streets["flow_veh_h"].to_numpy() == pytest.approx(
        (streets["flow_ahead"] + streets["flow_back"]).to_numpy()
    )
    assert (streets["through_veh_h"] <= streets["flow_veh_h"] + 1e-9).all()
    assert numbers["vehicles"] == pytest.approx(2000 * 0.16 + 300)
    assert numbers["total_length"] == pytest.approx(4000)
    metres = (streets["flow_veh_h"] * streets["length_m"]).sum()
    assert numbers["vehicle_km"] == pytest.approx(metres / 1000)
    assert numbers["distance_mean"] == pytest.approx(metres / numbers["vehicles"])
    assert numbers["time_mean"] == pytest.approx(
        3600 * numbers["vehicle_hours"] / numbers["vehicles"]
    )
    assert streets["travel_kmh"].to_numpy() == pytest.approx(streets["free_kmh"].to_numpy())
    assert numbers["max_use"] == streets["v_c"].max()
    assert np.isnan(numbers["gap"])
    places = report.places
    assert places["from_veh_h"].sum() == pytest.approx(numbers["vehicles"])
    assert places["to_veh_h"].sum() == pytest.approx(numbers["vehicles"])
    assert (places["kind"] == "gate").sum() == numbers["gates"]


def test_the_way_out_of_a_street_is_counted_by_hand():
    # One street of 400 m along the middle, out at both ends: a quarter of its length on average.
    frame = layer([[(0, 200), (400, 200)]], speed_kmh=[36.0])
    rules = DemandRules(shares={OUT: 1.0}, part_m=5.0)
    report = assign_traffic(frame, DemandLayers(site=SITE), TrafficOptions(demand=rules))
    assert report.numbers["distance_out"] == pytest.approx(100, rel=0.01)
    assert report.numbers["time_out"] == pytest.approx(10, rel=0.01)
    # All 40 vehicles pass one of both ends; on average half of each half has joined.
    assert report.streets["flow_veh_h"].iloc[0] == pytest.approx(10, rel=0.01)
    assert report.streets["v_c"].iloc[0] == pytest.approx(20 / 500, rel=0.03)


def test_a_crowded_street_is_slower_and_traffic_goes_round():
    frame = layer(
        [[(0, 0), (0, 100)], [(0, 100), (200, 100)], [(0, 100), (0, 180), (200, 180), (200, 100)],
         [(200, 100), (200, 0)]], capacity=[9000, 500, 500, 9000], speed_kmh=[50.0] * 4,
    )  # fmt: skip
    gates = sites(Point(0, 0), Point(200, 0))
    rules = DemandRules(density=0.0, through=4000.0)
    layers = DemandLayers(site=sites(box(-50, -50, 250, 250)), gates=gates)
    free = assign_traffic(frame, layers, TrafficOptions(demand=rules))
    full = assign_traffic(frame, layers, TrafficOptions(demand=rules, method="equilibrium"))
    ways = [report.streets.set_index(report.streets.index)["flow_veh_h"] for report in (free, full)]
    assert ways[0].tolist() == pytest.approx([4000, 4000, 0, 4000])
    assert ways[1][1] + ways[1][2] == pytest.approx(4000)
    assert ways[1][2] > 500
    times = full.streets["time_s"]
    assert times[1] == pytest.approx(times[2], rel=0.01)
    assert full.streets["travel_kmh"][1] < 40
    assert full.numbers["gap"] <= 1e-4
    assert full.numbers["time_mean"] > free.numbers["time_mean"]


def test_unserved_trips_are_told_where_they_begin():
    frame = layer([[(0, 100), (400, 100)], [(100, 300), (300, 300)]])
    report = assign_traffic(frame, DemandLayers(site=SITE))
    texts = " ".join(report.problems["problem"])
    assert "find no way" in texts
    assert "not connected" in texts
    assert report.numbers["unserved"] > 0
    assert report.numbers["unserved"] + report.numbers["vehicles"] == pytest.approx(40)


def test_results_come_back_in_the_crs_of_the_streets():
    frame = grid(4, 4)
    plane = assign_traffic(frame, DemandLayers(site=SITE))
    globe = assign_traffic(frame.to_crs(4326), DemandLayers(site=SITE))
    assert globe.streets.crs.to_epsg() == globe.places.crs.to_epsg() == 4326
    assert globe.numbers["vehicle_km"] == pytest.approx(plane.numbers["vehicle_km"], rel=2e-3)


def test_existing_streets_are_no_part_of_the_design():
    frame = grid(4, 4).assign(status="new")
    frame.loc[:3, "status"] = "existing"
    numbers = assign_traffic(frame, DemandLayers(site=SITE)).numbers
    assert numbers["total_length"] - numbers["design_length"] == pytest.approx(400)


def test_an_unknown_method_and_a_cancel():
    with pytest.raises(InputError, match="no method"):
        assign_traffic(grid(2, 2), options=TrafficOptions(method="magic"))

    class Cancelled(Silent):
        def cancelled(self):
            return True

    with pytest.raises(CancelledError):
        assign_traffic(grid(2, 2), progress=Cancelled())
