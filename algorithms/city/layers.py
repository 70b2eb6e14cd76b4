"""The streets of a whole city as ordinary layers, in the CRS of the municipality."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import LineString, Point

from ..levels import LEVEL_NAMES
from ..network.specification import Specification
from ..site.types import BoundaryStreet
from ..streets.hierarchy import speed_kmh
from ..streets.joints import split_at
from ..streets.layers import existing_level
from .agreement import CROSSING, STAGGERED, UNUSED, Agreement
from .region import KEPT, line_of
from .run import CityPlan
from .types import City

COLUMNS: Mapping[str, Sequence[str]] = {
    "streets": ("street_id", "sub_region", *KEPT, "name", "level_name"),
    "sub_regions": (
        "sub_region", "area_ha", "state", "reason", "attempts", "seconds", "objective", "bound",
        "gap_pct", "length_m", "mean_distance_m", "junctions", "key",
    ),
    "junctions": (
        "junction_id", "kind", "state", "road", "sub_regions", "offset_m",
    ),
    "problems": ("layer", "feature", "problem", "action", "severity"),
}  # fmt: skip

Row = dict[str, Any]


def city_layers(plan: CityPlan) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of a designed city.

    Parameters
    ----------
    plan
        What `design_city` returned.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        "streets": new streets with their sub-region, then the roads between sub-regions and the
        pieces across their middle. "sub_regions", "junctions" and "problems" as `COLUMNS` says.
        Lengths and distances in metres, areas in hectares, measured in the working CRS.
    """
    city, agreed = plan.city, plan.agreement
    roads = list(_roads(city, agreed, plan.specification))
    rows: dict[str, list[Row]] = {
        "streets": [*_streets(agreed), *roads],
        "sub_regions": list(_sub_regions(plan)),
        "junctions": list(_junctions(agreed)),
        "problems": list(_problems(plan)),
    }
    for i, row in enumerate(rows["streets"]):
        row["street_id"] = i + 1
    for i, row in enumerate(rows["junctions"]):
        row["junction_id"] = i + 1
    layers = {key: _frame(own, COLUMNS[key], city) for key, own in rows.items()}
    if len(city.problems):
        layers["problems"] = gpd.GeoDataFrame(
            pd.concat(
                [city.problems[[*COLUMNS["problems"], "geometry"]], layers["problems"]],
                ignore_index=True,
            ),
            geometry="geometry",
            crs=city.source_crs,
        )
    return layers


def _frame(rows: Sequence[Row], columns: Sequence[str], city: City) -> gpd.GeoDataFrame:
    """Rows as a frame in the CRS of the municipality."""
    data = {c: [row.get(c) for row in rows] for c in columns}
    geometry = gpd.GeoSeries([row["geometry"] for row in rows], crs=city.crs)
    frame = gpd.GeoDataFrame(data, geometry=geometry, crs=city.crs)
    return frame if city.crs == city.source_crs else frame.to_crs(city.source_crs)


def _streets(agreed: Agreement) -> Iterator[Row]:
    """Designed streets of all sub-regions."""
    for number, rows in agreed.streets.items():
        for row in rows:
            fields = {name: row[name] for name in KEPT}
            yield {
                **fields,
                "sub_region": number,
                "name": "",
                "level_name": LEVEL_NAMES[int(row["level"])],
                "geometry": line_of(row),
            }


def _roads(city: City, agreed: Agreement, spec: Specification) -> Iterator[Row]:
    """Roads between sub-regions, cut where streets meet them, and the pieces across."""
    used = [xy for m in agreed.meetings if m.state != UNUSED for xy in m.sides.values()]
    points = shapely.points(np.array(used, dtype=float).reshape(-1, 2))
    tree = shapely.STRtree(points)
    for road in city.roads:
        near = tree.query(road.line, predicate="dwithin", distance=0.1)
        level = 2 if road.new else existing_level(BoundaryStreet(road.line, kind=road.kind))
        at = [used[i] for i in np.sort(near).tolist()]
        for line in split_at(road.line, at):
            status = "new" if road.new else "existing"
            yield _road(line, level, status, road.name, spec)
    for line, name in agreed.links:
        yield _road(line, 3, "connector", name, spec)


def _road(line: LineString, level: int, status: str, name: str, spec: Specification) -> Row:
    """Give the row of a street of no sub-region."""
    return {
        "sub_region": None,
        "level": level,
        "level_name": LEVEL_NAMES[level],
        "speed_kmh": speed_kmh(spec, level),
        "status": status,
        "length_m": float(line.length),
        "direction": 0,
        "name": name,
        "geometry": line,
    }


def _sub_regions(plan: CityPlan) -> Iterator[Row]:
    """Give all sub-regions and what came of them."""
    for region in plan.city.regions:
        outcome = plan.outcomes[region.number]
        numbers = {} if outcome.result is None else outcome.result["numbers"]
        gap = numbers.get("achieved_gap")
        yield {
            "sub_region": region.number,
            "area_ha": region.polygon.area / 1e4,
            "state": outcome.state,
            "reason": outcome.reason,
            "attempts": outcome.attempts,
            "seconds": None if outcome.result is None else outcome.result["seconds"],
            "objective": numbers.get("objective"),
            "bound": numbers.get("bound"),
            "gap_pct": None if gap is None else 100.0 * gap,
            "length_m": numbers.get("total_length"),
            "mean_distance_m": numbers.get("mean_distance"),
            "junctions": sum(region.number in j.sides for j in plan.city.junctions),
            "key": outcome.key,
            "geometry": region.polygon,
        }


def _junctions(agreed: Agreement) -> Iterator[Row]:
    """Give the places where streets meet the roads between sub-regions, or might."""
    for meeting in agreed.meetings:
        planned = meeting.planned
        sides = meeting.sides or (planned.sides if planned is not None else {})
        yield {
            "kind": "free" if planned is None else planned.kind,
            "state": meeting.state,
            "road": "" if planned is None else planned.road,
            "sub_regions": ", ".join(str(n) for n in sorted(meeting.sides)),
            "offset_m": 0.0 if meeting.state == CROSSING else meeting.offset,
            "geometry": Point(next(iter(sides.values()))),
        }


def _problems(plan: CityPlan) -> Iterator[Row]:
    """Say which sub-regions failed and why, what they remarked, and where sides disagree."""
    for region in plan.city.regions:
        outcome = plan.outcomes[region.number]
        common = {
            "layer": "Sub-regions",
            "feature": str(region.number),
            "geometry": region.polygon.representative_point(),
        }
        if outcome.state == "failed":
            yield {
                **common,
                "problem": f"sub-region {region.number} failed: {outcome.reason}",
                "action": "it has no new streets; run again with the same file to try it once more",
                "severity": "error",
            }
        remarks = [] if outcome.result is None else list(outcome.result["remarks"])
        if outcome.result is not None and outcome.result["by_clock"]:
            remarks.append("the time limit ended it: another run may give other streets")
        for text in remarks:
            named = text.replace("the sub-region", f"sub-region {region.number}")
            yield {**common, "problem": named, "action": "kept as it is", "severity": "warning"}
    for meeting in plan.agreement.meetings:
        if meeting.state == STAGGERED:
            yield {
                "layer": "Junctions",
                "feature": ", ".join(str(n) for n in sorted(meeting.sides)),
                "problem": f"streets of two sub-regions end {meeting.offset:.0f} m apart on a road",
                "action": "move one of them by hand, or close one",
                "severity": "warning",
                "geometry": Point(next(iter(meeting.sides.values()))),
            }
