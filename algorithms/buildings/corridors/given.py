"""Corridors from a layer of streets: those in a zone, and those along its edge."""

from __future__ import annotations

from dataclasses import dataclass

import geopandas as gpd
import numpy as np
import shapely
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from ...parcels.streetspace import (
    StreetWidths,
    levels_of,
    names_of,
    read_streets,
    widths_of,
)
from ...site import Site
from ...site.crs import layer_crs, transformer
from ...site.frontage import frontage
from ...site.repair import Problems
from ...site.roadnetwork import build_network
from ...site.types import BoundaryStreet
from ..layout import Finding
from ..zone import Corridor

#: Streets this near to the edge of the zone run along it (metres), if so much of them does (share).
ALONG, MOSTLY = 4.0, 0.8
#: Shorter pieces of a street within the zone are left out (metres).
SHORTEST = 3.0


@dataclass(frozen=True)
class Given:
    """What a layer of streets says about a zone.

    Attributes
    ----------
    inner
        Corridors in the zone, clipped to it.
    edge
        Streets along its edge; only looked for where the site has none of its own.
    frontage
        The parts of its rings along these.
    barrier
        Ground that streets without access take, such as motorways.
    findings
        Lines that could not be used.
    """

    inner: tuple[Corridor, ...]
    edge: tuple[Corridor, ...]
    frontage: MultiLineString
    barrier: BaseGeometry
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class _Line:
    """A street of the layer."""

    line: shapely.Geometry
    width_m: float
    level: int
    name: str
    access: bool


def given_corridors(site: Site, frame: gpd.GeoDataFrame, layer: str, widths: StreetWidths) -> Given:
    """Read the corridors of a zone from a layer of streets of any make.

    Parameters
    ----------
    site
        The zone.
    frame
        Centre lines in any CRS, with the fields level, width_m, name or those of a map.
    layer
        Its name.
    widths
        Widths by level, for streets without a width of their own.

    Returns
    -------
    Given

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    lines, findings = _read(site, frame, layer, widths)
    rim = shapely.buffer(shapely.boundary(site.polygon), ALONG)
    deep = shapely.buffer(site.polygon, -ALONG, join_style="mitre")
    inner, outer = [], []
    for own in [line for line in lines if line.access]:
        inside = shapely.intersection(own.line, site.polygon)
        parts = [p for p in shapely.get_parts(inside) if p.geom_type == "LineString"]
        for part in parts:
            beside = shapely.intersection(part, rim).length
            if part.length > SHORTEST and beside < MOSTLY * part.length:
                inner.append(Corridor(part, own.width_m, own.level, own.name))
        rest = shapely.difference(own.line, deep)
        outer += [
            _Line(p, own.width_m, own.level, own.name, True)
            for p in shapely.get_parts(rest)
            if p.geom_type == "LineString" and p.length > SHORTEST
        ]
    edge, along = ([], MultiLineString()) if site.boundary_streets else _along(site, outer)
    closed = [own for own in lines if not own.access]
    barrier = shapely.union_all(
        [shapely.buffer(own.line, own.width_m / 2, cap_style="flat") for own in closed]
    )
    return Given(tuple(inner), tuple(edge), along, barrier, tuple(findings))


def existing(
    streets: tuple[BoundaryStreet, ...], widths: StreetWidths, *, edge: bool
) -> list[Corridor]:
    """Return existing streets of a site as corridors.

    Parameters
    ----------
    streets
        Boundary streets, or streets inside that are kept.
    widths
        Widths by level; the level follows from the road class.
    edge
        Whether they run along the edge.
    """
    frame = gpd.GeoDataFrame({"highway": [own.kind for own in streets]})
    return [
        Corridor(own.line, float(width), int(level), own.name, edge)
        for own, width, level in zip(streets, widths_of(frame, widths), levels_of(frame))
    ]


def _read(
    site: Site, frame: gpd.GeoDataFrame, layer: str, widths: StreetWidths
) -> tuple[list[_Line], list[Finding]]:
    """Return the streets near a site, in its CRS, and what could not be read."""
    source = layer_crs(frame, layer)
    reach = site.snap_distance * np.array([-1.0, -1.0, 1.0, 1.0])
    window = np.array(site.polygon.bounds) + reach
    if source != site.crs:
        window = np.array(transformer(site.crs, source).transform_bounds(*window))
    bounds = shapely.bounds(np.asarray(frame.geometry.array, dtype=object)).reshape(-1, 4)
    # what has no bounds is told of
    away = (bounds[:, :2] > window[2:]).any(axis=1) | (bounds[:, 2:] < window[:2]).any(axis=1)
    near = frame[~away]
    problems = Problems()
    found: list[_Line] = []
    if len(near):
        kind = {
            "width": widths_of(near, widths).tolist(),
            "level": levels_of(near).tolist(),
            "name": names_of(near),
        }
        alike: dict[tuple[float, int, str], list[int]] = {}
        for at, key in enumerate(zip(kind["width"], kind["level"], kind["name"])):
            alike.setdefault(key, []).append(at)
        for (width, level, name), rows in alike.items():
            read = read_streets(near.iloc[rows], widths, site.crs, layer, problems)
            found += [
                _Line(line, width, level, name, bool(access))
                for line, access in zip(read.lines, read.access)
            ]
    rows = problems.to_frame(site.crs)
    here = site.polygon.representative_point()
    findings = [
        Finding(
            f"Layer '{layer}', feature {row.feature}: {row.problem}.",
            f"It was {row.action}.",
            "warning",
            here if row.geometry is None else row.geometry,
        )
        for row in rows.itertuples()
    ]
    return found, findings


def _along(site: Site, lines: list[_Line]) -> tuple[list[Corridor], MultiLineString]:
    """Return the streets along the edge of a site, and the parts of its rings beside them."""
    if not lines:
        return [], MultiLineString()
    shapes = np.array([own.line for own in lines], dtype=object)
    names = np.array([own.name for own in lines], dtype=object)
    # the network carries a class along: here the number of the street
    numbers = np.array([str(at) for at in range(len(lines))], dtype=object)
    found = frontage(site.polygon, build_network(shapes, names, numbers), site.snap_distance)
    edge = [
        Corridor(own.line, lines[int(own.kind)].width_m, lines[int(own.kind)].level, own.name, True)
        for own in found.streets
    ]
    return edge, found.stretches
