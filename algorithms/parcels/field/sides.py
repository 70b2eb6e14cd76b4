"""Which side of a region a point belongs to, for the distance field."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import Polygon

from .outline import Bools, Complexes, Floats, Ints, Outline, outline, to_segments

#: Edges that turn by less between them are of one side (degrees).
TURN = 15.0
#: The outline is simplified by this first, so that jogs make no sides of their own (metres).
JOGS = 1.0
#: Points looked at in one go times edges.
AT_ONCE = 2_000_000


def nearest_sides(polygon: Polygon, points: Floats) -> tuple[Complexes, Floats]:
    """Direction of the nearest side of a region, and how clear it is which one that is.

    Edges that meet nearly straight are one side. Its direction runs on evenly from edge to edge,
    so that a drawn arc is an arc and not a polygon with a step at every vertex.

    Parameters
    ----------
    polygon
        The region, metres.
    points
        Shape (n, 2), metres.

    Returns
    -------
    tangent
        Direction of the nearest side at its nearest point, x + iy of length 1, shape (n,).
    clear
        1 on the boundary, 0 on the medial axis between two sides, unless they agree in direction
        (mod 90 degrees): then 1. Shape (n,).
    """
    simple = shapely.simplify(polygon, JOGS)
    if simple.is_empty or simple.geom_type != "Polygon":
        simple = polygon
    edges = outline(simple)
    order, first, at_start, at_end = _merge(edges)
    starts, ends = edges.start[order], edges.end[order]
    way = ends - starts
    angle = np.arctan2(way[:, 1], way[:, 0])
    found = []
    for part in np.array_split(points, max(1, len(points) * len(starts) // AT_ONCE + 1)):
        distance, t = to_segments(part[:, None], starts, ends)
        rows = np.arange(len(part))
        by_side = np.minimum.reduceat(distance, first, axis=1)
        side = by_side.argmin(axis=1)
        nearest = by_side[rows, side]
        tangent = _direction(distance, t, angle, at_start[order], at_end[order])
        by_side[rows, side] = np.inf
        second = by_side.argmin(axis=1)
        other = by_side[rows, second]
        alone = ~np.isfinite(other)
        other = np.where(alone, nearest, other)
        only = np.where(_of(first, len(starts)) == second[:, None], distance, np.inf)
        theirs = _direction(only, t, angle, at_start[order], at_end[order])
        gap = (other - nearest) / (other + nearest + 1e-9)
        agree = np.clip(2.0 * ((tangent * theirs.conj()) ** 4).real - 1.0, 0.0, 1.0)
        clear = np.where(alone, 1.0, np.maximum(gap, agree))
        found.append((tangent, clear))
    tangent, clear = (np.concatenate(column) for column in zip(*found))
    return tangent, clear


def _of(first: Ints, count: int) -> Ints:
    """Side of each edge, from the number of the first edge of each side."""
    side = np.zeros(count, np.int64)
    side[first[1:]] = 1
    return np.asarray(np.cumsum(side))


def _direction(
    distance: Floats, t: Floats, angle: Floats, at_start: Floats, at_end: Floats
) -> Complexes:
    """Direction of the nearest edge at the nearest point on it."""
    edge = distance.argmin(axis=1)
    t = t[np.arange(len(distance)), edge]
    # half the turn to the edge before and after, straight between
    turn = np.where(t < 0.5, at_start[edge], at_end[edge]) * (2 * t - 1)
    return np.asarray(np.exp(1j * (angle[edge] + turn)))


def _merge(edges: Outline) -> tuple[Ints, Ints, Floats, Floats]:
    """Edges in an order that keeps sides together, where sides begin, and half turns."""
    way = edges.end - edges.start
    angle = np.arctan2(way[:, 1], way[:, 0])
    turn = angle[edges.after] - angle
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    straight: Bools = np.abs(turn) < np.radians(TURN)
    at_end = np.where(straight, 0.5 * turn, 0.0)
    at_start = np.where(straight[edges.before], 0.5 * turn[edges.before], 0.0)
    begins = ~straight[edges.before]
    order, first = [], []
    for low, high in zip(edges.first[:-1], edges.first[1:]):
        breaks = np.flatnonzero(begins[low:high])
        shift = int(breaks[0]) if len(breaks) else 0
        order.append(low + (np.arange(high - low) + shift) % (high - low))
        first.append(low + (breaks - shift if len(breaks) else np.zeros(1, np.int64)))
    return np.concatenate(order), np.concatenate(first), at_start, at_end
