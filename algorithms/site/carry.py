"""Designed streets are carried on from the property line to the street that they meet."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import LineString, Point
from shapely.ops import nearest_points

from .types import Site

_OBLIQUE = 2.0
"""A way straight on is taken up to this many times the shortest way."""

_TOUCHING = 0.01


def carry_to_centre_line(
    site: Site,
    xy: tuple[float, float],
    direction: tuple[float, float],
    max_distance: float | None = None,
) -> tuple[float, float] | None:
    """Find where a street that ends on the property line meets the centre line beyond it.

    Parameters
    ----------
    site
        The site with its boundary streets.
    xy
        End of the designed street on the site's boundary, metres.
    direction
        Direction in which it arrives, pointing out of the site; any length but zero.
    max_distance
        Furthest way, metres; twice the site's snap distance if None.

    Returns
    -------
    tuple of float or None
        Point on the centre line: straight on, where that way is at most twice the shortest;
        else the nearest point. `xy` itself where it lies on the centre line; None where no
        boundary street is near, or only across the site.
    """
    limit = 2.0 * site.snap_distance if max_distance is None else max_distance
    here = Point(xy)
    best: tuple[float, Point] | None = None
    for street in site.boundary_streets:
        foot = nearest_points(here, street.line)[1]
        gap = float(here.distance(foot))
        if gap <= _TOUCHING:
            return xy
        if gap > limit or (best is not None and gap >= best[0]) or _crosses(site, here, foot):
            continue
        best = (gap, foot)
    if best is None:
        return None
    straight = _straight_on(site, here, direction, min(limit, _OBLIQUE * best[0]))
    place = best[1] if straight is None else straight
    return (float(place.x), float(place.y))


def _straight_on(
    site: Site, here: Point, direction: tuple[float, float], reach: float
) -> Point | None:
    size = math.hypot(*direction)
    if size < 1e-12:
        return None
    ahead = (here.x + direction[0] / size * reach, here.y + direction[1] / size * reach)
    lines = np.array([s.line for s in site.boundary_streets], dtype=object)
    way = LineString([(here.x, here.y), ahead])
    hits = [Point(c) for c in shapely.get_coordinates(shapely.intersection(lines, way)).tolist()]
    if not hits:
        return None
    hit = min(hits, key=here.distance)
    return None if _crosses(site, here, hit) else hit


def _crosses(site: Site, here: Point, there: Point) -> bool:
    """Tell whether the way leads through the site (more than the roundness of a corner)."""
    way = LineString([here, there])
    return bool(way.intersection(site.polygon).length > max(1.0, 0.25 * way.length))
