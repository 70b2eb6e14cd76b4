"""A polyline with distances along it: fronts are asked for points and normals again and again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
#: Normals are taken from a chord that goes this far to both sides (metres).
CHORD = 14.0


class Line:
    """A polyline that knows how far along it its vertices are.

    Parameters
    ----------
    xy
        Its vertices, shape (n, 2), n > 1, metres.
    """

    def __init__(self, xy: Floats) -> None:
        step = xy[1:] - xy[:-1]
        long = np.sqrt(step[:, 0] ** 2 + step[:, 1] ** 2)
        self.xy = xy
        #: distance of each vertex from the first, metres
        self.place = np.zeros(len(xy))
        long.cumsum(out=self.place[1:])
        self.length = float(self.place[-1])
        self._way = step / np.maximum(long, 1e-12)[:, None]
        self._inner = self.place[1:-1]

    def at(self, distance: Floats) -> Floats:
        """Return the points at distances from the start, on the line's length, shape (m, 2)."""
        if len(self.xy) == 2:
            found = self.xy[0] + distance[:, None] * self._way[0]
        else:
            k = self._inner.searchsorted(distance, side="right")
            found = self.xy[k] + (distance - self.place[k])[:, None] * self._way[k]
        # the end to the last bit: other lines may end there too
        found[distance >= self.length] = self.xy[-1]
        return np.asarray(found)

    def normals(self, distance: Floats) -> Floats:
        """Return the directions to the left at distances from the start, unit, shape (m, 2).

        Square to a chord: an edge of a polygonal arc may lie 3 degrees off.
        """
        found = np.empty((len(distance), 2))
        if len(self.xy) == 2:
            found[:, 0], found[:, 1] = -self._way[0, 1], self._way[0, 0]
            return found
        half = np.minimum(np.maximum(np.minimum(distance, self.length - distance), 1.0), CHORD)
        low = np.maximum(distance - half, 0.0)
        high = np.minimum(distance + half, self.length)
        way = self.at(high) - self.at(low)
        long = np.maximum(np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2), 1e-9)
        found[:, 0], found[:, 1] = -way[:, 1] / long, way[:, 0] / long
        return found


def along(xy: Floats, distance: Floats) -> Floats:
    """Return the points of a polyline at distances from its start, shape (m, 2)."""
    return Line(xy).at(distance)


def steps_of(xy: Floats) -> Floats:
    """Return how far along a polyline each of its vertices is, shape (n,), metres."""
    return Line(xy).place
