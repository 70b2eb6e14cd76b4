"""Areas and lines of the map become buildings, land use and obstacles."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from ..progress import Progress
from . import tags as read
from .classes import area_obstacle, land_use, line_obstacle
from .sea import sea
from .shapes import WGS84, polygons_only

BUILDING_COLUMNS = ("osm_id", "kind", "name", "height_m", "levels", "height_from")
LAND_USE_COLUMNS = ("osm_id", "theme", "kind", "name")
OBSTACLE_COLUMNS = ("osm_id", "kind", "name")

STOREY = 3.0
"""Height of a storey where only their number is mapped, metres."""

SMALLEST_OBSTACLE = 25.0
"""Smaller obstacles are left out, square metres: Prepare site does so, too."""

_SMALLEST_AREA = 1.0
_ROOFS = {"roof", "no", "ruins", "demolished", "razed", "proposed", "construction"}


def _rows(features: gpd.GeoDataFrame, kinds: tuple[int, ...]) -> list[tuple[dict[str, Any], Any]]:
    """Return (tags, geometry) of the features of some geometry types."""
    chosen = features[np.isin(shapely.get_type_id(features.geometry.to_numpy()), kinds)]
    table = chosen.drop(columns="geometry").to_dict("records")
    return list(zip(table, chosen.geometry))


def buildings(features: gpd.GeoDataFrame, area: shapely.Geometry) -> gpd.GeoDataFrame:
    """Pick the buildings that meet an area, whole.

    Parameters
    ----------
    features
        With osm_id and the tags of `classes.COLUMNS`, EPSG:4326.
    area
        Polygon.

    Returns
    -------
    geopandas.GeoDataFrame
        Columns as in `BUILDING_COLUMNS`. height_m is the height as mapped, else `STOREY` times
        the storeys; height_from says which. Roofs, ruins, what is not built yet and what is
        below ground are left out.
    """
    rows, shapes = [], []
    for tags, shape in _rows(features, (3, 6)):
        kind = read.text(tags.get("building"))
        if kind is None or kind in _ROOFS or read.below_ground(tags):
            continue
        height, levels = read.height_m(tags.get("height")), read.levels(tags.get("building:levels"))
        origin = "height" if height else "levels" if levels else None
        if height is None and levels is not None:
            height = STOREY * levels
        rows.append((tags["osm_id"], kind, read.text(tags.get("name")), height, levels, origin))
        shapes.append(shape)
    frame = gpd.GeoDataFrame(rows, columns=list(BUILDING_COLUMNS), geometry=shapes, crs=WGS84)
    return frame[shapely.intersects(frame.geometry.to_numpy(), area)].reset_index(drop=True)


def land_uses(features: gpd.GeoDataFrame, area: shapely.Geometry, crs: CRS) -> gpd.GeoDataFrame:
    """Pick the areas that say how land is used, cut to an area.

    Parameters
    ----------
    features
        With osm_id and the tags of `classes.COLUMNS`, EPSG:4326.
    area
        Polygon.
    crs
        CRS in metres.

    Returns
    -------
    geopandas.GeoDataFrame
        Columns as in `LAND_USE_COLUMNS`, large areas first, so that small ones lie on top.
    """
    rows, shapes = [], []
    for tags, shape in _rows(features, (3, 6)):
        use = None if read.below_ground(tags) else land_use(tags)
        if use is not None:
            rows.append((tags["osm_id"], *use, read.text(tags.get("name"))))
            shapes.append(shape)
    frame = gpd.GeoDataFrame(rows, columns=list(LAND_USE_COLUMNS), geometry=shapes, crs=WGS84)
    frame = _cut(frame, area)
    size = frame.to_crs(crs).area
    size = size[size >= _SMALLEST_AREA].sort_values(ascending=False, kind="stable")
    return frame.loc[size.index].reset_index(drop=True)


def _cut(frame: gpd.GeoDataFrame, area: shapely.Geometry) -> gpd.GeoDataFrame:
    """Cut polygons to an area; the parts without extent go."""
    shapes = frame.geometry.to_numpy().copy()
    edge = ~shapely.covers(area, shapes)
    shapes[edge] = polygons_only(shapely.intersection(shapes[edge], area))
    frame = frame.set_geometry(gpd.GeoSeries(shapes, index=frame.index, crs=frame.crs))
    return frame[~frame.geometry.is_empty].reset_index(drop=True)


def obstacles(features: gpd.GeoDataFrame, area: shapely.Geometry, crs: CRS) -> gpd.GeoDataFrame:
    """Pick what streets must not cross, as polygons cut to an area.

    Parameters
    ----------
    features
        With osm_id and the tags of `classes.COLUMNS`, EPSG:4326.
    area
        Polygon.
    crs
        CRS in metres, in which lines are widened.

    Returns
    -------
    geopandas.GeoDataFrame
        Columns as in `OBSTACLE_COLUMNS`; kind is water, sea, green, rail, motorway, airfield,
        military, wall or cliff. Lines are as wide as `classes.HALF_WIDTHS` or their tag width
        says; those of one kind and name are one polygon where they touch.
    """
    rows: list[tuple[Any, ...]] = []
    shapes: list[Any] = []
    for tags, shape in _rows(features, (3, 6)):
        kind = area_obstacle(tags)
        if kind is not None:
            rows.append((tags["osm_id"], kind, read.text(tags.get("name"))))
            shapes.append(shape)
    frame = gpd.GeoDataFrame(rows, columns=list(OBSTACLE_COLUMNS), geometry=shapes, crs=WGS84)
    parts = [_cut(frame, area), *_cut_lines(features, area, crs)]
    table = {c: [v for part in parts for v in part[c]] for c in (*OBSTACLE_COLUMNS, "geometry")}
    whole = gpd.GeoDataFrame(table, geometry="geometry", crs=WGS84)
    size = whole.to_crs(crs).area
    return whole[size >= SMALLEST_OBSTACLE].reset_index(drop=True)


def _cut_lines(
    features: gpd.GeoDataFrame, area: shapely.Geometry, crs: CRS
) -> list[gpd.GeoDataFrame]:
    """Return the obstacles that are lines on the map, and the sea."""
    found: dict[tuple[str, str | None], list[tuple[str, Any, float]]] = {}
    coast = []
    for tags, shape in _rows(features, (1, 2, 5)):
        if "coastline" in read.values(tags.get("natural")):
            coast += list(shapely.get_parts(shape))
        line = line_obstacle(tags)
        if line is not None:
            key = (line[0], read.text(tags.get("name")))
            found.setdefault(key, []).append((tags["osm_id"], shape, line[1]))
    frames = [_widened(kind, name, own, area, crs) for (kind, name), own in found.items()]
    if coast:
        # A coast mapped in pieces has no id of its own as a sea.
        shape = sea(coast, area)
        row = {"osm_id": [None], "kind": ["sea"], "name": [None]}
        frames.append(_cut(gpd.GeoDataFrame(row, geometry=[shape], crs=WGS84), area))
    return frames


def _widened(
    kind: str,
    name: str | None,
    lines: list[tuple[str, Any, float]],
    area: shapely.Geometry,
    crs: CRS,
) -> gpd.GeoDataFrame:
    """Return lines of one kind and name as polygons, joined where they touch."""
    moved = gpd.GeoSeries([line[1] for line in lines], crs=WGS84).to_crs(crs)
    wide = moved.buffer([line[2] for line in lines], cap_style="flat")
    parts = shapely.get_parts(shapely.union_all(wide.to_numpy()))
    tree = shapely.STRtree(moved.to_numpy())
    rows = []
    for part in parts:
        own = sorted({lines[k][0] for k in tree.query(part, predicate="intersects")})
        rows.append((";".join(own) or None, kind, name))
    frame = gpd.GeoDataFrame(rows, columns=list(OBSTACLE_COLUMNS), geometry=parts, crs=crs)
    return _cut(frame.to_crs(WGS84), area)


def warn_of_cover(found: gpd.GeoDataFrame, polygon: shapely.Geometry, progress: Progress) -> None:
    """Warn where a kind of obstacle covers most of the polygon, as a park that is the site.

    Parameters
    ----------
    found
        Obstacles.
    polygon
        The polygon that was asked for, EPSG:4326.
    progress
        Hears the warning.
    """
    for kind, own in found.groupby("kind"):
        covered = shapely.intersection(shapely.union_all(own.geometry.to_numpy()), polygon)
        share = covered.area / polygon.area
        if share > 0.5:
            progress.warn(
                f"Obstacles of the kind {kind} cover {100 * share:.0f} % of the polygon. Delete "
                "those that are to be built on before you use the layer as obstacles."
            )
