"""An edited layer of access points is taken back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Point, Polygon

from ..errors import InputError
from .access import boundary_tangent, in_ring_order
from .crs import layer_crs
from .types import AccessPoint, Site


def access_points_from_layer(
    frame: gpd.GeoDataFrame,
    site: Site,
    layer_name: str = "Access points",
    *,
    sites: Sequence[Site] = (),
) -> list[AccessPoint]:
    """Take access points back from a layer, so that the planner can edit them.

    Parameters
    ----------
    frame
        Points; the columns bearing_deg (direction into the site, degrees clockwise from
        north), name and site_id are read where present. Without a bearing the direction
        is square to the boundary.
    site
        The site they belong to; rows with another site_id are passed over.
    layer_name
        Name of the layer, for messages.
    sites
        All sites that the layer may have points of; a point without a site_id belongs to
        the one nearest to it. Only `site` if empty.

    Returns
    -------
    list of AccessPoint
        Moved onto the boundary, in the order in which they lie along the rings.

    Raises
    ------
    InputError
        If the layer has no CRS, a geometry is not a point, or a point lies further than
        the snap distance from the boundary of its site.

    See Also
    --------
    access_points_of_sites : all sites of a layer at once.
    """
    others = [s for s in sites if s.site_id != site.site_id]
    return access_points_of_sites(frame, [site, *others], layer_name)[0]


def access_points_of_sites(
    frame: gpd.GeoDataFrame, sites: Sequence[Site], layer_name: str = "Access points"
) -> list[list[AccessPoint]]:
    """Share the points of a layer out among sites.

    Parameters
    ----------
    frame
        Points, as for `access_points_from_layer`.
    sites
        The sites. A row belongs to the site that its site_id names, is passed over where it
        names none of them, and belongs to the nearest site where it is missing.
    layer_name
        Name of the layer, for messages.

    Returns
    -------
    list of list of AccessPoint
        The points of each site, moved onto its boundary, in ring order.

    Raises
    ------
    InputError
        If the layer has no CRS, a geometry is not a point, or a point lies further than
        the snap distance from the boundary of its site.
    """
    crs = layer_crs(frame, layer_name)
    frame = frame[~(frame.geometry.isna() | frame.geometry.is_empty)]
    if "site_id" in frame.columns:
        known = frame["site_id"].isna() | frame["site_id"].isin([s.site_id for s in sites])
        frame = frame[known]
    moved: dict[str, Any] = {}
    for site in sites:
        key = site.crs.srs
        if key not in moved:
            same = crs == site.crs
            moved[key] = (frame.geometry if same else frame.geometry.to_crs(site.crs)).to_numpy()
    owner = _owners(frame, sites, moved)
    bearings = frame["bearing_deg"] if "bearing_deg" in frame.columns else [None] * len(frame)
    names = frame["name"] if "name" in frame.columns else [None] * len(frame)
    result: list[list[AccessPoint]] = [[] for _ in sites]
    for row, (feature, k, bearing, name) in enumerate(zip(frame.index, owner, bearings, names)):
        place = moved[sites[k].crs.srs][row]
        point = _edited_point(place, bearing, sites[k], layer_name, feature)
        result[k].append(AccessPoint(point.xy, point.junction, point.direction, _text(name)))
    return [in_ring_order(s.polygon, points) for s, points in zip(sites, result)]


def _owners(
    frame: gpd.GeoDataFrame, sites: Sequence[Site], moved: dict[str, Any]
) -> npt.NDArray[np.intp]:
    """Index of the site that each row belongs to: the one it names, else the nearest."""
    owner = np.zeros(len(frame), dtype=np.intp)
    reach = np.full(len(frame), np.inf)
    for key, places in moved.items():
        mine = np.array([k for k, s in enumerate(sites) if s.crs.srs == key], dtype=np.intp)
        edges = np.array([sites[k].polygon.boundary for k in mine], dtype=object)
        row, near, gap = _nearest(edges, places)
        closer = gap < reach[row]
        owner[row[closer]] = mine[near[closer]]
        reach[row[closer]] = gap[closer]
    if "site_id" in frame.columns:
        number = {s.site_id: k for k, s in enumerate(sites)}
        for row, own in enumerate(frame["site_id"].tolist()):
            owner[row] = number.get(own, owner[row])
    return owner


def _nearest(edges: npt.NDArray[Any], places: npt.NDArray[Any]) -> tuple[Any, Any, Any]:
    """Row, index of the nearest edge and distance to it, ties to the first edge."""
    pairs, gap = shapely.STRtree(edges).query_nearest(places, return_distance=True)
    order = np.lexsort((pairs[1], pairs[0]))
    row, first = np.unique(pairs[0][order], return_index=True)
    return row, pairs[1][order][first], gap[order][first]


def _edited_point(place: Any, bearing: Any, site: Site, layer: str, feature: object) -> AccessPoint:
    label = feature if isinstance(feature, (int, str)) else str(feature)
    if place.geom_type == "MultiPoint" and len(place.geoms) == 1:
        place = place.geoms[0]
    if place.geom_type != "Point":
        raise InputError(
            f"is a {place.geom_type}, not a point.", "Give a point layer.",
            layer=layer, feature=label,
        )  # fmt: skip
    gap = float(site.polygon.boundary.distance(place))
    if not gap <= site.snap_distance:
        raise InputError(
            f"the point lies {gap:.0f} m from the boundary of {site.name}, further than the "
            f"snap distance of {site.snap_distance:g} m.",
            "Move it to the boundary, or delete it.",
            layer=layer,
            feature=label,
        )
    on = Point(site.polygon.boundary.interpolate(site.polygon.boundary.project(place)))
    junction = place if gap > 0.01 and not site.polygon.contains(place) else on
    number = _number(bearing)
    if number is None:
        direction = inward(site.polygon, on)
    else:
        angle = math.radians(number)
        direction = (math.sin(angle), math.cos(angle))
    return AccessPoint((on.x, on.y), (junction.x, junction.y), direction)


def inward(polygon: Polygon, place: Point) -> tuple[float, float]:
    """Give the direction square to the boundary into the site.

    Parameters
    ----------
    polygon
        The site.
    place
        Point on its boundary.

    Returns
    -------
    tuple of float
        Unit vector.
    """
    tx, ty = boundary_tangent(polygon, place)
    left = Point(place.x - ty, place.y + tx)
    right = Point(place.x + ty, place.y - tx)
    return (-ty, tx) if polygon.distance(left) <= polygon.distance(right) else (ty, -tx)


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""
