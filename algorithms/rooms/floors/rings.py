"""Rings of a footprint as runs of walls along two axes at right angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from ...mesh.quadmesh import FloatArray, IntArray

NOISE = 0.03
"""Bends flatter than this many modules are no corners."""
SKEW = np.radians(10.0)
"""Walls may deviate this much from the axes and still count as rectangular."""
SHORT = 0.15
"""Walls shorter than this many modules may run in any direction."""


@dataclass(frozen=True, eq=False)
class WallRing:
    """A ring of r walls, alternately along the first and along the second axis.

    Attributes
    ----------
    line
        The ring as it is, points (k, 2), the last one the first, metres.
    corners
        Shape (r, 2). Where wall i begins; wall i ends where wall i + 1 begins.
    direction
        Shape (r,). Quarter turns of each wall from the first axis.
    offset
        Shape (r,). Where a wall lies across its own direction, metres.
    """

    line: FloatArray
    corners: FloatArray
    direction: IntArray
    offset: FloatArray


def outlines(polygon: Polygon) -> list[FloatArray]:
    """Return the closed rings of a polygon with its ground on their left, the outer one first."""
    turned = orient(polygon, 1.0)
    return [
        np.asarray(ring.coords, dtype=float)[:, :2] for ring in (turned.exterior, *turned.interiors)
    ]


def wall_axis(polygon: Polygon) -> float:
    """Return the direction along which or square to which most walls run, radians."""
    total = 0j
    for ring in outlines(polygon):
        step = np.diff(ring, axis=0)
        length = np.hypot(*step.T)
        total += complex((length * np.exp(4j * np.arctan2(step[:, 1], step[:, 0]))).sum())
    return float(np.angle(total)) / 4


def wall_rings(polygon: Polygon, module: float) -> list[WallRing] | None:
    """Split the rings of a footprint into walls.

    Parameters
    ----------
    polygon
        The footprint, metres.
    module
        Side of a square, metres.

    Returns
    -------
    list of WallRing or None
        None where some wall runs askew.
    """
    axis = wall_axis(polygon)
    plain = shapely.simplify(polygon, NOISE * module)
    if plain.geom_type != "Polygon" or len(plain.interiors) != len(polygon.interiors):
        return None
    full = outlines(polygon)
    found = []
    for ring, bare in zip(full, outlines(plain)):
        walls = _walls(ring, bare, axis, module)
        if walls is None:
            return None
        found.append(walls)
    return found


def _walls(ring: FloatArray, bare: FloatArray, axis: float, module: float) -> WallRing | None:
    """Merge the sides of one ring to walls."""
    step = np.diff(bare, axis=0)
    length = np.hypot(*step.T)
    turn = (np.arctan2(step[:, 1], step[:, 0]) - axis) / (np.pi / 2)
    nearest = np.rint(turn)
    if (np.abs(turn - nearest)[length > SHORT * module] * np.pi / 2 > SKEW).any():
        return None
    side = nearest.astype(np.int64) % 4
    begins = np.flatnonzero(side != np.roll(side, 1))
    direction = side[begins]
    # a wall that turns back on itself, or two in a row along one axis, fit no grid
    if len(begins) < 4 or ((direction - np.roll(direction, 1)) % 2 == 0).any():
        return None
    turned = bare @ np.array([[np.cos(axis), -np.sin(axis)], [np.sin(axis), np.cos(axis)]])
    middle = (turned[1:] + turned[:-1]) / 2
    count = len(side)
    which = (np.cumsum(np.isin(np.arange(count), begins)) - 1) % len(begins)
    across = np.where(direction[which] % 2 == 0, middle[:, 1], middle[:, 0])
    offset = np.bincount(which, across * length) / np.bincount(which, length)
    return WallRing(ring, bare[begins], direction, offset)
