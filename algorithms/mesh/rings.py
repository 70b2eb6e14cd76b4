"""Closed boundary curves by arc length, their corners, and the points that must be kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from .quadmesh import FloatArray, IntArray

CORNER_WINDOW = 0.4
"""Half the window over which the turn of a corner is measured, in edge lengths."""
CORNER_ANGLE = np.radians(35.0)
STRONG_CORNER = np.radians(60.0)
LEAST_SPACING = 0.45
"""Distance under which two kept points of a boundary become one, in edge lengths."""


def wrap(angle: npt.ArrayLike) -> FloatArray:
    """Bring angles (radians) to [-pi, pi)."""
    return np.asarray((np.asarray(angle, dtype=float) + np.pi) % (2 * np.pi) - np.pi)


class Ring:
    """A closed polyline with arc length, the site on its left.

    Parameters
    ----------
    coordinates
        Shape (k, 2), metres; a repeated last point is dropped.
    """

    def __init__(self, coordinates: npt.ArrayLike) -> None:
        points = np.asarray(coordinates, dtype=float)[:, :2]
        step = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
        self.points: FloatArray = points[step > 1e-9]
        self.closed: FloatArray = np.vstack([self.points, self.points[:1]])
        steps = np.hypot(*np.diff(self.closed, axis=0).T)
        self.along: FloatArray = np.concatenate([[0.0], np.cumsum(steps)])
        self._units: FloatArray = np.diff(self.closed, axis=0) / steps[:, None]
        self.length = float(self.along[-1])
        self.line = shapely.linearrings(self.points)

    def at(self, arc: npt.ArrayLike) -> FloatArray:
        """Return the points (k, 2) at arc lengths, which may run over either end."""
        t = np.mod(arc, self.length)
        return np.stack([np.interp(t, self.along, self.closed[:, d]) for d in (0, 1)], axis=-1)

    def walk(self, arc: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points and unit tangents, both (k, 2), at arc lengths (k,)."""
        t = np.mod(arc, self.length)
        i = np.minimum(np.searchsorted(self.along, t, "right") - 1, len(self.points) - 1)
        tangent = self._units[i]
        return self.closed[i] + (t - self.along[i])[:, None] * tangent, tangent

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the arc length of the nearest place and the distance to it, both (k,)."""
        given = shapely.points(points)
        return shapely.line_locate_point(self.line, given), shapely.distance(self.line, given)

    def heading(self, start: npt.ArrayLike, end: npt.ArrayLike) -> FloatArray:
        """Return directions (radians) of the chords between arc lengths."""
        v = self.at(end) - self.at(start)
        return np.asarray(np.arctan2(v[..., 1], v[..., 0]))

    def turn(self, arc: npt.ArrayLike, before: npt.ArrayLike, after: npt.ArrayLike) -> FloatArray:
        """Return the turn (radians, left positive) over a window around arc lengths."""
        t = np.asarray(arc, dtype=float)
        return wrap(self.heading(t, t + after) - self.heading(t - before, t))

    def part(self, start: float, end: float) -> FloatArray:
        """Return the polyline from one arc length on to a later one (end > start)."""
        shift = np.floor(start / self.length) * self.length
        a, b = start - shift, end - shift
        along = np.concatenate([self.along[:-1], self.along[:-1] + self.length])
        slack = 1e-6
        inside = (along > a + slack) & (along < b - slack)
        between = np.vstack([self.points, self.points])[inside]
        return np.vstack([self.at([a]), between, self.at([b])])

    def gap(self, a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
        """Return the distance along the ring between arc lengths, the shorter way."""
        d = np.mod(np.asarray(a, dtype=float) - np.asarray(b, dtype=float), self.length)
        return np.asarray(np.minimum(d, self.length - d))


@dataclass(frozen=True, eq=False)
class Stations:
    """Points of a ring that become vertices, in order of arc length.

    Attributes
    ----------
    arc
        Shape (k,). Arc lengths in [0, length), rising.
    corner
        Shape (k,), bool. Corners of the ring; the others are given points.
    point
        Shape (k,). Index of the given point, or -1.
    """

    arc: FloatArray
    corner: npt.NDArray[np.bool_]
    point: IntArray


def polygon_rings(polygon: Polygon) -> list[Ring]:
    """Return the rings of a polygon, exterior first, each with the polygon on its left."""
    turned = shapely.geometry.polygon.orient(polygon, 1.0)
    return [Ring(r.coords) for r in (turned.exterior, *turned.interiors)]


def find_corners(
    ring: Ring, h: float, least: float = CORNER_ANGLE
) -> tuple[FloatArray, FloatArray]:
    """Return arc lengths and turns (radians) of the corners of a ring.

    A corner is a vertex where the chord turns by more than `least` (radians) over a window
    of 0.4 h to both sides; of neighbours in one window with turns of one sign the strongest
    counts.
    """
    window = min(CORNER_WINDOW * h, ring.length / 8)
    arc = ring.along[:-1]
    turn = ring.turn(arc, window, window)
    found: list[int] = []
    for i in np.argsort(-np.abs(turn), kind="stable").tolist():
        if abs(turn[i]) < least:
            break
        near = [j for j in found if ring.gap(arc[i], arc[j]) < window and turn[i] * turn[j] > 0]
        if not near:
            found.append(i)
    found.sort()
    return arc[found], turn[found]


def place_stations(
    rings: Sequence[Ring],
    h: float,
    points: FloatArray,
    indices: IntArray,
    corner_angle: float = CORNER_ANGLE,
) -> tuple[list[Stations], list[int]]:
    """Choose the points of every ring that must become vertices.

    Strong corners come first, then given points, then other corners; what lies within
    0.45 h of a kept one goes. A given point takes the place of a corner within 0.02 h.

    Parameters
    ----------
    rings
        Rings of one part of the site.
    h
        Edge length, metres.
    points, indices
        Given points (k, 2) near these rings and the indices by which the caller knows them.
    corner_angle
        Least turn of a corner, radians.

    Returns
    -------
    tuple
        Stations of each ring; indices of the given points that had to go.
    """
    nearest = np.zeros(0, dtype=int)
    located = np.zeros((len(rings), len(points)))
    if len(points):
        projections = [ring.project(points) for ring in rings]
        nearest = np.argmin(np.array([d for _, d in projections]), axis=0)
        located = np.array([t for t, _ in projections])
    stations, lost = [], []
    for r, ring in enumerate(rings):
        arcs, turns = find_corners(ring, h, corner_angle)
        rank = [(-2.0 if abs(w) > STRONG_CORNER else 0.0) - abs(w) / 9 for w in turns]
        marks = [(k, float(t), True, -1) for k, t in zip(rank, arcs)]
        marks += [
            (-1.0, float(located[r, i]), False, int(indices[i]))
            for i in np.flatnonzero(nearest == r)
        ]
        kept: list[tuple[float, bool, int]] = []
        for _, arc, corner, point in sorted(marks):
            gaps = [float(ring.gap(arc, other[0])) for other in kept]
            if not gaps or min(gaps) >= LEAST_SPACING * h:
                kept.append((arc, corner, point))
            elif point >= 0 and min(gaps) < 0.02 * h:
                i = int(np.argmin(gaps))
                if kept[i][2] < 0:
                    kept[i] = (kept[i][0], kept[i][1], point)
            elif point >= 0:
                lost.append(point)
        kept.sort()
        stations.append(
            Stations(
                np.array([k[0] for k in kept], dtype=float),
                np.array([k[1] for k in kept], dtype=bool),
                np.array([k[2] for k in kept], dtype=np.int64),
            )
        )
    return stations, lost
