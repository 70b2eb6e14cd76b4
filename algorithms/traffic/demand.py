"""How many vehicles travel from where to where (CND sections 4.1 and 5.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from ..errors import InputError
from ..measure.layers import read_union
from ..progress import Progress, Silent
from ..site.repair import Problems
from ..site.watch import ask
from .external import ends_of, given_trips
from .gates import Gates, gates_at_edge, gates_of_layer
from .ground import (
    MOST_PLACES,
    even_samples,
    gather,
    ground_of,
    inner_pieces,
    weighted_samples,
)
from .sections import cut_at_places
from .types import (
    BOUNDARY_BOUNDARY,
    BOUNDARY_INTERIOR,
    INTERIOR_BOUNDARY,
    INTERIOR_INTERIOR,
    KINDS,
    Demand,
    FloatArray,
    IntArray,
    Places,
    TrafficNetwork,
)

#: What goes on here, for those who cancel it.
_WORK = "the traffic was spread"


@dataclass(frozen=True)
class DemandRules:
    """How much traffic there is and of which kinds.

    Attributes
    ----------
    density
        Vehicles per hour and square kilometre of the ground (CND section 5.1: 250).
    shares
        Share of each kind of trip (see `types.KINDS`) in them; only their ratios count.
    nearest_gate
        Whether who leaves or enters takes the gate of the least time on free roads; else all
        gates evenly.
    through
        Further vehicles per hour between the gates, evenly from each to all others.
    part_m
        Places stand for so many metres of street at most.
    gate_reach_m
        A point of the layer of gates farther than this from streets is left out, metres.
    """

    density: float = 250.0
    shares: Mapping[str, float] = field(
        default_factory=lambda: {
            INTERIOR_BOUNDARY: 0.4,
            BOUNDARY_INTERIOR: 0.4,
            INTERIOR_INTERIOR: 0.2,
            BOUNDARY_BOUNDARY: 0.0,
        }
    )
    nearest_gate: bool = True
    through: float = 0.0
    part_m: float = 50.0
    gate_reach_m: float = 50.0

    def check(self) -> None:
        """Raise `InputError` where a number is out of range."""
        for name, value in (("density", self.density), ("traffic between gates", self.through)):
            if not 0 <= value < np.inf:
                raise InputError(f"The {name} must be 0 or more.", "Give another number.")
        for name, value in (("length of a part", self.part_m), ("reach", self.gate_reach_m)):
            if not 0 < value < np.inf:
                raise InputError(f"The {name} must be greater than 0.", "Give another number.")
        unknown = set(self.shares) - set(KINDS)
        if unknown or not all(0 <= share < np.inf for share in self.shares.values()):
            raise InputError(
                f"Shares are numbers of 0 or more, of {', '.join(KINDS)}.", "Give others."
            )
        if self.density > 0 and not sum(self.shares.values()) > 0:
            raise InputError("All shares of trips are 0.", "Give one a share, or no density.")


@dataclass(frozen=True, eq=False)
class DemandLayers:
    """What the planner gives beside the streets, in any CRS; None for nothing.

    Attributes
    ----------
    site
        Polygons over which traffic is spread; else the hull of the streets.
    gates
        Points where traffic enters and leaves (see `gates.gates_of_layer`); else where streets
        meet the edge.
    flows
        A table or lines with flows that are added (see `external.given_trips`).
    weights
        Points or polygons, such as buildings, that the traffic is spread over in their stead.
    weight_field
        Its field with the weight, such as dwellings; empty for the area.
    zones
        Polygons with a field `name` that flows may name.
    names
        Names of the layers by attribute, for messages.
    """

    site: gpd.GeoDataFrame | None = None
    gates: gpd.GeoDataFrame | None = None
    flows: pd.DataFrame | None = None
    weights: gpd.GeoDataFrame | None = None
    weight_field: str = ""
    zones: gpd.GeoDataFrame | None = None
    names: Mapping[str, str] = field(default_factory=dict)

    def name(self, key: str) -> str:
        """Name of a layer, for messages."""
        return self.names.get(key, key.capitalize())


def read_demand(
    network: TrafficNetwork,
    layers: DemandLayers | None = None,
    rules: DemandRules | None = None,
    problems: Problems | None = None,
    progress: Progress | None = None,
) -> Demand:
    """Say how many vehicles travel between which places.

    The traffic of a site is the same for all its designs: it is spread evenly over the ground, and
    each bit of ground goes to the nearest street inside.

    Parameters
    ----------
    network
        The streets; see `network.read_network`.
    layers
        What else is given; None for nothing.
    rules
        How much and which kinds; None for the defaults.
    problems
        Told of what is left out; None to forget it.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    InputError
        If a layer or a number cannot be used, or trips to the edge are asked for and there is no
        gate.
    CancelledError
        If the caller cancels.
    """
    layers, rules = layers or DemandLayers(), rules or DemandRules()
    problems, progress = Problems() if problems is None else problems, progress or Silent()
    rules.check()
    site = read_union(layers.site, network.crs, layers.name("site"))
    is_site = layers.site is not None
    if is_site and site.is_empty:
        raise InputError(
            "has no polygon.", "Choose the site, or no layer.", layer=layers.name("site")
        )
    ground = ground_of(network, site if is_site else None)
    inner = inner_pieces(network, ground, is_site=is_site)
    ask(progress, _WORK)
    if layers.gates is None:
        gates = gates_at_edge(network, ground, inner, is_site=is_site)
    else:
        name = layers.name("gates")
        gates = gates_of_layer(layers.gates, network, name, rules.gate_reach_m, problems)
    _check_gates(gates, rules)
    spread = _spread(network, ground, inner, layers, rules, problems)
    ask(progress, _WORK)
    places = _places(network, *spread, gates)
    vehicles = rules.density * ground.area / 1e6
    trips = _trips(network, places, rules, vehicles)
    if layers.flows is not None:
        ends = ends_of(network, places, layers.zones, layers.name("zones"), problems)
        name = layers.name("flows")
        given = given_trips(layers.flows, network, ends, name, problems, progress)
        for kind, more in given.items():
            trips[kind] = trips[kind] + more if kind in trips else more
    return Demand(places, {kind: trips[kind] for kind in KINDS if kind in trips})


def place_points(
    network: TrafficNetwork, places: Places
) -> np.ndarray[tuple[int], np.dtype[np.object_]]:
    """Give the points of places, shape (p,), in the working CRS.

    Parameters
    ----------
    network, places
        The streets, and places on them.
    """
    points = shapely.line_interpolate_point(network.lines[places.piece], places.along)
    points[places.gates] = shapely.points(network.nodes[places.node[places.gates]])
    return np.asarray(points, dtype=object)


def _check_gates(gates: Gates, rules: DemandRules) -> None:
    needed = {
        INTERIOR_BOUNDARY: 1, BOUNDARY_INTERIOR: 1, BOUNDARY_BOUNDARY: 2, INTERIOR_INTERIOR: 0,
    }  # fmt: skip
    asked = [needed[kind] for kind, share in rules.shares.items() if share > 0 < rules.density]
    most = max([*asked, 2 if rules.through > 0 else 0])
    if len(gates.node) < most:
        found = "No gate" if not len(gates.node) else "Only one gate"
        raise InputError(
            f"{found} was found where streets meet the edge of the site.",
            "Choose a layer of gates, such as access points, or ask for trips inside only.",
        )


def _spread(
    network: TrafficNetwork,
    ground: shapely.Geometry,
    inner: np.ndarray[tuple[int], np.dtype[np.bool_]],
    layers: DemandLayers,
    rules: DemandRules,
    problems: Problems,
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Piece, metres along it and weight of each interior place."""
    if layers.weights is not None:
        name = layers.name("weights")
        points, weight = weighted_samples(layers.weights, network, name, layers.weight_field)
        if layers.site is not None:
            points, weight = _in_site(network, ground, points, weight, name, problems)
    else:
        points = even_samples(ground)
        weight = np.ones(len(points))
    part = rules.part_m
    found = gather(network, inner, points, weight, part)
    while len(found[0]) > MOST_PLACES and part < 8 * rules.part_m:
        part *= 2
        found = gather(network, inner, points, weight, part)
    if len(found[0]) > MOST_PLACES:
        # More streets than places: the heaviest ones stand for those around them.
        heavy = np.argsort(-found[2], kind="stable")[:MOST_PLACES]
        kept = np.zeros(len(inner), dtype=bool)
        kept[found[0][heavy]] = True
        found = gather(network, kept, points, weight, np.inf)
    return found


