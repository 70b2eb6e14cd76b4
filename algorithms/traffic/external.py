"""Flows that are given: tables of origins and destinations, and lines between gates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from scipy.spatial import cKDTree

from ..errors import InputError
from ..measure.street_input import lines_of
from ..progress import Progress, Silent
from ..site.crs import layer_crs
from ..site.repair import Problems
from ..site.watch import ask
from .gates import name_of, names_within
from .speeds import numbers_of
from .types import (
    BOUNDARY_BOUNDARY,
    BOUNDARY_INTERIOR,
    INTERIOR_BOUNDARY,
    INTERIOR_INTERIOR,
    FloatArray,
    Places,
    TrafficNetwork,
)

#: Fields of a table of flows.
FROM, TO, VEHICLES = "from", "to", "vehicles_h"
#: What a table calls all interior places together.
INTERIOR = "interior"
#: Places listed in a message, at most.
_LISTED = 12
#: What goes on here, for those who cancel it.
_WORK = "the given flows were read"


@dataclass(frozen=True, eq=False)
class Ends:
    """Where flows may begin and end.

    Attributes
    ----------
    places
        The p places.
    by_name
        By lower-case name, shape (p,): share of each place. Gates of one name share evenly,
        places of a zone by their weight.
    """

    places: Places
    by_name: Mapping[str, FloatArray]


def ends_of(
    network: TrafficNetwork,
    places: Places,
    zones: gpd.GeoDataFrame | None,
    layer: str,
    problems: Problems,
) -> Ends:
    """Name all that flows may begin and end at.

    Parameters
    ----------
    network
        The streets.
    places
        The places.
    zones
        Polygons with a field `name`, in any CRS, or None. Those of one name are one zone.
    layer
        Name of the layer of zones, for messages.
    problems
        Told of zones that are called as a gate; then the zone counts.

    Raises
    ------
    InputError
        If the zones have no CRS or no names, or a zone holds no place.
    """
    found: dict[str, FloatArray] = {}
    for k in np.flatnonzero(places.gates).tolist():
        for name in names_within(str(places.name[k])):
            found.setdefault(name, np.zeros(len(places.piece)))[k] = 1.0
    found = {name: own / own.sum() for name, own in found.items()}
    if places.weight.sum() > 0:
        found.setdefault(INTERIOR, places.weight / places.weight.sum())
    if zones is not None:
        for name, (own, shape) in _zones(network, places, zones, layer).items():
            if name in found:
                text = f"zone '{name}' is also the name of a gate"
                what = "flows go to the zone: name one of them otherwise"
                problems.add(layer, "", text, what, "warning", shape, network.crs)
            found[name] = own / own.sum()
    return Ends(places, found)


def _zones(
    network: TrafficNetwork, places: Places, zones: gpd.GeoDataFrame, layer: str
) -> dict[str, tuple[FloatArray, shapely.Geometry]]:
    """Weights of the places in each zone, and a polygon of it, by its name in lower case."""
    layer_crs(zones, layer)
    if "name" not in zones.columns:
        raise InputError("has no field 'name'.", "Name the zones.", layer=layer)
    xy = shapely.line_interpolate_point(network.lines[places.piece], places.along)
    shapes = shapely.make_valid(shapely.force_2d(zones.geometry.to_crs(network.crs).to_numpy()))
    found: dict[str, tuple[FloatArray, shapely.Geometry]] = {}
    for k, (value, shape) in enumerate(zip(zones["name"], shapes)):
        name = name_of(value).lower()
        if not name:
            continue  # no flow can mean it
        own = np.where(shapely.intersects(shape, xy), places.weight, 0.0)
        if not own.sum() > 0:
            raise InputError(
                "No street inside this zone serves as a place.",
                "Draw the zone over streets of the site.",
                layer=layer,
                feature=str(zones.index[k]),
            )
        # a place on the border of two parts is in the zone once
        found[name] = (np.maximum(own, found[name][0]) if name in found else own), shape
    return found


def given_trips(
    frame: pd.DataFrame,
    network: TrafficNetwork,
    ends: Ends,
    layer: str,
    problems: Problems,
    progress: Progress | None = None,
) -> dict[str, FloatArray]:
    """Read flows between named places, or along lines between gates.

    Parameters
    ----------
    frame
        A table with the fields `from`, `to` (names of gates, of zones, or interior) and
        `vehicles_h`; or lines with `vehicles_h`, each from the gate nearest to its first point to
        that nearest to its last. Where lines have `from` and `to` these count.
    network
        The streets.
    ends
        What the names mean.
    layer
        Name of the layer, for messages.
    problems
        Told of flows that are left out.
    progress
        Asked for cancellation, or None.

    Returns
    -------
    dict
        Vehicles per hour by kind, shape (p, p).

    Raises
    ------
    InputError
        If a field is missing, a name is unknown, or a volume is negative or missing.
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    if VEHICLES not in frame.columns:
        raise InputError(
            f"has no field '{VEHICLES}'.", "Give it vehicles per hour there.", layer=layer
        )
    volume = numbers_of(frame, VEHICLES)
    for k in np.flatnonzero(~(volume >= 0) | ~np.isfinite(volume)).tolist():
        raise InputError(
            f"{VEHICLES} is no number of 0 or more.",
            "Mend it.",
            layer=layer,
            feature=str(frame.index[k]),
        )
    named = FROM in frame.columns and TO in frame.columns
    begin, end = _named(frame, ends, layer) if named else _drawn(frame, network, ends, layer)
    size = len(ends.places.piece)
    found: dict[str, FloatArray] = {}
    for k in range(len(frame)):
        ask(progress, _WORK)
        if volume[k] == 0:
            continue
        # a matrix has many rows, and each concerns few of the places
        start, stop = np.flatnonzero(begin[k]), np.flatnonzero(end[k])
        trips = np.outer(begin[k][start], end[k][stop])
        trips[start[:, None] == stop] = 0.0
        if not trips.sum() > 0:
            text = f"{volume[k]:g} vehicles/h begin and end at the same place"
            crs = network.crs
            problems.add(layer, frame.index[k], text, "left out", "warning", None, crs)
            continue
        own = found.setdefault(_kind(ends.places, begin[k], end[k]), np.zeros((size, size)))
        own[np.ix_(start, stop)] += volume[k] * trips / trips.sum()
    return found


