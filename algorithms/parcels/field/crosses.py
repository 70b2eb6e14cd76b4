"""Cross fields over a region: smooth, by distance, or led by drawn lines (UP section 5)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from ...errors import InputError
from .grid import Grid, make_grid
from .outline import Bools, Complexes, Floats, Ints
from .sides import nearest_sides
from .solve import smoothest, stiffness
from .triangulation import Triangulation, triangulate

#: smooth: turns as little as possible between the edges of the region; distance: follows the
#: nearest side; guided: smooth, and along drawn lines.
FieldKind = Literal["smooth", "distance", "guided"]
#: Where the directions at a corner differ by more (mod 90 degrees), the field is free there.
FREE = math.radians(20.0)
#: Share by which turning along the nearest side costs less than turning away from it.
DROP = 0.8
#: Singularities of opposite sign that are nearer than this many sizes cancel each other.
CANCEL = 1.6


@dataclass(frozen=True)
class CrossField:
    """Two directions at right angles at every point of a region.

    Attributes
    ----------
    polygon
        The region.
    kind
        How the field was made.
    mesh
        Its triangles.
    cross
        cos 4t + i sin 4t for the direction t, at the vertices, shape (n,), of length 1.
    singularities
        Where no direction is defined, shape (k, 2), metres.
    index
        How often the crosses turn around each of them, in quarters of a turn: mostly 1 or -1,
        shape (k,). Their sum and the turns along the boundary agree (Poincaré-Hopf).
    grid
        The same on a raster.
    """

    polygon: Polygon
    kind: FieldKind
    mesh: Triangulation
    cross: Complexes
    singularities: Floats
    index: Ints
    grid: Grid

    def direction(self, points: Floats) -> Floats:
        """Direction at points, shape (n, 2): radians, -45 to 45 degrees; the other at 90."""
        (z,) = self.grid.take(points[:, 0] + 1j * points[:, 1], self.grid.cross)
        return np.asarray(np.angle(z) / 4)

    def divergence(self, points: Floats, along: Floats) -> Floats:
        """Divergence of lines of the field that pass points.

        Parameters
        ----------
        points
            Shape (n, 2), metres.
        along
            Their directions, shape (n, 2), length 1.

        Returns
        -------
        divergence
            Shape (n,), 1/metre: by how much neighbouring lines part, n . grad t.
        """
        (slope,) = self.grid.take(points[:, 0] + 1j * points[:, 1], self.grid.slope)
        return np.asarray(along[:, 0] * slope.imag - along[:, 1] * slope.real)

    def distance(self, points: Floats) -> Floats:
        """Distance of points, shape (n, 2), to the boundary; metres, negative outside."""
        (inside,) = self.grid.take(points[:, 0] + 1j * points[:, 1], self.grid.inside)
        return np.asarray(inside.real)


def default_size(area: float) -> float:
    """Length of the edges of triangles that suits a region, metres.

    1/20 of its width, 5 to 16 m; regions of square kilometres need no more than 1/100.

    Parameters
    ----------
    area
        Of the region, square metres.
    """
    wide = math.sqrt(max(area, 0.0))
    return float(np.clip(wide / 20.0, 5.0, max(16.0, wide / 100.0)))


def cross_field(
    polygon: Polygon,
    kind: FieldKind = "smooth",
    *,
    size: float | None = None,
    guides: Sequence[BaseGeometry] = (),
    pull: float = 4.0,
    reach: float = 40.0,
    scale: float = 37.5,
) -> CrossField:
    """Make a cross field that is aligned with the boundary of a region.

    `smooth` turns as evenly as it can between the edges. `distance` takes the place of UP's
    D-field, whose construction is in a supplement that was not at hand; this one is our own. Its
    crosses are drawn to the nearest side (edges that meet nearly straight are one), least where
    two sides are equally near, and it may turn along sides but hardly away from them, which keeps
    streets parallel to a side at a constant distance from each other. `guided` is `smooth` with
    crosses drawn to the direction of lines, the less the further off.

    Parameters
    ----------
    polygon
        The region, valid; metres.
    kind
        See `FieldKind`.
    size
        Length of the edges of triangles, metres; None: `default_size`.
    guides
        Lines that the field should follow, metres. Used by every kind, needed for `guided`.
    pull
        How strongly lines and sides draw, against smoothness; greater than 0.
    reach
        The pull of a line falls to a third at this distance, metres.
    scale
        Distance over which a side makes itself felt at `pull` 4 (half a block and half a
        street), metres.

    Returns
    -------
    field
        With its singularities.

    Raises
    ------
    InputError
        If the region has no area, or guide lines are missing.
    """
    if polygon.is_empty or not polygon.area > 0:
        raise InputError("A region has no area.", "Remove it, or draw it anew.")
    if kind == "guided" and not any(line.length > 0 for line in guides):
        raise InputError(
            "A field led by guide lines was asked for, and there are none.",
            "Draw at least one line, or choose another kind of field.",
        )
    size = default_size(polygon.area) if size is None else size
    mesh = triangulate(polygon, size)
    fixed, value = _boundary_values(mesh)
    # where vertices are drawn to, and how strongly
    weight, wish = np.zeros(len(mesh.points)), np.ones(len(mesh.points), complex)
    if kind == "distance":
        tangent, clear = nearest_sides(polygon, mesh.points)
        # the mean of lines, not of arrows
        mean = np.exp(0.5j * np.angle((tangent[mesh.triangles] ** 2).sum(axis=1)))
        drop = DROP * clear[mesh.triangles].min(axis=1)
        matrix, mass = stiffness(mesh, np.c_[mean.real, mean.imag], drop)
        weight, wish = pull / scale**2 * clear * mass, tangent**4
    else:
        matrix, mass = stiffness(mesh)
    if guides:
        along, off = _along_lines(guides, mesh.points, 0.25 * size)
        more = 16 * pull / scale**2 * np.exp(-((off / reach) ** 2)) * mass
        both = weight * wish + more * along
        weight = weight + more
        # two that contradict each other draw less
        length = np.abs(both)
        wish = np.where(length > 1e-12, both / np.maximum(length, 1e-12), 1.0)
        weight = np.minimum(weight, length)
    cross = smoothest(matrix, fixed, value, weight, wish)
    grid = make_grid(polygon, mesh, cross, 0.5 * size)
    return CrossField(polygon, kind, mesh, cross, *_singularities(mesh, cross), grid)


def _boundary_values(mesh: Triangulation) -> tuple[Bools, Complexes]:
    """Which vertices on the boundary are fixed, and to which cross."""
    way = mesh.points[mesh.pieces[:, 1]] - mesh.points[mesh.pieces[:, 0]]
    length = np.hypot(*way.T)
    # short pieces must not turn the field for a jog; long ones count no more than their size
    z = np.minimum(length, mesh.size) * np.exp(4j * np.arctan2(way[:, 1], way[:, 0]))
    total = np.zeros(len(mesh.points), complex)
    weight = np.zeros(len(mesh.points))
    for end in (0, 1):
        np.add.at(total, mesh.pieces[:, end], z)
        np.add.at(weight, mesh.pieces[:, end], np.minimum(length, mesh.size))
    # two directions that differ by d have a mean of length cos(2 d)
    fixed = (weight > 0) & (np.abs(total) >= math.cos(2 * FREE) * weight)
    return fixed, np.where(fixed, total / np.maximum(np.abs(total), 1e-12), 0)


def _along_lines(
    lines: Sequence[BaseGeometry], points: Floats, spacing: float
) -> tuple[Complexes, Floats]:
    """Cross of the nearest line at points, and the distance to it."""
    parts = shapely.get_parts(np.asarray(lines, dtype=object))
    dense = shapely.segmentize(parts[shapely.length(parts) > 0], spacing)
    xy, owner = shapely.get_coordinates(dense, return_index=True)
    here = np.flatnonzero(owner[1:] == owner[:-1])
    way = xy[here + 1] - xy[here]
    distance, nearest = cKDTree(0.5 * (xy[here] + xy[here + 1])).query(points)
    return np.exp(4j * np.arctan2(way[nearest, 1], way[nearest, 0])), distance


def _singularities(mesh: Triangulation, cross: Complexes) -> tuple[Floats, Ints]:
    """Triangles around which the crosses turn, and by how many quarters."""
    at = cross[mesh.triangles]
    turn = np.angle(np.roll(at, -1, axis=1) * at.conj()).sum(axis=1) / (2 * np.pi)
    index = np.rint(turn).astype(np.int64)
    found = np.flatnonzero(index)
    place, index = mesh.points[mesh.triangles[found]].mean(axis=1), index[found]
    if len(found) < 2:
        return place, index
    # pairs of opposite sign are what a coarse triangle makes of a tight bend
    pairs = cKDTree(place).query_pairs(CANCEL * mesh.size, output_type="ndarray")
    far = np.hypot(*(place[pairs[:, 0]] - place[pairs[:, 1]]).T)
    left = index.copy()
    for a, b in pairs[np.argsort(far, kind="stable")]:
        if left[a] * left[b] < 0:
            size = min(abs(left[a]), abs(left[b]))
            left[a] -= size * np.sign(left[a])
            left[b] -= size * np.sign(left[b])
    return place[left != 0], left[left != 0]
