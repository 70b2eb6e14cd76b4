"""The outline of a zone as a planner sees it, and where streets may come in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.polygon import orient

from ...site import Site
from ..types import Floats

#: Slots narrower than twice this are closed, and tails narrower than that cut off (metres).
SLOT, TAIL = 12.0, 9.0
#: Bends of the outline that do not count (share of the square root of the area).
ROUGH = 0.025
#: An access point or a stretch of frontage this near to the outline lies on it (metres).
ON_OUTLINE = 25.0
#: Step in which frontage is looked at (metres).
STEP = 5.0


@dataclass(frozen=True, eq=False)
class Outline:
    """A zone without its details.

    Attributes
    ----------
    ring
        Vertices, counter-clockwise, shape (n, 2), metres.
    line
        The ring as a closed line.
    gates
        Places of the access points along it, 0 to 1, shape (a,), in their order.
    gate_xy
        The access points themselves, on the boundary of the zone, shape (a, 2).
    fronts
        Places along it where there is a street outside, 0 to 1, shape (f,), about every 5 m.
    """

    ring: Floats
    line: LineString
    gates: Floats
    gate_xy: Floats
    fronts: Floats

    @property
    def length(self) -> float:
        """Length, metres."""
        return float(self.line.length)

    def at(self, place: Floats) -> Floats:
        """Return the points at places along the outline, shape (n, 2)."""
        points = shapely.line_interpolate_point(self.line, np.asarray(place) % 1.0, normalized=True)
        return np.asarray(shapely.get_coordinates(points))


def outline_of(site: Site) -> Outline:
    """Give the outline of a site.

    Parameters
    ----------
    site
        A prepared site.
    """
    ring = _ring(site.polygon)
    line = LineString(np.vstack([ring, ring[:1]]))
    gates, gate_xy = _on(line, site.access_xy)
    fronts = np.zeros((0, 2))
    if not site.street_frontage.is_empty:
        dense = shapely.segmentize(site.street_frontage, STEP)
        fronts = shapely.get_coordinates(dense)
    places, _ = _on(line, fronts)
    if len(places) == 0 and len(gates) == 0:  # no street anywhere: ways in may be anywhere
        places = np.arange(0.0, 1.0, STEP / line.length)
    return Outline(ring, line, gates, gate_xy, np.unique(np.round(places, 4)))


def _on(line: LineString, points: Floats) -> tuple[Floats, Floats]:
    """Return places along a closed line of the points near to it, and those points."""
    shapes = shapely.points(np.asarray(points, dtype=float).reshape(-1, 2))
    near = shapely.distance(line, shapes) <= ON_OUTLINE
    place = shapely.line_locate_point(line, shapes[near], normalized=True)
    order = np.argsort(place, kind="stable")
    return np.asarray(place[order]) % 1.0, np.asarray(points, dtype=float)[near][order]


def _ring(polygon: Polygon) -> Floats:
    """Return the outer ring without slots, tails and small bends."""
    shell = Polygon(polygon.exterior)
    size = float(np.sqrt(shell.area))
    grow = {"join_style": "mitre", "mitre_limit": 3.0}
    slot, tail = min(SLOT, 0.1 * size), min(TAIL, 0.05 * size)
    closed = shapely.buffer(shapely.buffer(shell, slot, **grow), -slot, **grow)
    opened = shapely.buffer(shapely.buffer(closed, -tail, **grow), tail, **grow)
    largest = max(_polygons(opened) or [shell], key=lambda part: part.area)
    plain = shapely.simplify(Polygon(largest.exterior), ROUGH * size)
    if plain.is_empty or plain.geom_type != "Polygon" or not plain.is_valid:
        plain = shell
    return np.asarray(orient(plain).exterior.coords)[:-1, :2]


def _polygons(geometry: Any) -> list[Polygon]:
    """Return the polygons of a geometry."""
    return [part for part in shapely.get_parts(geometry) if part.geom_type == "Polygon"]
