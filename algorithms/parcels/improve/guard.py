"""What must not become of regions as streets move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ..edges import EdgeKind
from ..roadmesh import StreetMesh

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
#: Streets meet at no smaller angle, unless they did before (degrees).
ANGLE = 60.0
#: Regions keep at least this share of their area.
AREA = 0.5
#: Streets bend by no more at a vertex, unless they did before (degrees).
BEND = 60.0


@dataclass(frozen=True)
class Guard:
    """What must stay true of the regions of a mesh.

    Attributes
    ----------
    vertex
        Vertices of all rings, side by side, shape (k,).
    ring
        Number of the ring of each, shape (k,).
    owner
        Index of the region of each ring, outer rings first, shape (rings,).
    corners
        Vertices at which two streets, or a street and the edge of the site, meet: the vertex on
        the one, the junction, the one on the other, and the index of the region between them;
        shape (c, 4).
    least
        Least angle at these, degrees, shape (c,).
    areas
        Least areas, square metres, shape (regions,).
    """

    vertex: Ints
    ring: Ints
    owner: Ints
    corners: Ints
    least: Floats
    areas: Floats

    def polygons(self, xy: Floats) -> npt.NDArray[Any]:
        """Outlines of the regions, shape (regions,)."""
        rings = shapely.linearrings(xy[self.vertex], indices=self.ring)
        count = len(self.areas)
        found = np.asarray(shapely.polygons(rings[:count]))
        for region in np.unique(self.owner[count:]):
            holes = rings[count:][self.owner[count:] == region]
            found[region] = shapely.Polygon(rings[region], list(holes))
        return found

    def broken(self, xy: Floats) -> Flags:
        """Tell which regions are no longer what they must be, shape (regions,)."""
        polygons = self.polygons(xy)
        bad = ~shapely.is_valid(polygons) | (self._signed(xy) < self.areas)
        sharp = angles(xy, self.corners) < self.least - 1e-6
        bad[self.corners[sharp, 3]] = True
        return np.asarray(bad)

    def broken_at(self, xy: Floats) -> Ints:
        """Vertices of the regions that are no longer what they must be."""
        bad = self.broken(xy)
        return np.asarray(np.unique(self.vertex[bad[self.owner[self.ring]]]), dtype=np.int64)

    def sharpest(self, xy: Floats, junctions: Sequence[int]) -> Floats:
        """Least angles at some vertices, degrees, shape as these."""
        own = angles(xy, self.corners)
        return np.array([own[self.corners[:, 1] == v].min(initial=180.0) for v in junctions])

    def _signed(self, xy: Floats) -> Floats:
        """Signed areas of the outer rings less their holes, shape (regions,), square metres."""
        first = np.r_[True, np.diff(self.ring) != 0]
        starts = np.flatnonzero(first)
        own = xy[self.vertex] - xy[self.vertex[starts]][self.ring]
        following = np.arange(1, len(own) + 1)
        following[np.r_[starts[1:], len(own)] - 1] = starts
        on = own[following]
        twice = np.add.reduceat(own[:, 0] * on[:, 1] - on[:, 0] * own[:, 1], starts)
        found = np.bincount(self.owner, weights=twice / 2, minlength=len(self.areas))
        return np.asarray(found, dtype=float)


def guard_of(mesh: StreetMesh, least_areas: Floats | None = None) -> Guard:
    """Take note of what must stay true of the regions of a mesh.

    Parameters
    ----------
    mesh
        The mesh, all of whose regions are valid.
    least_areas
        Of the regions in the order of their numbers, shape (regions,), square metres; None for
        half of what they have.
    """
    order = sorted(mesh.regions)
    rings = [(k, mesh.regions[r].rings[0]) for k, r in enumerate(order)]
    rings += [(k, ring) for k, r in enumerate(order) for ring in mesh.regions[r].rings[1:]]
    vertex = np.array([v for _, ring in rings for v in ring], dtype=np.int64)
    number = np.repeat(np.arange(len(rings)), [len(ring) for _, ring in rings])
    corners = np.array(_corners(mesh, order), dtype=np.int64).reshape(-1, 4)
    junction = mesh.degrees()[corners[:, 1]] > 2
    limit = np.where(junction, ANGLE, 180.0 - BEND)
    guard = Guard(
        vertex,
        number,
        np.array([k for k, _ in rings], dtype=np.int64),
        corners,
        np.minimum(limit, angles(mesh.xy, corners)),
        np.zeros(len(order)),
    )
    areas = AREA * guard._signed(mesh.xy) if least_areas is None else least_areas
    return Guard(vertex, number, guard.owner, corners, guard.least, areas)


def angles(xy: Floats, corners: Ints) -> Floats:
    """Angles at corners (see `Guard`), 0 to 180 degrees, shape (c,)."""
    a, v, b = corners[:, :3].T
    first, second = xy[a] - xy[v], xy[b] - xy[v]
    cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return np.asarray(np.degrees(np.arctan2(np.abs(cross), (first * second).sum(axis=1))))


def _corners(mesh: StreetMesh, order: list[int]) -> list[tuple[int, int, int, int]]:
    """Corners of the regions at which a street that may move is one of the two edges."""
    found = []
    for k, number in enumerate(order):
        for ring in mesh.regions[number].rings:
            for before, v, after in zip((ring[-1], *ring[:-1]), ring, (*ring[1:], ring[0])):
                edges = mesh.edge(before, v), mesh.edge(v, after)
                if any(e.kind == EdgeKind.STREET and not e.fixed for e in edges):
                    found.append((before, v, after, k))
    return found