def _in_site(
    network: TrafficNetwork,
    ground: shapely.Geometry,
    points: FloatArray,
    weight: FloatArray,
    layer: str,
    problems: Problems,
) -> tuple[FloatArray, FloatArray]:
    """Leave out what stands outside of the site: layers of buildings hold the whole town."""
    shapely.prepare(ground)
    own = shapely.contains_xy(ground, points[:, 0], points[:, 1])
    if not weight[own].sum() > 0:
        raise InputError(
            "has nothing with a weight inside the site.",
            "Choose the layer of this site, or none.",
            layer=layer,
        )
    if not own.all():
        text = f"{(~own).sum()} of {len(own)} features lie outside of the site"
        what = "left out: no traffic of the site comes from them"
        problems.add(layer, "", text, what, "info", None, network.crs)
    return points[own], weight[own]


def _places(
    network: TrafficNetwork, piece: IntArray, along: FloatArray, weight: FloatArray, gates: Gates
) -> Places:
    """Put the interior places and the gates together."""
    count, more = len(piece), len(gates.node)
    at, side = np.full(more, -1), np.zeros(more, dtype=np.int64)
    for k, node in enumerate(gates.node.tolist()):
        at[k], side[k] = np.argwhere(network.ends == node)[0]
    names = np.full(count + more, "", dtype=object)
    names[count:] = gates.name
    return Places(
        piece=np.concatenate([piece, at]).astype(np.int64),
        along=np.concatenate([along, np.where(side == 0, 0.0, network.length[at])]),
        node=np.concatenate([np.full(count, -1), gates.node]).astype(np.int64),
        weight=np.concatenate([weight, np.zeros(more)]),
        name=names,
    )


