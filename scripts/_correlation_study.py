"""Scenarios of one site: designed, their trips assigned and simulated."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from platwright.network.specification import Specification
from platwright.site import prepare_sites, site_layers
from platwright.streets import Wishes, design_streets, plan_layers
from platwright.traffic.demand import DemandLayers, DemandRules
from platwright.traffic.ground import even_samples, inner_pieces
from platwright.traffic.network import pieces_layer
from platwright.traffic.run import Traffic, TrafficOptions, read_traffic, report_traffic
from platwright.traffic.sumo import SimulationOptions, simulate, street_columns
from platwright.traffic.types import INTERIOR_BOUNDARY, INTERIOR_INTERIOR
from shapely.geometry import LineString, Polygon

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("PLATWRIGHT_TEST_DATA", ROOT.parent / "shared" / "data"))
#: Vehicles per hour and km², as in CND section 5.1. Of a small site that are few trips in an
#: hour: so many hours are driven that chance has no say.
DENSITY, HOURS = 250.0, 24.0
#: Streets this near to the site serve it today (metres).
EDGE = 60.0
#: Kinds of trips by their key in the numbers of the assignment.
KINDS = {"out": INTERIOR_BOUNDARY, "within": INTERIOR_INTERIOR}


@dataclass(frozen=True)
class Kind:
    """Trips of one kind: metres and seconds as assigned, and as simulated."""

    metres: float
    seconds: float
    driven_metres: float
    driven_seconds: float
    trips: int
    arrived: float


@dataclass(frozen=True, eq=False)
class Row:
    """One scenario.

    Attributes
    ----------
    name, says
        Its letter and what it is.
    length, distance
        New streets (m), and what the program minimised besides: the mean way out (m).
    access
        Mean straight way from the ground to a street of the site (m): streets that serve it from
        afar make trips on them shorter.
    kinds
        Traffic by its key, see `KINDS`.
    streets
        Pieces of streets, new ones and those around, with flow_veh_h of trips within.
    ground
        The site.
    """

    name: str
    says: str
    length: float
    distance: float
    access: float
    kinds: dict[str, Kind]
    streets: gpd.GeoDataFrame
    ground: gpd.GeoDataFrame

    @property
    def has_exits(self) -> bool:
        """Whether it is a design, with places where its trips leave."""
        return "out" in self.kinds


def read(path: Path) -> dict[str, Any]:
    """Read a file of scenarios.

    Raises
    ------
    FileNotFoundError
        If the site is not there.
    """
    asked = dict(json.loads(path.read_text(encoding="utf-8")))
    asked["file"] = DATA / asked["site"]
    if not asked["file"].is_file():
        msg = f"{asked['site']} is not in the test data; PLATWRIGHT_TEST_DATA says where that is"
        raise FileNotFoundError(msg)
    return asked


def rows(asked: dict[str, Any], hours: float = HOURS) -> Iterator[Row]:
    """Yield the ground as it is, then each scenario."""
    layers = {key: gpd.read_file(asked["file"], layer=name)
              for key, name in asked["layers"].items()}  # fmt: skip
    roads = layers["streets"]
    around = surroundings(asked, layers["site"], roads)
    prepared = prepare_sites(layers["site"], roads, snap_distance=asked["snap_distance"])
    ground = site_layers(prepared)["site"]
    # today nothing runs through the site: who is in it goes to the streets along its edge
    edge = ground.assign(geometry=ground.buffer(EDGE))
    yield _measured("b", "the streets that are there", 0.0, np.nan, around, edge, None, hours)
    for scenario in asked["scenarios"]:
        plan, made = _designed(asked, scenario, layers["site"], roads)
        new = made["streets"][made["streets"]["status"] != "existing"].to_crs(around.crs)
        streets = pd.concat([new, around], ignore_index=True)
        gates = made["junctions"][made["junctions"]["is_sink"].astype(bool)]
        yield _measured(
            scenario["name"], scenario["says"], plan["TOTAL_LENGTH"], plan["MEAN_DISTANCE"],
            streets, ground, gates, hours,
        )  # fmt: skip


def surroundings(
    asked: dict[str, Any], site: gpd.GeoDataFrame, roads: gpd.GeoDataFrame
) -> gpd.GeoDataFrame:
    """Return the streets around the site on which trips may go, one-way ones as they are."""
    given = asked.get("around")
    if given is None:
        return roads.assign(status="existing").reset_index(drop=True)
    near = site.union_all().buffer(given["metres"])
    town = gpd.read_file(DATA / given["file"], layer=given["layer"]).to_crs(site.crs)
    # the site's own file tells more, but of the nearest streets and without directions
    more = roads[~roads.within(town.union_all().buffer(1.0))]
    streets = pd.concat([town, more], ignore_index=True)
    streets = streets[streets.intersects(near) & ~streets["highway"].isin(given["without"])]
    return streets.assign(status="existing").reset_index(drop=True)


def _designed(
    asked: dict[str, Any], scenario: dict[str, Any], site: gpd.GeoDataFrame, roads: gpd.GeoDataFrame
) -> tuple[dict[str, float], dict[str, Any]]:
    """Design the streets of a scenario: its numbers and layers."""
    wished = scenario.get("wishes", {})
    rings = wished.get("obstacles", [])
    free = gpd.GeoDataFrame(
        {"name": [own["name"] for own in rings]},
        geometry=[Polygon(own["ring"]) for own in rings],
        crs=site.crs,
    )
    prepared = prepare_sites(
        site, roads, free if len(free) else None, snap_distance=asked["snap_distance"]
    )
    own = {**asked["specification"], **scenario.get("specification", {})}
    specification = Specification.from_json(json.dumps({**own, "time_limit": asked["seconds"]}))
    required = [LineString(line) for line in wished.get("required", [])]
    plan = design_streets(prepared.sites, specification, wishes=Wishes(required=required))
    return plan.numbers, plan_layers(plan)


def _measured(
    name: str, says: str, length: float, distance: float, streets: gpd.GeoDataFrame,
    ground: gpd.GeoDataFrame, gates: gpd.GeoDataFrame | None, hours: float,
) -> Row:  # fmt: skip
    """Send trips over streets, one kind after the other."""
    found: dict[str, Kind] = {}
    for key, kind in KINDS.items():
        if gates is None and kind == INTERIOR_BOUNDARY:
            continue  # nothing leaves by streets that are not there
        rules = DemandRules(density=DENSITY, shares={kind: 1.0})
        traffic = read_traffic(streets, DemandLayers(site=ground, gates=gates),
                               TrafficOptions(demand=rules))  # fmt: skip
        found[key], loaded = _driven(traffic, key, kind, hours)
        network = traffic.network
    inside = inner_pieces(network, place := ground.to_crs(network.crs).union_all(), is_site=True)
    tree = shapely.STRtree(network.lines[inside])
    bits = shapely.points(even_samples(place))
    access = float(tree.query_nearest(bits, return_distance=True, all_matches=False)[1].mean())
    return Row(name, says, length, distance, access, found, loaded, ground)


def _driven(traffic: Traffic, key: str, kind: str, hours: float) -> tuple[Kind, gpd.GeoDataFrame]:
    numbers = report_traffic(traffic).numbers
    options = SimulationOptions(hours=hours, routes="shortest", seed=1)
    made = simulate(traffic.network, traffic.demand, options)
    pieces = pieces_layer(traffic.network, traffic.streets).reset_index(drop=True)
    flow = street_columns(traffic.network, made)["flow_veh_h"].to_numpy()
    return Kind(
        metres=numbers[f"distance_{key}"],
        seconds=numbers[f"time_{key}"],
        driven_metres=made.flows.distance[kind],
        driven_seconds=made.flows.time[kind],
        trips=made.counts.drawn,
        arrived=made.finished[kind],
    ), pieces.assign(flow_veh_h=flow)
