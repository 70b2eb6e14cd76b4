"""The area that is asked for: checked, repaired, and widened in metres."""

from __future__ import annotations

import math

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS, Geod

from ..errors import InputError
from ..progress import Progress
from ..site.crs import layer_crs, working_crs
from .polygons import area_ha
from .shapes import WGS84, polygons_only

LARGEST_AREA = 1000e6
"""Larger areas are refused, square metres: a large city still fits, a country does not."""

MOST_CORNERS = 40
"""Points of an outline that is asked for."""

GEOD = Geod(ellps="WGS84")
_HALF_TURN = 180.0
_POLE = 89.0
#: Metres by which an outline may be wider than what it is of, to begin with.
_LEAST_SLACK = 5.0


def check_polygon(polygon: shapely.Geometry, progress: Progress) -> shapely.Geometry:
    """Return the area to look at as a valid polygon, or say why it is none.

    Parameters
    ----------
    polygon
        Polygon or multipolygon in EPSG:4326; rings may cross themselves.
    progress
        Hears of repairs.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon
        Valid, in two dimensions.

    Raises
    ------
    InputError
        It has no area, is larger than `LARGEST_AREA`, is not on the globe, or lies across the
        180° meridian.
    """
    if polygon is None or shapely.is_empty(polygon):
        raise InputError("The polygon is empty.", "Choose or draw a polygon with an area.")
    flat = shapely.force_2d(polygon)
    bounds = shapely.bounds(flat)
    if not np.all(np.isfinite(bounds)):
        raise InputError("The polygon has no usable coordinates.", "Draw it again.")
    west, south, east, north = (float(b) for b in bounds)
    _check_globe(west, south, east, north)
    if not shapely.is_valid(flat):
        progress.info("The polygon crosses itself; it was repaired.")
    fixed = polygons_only(np.array([flat], dtype=object))[0]
    if shapely.is_empty(fixed):
        raise InputError(
            "The polygon has no area: it is a line or a point.",
            "Choose or draw a polygon with an area.",
        )
    check_size(fixed)
    return fixed


def check_size(polygon: shapely.Geometry) -> None:
    """Refuse an area that is too large to be fetched.

    Parameters
    ----------
    polygon
        In EPSG:4326, valid.

    Raises
    ------
    InputError
        It is larger than `LARGEST_AREA`.
    """
    area = area_ha(polygon) / 100
    if area > LARGEST_AREA / 1e6:
        raise InputError(
            f"The polygon, or what lies between its parts, covers {area:,.0f} km2; at most "
            f"{LARGEST_AREA / 1e6:,.0f} km2 can be fetched at once.",
            "Use the polygon of a town, a quarter or a site.",
        )


def site_polygon(frame: gpd.GeoDataFrame, layer: str) -> shapely.Geometry:
    """Return the polygons of a layer as one, in EPSG:4326.

    Parameters
    ----------
    frame
        Polygons in any CRS; rings that cross themselves are repaired, other geometries and
        missing ones passed over.
    layer
        Its name, for messages.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon
        Valid.

    Raises
    ------
    InputError
        The layer has no CRS, or no polygon with an area.
    """
    layer_crs(frame, layer)
    shapes = frame.geometry[frame.geometry.notna() & ~frame.geometry.is_empty]
    finite = np.isfinite(shapely.bounds(shapes.to_numpy())).all(axis=1)
    flat = polygons_only(shapely.force_2d(shapes.to_numpy()[finite]))
    whole = polygons_only(np.array([shapely.union_all(flat)], dtype=object))
    moved = gpd.GeoSeries(whole, crs=frame.crs).to_crs(WGS84).to_numpy()
    if shapely.is_empty(moved[0]) or not np.all(np.isfinite(shapely.bounds(moved[0]))):
        raise InputError(
            "it has no polygon with an area, or its coordinates do not fit its CRS.",
            "Choose or draw a polygon, and see whether the CRS is the one in which it was drawn.",
            layer=layer,
        )
    result: shapely.Geometry = polygons_only(moved)[0]
    return result


