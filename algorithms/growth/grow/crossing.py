"""The strip between sites and the streets along their edges, that new streets only cross."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import NamedTuple

import shapely
from shapely.geometry import LineString, Point

from ..types import Strip

#: Streets run so far beside the edge of a site as if they were inside (metres).
SLACK = 1.0
#: A way over the strip is at most so many times as long as the strip is wide there: 30 degrees.
ASKEW = 2.0
#: What lies this near to a street lies on it (metres).
ON = 0.01

Place = tuple[float, float]


class Way(NamedTuple):
    """Where a street could lead instead: a place, and whether it ends there at the site's edge."""

    place: Place
    edge: bool = False


class Crossing:
    """Tells which streets cross the strip, and leads others over it.

    Parameters
    ----------
    strip
        The sites and the streets along their edges.
    domain
        Ground that streets stay in.
    depth
        A street that comes over the strip ends so far inside a site at least, metres.
    """

    def __init__(self, strip: Strip, domain: shapely.Geometry, depth: float) -> None:
        self.sites, self.streets, self.depth = strip.sites, strip.streets, depth
        self.inner = shapely.buffer(strip.sites, SLACK, join_style="mitre")
        self.domain = domain
        for area in (self.sites, self.streets, self.inner, self.domain):
            shapely.prepare(area)

    def inside(self, place: Place) -> bool:
        """Tell whether a place is inside a site, not in the strip.

        Parameters
        ----------
        place
            The place.
        """
        return bool(shapely.intersects_xy(self.inner, *place))

    def allowed(self, start: Place, end: Place) -> bool:
        """Tell whether a street stays in a site but for short ways over the strip to a street.

        Parameters
        ----------
        start, end
            Where it begins and ends.
        """
        line = LineString([start, end])
        if shapely.covers(self.inner, line):
            return True
        for part in shapely.get_parts(shapely.difference(line, self.inner)):
            if part.length < ON:
                continue
            tips = [tip for tip in part.coords if tip in (start, end)]
            if len(tips) != 1 or not self._short(tips[0], part.length):
                return False
        return True

    def others(self, start: Place, end: Place) -> Iterator[Way]:
        """Give where a street that is not allowed could lead instead, the straightest first.

        Parameters
        ----------
        start, end
            Where it begins, and where it would end.
        """
        length = hypot(end[0] - start[0], end[1] - start[1])
        way = (end[0] - start[0]) / length, (end[1] - start[1]) / length

        def ahead(distance: float) -> Place:
            return start[0] + distance * way[0], start[1] + distance * way[1]

        entry = 0.0
        if not self.inside(start):
            gap = float(shapely.distance(self.inner, Point(start)))
            far = shapely.intersection(LineString([start, ahead(ASKEW * gap + SLACK)]), self.inner)
            if far.is_empty:
                return
            entry = float(far.distance(Point(start)))
            length = max(length, entry + self.depth)
            yield Way(ahead(length))
        out = self._exit(LineString([start, ahead(length)]), entry)
        if out is None or out - entry < self.depth:
            return
        leaves = Point(ahead(out))
        gap = float(shapely.distance(self.streets, leaves))
        yield Way(ahead(out + ASKEW * gap + SLACK))
        foot = shapely.get_coordinates(shapely.shortest_line(leaves, self.streets))[1].tolist()
        yield Way((foot[0], foot[1]))
        # an end at the edge of the site is poor: only where something stands in the way
        tip = leaves.x, leaves.y
        ways = shapely.linestrings([[start, tip], [tip, (foot[0], foot[1])]])
        if shapely.covers(self.domain, ways).tolist() == [True, False]:
            yield Way(tip, edge=True)

    def _short(self, tip: Place, length: float) -> bool:
        """Tell whether a way over the strip of a length ends at a street, and is short enough."""
        point = Point(tip)
        if not shapely.dwithin(self.streets, point, ON):
            return False
        return bool(length <= ASKEW * shapely.distance(self.inner, point) + SLACK)

    def _exit(self, line: LineString, entry: float) -> float | None:
        """Return how far along a line it leaves the site that it enters at a distance."""
        start = Point(line.coords[0])
        for part in shapely.get_parts(shapely.intersection(line, self.sites)):
            if part.length > ON:
                tips = Point(part.coords[0]), Point(part.coords[-1])
                near, far = sorted(start.distance(tip) for tip in tips)
                if near <= entry + 2 * ASKEW * SLACK + ON:
                    return float(far)
        return None
