"""A municipality cut by its major roads into sub-regions (CND section 5.1, CND-x Fig. 5)."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon

from ..errors import InputError
from ..progress import Progress, Share, Silent
from ..site import prepare_sites
from ..site.repair import Problems
from ..site.types import BoundaryStreet, PreparedSites, Site
from ..site.watch import ask
from .faces import ON, RoadEdges, cut, faces_of, in_order, is_street_space, noded, without_obstacles
from .junctions import plan_junctions
from .roads import read_roads
from .rules import CityRules
from .types import DESIGN, LEFT, City, DividingRoad, SubRegion

#: Obstacles that cover at least this, or that much of a face, cut the ground (square metres).
CUTTING = 5000.0
#: Outlines of such obstacles are simplified by this (metres).
SMOOTH = 2.0
#: What is smaller than this is no ground at all (square metres).
SCRAP = 50.0
#: Class of a new road that cuts what is too large.
CUT = "new collector"
#: Streets can enter where roads run along this length of the edge at least (metres).
LEAST_FRONTAGE = 20.0


def divide_city(
    municipality: gpd.GeoDataFrame,
    roads: gpd.GeoDataFrame,
    obstacles: gpd.GeoDataFrame | None = None,
    rules: CityRules | None = None,
    *,
    polygon_layer: str = "Municipality",
    road_layer: str = "Roads",
    obstacle_layer: str = "Obstacles",
    progress: Progress | None = None,
) -> City:
    """Cut a municipality by its major roads and plan the junctions along them.

    Parameters
    ----------
    municipality
        One or several polygons in any CRS; they are designed together.
    roads
        Lines with a road class or a level.
    obstacles
        Polygons that stay free of streets: water, parks, railways; or None.
    rules
        Which roads divide, and sizes; None for the usual ones.
    polygon_layer, road_layer, obstacle_layer
        Names of the layers, for messages.
    progress
        Told of stages; asked for cancellation.

    Returns
    -------
    City
        Sub-regions in a stable order, roads between them and planned junctions.

    Raises
    ------
    InputError
        If a layer cannot be used, no road divides the municipality, or it spans more than one
        projection in metres can hold.
    CancelledError
        If the caller cancels.
    """
    rules, progress = rules or CityRules(), progress or Silent()
    prepared = prepare_sites(
        municipality,
        None,
        obstacles,
        polygon_layer=polygon_layer,
        obstacle_layer=obstacle_layer,
        without_roads="",
        progress=Share(progress, 0.0, 0.3),
    )
    sites, crs = prepared.sites, prepared.sites[0].crs
    if any(site.crs != crs for site in sites):
        raise InputError(
            "its polygons are so far apart that no projection in metres holds all of them.",
            "Run one municipality at a time.",
            layer=polygon_layer,
        )
    city = [site.polygon for site in sites]
    whole = shapely.union_all(np.array(city, dtype=object))
    found = read_roads(roads, rules, crs, whole, road_layer, progress)
    progress.stage("Dividing the municipality", 0.4)
    edges = noded(found, city)
    ask(progress)
    faces = faces_of(edges, city)
    thin = [is_street_space(face, rules.thin) for face in faces]
    space = shapely.union_all(np.array([f for f, t in zip(faces, thin) if t], dtype=object))
    ground = [face for face, t in zip(faces, thin) if not t]
    regions, cuts = _regions(ground, sites, rules, progress)
    progress.stage("Streets along the sub-regions", 0.6)
    regions = _with_roads(regions, _all_edges(edges, cuts), progress)
    dividing = _dividing(edges, cuts)
    progress.stage("Planning junctions", 0.8)
    junctions = plan_junctions(regions, dividing, space, found.minor, rules, progress)
    regions = _served(regions, {number for own in junctions for number in own.sides})
    return City(
        name=sites[0].name if len(sites) == 1 else polygon_layer,
        crs=crs,
        source_crs=sites[0].source_crs,
        rules=rules,
        regions=tuple(regions),
        roads=tuple(dividing),
        junctions=tuple(junctions),
        street_space=space,
        problems=_told(prepared, regions, polygon_layer),
    )


def _dividing(edges: RoadEdges, cuts: Sequence[LineString]) -> list[DividingRoad]:
    """Return the roads between sub-regions, those that are there first."""
    old = [
        DividingRoad(line, str(name), str(kind), closed=bool(closed))
        for line, name, kind, closed in zip(edges.lines, edges.names, edges.kinds, edges.closed)
    ]
    return old + [DividingRoad(line, kind=CUT, level=2, new=True) for line in cuts]


def _served(regions: Sequence[SubRegion], served: set[int]) -> list[SubRegion]:
    """Leave sub-regions as they are along which there is no place for a junction."""
    return [
        dataclasses.replace(
            region, state=LEFT, reason="the roads along it leave no place for a junction"
        )
        if region.state == DESIGN and region.number not in served
        else region
        for region in regions
    ]


def _told(prepared: PreparedSites, regions: Sequence[SubRegion], layer: str) -> gpd.GeoDataFrame:
    """Join what is told of sub-regions that stay as they are to the repairs."""
    problems, site = Problems(), prepared.sites[0]
    for region in regions:
        if region.state == LEFT:
            problems.add(
                layer,
                region.number,
                f"sub-region {region.number} stays as it is: {region.reason}",
                "design it by hand, or choose other limits",
                "info",
                region.polygon.representative_point(),
                site.crs,
            )
    frames = [f for f in (prepared.problems, problems.to_frame(site.source_crs)) if len(f)]
    return pd.concat(frames, ignore_index=True) if frames else prepared.problems


def _regions(
    faces: Sequence[Polygon], sites: Sequence[Site], rules: CityRules, progress: Progress
) -> tuple[list[SubRegion], list[LineString]]:
    """Take obstacles out of the faces, cut what is too large, and number what is left."""
    every = [o for site in sites for o in site.obstacles]
    united = shapely.get_parts(shapely.union_all(np.array(every, dtype=object)))
    large = united[shapely.area(united) >= CUTTING]
    cutting = shapely.make_valid(shapely.simplify(shapely.union_all(large), SMOOTH))
    small = united[shapely.area(united) < CUTTING]
    tree = shapely.STRtree(small)
    found: list[tuple[Polygon, str]] = []
    lines: list[LineString] = []
    for face in faces:
        ask(progress)
        for part in without_obstacles(face, cutting):
            if part.area < SCRAP:
                continue
            if part.area < 1e4 * rules.least_ha:
                found.append((part, f"it is smaller than {rules.least_ha:g} ha"))
                continue
            if is_street_space(part, rules.thin):
                found.append((part, "it is a narrow strip"))
                continue
            pieces, more = cut(part, 1e4 * rules.most_ha, 1e4 * rules.least_ha)
            found += [(piece, "") for piece in pieces]
            lines += more
    reasons = {id(polygon): reason for polygon, reason in found}
    regions = []
    for i, polygon in enumerate(in_order([p for p, _ in found])):
        reason = reasons[id(polygon)]
        inside = shapely.intersection(small[np.sort(tree.query(polygon))], polygon)
        kept = [p for p in shapely.get_parts(inside) if p.geom_type == "Polygon" and p.area > 1]
        state = LEFT if reason else DESIGN
        regions.append(SubRegion(i + 1, polygon, state, reason, obstacles=tuple(kept)))
    return regions, lines


def _all_edges(edges: RoadEdges, cuts: Sequence[LineString]) -> RoadEdges:
    """Join new collectors to the roads."""
    n = len(cuts)
    return RoadEdges(
        np.concatenate([edges.lines, np.array(cuts, dtype=object)]),
        np.concatenate([edges.names, np.full(n, "", dtype=object)]),
        np.concatenate([edges.kinds, np.full(n, CUT, dtype=object)]),
        np.concatenate([edges.closed, np.zeros(n, dtype=np.bool_)]),
    )


def _with_roads(
    regions: Sequence[SubRegion], edges: RoadEdges, progress: Progress
) -> list[SubRegion]:
    """Find the roads along each sub-region; one that only motorways surround stays as it is."""
    tree = edges.tree()
    found = []
    for region in regions:
        ask(progress)
        ring = region.polygon.boundary
        near = np.sort(tree.query(region.polygon, predicate="dwithin", distance=ON))
        near = near[~edges.closed[near]]
        lines = edges.lines[near]
        along = shapely.length(shapely.intersection(lines, shapely.buffer(ring, ON)))
        beside = (along > 0.5 * shapely.length(lines)) | (along > LEAST_FRONTAGE)
        middle = shapely.line_interpolate_point(lines, 0.5, normalized=True)
        inside = ~beside & (shapely.length(lines) > 5.0)
        inside &= shapely.intersects(shapely.buffer(region.polygon, -1.0), middle)
        band = shapely.buffer(shapely.union_all(lines[beside]), ON)
        shared = shapely.get_parts(shapely.intersection(ring, band))
        merged = shapely.line_merge(MultiLineString([p for p in shared if p.length > 5 * ON]))
        frontage = MultiLineString([p for p in shapely.get_parts(merged) if p.length > 0])
        state, reason = region.state, region.reason
        if state == DESIGN and frontage.length < LEAST_FRONTAGE:
            state, reason = LEFT, "no road that gives access runs along it"
        found.append(
            dataclasses.replace(
                region,
                state=state,
                reason=reason,
                frontage=frontage,
                beside=_streets(edges, near[beside]),
                inside=_streets(edges, near[inside]),
            )
        )
    return found


def _streets(edges: RoadEdges, which: np.ndarray) -> tuple[BoundaryStreet, ...]:  # type: ignore[type-arg]
    """Return pieces of road as streets."""
    return tuple(
        BoundaryStreet(edges.lines[i], str(edges.names[i]), str(edges.kinds[i])) for i in which
    )
