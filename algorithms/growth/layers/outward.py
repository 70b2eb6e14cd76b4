"""How streets lead out of what has grown: over existing streets, or over the edge."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from ..grammar import EDGE
from ..types import BoolArray, FloatArray, Growth, IntArray

if TYPE_CHECKING:
    from ..land.ground import RealGround

Shapes = npt.NDArray[Any]

#: Ends nearer than this to the edge lie on it (metres).
ON_EDGE = 0.05
#: Ends that growth has put at the edge are nearer than this to it (metres).
PUT_THERE = 0.5


def existing_edges(growth: Growth, real: RealGround) -> BoolArray:
    """Tell which edges are of streets that exist, shape (e,).

    Streets along the edge of the domain that the planner asked for are new, and so are grown ones.

    Parameters
    ----------
    growth, real
        What has grown, and where.
    """
    planned = np.array([street.edge for street in real.streets], dtype=bool)
    found = ~growth.grown
    found[found] = ~planned[growth.street[found]]
    return found


def at_nodes(growth: Growth, edges: BoolArray) -> BoolArray:
    """Tell which nodes edges meet, shape (n,).

    Parameters
    ----------
    growth
        What has grown.
    edges
        Shape (e,). Which edges.
    """
    found = np.zeros(len(growth.xy), dtype=bool)
    found[growth.ends[edges].ravel()] = True
    return found


def on_outer_edge(growth: Growth, real: RealGround) -> BoolArray:
    """Tell which nodes lie on the outer edge of the domain, shape (n,).

    Streets lead out there; at the edge of an obstacle they do not, be it a hole of the domain or
    across its outer edge. Besides the nodes that growth has put there these are all within
    `ON_EDGE` of it, such as starts.

    Parameters
    ----------
    growth, real
        What has grown, and where.
    """
    found = np.zeros(len(growth.xy), dtype=bool)
    domain = real.ground.domain
    if domain is None or not len(found):
        return found
    shells, holes = _sides(domain, real.outline)
    points = shapely.points(growth.xy)
    shell_tree = shapely.STRtree(shells)
    near = shell_tree.query(points, predicate="dwithin", distance=ON_EDGE)[0]
    found[near] = True
    edge = np.flatnonzero(growth.node_type == EDGE)
    sides = np.concatenate([shells, holes])
    tree = shapely.STRtree(sides)
    nearest = tree.nearest(points[edge])
    # streets may end at the edge of the site, too, where they cannot cross to the road beside it
    there = shapely.distance(points[edge], sides[nearest]) < PUT_THERE
    found[edge] |= (nearest < len(shells)) & there
    return found


def ways_out(growth: Growth, real: RealGround) -> FloatArray:
    """Measure the shortest way along streets from each node to where traffic leaves.

    Traffic leaves over existing streets. Streets that reach none lead over the edge of the
    domain: to the street along it, or to where they end there.

    Parameters
    ----------
    growth, real
        What has grown, and where.

    Returns
    -------
    ndarray
        Shape (n,). Metres; infinite where no way leads out.
    """
    out = at_nodes(growth, existing_edges(growth, real))
    label = components(growth)
    served = np.zeros(int(label.max(initial=-1)) + 1, dtype=bool)
    served[label[out]] = True
    planned = ~growth.grown & ~existing_edges(growth, real)
    edge = at_nodes(growth, planned) | on_outer_edge(growth, real)
    out |= edge & ~served[label]
    return _distances(growth, out)


def components(growth: Growth) -> IntArray:
    """Label the connected part of the streets that each node belongs to, shape (n,).

    Parameters
    ----------
    growth
        What has grown.
    """
    count = len(growth.xy)
    links = coo_matrix((np.ones(len(growth.ends)), growth.ends.T), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _distances(growth: Growth, sinks: BoolArray) -> FloatArray:
    """Shortest way from each node to a sink, shape (n,)."""
    count = len(growth.xy)
    starts = np.flatnonzero(sinks)
    if not len(starts):
        return np.full(count, np.inf)
    # edges between the same nodes, which are straight and equally long, count once
    pairs, first = np.unique(np.sort(growth.ends, axis=1), axis=0, return_index=True)
    # a length of 0 would be no link at all
    length = np.maximum(growth.lengths[first], 1e-9)
    links = coo_matrix((length, pairs.T), shape=(count, count)).tocsr()
    return np.asarray(dijkstra(links, directed=False, indices=starts, min_only=True))


def _sides(domain: shapely.Geometry, outline: shapely.Geometry | None) -> tuple[Shapes, Shapes]:
    """Straight sides of a domain: those of its outer edges, and those of holes and obstacles."""
    sides = segments(shapely.get_rings(_polygons(domain)))
    shells = segments(shapely.get_exterior_ring(_polygons(domain if outline is None else outline)))
    # where an obstacle was taken away there are corners, so one place tells of all of a side
    middles = shapely.line_interpolate_point(sides, 0.5, normalized=True)
    outer = np.zeros(len(sides), dtype=bool)
    outer[shapely.STRtree(shells).query(middles, predicate="dwithin", distance=ON_EDGE)[0]] = True
    return sides[outer], sides[~outer]


def _polygons(area: shapely.Geometry) -> Shapes:
    parts = shapely.get_parts(area)
    return np.asarray(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON])


def segments(lines: Shapes) -> Shapes:
    """Part lines into their straight pieces, shape (k,).

    Parameters
    ----------
    lines
        Lines or rings, shape (n,).
    """
    xy, owner = shapely.get_coordinates(lines, return_index=True)
    inner = np.flatnonzero(owner[1:] == owner[:-1])
    if not len(inner):
        return np.zeros(0, dtype=object)
    pairs = np.stack([xy[inner], xy[inner + 1]], axis=1)
    return np.asarray(shapely.linestrings(pairs), dtype=object)
