"""Room for buildings that face one way: where straight rows of them fit on a piece of ground."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..shape import facing_vectors
from ..types import Floats

#: A building that is larger than its room by this still fits, metres (rounding of coordinates).
SLACK = 5e-7
#: Step in which the outermost row is looked for, metres, and halvings that make it exact.
SCAN, HALVINGS = 2.0, 21


class Room:
    """Ground in the frame of a façade: u along it, v from the balconies to the back, metres.

    Parameters
    ----------
    ground
        What footprints may cover: a Polygon or MultiPolygon.
    facing_deg
        Azimuth of the balconies, degrees clockwise from grid north.
    origin
        Where u and v are 0, None for a corner of the ground.
    """

    def __init__(
        self, ground: BaseGeometry, facing_deg: float, origin: tuple[float, float] | None = None
    ) -> None:
        self.ground = ground
        self.facing_deg = float(facing_deg)
        self._out = facing_vectors(np.array([facing_deg]))[0]
        self._way = np.array([-self._out[1], self._out[0]])
        corner = (0.0, 0.0) if ground.is_empty else ground.bounds[:2]
        self._origin = np.array(corner if origin is None else origin)
        rings = shapely.get_rings(shapely.get_parts(ground))
        xy, of = shapely.get_coordinates(rings, return_index=True)
        uv = self.local(xy)
        same = of[1:] == of[:-1]
        self._a, self._b = uv[:-1][same], uv[1:][same]
        self._centres: dict[tuple[float, float], BaseGeometry] = {}

    @property
    def empty(self) -> bool:
        """Tell whether there is no ground."""
        return len(self._a) == 0

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Least u and v, greatest u and v, metres."""
        low, high = self._a.min(axis=0), self._a.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def local(self, xy: Floats) -> Floats:
        """Turn points of the working CRS into (u, v), shape (n, 2)."""
        at = np.asarray(xy, dtype=float) - self._origin
        return np.column_stack([at @ self._way, -(at @ self._out)])

    def world(self, uv: Floats) -> Floats:
        """Turn (u, v) into points of the working CRS, shape (n, 2)."""
        at = np.asarray(uv, dtype=float)
        turned: Floats = self._origin + at[:, :1] * self._way - at[:, 1:2] * self._out
        return turned

    def spans(self, v: float, length: float, width: float) -> Floats:
        """Give the stretches of a row on which buildings of a size find room.

        Parameters
        ----------
        v
            Where the centre line of the row lies.
        length, width
            Size of the buildings, metres.

        Returns
        -------
        numpy.ndarray
            First and last u of the ground of the row, each stretch at least as long as a
            building, ascending, shape (n, 2).
        """
        low, high = v - width / 2 + SLACK, v + width / 2 - SLACK
        a, b = self._a, self._b
        near = (np.minimum(a[:, 1], b[:, 1]) < high) & (np.maximum(a[:, 1], b[:, 1]) > low)
        a, b = a[near], b[near]
        if not len(a):
            return np.zeros((0, 2))
        rise = b[:, 1] - a[:, 1]
        flat = np.abs(rise) < 1e-12
        safe = np.where(flat, 1.0, rise)
        part = np.stack([(low - a[:, 1]) / safe, (high - a[:, 1]) / safe])
        part = np.minimum(np.maximum(part, 0.0), 1.0)
        part[:, flat] = np.array([[0.0], [1.0]])
        ends = a[:, 0] + part * (b[:, 0] - a[:, 0])
        first, last = ends.min(axis=0), ends.max(axis=0)
        order = np.argsort(first, kind="stable")
        first, reached = first[order], np.maximum.accumulate(last[order])
        wide = np.flatnonzero(first[1:] - reached[:-1] >= length - 2 * SLACK)
        free = np.column_stack([reached[wide], first[wide + 1]])
        return free[[self._inside(float(u), v) for u in free.mean(axis=1)]]

    def _inside(self, u: float, v: float) -> bool:
        """Tell whether a point that is on no edge lies on the ground."""
        a, b = self._a, self._b
        cross = (a[:, 1] > v) != (b[:, 1] > v)
        a, b = a[cross], b[cross]
        at = a[:, 0] + (v - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
        return bool(np.count_nonzero(at < u) % 2)

    def stretches(self, v: float, sizes: Floats) -> Floats:
        """Give the stretches of a row on which a building of any of the sizes finds room.

        Parameters
        ----------
        v
            Where the centre line of the row lies.
        sizes
            Length and width of the buildings, metres, shape (k, 2).

        Returns
        -------
        numpy.ndarray
            Disjoint, ascending, shape (n, 2).
        """
        found = np.concatenate([self.spans(v, *size) for size in sizes] + [np.zeros((0, 2))])
        return merged(found)

    def outermost(self, length: float, width: float, *, back: bool = False) -> float | None:
        """Give the v of the first row with room for a building, or of the last; None for none."""
        if self.empty:
            return None
        _, low, _, high = self.bounds
        low, high = low + width / 2, high - width / 2
        if high < low - 2 * SLACK:
            return None
        places = np.append(np.arange(low, high, SCAN), max(low, high))
        if back:
            places = low + high - places
        for k, v in enumerate(places):
            if len(self.spans(float(v), length, width)):
                return float(v) if k == 0 else self._edge(places[k - 1], v, length, width)
        return None

    def _edge(self, blocked: float, free: float, length: float, width: float) -> float:
        """Find the row with room next to one without, to a fraction of a millimetre."""
        for _ in range(HALVINGS):
            middle = (blocked + free) / 2
            if len(self.spans(middle, length, width)):
                free = middle
            else:
                blocked = middle
        return float(free)

    def centres(self, length: float, width: float) -> BaseGeometry:
        """Give the ground on which the centre of a building may stand, in the working CRS.

        That is the ground without the Minkowski sum of its edges and the building.
        """
        key = (length, width)
        if key not in self._centres:
            corner = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) * (
                np.array([length, width]) / 2 - SLACK
            )
            points = np.concatenate(
                [self._a[:, None] + corner, self._b[:, None] + corner], axis=1
            )  # fmt: skip
            swept = shapely.convex_hull(shapely.multipoints(points))
            local = shapely.transform(self.ground, self.local)
            left = shapely.difference(local, shapely.union_all(swept))
            self._centres[key] = shapely.transform(left, self.world)
        return self._centres[key]

    def standing(self, sizes: Floats) -> BaseGeometry:
        """Give the ground on which the centre of a building of any of the sizes may stand."""
        return shapely.union_all([self.centres(*size) for size in sizes])


def merged(spans: Floats) -> Floats:
    """Join intervals that overlap, shape (n, 2)."""
    out: list[list[float]] = []
    for low, high in sorted(spans.tolist()):
        if out and low <= out[-1][1]:
            out[-1][1] = max(out[-1][1], high)
        else:
            out.append([low, high])
    return np.array(out).reshape(-1, 2)
