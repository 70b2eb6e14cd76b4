"""How far the land of a region lies from access, at sample points that its parts inherit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
import shapely.affinity
from shapely.geometry import LineString, Polygon

from ..edges import EdgeKind
from ..roadmesh import StreetMesh

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Samples:
    """Points of a region and their depth.

    Attributes
    ----------
    points
        On a grid, shape (n,), metres.
    depth
        Distance from street space that gives access, shape (n,), metres; negative in it and
        infinite where there is no access at all.
    """

    points: npt.NDArray[np.object_]
    depth: Floats

    @property
    def deepest(self) -> float:
        """Largest depth, metres; 0 without points."""
        return float(self.depth.max()) if len(self.depth) else 0.0

    def beside(self, line: shapely.Geometry, width: float) -> Samples:
        """Return the same points with a street of some width more.

        Parameters
        ----------
        line
            Its centre line or lines, metres.
        width
            Metres.
        """
        shapely.prepare(line)
        new = shapely.distance(self.points, line) - width / 2
        return Samples(self.points, np.minimum(self.depth, new))

    def within(self, polygon: Polygon) -> Samples:
        """Return the points inside a polygon.

        Parameters
        ----------
        polygon
            A part of the region.
        """
        shapely.prepare(polygon)
        inside = shapely.contains(polygon, self.points)
        return Samples(self.points[inside], self.depth[inside])


def sample(mesh: StreetMesh, region: int, spacing: float) -> Samples:
    """Measure the depth of a region.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    spacing
        Of the grid, metres.
    """
    polygon = mesh.polygon(region)
    x0, y0, x1, y1 = polygon.bounds
    x, y = np.meshgrid(
        np.arange(x0 + spacing / 2, x1, spacing), np.arange(y0 + spacing / 2, y1, spacing)
    )
    xy = np.column_stack([x.ravel(), y.ravel()])
    shapely.prepare(polygon)
    xy = xy[shapely.contains_xy(polygon, xy)]
    depth = np.full(len(xy), math.inf)
    lines, offsets = [], []
    for a, b in mesh.regions[region].edges():
        edge = mesh.edge(a, b)
        if edge.kind != EdgeKind.CLOSED:
            lines.append(mesh.xy[[a, b]])
            offsets.append(edge.width / 2 if edge.kind == EdgeKind.STREET else 0.0)
    points = shapely.points(xy)
    if lines and len(xy):
        segments, half = shapely.linestrings(np.array(lines)), np.array(offsets)
        for width in np.unique(half):
            own = half == width
            near = segments[own][_nearest(xy, np.array(lines)[own])]
            depth = np.minimum(depth, shapely.distance(points, near) - width)
    return Samples(points, depth)


def _nearest(xy: Floats, segments: Floats) -> npt.NDArray[np.int64]:
    """Find the segment nearest to each point; less work than a tree, as segments are few.

    Parameters
    ----------
    xy
        Points, shape (n, 2), metres.
    segments
        Their ends, shape (s, 2, 2).

    Returns
    -------
    ndarray of int, shape (n,)
    """
    start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
    square = np.maximum((way * way).sum(axis=1), 1e-18)
    best = np.full(len(xy), math.inf)
    found = np.zeros(len(xy), dtype=np.int64)
    x, y = xy.T
    for k, ((x0, y0), (wx, wy), size) in enumerate(zip(start.tolist(), way.tolist(), square)):
        dx, dy = x - x0, y - y0
        t = np.minimum(np.maximum((dx * wx + dy * wy) / size, 0.0), 1.0)
        dx -= t * wx
        dy -= t * wy
        off = dx * dx + dy * dy
        nearer = off < best
        best[nearer] = off[nearer]
        found[nearer] = k
    return found


def block_length(polygon: Polygon) -> float:
    """Longer side of the rectangle with the same area and perimeter, metres.

    Unlike the side of the smallest rectangle around, it tells the length of bent strips.

    Parameters
    ----------
    polygon
        A region.

    Examples
    --------
    >>> block_length(shapely.box(0, 0, 200, 75))
    200.0
    """
    half = float(polygon.exterior.simplify(2.0).length) / 2
    root = half * half - 4 * float(polygon.area)
    return (half + math.sqrt(max(root, 0.0))) / 2


def parts(polygon: Polygon, lines: Sequence[LineString]) -> list[Polygon] | None:
    """Cut a polygon along lines between points of its rings.

    Parameters
    ----------
    polygon
        Possibly with holes, which must not meet the line.
    lines
        One from the outer ring to itself, or several that lead from hole to ring, metres.

    Returns
    -------
    list of Polygon or None
        Two valid polygons, or None if the line does not cut it so.

    Examples
    --------
    >>> sorted(p.area for p in parts(shapely.box(0, 0, 4, 1), [LineString([(1, 0), (1, 1)])]))
    [1.0, 3.0]
    """
    ring = polygon.exterior
    if len(lines) > 1:
        return _noded(polygon, lines)
    (line,) = lines
    chain = shapely.get_coordinates(line)
    ends = shapely.points(chain[[0, -1]])
    if shapely.distance(ring, ends).max() > 1e-6:
        return _noded(polygon, lines)
    xy = shapely.get_coordinates(ring)[:-1]
    along = np.r_[0.0, np.cumsum(np.hypot(*(np.roll(xy, -1, axis=0) - xy).T))]
    start, stop = shapely.line_locate_point(ring, ends).tolist()
    if abs(start - stop) < 1e-6:
        return None
    vertices = along[:-1]

    def between(a: float, b: float) -> Floats:
        # open interval, going round where b < a
        if a < b:
            return np.asarray(xy[(vertices > a + 1e-9) & (vertices < b - 1e-9)])
        return np.vstack([xy[vertices > a + 1e-9], xy[vertices < b - 1e-9]])

    loops = [np.vstack([chain, between(stop, start)])]
    loops.append(np.vstack([chain[::-1], between(start, stop)]))
    if min(map(len, loops)) < 3:
        return None
    first, second = map(Polygon, loops)
    if not (first.is_valid and second.is_valid):
        return None
    holes = polygon.interiors
    if holes:
        inside = [first.contains(shapely.Point(hole.coords[0])) for hole in holes]
        cut = shapely.polygons(np.array(holes, dtype=object))
        if shapely.intersects(cut, line).any():
            return None
        first = Polygon(first.exterior, [h for h, own in zip(holes, inside) if own])
        second = Polygon(second.exterior, [h for h, own in zip(holes, inside) if not own])
    if abs(first.area + second.area - polygon.area) > 1e-3:
        return None
    return [first, second]


def _noded(polygon: Polygon, lines: Sequence[LineString]) -> list[Polygon] | None:
    """Cut a polygon along lines that end on several of its rings."""
    rings = [LineString(ring.coords) for ring in (polygon.exterior, *polygon.interiors)]
    # a breath longer, so that noding finds where they meet the rings
    longer = [shapely.affinity.scale(line, 1 + 1e-6, 1 + 1e-6) for line in lines]
    noded = shapely.union_all([*rings, *longer])
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    inside = [f for f in faces if f.area > 1e-3 and polygon.covers(f.representative_point())]
    return inside if len(inside) == 2 else None
