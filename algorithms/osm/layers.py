"""The layers of OpenStreetMap that a planner works with, from its services or a local file."""

from __future__ import annotations

import datetime
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS

from ..errors import InputError, without_credentials
from ..progress import Progress, Silent
from . import files, ground, mapped, streets
from .classes import COLUMNS, EXCLUDED, FEATURES, NetworkType, is_feature, overpass_filter
from .local import LocalMap, read_local, write_streets
from .packages import load_osmnx
from .session import QUERY_SETTINGS, with_osmnx
from .settings import ATTRIBUTION, LICENCE, OsmSettings
from .shapes import WGS84, polygons_only
from .transport import Transport
from .waiting import wait_for

REACH = 80.0
"""Layers reach this far beyond the polygon, metres: beyond the streets along its edge."""

FARTHEST_REACH = 2000.0

AHEAD = 300.0
"""Streets are looked at this much farther, metres, so that those at the end are whole."""

OSMNX_AHEAD = 500.0
"""So much farther still, metres, osmnx asks for streets, to count those at each junction."""

#: Tags of areas in whose midst a site may lie.
_AREA_KEYS = ("landuse", "leisure", "natural", "amenity", "aeroway", "military")

LAYERS = ("streets", "intersections", "buildings", "landuse", "obstacles")


def osm_layers(
    polygon: shapely.Geometry,
    *,
    network_type: NetworkType = "drive",
    source: Path | None = None,
    settings: OsmSettings | None = None,
    reach: float = REACH,
    progress: Progress | None = None,
) -> dict[str, gpd.GeoDataFrame]:
    """Return streets, intersections, buildings, land use and obstacles around a polygon.

    Streets are simplified by osmnx: each runs from junction to junction, and ends where class,
    name, bridge or tunnel change. All layers reach a little beyond the polygon, so that the
    streets along its edge and those that arrive there are among them.

    Parameters
    ----------
    polygon
        Polygon or multipolygon in EPSG:4326; repaired where it crosses itself. At most
        `ground.LARGEST_AREA`.
    network_type
        "drive" (public streets for cars), "walk", "bike", or "all" ways in use, private ones
        and service ways too.
    source
        An .osm or .osm.pbf file; None asks Overpass.
    settings
        How Overpass is asked.
    reach
        How far the layers reach beyond the polygon, metres, from 0 to `FARTHEST_REACH`.
    progress
        Told how far it is; asked for cancellation.

    Returns
    -------
    dict
        GeoDataFrames by the names in `LAYERS`, all in EPSG:4326 with valid geometries and ids
        as "W123", perhaps without rows. `attrs["osm"]` of each has the texts attribution,
        licence, source and date (day of the data, ISO 8601).

        - streets: `streets.STREET_COLUMNS`; level 1 major, 2 collector, 3 local, 4 service ways
          and paths; lines are cut at the reach. speed_kmh and lanes where they are mapped.
        - intersections: `streets.INTERSECTION_COLUMNS`; street_count counts the streets of the
          chosen network, also those beyond the reach.
        - buildings: `mapped.BUILDING_COLUMNS`; whole.
        - landuse: `mapped.LAND_USE_COLUMNS`; cut at the reach.
        - obstacles: `mapped.OBSTACLE_COLUMNS`; green, water, rail and other ground that streets
          must not cross, as polygons cut at the reach. Railway land is none, only its tracks.

    Raises
    ------
    InputError
        The polygon or the file cannot be used.
    ServiceError
        Overpass gave no usable answer.
    MissingDependencyError
        osmnx, or osmium for a file, is not installed.
    CancelledError
        The caller has cancelled.
    """
    progress = progress or Silent()
    if network_type not in EXCLUDED:
        raise InputError(
            f"There is no network type '{network_type}'.", f"Give one of {', '.join(EXCLUDED)}."
        )
    if not 0.0 <= reach <= FARTHEST_REACH:
        raise InputError(
            f"The reach is {reach:g} m.", f"Give a distance from 0 to {FARTHEST_REACH:g} m."
        )
    area = ground.check_polygon(polygon, progress)
    crs = ground.local_crs(area)
    wide = ground.widened(area, reach, crs)
    settings = settings or OsmSettings()
    if source is not None:
        found, date = _from_file(Path(source), wide, network_type, crs, progress)
        origin = Path(source).name
    else:
        found, date = _from_services(wide, network_type, settings, crs, progress)
        origin = without_credentials(settings.overpass_url)
    progress.stage("Sorting what was found", 0.85)
    lines, points, features = found
    layers: dict[str, gpd.GeoDataFrame] = wait_for(
        lambda _: {
            "streets": lines,
            "intersections": points,
            "buildings": mapped.buildings(features, wide),
            "landuse": mapped.land_uses(features, wide, crs),
            "obstacles": mapped.obstacles(features, wide, crs),
        },
        progress,
    )
    if len(lines) == 0:
        progress.warn(
            f"There are no streets for '{network_type}' in the polygon or within {reach:g} m of "
            "it. Try the network type all, or a longer reach."
        )
    mapped.warn_of_cover(layers["obstacles"], area, progress)
    for frame in layers.values():
        frame.attrs["osm"] = {
            "attribution": ATTRIBUTION,
            "licence": LICENCE,
            "source": origin,
            "date": date.isoformat() if date else "",
        }
    return layers


