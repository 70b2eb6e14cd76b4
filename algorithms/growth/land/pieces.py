"""Lines become planar pieces that meet in shared nodes, and nothing moves.

Unlike `site.roadnetwork` and `measure.graph`, which weld what nearly meets, this keeps every
vertex where it is (to `SAME`): streets that grow must leave the streets that are there alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from shapely.geometry import LineString

from ..types import BoolArray, FloatArray, IntArray

#: Points nearer than this are one (metres).
SAME = 1e-6
#: Rounds after which the search for further crossings ends; two or three are the rule.
ROUNDS = 12


@dataclass(frozen=True, eq=False)
class Pieces:
    """Straight pieces of lines, n nodes and e pieces; metres.

    Attributes
    ----------
    nodes
        Shape (n, 2).
    ends
        Shape (e, 2). Nodes of each piece, in the direction of its line.
    line
        Shape (e,). Position of the line that each is a piece of, in the order of the lines and
        along them.
    kept
        Shape (e,). False for pieces that lie on a piece of a better line.
    crossings
        Shape (c, 3). Two lines and the node where they crossed without a junction.
    """

    nodes: FloatArray
    ends: IntArray
    line: IntArray
    kept: BoolArray
    crossings: IntArray


def cut_lines(
    lines: Sequence[LineString] | npt.NDArray[Any], rank: IntArray | None = None
) -> Pieces:
    """Cut lines where they meet.

    Parameters
    ----------
    lines
        Two-dimensional lines with a length, metres; vertices may be repeated.
    rank
        Shape (k,). Of lines on top of each other the one with the lowest rank is kept; the first
        if None.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> cross = cut_lines([LineString([(0, 0), (2, 0)]), LineString([(1, -1), (1, 1)])])
    >>> len(cross.nodes), len(cross.ends), cross.crossings.tolist()
    (5, 4, [[0, 1, 4]])
    """
    xy, line = shapely.get_coordinates(np.asarray(lines, dtype=object), return_index=True)
    nodes, label = _merged(np.asarray(xy, dtype=float))
    inner = line[:-1] == line[1:]
    ends = np.column_stack([label[:-1][inner], label[1:][inner]])
    line = line[:-1][inner].astype(np.int64)
    tips = _tips(line, ends, len(nodes))
    crossings: list[IntArray] = []
    for _ in range(ROUNDS):
        some = ends[:, 0] != ends[:, 1]
        ends, line = ends[some], line[some]
        piece, node = _touching(nodes, ends)
        if len(piece):
            crossings.append(_passing(piece, node, ends, line, tips))
            ends, line = _cut(nodes, ends, line, piece, node)
            continue
        first, second, points = _crossing(nodes, ends)
        if not len(first):
            break
        fresh, label = _merged(points)
        label = label + len(nodes)
        nodes = np.vstack([nodes, fresh])
        tips = np.r_[tips, np.zeros(len(fresh), dtype=bool)]
        crossings.append(np.column_stack([line[first], line[second], label]))
        ends, line = _cut(nodes, ends, line, np.r_[first, second], np.r_[label, label])
    kept = _best(ends, line, rank)
    found = np.vstack(crossings) if crossings else np.zeros((0, 3), dtype=np.int64)
    return _compact(nodes, ends, line, kept, _real(found, ends, line, kept))


def with_points(
    nodes: FloatArray, ends: IntArray, number: IntArray, piece: IntArray, xy: FloatArray
) -> tuple[FloatArray, IntArray, IntArray, IntArray]:
    """Cut pieces at points that lie on them.

    Parameters
    ----------
    nodes, ends
        As in `Ground`.
    number
        Shape (e,). Any number that both parts of a piece inherit.
    piece
        Shape (k,). Pieces to cut.
    xy
        Shape (k, 2). Points on them, not at their ends.

    Returns
    -------
    tuple
        Nodes, ends and numbers after it, and the node of each point, shape (k,).
    """
    fresh, label = _merged(np.asarray(xy, dtype=float))
    label = label + len(nodes)
    nodes = np.vstack([nodes, fresh])
    ends, number = _cut(nodes, ends, number, piece, label)
    return nodes, ends, number, label


def _merged(xy: FloatArray) -> tuple[FloatArray, IntArray]:
    """Make one point of all that are nearer than `SAME`; the first of them stays."""
    if not len(xy):
        return xy.reshape(0, 2), np.zeros(0, dtype=np.int64)
    unique, first, label = np.unique(xy, axis=0, return_index=True, return_inverse=True)
    label = label.reshape(-1)
    pairs = cKDTree(unique).query_pairs(SAME, output_type="ndarray")
    if len(pairs):
        links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(unique), len(unique)))
        group = connected_components(links, directed=False)[1]
        least = np.full(int(group.max()) + 1, len(xy), dtype=np.int64)
        np.minimum.at(least, group, first)
        first, label = least, group[label]
    # in the order of the input, so that numbers do not hang on coordinates
    order = np.argsort(first, kind="stable")
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return xy[first[order]], place[label]


def _tips(line: IntArray, ends: IntArray, count: int) -> BoolArray:
    """Nodes where a line ends, shape (n,)."""
    tips = np.zeros(count, dtype=bool)
    if len(line):
        turn = np.flatnonzero(np.diff(line)) + 1
        tips[ends[np.r_[0, turn], 0]] = True
        tips[ends[np.r_[turn - 1, len(line) - 1], 1]] = True
    return tips


def _touching(nodes: FloatArray, ends: IntArray) -> tuple[IntArray, IntArray]:
    """Pieces, and nodes that lie on them but are none of their ends."""
    if not len(ends):
        none = np.zeros(0, dtype=np.int64)
        return none, none
    tree = shapely.STRtree(shapely.linestrings(nodes[ends]))
    node, piece = tree.query(shapely.points(nodes), predicate="dwithin", distance=SAME)
    own = (ends[piece] == node[:, None]).any(axis=1)
    return piece[~own], node[~own]


def _crossing(nodes: FloatArray, ends: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Pairs of pieces that cross between their ends, and where."""
    if not len(ends):
        none = np.zeros(0, dtype=np.int64)
        return none, none, np.zeros((0, 2))
    lines = shapely.linestrings(nodes[ends])
    first, second = shapely.STRtree(lines).query(lines, predicate="intersects")
    some = first < second
    first, second = first[some], second[some]
    shared = (ends[first][:, :, None] == ends[second][:, None, :]).any(axis=(1, 2))
    first, second = first[~shared], second[~shared]
    a, b = nodes[ends[first, 0]], nodes[ends[second, 0]]
    u, v = nodes[ends[first, 1]] - a, nodes[ends[second, 1]] - b
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    gap = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[:, 0] * v[:, 1] - gap[:, 1] * v[:, 0]) / area
        s = (gap[:, 0] * u[:, 1] - gap[:, 1] * u[:, 0]) / area
        hit = (t > 0) & (t < 1) & (s > 0) & (s < 1)
    return first[hit], second[hit], (a + t[:, None] * u)[hit]


