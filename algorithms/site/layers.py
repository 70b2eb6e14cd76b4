"""Prepared sites as ordinary layers, in the CRS of the input."""

from __future__ import annotations

import math
from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from shapely.geometry import Point

from .roads import INSIDE
from .types import SNAP_COLUMN, PreparedSites, Site


def site_layers(prepared: PreparedSites) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of prepared sites.

    Parameters
    ----------
    prepared
        What `prepare_sites` returned.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        `site` (site_id, name, area_m2, area_ha, perimeter_m, snap_m), `boundary_streets` (site_id,
        name, kind, place, length_m; place is "edge", or "inside" for the streets inside the
        site that are kept), `access_points` (site_id, name, bearing_deg: direction into
        the site, degrees clockwise from grid north of the working CRS), `site_obstacles`
        (site_id, area_m2) and `problems`. All measures are taken in the working CRS.
    """
    sites = prepared.sites
    crs = sites[0].source_crs if sites else prepared.problems.crs
    rows: dict[str, list[tuple[Any, ...]]] = {
        "site": [], "boundary_streets": [], "access_points": [], "site_obstacles": [],
    }  # fmt: skip
    shapes: dict[str, list[Any]] = {key: [] for key in rows}
    for site in sites:
        for key, values, geometry in _rows(site):
            rows[key] += values
            shapes[key] += _back(geometry, site)
    columns = {
        "site": ["site_id", "name", "area_m2", "area_ha", "perimeter_m", SNAP_COLUMN],
        "boundary_streets": ["site_id", "name", "kind", "place", "length_m"],
        "access_points": ["site_id", "name", "bearing_deg"],
        "site_obstacles": ["site_id", "area_m2"],
    }
    layers = {
        key: gpd.GeoDataFrame(
            {c: [row[k] for row in rows[key]] for k, c in enumerate(columns[key])},
            geometry=gpd.GeoSeries(shapes[key], crs=crs),
            crs=crs,
        )
        for key in rows
    }
    layers["problems"] = prepared.problems
    return layers


def bearing(direction: tuple[float, float]) -> float:
    """Give the bearing of a direction.

    Parameters
    ----------
    direction
        Vector, x east and y north.

    Returns
    -------
    float
        Degrees clockwise from north, 0 up to 360.
    """
    return math.degrees(math.atan2(direction[0], direction[1])) % 360.0


def _rows(site: Site) -> list[tuple[str, list[tuple[Any, ...]], list[Any]]]:
    number = site.site_id
    area, around = float(site.polygon.area), float(site.polygon.length)
    streets = [(s, "edge") for s in site.boundary_streets]
    streets += [(s, INSIDE) for s in site.inner_streets]
    points = site.access_points
    return [
        (
            "site",
            [(number, site.name, area, area / 1e4, around, site.snap_distance)],
            [site.polygon],
        ),
        (
            "boundary_streets",
            [(number, s.name, s.kind, place, float(s.line.length)) for s, place in streets],
            [s.line for s, _ in streets],
        ),
        (
            "access_points",
            [(number, p.name, bearing(p.direction)) for p in points],
            [Point(p.xy) for p in points],
        ),
        (
            "site_obstacles",
            [(number, float(o.area)) for o in site.obstacles],
            list(site.obstacles),
        ),
    ]


def _back(geometry: list[Any], site: Site) -> list[Any]:
    """Geometries in the CRS of the input."""
    if site.crs == site.source_crs or not geometry:
        return geometry
    array = np.empty(len(geometry), dtype=object)
    array[:] = geometry
    moved = gpd.GeoSeries(shapely.force_2d(array), crs=site.crs).to_crs(site.source_crs)
    return list(moved)
