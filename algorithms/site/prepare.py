"""From the planner's layers to sites: read, repair, project, snap, find the streets around."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Point, Polygon

from ..errors import InputError
from ..progress import Progress, Silent
from .access import access_points
from .crs import DISTORTION, distortion, layer_crs, transformer, working_crs
from .dissolve import dissolve
from .frontage import frontage
from .inner import inner_streets
from .repair import NO_AREA, POLYGON_TYPE, Geometries, Problems, overlay, repair_polygons
from .roadnetwork import RoadNetwork
from .roads import RoadLayer
from .types import SNAP_COLUMN, AccessPoint, BoundaryStreet, PreparedSites, Site
from .watch import ask, in_chunks

SMALLEST_OBSTACLE = 25.0
"""Smaller obstacles are left out, square metres."""

NO_ROADS = (
    "No road layer is given: the whole outer edge of each site counts as street, and there are no "
    "access points."
)
"""What it means for most that there are no roads."""

NO_FRONTAGE = "the site has no street frontage"
"""Begins what to do about sites without a road along their edge."""

_WAY_IN = 25.0
_NAME_COLUMNS = ("name", "site", "label", "nom", "libelle")

InnerRoads = Literal["ignore", "keep"]


@dataclass(frozen=True)
class _Task:
    """What stays the same for all sites of a run."""

    source_crs: CRS
    layer: str
    roads: RoadLayer | None
    road_layer: str
    obstacles: _Obstacles | None
    snap_distance: float
    inner_roads: InnerRoads
    problems: Problems


def prepare_sites(
    polygons: gpd.GeoDataFrame,
    roads: gpd.GeoDataFrame | None = None,
    obstacles: gpd.GeoDataFrame | None = None,
    *,
    snap_distance: float = 30.0,
    inner_roads: InnerRoads = "ignore",
    polygon_layer: str = "Site",
    road_layer: str = "Roads",
    obstacle_layer: str = "Obstacles",
    without_roads: str = NO_ROADS,
    progress: Progress | None = None,
) -> PreparedSites:
    """Turn real layers into sites to design.

    Polygons are repaired, projected to metres and dissolved where they adjoin. Roads that
    run along the edge become boundary streets; where other roads arrive are the access
    points. Layers may have any CRS, each its own. Feature ids are the index of the frames.

    Parameters
    ----------
    polygons
        Parcels or site polygons.
    roads
        Centre lines, or None: then the whole exterior of a site counts as frontage.
    obstacles
        Polygons that must stay free of streets, or None.
    snap_distance
        Largest distance between the boundary and the centre line of a road that runs along
        it, metres, greater than 0. A site that was prepared with a larger one (its column
        snap_m says so) keeps that.
    inner_roads
        "keep" the roads inside a site as existing streets, or "ignore" them. Roads whose
        column place says "inside", as in the layer of boundary streets of a prepared site
        whose inner roads are kept, stay in both cases.
    polygon_layer, road_layer, obstacle_layer
        Names of the layers, for messages.
    without_roads
        What is remarked where there is no road layer.
    progress
        Takes remarks and is asked for cancellation.

    Returns
    -------
    PreparedSites
        The sites in the order of their first features, and every repair.

    Raises
    ------
    InputError
        If a layer has no CRS, no polygon is usable, or a parameter is out of bounds.
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    if not snap_distance > 0:
        raise InputError(
            f"the snap distance is {snap_distance:g} m.", "Give a distance greater than 0 m."
        )
    if inner_roads not in ("ignore", "keep"):
        raise InputError(f"inner roads cannot be '{inner_roads}'.", "Give 'ignore' or 'keep'.")
    progress.stage("Reading the site", 0.0)
    problems = Problems()
    source_crs = layer_crs(polygons, polygon_layer)
    pieces = _sites_of(polygons, source_crs, polygon_layer, problems, progress)
    task = _Task(
        source_crs,
        polygon_layer,
        None if roads is None else RoadLayer(roads, road_layer, progress),
        road_layer,
        None if obstacles is None else _Obstacles(obstacles, obstacle_layer, problems, progress),
        snap_distance,
        inner_roads,
        problems,
    )
    ask(progress)
    names = _names(polygons)
    numbers = _numbers(polygons, [own[0] for _, _, own in pieces])
    sites = []
    for k, (polygon, crs, own) in enumerate(pieces):
        ask(progress)
        progress.stage(f"Preparing site {k + 1} of {len(pieces)}", (k + 0.5) / len(pieces))
        name = names.get(own[0], "") if len(own) == 1 else ""
        number = numbers[k]
        snap = max(snap_distance, prepared_with(polygons, own[0]))
        this = replace(task, snap_distance=snap)
        sites.append(_one_site(this, polygon, crs, own[0], number, name or f"Site {number}"))
    if roads is None:
        progress.info(without_roads)
    return PreparedSites(tuple(sites), problems.to_frame(source_crs))


