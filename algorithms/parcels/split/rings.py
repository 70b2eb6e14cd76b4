"""Streets that tie the streets around a hole to those around the region: two at once."""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Polygon

from ..edges import EdgeKind
from ..roadmesh import StreetMesh
from .cutting import cut

Floats = npt.NDArray[np.float64]
#: Places on a hole from which a street is tried.
PLACES = 48
#: Streets meet others at no less than this (degrees).
LEAST_ANGLE = 60.0
#: Corners of the hole are no nearer than this to a street (metres).
FROM_CORNER = 8.0


def open_holes(mesh: StreetMesh, region: int) -> list[int]:
    """Rings of a region inside it that a street runs along.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    """
    found = []
    for k, ring in enumerate(mesh.regions[region].rings[1:], start=1):
        edges = (mesh.edge(a, b) for a, b in zip(ring, (*ring[1:], ring[0])))
        if any(edge.kind != EdgeKind.CLOSED for edge in edges):
            found.append(k)
    return found


def tie(mesh: StreetMesh, region: int, hole: int, street: int, width: float) -> list[int]:
    """Cut a ring-shaped region in two by two straight streets.

    Parameters
    ----------
    mesh, region
        The mesh, which changes, and the number of the region.
    hole
        Which of its rings is tied to the outer one.
    street
        Number of the first street; the second has the next.
    width
        Of the streets, metres.

    Returns
    -------
    list of int
        Numbers of the two parts; empty if no two streets were found.
    """
    polygon = mesh.polygon(region)
    lines = _rays(polygon, hole)
    pair = _best_pair(lines, polygon.interiors[hole - 1].length)
    if pair is None:
        return []
    return cut(mesh, region, pair, street, width)


def _rays(polygon: Polygon, hole: int) -> list[tuple[float, LineString, float]]:
    """Straight ways from a hole to the outer ring: place along the hole, the way, its badness."""
    ring = polygon.interiors[hole - 1]
    corners = shapely.get_coordinates(ring)
    reach = math.hypot(*np.ptp(shapely.get_coordinates(polygon), axis=0))
    found = []
    for k in range(PLACES):
        at = ring.length * (k + 0.5) / PLACES
        before, after = (shapely.get_coordinates(ring.interpolate(at + d))[0] for d in (-1.0, 1.0))
        here = shapely.get_coordinates(ring.interpolate(at))[0]
        along = (after - before) / (np.hypot(*(after - before)) or 1.0)
        if np.hypot(*(corners - here).T).min() < FROM_CORNER:
            continue
        for normal in (np.array([-along[1], along[0]]), np.array([along[1], -along[0]])):
            hit = shapely.intersection(
                LineString([here + normal * 0.01, here + normal * reach]), polygon.boundary
            )
            if hit.is_empty:
                continue
            away = shapely.get_coordinates(
                shapely.shortest_line(shapely.Point(here + normal * 0.01), hit)
            )[1]
            line = LineString([here, away])
            on_outer = polygon.exterior.distance(shapely.Point(away)) < 1e-6
            if not on_outer or not polygon.covers(shapely.Point(here + normal * 0.5)):
                continue
            slant = _slant(polygon, away, normal)
            if slant < math.cos(math.radians(LEAST_ANGLE)):
                found.append((at, line, line.length * (1 + slant)))
    return found


def _slant(polygon: Polygon, place: Floats, way: Floats) -> float:
    """Cosine of the angle between a way and the outer ring at a place."""
    ring = polygon.exterior
    at = ring.project(shapely.Point(place))
    ends = [shapely.get_coordinates(ring.interpolate((at + d) % ring.length))[0] for d in (-2, 2)]
    along = ends[1] - ends[0]
    return float(abs(along @ way) / (np.hypot(*along) or 1.0))


def _best_pair(
    lines: list[tuple[float, LineString, float]], around: float
) -> tuple[LineString, LineString] | None:
    """Choose two short ways that begin on opposite sides of the hole."""
    best: tuple[float, tuple[LineString, LineString]] | None = None
    for first, second in itertools.combinations(lines, 2):
        apart = abs(first[0] - second[0])
        apart = min(apart, around - apart) / around
        if apart < 0.25 or first[1].intersects(second[1]):
            continue
        cost = (first[2] + second[2]) / apart
        if best is None or cost < best[0]:
            best = (cost, (first[1], second[1]))
    return None if best is None else best[1]