_Found = tuple[gpd.GeoDataFrame, gpd.GeoDataFrame, gpd.GeoDataFrame]


def _from_file(
    source: Path, wide: shapely.Geometry, network_type: NetworkType, crs: CRS, progress: Progress
) -> tuple[_Found, datetime.date | None]:
    path = files.check_file(source)
    load_osmnx()
    date = files.file_info(path).date
    window = ground.widened(wide, AHEAD, crs)
    local: LocalMap = wait_for(lambda own: read_local(path, window, network_type, own), progress)
    if not local.ways:
        return (*streets.no_streets(), local.features), date
    progress.stage("Simplifying streets", 0.6)

    def simplify(osmnx: ModuleType, _: Transport) -> Any:
        with tempfile.TemporaryDirectory(prefix="platwright_") as folder:
            path = Path(folder) / "streets.osm"
            write_streets(local, path, streets.WAY_TAGS)
            graph = osmnx.graph_from_xml(
                path, bidirectional=network_type == "walk", simplify=False, retain_all=True
            )
        counts = osmnx.stats.count_streets_per_node(graph)
        for node, count in counts.items():
            graph.nodes[node]["street_count"] = count
        return streets.street_layers(osmnx, graph, wide)

    options = {"useful_tags_way": list(streets.WAY_TAGS)}
    lines, points = with_osmnx(simplify, None, progress, options=options)
    return (lines, points, local.features), date


def _from_services(
    wide: shapely.Geometry,
    network_type: NetworkType,
    settings: OsmSettings,
    crs: CRS,
    progress: Progress,
) -> tuple[_Found, datetime.date | None]:
    asked = ground.outline(wide, crs)
    ahead = ground.outline(ground.widened(wide, AHEAD, crs), crs)
    ground.widened(ahead, OSMNX_AHEAD, crs)  # it must not reach across the meridian
    if len(shapely.get_parts(wide)) > 1:  # all ground between them is asked for, too
        ground.check_size(ahead)

    def fetch(osmnx: ModuleType, transport: Transport) -> tuple[_Found, datetime.date | None]:
        transport.progress.stage("Fetching streets from OpenStreetMap", 0.05)
        lines, points = _fetch_streets(osmnx, ahead, wide, network_type)
        transport.progress.stage("Fetching buildings and areas from OpenStreetMap", 0.45)
        wanted = {key: list(values) or True for key, values in FEATURES.items()}
        try:
            table = osmnx.features_from_polygon(asked, tags=wanted)
        except osmnx._errors.InsufficientResponseError:
            table = gpd.GeoDataFrame(geometry=[], crs=WGS84)
        transport.progress.stage("Asking which areas enclose the polygon", 0.75)
        features = with_enclosing(_normalised(table), wide, transport)
        if len(lines) == 0 and len(features) == 0:
            corners = ", ".join(f"{value:.3f}" for value in shapely.bounds(wide))
            raise InputError(
                f"OpenStreetMap has nothing in the polygon, which covers {corners} in degrees "
                "(west, south, east, north).",
                "See whether the polygon has the right coordinate reference system.",
            )
        return (lines, points, features), transport.date

    options = {"useful_tags_way": list(streets.WAY_TAGS)}
    return with_osmnx(fetch, settings, progress, options=options)


