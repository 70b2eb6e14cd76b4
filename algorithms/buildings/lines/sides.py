"""Straight sides of pieces of ground, and where their middle is."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from ..types import Floats
from .draft import Draft, row
from .need import Need, azimuth_of

#: A curved edge is followed by straight lines that leave it by so much at most, metres.
CHORD = 2.0
#: Lines of a side are tried at this step from it, metres, up to twice the chord error.
AWAY = 1.0
#: A line with room on so much of a side need not be moved farther away.
ENOUGH = 0.8


def sides_of(ring: shapely.Geometry, tolerance: float = CHORD) -> Floats:
    """Give the straight sides of a ring, with the ground on their left.

    Parameters
    ----------
    ring
        A closed ring around ground.
    tolerance
        How far a side may be from the ring, metres.

    Returns
    -------
    numpy.ndarray
        Start and end, counter-clockwise, shape (n, 2, 2).
    """
    if ring.is_empty:
        return np.zeros((0, 2, 2))
    whole = orient(Polygon(ring))
    # narrow ground would lose its shape
    fine = min(tolerance, whole.area / (2 * whole.length))
    simple = orient(shapely.simplify(whole, fine))
    xy = shapely.get_coordinates(simple.exterior)
    # a ring is simplified between its first and its last point, so a straight side may be cut
    xy = _turning(xy[:-1])
    return np.stack([xy, np.roll(xy, -1, axis=0)], axis=1)


def _turning(xy: Floats, least_deg: float = 1.0) -> Floats:
    """Drop the corners of a ring at which it hardly turns, shape (n, 2)."""
    while len(xy) > 3:
        into, out = xy - np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0) - xy
        cross = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]
        turn = np.degrees(np.abs(np.arctan2(cross, (into * out).sum(axis=1))))
        least = int(np.argmin(turn))
        if turn[least] >= least_deg:
            break
        xy = np.delete(xy, least, axis=0)
    return xy


def outward_azimuth(side: Floats) -> float:
    """Give the azimuth away from the ground of a side, degrees, of `sides_of`."""
    along = side[1] - side[0]
    return azimuth_of(np.array([along[1], -along[0]]))


def beside(
    need: Need, side: Floats, facing: float, rank: int = 0, depth: float = 0.0
) -> list[Draft]:
    """Draw the line that follows a side from within, with façades parallel to it.

    Parameters
    ----------
    need
        The patch; buildings keep to its ground.
    side
        Start and end, metres, with the ground on the left; centres stand as near to it as the
        ground allows.
    facing
        Azimuth of the balconies, square to the side.
    rank
        Placement order.
    depth
        Least distance of centres from the side, metres.

    Returns
    -------
    list of Draft
        The pieces with room, none if there is none.
    """
    room = need.turned(facing)
    ends = room.local(side)
    inward = room.local((side + _left(side))[:1])[0, 1] - ends[0, 1]
    low, high = float(ends[:, 0].min()), float(ends[:, 0].max())
    best, most = [], 0.0
    for away in np.arange(depth, depth + 2 * CHORD + AWAY, AWAY):
        v = float(ends[:, 1].mean() + inward * away)
        spans = np.clip(room.stretches(v, need.sizes), low, high)
        spans = spans[spans[:, 1] - spans[:, 0] >= need.shortest - 1e-3]
        length = float((spans[:, 1] - spans[:, 0]).sum())
        if length > 1.1 * most:
            best, most = [row(room, v, span, rank) for span in spans], length
        if most > ENOUGH * (high - low):
            break
    return best


def _left(side: Floats) -> Floats:
    """Give the unit vector to the left of a side, shape (2,)."""
    along = (side[1] - side[0]) / np.hypot(*(side[1] - side[0]))
    return np.array([-along[1], along[0]])


def middle_of(polygon: Polygon) -> tuple[Floats, float]:
    """Give the point of a polygon that is farthest from its outer edge, and how far it is.

    Holes are not heeded: a pond is a good middle.

    Returns
    -------
    centre : numpy.ndarray
        Shape (2,).
    radius : float
        Metres, to about 1 %.
    """
    whole = Polygon(polygon.exterior)
    low, high = 0.0, float(np.sqrt(whole.area / np.pi)) * 1.01
    core = whole
    while high - low > 0.01 * high:
        middle = (low + high) / 2
        inner = whole.buffer(-middle)
        if inner.is_empty:
            high = middle
        else:
            low, core = middle, inner
    piece = max(shapely.get_parts(core), key=lambda part: part.area)
    return shapely.get_coordinates(piece.centroid)[0], low
