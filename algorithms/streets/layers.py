"""A street plan as ordinary layers, in the CRS of the input."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import LineString, Point

from ..errors import PlatwrightError
from ..levels import LEVEL_NAMES
from ..network.specification import Specification
from ..site.types import BoundaryStreet, Site
from .adopt import existing_lines
from .hierarchy import speed_kmh
from .joints import TIP, split_at
from .limits import or_limits
from .site_plan import SitePlan, StreetPlan
from .unmet import unmet_requirements
from .why_not import NoDesignError

#: Road classes (OpenStreetMap and common local ones) -> level of an existing street.
CLASS_LEVEL = {
    **dict.fromkeys(("motorway", "trunk", "primary", "secondary"), 1),
    **dict.fromkeys(("tertiary", "collector"), 2),
}

#: Junctions of two sub-regions that are nearer than this are one (metres).
SAME = 0.1
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
        "level_name",
        "turning_m",
        "oneway",
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
        existing streets, and the existing streets beside the site and given ones in it.
        "junctions", "blocks" and
        "problems" as their columns say (`COLUMNS`); lengths and distances in metres, areas in
        square metres, speeds in km/h, measured in the working CRS.
    """
    parts: dict[str, list[gpd.GeoDataFrame]] = {key: [] for key in COLUMNS}
    sites = [own.site for own in plan.plans] + [site for site, _ in plan.failures]
    source = sites[0].source_crs if sites else CRS.from_epsg(4326)
    for group in plan.by_site:
        new = [row for own in group for row in _new_streets(own)]
        rows: dict[str, Iterable[Row]] = {
            "streets": [*new, *_existing_streets(group)],
            "junctions": _junctions_of(group),
            "blocks": [row for own in group for row in _blocks(own)],
            "problems": [row for own in group for row in _problems(own)],
        }
        for key, values in rows.items():
            parts[key].append(_frame(values, COLUMNS[key], group[0].site.crs, source))
    for site, error in plan.failures:
        parts["problems"].append(
            _frame(_failure(site, error), COLUMNS["problems"], site.crs, source)
        )
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


def _failure(site: Site, error: PlatwrightError) -> Iterator[Row]:
    """Say why a site has no design, and where."""
    common = {"layer": site.name, "feature": str(site.feature), "severity": "error"}
    yield {
        **common,
        "problem": str(error),
        "action": "this site has no streets",
        "geometry": site.polygon.representative_point(),
    }
    for place in error.places if isinstance(error, NoDesignError) else ():
        yield {
            **common,
            "problem": place.problem,
            "action": place.action,
            "geometry": place.point,
        }


def _new_streets(plan: SitePlan) -> Iterable[Row]:
    """Designed streets and their connectors."""
    site_id, spec = plan.site.site_id, plan.specification
    for s in plan.segments:
        turns = s.blind and spec.turning_radius > 0
        yield {
            "site_id": site_id,
            **_of_level(s.level, spec),
            "turning_m": spec.turning_radius if turns else None,
            "oneway": s.one_way,
            "status": "new",
            "length_m": s.line.length,
            "dist_to_sink_m": s.distance,
            "dist_start_m": s.dist_start,
            "dist_end_m": s.dist_end,
            "direction": s.direction,
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
            **_of_level(joint.level, spec),
            "status": "connector",
            "length_m": joint.line.length,
            "dist_to_sink_m": out,
            "dist_start_m": out,
            "dist_end_m": out,
            "direction": 1,
            "name": joint.arrival.name if joint.arrival is not None else "",
            "geometry": joint.line,
        }


def _existing_streets(plans: Sequence[SitePlan]) -> Iterator[Row]:
    """Give the streets beside a site and those kept or given inside, cut where new ones join."""
    site, division, spec = plans[0].whole, plans[0].division, plans[0].specification
    joints = [joint.line.coords[-1] for plan in plans for joint in plan.connectors]
    lines = [s.line for plan in plans for s in plan.segments]
    if division is not None:
        joints += [joint.line.coords[-1] for joint in division.connectors]
        lines += [street.line for street in division.streets]
    joints += [xy for line in lines for xy in (line.coords[0], line.coords[-1])]
    tips = shapely.boundary(shapely.line_merge(existing_lines(site)))
    for street in (*site.boundary_streets, *site.inner_streets):
        own = existing_level(street)
        for line in _without_stubs(split_at(street.line, joints), tips):
            yield {**_not_new(site.site_id, own, spec, line), "name": street.name}
    if division is None:
        return
    for given in division.streets:
        for line in split_at(given.line, joints):
            yield {**_not_new(site.site_id, given.level, spec, line), "status": "given"}
    for joint in division.connectors:
        for line in split_at(joint.line, joints):
            yield {**_not_new(site.site_id, joint.level, spec, line), "status": "given"}


def _not_new(site_id: int, level: int, spec: Specification, line: LineString) -> Row:
    """Give the row of a street that was not designed."""
    return {
        "site_id": site_id,
        **_of_level(level, spec),
        "status": "existing",
        "length_m": line.length,
        "dist_to_sink_m": None,
        "dist_start_m": None,
        "dist_end_m": None,
        "direction": 0,
        "name": "",
        "geometry": line,
    }


def _of_level(level: int, spec: Specification) -> Row:
    """Give what the level of a street says."""
    return {"level": level, "level_name": LEVEL_NAMES[level], "speed_kmh": speed_kmh(spec, level)}


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


def _junctions_of(plans: Sequence[SitePlan]) -> list[Row]:
    """Junctions of a site; at a given street those of both sides are one."""
    rows = [row for plan in plans for row in _junctions(plan)]
    if len(plans) == 1:
        return rows
    found: dict[tuple[int, int], Row] = {}
    for row in rows:
        key = (round(row["geometry"].x / SAME), round(row["geometry"].y / SAME))
        other = found.get(key)
        if other is None:
            found[key] = row
            continue
        # each side counts the given street, and one that goes on counts the other side, too
        both = row["valence"] + other["valence"] - 2
        if "continues street" in (row["kind"], other["kind"]):
            both = max(row["valence"], other["valence"])
        found[key] = {**other, "valence": both, "kind": "meets street"}
    return list(found.values())


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
    limits = or_limits(spec)
    for xy in plan.uncovered:
        yield _problem(
            plan,
            Point(xy),
            "No street comes near this place.",
            f"left without a street: obstacles, walls or a bottleneck allow none{limits}",
        )
    for block in plan.blocks:
        if block.length > LONG * spec.block_length and block.width > 0.5 * spec.block_width:
            yield _problem(
                plan,
                block.polygon.representative_point(),
                f"This block is {block.length:.0f} m long, the wished length is "
                f"{spec.block_length:g} m.",
                "left so: no street may end at a side of the site without a road; add the road "
                f"layer, raise the snap distance or let the whole boundary be the exit{limits}",
            )
    for remark in unmet_requirements(plan.network):
        yield _problem(plan, remark.point, remark.problem, remark.action)
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
        "layer": plan.whole.name,
        "feature": str(plan.whole.feature),
        "problem": problem,
        "action": action,
        "severity": severity,
        "geometry": place,
    }
