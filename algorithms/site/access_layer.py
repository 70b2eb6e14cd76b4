"""An edited layer of access points is taken back."""

from __future__ import annotations

import math
from typing import Any

import geopandas as gpd
from shapely.geometry import Point, Polygon

from ..errors import InputError
from .access import boundary_tangent, in_ring_order
from .crs import layer_crs
from .types import AccessPoint, Site


def access_points_from_layer(
    frame: gpd.GeoDataFrame, site: Site, layer_name: str = "Access points"
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

    Returns
    -------
    list of AccessPoint
        Moved onto the boundary, in the order in which they lie along the rings.

    Raises
    ------
    InputError
        If the layer has no CRS, a geometry is not a point, or a point lies further than
        the site's snap distance from its boundary.
    """
    crs = layer_crs(frame, layer_name)
    if "site_id" in frame.columns:
        own = frame["site_id"]
        frame = frame[(own == site.site_id) | own.isna()]
    geometry = frame.geometry if crs == site.crs else frame.geometry.to_crs(site.crs)
    bearings = frame["bearing_deg"] if "bearing_deg" in frame.columns else [None] * len(frame)
    names = frame["name"] if "name" in frame.columns else [None] * len(frame)
    result = []
    for feature, place, bearing, name in zip(frame.index, geometry, bearings, names):
        if place is None or place.is_empty:
            continue
        point = _edited_point(place, bearing, site, layer_name, feature)
        result.append(AccessPoint(point.xy, point.junction, point.direction, _text(name)))
    return in_ring_order(site.polygon, result)


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
