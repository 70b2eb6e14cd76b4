"""A street plan as ordinary layers, in the CRS of the input."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import LineString, Point

from ..site.types import BoundaryStreet
from .adopt import existing_lines
from .joints import TIP, split_at
from .site_plan import SitePlan, StreetPlan

#: Speeds by level, km/h: 40, 30, 20 and 20 miles per hour (CND section 5.1).
SPEED = {1: 64.0, 2: 48.0, 3: 32.0, 4: 32.0}

#: Road classes (OpenStreetMap and common local ones) -> level of an existing street.
CLASS_LEVEL = {
    **dict.fromkeys(("motorway", "trunk", "primary", "secondary"), 1),
    **dict.fromkeys(("tertiary", "collector"), 2),
}

#: Blocks longer than this many times the wished length are named.
LONG = 1.8  #: Exits moved by more than this are named (metres).
MOVED = 5.0

COLUMNS: Mapping[str, Sequence[str]] = {
    "streets": (
        "street_id",
        "site_id",
        "level",
        "status",
        "length_m",
        "dist_to_sink_m",
        "dist_start_m",
        "dist_end_m",
        "direction",
        "speed_kmh",
        "name",
    ),
    "junctions": ("junction_id", "site_id", "valence", "is_sink", "dist_to_sink_m", "kind"),
    "blocks": ("block_id", "site_id", "area_m2", "perimeter_m", "width_m", "length_m"),
    "problems": ("layer", "feature", "problem", "action", "severity"),
}

Row = dict[str, Any]


def plan_layers(plan: StreetPlan) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of a street plan.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        "streets": new streets between junctions, their connectors to the centre lines of
        existing streets, and the existing streets beside the site. "junctions", "blocks" and
        "problems" as their columns say (`COLUMNS`); lengths and distances in metres, areas in
        square metres, speeds in km/h, measured in the working CRS.
    """
    parts: dict[str, list[gpd.GeoDataFrame]] = {key: [] for key in COLUMNS}
    source = plan.plans[0].site.source_crs if plan.plans else CRS.from_epsg(4326)
    for own in plan.plans:
        rows: dict[str, Iterable[Row]] = {
            "streets": [*_new_streets(own), *_existing_streets(own)],
            "junctions": _junctions(own),
            "blocks": _blocks(own),
            "problems": _problems(own),
        }
        for key, values in rows.items():
            parts[key].append(_frame(values, COLUMNS[key], own.site.crs, source))
    for site, error in plan.failures:
        row = {
            "layer": site.name,
            "feature": str(site.feature),
            "problem": str(error),
            "action": "this site has no streets",
            "severity": "error",
            "geometry": site.polygon.representative_point(),
        }
        parts["problems"].append(_frame([row], COLUMNS["problems"], site.crs, source))
    layers = {}
    for key, frames in parts.items():
        full = [frame for frame in frames if len(frame)]
        joined = (
            pd.concat(full, ignore_index=True) if full else _frame([], COLUMNS[key], source, source)
        )
        if not key.startswith("problem"):
            joined[f"{key[:-1]}_id"] = np.arange(1, len(joined) + 1)
        layers[key] = gpd.GeoDataFrame(joined, geometry="geometry", crs=source)
    return layers


def _frame(given: Iterable[Row], columns: Sequence[str], crs: CRS, source: CRS) -> gpd.GeoDataFrame:
    """Rows as a frame in the source CRS."""
    rows = list(given)
    data = {c: [row.get(c) for row in rows] for c in columns}
    geometry = gpd.GeoSeries([row["geometry"] for row in rows], crs=crs)
    frame = gpd.GeoDataFrame(data, geometry=geometry, crs=crs)
    return frame if crs == source else frame.to_crs(source)


def _new_streets(plan: SitePlan) -> Iterable[Row]:
    """Designed streets and their connectors."""
    site_id = plan.site.site_id
    for s in plan.segments:
        yield {
            "site_id": site_id,
            "level": s.level,
            "status": "new",
            "length_m": s.line.length,
            "dist_to_sink_m": s.distance,
            "dist_start_m": s.dist_start,
            "dist_end_m": s.dist_end,
            "direction": s.direction,
            "speed_kmh": SPEED[s.level],
            "name": "",
            "geometry": s.line,
        }
    reached = {
        v: d for s in plan.segments for v, d in ((s.start, s.dist_start), (s.end, s.dist_end))
    }
    for joint in plan.connectors:
        out = reached.get(joint.node)
        yield {
            "site_id": site_id,
            "level": joint.level,
            "status": "connector",
            "length_m": joint.line.length,
            "dist_to_sink_m": out,
            "dist_start_m": out,
            "dist_end_m": out,
            "direction": 1,
            "speed_kmh": SPEED[joint.level],
            "name": joint.arrival.name if joint.arrival is not None else "",
            "geometry": joint.line,
        }


