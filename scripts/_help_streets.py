"""The pictures of the help of tools that measure and compare streets."""

from __future__ import annotations

import geopandas as gpd
from matplotlib.axes import Axes
from platwright.explore import explore, grid
from platwright.measure import measure_streets
from platwright.network.specification import Specification
from platwright.site.layers import site_layers
from platwright.traffic.demand import DemandLayers, DemandRules
from platwright.traffic.network import pieces_layer
from platwright.traffic.run import TrafficOptions, assign_traffic, read_traffic
from platwright.traffic.sumo import SimulationOptions, simulate, street_columns

from _help_drawing import GREY, INK, TEAL, designed, ground, mapped, prepared, show, streets

#: Shares of the largest betweenness from which on a street has a colour and a width.
CLASSES = (
    (-1.0, "#3b6ea5", 1.0), (0.01, "#7fb0c9", 1.3), (0.05, "#c9d6b0", 1.7), (0.15, "#f0c572", 2.2),
    (0.3, "#e0803f", 2.8), (0.6, "#b5302a", 3.4),
)  # fmt: skip


def measurestreets(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw streets as they come, and how much runs through them, with junctions and dead ends."""
    streets = mapped()["streets"]
    show(left, streets, color=GREY, linewidth=1.4)
    report = measure_streets(streets)
    share = report.streets["betweenness"] / report.streets["betweenness"].max()
    for at, (low, colour, width) in enumerate(CLASSES):
        show(right, report.streets[share >= low], color=colour, linewidth=width, zorder=at + 1)
    blind = report.nodes["degree"] == 1
    show(right, report.nodes[~blind], color=INK, markersize=4, zorder=9)
    show(right, report.nodes[blind], color=TEAL, marker="s", markersize=9, zorder=9)
    return "streets", "betweenness"


def assigntraffic(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw a design, and how many vehicles run on each of its streets."""
    own = designed()["streets"]
    ground(left)
    streets(left, own)
    site = site_layers(prepared())["site"]
    options = TrafficOptions(demand=DemandRules(through=500.0))
    found = assign_traffic(own, DemandLayers(site=site), options)
    ground(right)
    classed(right, found.streets, "flow_veh_h", 260.0)
    gates = found.places[found.places["kind"] == "gate"]
    show(right, gates, color=INK, marker="D", markersize=36, zorder=12)
    return "streets", "vehicles per hour"


def simulatetraffic(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw what drives on each street in the simulator, and what vehicles lose there."""
    site = site_layers(prepared())["site"]
    options = TrafficOptions(demand=DemandRules(density=1500.0, through=1000.0))
    traffic = read_traffic(designed()["streets"], DemandLayers(site=site), options)
    found = simulate(traffic.network, traffic.demand, SimulationOptions(routes="shortest"))
    own = pieces_layer(traffic.network, traffic.streets).reset_index(drop=True)
    own = own.assign(**{key: values.to_numpy() for key, values in street_columns(
        traffic.network, found
    ).items()})  # fmt: skip
    for axes, column, full in ((left, "flow_veh_h", 900.0), (right, "loss_s", 12.0)):
        ground(axes)
        classed(axes, own, column, full)
    return "vehicles per hour", "seconds lost"


def classed(axes: Axes, streets: gpd.GeoDataFrame, column: str, full: float) -> None:
    """Draw streets by how much they have of a column; `full` has the strongest colour."""
    show(axes, streets, color="#c9c4bb", linewidth=1.2)
    for at, (low, colour, width) in enumerate(CLASSES):
        loaded = streets[streets[column] > full * max(low, 0.002)]
        show(axes, loaded, color=colour, linewidth=1.6 * width, zorder=at + 3)


def exploretradeoffs(left: Axes, right: Axes) -> tuple[str, str]:
    """Draw a design with small blocks, and one with large blocks."""
    found = explore(prepared(), grid(Specification(), {"edge_length": [60.0, 130.0]}))
    for axes, design in zip((left, right), found.designs):
        ground(axes)
        streets(axes, design.layers["streets"])
    return "small blocks", "large blocks"
