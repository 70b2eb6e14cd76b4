"""Assign and simulate traffic on about a square kilometre of streets.

Assignments are held against networkx, SUMO against the assignment of the same trips.

Figures are medians of several runs on one core. The networks are grids of a square kilometre with
streets of two levels, as Design streets lays them, and, with --streets, any layer. networkx gets
the same network, cut at the same places, and what it is best at: one search from each place, then
each way followed back. Both must agree on the mean time. With --picture the flows of --streets
are drawn, in equilibrium.

SUMO drives a square kilometre that Design streets has laid out, from its exits: end to end is from
the layers to the columns of the streets, reading and spreading included. Every trip must arrive.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import geopandas as gpd
import matplotlib.pyplot as plt
import networkx as nx
import numpy as np
from platwright.errors import MissingDependencyError
from platwright.network.specification import Specification
from platwright.site import prepare_sites
from platwright.streets import design_streets, plan_layers
from platwright.traffic.assign import assign
from platwright.traffic.demand import DemandLayers, DemandRules, read_demand
from platwright.traffic.equilibrium import EquilibriumRules, equilibrium
from platwright.traffic.network import read_network
from platwright.traffic.run import TrafficOptions, assign_traffic, read_traffic, report_traffic
from platwright.traffic.sections import cut_at_places
from platwright.traffic.sumo import SimulationOptions, find_sumo, simulate, street_columns
from platwright.traffic.types import Demand, TrafficNetwork
from shapely.geometry import LineString, box

#: Runs of each measurement.
RUNS = 5
#: Bounds of the classes of flow in the picture, vehicles per hour, and their colours.
CLASSES = (0.05, 10.0, 25.0, 50.0, 100.0, 250.0, 500.0)
COLOURS = ("#3b6ea5", "#7fb0c9", "#c9d6b0", "#f0c572", "#e0803f", "#b5302a", "#7a1522")
#: Corner of the grids, metres in UTM zone 33.
EAST, NORTH = 500_000.0, 5_500_000.0
#: The design that SUMO drives on: two levels under the paper's rules, ended by its work.
DESIGN = {
    "rules": "paper", "levels": 2, "edge_length": 50.0, "coverage": 1.0, "weight_length": 1.0,
    "weight_distance": 0.2, "effort": 5.0, "time_limit": 120,
}  # fmt: skip
#: Demands that are driven: vehicles per hour and km², and per hour between the exits (the second
#: is that of CND section 5.1).
DEMANDS = ((250.0, 0.0), (250.0, 1000.0), (3000.0, 0.0))
#: Runs of the simulator; what issue 9 asks of it and of the assignment, seconds.
DRIVES, MOST_SUMO, MOST_ASSIGN = 3, 60.0, 1.0


def grid(blocks: int) -> gpd.GeoDataFrame:
    """Return a square kilometre of streets with so many blocks a side, each third a collector."""
    step = 1000 / blocks
    lines, levels = [], []
    for k in range(blocks + 1):
        for j in range(blocks):
            for a, b in (((j, k), (j + 1, k)), ((k, j), (k, j + 1))):
                lines.append(LineString([(EAST + x * step, NORTH + y * step) for x, y in (a, b)]))
                levels.append(2 if k % 3 == 0 else 3)
    return gpd.GeoDataFrame({"level": levels}, geometry=lines, crs=32633)


def slow(network: TrafficNetwork, demand: Demand) -> tuple[np.ndarray[Any, Any], float]:
    """Assign by networkx; return the flow of each link and the mean time."""
    sections = cut_at_places(network, demand.places)
    graph = nx.DiGraph()
    graph.add_nodes_from(range(sections.nodes))
    for k, (u, v, seconds) in enumerate(
        zip(sections.start.tolist(), sections.end.tolist(), sections.free_time.tolist())
    ):
        graph.add_edge(u, v, seconds=seconds, link=k)
    flow = np.zeros(len(sections.start))
    total, spent, served = demand.total, 0.0, 0.0
    for i in np.flatnonzero(total.sum(axis=1) > 0).tolist():
        far, ways = nx.single_source_dijkstra(graph, int(sections.place[i]), weight="seconds")
        for j in np.flatnonzero(total[i]).tolist():
            end = int(sections.place[j])
            if end in far:
                way = ways[end]
                for u, v in zip(way, way[1:]):
                    flow[graph[u][v]["link"]] += total[i, j]
                spent += far[end] * total[i, j]
                served += total[i, j]
    return flow, spent / served


def median(function: Callable[[], Any], runs: int = RUNS) -> tuple[Any, float]:
    """Return what a function gives, and its median time in seconds."""
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        found = function()
        seconds.append(time.perf_counter() - start)
    return found, statistics.median(seconds)


def row(name: str, frame: gpd.GeoDataFrame, site: gpd.GeoDataFrame | None, gap: float) -> str:
    """Measure one network and return its row."""
    layers = DemandLayers(site=site)
    # So much traffic between gates that streets fill up and the equilibrium is no trifle.
    rules = DemandRules(through=3000.0)
    (network, _), read = median(lambda: read_network(frame))
    demand, spread = median(lambda: read_demand(network, layers, rules))
    found, ours = median(lambda: assign(network, demand))
    (_, mean), theirs = median(lambda: slow(network, demand), 1)
    if abs(mean - found.flows.time["all"]) > 1e-6 * mean:
        raise SystemExit(f"{name}: the mean times differ, {mean} and {found.flows.time['all']}")
    even, search = median(lambda: equilibrium(network, demand, EquilibriumRules(gap=gap)), 1)
    return (
        f"| {name} | {len(network.lines)} | {len(demand.places.piece)} | {read:.2f} | {spread:.2f} "
        f"| {ours:.3f} | {theirs:.2f} | {theirs / ours:.0f} | {even.busiest.max():.2f} "
        f"| {even.rounds} | {even.gap:.1e} | {search:.1f} |"
    )


def designed() -> tuple[gpd.GeoDataFrame, DemandLayers]:
    """Design a square kilometre in a ring of streets; return streets, and the site with exits."""
    square = box(EAST, NORTH, EAST + 1000, NORTH + 1000)
    site = gpd.GeoDataFrame(geometry=[square], crs=32633)
    # parts of a design may be joined by the streets around it only
    ring = gpd.GeoDataFrame({"level": [2]}, geometry=[square.exterior], crs=32633)
    prepared = prepare_sites(site, ring)
    plan = design_streets(prepared.sites, Specification.from_json(json.dumps(DESIGN)))
    layers = plan_layers(plan)
    return layers["streets"], DemandLayers(site=site, gates=layers["junctions"])


def drives(
    name: str, frame: gpd.GeoDataFrame, layers: DemandLayers
) -> Iterator[tuple[str, float, float]]:
    """Drive streets with each demand and choice of ways: rows, seconds of SUMO and assignment."""
    for density, through in DEMANDS:
        options = TrafficOptions(demand=DemandRules(density=density, through=through))
        traffic = read_traffic(frame, layers, options)
        report = report_traffic(traffic, options)
        numbers = report.numbers
        _, ours = median(lambda: assign(traffic.network, traffic.demand))  # noqa: B023
        for routes in ("shortest", "iterated"):
            asked = SimulationOptions(routes=routes, seed=1)

            def drive(options: TrafficOptions = options, asked: SimulationOptions = asked) -> Any:
                own = read_traffic(frame, layers, options)
                found = simulate(own.network, own.demand, asked)
                return found, street_columns(own.network, found)

            (found, _), seconds = median(drive, DRIVES)
            counts = found.counts
            if counts.arrived + counts.nowhere != counts.drawn:
                raise SystemExit(f"{name}: of {counts.drawn} trips {counts.arrived} arrived")
            text = (
                f"| {name} | {density:,.0f} + {through:,.0f} | {counts.drawn:,} | {ours:.3f} "
                f"| {numbers['distance_mean']:.0f} m, {numbers['time_mean']:.1f} s | {routes} "
                f"| {seconds:.1f} | {found.flows.distance['all']:.0f} m, "
                f"{found.flows.time['all']:.1f} s | {seconds / ours:.0f} |"
            )
            yield text, seconds, ours


def simulated(streets: gpd.GeoDataFrame | None, layers: DemandLayers, name: str) -> None:
    """Print what SUMO takes end to end, and the assignment of the same trips in the same run."""
    try:
        find_sumo()
    except MissingDependencyError as error:
        raise SystemExit(str(error)) from error
    start = time.perf_counter()
    square, own = designed()
    km = square.length.sum() / 1e3
    print(f"\nDesigned 1 km² in {time.perf_counter() - start:.0f} s: {km:.1f} km of streets.\n")
    print(
        "| streets | veh/h per km² + between exits | trips | assign, s | assigned | ways "
        "| SUMO end to end, s | driven | times as long |\n" + "|---" * 9 + "|"
    )
    most = np.zeros(2)
    every = [("1 km², designed", square, own)]
    if streets is not None:
        every.append((name, streets, layers))
    for each in every:
        for text, *seconds in drives(*each):
            print(text, flush=True)
            most = np.maximum(most, seconds)
    print(
        f"\nLongest: SUMO {most[0]:.1f} s (asked: under {MOST_SUMO:.0f}), "
        f"assignment {most[1]:.3f} s (asked: under {MOST_ASSIGN:.0f})."
    )


def draw(
    frame: gpd.GeoDataFrame, site: gpd.GeoDataFrame | None, gates: gpd.GeoDataFrame | None,
    path: Path,
) -> None:  # fmt: skip
    """Draw the flows of streets with 1,000 vehicles per hour between the gates, as CND Fig. 8."""
    options = TrafficOptions(demand=DemandRules(through=1000.0), method="equilibrium")
    report = assign_traffic(frame, DemandLayers(site=site, gates=gates), options)
    west, south, east, north = report.streets.total_bounds
    figure, axes = plt.subplots(figsize=(11, 11 * (north - south) / (east - west) + 0.4), dpi=90)
    report.streets.plot(ax=axes, color="#c9c4bb", linewidth=0.9, label="no traffic")
    for at, (low, high) in enumerate(zip(CLASSES, (*CLASSES[1:], np.inf))):
        flow = report.streets["flow_veh_h"]
        own = report.streets[(flow >= low) & (flow < high)]
        text = f"{low:g} and more" if np.isinf(high) else f"{max(0, round(low)):g} to {high:g}"
        if len(own):
            own.plot(
                ax=axes, color=COLOURS[at], linewidth=1.2 + 0.9 * at, label=text, zorder=at + 2
            )
    at_gates = report.places[report.places["kind"] == "gate"]
    at_gates.plot(ax=axes, color="#2b2b2b", marker="D", markersize=28, zorder=20, label="gates")
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.legend(title="vehicles per hour", loc="upper left", frameon=False)
    figure.tight_layout()
    figure.savefig(path)
    print({key: round(value, 2) for key, value in report.numbers.items()})


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--streets", type=Path, help="a layer of streets to measure too")
    parser.add_argument("--site", type=Path, help="its site")
    parser.add_argument("--gates", type=Path, help="its gates, for the picture")
    parser.add_argument("--picture", type=Path, help="draw flows of the streets here, and no more")
    parser.add_argument("--only", choices=("assignment", "sumo"), help="one of the two parts")
    parser.add_argument("--gap", type=float, default=1e-4, help="wished gap of the equilibrium")
    given = parser.parse_args()
    streets, site, gates = (
        gpd.read_file(path) if path is not None else None
        for path in (given.streets, given.site, given.gates)
    )
    if given.picture is not None and streets is not None:
        draw(streets, site, gates, given.picture)
        return
    if given.only != "sumo":
        assigned(streets, site, given.streets, given.gap)
    if given.only != "assignment":
        layers = DemandLayers(site=site, gates=gates)
        simulated(streets, layers, "" if given.streets is None else given.streets.stem)


def assigned(
    streets: gpd.GeoDataFrame | None, site: gpd.GeoDataFrame | None, path: Path | None, gap: float
) -> None:
    """Print what assignments take."""
    print(
        "| network | pieces | places | read, s | spread, s | assign, s | networkx, s "
        "| times faster | max v/c | rounds | gap | equilibrium, s |\n" + "|---" * 12 + "|"
    )
    for blocks in (7, 10, 14):
        print(row(f"grid of {blocks} x {blocks} blocks", grid(blocks), None, gap), flush=True)
    if streets is not None and path is not None:
        print(row(path.stem, streets, site, gap))


if __name__ == "__main__":
    main()
