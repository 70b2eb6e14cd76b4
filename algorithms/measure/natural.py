"""Natural streets: pieces of street that follow one another in good continuity.

A natural street is what a walker takes for one street: it goes on through a junction in the piece
that turns least. The idea is that of strokes (Thomson and Richardson 1999) and of natural roads
(Jiang, Zhao and Yin 2008, "Self-organized natural roads for predicting traffic flow", whose
every-best-fit principle is used here). COINS (Tripathy et al. 2021, the form known from momepy)
differs in three ways. It cuts lines at every vertex and compares the segments next to it, whereas
here whole edges are compared over some metres, since surveyed lines wiggle; a bend within an edge
never ends a street. Where the best continuation of an end has a better one itself, COINS ends the
street; here what is left over at a junction is compared again. And COINS has no greatest turn
unless one is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry import LineString, MultiLineString

from .graph import FloatArray, IntArray, StreetGraph
from .turns import leaving

#: Streets that turn by more than this at a node end there (degrees; the usual choice).
MAX_TURN = 45.0
#: Over how much of an edge its direction at a node is measured (metres).
REACH = 15.0


@dataclass(frozen=True, eq=False)
class NaturalLines:
    """Natural streets (or roads of any other numbering) as lines, s of them.

    Attributes
    ----------
    number
        Shape (s,). Their numbers, ascending.
    lines
        Shape (s,). A LineString each; a MultiLineString where a road has branches or gaps.
    length
        Shape (s,), metres.
    segments
        Shape (s,). Number of edges.
    connectivity
        Shape (s,). Number of other streets that each one meets.
    """

    number: IntArray
    lines: npt.NDArray[np.object_]
    length: FloatArray
    segments: IntArray
    connectivity: IntArray


def natural_streets(
    graph: StreetGraph,
    max_turn: float = MAX_TURN,
    reach: float = REACH,
    max_bend: float | None = None,
) -> IntArray:
    """Give each edge the number of its natural street, longest street first.

    Parameters
    ----------
    graph
        The streets, metres.
    max_turn
        Greatest turn at a node within a natural street, degrees, 0 to 180.
    reach
        Over how much of an edge its direction at a node is measured, metres, greater than 0; a
        shorter edge counts as a whole.
    max_bend
        The same as `max_turn` at nodes where only two edges meet, or None for `max_turn` there
        too. With 180 it does not matter where a layer cuts its streets between junctions.

    Returns
    -------
    array
        Shape (e,), from 0. Of equally long streets the one that reaches further west comes first.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> from .graph import build_graph
    >>> lines = [LineString([(0, 0), (100, 0)]), LineString([(50, 0), (50, 60)])]
    >>> natural_streets(build_graph(lines)).tolist()
    [0, 0, 1]
    """
    count = len(graph.ends)
    if not count:
        return np.zeros(0, dtype=np.int64)
    partner = continuations(graph, max_turn, reach, max_bend)
    joined = np.flatnonzero(partner >= 0)
    links = coo_array(
        (np.ones(len(joined)), (joined // 2, partner[joined] // 2)), shape=(count, count)
    )
    streets, label = connected_components(links, directed=False)
    length = np.bincount(label, graph.lengths, minlength=streets)
    # Equal lengths are common in grids; places of nodes tell such streets apart in any order.
    place = np.empty(len(graph.nodes), dtype=np.int64)
    place[np.lexsort((graph.nodes[:, 1], graph.nodes[:, 0]))] = np.arange(len(place))
    west, total = np.full(streets, len(place)), np.zeros(streets, dtype=np.int64)
    for at in place[graph.ends].T:
        np.minimum.at(west, label, at)
        np.add.at(total, label, at * at)
    order = np.lexsort((total, west, -np.round(length, 6)))
    rank = np.empty(streets, dtype=np.int64)
    rank[order] = np.arange(streets)
    return np.asarray(rank[label], dtype=np.int64)


def continuations(
    graph: StreetGraph,
    max_turn: float = MAX_TURN,
    reach: float = REACH,
    max_bend: float | None = None,
    within: IntArray | None = None,
) -> IntArray:
    """Find how streets go on at nodes: every best fit first (Jiang et al. 2008).

    Of all pairs of ends at a node the one that turns least is joined, then the one that turns
    least among the ends that are left. Of equal turns the one of the longer edges comes first.

    Parameters
    ----------
    graph, max_turn, reach, max_bend
        See `natural_streets`.
    within
        Shape (e,). Join edges only where these numbers are equal; None for everywhere.

    Returns
    -------
    array
        Shape (2e,). End 2k is the start of edge k, end 2k + 1 its end: the end that each one goes
        on in, or -1. A ring may go on in itself.
    """
    node = graph.ends.ravel()
    partner = np.full(len(node), -1, dtype=np.int64)
    one, other = _pairs_at(node)
    if within is not None:
        same = within[one // 2] == within[other // 2]
        one, other = one[same], other[same]
    if not len(one):
        return partner
    away = _directions(graph, reach)
    a, b = away[one], away[other]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    turn = np.degrees(np.arctan2(np.abs(cross), -(a * b).sum(axis=1)))
    turn = np.round(turn, 6)  # so that rounding does not choose between equal turns
    bend = graph.degrees[node[one]] == 2
    keep = turn <= np.where(bend, max_turn if max_bend is None else max_bend, max_turn)
    one, other, turn = one[keep], other[keep], turn[keep]
    size = np.round(graph.lengths[one // 2] + graph.lengths[other // 2], 6)
    azimuth = np.round(np.degrees(np.arctan2(away[:, 0], away[:, 1])), 6) % 360
    first, second = np.sort([azimuth[one], azimuth[other]], axis=0)
    order = np.lexsort((second, first, -size, turn))
    one, other = one[order], other[order]
    while len(one):
        # Pairs are in order of preference: each end prefers the first that it is in.
        best = np.full(len(node), -1, dtype=np.int64)
        at = np.arange(len(one))[::-1]
        best[np.column_stack([one, other])[::-1].ravel()] = np.repeat(at, 2)
        both = (best[one] == best[other]) & (best[one] == np.arange(len(one)))
        partner[one[both]], partner[other[both]] = other[both], one[both]
        left = (partner[one] < 0) & (partner[other] < 0)
        one, other = one[left], other[left]
    return partner


def natural_lines(graph: StreetGraph, label: IntArray) -> NaturalLines:
    """Merge the edges of each natural street into one line.

    Parameters
    ----------
    graph
        The streets.
    label
        Shape (e,). Number of the street of each edge, as of `natural_streets`; or any other
        numbering, as by name or by the roads of a grammar.
    """
    number, label = np.unique(label, return_inverse=True)
    count = len(number)
    parts = _walks(graph, label)
    lines = np.empty(count, dtype=object)
    for k, own in enumerate(parts):
        lines[k] = LineString(own[0]) if len(own) == 1 else MultiLineString(own)
    met = np.unique(meetings(graph.ends, label), axis=0)
    return NaturalLines(
        number,
        lines,
        np.bincount(label, graph.lengths, minlength=count).astype(float),
        np.bincount(label, minlength=count).astype(np.int64),
        np.bincount(met.ravel(), minlength=count).astype(np.int64),
    )


def meetings(ends: IntArray, label: IntArray) -> IntArray:
    """List which streets meet, once for each node where they do.

    Parameters
    ----------
    ends
        Shape (e, 2). Nodes of the edges.
    label
        Shape (e,). Number of the street of each edge.

    Returns
    -------
    array
        Shape (k, 2). Two different numbers of streets, the smaller one first; in order.
    """
    if not len(ends):
        return np.zeros((0, 2), dtype=np.int64)
    there = np.unique(np.column_stack([ends.ravel(), np.repeat(label, 2)]), axis=0)
    one, other = _pairs_at(there[:, 0])
    pairs = np.sort(np.column_stack([there[one, 1], there[other, 1]]), axis=1)
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], dtype=np.int64)


def _pairs_at(node: IntArray) -> tuple[IntArray, IntArray]:
    """All pairs of positions that have the same node."""
    order = np.argsort(node, kind="stable")
    _, starts, counts = np.unique(node[order], return_index=True, return_counts=True)
    ones, others = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for many in np.unique(counts[counts > 1]).tolist():
        block = order[starts[counts == many][:, None] + np.arange(many)]
        i, j = np.triu_indices(many, 1)
        ones.append(block[:, i].ravel())
        others.append(block[:, j].ravel())
    return np.concatenate(ones), np.concatenate(others)


def _directions(graph: StreetGraph, reach: float) -> FloatArray:
    """Vectors in which edges leave their ends, shape (2e, 2), in the order of the ends."""
    away = leaving(graph.lines, reach)
    # The whole of a small ring leads nowhere; a quarter of it shows how it leaves.
    small = (graph.ends[:, 0] == graph.ends[:, 1]) & (graph.lengths < 4 * reach)
    for e in np.flatnonzero(small).tolist():
        away[e] = leaving([graph.lines[e]], graph.lines[e].length / 4)[0]
    return away.reshape(-1, 2)


def _walks(graph: StreetGraph, label: IntArray) -> list[list[Any]]:
    """Walk along each street: the vertices of its parts, one unless it has branches or gaps."""
    partner = continuations(graph, 180.0, within=label).tolist()
    xy, index = shapely.get_coordinates(np.array(graph.lines, dtype=object), return_index=True)
    vertices = np.split(xy, np.flatnonzero(np.diff(index)) + 1)
    found: list[list[Any]] = [[] for _ in range(int(label.max(initial=-1)) + 1)]
    done = np.zeros(len(label), dtype=bool)
    # First what has a free end, then what is left: rings.
    open_ends = [k for k, other in enumerate(partner) if other < 0]
    for start in [*open_ends, *range(0, len(partner), 2)]:
        if done[start // 2]:
            continue
        points: list[Any] = []
        end = start
        while end >= 0 and not done[end // 2]:
            done[end // 2] = True
            own = vertices[end // 2]
            points.append((own if end % 2 == 0 else own[::-1])[1 if points else 0 :])
            end = partner[end ^ 1]
        found[int(label[start // 2])].append(np.concatenate(points))
    return found
