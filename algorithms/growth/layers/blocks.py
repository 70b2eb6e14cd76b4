"""Blocks: what streets that have grown enclose, with those that were there and the edge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import shapely

from ...progress import Progress
from ...site.watch import aside, ask, in_chunks
from ..types import BoolArray, FloatArray, Growth, IntArray
from .outward import Shapes, segments

if TYPE_CHECKING:
    from ..land.ground import RealGround

#: What goes on here, for those who cancel it.
_WORK = "the blocks were drawn"
#: Grid on which streets and the edge of the domain meet (metres).
GRID = 0.001
#: Sides of blocks this near to a street are pieces of it (metres).
NEAR = 2 * GRID
#: Nodes this near to the edge of the domain lie on it (metres).
BESIDE = 0.3
#: Blocks have no more than this along their outlines without a street to be closed (metres).
OPEN = 1.0
#: Between lines that are on average nearer than this there is no block (metres).
STRIP = 1.5


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks, b of them, in the order of their lowest corners.

    Attributes
    ----------
    polygons
        Shape (b,). Outlines along the middles of streets, metres.
    sides
        Shape (b,). Number of different roads and existing streets along the outline.
    closed
        Shape (b,). Whether streets run all the way around; else the edge of the domain closes it.
    iteration
        Shape (b,). Iteration in which the last street along the outline appeared.
    """

    polygons: Shapes
    sides: IntArray
    closed: BoolArray
    iteration: IntArray


def grown_blocks(growth: Growth, real: RealGround, progress: Progress | None = None) -> Blocks:
    """Find the blocks inside the domain.

    Streets that end blind inside a block do not cut it. The edge of the domain closes blocks
    where no street does; without a domain only streets do.

    Parameters
    ----------
    growth, real
        What has grown, and where.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    lines = np.asarray(shapely.linestrings(growth.xy[growth.ends]), dtype=object)
    faces = block_faces(growth, real.ground.domain, progress)
    ask(progress, _WORK)
    owner, edge, length = _sides(faces, lines, progress)
    ask(progress, _WORK)
    along = edge >= 0
    step = np.zeros(len(faces), dtype=np.int64)
    np.maximum.at(step, owner[along], growth.step[edge[along]])
    bare = np.bincount(owner[~along], weights=length[~along], minlength=len(faces))
    sides = _count_sides(growth, real, owner[along], edge[along], len(faces))
    return Blocks(faces, sides, bare < OPEN, step)


def block_faces(
    growth: Growth,
    domain: shapely.Geometry | None,
    progress: Progress | None,
    *,
    within: Shapes | None = None,
) -> Shapes:
    """Find the outlines of blocks, shape (b,), in the order of their lowest corners.

    Parameters
    ----------
    growth, progress
        As of `grown_blocks`.
    domain
        That of the ground, or None.
    within
        Shape (k,). Blocks of the same growth when it was smaller: only what became of them is
        looked for. None for everywhere.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    edges, border = growth.ends, _border(domain)
    if within is not None:
        near = shapely.STRtree(shapely.linestrings(growth.xy[edges]))
        edges = edges[_found(near, within)]
        border = border[_found(shapely.STRtree(border), within)]
        ask(progress, _WORK)
    lines = np.asarray(shapely.linestrings(growth.xy[edges]), dtype=object)
    every = np.concatenate([lines, border, _closings(growth.xy[np.unique(edges)], border)])
    # streets end at the edge but for rounding: the grid brings them together
    noded = aside(partial(shapely.union_all, grid_size=GRID), every, progress, work=_WORK)
    pieces = shapely.get_parts(noded)
    faces = shapely.get_parts(aside(shapely.polygonize, pieces, progress, work=_WORK))
    ask(progress, _WORK)
    return _inside(faces, domain, within)


def _found(tree: shapely.STRtree, areas: Shapes) -> IntArray:
    """Tell what of a tree lies in areas or along them, in its order."""
    found: IntArray = tree.query(areas, predicate="dwithin", distance=BESIDE)[1]
    return np.unique(found)


def _border(domain: shapely.Geometry | None) -> Shapes:
    """Give the straight sides of the domain, all rings, shape (k,)."""
    if domain is None:
        return np.zeros(0, dtype=object)
    parts = shapely.get_parts(domain)
    return segments(
        shapely.get_rings(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON])
    )


def _closings(nodes: FloatArray, border: Shapes) -> Shapes:
    """Lead nodes that hardly miss the border on to it.

    The domain reaches a little beyond the streets along its edge. What lies beyond them would
    hang on blocks as long tails.
    """
    points = shapely.points(nodes)
    if not len(border) or not len(points):
        return np.zeros(0, dtype=object)
    tree = shapely.STRtree(border)
    (node, side), gap = tree.query_nearest(
        points, max_distance=BESIDE, all_matches=False, return_distance=True
    )
    apart = gap > GRID
    return np.asarray(shapely.shortest_line(points[node[apart]], border[side[apart]]))


def _inside(faces: Shapes, domain: shapely.Geometry | None, within: Shapes | None) -> Shapes:
    """Keep faces inside the domain that are no mere strips, in the order of their corners."""
    around = shapely.length(faces)
    keep = shapely.area(faces) > STRIP / 2 * around
    inner = shapely.point_on_surface(faces)
    if domain is not None:
        shapely.prepare(domain)
        keep &= shapely.contains_xy(domain, shapely.get_x(inner), shapely.get_y(inner))
    if within is not None:
        own = np.zeros(len(faces), dtype=bool)
        own[shapely.STRtree(within).query(inner, predicate="within")[0]] = True
        keep &= own
    faces = shapely.normalize(faces[keep])
    bounds = shapely.bounds(faces)
    return np.asarray(faces[np.lexsort(bounds.T[[3, 2, 0, 1]])], dtype=object)


def _count_sides(
    growth: Growth, real: RealGround, owner: IntArray, edge: IntArray, count: int
) -> IntArray:
    """Count different roads and existing streets, shape (count,); of one name they are one."""
    first: dict[str, int] = {}
    one = [first.setdefault(s.name or f" {k}", k) for k, s in enumerate(real.streets)]
    # streets that were there have numbers below those of roads
    given = -1 - np.array([*one, -1], dtype=np.int64)
    street = np.where(growth.grown[edge], growth.road[edge], given[growth.street[edge]])
    different = np.unique(np.column_stack([owner, street]), axis=0)
    return np.bincount(different[:, 0], minlength=count).astype(np.int64)


def _sides(
    polygons: Shapes, lines: Shapes, progress: Progress | None
) -> tuple[IntArray, IntArray, FloatArray]:
    """Give polygon, edge and length of each straight side; the edge is -1 without a street."""
    rings, polygon = shapely.get_rings(polygons, return_index=True)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    side = np.flatnonzero(ring[1:] == ring[:-1])
    middles = shapely.points((xy[side] + xy[side + 1]) / 2)
    tree = shapely.STRtree(lines)

    def beside(points: Shapes) -> IntArray:
        found = np.full(len(points), -1, dtype=np.int64)
        hit, line = tree.query_nearest(points, max_distance=NEAR, all_matches=False)
        found[hit] = line
        return found

    edge = in_chunks(beside, middles, progress, work=_WORK)
    return polygon[ring[side]], edge, np.hypot(*(xy[side + 1] - xy[side]).T)
