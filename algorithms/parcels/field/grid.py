"""The field on a raster, for quick look-ups along lines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from .outline import Complexes, Floats, Ints, NearestEdge, Outline, to_segments
from .triangulation import Triangulation

#: Values are given so many steps around a region: further out no line is ever followed.
MARGIN = 3.0


@dataclass(frozen=True)
class Grid:
    """Values at the nodes of a square raster that covers a region with a margin.

    Points are complex numbers x + iy.

    Attributes
    ----------
    origin, step
        First node and spacing, metres.
    shape
        Nodes in x and in y.
    cross
        (cos 4t + i sin 4t), not normalised: short near singularities; flat, complex.
    inside
        Distance to the boundary, negative outside, there no less than `MARGIN` steps; flat,
        metres.
    edge
        Number of the nearest edge of the outline, flat.
    slope
        Gradient of t as dt/dx + i dt/dy, flat, complex, radians per metre.
    """

    origin: complex
    step: float
    shape: tuple[int, int]
    cross: Complexes
    inside: Floats
    edge: Ints
    slope: Complexes

    def _place(self, points: Complexes) -> tuple[Ints, npt.NDArray[Any], npt.NDArray[Any]]:
        """Flat index of the lower left node, and the place in the cell, 0 to 1."""
        # plain ufuncs of real numbers: this is called four times a step of a line
        per = 1.0 / self.step
        x = (points.real - self.origin.real) * per
        y = (points.imag - self.origin.imag) * per
        x = np.minimum(np.maximum(x, 0.0), self.shape[0] - 1.001)
        y = np.minimum(np.maximum(y, 0.0), self.shape[1] - 1.001)
        i, j = x.astype(np.int64), y.astype(np.int64)
        return i * self.shape[1] + j, x - i, y - j

    def take(self, points: Complexes, *values: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
        """Bilinear values at points, for each of the flat arrays given."""
        at, x, y = self._place(points)
        found = []
        for value in values:
            four = self._four(value).take(at, axis=0)
            low, high = four[:, 0], four[:, 2]
            low = low + (four[:, 1] - low) * y
            high = high + (four[:, 3] - high) * y
            found.append(low + (high - low) * x)
        return found

    def _four(self, value: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values at the corners of the cell above each node, side by side, shape (n, 4)."""
        if id(value) not in self._cells:
            row = self.shape[1]
            corners = [value[offset:] for offset in (0, 1, row, row + 1)]
            # the last nodes are the lower left corner of no cell
            four = np.stack([corner[: len(corners[-1])] for corner in corners], axis=1)
            self._cells[id(value)] = value, four
        return self._cells[id(value)][1]

    @cached_property
    def _cells(self) -> dict[int, tuple[npt.NDArray[Any], npt.NDArray[Any]]]:
        """Arrays that were asked for, with their values cell by cell."""
        return {}

    def nearest_edge(self, points: Complexes) -> Ints:
        """Return the edge of the outline that is nearest to the nearest node."""
        at, x, y = self._place(points)
        return np.asarray(self.edge[at + self.shape[1] * (x > 0.5) + (y > 0.5)])


