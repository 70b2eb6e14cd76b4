"""The edges of a polygon as arrays, and what is nearest to a point."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Complexes = npt.NDArray[np.complex128]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Outline:
    """The edges of the rings of a polygon, the exterior first, in their order.

    Attributes
    ----------
    start, end
        Their end points, shape (e, 2), metres.
    ring
        Which ring each is of, 0 for the exterior, shape (e,).
    first
        Number of the first edge of each ring, and the number of edges, shape (rings + 1,).
    """

    start: Floats
    end: Floats
    ring: Ints
    first: Ints

    @property
    def length(self) -> Floats:
        """Lengths of the edges, shape (e,), metres."""
        return np.asarray(np.hypot(*(self.end - self.start).T))

    @property
    def before(self) -> Ints:
        """Number of the edge before each on its ring, shape (e,)."""
        before = np.arange(len(self.start)) - 1
        before[self.first[:-1]] = self.first[1:] - 1
        return before

    @property
    def after(self) -> Ints:
        """Number of the edge after each on its ring, shape (e,)."""
        after = np.arange(len(self.start)) + 1
        after[self.first[1:] - 1] = self.first[:-1]
        return after


def on_edges(edges: Outline, edge: Ints, t: Floats) -> Floats:
    """Points on edges at t, 0 to 1; exactly the vertices at 0 and 1; shape (..., 2), metres."""
    start, end = edges.start[edge], edges.end[edge]
    return np.where(t[..., None] == 1.0, end, start + t[..., None] * (end - start))


def outline(polygon: Polygon) -> Outline:
    """Edges of a polygon.

    Parameters
    ----------
    polygon
        Not empty; holes are taken. Metres.

    Examples
    --------
    >>> outline(shapely.box(0, 0, 2, 1)).length.tolist()
    [1.0, 2.0, 1.0, 2.0]
    """
    rings = shapely.get_rings(polygon)
    xy, owner = shapely.get_coordinates(rings, return_index=True)
    here = np.flatnonzero(owner[1:] == owner[:-1])
    counts = np.bincount(owner[here], minlength=len(rings))
    return Outline(xy[here], xy[here + 1], owner[here], np.r_[0, np.cumsum(counts)])


def pieces_of_edges(length: Floats, size: float) -> tuple[Ints, Floats]:
    """Cut edges into equal pieces no longer than a size.

    Parameters
    ----------
    length
        Of the edges, shape (e,), metres.
    size
        Greatest length of a piece, metres.

    Returns
    -------
    edge
        Which edge each piece is of, shape (n,).
    t
        Where on it the piece begins, 0 to 1, shape (n,).
    """
    count = np.maximum(np.ceil(length / size - 1e-9), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(length)), count)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    return edge, step / count[edge]


def to_segments(points: Floats, start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Distance of points to segments, one each (arrays that broadcast, (..., 2)).

    Returns
    -------
    distance
        Metres.
    t
        Where the nearest point is on the segment, 0 to 1.
    """
    way = end - start
    t = ((points - start) * way).sum(-1) / np.maximum((way * way).sum(-1), 1e-18)
    t = np.clip(t, 0.0, 1.0)
    off = points - start - t[..., None] * way
    return np.sqrt((off * off).sum(-1)), t


class NearestEdge:
    """Finds the nearest edge of an outline for many points at once.

    Parameters
    ----------
    edges
        The outline.
    spacing
        Of the samples on it that are looked at first, metres. Distances are exact to the edge
        found; where two are nearly as near, to `spacing**2 / 8` over the distance, either is
        found.
    """

    def __init__(self, edges: Outline, spacing: float) -> None:
        self.edges = edges
        self.spacing = spacing
        owner, t = pieces_of_edges(edges.length, spacing)
        self.owner = owner
        way = edges.end - edges.start
        self.tree = cKDTree(edges.start[owner] + t[:, None] * way[owner])
        self.before, self.after = edges.before, edges.after

    def __call__(self, points: Floats) -> tuple[Floats, Ints]:
        """Return the distance (metres) and the number of the nearest edge, shape (n,) each."""
        if not len(points):
            return np.zeros(0), np.zeros(0, np.int64)
        return self._exact(points, self.tree.query(points)[1])

    def within(self, points: Floats, limit: float) -> tuple[Floats, Ints]:
        """Return the same, in less time: `limit` and edge 0 for points further off than it.

        Parameters
        ----------
        points
            Shape (n, 2), metres.
        limit
            Metres; points a little further off may get their distance all the same.
        """
        distance, edge = np.full(len(points), limit), np.zeros(len(points), np.int64)
        if len(points):
            # the nearest sample is no further from the nearest place than half their spacing
            far = 1.001 * math.hypot(limit, 0.5 * self.spacing)
            sample = self.tree.query(points, distance_upper_bound=far)[1]
            near = np.flatnonzero(sample < len(self.owner))
            distance[near], edge[near] = self._exact(points[near], sample[near])
        return distance, edge

    def _exact(self, points: Floats, sample: Ints) -> tuple[Floats, Ints]:
        """Distance to the nearest of the edges at the nearest sample, and its number."""
        edge = self.owner[sample]
        around = np.stack([edge, self.before[edge], self.after[edge]], axis=1)
        distance, _ = to_segments(points[:, None], self.edges.start[around], self.edges.end[around])
        which = distance.argmin(axis=1)
        rows = np.arange(len(points))
        return distance[rows, which], around[rows, which]
