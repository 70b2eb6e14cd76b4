"""A patch's own axes, and rotated rectangles filled into rows of cells (RZ Fig. 5a)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from ..types import Floats

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Frame:
    """Axes turned so that most buildings or edges of a patch run along them.

    Attributes
    ----------
    x, y
        Origin, metres.
    angle
        From the x axis of the grid to that of the frame, radians counter-clockwise.
    """

    x: float
    y: float
    angle: float

    def inward(self, xy: Floats) -> Floats:
        """Turn points of the grid into points of the frame, shape (..., 2), metres."""
        return self.turned(np.asarray(xy, dtype=float) - (self.x, self.y))

    def outward(self, xy: Floats) -> Floats:
        """Turn points of the frame into points of the grid, shape (..., 2), metres."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        x, y = np.asarray(xy, dtype=float)[..., 0], np.asarray(xy, dtype=float)[..., 1]
        return np.stack([c * x - s * y + self.x, s * x + c * y + self.y], axis=-1)

    def turned(self, vectors: Floats) -> Floats:
        """Turn vectors of the grid into vectors of the frame, shape (..., 2)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        x, y = vectors[..., 0], vectors[..., 1]
        return np.stack([c * x + s * y, -s * x + c * y], axis=-1)

    def geometry(self, shape: BaseGeometry) -> BaseGeometry:
        """Turn a geometry of the grid into one of the frame."""
        moved: BaseGeometry = shapely.transform(shape, self.inward)
        return moved


def edge_frame(polygon: Polygon) -> Frame:
    """Give the frame along the longer side of the smallest rectangle around a polygon."""
    ring = np.asarray(polygon.minimum_rotated_rectangle.exterior.coords)
    sides = np.diff(ring[:3], axis=0)
    along = sides[int(np.argmax(np.hypot(sides[:, 0], sides[:, 1])))]
    return Frame(float(ring[0, 0]), float(ring[0, 1]), float(np.arctan2(along[1], along[0])))


def facing_frame(polygon: Polygon, facing_deg: Floats) -> Frame:
    """Give the frame in which most buildings stand square, by their azimuths, shape (n,)."""
    if not len(facing_deg):
        return edge_frame(polygon)
    turn = np.round(np.asarray(facing_deg, dtype=float) % 90.0, 1) % 90.0
    kinds, counts = np.unique(turn, return_counts=True)
    most = kinds[int(np.argmax(counts))]
    exact = np.asarray(facing_deg, dtype=float)[turn == most][0] % 90.0
    x, y = polygon.bounds[:2]
    return Frame(float(x), float(y), -float(np.radians(exact)))


def covered(
    xs: Floats, ys: Floats, centres: Floats, along: Floats, half: Floats, grow: float = 0.0
) -> Mask:
    """Tell which points of a grid lie strictly inside rotated rectangles.

    As in RZ Fig. 5a, each row of the grid is cut with each rectangle into an interval; the
    intervals are added up along the rows.

    Parameters
    ----------
    xs, ys
        Coordinates of the columns and rows, ascending, metres, shapes (c,) and (r,).
    centres
        Centres of the rectangles, shape (n, 2).
    along
        Unit vectors along the rectangles, shape (n, 2).
    half
        Half of their length and width, metres, shape (n, 2).
    grow
        Added on all four sides, metres.

    Returns
    -------
    numpy.ndarray
        Shape (r, c).
    """
    rows, columns = len(ys), len(xs)
    if not len(centres) or not rows or not columns:
        return np.zeros((rows, columns), dtype=bool)
    size = half + grow
    tall = np.abs(along[:, 1]) * size[:, 0] + np.abs(along[:, 0]) * size[:, 1]
    which, row = np.nonzero(np.abs(ys[None, :] - centres[:, 1:2]) < tall[:, None])
    dy = ys[row] - centres[which, 1]
    low, high = np.full(len(row), -np.inf), np.full(len(row), np.inf)
    across = np.column_stack([-along[:, 1], along[:, 0]])
    for axis, reach in ((along, size[:, 0]), (across, size[:, 1])):
        p, shift = axis[which, 0], axis[which, 1] * dy
        flat = np.abs(p) < 1e-9
        inside = np.abs(shift) < reach[which]
        steep = np.where(flat, 1.0, p)
        middle, width = -shift / steep, np.abs(reach[which] / steep)
        low = np.maximum(low, np.where(flat, np.where(inside, -np.inf, np.inf), middle - width))
        high = np.minimum(high, np.where(flat, np.where(inside, np.inf, -np.inf), middle + width))
    first = np.searchsorted(xs, low + centres[which, 0], side="right")
    last = np.searchsorted(xs, high + centres[which, 0], side="left")
    some = last > first
    base = row[some] * (columns + 1)
    cells = rows * (columns + 1)
    change = np.bincount(base + first[some], minlength=cells)
    change -= np.bincount(base + last[some], minlength=cells)
    depth = np.cumsum(change.reshape(rows, columns + 1)[:, :columns], axis=1)
    return np.asarray(depth > 0)
