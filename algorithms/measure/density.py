"""Road density: how much of the ground streets take up, and how long they are on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import Delaunay, QhullError

from ..levels import COLLECTOR, CUL_DE_SAC, LOCAL, MAJOR
from .graph import FloatArray, IntArray, StreetGraph

#: Widths of streets by level from property line to property line, metres: the same that blocks are
#: cut with where a street has no width of its own.
WIDTHS: Mapping[int, float] = {MAJOR: 20.0, COLLECTOR: 16.0, LOCAL: 12.0, CUL_DE_SAC: 10.0}
#: Triangles with a larger circumscribed circle are no ground of a network (metres; 20 units of
#: 100 m in CitySprout).
ALPHA_RADIUS = 2000.0
#: Streets this near to the edge of their ground run along it (metres).
TOUCH = 1.0
#: Stretches that are shorter than this only cross the edge (metres).
_ALONG = 6 * TOUCH
#: Street space is added up in squares of this size; joining all at once takes longer (metres).
_TILE = 1000.0
#: Segments of a quarter circle, which change the area of streets by less than a ten-thousandth.
_ARC = 6


@dataclass(frozen=True)
class RoadDensity:
    """How much street there is on some ground.

    Attributes
    ----------
    ground
        Area of the ground, m2.
    length
        Length of the streets on it, m.
    roads
        Area that they take up, m2.
    """

    ground: float
    length: float
    roads: float

    @property
    def share(self) -> float:
        """Road area / ground, 0 to 1; NaN without ground."""
        return self.roads / self.ground if self.ground > 0 else math.nan

    @property
    def km_per_km2(self) -> float:
        """Length per area; NaN without ground."""
        return 1000.0 * self.length / self.ground if self.ground > 0 else math.nan

    @property
    def hm_per_hm2(self) -> float:
        """The same in hectometres, the units of CitySprout: a tenth of km per km2."""
        return self.km_per_km2 / 10.0


def road_density(
    graph: StreetGraph,
    widths: npt.ArrayLike | None = None,
    ground: shapely.Geometry | None = None,
    *,
    radius: float = ALPHA_RADIUS,
) -> RoadDensity:
    """Measure how much street there is on some ground.

    Parameters
    ----------
    graph
        The streets, metres.
    widths
        Shape (e,). Widths of the edges, metres, or None for that of local streets.
    ground
        Polygon or MultiPolygon, metres; what lies outside does not count, but streets that run
        along its edge, within 1 m, count in full. None: the alpha shape of the nodes, as in
        CitySprout, on which the length counts in full but the road area only as far as it lies
        on it.
    radius
        See `alpha_shape`.
    """
    own = _widths(graph, widths)
    land = alpha_shape(graph.nodes, radius) if ground is None else ground
    length = float(graph.lengths.sum())
    if ground is not None:
        length = _length_on(graph, ground)
    return RoadDensity(float(shapely.area(land)), length, _area_on(_pieces(graph, own), land))


def road_area_share(
    graph: StreetGraph, widths: npt.ArrayLike | None, ground: shapely.Geometry
) -> float:
    """Share of some ground that is taken up by streets, 0 to 1; NaN where the ground is empty.

    Parameters
    ----------
    graph, widths, ground
        See `road_density`.
    """
    return road_density(graph, widths, ground).share


def road_area(graph: StreetGraph, widths: npt.ArrayLike | None = None) -> shapely.Geometry:
    """Make the area of the streets: strips that end straight at dead ends, round at junctions.

    Parameters
    ----------
    graph, widths
        See `road_density`.
    """
    return shapely.union_all(_pieces(graph, _widths(graph, widths)))


def _pieces(graph: StreetGraph, widths: FloatArray) -> npt.NDArray[np.object_]:
    """Make the strips of the edges, and discs where they meet."""
    half = widths / 2
    strips = shapely.buffer(
        np.array(graph.lines, dtype=object),
        half,
        quad_segs=_ARC,
        cap_style="flat",
        join_style="round",
    )
    # Between strips that meet at an angle a wedge stays open; a disc fills it, as wide as the
    # second widest street, so that it does not stand out where a wide street becomes narrow.
    second = _second_widest(graph, half)
    met = np.flatnonzero(second > 0)
    discs = shapely.buffer(shapely.points(graph.nodes[met]), second[met], quad_segs=_ARC)
    return np.concatenate([strips, discs])


def _area_on(pieces: npt.NDArray[np.object_], land: shapely.Geometry) -> float:
    """Add up the area that pieces cover together on some land, square by square."""
    pieces = pieces[~shapely.is_empty(pieces)]
    if not len(pieces) or shapely.is_empty(land):
        return 0.0
    cells = np.floor(shapely.bounds(pieces) / _TILE).astype(np.int64)
    across = cells[:, 2:] - cells[:, :2] + 1
    many = across.prod(axis=1)
    own = np.repeat(np.arange(len(pieces)), many)
    nth = np.arange(len(own)) - np.repeat(np.cumsum(many) - many, many)
    cell = cells[own, :2] + np.stack(np.divmod(nth, across[own, 1]), axis=1)
    parts, cut = pieces[own], np.flatnonzero(many[own] > 1)
    low, high = cell * _TILE, (cell + 1) * _TILE
    parts[cut] = shapely.intersection(parts[cut], shapely.box(*low[cut].T, *high[cut].T))
    _, first, key = np.unique(cell, axis=0, return_index=True, return_inverse=True)
    key = key.ravel()
    order = np.argsort(key, kind="stable")
    groups = np.split(parts[order], np.flatnonzero(np.diff(key[order])) + 1)
    covered = np.array([shapely.union_all(group) for group in groups], dtype=object)
    squares = shapely.box(*low[first].T, *high[first].T)
    shapely.prepare(land)
    edge = ~shapely.covers(land, squares)
    # The land of a square first: the whole of it may have many vertices.
    grounds = shapely.intersection(squares[edge], land)
    covered[edge] = shapely.intersection(covered[edge], grounds)
    return float(shapely.area(covered).sum())


def level_widths(level: IntArray) -> FloatArray:
    """Usual widths of streets by their level, shape (e,), metres.

    Parameters
    ----------
    level
        Shape (e,). See `levels.LEVEL_NAMES`; anything else counts as local.
    """
    return np.array([WIDTHS.get(k, WIDTHS[LOCAL]) for k in np.asarray(level).tolist()], dtype=float)


def alpha_shape(points: npt.ArrayLike, radius: float = ALPHA_RADIUS) -> shapely.Geometry:
    """Make the alpha shape of points: what their small Delaunay triangles cover.

    Parameters
    ----------
    points
        Shape (n, 2), metres.
    radius
        Triangles count whose circumscribed circle has a radius below this, metres.

    Returns
    -------
    Geometry
        Polygon or MultiPolygon, empty where points are fewer than three or in a line. Gaps that
        are larger than the radius stay open, whereas CitySprout closes those inside.
    """
    return shapely.union_all(shapely.polygons(_triangles(points, radius)))


def alpha_area(points: npt.ArrayLike, radius: float = ALPHA_RADIUS) -> float:
    """Area of the alpha shape of points, m2.

    Parameters
    ----------
    points, radius
        See `alpha_shape`.
    """
    return float(_areas(_triangles(points, radius)).sum())


def _triangles(points: npt.ArrayLike, radius: float) -> FloatArray:
    """Delaunay triangles with a circumscribed circle below a radius, shape (k, 3, 2)."""
    xy = np.unique(np.asarray(points, dtype=float).reshape(-1, 2), axis=0)
    if len(xy) < 3:
        return np.zeros((0, 3, 2))
    try:
        corners = xy[Delaunay(xy - xy.mean(axis=0)).simplices]
    except QhullError:  # all in one line
        return np.zeros((0, 3, 2))
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    area = _areas(corners)
    around = np.prod(sides, axis=1) < 4 * radius * area
    return np.asarray(corners[around], dtype=float)


def _areas(corners: FloatArray) -> FloatArray:
    """Areas of triangles, shape (k,)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2, dtype=float)