class _Obstacles:
    """An obstacle layer, projected once per working CRS."""

    def __init__(
        self, frame: gpd.GeoDataFrame, layer: str, problems: Problems, progress: Progress
    ) -> None:
        self.crs = layer_crs(frame, layer)
        self.layer = layer
        self._geometry = np.asarray(frame.geometry.array, dtype=object)
        self._ids = frame.index.to_numpy()
        self._bounds = shapely.bounds(self._geometry).reshape(-1, 4)
        self._problems = problems
        self._progress = progress

    def inside(self, polygon: Polygon, crs: CRS) -> list[Polygon]:
        """Repair the obstacles that touch a site and clip them to it."""
        window = shapely.bounds(polygon)
        if self.crs != crs:
            window = transformer(crs, self.crs).transform_bounds(*window)
        b = self._bounds
        with np.errstate(invalid="ignore"):
            hit = (b[:, 0] <= window[2]) & (b[:, 2] >= window[0])
            hit &= (b[:, 1] <= window[3]) & (b[:, 3] >= window[1])
        geometry, ids = self._geometry[hit].copy(), self._ids[hit]
        if len(geometry) == 0:
            return []
        if self.crs != crs:
            geometry = _project(geometry, self.crs, crs, self._progress)
        areas, ids = repair_polygons(geometry, ids, self.layer, crs, self._problems, self._progress)
        shapely.prepare(polygon)
        edge = ~shapely.covers(polygon, areas)
        areas[edge] = overlay(shapely.intersection, areas[edge], polygon)
        parts, origin = shapely.get_parts(areas, return_index=True)
        keep = (shapely.get_type_id(parts) == POLYGON_TYPE) & (shapely.area(parts) > NO_AREA)
        parts, origin = parts[keep], origin[keep]
        small = shapely.area(parts) < SMALLEST_OBSTACLE
        for part, k in zip(parts[small], origin[small]):
            what = f"a part covers {part.area:.1f} m2 of the site"
            self._problems.add(self.layer, ids[k], what, "left out as too small", "info", part, crs)
        return list(parts[~small])


def _sites_of(
    polygons: gpd.GeoDataFrame,
    source_crs: CRS,
    layer: str,
    problems: Problems,
    progress: Progress,
) -> list[tuple[Polygon, CRS, list[Any]]]:
    """Repair and dissolve; each site comes with its working CRS and the ids it is made of."""
    geometry = np.asarray(polygons.geometry.array, dtype=object).copy()
    bounds = shapely.bounds(geometry).reshape(-1, 4)
    finite = bounds[np.all(np.isfinite(bounds), axis=1)]
    if len(finite) == 0:
        raise InputError(
            "has no polygon." if len(polygons) == 0 else "none of its geometries is usable.",
            "Select or draw the polygon of the site and run again.",
            layer=layer,
        )
    total = np.concatenate([finite[:, :2].min(axis=0), finite[:, 2:].max(axis=0)])
    crs = working_crs(source_crs, total, layer)
    ids = polygons.index.to_numpy()
    geometry = _project(geometry, source_crs, crs, progress)
    areas, own = repair_polygons(geometry, ids, layer, crs, problems, progress)
    pieces = dissolve(areas, own, layer, crs, problems, progress)
    if not pieces:
        raise InputError(
            "none of its polygons has an area that could be designed.",
            "See whether the right layer and features are chosen; the coordinate reference "
            "system may be wrong.",
            layer=layer,
        )
    ask(progress)
    extent = shapely.total_bounds([p for p, _ in pieces])
    true_everywhere = distortion(crs, extent) < DISTORTION
    result = []
    for polygon, features in pieces:
        ask(progress)
        # a layer may span more than one projection can hold: then each site has its own
        if true_everywhere or distortion(crs, polygon.bounds) < DISTORTION:
            result.append((polygon, crs, features))
            continue
        near = working_crs(crs, polygon.bounds, layer)
        if near == crs:
            result.append((polygon, crs, features))
        else:
            moved = _project(np.array([polygon], dtype=object), crs, near, progress)
            fixed, own = repair_polygons(moved, np.array([features[0]]), layer, near, problems)
            fresh = dissolve(fixed, own, layer, near, problems)
            result += [(p, near, features) for p, _ in fresh]
        error = distortion(near, result[-1][0].bounds)
        if error >= DISTORTION:
            what = f"so large that lengths are wrong by up to {100 * error:.1f} %"
            todo = "see whether the right polygon and coordinate reference system are chosen"
            problems.add(layer, features[0], what, todo, "warning", polygon, crs)
    return result


