"""Street lines of any layer as a planar graph that can be moved and put together again.

Unlike the graph of a design it comes from drawn geometry alone: ends that nearly meet are one
junction, an end on another line makes one there, and so does a vertex that lines share. Lines
that cross anywhere else are taken as bridges: they stay crossed, and no junction is made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..network.problem import BoolArray, FloatArray, IntArray

Geometries = npt.NDArray[np.object_]

#: Street ends closer than this are one junction (metres).
TOLERANCE = 0.5
#: Vertices closer than this are the same (metres).
SAME = 1e-3


@dataclass(frozen=True, eq=False)
class StreetNet:
    """Streets as n nodes and e edges, in metres.

    Attributes
    ----------
    nodes
        Shape (n, 2). Positions.
    ends
        Shape (e, 2). Nodes at the start and the end of each edge.
    lines
        Shape (e,). LineStrings from start to end; neighbours share the very same coordinates.
    street
        Shape (e,). Position of the input line that each edge is a piece of. The edges of one
        line follow one another.
    marks
        Shape (k,). Node at each of the given marks, -1 where no line was near.
    """

    nodes: FloatArray
    ends: IntArray
    lines: Geometries
    street: IntArray
    marks: IntArray

    @property
    def degrees(self) -> IntArray:
        """Number of edge ends at each node, shape (n,)."""
        return np.bincount(self.ends.ravel(), minlength=len(self.nodes)).astype(np.int64)

    @property
    def lengths(self) -> FloatArray:
        """Lengths of the edges, shape (e,), metres."""
        return np.asarray(shapely.length(self.lines), dtype=float)

    def joined(self, lines: Sequence[shapely.Geometry] | Geometries) -> dict[int, FloatArray]:
        """Put the pieces of each input line together again.

        Parameters
        ----------
        lines
            Shape (e,). A geometry for each edge, from its start to its end.

        Returns
        -------
        dict of int to array
            Position of the input line -> its coordinates (k, 2). Lines that left no edge, since
            they are shorter than the tolerance, are missing.
        """
        found: dict[int, list[FloatArray]] = {}
        for street, line in zip(self.street.tolist(), lines):
            xy = shapely.get_coordinates(line)
            parts = found.setdefault(street, [])
            parts.append(xy[1:] if parts else xy)
        return {street: np.vstack(parts) for street, parts in found.items()}


def build_net(
    lines: Sequence[shapely.Geometry] | Geometries,
    marks: FloatArray | None = None,
    reach: float = 2.0,
    held: BoolArray | None = None,
    tolerance: float = TOLERANCE,
) -> StreetNet:
    """Join lines into a graph.

    Parameters
    ----------
    lines
        LineStrings in metres, not empty, of some length.
    marks
        Shape (k, 2). Places that shall be nodes, if a line is near.
    reach
        A mark is near a line up to this distance, in metres.
    held
        Shape (k,). Lines to whose ends others come, rather than half-way. None for no such.
    tolerance
        Ends closer than this are one node, in metres, greater than 0.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> net = build_net([LineString([(0, 0), (100, 0)]), LineString([(50, 0), (50, 60)])])
    >>> net.nodes.shape, net.ends.shape, sorted(net.degrees.tolist())
    ((4, 2), (3, 2), [1, 1, 1, 3])
    """
    given = np.asarray(lines, dtype=object)
    spots = np.zeros((0, 2)) if marks is None else np.asarray(marks, dtype=float).reshape(-1, 2)
    if not len(given):
        none = np.zeros(0, dtype=np.int64)
        return StreetNet(np.zeros((0, 2)), none.reshape(0, 2), given, none, np.full(len(spots), -1))
    cuts = _touches(given, spots, reach, tolerance)
    pieces, street = _pieces(given, cuts, tolerance)
    keep = np.zeros(len(given), dtype=bool) if held is None else held
    return _weld(pieces, np.array(street), keep, spots, reach, tolerance)


def _touches(
    lines: Geometries, marks: FloatArray, reach: float, tolerance: float
) -> list[list[float]]:
    """Distances along each line at which an end of another one, or a mark, lies on it."""
    cuts: list[list[float]] = [[] for _ in lines]
    tips = np.concatenate([shapely.get_point(lines, 0), shapely.get_point(lines, -1)])
    owner = np.tile(np.arange(len(lines)), 2)
    tree = shapely.STRtree(lines)
    k, j = tree.query(tips, predicate="dwithin", distance=tolerance)
    k, j = k[owner[k] != j], j[owner[k] != j]
    if len(marks):
        # An end nearby is meant; elsewhere a node is made.
        gap, _ = cKDTree(shapely.get_coordinates(tips)).query(marks)
        spots = shapely.points(marks[gap > reach])
        m, near = tree.query_nearest(spots, max_distance=reach, all_matches=False)
        tips = np.concatenate([tips, spots])
        k, j = np.concatenate([k, m + 2 * len(lines)]), np.concatenate([j, near])
    along = shapely.line_locate_point(lines[j], tips[k])
    for line, at in zip(j.tolist(), along.tolist()):
        cuts[line].append(at)
    return cuts


def _pieces(
    lines: Geometries, cuts: list[list[float]], tolerance: float
) -> tuple[list[FloatArray], list[int]]:
    """Cut lines at the touched places and at vertices that are used more than once."""
    shared = _shared(lines)
    pieces: list[FloatArray] = []
    street: list[int] = []
    for i, (line, at, own) in enumerate(zip(lines, cuts, shared)):
        xy = shapely.get_coordinates(line)
        parts = _cut(xy, at, own, tolerance) if at or len(own) else [xy]
        pieces += parts
        street += [i] * len(parts)
    return pieces, street


def _shared(lines: Geometries) -> list[IntArray]:
    """Inner vertices of each line, by their index, that lines have in common or use twice."""
    xy, owner = shapely.get_coordinates(lines, return_index=True)
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    pairs = cKDTree(xy).query_pairs(SAME, output_type="ndarray").reshape(-1, 2)
    # A vertex that is only repeated at once is no meeting.
    repeated = (owner[pairs[:, 0]] == owner[pairs[:, 1]]) & (np.diff(pairs)[:, 0] == 1)
    met = np.zeros(len(xy), dtype=bool)
    met[pairs[~repeated]] = True
    met[first] = False
    met[np.append(first[1:], len(xy)) - 1] = False
    at = np.flatnonzero(met)
    local = at - first[owner[at]]
    return np.split(local, np.searchsorted(owner[at], np.arange(1, len(lines))))


def _cut(xy: FloatArray, along: list[float], own: IntArray, tolerance: float) -> list[FloatArray]:
    """Cut a line at vertices and at distances along it; no piece is a mere crumb."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    kept = [0.0, float(arc[-1])]
    # Vertices first: what touches nearby is welded to them.
    for at in [*arc[own].tolist(), *sorted(along)]:
        if min(abs(at - other) for other in kept) > tolerance:
            kept.append(at)
    places = np.array(sorted(kept))
    middle = places[1:-1]
    inserted = np.column_stack([np.interp(middle, arc, xy[:, k]) for k in (0, 1)])
    on_vertex = np.abs(arc[:, None] - middle[None, :]).min(axis=1, initial=np.inf) > SAME
    on_vertex[[0, -1]] = True
    full_arc = np.concatenate([arc[on_vertex], middle])
    full = np.vstack([xy[on_vertex], inserted])
    order = np.argsort(full_arc, kind="stable")
    full, full_arc = full[order], full_arc[order]
    index = np.searchsorted(full_arc, places)
    index[0], index[-1] = 0, len(full) - 1
    return [full[a : b + 1] for a, b in zip(index[:-1], index[1:])]


