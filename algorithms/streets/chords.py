"""Straight ways across a block, from one of its streets to the opposite one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.polygon import orient

from ..network.problem import BoolArray, FloatArray

#: Spacing of the places along the outline from which a way is tried (metres).
STEP = 4.0
#: A way keeps this far from the corners of its block, measured along the outline (metres).
CLEAR = 15.0
#: Turn of the outline that makes a corner (degrees).
CORNER = 30.0
#: Least angle between a way and the streets at its ends (degrees).
LEAST_ANGLE = 65.0
#: A way that arrives this near to the end of a street opposite goes on into it (share of its
#: length), and a street that arrives may bend by this much (degrees).
SNAP, BEND = 0.14, 20.0
#: Half the length over which the direction of the outline is taken (metres).
TANGENT = 2.0
#: What lies this near to a street is on it (metres).
ON = 0.1


@dataclass(frozen=True, eq=False)
class Chords:
    """Ways across one block, k of them.

    Attributes
    ----------
    start, end
        Shape (k, 2). Their ends, metres.
    joined
        Shape (k, 2). Whether the way goes on into another street at its start, and its end.
    skew
        Shape (k,). Mean deviation from a right angle at the ends, degrees.
    arrival
        Shape (k,). Index of the joint that the way continues, -1 for none with a heading.
    """

    start: FloatArray
    end: FloatArray
    joined: BoolArray
    skew: FloatArray
    arrival: npt.NDArray[np.int64]

    def __len__(self) -> int:
        """Give the number of ways."""
        return len(self.start)

    def line(self, i: int) -> LineString:
        """Give way `i` as a line."""
        return LineString([self.start[i], self.end[i]])

    def take(self, which: BoolArray) -> Chords:
        """Keep some of the ways."""
        return Chords(
            self.start[which],
            self.end[which],
            self.joined[which],
            self.skew[which],
            self.arrival[which],
        )


@dataclass(frozen=True, eq=False)
class Joint:
    """A street that ends at the outline of blocks from outside.

    Attributes
    ----------
    xy
        Where it ends, metres.
    heading
        Unit vector in which it would go on, where it asks to be continued; else None.
    """

    xy: tuple[float, float]
    heading: tuple[float, float] | None = None


class Outline:
    """The outline of a block, and which places on it a way may start from or end at."""

    def __init__(self, polygon: Polygon, streets: shapely.Geometry) -> None:
        self.polygon = polygon
        self.ring = LineString(orient(polygon).exterior)
        self.length = float(self.ring.length)
        west, south, east, north = polygon.buffer(1.0).bounds
        self.streets = shapely.clip_by_rect(streets, west, south, east, north)
        self.holes = shapely.union_all([LineString(ring) for ring in polygon.interiors])
        self.across = shapely.difference(self.streets, shapely.buffer(self.holes, ON))
        plain = shapely.get_coordinates(self.ring.simplify(1.0))[:-1]
        ahead = np.roll(plain, -1, axis=0) - plain
        behind = plain - np.roll(plain, 1, axis=0)
        turn = np.abs(_angle(behind, ahead))
        self.corners = shapely.line_locate_point(
            self.ring, shapely.points(plain[turn > np.radians(CORNER)])
        )

    def points(self, at: FloatArray) -> FloatArray:
        """Positions at distances along the outline, which is closed."""
        here = shapely.line_interpolate_point(self.ring, np.mod(at, self.length))
        return np.asarray(shapely.get_coordinates(here))

    def along(self, xy: FloatArray) -> FloatArray:
        """Distances along the outline of the places nearest to `xy`."""
        return np.asarray(shapely.line_locate_point(self.ring, shapely.points(xy)))

    def tangents(self, at: FloatArray) -> FloatArray:
        """Give unit vectors along the outline, the block on their left."""
        way = self.points(at + TANGENT) - self.points(at - TANGENT)
        return np.asarray(way / np.maximum(np.hypot(*way.T), 1e-9)[:, None])

    def within(self, lines: npt.NDArray[np.object_]) -> BoolArray:
        """Whether lines stay in the block, save for holes with a street at their edge."""
        inside = shapely.covers(self.polygon.buffer(ON), lines)
        if self.holes.is_empty:
            return np.asarray(inside)
        over = shapely.covers(Polygon(self.ring).buffer(ON), lines)
        met, line = shapely.get_coordinates(
            shapely.intersection(lines, self.holes), return_index=True
        )
        off = shapely.distance(shapely.points(met), self.streets) >= ON
        blocked = np.zeros(len(lines), dtype=np.bool_)
        blocked[line[off]] = True
        return np.asarray(inside | (over & ~blocked))

    def open(self, at: FloatArray) -> BoolArray:
        """Whether a street may meet the outline there: on a street, clear of corners."""
        gap = np.abs(at[:, None] - self.corners[None, :])
        gap = np.minimum(gap, self.length - gap)
        clear = gap.min(axis=1) >= CLEAR if len(self.corners) else np.ones(len(at), np.bool_)
        on = shapely.distance(shapely.points(self.points(at)), self.streets) < ON
        return np.asarray(clear & on)


def chords(polygon: Polygon, streets: shapely.Geometry, joints: Sequence[Joint]) -> Chords:
    """Find the ways across a block.

    Parameters
    ----------
    polygon
        The block.
    streets
        All streets, and the parts of the site's edge that act as one.
    joints
        Where other streets end: a way that comes near to one goes on into it; one with a
        heading is continued in that direction.
    """
    outline = Outline(polygon, streets)
    near = joints_at(outline, joints)
    fixed = outline.along(np.array([joints[i].xy for i in near]).reshape(-1, 2))
    at = np.concatenate([np.arange(0.0, outline.length, STEP), fixed])
    joint = np.concatenate([np.full(len(at) - len(near), -1), near]).astype(np.int64)
    free = outline.open(at)
    at, joint = at[free], joint[free]
    tangent = outline.tangents(at)
    heading = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    headed = [k for k, i in enumerate(joint) if i >= 0 and joints[i].heading is not None]
    extra = np.array([joints[joint[k]].heading for k in headed], dtype=float).reshape(-1, 2)
    begin = np.concatenate([np.arange(len(at)), np.array(headed, dtype=np.int64)]).astype(np.int64)
    heading = np.concatenate([heading, extra])
    start = outline.points(at)[begin]
    end = _opposite(outline, start, heading)
    found = np.isfinite(end[:, 0])
    begin, start, end = begin[found], start[found], end[found]
    end, snapped = _snap(outline, start, end, at[joint >= 0])
    ways = _checked(outline, at[begin], joint[begin], start, end, snapped)
    return _headed(ways, joints)


def joints_at(outline: Outline, joints: Sequence[Joint]) -> list[int]:
    """Joints on the outline."""
    if not joints:
        return []
    gap = shapely.distance(shapely.points([j.xy for j in joints]), outline.ring)
    return [int(i) for i in np.flatnonzero(gap < 5 * ON)]


def _opposite(outline: Outline, start: FloatArray, heading: FloatArray) -> FloatArray:
    """Where rays into the block first meet its outline; NaN where they do not."""
    reach = outline.length / 2
    lines = shapely.linestrings(np.stack([start + heading, start + reach * heading], axis=1))
    hits, ray = shapely.get_coordinates(
        shapely.intersection(lines, outline.ring), return_index=True
    )
    gap = np.hypot(*(hits - start[ray]).T)
    end = np.full_like(start, np.nan)
    for k in np.argsort(-gap, kind="stable"):
        end[ray[k]] = hits[k]
    return end


def _snap(
    outline: Outline, start: FloatArray, end: FloatArray, fixed: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Move ends to joints that are near, and tell which were."""
    if not len(fixed) or not len(end):
        return end, np.zeros(len(end), dtype=np.bool_)
    gap = np.abs(outline.along(end)[:, None] - fixed[None, :])
    gap = np.minimum(gap, outline.length - gap)
    nearest = gap.argmin(axis=1)
    snapped = gap.min(axis=1) <= SNAP * np.hypot(*(end - start).T)
    return np.where(snapped[:, None], outline.points(fixed[nearest]), end), snapped


