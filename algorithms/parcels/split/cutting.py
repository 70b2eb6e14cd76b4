"""Putting a new street into the mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString

from ..edges import EdgeKind
from ..roadmesh import MeshEdge, StreetMesh

Floats = npt.NDArray[np.float64]
#: Ends of streets this near to where another arrives from across become one crossing with it:
#: UP's continuity is 4 m, but crossings a few metres apart are dangerous (metres).
TO_JUNCTION = 15.0
#: ... where the directions of both differ by less than this (degrees).
ALIGNED = 40.0
#: Ends this near to any other vertex become it (metres).
TO_VERTEX = 0.5
#: An end that moves takes this much of its street along, less and less (metres).
EASE = 120.0


def fit_ends(
    mesh: StreetMesh, region: int, line: LineString, junctions: tuple[Floats, Floats]
) -> LineString:
    """Draw the ends of a street to the streets that arrive from across, and on to the edge.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    line
        Centre line through the region, metres.
    junctions
        Places and directions of the streets that arrive, see `junctions_of`.
    """
    xy = shapely.get_coordinates(line).copy()
    for end, inner in ((0, 1), (-1, -2)):
        way = xy[inner] - xy[end]
        target = _across(xy[end], way / (np.hypot(*way) or 1.0), *junctions)
        if target is None:
            place, _, vertex = locate(mesh, region, xy[end])
            target = place if vertex is None else mesh.xy[vertex]
        xy = _drag(xy, end, target - xy[end])
    return LineString(xy)


def _across(xy: Floats, way: Floats, places: Floats, ways: Floats) -> Floats | None:
    """Find the nearest junction that a street goes on from, or None."""
    if not len(places):
        return None
    off = np.hypot(*(places - xy).T)
    off[ways @ way < np.cos(np.radians(ALIGNED))] = np.inf
    nearest = int(np.argmin(off))
    return places[nearest] if off[nearest] < TO_JUNCTION else None


def cut(
    mesh: StreetMesh, region: int, lines: Sequence[LineString], street: int, width: float
) -> list[int]:
    """Split a region along streets.

    Parameters
    ----------
    mesh, region
        The mesh, which changes, and the number of the region.
    lines
        Centre lines, their ends on the region's rings, metres; see `fit_ends`.
    street
        Number of the first street; the others have the next.
    width
        Metres.

    Returns
    -------
    list of int
        Numbers of the parts.
    """
    chains, edges = [], []
    for number, line in enumerate(lines):
        xy = shapely.get_coordinates(line)
        ends = []
        for end in (0, -1):
            place, (a, b), vertex = locate(mesh, region, xy[end])
            ends.append(mesh.insert(a, b, (place[0], place[1])) if vertex is None else vertex)
        chains.append([ends[0], *mesh.add_vertices(xy[1:-1]), ends[1]])
        edges.append(MeshEdge(EdgeKind.STREET, street + number, width))
    return mesh.split(region, chains, edges)


def locate(mesh: StreetMesh, region: int, xy: Floats) -> tuple[Floats, tuple[int, int], int | None]:
    """Find where on the edge of a region a point lies.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    xy
        The point, shape (2,), metres.

    Returns
    -------
    place
        Nearest place on the edges, shape (2,), metres.
    edge
        The edge that it is on.
    vertex
        The vertex within half a metre that it should be instead, or None.
    """
    halves = mesh.regions[region].halves
    start, stop = mesh.xy[halves[:, 0]], mesh.xy[halves[:, 1]]
    way = stop - start
    length = np.maximum((way * way).sum(axis=1), 1e-12)
    t = np.clip(((xy - start) * way).sum(axis=1) / length, 0.0, 1.0)
    foot = start + way * t[:, None]
    k = int(np.argmin(np.hypot(*(foot - xy).T)))
    near = np.hypot(*(start - foot[k]).T)
    vertex = int(halves[int(np.argmin(near)), 0]) if near.min() < TO_VERTEX else None
    return foot[k], (int(halves[k, 0]), int(halves[k, 1])), vertex


def _drag(xy: Floats, end: int, by: Floats) -> Floats:
    """Move one end of a line and ease its neighbourhood along."""
    if not np.hypot(*by) > 0:
        return xy
    step = np.r_[0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T))]
    away = step if end == 0 else step[-1] - step
    share = np.clip(1.0 - away / min(EASE, 0.5 * step[-1]), 0.0, 1.0)
    return np.asarray(xy + share[:, None] * by)
