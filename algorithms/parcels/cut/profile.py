"""How deep a row is along its street, and what lies beyond the ends of the street."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..rules import ParcelRules
from .line import Floats
from .rear import ray_distances

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


def depths(start: Floats, way: Floats, ring: Floats) -> Floats:
    """Return how deep the row is at each ray, 0 where the ray does not begin in it."""
    a, b = ring[:-1], ring[1:]
    from_here = start + way * 0.6
    found = ray_distances(from_here, way, a, b, 1e-6)
    # even-odd rule: does the ray begin inside?
    edge = b - a
    here_x, here_y = from_here[:, :1], from_here[:, 1:]
    higher = ring[:, 1] > here_y
    above = higher[:, :-1] != higher[:, 1:]
    level = edge[:, 1] == 0.0
    lean = np.where(level, 0.0, edge[:, 0]) / np.where(level, 1.0, edge[:, 1])
    right = a[:, 0] + (here_y - a[:, 1]) * lean > here_x
    inside = (above & right).sum(axis=1) % 2 == 1
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
    full, density = depth, np.minimum(depth, DEEPEST * rules.depth)
    if (way != way[0]).any():
        bend = np.gradient(np.unwrap(np.arctan2(way[:, 1], way[:, 0])), place)
        fan = np.minimum(np.maximum(1 - bend * depth / 2, 0.3), 3.0)
        full, density = full * fan, density * fan
    step = (place[1:] - place[:-1]) / 2
    area = np.zeros(len(place))
    ((density[1:] + density[:-1]) * step).cumsum(out=area[1:])
    return Profile(place, depth, area, float(((full[1:] + full[:-1]) * step).sum()))


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
    usual = max(middle_of(profile.depth), 1.0)
    found = []
    for area, reach in parts:
        mean = area * share / usual
        # a triangle reaches twice as far as a rectangle of its area, which does not slant
        found.append(Overhang(area * share, 2 * min(mean, 1.2 * max(reach - mean, 0.0))))
    return found[0], found[1]


def middle_of(values: Floats) -> float:
    """Return the median, in less time than numpy takes for a few values."""
    many = np.sort(values)
    half = len(many) // 2
    return float(many[half] if len(many) % 2 else (many[half - 1] + many[half]) / 2)


def _area(ring: Floats) -> float:
    x, y = ring[:, 0] - ring[0, 0], ring[:, 1] - ring[0, 1]
    return float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2)


def _behind(ring: Floats, point: Floats, way: Floats) -> Floats:
    """Return the part of a ring behind a line through a point, square to a direction."""
    height = (ring - point) @ way
    below = height < 0
    ha, hb = height[:-1], height[1:]
    crosses = below[:-1] != below[1:]
    t = np.where(crosses, ha, 0.0) / np.where(crosses, ha - hb, 1.0)
    # each vertex, and where the edge after it crosses the line
    both = np.empty((len(ha), 2, 2))
    both[:, 0] = ring[:-1]
    both[:, 1] = ring[:-1] + (ring[1:] - ring[:-1]) * t[:, None]
    found = both[np.stack([below[:-1], crosses], axis=1)]
    return np.concatenate([found, found[:1]]) if len(found) > 2 else np.stack([point, point])


def turning(ring: Floats) -> npt.NDArray[np.bool_]:
    """Tell which vertices of a closed ring are corners, shape (n - 1,)."""
    on = ring[1:] - ring[:-1]
    back = np.concatenate([on[-1:], on[:-1]])
    cross = back[:, 0] * on[:, 1] - back[:, 1] * on[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, (back * on).sum(axis=1))) > math.radians(20))
