"""Streets inside a site that were cut at its edge reach the streets along it again."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon

#: Ends this near to the edge of a site lie on it (metres).
ON_EDGE = 0.05
#: Ends this near to a street meet it (metres).
MEETS = 0.02
#: Ends are led straight on where the street ahead is at most this many times as far away as the
#: nearest.
DETOUR = 2.0


def led_to_streets(
    lines: Sequence[LineString], streets: Sequence[LineString], polygon: Polygon, reach: float
) -> list[LineString]:
    """Lead streets inside a site on to the centre lines of those along its edge.

    A prepared site cuts its inner streets at the edge, which is often the property line, half a
    street width from the centre line that they lead to.

    Parameters
    ----------
    lines
        Streets inside the site, metres.
    streets
        Streets along its edge.
    polygon
        The site.
    reach
        Largest distance of those from the edge, metres.

    Returns
    -------
    list of LineString
        The lines, in their order, with a vertex more where they were led on.
    """
    result = list(lines)
    if not streets or not lines:
        return result
    network = shapely.union_all(list(streets))
    whole = np.array(lines, dtype=object)
    tree = shapely.STRtree(whole)
    for end in (0, -1):
        tips = shapely.get_point(whole, end)
        shapely.prepare(network)
        open_ = shapely.dwithin(tips, polygon.boundary, ON_EDGE)
        open_ &= ~shapely.dwithin(tips, network, MEETS)
        tip, other = tree.query(tips, predicate="dwithin", distance=MEETS)
        open_[tip[tip != other]] = False
        for k in np.flatnonzero(open_).tolist():
            xy = [(float(x), float(y)) for x, y in result[k].coords]
            target = _ahead(xy[end], xy[1 if end == 0 else -2], network, reach)
            if target is not None:
                xy.insert(0 if end == 0 else len(xy), target)
                result[k] = LineString(xy)
    return result


def _ahead(
    tip: tuple[float, float],
    before: tuple[float, float],
    network: shapely.Geometry,
    reach: float,
) -> tuple[float, float] | None:
    """Find where a street goes on to: straight ahead, else to the nearest place."""
    gap = float(network.distance(Point(tip)))
    if gap > reach:
        return None
    size = math.dist(tip, before)
    far = min(DETOUR * gap, 1.5 * reach)
    way = LineString([tip, tuple(t + far * (t - b) / size for t, b in zip(tip, before))])
    hits = shapely.get_coordinates(shapely.intersection(way, network)).tolist()
    if not hits:
        hits = [shapely.get_coordinates(shapely.shortest_line(Point(tip), network))[1].tolist()]
    x, y = min(hits, key=lambda hit: math.dist(hit, tip))
    return float(x), float(y)
