"""From layers to traffic in one step."""

from __future__ import annotations

from dataclasses import dataclass, field

import geopandas as gpd

from ..errors import InputError
from ..progress import Progress, Share, Silent
from ..site.repair import Problems
from .assign import Assignment, assign
from .demand import DemandLayers, DemandRules, read_demand
from .equilibrium import EquilibriumRules, equilibrium
from .layers import (
    note_unserved,
    numbers_of_traffic,
    places_with_traffic,
    streets_with_traffic,
)
from .network import read_network
from .speeds import StreetRules
from .types import Demand, TrafficNetwork

#: Ways to assign trips.
SHORTEST, EQUILIBRIUM = "shortest time", "equilibrium"
METHODS = (SHORTEST, EQUILIBRIUM)


@dataclass(frozen=True)
class TrafficOptions:
    """What is asked of the traffic.

    Attributes
    ----------
    streets
        What is taken of streets whose fields do not say it.
    demand
        How much traffic there is.
    method
        "shortest time" or "equilibrium".
    equilibrium
        How streets slow down, and when the search for an equilibrium stops.
    """

    streets: StreetRules = field(default_factory=StreetRules)
    demand: DemandRules = field(default_factory=DemandRules)
    method: str = SHORTEST
    equilibrium: EquilibriumRules = field(default_factory=EquilibriumRules)


@dataclass(frozen=True, eq=False)
class Traffic:
    """Streets and trips, ready to be assigned or simulated.

    Attributes
    ----------
    streets
        The layer of streets.
    layer
        Its name, for messages.
    network, demand
        What was read of it, and the trips.
    problems
        What was left out or is doubtful.
    """

    streets: gpd.GeoDataFrame
    layer: str
    network: TrafficNetwork
    demand: Demand
    problems: Problems


@dataclass(frozen=True, eq=False)
class TrafficReport:
    """Traffic as layers and numbers; see `layers`.

    Attributes
    ----------
    streets, places, problems
        In the CRS of the streets.
    numbers
        Figures by name.
    assignment
        The traffic itself.
    """

    streets: gpd.GeoDataFrame
    places: gpd.GeoDataFrame
    problems: gpd.GeoDataFrame
    numbers: dict[str, float]
    assignment: Assignment


def read_traffic(
    streets: gpd.GeoDataFrame,
    layers: DemandLayers | None = None,
    options: TrafficOptions | None = None,
    layer: str = "Streets",
    progress: Progress | None = None,
) -> Traffic:
    """Read streets and say what travels on them.

    Parameters
    ----------
    streets
        Lines in any CRS; see `network.read_network`. Not changed.
    layers
        What else is given; see `demand.DemandLayers`.
    options
        What is asked; None for the defaults.
    layer
        Name of the layer of streets, for messages.
    progress
        Told of the stages; asked for cancellation.

    Raises
    ------
    InputError
        If a layer or a number cannot be used.
    CancelledError
        If the caller cancels.
    """
    options, progress = options or TrafficOptions(), progress or Silent()
    options.demand.check()
    progress.stage("Joining the streets", 0.0)
    network, problems = read_network(streets, layer, options.streets, progress)
    progress.stage("Spreading the traffic", 0.6)
    demand = read_demand(network, layers, options.demand, problems, progress)
    return Traffic(streets, layer, network, demand, problems)


def assign_traffic(
    streets: gpd.GeoDataFrame,
    layers: DemandLayers | None = None,
    options: TrafficOptions | None = None,
    layer: str = "Streets",
    progress: Progress | None = None,
) -> TrafficReport:
    """Say how much traffic runs on each street (CND sections 4.1 and 5.1).

    Parameters
    ----------
    streets, layers, options, layer
        See `read_traffic`.
    progress
        Told of the stages; asked for cancellation. A cancelled search for an equilibrium gives
        the best flows so far.

    Raises
    ------
    InputError
        If a layer or a number cannot be used.
    CancelledError
        If the caller cancels before there is anything to keep.
    """
    options, progress = options or TrafficOptions(), progress or Silent()
    _check(options)
    traffic = read_traffic(streets, layers, options, layer, Share(progress, 0.0, 0.5))
    return report_traffic(traffic, options, Share(progress, 0.5, 1.0))


def report_traffic(
    traffic: Traffic, options: TrafficOptions | None = None, progress: Progress | None = None
) -> TrafficReport:
    """Assign trips to streets that were read.

    Parameters
    ----------
    traffic
        See `read_traffic`.
    options, progress
        See `assign_traffic`.

    Raises
    ------
    InputError
        If there is no such method, or a number cannot be used.
    CancelledError
        If the caller cancels before there is anything to keep.
    """
    options, progress = options or TrafficOptions(), progress or Silent()
    _check(options)
    progress.stage("Assigning the traffic", 0.0)
    network, demand, crs = traffic.network, traffic.demand, traffic.streets.crs
    if options.method == EQUILIBRIUM:
        found = equilibrium(network, demand, options.equilibrium, progress)
    else:
        found = assign(network, demand, progress)
    problems = Problems()
    problems.extend(traffic.problems)
    note_unserved(network, demand, found, traffic.layer, problems)
    return TrafficReport(
        streets_with_traffic(network, traffic.streets, found),
        places_with_traffic(network, demand, crs),
        problems.to_frame(crs),
        numbers_of_traffic(network, demand, found),
        found,
    )


def _check(options: TrafficOptions) -> None:
    if options.method not in METHODS:
        raise InputError(f"There is no method '{options.method}'.", f"Give one of {METHODS}.")
    options.equilibrium.check()
