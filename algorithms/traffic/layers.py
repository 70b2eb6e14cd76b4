"""Traffic as layers and numbers."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import shapely

from ..site.repair import Problems
from .assign import Assignment
from .demand import place_points
from .network import components, pieces_layer
from .speeds import KMH
from .types import (
    BOUNDARY_BOUNDARY,
    BOUNDARY_INTERIOR,
    INTERIOR_BOUNDARY,
    INTERIOR_INTERIOR,
    Demand,
    FloatArray,
    TrafficNetwork,
)

#: What the kinds of trips are called in numbers.
KIND_KEYS = {
    INTERIOR_BOUNDARY: "out",
    BOUNDARY_INTERIOR: "in",
    INTERIOR_INTERIOR: "within",
    BOUNDARY_BOUNDARY: "through",
    "all": "mean",
}


def streets_with_traffic(
    network: TrafficNetwork, frame: gpd.GeoDataFrame, found: Assignment
) -> gpd.GeoDataFrame:
    """Give the pieces of streets between junctions with their traffic.

    Parameters
    ----------
    network
        The streets.
    frame
        The layer that they were read from.
    found
        The traffic.

    Returns
    -------
    geopandas.GeoDataFrame
        All fields of `frame`, and: length_m; flow_veh_h of both directions, flow_ahead along the
        line and flow_back against it, through_veh_h between gates (vehicles per hour, means over
        the piece); time_s, which a vehicle takes, mean of both directions by their flow;
        free_kmh and travel_kmh, speeds on the free road and with the traffic; v_c, largest share
        of the capacity that a direction uses.
    """
    flows = found.flows
    layer = pieces_layer(network, frame)
    both = flows.ahead + flows.back
    time = mean_time(found)
    size = network.length
    layer["length_m"] = size
    layer["flow_veh_h"] = both
    layer["flow_ahead"] = flows.ahead
    layer["flow_back"] = flows.back
    layer["through_veh_h"] = _through(network, found)
    layer["time_s"] = time
    layer["free_kmh"] = network.speed / KMH
    layer["travel_kmh"] = size / time / KMH
    layer["v_c"] = found.busiest
    return layer


def mean_time(found: Assignment) -> FloatArray:
    """Seconds on each piece, shape (m,): mean of both directions by their flow.

    Parameters
    ----------
    found
        The traffic.
    """
    flows = found.flows
    weight = np.array([flows.ahead, flows.back])
    times = np.array([flows.time_ahead, flows.time_back])
    weight = np.where(weight.sum(axis=0) > 0, weight, 1.0) * ~np.isnan(times)
    return np.asarray((weight * np.nan_to_num(times)).sum(axis=0) / weight.sum(axis=0))


def places_with_traffic(network: TrafficNetwork, demand: Demand, crs: object) -> gpd.GeoDataFrame:
    """Give the places with the trips that begin and end there.

    Parameters
    ----------
    network, demand
        The streets and the trips.
    crs
        CRS of the layer.

    Returns
    -------
    geopandas.GeoDataFrame
        Fields place_id (from 1), kind ("interior" or "gate"), name, from_veh_h and to_veh_h.
    """
    places, total = demand.places, demand.total
    points = gpd.GeoSeries(place_points(network, places), crs=network.crs).to_crs(crs)
    return gpd.GeoDataFrame(
        {
            "place_id": np.arange(1, len(points) + 1),
            "kind": np.where(places.gates, "gate", "interior"),
            "name": places.name,
            "from_veh_h": total.sum(axis=1),
            "to_veh_h": total.sum(axis=0),
        },
        geometry=points,
        crs=crs,
    )


def note_unserved(
    network: TrafficNetwork, demand: Demand, found: Assignment, layer: str, problems: Problems
) -> None:
    """Tell where trips begin that find no way, once for each connected part of the streets.

    Parameters
    ----------
    network, demand, found
        The streets, the trips and the traffic.
    layer
        Name of the layer of streets, for messages.
    problems
        Told of them.
    """
    missed = found.loads.missed
    part = components(network)[network.ends[demand.places.piece, 0]]
    points = place_points(network, demand.places)
    for k in np.unique(part[missed > 0]).tolist():
        own = (part == k) & (missed > 0)
        text = f"{missed[own].sum():.3g} vehicles/h that begin here find no way to where they go"
        what = "left out: join the streets, or look at one-way streets"
        shape = shapely.multipoints(list(points[own]))
        problems.add(layer, "", text, what, "warning", shape, network.crs)


def numbers_of_traffic(
    network: TrafficNetwork, demand: Demand, found: Assignment
) -> dict[str, float]:
    """Give the figures of a network with traffic, among them the paper's L and d (CND Fig. 8).

    Parameters
    ----------
    network, demand, found
        The streets, the trips and the traffic.

    Returns
    -------
    dict
        total_length and design_length (of streets that were not there before), metres;
        distance_* (metres) and time_* (seconds), means per vehicle of all (mean) and of each kind
        of trip (out, in, within, through), NaN where there are none; vehicles, vehicle_km and
        vehicle_hours per hour; max_use (largest share of a capacity that is used), unserved,
        gates, gap.
    """
    flows, size = found.flows, network.length
    numbers = {
        "total_length": float(size.sum()),
        "design_length": float(size[~network.existing].sum()),
    }
    for kind, key in KIND_KEYS.items():
        numbers[f"distance_{key}"] = flows.distance.get(kind, float("nan"))
        numbers[f"time_{key}"] = flows.time.get(kind, float("nan"))
    total = found.loads.flow.sum(axis=0)
    return {
        **numbers,
        "vehicles": flows.trips["all"],
        "vehicle_km": float(total @ found.sections.length) / 1e3,
        "vehicle_hours": float(total @ found.time) / 3600,
        "max_use": float(found.busiest.max()),
        "unserved": flows.unserved,
        "gates": float(demand.places.gates.sum()),
        "gap": found.gap,
    }


def _through(network: TrafficNetwork, found: Assignment) -> FloatArray:
    """Vehicles per hour between gates on each piece, shape (m,), mean over its length."""
    loads, sections = found.loads, found.sections
    if BOUNDARY_BOUNDARY not in loads.kinds:
        return np.zeros(len(network.lines))
    own = loads.flow[loads.kinds.index(BOUNDARY_BOUNDARY)] * sections.length
    return np.bincount(sections.piece, own, minlength=len(network.lines)) / network.length