def _check_globe(west: float, south: float, east: float, north: float) -> None:
    if south < -90 or north > 90 or west < -360 or east > 360:
        raise InputError(
            "The polygon is not in degrees of longitude and latitude.",
            "See whether its coordinate reference system is right.",
        )
    if south < -_POLE or north > _POLE:
        raise InputError("The polygon reaches to a pole.", "Use a smaller polygon.")
    if west < -_HALF_TURN or east > _HALF_TURN or east - west > _HALF_TURN:
        raise _across()


def _across() -> InputError:
    return InputError(
        "The polygon lies across the 180° meridian (the antimeridian) or so close to it that the "
        "streets around are beyond it, or it reaches half round the globe.",
        "Cut it some kilometres from the meridian, or use a smaller polygon.",
    )


def local_crs(polygon: shapely.Geometry) -> CRS:
    """Return a CRS in metres for the ground around a polygon.

    Parameters
    ----------
    polygon
        In EPSG:4326.
    """
    return working_crs(CRS.from_user_input(WGS84), np.array(shapely.bounds(polygon)), "Polygon")


def widened(polygon: shapely.Geometry, reach: float, crs: CRS) -> shapely.Geometry:
    """Return a polygon with all ground within some metres of it, holes filled.

    Parameters
    ----------
    polygon
        In EPSG:4326.
    reach
        Distance, metres.
    crs
        CRS in metres, see `local_crs`.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon
        In EPSG:4326.

    Raises
    ------
    InputError
        It reaches across the 180° meridian.
    """
    moved = gpd.GeoSeries([polygon], crs=WGS84).to_crs(crs)
    wide = moved.buffer(reach)
    filled = [shapely.Polygon(part.exterior) for part in shapely.get_parts(wide.to_numpy())]
    return _in_degrees(shapely.union_all(filled), crs)


def outline(polygon: shapely.Geometry, crs: CRS) -> shapely.Polygon:
    """Return a polygon of few corners around another one, for questions to Overpass.

    osmnx writes the outline into every one of the 180 parts of its question for features, and
    the servers take no question of more than a megabyte.

    Parameters
    ----------
    polygon
        In EPSG:4326.
    crs
        CRS in metres, see `local_crs`.

    Returns
    -------
    shapely.Polygon
        In EPSG:4326, of at most `MOST_CORNERS` points. A single one around several parts, since
        osmnx asks for all ground between them.

    Raises
    ------
    InputError
        It reaches across the 180° meridian.
    """
    parts = shapely.get_parts(polygon)
    hull = shapely.convex_hull(polygon)
    if len(parts) > 1:
        return _simpler(hull, crs)
    # Around a ragged outline the hull may be the smaller one.
    both = _simpler(shapely.Polygon(parts[0].exterior), crs), _simpler(hull, crs)
    return min(both, key=shapely.area)


def _simpler(shape: shapely.Polygon, crs: CRS) -> shapely.Polygon:
    """Return a polygon of at most `MOST_CORNERS` points around another, as close as it may be."""
    own = gpd.GeoSeries([shape], crs=WGS84).to_crs(crs).iloc[0]
    width, found = _LEAST_SLACK, shape
    # An edge that is straight in metres is not in degrees, so that it is looked at there.
    while shapely.get_num_coordinates(found) > MOST_CORNERS or not shapely.covers(found, shape):
        # The corners of eight sides are 0.92 widths away, and less than that is taken away.
        wide = shapely.simplify(shapely.buffer(own, width, quad_segs=2), 0.8 * width)
        found = _in_degrees(shapely.Polygon(shapely.get_parts(wide)[0].exterior), crs)
        width *= 2.0
    return found


def _in_degrees(shape: shapely.Geometry, crs: CRS) -> shapely.Geometry:
    """Return a shape in metres in EPSG:4326, unless it reaches across the meridian."""
    moved: shapely.Geometry = gpd.GeoSeries([shape], crs=crs).to_crs(WGS84).iloc[0]
    west, _, east, _ = shapely.bounds(moved)
    if east - west > _HALF_TURN:  # part of it came out on the other side of the map
        raise _across()
    return moved


def lengths_m(lines: gpd.GeoSeries) -> list[float]:
    """Return the lengths of lines in EPSG:4326 on the ellipsoid, in metres.

    Parameters
    ----------
    lines
        Lines.
    """
    found = [float(GEOD.geometry_length(line)) for line in lines]
    return [round(length, 2) if math.isfinite(length) else 0.0 for length in found]