def _checked(
    outline: Outline,
    at: FloatArray,
    joint: npt.NDArray[np.int64],
    start: FloatArray,
    end: FloatArray,
    snapped: BoolArray,
) -> Chords:
    """Keep the ways that end at a street, and meet it well."""
    far = outline.along(end)
    way = end - start
    size = np.maximum(np.hypot(*way.T), 1e-9)
    way = way / size[:, None]
    sines = [np.abs(_cross(way, outline.tangents(a))) for a in (at, far)]
    least = np.sin(np.radians(LEAST_ANGLE))
    good = (sines[0] >= np.where(joint >= 0, 0.5, least)) & (sines[1] >= least)
    good &= outline.open(far)
    lines = shapely.linestrings(np.stack([start, end], axis=1))
    good &= outline.within(lines)
    # a street that ends blind within the block is no outline of it, but is not to be crossed
    short = np.minimum(2 * ON, size / 4)[:, None] * way
    inner = shapely.linestrings(np.stack([start + short, end - short], axis=1))
    good &= ~shapely.intersects(inner, outline.across)
    skew = 90 - np.degrees(np.arcsin(np.clip(np.stack(sines), 0, 1))).mean(axis=0)
    return Chords(start, end, np.stack([joint >= 0, snapped], axis=1), skew, joint.copy()).take(
        good
    )


def _headed(ways: Chords, joints: Sequence[Joint]) -> Chords:
    """Tell which ways continue a street that asks for it."""
    arrival = np.full(len(ways), -1, dtype=np.int64)
    for k in range(len(ways)):
        i = int(ways.arrival[k])
        heading = joints[i].heading if i >= 0 else None
        if heading is None:
            continue
        way = ways.end[k] - ways.start[k]
        turn = np.abs(_angle(way[None, :], np.array([heading])))[0]
        if turn <= np.radians(BEND):
            arrival[k] = i
    return Chords(ways.start, ways.end, ways.joined, ways.skew, arrival)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of vectors, row by row."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _angle(a: FloatArray, b: FloatArray) -> FloatArray:
    """Turn from each vector to the other, radians, counter-clockwise positive."""
    return np.arctan2(_cross(a, b), (a * b).sum(axis=1))
