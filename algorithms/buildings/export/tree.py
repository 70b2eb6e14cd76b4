"""A tree as a plan in 3D shows it: a crown of two cones on a stem."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
#: Radius of the crown, its lowest and widest height and the top, metres.
RADIUS, FOOT, WAIST, TOP = 2.2, 2.0, 3.6, 8.0
#: Half the width of the stem, metres.
STEM = 0.18
#: Sides of the crown.
SIDES = 7
#: Trees differ in size by up to this share.
VARIETY = 0.18
_GOLDEN = 0.6180339887498949


def tree_scale(at: int) -> float:
    """Give the size of a tree as a multiple of the usual one, the same for the same number."""
    return 1.0 + VARIETY * (2.0 * ((at * _GOLDEN) % 1.0) - 1.0)


def tree_faces(at: int) -> tuple[Floats, Floats, float]:
    """Give the faces of a tree that stands at the origin.

    Parameters
    ----------
    at
        Its number, which decides its size.

    Returns
    -------
    stem : numpy.ndarray
        Rectangles, shape (4, 4, 3), metres, that look outwards.
    crown : numpy.ndarray
        Triangles, shape (2 * SIDES, 3, 3), metres, that look outwards.
    height : float
        Metres.
    """
    scale = tree_scale(at)
    corner = STEM * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    following = np.roll(corner, -1, axis=0)
    low, high = np.zeros((4, 1)), np.full((4, 1), FOOT)
    stem = np.stack(
        [
            np.hstack([corner, low]),
            np.hstack([following, low]),
            np.hstack([following, high]),
            np.hstack([corner, high]),
        ],
        axis=1,
    )
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    ring = np.column_stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), np.full(SIDES, WAIST)])
    after = np.roll(ring, -1, axis=0)
    top, foot = np.zeros((SIDES, 3)), np.zeros((SIDES, 3))
    top[:, 2], foot[:, 2] = TOP, FOOT
    crown = np.concatenate([np.stack([ring, after, top], 1), np.stack([after, ring, foot], 1)])
    return stem * scale, crown * scale, TOP * scale
