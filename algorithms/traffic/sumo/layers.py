"""A simulation as columns of the street layer, and its troubles as points on a map."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from ..types import FloatArray, Places, TrafficNetwork
from .result import Simulation

#: Where vehicles wait longer than this (s) on average to enter, that is told.
LONG_ENTRY = 60.0
_NO_WAY = "Check directions of one-way streets, and whether the streets are connected."
_FULL = "Streets here are full; add capacity or another way, or lower the demand."


def street_columns(network: TrafficNetwork, simulation: Simulation) -> pd.DataFrame:
    """Return what was measured on each piece of street.

    Parameters
    ----------
    network, simulation
        What was simulated, and what was found.

    Returns
    -------
    DataFrame
        A row for each of the m pieces: length_m; flow_veh_h of both directions, flow_ahead along
        the line and flow_back against it, vehicles per hour, means over the piece; of both
        directions together travel_kmh, vehicle metres over vehicle seconds, waiting_s and
        loss_s, seconds that a vehicle stands and loses there, NaN where nothing travelled.
    """
    length = network.length
    ahead, back = simulation.flows.ahead, simulation.flows.back
    both = np.asarray(ahead + back)
    each = np.where(both > 0, both, np.nan)

    def mean(of_ahead: FloatArray, of_back: FloatArray) -> FloatArray:
        total = np.where(ahead > 0, ahead * of_ahead, 0.0) + np.where(back > 0, back * of_back, 0.0)
        return np.asarray(total / each)

    slow = mean(simulation.flows.time_ahead, simulation.flows.time_back)
    return pd.DataFrame(
        {
            "length_m": length,
            "flow_veh_h": both,
            "flow_ahead": ahead,
            "flow_back": back,
            "travel_kmh": 3.6 * length / slow,
            "waiting_s": mean(simulation.waiting_ahead, simulation.waiting_back),
            "loss_s": mean(simulation.loss_ahead, simulation.loss_back),
        }
    )


def problem_points(
    network: TrafficNetwork, places: Places, simulation: Simulation, layer: str
) -> gpd.GeoDataFrame:
    """Return where vehicles found no way, waited long to enter, or had to be moved on.

    Parameters
    ----------
    network, places, simulation
        What was simulated, and what was found.
    layer
        Name of the street layer.

    Returns
    -------
    GeoDataFrame
        Points in the working CRS with the columns layer, feature, problem, action, severity.
    """
    rows: list[tuple[str, str, str]] = []
    points: list[shapely.Point] = []
    for place in np.flatnonzero(simulation.lost > 0):
        count = int(simulation.lost[place])
        rows.append((f"Trips that begin here and find no way: {count}.", _NO_WAY, "warning"))
        points.append(_point(network, places, int(place)))
    for place in np.flatnonzero(simulation.entry > LONG_ENTRY):
        seconds = f"{simulation.entry[place]:.0f} s"
        rows.append((f"Vehicles wait {seconds} on average to enter here.", _FULL, "warning"))
        points.append(_point(network, places, int(place)))
    spots, counts = np.unique(simulation.teleports, axis=0, return_counts=True)
    for spot, number in zip(spots, counts):
        stood = f"Vehicles that stood here so long that the simulator moved them on: {number}."
        rows.append((stood, _FULL, "warning"))
        points.append(shapely.Point(spot))
    columns = {
        "layer": [layer] * len(rows),
        "feature": [""] * len(rows),
        "problem": [row[0] for row in rows],
        "action": [row[1] for row in rows],
        "severity": [row[2] for row in rows],
    }
    geometry = gpd.GeoSeries(points, dtype="geometry")
    return gpd.GeoDataFrame(columns, geometry=geometry, crs=network.crs)


def _point(network: TrafficNetwork, places: Places, place: int) -> shapely.Point:
    node = int(places.node[place])
    if node >= 0:
        return shapely.Point(network.nodes[node])
    return network.lines[places.piece[place]].interpolate(float(places.along[place]))