def _weld(
    pieces: list[FloatArray],
    street: IntArray,
    held: BoolArray,
    marks: FloatArray,
    reach: float,
    tolerance: float,
) -> StreetNet:
    """Make one node of all ends within the tolerance of each other."""
    tips = np.array([piece[k] for piece in pieces for k in (0, -1)])
    pairs = cKDTree(tips).query_pairs(tolerance, output_type="ndarray").reshape(-1, 2)
    full = (len(tips), len(tips))
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=full)
    label = connected_components(links, directed=False)[1].astype(np.int64)
    count = np.bincount(label).astype(float)
    mean = np.column_stack([np.bincount(label, tips[:, k]) / count for k in (0, 1)])
    # One of the ends itself, so that what met exactly stays where it is.
    off = np.hypot(*(tips - mean[label]).T)
    order = np.lexsort((np.round(off, 6), ~np.repeat(held[street], 2), label))
    nodes = tips[order[np.flatnonzero(np.diff(label[order], prepend=-1))]]
    ends = label.reshape(-1, 2)
    for piece, (u, v) in zip(pieces, ends.tolist()):
        piece[0], piece[-1] = nodes[u], nodes[v]
    lines = shapely.linestrings(
        np.vstack(pieces), indices=np.repeat(np.arange(len(pieces)), [len(p) for p in pieces])
    )
    used = (ends[:, 0] != ends[:, 1]) | (shapely.length(lines) > 4 * tolerance)
    found = np.full(len(marks), -1, dtype=np.int64)
    if len(marks):
        gap, near = cKDTree(nodes).query(marks)
        found[gap <= reach + tolerance] = near[gap <= reach + tolerance]
    return StreetNet(nodes, ends[used], lines[used], street[used], found)


