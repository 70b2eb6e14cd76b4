"""How deep a row is along its street, and what lies beyond the ends of the street."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..rules import ParcelRules
from .outline import Floats
from .rear import along, ray_distances

#: Normals are taken from a chord that goes this far to both sides (metres).
CHORD = 14.0
#: Deeper land counts as that many depths, so that deep parcels stay wide enough.
DEEPEST = 1.5


@dataclass
class Profile:
    """How deep a row is along its street.

    Attributes
    ----------
    place
        Distance along the front, shape (n,), metres.
    depth
        Depth of the row there, shape (n,), metres.
    area
        Area of the row up to there, shape (n,), square metres; deep land counts less.
    whole
        Area that the rays sweep, square metres.
    """

    place: Floats
    depth: Floats
    area: Floats
    whole: float


@dataclass
class Overhang:
    """Land beyond one end of the street that belongs to the row.

    Attributes
    ----------
    area
        Square metres.
    lack
        By how much more its far side is longer than its mean, metres: how much it slants.
    """

    area: float = 0.0
    lack: float = 0.0


def normals(front: Floats, length: float, place: Floats) -> Floats:
    """Return the directions into the block, square to the street, shape (n, 2).

    Square to a chord: an edge of a polygonal arc may lie 3 degrees off.
    """
    half = np.clip(np.minimum(place, length - place), 1.0, CHORD)
    way = along(front, np.clip(place + half, 0, length)) - along(
        front, np.clip(place - half, 0, length)
    )
    way /= np.maximum(np.hypot(*way.T), 1e-9)[:, None]
    return np.stack([-way[:, 1], way[:, 0]], axis=-1)


def depths(start: Floats, way: Floats, ring: Floats) -> Floats:
    """Return how deep the row is at each ray, 0 where the ray does not begin in it."""
    a, b = ring[:-1], ring[1:]
    from_here = start + way * 0.6
    found = ray_distances(from_here, way, a, b, 1e-6)
    # even-odd rule: does the ray begin inside?
    edge = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        x = a[:, 0] + (from_here[:, None, 1] - a[:, 1]) / edge[:, 1] * edge[:, 0]
    above = (a[:, 1] > from_here[:, None, 1]) != (b[:, 1] > from_here[:, None, 1])
    inside = (above & (x > from_here[:, None, 0])).sum(axis=1) % 2 == 1
    return np.asarray(np.where(inside & np.isfinite(found), found + 0.6, 0.0))


def profile_of(place: Floats, way: Floats, depth: Floats, rules: ParcelRules) -> Profile:
    """Return the profile of a row.

    Parameters
    ----------
    place, way, depth
        Distances along the front, shape (n,), directions there, shape (n, 2), and depths, (n,).
    rules
        What is asked of parcels.
    """
    bend = np.gradient(np.unwrap(np.arctan2(way[:, 1], way[:, 0])), place)
    fan = np.clip(1 - bend * depth / 2, 0.3, 3)
    density = np.minimum(depth, DEEPEST * rules.depth) * fan
    steps = (density[1:] + density[:-1]) / 2 * np.diff(place)
    full = depth * fan
    whole = float(((full[1:] + full[:-1]) / 2 * np.diff(place)).sum())
    return Profile(place, depth, np.r_[0.0, np.cumsum(steps)], whole)


def overhangs(
    ring: Floats, start: Floats, way: Floats, profile: Profile
) -> tuple[Overhang, Overhang]:
    """Return the land beyond the first and the last ray.

    Parameters
    ----------
    ring
        Outline of the row, closed, shape (m, 2).
    start, way
        Starts and directions of the rays, shape (n, 2).
    profile
        The row.
    """
    missing = max(0.0, abs(_area(ring)) - profile.whole)
    parts = []
    for k, sign in ((0, 1.0), (-1, -1.0)):
        along_ = sign * np.array([way[k, 1], -way[k, 0]])
        behind = _behind(ring, start[k], along_)
        parts.append((abs(_area(behind)), -float(((behind - start[k]) @ along_).min())))
    share = min(1.0, missing / max(parts[0][0] + parts[1][0], 1e-9))
    usual = max(float(np.median(profile.depth)), 1.0)
    found = []
    for area, reach in parts:
        mean = area * share / usual
        # a triangle reaches twice as far as a rectangle of its area, which does not slant
        found.append(Overhang(area * share, 2 * min(mean, 1.2 * max(reach - mean, 0.0))))
    return found[0], found[1]


def _area(ring: Floats) -> float:
    x, y = ring[:, 0] - ring[0, 0], ring[:, 1] - ring[0, 1]
    return float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2)


def _behind(ring: Floats, point: Floats, way: Floats) -> Floats:
    """Return the part of a ring behind a line through a point, square to a direction."""
    height = (ring - point) @ way
    a, b, ha, hb = ring[:-1], ring[1:], height[:-1], height[1:]
    crosses = (ha < 0) != (hb < 0)
    t = np.where(crosses, ha / np.where(crosses, ha - hb, 1.0), 0.0)
    found = []
    for k in range(len(a)):
        if ha[k] < 0:
            found.append(a[k])
        if crosses[k]:
            found.append(a[k] + (b[k] - a[k]) * t[k])
    return np.vstack([*found, found[0]]) if len(found) > 2 else np.vstack([point, point])


def turning(ring: Floats) -> npt.NDArray[np.bool_]:
    """Tell which vertices of a closed ring are corners, shape (n - 1,)."""
    on = np.diff(ring, axis=0)
    back = np.roll(on, 1, axis=0)
    cross = back[:, 0] * on[:, 1] - back[:, 1] * on[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, (back * on).sum(axis=1))) > math.radians(20))