def _named(
    frame: pd.DataFrame, ends: Ends, layer: str
) -> tuple[Sequence[FloatArray], Sequence[FloatArray]]:
    """Shares of all places, rows of shape (p,), of the names of origins and destinations."""
    found = []
    for name in (FROM, TO):
        rows = []
        for k, value in enumerate(frame[name].tolist()):
            text = name_of(value)
            if text.lower() not in ends.by_name:
                known = ", ".join(list(ends.by_name)[:_LISTED])
                raise InputError(
                    f"There is no gate or zone '{text}'. There are: {known}.",
                    f"Mend the field '{name}', or name the gates.",
                    layer=layer,
                    feature=str(frame.index[k]),
                )
            rows.append(ends.by_name[text.lower()])
        found.append(rows)
    return found[0], found[1]


def _drawn(
    frame: pd.DataFrame, network: TrafficNetwork, ends: Ends, layer: str
) -> tuple[Sequence[FloatArray], Sequence[FloatArray]]:
    """Shares of all places of the gates nearest to both ends of lines, shapes (rows, p)."""
    places = ends.places
    gates = np.flatnonzero(places.gates)
    if not isinstance(frame, gpd.GeoDataFrame) or frame.geometry.isna().all():
        raise InputError(
            f"has neither the fields '{FROM}' and '{TO}' nor lines.",
            "Give it both fields with names of gates, or draw a line from gate to gate.",
            layer=layer,
        )
    if not len(gates):
        raise InputError("The flows need gates.", "Choose a layer of gates.", layer=layer)
    layer_crs(frame, layer)
    tree = cKDTree(network.nodes[places.node[gates]])
    shares = np.zeros((2, len(frame), len(places.piece)))
    for k, line in enumerate(lines_of(frame.geometry.to_crs(network.crs))):
        if line is None:
            raise InputError(
                "is no line.", "Draw a line from gate to gate.", layer=layer,
                feature=str(frame.index[k]),
            )  # fmt: skip
        xy = shapely.get_coordinates(line)[[0, -1]]
        shares[[0, 1], k, gates[tree.query(xy)[1]]] = 1.0
    return list(shares[0]), list(shares[1])


def _kind(places: Places, begin: FloatArray, end: FloatArray) -> str:
    """Kind of the trips between places with these shares."""
    outside = [bool(places.gates[share > 0].all()) for share in (begin, end)]
    return {
        (False, True): INTERIOR_BOUNDARY,
        (True, False): BOUNDARY_INTERIOR,
        (False, False): INTERIOR_INTERIOR,
        (True, True): BOUNDARY_BOUNDARY,
    }[outside[0], outside[1]]