def overlapping(lines: Geometries) -> tuple[BoolArray, list[tuple[int, int]]]:
    """Tell which lines share a stretch with another one, or meet themselves within.

    Such lines have no place of their own in a planar graph.

    Returns
    -------
    array, list
        Shape (e,), and the pairs (i, j) with i < j; (i, i) for a line that meets itself.
    """
    wrong = ~shapely.is_simple(lines)
    pairs = [(int(i), int(i)) for i in np.flatnonzero(wrong)]
    i, j = shapely.STRtree(lines).query(lines, predicate="intersects")
    i, j = i[i < j], j[i < j]
    doubled = shapely.length(shapely.intersection(lines[i], lines[j])) > SAME
    wrong[i[doubled]] = wrong[j[doubled]] = True
    pairs += list(zip(i[doubled].tolist(), j[doubled].tolist()))
    return wrong, sorted(pairs)


def chains_of(net: StreetNet) -> list[list[int]]:
    """Join edges that meet with no third street into chains, in order along each.

    Returns
    -------
    list of list of int
        Edges with their direction: e for along the edge, ~e for against it.
    """
    incident: list[list[int]] = [[] for _ in net.nodes]
    for e, (u, v) in enumerate(net.ends.tolist()):
        incident[u].append(e)
        incident[v].append(~e)
    ends, seen = net.ends.tolist(), np.zeros(len(net.ends), dtype=bool)

    def follow(step: int) -> list[int]:
        """Go on from the far end of a directed edge until a junction or an end."""
        path: list[int] = []
        while True:
            e = step if step >= 0 else ~step
            node = ends[e][1] if step >= 0 else ends[e][0]
            back = ~step
            onward = [s for s in incident[node] if s != back]
            if len(incident[node]) != 2 or not onward:
                return path
            step = onward[0]
            e = step if step >= 0 else ~step
            if seen[e]:
                return path
            seen[e] = True
            path.append(step)

    found = []
    for e in range(len(ends)):
        if not seen[e]:
            seen[e] = True
            ahead = follow(e)
            behind = follow(~e)
            found.append([*(~s for s in behind[::-1]), e, *ahead])
    return found
