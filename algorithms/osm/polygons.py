"""Polygons on the globe: repaired, measured, compared, put together from ways."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any, Optional

import shapely
from shapely.geometry.base import BaseGeometry

#: Share of their common ground from which two areas are the same.
SAME = 0.985
#: Degrees from the 180th meridian within which an area touches it.
_EDGE = 1e-6
_HALF_TURN = 180.0
_LEAST_OF_LINE = 2
_LEAST_OF_RING = 4


def areal_part(geometry: Optional[BaseGeometry]) -> Optional[BaseGeometry]:
    """Return the valid areal part of a geometry.

    Parameters
    ----------
    geometry
        Any geometry, or None.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon or None
        None where it has no area.
    """
    if geometry is None or geometry.is_empty:
        return None
    whole = shapely.force_2d(geometry)
    if not whole.is_valid:
        whole = shapely.make_valid(whole)
    flat = [q for p in shapely.get_parts(whole) for q in shapely.get_parts(p)]
    areas = [p for p in flat if p.geom_type == "Polygon" and p.area > 0]
    if not areas:
        return None
    return areas[0] if len(areas) == 1 else shapely.multipolygons(areas)


def area_ha(geometry: BaseGeometry) -> float:
    """Return the area on the ellipsoid WGS 84, in hectares.

    Parameters
    ----------
    geometry
        Polygon or multipolygon, in degrees (longitude, latitude).
    """
    from pyproj import Geod
    from shapely.geometry.polygon import orient

    globe = Geod(ellps="WGS84")
    parts = shapely.get_parts(geometry)
    return float(sum(abs(globe.geometry_area_perimeter(orient(part))[0]) for part in parts) / 1e4)


def same_area(one: BaseGeometry, other: BaseGeometry) -> bool:
    """Tell whether two polygons cover the same ground but for details of their edges."""
    small, large = sorted((one.area, other.area))
    if small < SAME * large or not shapely.box(*one.bounds).intersects(shapely.box(*other.bounds)):
        return False
    common = shapely.intersection(one, other).area
    return bool(common >= SAME * (small + large - common))


def crosses_antimeridian(geometry: BaseGeometry) -> bool:
    """Tell whether an area lies on both sides of the 180th meridian, cut there in two."""
    west, _, east, _ = geometry.bounds
    return bool(west <= _EDGE - _HALF_TURN and east >= _HALF_TURN - _EDGE)


def area_of_element(element: Mapping[str, Any]) -> Optional[BaseGeometry]:
    """Put an area together from an element of Overpass with its geometry (`out geom`).

    Parameters
    ----------
    element
        A way with `geometry`, or a relation whose members have one.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon or None
        None where the lines do not close, as for a street or for half a boundary.
    """
    if element.get("type") == "way":
        line = _line(element.get("geometry"))
        if line is None or len(line.coords) < _LEAST_OF_RING or not line.is_closed:
            return None
        return areal_part(shapely.polygons(line.coords))
    outer: list[Optional[BaseGeometry]] = []
    inner: list[Optional[BaseGeometry]] = []
    for member in element.get("members", ()):
        if member.get("type") == "way" and member.get("role") in ("outer", "inner", ""):
            (inner if member["role"] == "inner" else outer).append(_line(member.get("geometry")))
    return rings_to_area(outer, inner)


def rings_to_area(
    outer: Iterable[Optional[BaseGeometry]], inner: Iterable[Optional[BaseGeometry]]
) -> Optional[BaseGeometry]:
    """Close lines to rings, and rings to an area with holes.

    Parameters
    ----------
    outer, inner
        Lines in any order and direction; None stands for a line that is missing.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon or None
        None where a line around the area is missing or some do not close. Inner lines that do not
        close make no hole.
    """
    around = _closed(list(outer))
    if around is None:
        return None
    holes = _closed([line for line in inner if line is not None])
    return areal_part(around if holes is None else shapely.difference(around, holes))


def _closed(lines: list[Optional[BaseGeometry]]) -> Optional[BaseGeometry]:
    if not lines or any(line is None for line in lines):
        return None
    rings, cuts, dangles, invalid = shapely.polygonize_full([shapely.union_all(lines)])
    if not (cuts.is_empty and dangles.is_empty and invalid.is_empty):
        return None
    # Where rings lie in each other, as an island in a lake on an island, the ground alternates.
    filled = [shapely.polygons(ring.exterior) for ring in shapely.get_parts(rings)]
    return functools.reduce(shapely.symmetric_difference, filled)


def _line(points: Optional[Iterable[Optional[Mapping[str, float]]]]) -> Optional[BaseGeometry]:
    given = list(points or ())
    if len(given) < _LEAST_OF_LINE or any(p is None for p in given):
        return None
    return shapely.linestrings([(p["lon"], p["lat"]) for p in given if p is not None])
