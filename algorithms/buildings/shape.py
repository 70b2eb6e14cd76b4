"""Geometry of buildings from their placements: outlines, façades, entrances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from .types import RESIDENCE, BuildingType, Floats, Placements

Shapes = npt.NDArray[np.object_]


def facing_vectors(facing_deg: Floats) -> Floats:
    """Give unit vectors of azimuths.

    Parameters
    ----------
    facing_deg
        Degrees clockwise from grid north, shape (n,).

    Returns
    -------
    numpy.ndarray
        Shape (n, 2).
    """
    angle = np.radians(facing_deg)
    return np.column_stack([np.sin(angle), np.cos(angle)])


def sizes(types: Sequence[BuildingType], placed: Placements) -> Floats:
    """Give length, width and height of each building, metres, shape (n, 3)."""
    table = np.array([(t.length_m, t.width_m, t.height_m) for t in types]).reshape(-1, 3)
    return table[placed.type]


def residences(types: Sequence[BuildingType], placed: Placements) -> npt.NDArray[np.bool_]:
    """Tell which buildings are residences, shape (n,)."""
    return np.array([t.use == RESIDENCE for t in types], dtype=bool)[placed.type]


def frames(placed: Placements) -> tuple[Floats, Floats]:
    """Give unit vectors along the façade and out of the balcony side, each of shape (n, 2)."""
    out = facing_vectors(placed.facing)
    return np.column_stack([out[:, 1], -out[:, 0]]), out


def corners(types: Sequence[BuildingType], placed: Placements) -> Floats:
    """Give the four corners of each building, shape (n, 4, 2), counter-clockwise.

    The first two corners are those of the balcony façade.
    """
    size = sizes(types, placed)
    along, out = frames(placed)
    u = along * size[:, :1] / 2
    v = out * size[:, 1:2] / 2
    c = placed.xy
    return np.stack([c + v + u, c + v - u, c - v - u, c - v + u], axis=1)


def footprints(types: Sequence[BuildingType], placed: Placements) -> Shapes:
    """Give the outline of each building as a polygon, shape (n,)."""
    if not len(placed):
        return np.zeros(0, dtype=object)
    ring = corners(types, placed)
    made: Shapes = shapely.polygons(np.concatenate([ring, ring[:, :1]], axis=1))
    return made


def centre_lines(types: Sequence[BuildingType], placed: Placements) -> Shapes:
    """Give the line through the middle of each building, parallel to the façade, shape (n,)."""
    if not len(placed):
        return np.zeros(0, dtype=object)
    along, _ = frames(placed)
    half = along * sizes(types, placed)[:, :1] / 2
    made: Shapes = shapely.linestrings(np.stack([placed.xy - half, placed.xy + half], axis=1))
    return made


def entrances(types: Sequence[BuildingType], placed: Placements) -> tuple[Floats, Floats]:
    """Give the middle of each entrance side and the unit vector out of it (pg and vg of RZ).

    Returns
    -------
    points : numpy.ndarray
        Shape (n, 2), metres.
    outward : numpy.ndarray
        Shape (n, 2).
    """
    _, out = frames(placed)
    side = np.array([1.0 if t.entrance == "same" else -1.0 for t in types])[placed.type]
    outward = out * side[:, None]
    return placed.xy + outward * sizes(types, placed)[:, 1:2] / 2, outward