def _fetch_streets(
    osmnx: ModuleType, ahead: shapely.Geometry, wide: shapely.Geometry, network_type: NetworkType
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Return streets and intersections of an area, fetched in a larger one."""
    try:
        graph = osmnx.graph_from_polygon(
            ahead,
            network_type=network_type,
            custom_filter=overpass_filter(network_type),
            simplify=False,
            retain_all=True,
            truncate_by_edge=True,
        )
    except ValueError as error:
        # An answer without ways, or with none inside; any other error has another cause.
        if isinstance(error, osmnx._errors.InsufficientResponseError):
            return streets.no_streets()
        if "no graph nodes" in str(error).lower():
            return streets.no_streets()
        raise
    return streets.street_layers(osmnx, graph, wide)


def with_enclosing(
    features: gpd.GeoDataFrame, wide: shapely.Geometry, transport: Transport
) -> gpd.GeoDataFrame:
    """Add the areas in whose midst a polygon lies, which Overpass leaves out.

    It finds by a polygon only what has a point or a line inside. What contains a point of the
    polygon and was not found has no edge in it, so all of the polygon lies in it.

    Parameters
    ----------
    features
        What was found, as of `_normalised`.
    wide
        The polygon, EPSG:4326.
    transport
        Asks Overpass once for each part of the polygon.
    """
    rows, shapes = [], []
    known = set(features["osm_id"])
    for part in shapely.get_parts(wide):
        spot = shapely.point_on_surface(part)
        tests = f'[~"^({"|".join(_AREA_KEYS)})$"~"."]'
        answer = transport.overpass(
            f"{QUERY_SETTINGS.format(maxsize='')};is_in({spot.y:.7f},{spot.x:.7f})->.a;"
            f"(relation(pivot.a){tests};way(pivot.a){tests};);out tags;"
        )
        for element in answer["elements"]:
            tags = element.get("tags", {})
            osm_id = f"{str(element.get('type', '?'))[0].upper()}{element.get('id')}"
            if osm_id not in known and is_feature(tags):
                rows.append({"osm_id": osm_id, **{key: tags.get(key) for key in COLUMNS}})
                shapes.append(part)
    if not rows:
        return features
    more = gpd.GeoDataFrame(rows, geometry=shapes, crs=WGS84)
    if len(features) == 0:
        return more
    joined = pd.concat([features, more], ignore_index=True)
    return gpd.GeoDataFrame(joined, geometry="geometry", crs=WGS84)


def _normalised(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Return a table of features of osmnx in the shape of that of a file."""
    frame = table.reindex(columns=[*COLUMNS, "geometry"]).astype(object)
    frame = frame.where(frame.notna(), None)
    pairs = table.index if len(table) else ()
    ids = [f"{element[0].upper()}{number}" for element, number in pairs]
    frame.insert(0, "osm_id", ids)
    shapes = np.asarray(table.geometry.to_numpy(), dtype=object).copy()
    polygon = np.isin(shapely.get_type_id(shapes), (3, 6))
    shapes[polygon] = polygons_only(shapes[polygon])
    return gpd.GeoDataFrame(
        frame.drop(columns="geometry").reset_index(drop=True), geometry=shapes, crs=WGS84
    )
