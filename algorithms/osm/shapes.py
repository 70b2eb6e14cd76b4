"""Geometries of pyosmium as those of shapely, and polygons that are valid."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from .packages import load_osmium

WGS84 = "EPSG:4326"
"""The CRS of OpenStreetMap."""


def troubles() -> tuple[type[Exception], ...]:
    """Return what pyosmium raises at damaged files and at ways whose nodes are missing."""
    return (RuntimeError, ValueError, OSError, load_osmium().InvalidLocationError)


def area_id(area: Any) -> str:
    """Return the id of an area of pyosmium: "W123" where it is a way, else "R123".

    Parameters
    ----------
    area
        A `osmium.osm.Area`.
    """
    return f"{'W' if area.from_way() else 'R'}{area.orig_id()}"


def area_wkb(factory: Any, area: Any) -> bytes | None:
    """Return an area as well-known binary, or None where its rings do not close.

    Parameters
    ----------
    factory
        A `osmium.geom.WKBFactory`.
    area
        A `osmium.osm.Area`.
    """
    try:
        return bytes.fromhex(factory.create_multipolygon(area))
    except troubles():
        return None


def line_wkb(factory: Any, way: Any) -> bytes | None:
    """Return a way as well-known binary, or None where a file lacks some of its nodes.

    Parameters
    ----------
    factory
        A `osmium.geom.WKBFactory`.
    way
        A `osmium.osm.Way`.
    """
    try:
        return bytes.fromhex(factory.create_linestring(way))
    except troubles():
        return None


def valid_polygons(wkb: list[bytes]) -> np.ndarray[Any, np.dtype[Any]]:
    """Return polygons that are valid, whatever the rings of the map were like.

    Parameters
    ----------
    wkb
        Geometries as well-known binary.

    Returns
    -------
    numpy.ndarray of shapely geometries
        Polygons and multipolygons, some perhaps empty.
    """
    return polygons_only(shapely.from_wkb(np.array(wkb, dtype=object)))


def polygons_only(geometry: Any) -> np.ndarray[Any, np.dtype[Any]]:
    """Return geometries made valid and without parts that have no area.

    Parameters
    ----------
    geometry
        Array of shapely geometries.

    Returns
    -------
    numpy.ndarray of shapely geometries
        Polygons and multipolygons, some perhaps empty.
    """
    shapes = np.asarray(geometry, dtype=object).copy()
    wrong = ~shapely.is_valid(shapes)
    shapes[wrong] = shapely.make_valid(shapes[wrong])
    mixed = shapely.get_type_id(shapes) == shapely.GeometryType.GEOMETRYCOLLECTION
    for k in np.flatnonzero(mixed):
        parts = shapely.get_parts(shapes[k])
        flat = [p for part in parts for p in shapely.get_parts(part)]
        shapes[k] = shapely.union_all([p for p in flat if p.geom_type == "Polygon"])
    none = ~np.isin(shapely.get_type_id(shapes), (3, 6))
    shapes[none] = shapely.Polygon()
    return shapes