def make_grid(polygon: Polygon, mesh: Triangulation, z: Complexes, step: float) -> Grid:
    """Bring a field from triangles to a raster.

    Parameters
    ----------
    polygon
        The region, metres.
    mesh, z
        Its triangles and the field at their vertices, shape (n,).
    step
        Spacing of the nodes, metres.

    Returns
    -------
    grid
        Outside, nodes have the value of the nearest point of the boundary, so that lines near it
        do not mix what is on the other side of a slit.
    """
    x0, y0, x1, y1 = polygon.bounds
    origin = complex(x0 - 3 * step, y0 - 3 * step)
    shape = (int((x1 - x0) / step) + 7, int((y1 - y0) / step) + 7)
    x, y = np.meshgrid(
        origin.real + step * np.arange(shape[0]),
        origin.imag + step * np.arange(shape[1]),
        indexing="ij",
    )
    nodes = np.c_[x.ravel(), y.ravel()]
    shapely.prepare(polygon)
    within = shapely.contains_xy(polygon, nodes[:, 0], nodes[:, 1])
    nearest = NearestEdge(mesh.outline, 0.5 * step)
    distance, edge = np.empty(len(nodes)), np.empty(len(nodes), np.int64)
    distance[within], edge[within] = nearest(nodes[within])
    distance[~within], edge[~within] = nearest.within(nodes[~within], MARGIN * step)
    cross = _fill(mesh, z, nodes, origin, step, shape)
    outside = (~within & (distance < MARGIN * step)) | (within & (cross == 0))
    cross[~within] = 0.0
    cross[outside] = _at_boundary(mesh, z, nodes[outside])
    length = np.abs(cross)
    unit = (cross / np.maximum(length, 1e-9)).reshape(shape)
    # t changes by a quarter of the angle of z
    slopes = []
    for axis in (0, 1):
        count = shape[axis]
        turn = unit.take(range(1, count), axis=axis) * unit.take(range(count - 1), axis=axis).conj()
        change = np.angle(turn) / (4 * step)
        wide = np.concatenate(
            [change.take([0], axis=axis), change, change.take([-1], axis=axis)], axis=axis
        )
        here, on = wide.take(range(count), axis=axis), wide.take(range(1, count + 1), axis=axis)
        slopes.append(0.5 * (here + on))
    slope = (slopes[0] + 1j * slopes[1]).ravel()
    inside = np.where(within, distance, -distance)
    return Grid(origin, step, shape, cross, inside, edge, slope)


def _at_boundary(mesh: Triangulation, z: Complexes, points: Floats) -> Complexes:
    """Value at the nearest point of the boundary."""
    start, end = mesh.pieces.T
    ring = mesh.outline.ring[mesh.edge]
    first = np.r_[0, np.cumsum(np.bincount(ring))]
    border = Outline(mesh.points[start], mesh.points[end], ring, first)
    _, piece = NearestEdge(border, np.inf)(points)
    _, t = to_segments(points, border.start[piece], border.end[piece])
    return np.asarray(z[start[piece]] * (1 - t) + z[end[piece]] * t)


def _fill(
    mesh: Triangulation,
    z: Complexes,
    nodes: Floats,
    origin: complex,
    step: float,
    shape: tuple[int, int],
) -> Complexes:
    """Linear values at the nodes in each triangle; 0 where there is none."""
    cross = np.zeros(len(nodes), complex)
    corner = mesh.points[mesh.triangles]
    if not len(corner):
        return cross
    start = np.array([origin.real, origin.imag])
    low = np.ceil((corner.min(axis=1) - start) / step - 1e-9).astype(np.int64)
    high = np.floor((corner.max(axis=1) - start) / step + 1e-9).astype(np.int64)
    wide = np.maximum(high - low + 1, 0)
    count = wide.prod(axis=1)
    owner = np.repeat(np.arange(len(corner)), count)
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    column = rank // wide[owner, 1]
    at = (low[owner, 0] + column) * shape[1] + low[owner, 1] + rank - column * wide[owner, 1]
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    off = nodes[at] - corner[owner, 0]
    second = (off[:, 0] * b[owner, 1] - off[:, 1] * b[owner, 0]) / twice[owner]
    third = (a[owner, 0] * off[:, 1] - a[owner, 1] * off[:, 0]) / twice[owner]
    hit = (second > -1e-9) & (third > -1e-9) & (second + third < 1 + 1e-9)
    at, owner, second, third = at[hit], owner[hit], second[hit], third[hit]
    value = z[mesh.triangles[owner]]
    cross[at] = value[:, 0] * (1 - second - third) + value[:, 1] * second + value[:, 2] * third
    return cross