def _trips(
    network: TrafficNetwork, places: Places, rules: DemandRules, vehicles: float
) -> dict[str, FloatArray]:
    """Vehicles per hour by kind, shape (p, p), of the density and between the gates."""
    weight, gate = places.weight, places.gates.astype(np.float64)
    whole = sum(rules.shares.values())
    number = {k: vehicles * s / whole for k, s in rules.shares.items()} if vehicles > 0 else {}
    number[BOUNDARY_BOUNDARY] = number.get(BOUNDARY_BOUNDARY, 0.0) + rules.through
    found = {}
    for kind in KINDS:
        if not number.get(kind, 0.0) > 0:
            continue
        if kind == INTERIOR_INTERIOR:
            shape = np.outer(weight, weight)
        elif kind == BOUNDARY_BOUNDARY:
            shape = np.outer(gate, gate)
        else:
            shape = weight[:, None] * _choice(network, places, rules, kind)
            shape = shape.T if kind == BOUNDARY_INTERIOR else shape
        np.fill_diagonal(shape, 0.0)
        if not shape.sum() > 0:
            raise InputError(
                "All traffic of the site gathers at one place.",
                "Give shorter parts of streets, or no trips within the site.",
            )
        found[kind] = number[kind] * shape / shape.sum()
    return found


def _choice(network: TrafficNetwork, places: Places, rules: DemandRules, kind: str) -> FloatArray:
    """Share of each place's trips that takes each gate, shape (p, p): rows are places."""
    gates = np.flatnonzero(places.gates)
    size = len(places.piece)
    found = np.zeros((size, size))
    if not rules.nearest_gate:
        found[:, gates] = 1 / len(gates)
        return found
    sections = cut_at_places(network, places)
    cost = sections.free_time
    if kind == INTERIOR_BOUNDARY:
        # From the gates against the traffic: far fewer searches than from the places.
        sections = sections.reversed()
        cost = sections.free_time
    times = sections.times(cost, sections.place[gates])
    # Where no gate can be reached the trips go to the first, and are told as unserved.
    found[np.arange(size), gates[np.argmin(times, axis=0)]] = 1.0
    return found
