"""Edges that follow one another, as the lines that they make together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from ..types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Chains:
    """Runs of edges, c of them.

    Attributes
    ----------
    nodes
        Nodes of all chains, one chain after the other, each in its order.
    owner
        Chain of each entry of `nodes`.
    ends
        Shape (c, 2). First and last node of each chain; equal for a ring.
    first
        Shape (c,). An edge of each chain: its first.
    of_edge
        Shape (e,). Chain of each edge.
    """

    nodes: IntArray
    owner: IntArray
    ends: IntArray
    first: IntArray
    of_edge: IntArray

    def lines(self, xy: FloatArray) -> npt.NDArray[np.object_]:
        """Draw the chains, shape (c,).

        Parameters
        ----------
        xy
            Shape (n, 2). Positions of the nodes.
        """
        if not len(self.first):
            return np.zeros(0, dtype=object)
        return np.asarray(shapely.linestrings(xy[self.nodes], indices=self.owner), dtype=object)


def chains(ends: IntArray, passing: BoolArray) -> Chains:
    """Join edges through nodes where exactly two edges meet.

    All chains are followed at the same time, so that the work is in arrays. A chain runs in the
    direction of its first edge where its two ends do not agree. It is numbered by that edge.

    Parameters
    ----------
    ends
        Shape (e, 2). Nodes at the start and the end of each edge.
    passing
        Shape (n,). Where chains go on; nodes with another number of edges than two end them
        nevertheless.
    """
    count = len(ends)
    following = _following(ends, passing)
    before = np.full(2 * count, -1)
    went_on = np.flatnonzero(following >= 0)
    before[following[went_on]] = went_on
    done = np.zeros(count, dtype=bool)
    heads = np.flatnonzero(before < 0)
    runs = [_follow(following, heads)] if len(heads) else []
    if runs:
        done[runs[0][0] >> 1] = True
    # what is left are rings that meet nothing; each begins with its first edge
    rings = _ring_heads(following, np.flatnonzero(~done))
    if len(rings):
        runs.append(_follow(following, rings))
    return _numbered(runs, ends, count)


def _following(ends: IntArray, passing: BoolArray) -> IntArray:
    """Give the half-edge after each half-edge, shape (2e,); -1 where its chain ends.

    Half-edge 2k runs along edge k, half-edge 2k + 1 against it.
    """
    leaves = ends.ravel()
    order = np.argsort(leaves, kind="stable")
    degrees = np.bincount(leaves, minlength=len(passing))
    through = passing & (degrees == 2)
    begin = np.cumsum(degrees) - degrees
    pairs = begin[through]
    one, other = order[pairs], order[pairs + 1]
    found = np.full(2 * len(ends), -1, dtype=np.int64)
    # whoever arrives against the one half-edge goes on along the other
    found[one ^ 1], found[other ^ 1] = other, one
    return found


def _follow(following: IntArray, heads: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Follow chains from their first half-edges: half-edges, their chains, their places."""
    halves, owners, places = [heads], [np.arange(len(heads))], [np.zeros(len(heads), np.int64)]
    here, owner = heads, owners[0]
    while len(here):
        after = following[here]
        on = (after >= 0) & (after != heads[owner])
        here, owner = after[on], owner[on]
        halves.append(here)
        owners.append(owner)
        places.append(np.full(len(here), len(places)))
    return np.concatenate(halves), np.concatenate(owners), np.concatenate(places)


def _ring_heads(following: IntArray, edges: IntArray) -> IntArray:
    """Choose one half-edge of each ring: that along its first edge."""
    least = 2 * edges
    jump = following.copy()
    name = np.arange(len(following))
    # after k rounds each half-edge knows the least of the 2^k that follow it
    for _ in range(int(np.ceil(np.log2(max(len(edges), 1)))) + 1 if len(edges) else 0):
        both = np.r_[least, least + 1]
        name[both] = np.minimum(name[both], name[jump[both]])
        jump[both] = jump[jump[both]]
    return np.asarray(least[name[least] == least], dtype=np.int64)


def _numbered(
    runs: list[tuple[IntArray, IntArray, IntArray]], ends: IntArray, count: int
) -> Chains:
    """Keep each chain in one direction and number them by their first edges."""
    nothing = np.zeros(0, dtype=np.int64)
    halves, names, places = [nothing], [nothing], [nothing]
    for half, owner, place in runs:
        order = np.lexsort((place, owner))
        half, owner, place = half[order], owner[order], place[order]
        first = np.flatnonzero(place == 0)
        last = np.r_[first[1:], len(owner)] - 1
        # the same chain followed from its other end begins with `tail`
        head, tail = half[first], half[last] ^ 1
        rank, other = (head & 1) * 2 * count + head, (tail & 1) * 2 * count + tail
        rows = (rank <= other)[owner]
        halves.append(half[rows])
        names.append((head >> 1)[owner[rows]])
        places.append(place[rows])
    half, name, place = (np.concatenate(k) for k in (halves, names, places))
    order = np.lexsort((place, name))
    half, place = half[order], place[order]
    start = place == 0
    owner = np.cumsum(start) - 1
    first = np.flatnonzero(start)
    last = np.r_[first[1:], len(half)][: len(first)] - 1
    leave, arrive = ends[half >> 1, half & 1], ends[half >> 1, 1 - (half & 1)]
    of_edge = np.empty(count, dtype=np.int64)
    of_edge[half >> 1] = owner
    return Chains(
        np.insert(arrive, first, leave[first]),
        np.insert(owner, first, owner[first]),
        np.column_stack([leave[first], arrive[last]]),
        half[first] >> 1,
        of_edge,
    )
