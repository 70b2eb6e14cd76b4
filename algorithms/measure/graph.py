"""A graph of streets, read from the geometry of any line layer alone.

Nothing here knows of meshes, models or designs, so that what is checked on this graph is
checked independently of how the streets came about.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from shapely.geometry import LineString, Point
from shapely.ops import substring

BoolArray = npt.NDArray[np.bool_]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: Street ends closer than this are one junction (metres).
TOLERANCE = 0.5


@dataclass(frozen=True)
class Conflict:
    """Two streets that cross without a junction, or run on top of each other.

    Attributes
    ----------
    streets
        Positions of the two input lines; the same twice where a line meets itself.
    geometry
        The crossing point or the shared stretch.
    """

    streets: tuple[int, int]
    geometry: shapely.Geometry


@dataclass(frozen=True, eq=False)
class StreetGraph:
    """Streets as n nodes and e edges, in metres.

    Attributes
    ----------
    nodes
        Shape (n, 2). Positions.
    ends
        Shape (e, 2). Nodes at the start and the end of each edge.
    lines
        The e edges' geometries, from start to end.
    street
        Shape (e,). Position of the input line that each edge is a piece of.
    crossings, overlaps
        Pairs of lines that cross without a junction or share a stretch.
    """

    nodes: FloatArray
    ends: IntArray
    lines: tuple[LineString, ...]
    street: IntArray
    crossings: tuple[Conflict, ...] = ()
    overlaps: tuple[Conflict, ...] = ()

    @property
    def lengths(self) -> FloatArray:
        """Lengths of the edges, shape (e,), metres."""
        return np.asarray(shapely.length(np.array(self.lines, dtype=object)), dtype=float)

    @property
    def degrees(self) -> IntArray:
        """Number of edge ends at each node, shape (n,)."""
        return np.bincount(self.ends.ravel(), minlength=len(self.nodes)).astype(np.int64)

    def incident(self) -> list[list[int]]:
        """List the edges at each node; a loop is listed twice."""
        found: list[list[int]] = [[] for _ in self.nodes]
        for e, (u, v) in enumerate(self.ends.tolist()):
            found[u].append(e)
            found[v].append(e)
        return found

    def components(self) -> IntArray:
        """Label the connected component of each node, shape (n,)."""
        return _components(len(self.nodes), self.ends)

    def near(self, geometry: shapely.Geometry, distance: float) -> BoolArray:
        """Tell which nodes lie within a distance of a geometry, shape (n,)."""
        if geometry.is_empty or not len(self.nodes):
            return np.zeros(len(self.nodes), dtype=bool)
        shapely.prepare(geometry)
        return np.asarray(shapely.dwithin(shapely.points(self.nodes), geometry, distance))


@dataclass(frozen=True)
class Chain:
    """Edges that follow one another without a junction.

    Attributes
    ----------
    edges
        Indices of the edges, in order.
    ends
        Nodes at the start and the end; equal for a ring.
    line
        Geometry from start to end.
    """

    edges: tuple[int, ...]
    ends: tuple[int, int]
    line: LineString


def build_graph(lines: Sequence[LineString], tolerance: float = TOLERANCE) -> StreetGraph:
    """Join lines into a graph at shared end points.

    A line is cut where the end of another one touches it, and where both have a vertex at
    the same place. Lines that cross otherwise are not joined; they are listed instead.

    Parameters
    ----------
    lines
        Streets in metres, not empty; geometry that is not simple is cut where it meets itself.
    tolerance
        Points closer than this are the same, in metres, greater than 0.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> graph = build_graph([LineString([(0, 0), (100, 0)]), LineString([(50, 0), (50, 60)])])
    >>> graph.nodes.shape, graph.ends.shape, sorted(graph.degrees.tolist())
    ((4, 2), (3, 2), [1, 1, 1, 3])
    """
    pieces, street, crossings = _simple_pieces(lines, tolerance)
    cuts: list[list[float]] = [[] for _ in pieces]
    _cut_at_ends(pieces, cuts, tolerance)
    found, overlaps = _cut_at_vertices(pieces, cuts, tolerance)
    crossings += [Conflict((street[i], street[j]), at) for i, j, at in found]
    parts: list[LineString] = []
    origin: list[int] = []
    for piece, own, at in zip(pieces, street, cuts):
        for part in _split(piece, at, tolerance):
            parts.append(part)
            origin.append(own)
    return _weld(
        parts,
        origin,
        tolerance,
        crossings,
        [Conflict((street[i], street[j]), shared) for i, j, shared in overlaps],
    )


def chains(graph: StreetGraph, use: BoolArray, stops: BoolArray) -> list[Chain]:
    """Join edges through nodes where exactly two edges meet.

    Parameters
    ----------
    graph
        The streets.
    use
        Shape (e,). Edges to join; the others only count as edges at their nodes.
    stops
        Shape (n,). Nodes where a chain ends although only two edges meet.
    """
    incident = graph.incident()
    passing = np.array([len(at) == 2 and bool(use[at].all()) for at in incident], dtype=bool)
    passing &= ~stops
    done = np.zeros(len(graph.lines), dtype=bool)
    found = []
    # First the chains that have ends, then what is left: rings without a junction.
    starts = [(e, k) for e in np.flatnonzero(use).tolist() for k in (0, 1)]
    starts.sort(key=lambda start: bool(passing[graph.ends[start[0], start[1]]]))
    for edge, side in starts:
        if not done[edge]:
            found.append(_walk(graph, incident, passing, done, edge, side))
    return found


def _walk(
    graph: StreetGraph,
    incident: list[list[int]],
    passing: BoolArray,
    done: BoolArray,
    edge: int,
    side: int,
) -> Chain:
    """Follow a chain from the given end of an edge to its other end."""
    start = node = int(graph.ends[edge, side])
    members: list[int] = []
    points: list[tuple[float, float]] = []
    while True:
        done[edge] = True
        members.append(edge)
        forward = int(graph.ends[edge, 0]) == node
        xy = [(float(c[0]), float(c[1])) for c in graph.lines[edge].coords]
        points += (xy if forward else xy[::-1])[1 if points else 0 :]
        node = int(graph.ends[edge, 1 if forward else 0])
        onward = [e for e in incident[node] if not done[e]]
        if not passing[node] or not onward:
            return Chain(tuple(members), (start, node), LineString(points))
        edge = onward[0]


def _components(count: int, pairs: IntArray) -> IntArray:
    pairs = pairs.reshape(-1, 2)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _simple_pieces(
    lines: Sequence[LineString], tolerance: float
) -> tuple[list[LineString], list[int], list[Conflict]]:
    """Cut lines that meet themselves; list where they do so without a vertex."""
    pieces: list[LineString] = []
    street: list[int] = []
    crossings: list[Conflict] = []
    for i, line in enumerate(lines):
        if line.is_simple:
            parts = [line]
        else:
            noded = shapely.union_all([line])
            parts = list(shapely.get_parts(shapely.line_merge(noded)))
            own = shapely.MultiPoint(line.coords)
            ends = {part.coords[k] for part in parts for k in (0, -1)}
            crossings += [
                Conflict((i, i), Point(xy)) for xy in sorted(ends) if own.distance(Point(xy)) > 1e-6
            ]
        kept = [part for part in parts if part.length > tolerance]
        pieces += kept
        street += [i] * len(kept)
    return pieces, street, crossings


def _cut_at_ends(pieces: list[LineString], cuts: list[list[float]], tolerance: float) -> None:
    """Mark on each piece the places where the end of another one touches it."""
    if not pieces:
        return
    ends = np.array([Point(piece.coords[k]) for piece in pieces for k in (0, -1)], dtype=object)
    tree = shapely.STRtree(pieces)
    for k, j in tree.query(ends, predicate="dwithin", distance=tolerance).T.tolist():
        if k // 2 != j:
            cuts[j].append(float(pieces[j].project(ends[k])))


def _cut_at_vertices(
    pieces: list[LineString], cuts: list[list[float]], tolerance: float
) -> tuple[list[tuple[int, int, Point]], list[tuple[int, int, shapely.Geometry]]]:
    """Mark shared vertices; list crossings without one, and shared stretches."""
    crossings: list[tuple[int, int, Point]] = []
    overlaps: list[tuple[int, int, shapely.Geometry]] = []
    if not pieces:
        return crossings, overlaps
    width = tolerance / 10
    lines = np.array(pieces, dtype=object)
    pairs = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=width)
    first, second = pairs[:, pairs[0] < pairs[1]]
    beside = shapely.buffer(lines, width, cap_style="flat")
    shared = shapely.intersection(lines[first], beside[second])
    doubled = shapely.length(shared) > 2 * tolerance
    for i, j, stretch in zip(first[doubled], second[doubled], shared[doubled]):
        overlaps.append((int(i), int(j), stretch))
    at, index = shapely.get_parts(
        shapely.intersection(lines[first[~doubled]], lines[second[~doubled]]), return_index=True
    )
    points = shapely.centroid(at)
    some = ~shapely.is_empty(points)  # lines may touch within rounding only
    points = points[some]
    first, second = first[~doubled][index[some]], second[~doubled][index[some]]
    places = _places(lines, first, second, points)
    size = shapely.length(lines).tolist()
    for i, j, point, (a, b, gap) in zip(first.tolist(), second.tolist(), points, places.tolist()):
        joined = _marked(size[i], cuts[i], a, tolerance) and _marked(size[j], cuts[j], b, tolerance)
        if not joined and gap <= tolerance:
            cuts[i].append(a)
            cuts[j].append(b)
        elif not joined:
            crossings.append((i, j, point))
    return crossings, overlaps


def _places(
    lines: npt.NDArray[np.object_],
    first: IntArray,
    second: IntArray,
    points: npt.NDArray[np.object_],
) -> FloatArray:
    """Where points lie on pairs of lines, and how far they are from vertices of both.

    Returns
    -------
    array
        Shape (k, 3). Distance along the first and along the second line; the larger of the
        distances to the nearest vertex of each; metres.
    """
    xy, index = shapely.get_coordinates(lines, return_index=True)
    vertices = shapely.multipoints(shapely.points(xy), indices=index)
    gaps = [shapely.distance(vertices[side], points) for side in (first, second)]
    along = [shapely.line_locate_point(lines[side], points) for side in (first, second)]
    return np.column_stack([*along, np.maximum(*gaps)])


def _marked(length: float, cuts: Iterable[float], where: float, tolerance: float) -> bool:
    """Tell whether a place on a line is one of its ends or cuts, nearly."""
    return any(abs(where - cut) <= 2 * tolerance for cut in (0.0, length, *cuts))


def _split(line: LineString, cuts: list[float], tolerance: float) -> list[LineString]:
    """Cut a line at distances along it, leaving no piece shorter than the tolerance."""
    at = [0.0]
    for cut in sorted(cuts):
        if cut - at[-1] > tolerance and line.length - cut > tolerance:
            at.append(cut)
    if len(at) == 1:
        return [line]
    at.append(line.length)
    return [substring(line, a, b) for a, b in zip(at, at[1:])]


def _weld(
    parts: list[LineString],
    origin: list[int],
    tolerance: float,
    crossings: list[Conflict],
    overlaps: list[Conflict],
) -> StreetGraph:
    """Make one node of all ends within the tolerance of each other."""
    if not parts:
        empty = np.zeros(0, dtype=np.int64)
        return StreetGraph(np.zeros((0, 2)), empty.reshape(0, 2), (), empty)
    ends = np.array([part.coords[k][:2] for part in parts for k in (0, -1)], dtype=float)
    pairs = cKDTree(ends).query_pairs(tolerance, output_type="ndarray")
    label = _components(len(ends), pairs)
    count = np.bincount(label).astype(float)
    nodes = np.column_stack([np.bincount(label, ends[:, k]) / count for k in (0, 1)])
    pair = label.reshape(-1, 2)
    keep = [
        e for e, part in enumerate(parts) if pair[e, 0] != pair[e, 1] or part.length > 4 * tolerance
    ]
    return StreetGraph(
        nodes,
        pair[keep],
        tuple(parts[e] for e in keep),
        np.array([origin[e] for e in keep], dtype=np.int64),
        tuple(crossings),
        tuple(overlaps),
    )