def _project(geometry: Geometries, source: CRS, target: CRS, progress: Progress) -> Geometries:
    if source == target:
        return geometry

    def move(part: Geometries) -> Geometries:
        moved: Geometries = gpd.GeoSeries(part, crs=source).to_crs(target).to_numpy()
        return moved

    return in_chunks(move, geometry, progress)


def _names(polygons: gpd.GeoDataFrame) -> dict[Any, str]:
    by_lower = {str(c).lower(): c for c in reversed(list(polygons.columns))}
    for candidate in _NAME_COLUMNS:
        if candidate in by_lower:
            column = polygons[by_lower[candidate]]
            return {i: v.strip() for i, v in column.items() if isinstance(v, str)}
    return {}


def prepared_with(polygons: gpd.GeoDataFrame, feature: Any) -> float:
    """Return the snap distance with which a site was prepared before, 0 where it was not, metres.

    A prepared site that is taken further finds the same streets along its edge, though nobody
    gives the distance a second time.
    """
    if SNAP_COLUMN not in polygons.columns or not polygons.index.is_unique:
        return 0.0
    value = polygons.at[feature, SNAP_COLUMN]
    number = isinstance(value, (int, float, np.number)) and np.isfinite(value)
    return float(value) if number else 0.0


def _numbers(polygons: gpd.GeoDataFrame, first: list[Any]) -> list[int]:
    """Give each site its number, by the first of its features.

    A prepared site keeps its number, even where others of its layer are not selected: the
    access points and obstacles that belong to it refer to it.
    """
    plain = list(range(1, len(first) + 1))
    if "site_id" not in polygons.columns:
        return plain
    given = polygons.loc[first, "site_id"].tolist()
    whole = [g for g in given if isinstance(g, (int, float)) and g == g // 1 and g >= 1]
    unique = len(set(whole)) == len(first) and polygons.index.is_unique
    return [int(g) for g in whole] if unique else plain


def _one_site(
    task: _Task, polygon: Polygon, crs: CRS, feature: Any, number: int, name: str
) -> Site:
    stretches: MultiLineString = MultiLineString([polygon.exterior.coords])
    streets: list[BoundaryStreet] = []
    points: list[AccessPoint] = []
    inner: list[BoundaryStreet] = []
    if task.roads is not None:
        network = task.roads.near(polygon, crs)
        found = frontage(polygon, network, task.snap_distance)
        stretches, streets = found.stretches, found.streets
        points = access_points(polygon, network, found.lines, task.snap_distance)
        everything = task.inner_roads == "keep"
        inner = inner_streets(polygon, network, found.reaches, everything=everything)
        if stretches.is_empty:
            _report_no_frontage(task, polygon, crs, feature, network)
    barred = [] if task.obstacles is None else task.obstacles.inside(polygon, crs)
    points = _without_barred(task, points, barred, crs)
    return Site(
        name=name,
        feature=feature if isinstance(feature, (int, str)) else str(feature),
        polygon=polygon,
        crs=crs,
        source_crs=task.source_crs,
        street_frontage=stretches,
        boundary_streets=tuple(streets),
        access_points=tuple(points),
        inner_streets=tuple(inner),
        obstacles=tuple(barred),
        site_id=number,
        snap_distance=task.snap_distance,
    )


def _without_barred(
    task: _Task, points: list[AccessPoint], barred: list[Polygon], crs: CRS
) -> list[AccessPoint]:
    """Leave out the access points whose street would go on into an obstacle."""
    if not barred:
        return points
    ground = np.array(barred, dtype=object)
    tree = shapely.STRtree(ground)
    kept = []
    for point in points:
        way = LineString([point.xy, np.array(point.xy) + _WAY_IN * np.array(point.direction)])
        ahead = shapely.union_all(ground[tree.query(way)])
        if way.intersection(ahead).length <= 0.5 * _WAY_IN:
            kept.append(point)
            continue
        what = f"the street {point.name or 'without a name'} arrives at an obstacle"
        task.problems.add(
            task.road_layer, "", what, "no access point there", "info", Point(point.xy), crs
        )
    return kept


def _report_no_frontage(
    task: _Task, polygon: Polygon, crs: CRS, feature: Any, network: RoadNetwork
) -> None:
    if len(network.lines) == 0:
        what = f"no road of layer '{task.road_layer}' comes near the site"
    else:
        gap = float(np.min(shapely.distance(network.lines, polygon)))
        near = gap <= task.snap_distance  # it crosses the edge, or only comes near a corner
        what = f"no road runs along the edge within {task.snap_distance:g} m"
        what += ", though one comes near" if near else f"; the nearest is {gap:.0f} m away"
    todo = (
        f"{NO_FRONTAGE}: give a larger snap distance, another road layer, or "
        "let streets end anywhere on the boundary (sink mode whole boundary)"
    )
    task.problems.add(task.layer, feature, what, todo, "warning", polygon, crs)