def _existing_streets(plan: SitePlan) -> Iterable[Row]:
    """Give the streets beside the site and those kept inside, cut where new ones join them."""
    site = plan.site
    joints = [joint.line.coords[-1] for joint in plan.connectors]
    joints += [xy for s in plan.segments for xy in (s.line.coords[0], s.line.coords[-1])]
    tips = shapely.boundary(shapely.line_merge(existing_lines(site)))
    for street in (*site.boundary_streets, *site.inner_streets):
        own = existing_level(street)
        for line in _without_stubs(split_at(street.line, joints), tips):
            yield {
                "site_id": site.site_id,
                "level": own,
                "status": "existing",
                "length_m": line.length,
                "dist_to_sink_m": None,
                "dist_start_m": None,
                "dist_end_m": None,
                "direction": 0,
                "speed_kmh": SPEED[own],
                "name": street.name,
                "geometry": line,
            }


def _without_stubs(pieces: list[LineString], tips: shapely.Geometry) -> list[LineString]:
    """Leave out a blind end that reaches hardly beyond the new street that meets it."""
    kept = list(pieces)
    for last, end in ((0, 0), (-1, -1)):
        short = len(kept) > 1 and kept[last].length < TIP
        if short and tips.distance(Point(kept[last].coords[end])) == 0:
            kept.pop(last)
    return kept


def existing_level(street: BoundaryStreet) -> int:
    """Level of an existing street by its class; local where the class says nothing."""
    return CLASS_LEVEL.get(street.kind.lower().removesuffix("_link"), 3)


def _junctions(plan: SitePlan) -> Iterable[Row]:
    """Where streets meet, end or leave the site."""
    ground = plan.network.ground
    mesh = ground.mesh
    arriving = {joint.node for joint in plan.connectors if joint.arrival is not None}
    arriving |= set(ground.arrivals)
    meeting: dict[int, list[tuple[float, tuple[float, float]]]] = {}
    for s in plan.segments:
        meeting.setdefault(s.start, []).append((s.dist_start, s.line.coords[0]))
        meeting.setdefault(s.end, []).append((s.dist_end, s.line.coords[-1]))
    for v in sorted(meeting):
        distance, xy = meeting[v][0]
        if v < 0 or v >= len(mesh.vertices):
            frontage = 2 if v < 0 else 0
        else:
            frontage = int(sum(ground.street[e] for e in mesh.vertex_edges[v]))
        valence = len(meeting[v]) + frontage
        if v in arriving:
            kind, valence = "continues street", valence + 1
        elif frontage:
            kind = "meets street"
        else:
            kind = {1: "dead end", 2: "bend", 3: "T-junction"}.get(valence, "crossing")
        yield {
            "site_id": plan.site.site_id,
            "valence": valence,
            "is_sink": distance == 0.0,
            "dist_to_sink_m": distance,
            "kind": kind,
            "geometry": Point(xy),
        }


def _blocks(plan: SitePlan) -> Iterable[Row]:
    """Blocks and their sizes."""
    for block in plan.blocks:
        yield {
            "site_id": plan.site.site_id,
            "area_m2": block.polygon.area,
            "perimeter_m": block.polygon.length,
            "width_m": block.width,
            "length_m": block.length,
            "geometry": block.polygon,
        }


def _problems(plan: SitePlan) -> Iterable[Row]:
    """List what could not be had, place by place."""
    spec = plan.specification
    for xy in plan.uncovered:
        yield _problem(
            plan,
            Point(xy),
            "No street comes near this place.",
            "left without a street: obstacles, walls or a bottleneck allow none",
        )
    for block in plan.blocks:
        if block.length > LONG * spec.block_length and block.width > 0.5 * spec.block_width:
            yield _problem(
                plan,
                block.polygon.representative_point(),
                f"This block is {block.length:.0f} m long, the wished length is "
                f"{spec.block_length:g} m.",
                "left so: no street may end at a side of the site without a road; add the road "
                "layer, raise the snap distance or let the whole boundary be the exit",
            )
    ground = plan.network.ground
    for xy, v in ground.exits.items():
        gap = math.dist(xy, plan.alignment.positions[v])
        if gap > MOVED:
            yield _problem(
                plan,
                Point(xy),
                f"Streets leave {gap:.0f} m from the exit given here.",
                "moved to the nearest corner of a block; draw a mesh to have it exactly here",
                "info",
            )
    for point in plan.not_continued:
        yield _problem(
            plan,
            Point(point.xy),
            f"The existing street {point.name or 'without a name'} that arrives here is not "
            "continued.",
            "left so: it would cost more than it is worth; raise the weight of continuing",
            "info",
        )


def _problem(
    plan: SitePlan, place: Point, problem: str, action: str, severity: str = "warning"
) -> Row:
    """Make a row of the problems layer."""
    return {
        "layer": plan.site.name,
        "feature": str(plan.site.feature),
        "problem": problem,
        "action": action,
        "severity": severity,
        "geometry": place,
    }