def _widths(graph: StreetGraph, widths: npt.ArrayLike | None) -> FloatArray:
    """Widths of the edges, shape (e,), local streets' where none are given."""
    given = WIDTHS[LOCAL] if widths is None else widths
    return np.broadcast_to(np.asarray(given, dtype=float), len(graph.ends)).copy()


def _second_widest(graph: StreetGraph, half: FloatArray) -> FloatArray:
    """Find the second largest half width at each node, 0 at dead ends, shape (n,)."""
    node, own = graph.ends.ravel(), np.repeat(half, 2)
    order = np.lexsort((-own, node))
    node, own = node[order], own[order]
    second = np.zeros(len(graph.nodes))
    first = np.r_[True, node[1:] != node[:-1]]
    # The end after the first one of its node.
    follows = np.flatnonzero(first[:-1] & ~first[1:]) + 1
    second[node[follows]] = own[follows]
    return second


def _length_on(graph: StreetGraph, ground: shapely.Geometry) -> float:
    """Length of the streets on some ground, its edge included.

    Streets are often drawn along the edge of a site, and rounding puts them to either side of it.
    """
    shapely.prepare(ground)
    lines = np.array(graph.lines, dtype=object)
    whole = shapely.covers(ground, lines)
    length = float(shapely.length(lines[whole]).sum())
    edge = shapely.buffer(shapely.boundary(ground), TOUCH, quad_segs=_ARC)
    shapely.prepare(edge)
    # Most streets lie on one side; overlays are for the others.
    lines = lines[~whole & shapely.intersects(edge, lines)]
    beside = shapely.get_parts(shapely.line_merge(shapely.intersection(lines, edge)))
    away = shapely.intersection(shapely.difference(lines, edge), ground)
    along = shapely.length(beside) > _ALONG
    across = shapely.intersection(beside[~along], ground)
    return length + float(sum(shapely.length(own).sum() for own in (away, beside[along], across)))
