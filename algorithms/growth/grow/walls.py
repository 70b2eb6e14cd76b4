"""Walls: the rings of the ground that streets stay in."""

from __future__ import annotations

from math import hypot

import numpy as np
import shapely

from .cells import Segment, SegmentCells, box, corridor


class Walls:
    """The rings of a domain, exterior and holes, as a grid of segments.

    Parameters
    ----------
    domain
        Polygon or MultiPolygon; None or empty for no walls at all.
    cell
        Least side of the cells of the grid, metres.
    tolerance
        What lies this near to a wall lies on it, metres.

    Attributes
    ----------
    any
        Whether there are walls.
    """

    def __init__(self, domain: shapely.Geometry | None, cell: float, tolerance: float) -> None:
        self.any = domain is not None and not domain.is_empty
        self.domain = domain
        self.tolerance = tolerance
        self.segment: list[Segment] = []
        perimeter = domain.length if domain is not None else 0.0
        self.lines = SegmentCells(max(cell, perimeter / 1e5), tolerance)
        if domain is None:
            return
        shapely.prepare(domain)
        for part in shapely.get_parts(domain):
            for ring in (part.exterior, *part.interiors):
                points = np.asarray(ring.coords)[:, :2]
                pieces = np.hstack([points[:-1], points[1:]])
                pieces = pieces[np.any(pieces[:, :2] != pieces[:, 2:], axis=1)]
                self.segment += [(a, b, c, d) for a, b, c, d in pieces.tolist()]
        for number, piece in enumerate(self.segment):
            self.lines.add(number, piece)

    def touching(self, x: float, y: float) -> set[int]:
        """Return the walls on which a point lies."""
        found = set()
        for key in box(x, y, self.tolerance, self.lines.per):
            for wall in self.lines.cells.get(key, ()):
                if _distance(self.segment[wall], x, y) <= self.tolerance:
                    found.add(wall)
        return found

    def inside(self, x: float, y: float) -> bool:
        """Tell whether a point lies in the domain or on a wall."""
        if not self.any:
            return True
        return bool(shapely.contains_xy(self.domain, x, y)) or bool(self.touching(x, y))

    def hit(self, segment: Segment) -> float | None:
        """Return how far along a segment the first wall is, metres, or None.

        Walls on which the segment begins do not count; a street that leads out from there is
        stopped at once, at 0.
        """
        x0, y0, x1, y1 = segment
        dx, dy = x1 - x0, y1 - y0
        length = hypot(dx, dy)
        ux, uy = dx / length, dy / length
        tolerance = self.tolerance
        best, left = length + tolerance, None
        found = None
        find = self.lines.cells.get
        for key in corridor(segment, tolerance, self.lines.per):
            for wall in find(key, ()):
                ax, ay, bx, by = self.segment[wall]
                sa = ux * (ay - y0) - uy * (ax - x0)
                sb = ux * (by - y0) - uy * (bx - x0)
                if (sa > tolerance and sb > tolerance) or (sa < -tolerance and sb < -tolerance):
                    continue
                if left is None:
                    left = self.touching(x0, y0)
                if wall in left:
                    continue
                ta = ux * (ax - x0) + uy * (ay - y0)
                tb = ux * (bx - x0) + uy * (by - y0)
                if sa == sb:
                    at = min(ta, tb)
                else:
                    share = sa / (sa - sb)
                    at = ta + (0.0 if share < 0 else 1.0 if share > 1 else share) * (tb - ta)
                if 0 <= at < best:
                    best = found = at
        if left and self._leads_out(segment, best):
            return 0.0
        return found

    def _leads_out(self, segment: Segment, length: float) -> bool:
        """Tell whether a segment that begins on a wall begins outside of the domain."""
        x0, y0, x1, y1 = segment
        whole = hypot(x1 - x0, y1 - y0)
        # far enough off the wall to be sure, and before the next one
        share = min(0.5 * length, 100 * self.tolerance) / whole
        x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        return not shapely.contains_xy(self.domain, x, y) or bool(self.touching(x, y))


def _distance(segment: Segment, x: float, y: float) -> float:
    ax, ay, bx, by = segment
    dx, dy = bx - ax, by - ay
    along = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
    along = 0.0 if along < 0 else 1.0 if along > 1 else along
    return hypot(ax + along * dx - x, ay + along * dy - y)
