"""Putting a new street into the mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString

from ..edges import EdgeKind
from ..roadmesh import MeshEdge, StreetMesh

Floats = npt.NDArray[np.float64]
#: Ends of streets this near to a junction become part of it (metres; UP's continuity).
TO_JUNCTION = 4.0
#: Ends this near to any other vertex become it (metres).
TO_VERTEX = 0.5
#: An end that moves takes this much of its street along, less and less (metres).
EASE = 60.0


def fit_ends(mesh: StreetMesh, region: int, line: LineString) -> LineString:
    """Draw the ends of a street on to junctions that are near, and to the edge of its region.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    line
        Centre line through the region, metres.
    """
    xy = shapely.get_coordinates(line).copy()
    degrees = mesh.degrees()
    for end in (0, -1):
        place, _, vertex = locate(mesh, region, xy[end], degrees)
        target = place if vertex is None else mesh.xy[vertex]
        xy = _drag(xy, end, target - xy[end])
    return LineString(xy)


def cut(mesh: StreetMesh, region: int, line: LineString, street: int, width: float) -> list[int]:
    """Split a region along a street.

    Parameters
    ----------
    mesh, region
        The mesh, which changes, and the number of the region.
    line
        Centre line, its ends on the region's rings, metres; see `fit_ends`.
    street
        Number of the street.
    width
        Metres.

    Returns
    -------
    list of int
        Numbers of the parts.
    """
    xy = shapely.get_coordinates(line)
    ends = []
    for end in (0, -1):
        place, (a, b), vertex = locate(mesh, region, xy[end], mesh.degrees())
        ends.append(mesh.insert(a, b, (place[0], place[1])) if vertex is None else vertex)
    chain = [ends[0], *mesh.add_vertices(xy[1:-1]), ends[1]]
    return mesh.split(region, [chain], [MeshEdge(EdgeKind.STREET, street, width)])


def locate(
    mesh: StreetMesh, region: int, xy: Floats, degrees: npt.NDArray[np.int64]
) -> tuple[Floats, tuple[int, int], int | None]:
    """Find where on the edge of a region a point lies.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    xy
        The point, shape (2,), metres.
    degrees
        Of the vertices of the mesh.

    Returns
    -------
    place
        Nearest place on the edges, shape (2,), metres.
    edge
        The edge that it is on.
    vertex
        The vertex that it should be instead, or None: a junction within 4 m, any vertex within
        half a metre.
    """
    halves = np.array(list(mesh.regions[region].edges()), dtype=int)
    start, stop = mesh.xy[halves[:, 0]], mesh.xy[halves[:, 1]]
    way = stop - start
    length = np.maximum((way * way).sum(axis=1), 1e-12)
    t = np.clip(((xy - start) * way).sum(axis=1) / length, 0.0, 1.0)
    foot = start + way * t[:, None]
    k = int(np.argmin(np.hypot(*(foot - xy).T)))
    off = np.hypot(*(start - xy).T)
    junctions = np.where(degrees[halves[:, 0]] >= 3, off, np.inf)
    vertex = None
    if junctions.min() < TO_JUNCTION:
        vertex = int(halves[int(np.argmin(junctions)), 0])
    else:
        near = np.hypot(*(start - foot[k]).T)
        if near.min() < TO_VERTEX:
            vertex = int(halves[int(np.argmin(near)), 0])
    return foot[k], (int(halves[k, 0]), int(halves[k, 1])), vertex


def _drag(xy: Floats, end: int, by: Floats) -> Floats:
    """Move one end of a line and ease its neighbourhood along."""
    if not np.hypot(*by) > 0:
        return xy
    step = np.r_[0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T))]
    away = step if end == 0 else step[-1] - step
    share = np.clip(1.0 - away / min(EASE, 0.5 * step[-1]), 0.0, 1.0)
    return np.asarray(xy + share[:, None] * by)