def _passing(
    piece: IntArray, node: IntArray, ends: IntArray, line: IntArray, tips: BoolArray
) -> IntArray:
    """Lines that pass through a node on a piece of another line, shape (k, 3)."""
    order = np.argsort(ends[:, 0], kind="stable")
    at = np.searchsorted(ends[order, 0], node)
    other = order[np.minimum(at, len(order) - 1)]
    inside = ~tips[node] & (ends[other, 0] == node)
    return np.asarray(np.column_stack([line[other], line[piece], node])[inside])


def _cut(
    nodes: FloatArray, ends: IntArray, line: IntArray, piece: IntArray, node: IntArray
) -> tuple[IntArray, IntArray]:
    """Cut pieces at nodes that lie on them."""
    a, b = nodes[ends[piece, 0]], nodes[ends[piece, 1]]
    along = ((nodes[node] - a) * (b - a)).sum(axis=1)
    order = np.lexsort((along, piece))
    piece, node = piece[order], node[order]
    fresh = np.ones(len(piece), dtype=bool)
    fresh[1:] = (piece[1:] != piece[:-1]) | (node[1:] != node[:-1])
    piece, node = piece[fresh], node[fresh]
    owner = np.concatenate([np.arange(len(ends)), piece])
    rank = np.concatenate([np.zeros(len(ends), dtype=np.int64), np.arange(1, len(piece) + 1)])
    order = np.lexsort((rank, owner))
    start = np.concatenate([ends[:, 0], node])[order]
    owner = owner[order]
    last = np.ones(len(owner), dtype=bool)
    last[:-1] = owner[1:] != owner[:-1]
    stop = np.where(last, ends[owner, 1], np.roll(start, -1))
    return np.column_stack([start, stop]), line[owner]


def _best(ends: IntArray, line: IntArray, rank: IntArray | None) -> BoolArray:
    """Tell which pieces lie on no piece of a better line, shape (e,)."""
    own = line if rank is None else rank[line]
    low, high = ends.min(axis=1), ends.max(axis=1)
    order = np.lexsort((own, high, low))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    kept = np.zeros(len(ends), dtype=bool)
    kept[order[first]] = True
    return kept


def _real(crossings: IntArray, ends: IntArray, line: IntArray, kept: BoolArray) -> IntArray:
    """Leave out crossings of lines that lie on top of each other there."""
    pairs = np.sort(crossings[:, :2], axis=1)
    crossings = np.unique(np.column_stack([pairs, crossings[:, 2]]), axis=0)
    if kept.all():
        return crossings
    doubled = {(int(k), int(n)) for k, pair in zip(line[~kept], ends[~kept]) for n in pair}
    real = [(i, n) not in doubled and (j, n) not in doubled for i, j, n in crossings.tolist()]
    return np.asarray(crossings[np.array(real, dtype=bool)])


def _compact(
    nodes: FloatArray, ends: IntArray, line: IntArray, kept: BoolArray, crossings: IntArray
) -> Pieces:
    """Leave out nodes without a piece."""
    used = np.zeros(len(nodes), dtype=bool)
    used[ends.ravel()] = True
    number = np.cumsum(used) - 1
    crossings = crossings[used[crossings[:, 2]]].astype(np.int64)
    crossings[:, 2] = number[crossings[:, 2]]
    return Pieces(nodes[used], number[ends].astype(np.int64), line, kept, crossings)
