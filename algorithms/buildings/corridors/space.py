"""Street space of corridors, and what is left between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from ...parcels.streetspace import StreetLines, noded, street_space
from ...progress import Progress
from ...site import Site, carry_to_centre_line
from ..zone import Corridor

#: Edges of a patch this near to street space border on it (metres).
NEAR = 0.1
#: Streets up to this far outside the edge of a zone run on it, and take half their width of the
#: zone; further out its edge is the property line (metres).
ON_EDGE = 2.0
#: Streets along the edge may stop so far from a corner (metres).
TO_CORNER = 8.0
#: Shorter stretches of a ring give no access (metres).
SHORT = 1.0


def space_of(corridors: Sequence[Corridor], progress: Progress | None = None) -> BaseGeometry:
    """Return the ground that corridors take, empty where there are none."""
    if not corridors:
        return Polygon()
    count = len(corridors)
    lines = StreetLines(
        np.array([corridor.line for corridor in corridors], dtype=object),
        np.array([corridor.width_m / 2 for corridor in corridors]),
        np.zeros(count),
        np.ones(count, dtype=bool),
    )
    cut = noded(lines, progress)
    areas, _ = street_space(cut, np.zeros((len(cut.lines), 2), dtype=bool))
    return shapely.union_all(areas)


def access_of(polygon: Polygon, streets: BaseGeometry) -> MultiLineString:
    """Return the parts of the rings of a patch that border on streets.

    Parameters
    ----------
    polygon
        The patch.
    streets
        Street space, and lines of the edge of the zone that lie along a street.
    """
    if streets.is_empty:
        return MultiLineString()
    rings = shapely.boundary(polygon)
    along = shapely.intersection(rings, shapely.buffer(streets, NEAR))
    parts: list[Any] = _lines(along)
    merged = shapely.get_parts(shapely.line_merge(MultiLineString(parts))) if parts else []
    return MultiLineString([part for part in merged if part.length >= SHORT])


def space_in(
    polygon: Polygon, corridors: Sequence[Corridor], progress: Progress | None = None
) -> BaseGeometry:
    """Return what corridors take of a zone, and of the ground around it.

    Streets along the edge take half their width where the edge is their centre line, and nothing
    where it is the property line. Corridors that end on the edge are drawn through it, so that no
    slivers stay beside their end.

    Parameters
    ----------
    polygon
        The zone, metres.
    corridors
        In it and along its edge.
    progress
        Asked for cancellation.
    """
    zone = shapely.buffer(polygon, ON_EDGE, join_style="mitre", mitre_limit=3.0)
    near: list[Corridor] = []
    for own in corridors:
        if not own.edge:
            near.append(_through(own, polygon))
            continue
        parts = _lines(shapely.intersection(own.line, zone))
        near += [replace(own, line=_to_corners(part, polygon)) for part in parts]
    # not clipped to the zone: then a hair of ground would stay between its end and the edge
    return space_of(near, progress)


def _lines(geometry: BaseGeometry) -> list[Any]:
    """Return the lines of a geometry."""
    parts = shapely.get_parts(geometry)
    return [part for part in parts if part.geom_type == "LineString" and not part.is_empty]


def _to_corners(line: LineString, polygon: Polygon) -> LineString:
    """Draw a street along the edge on to the corners of the zone, which it stops short of."""
    inner = shapely.buffer(polygon, -1.25 * ON_EDGE)
    beside = shapely.buffer(polygon, ON_EDGE)
    xy = shapely.get_coordinates(line)
    for last in (False, True):
        turned = xy if last else xy[::-1]
        way = turned[-1] - turned[-2]
        beyond = turned[-1] + way / max(math.hypot(*way), 1e-9) * TO_CORNER
        leaves = not beside.contains(Point(beyond))
        if leaves and not inner.intersects(LineString([turned[-1], beyond])):
            turned = np.vstack([turned, beyond])
        xy = turned if last else turned[::-1]
    return LineString(xy)


def _through(corridor: Corridor, polygon: Polygon) -> Corridor:
    """Draw a corridor through the edge of the zone where it ends on it."""
    xy = shapely.get_coordinates(corridor.line)
    for last in (False, True):
        turned = xy if last else xy[::-1]
        way = turned[-1] - turned[-2]
        size = math.hypot(*way)
        if size > 0.0 and polygon.boundary.distance(Point(turned[-1])) < 0.05:
            beyond = turned[-1] + way / size * 2.0 * corridor.width_m
            # where the zone goes on behind a slot the street does not
            if LineString([turned[-1], beyond]).intersection(polygon).length < 0.5:
                turned = np.vstack([turned, beyond])
        xy = turned if last else turned[::-1]
    return replace(corridor, line=LineString(xy))


def joined(corridors: Sequence[Corridor], site: Site) -> list[Corridor]:
    """Draw corridors that end on the edge of a site on to the street beyond it.

    Parameters
    ----------
    corridors
        In the site.
    site
        With its boundary streets.

    Returns
    -------
    list of Corridor
        So that corridors and streets around are one network.
    """
    made = []
    for own in corridors:
        xy = shapely.get_coordinates(own.line)
        for last in (False, True):
            turned = xy if last else xy[::-1]
            end = turned[-1]
            if shapely.boundary(site.polygon).distance(Point(end)) > 0.5:
                continue
            way = end - turned[-2]
            there = carry_to_centre_line(
                site, (float(end[0]), float(end[1])), (float(way[0]), float(way[1]))
            )
            if there is not None and math.dist(there, end) > 0.01:
                turned = np.vstack([turned, there])
            xy = turned if last else turned[::-1]
        made.append(replace(own, line=LineString(xy)))
    return made
