"""The paths of a patch while they grow: a plane graph whose lines are cut where they meet."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable

import numpy as np

from ..types import Floats

#: Points closer than this are one, metres.
SNAP_M = 0.05
#: What a piece was made for: to an entrance, along a group, or as a way out.
STUB, GROUP, ROUTE = 0, 1, 2


class Net:
    """Nodes and straight edges; no two edges cross or overlap.

    Attributes
    ----------
    points
        Coordinates of the nodes, metres.
    edges
        Pairs of nodes (smaller first) and what each was made for.
    exits
        Nodes on the edge of street space.
    """

    def __init__(self) -> None:
        self.points: list[tuple[float, float]] = []
        self.edges: dict[tuple[int, int], int] = {}
        self.exits: list[int] = []

    def add(self, line: Floats, kind: int) -> list[int]:
        """Add a line, cutting it and what it meets.

        Parameters
        ----------
        line
            Shape (k, 2), metres.
        kind
            What it is made for; where it lies on another line that one's kind stays.

        Returns
        -------
        list of int
            The nodes along it.
        """
        ids = [self.node(line[0])]
        for a, b in zip(line[:-1], line[1:]):
            if math.dist(a, b) < SNAP_M:
                continue
            ids.extend(self._segment(np.asarray(a), np.asarray(b), kind)[1:])
        return ids

    def node(self, point: Floats) -> int:
        """Give the node at a point, new or old; an edge that the point lies on is cut."""
        if self.points:
            at = np.asarray(self.points)
            far = np.hypot(at[:, 0] - point[0], at[:, 1] - point[1])
            nearest = int(np.argmin(far))
            if far[nearest] < SNAP_M:
                return nearest
        new = len(self.points)
        on = self._edges_at(point)
        self.points.append((float(point[0]), float(point[1])))
        for edge in on:
            self._cut(edge, new)
        return new

    def _cut(self, edge: tuple[int, int], node: int) -> None:
        kind = self.edges.pop(edge)
        for end in edge:
            if end != node:
                self.edges.setdefault((min(end, node), max(end, node)), kind)

    def _edges_at(self, point: Floats) -> list[tuple[int, int]]:
        """Return the edges that a point lies on."""
        if not self.edges:
            return []
        keys = list(self.edges)
        at = np.asarray(self.points)
        pairs = np.asarray(keys)
        a, b = at[pairs[:, 0]], at[pairs[:, 1]]
        ab = b - a
        t = ((point - a) * ab).sum(axis=1) / np.maximum((ab * ab).sum(axis=1), 1e-12)
        foot = a + np.clip(t, 0.0, 1.0)[:, None] * ab
        far = np.hypot(*(foot - point).T)
        return [keys[i] for i in np.flatnonzero(far < SNAP_M)]

    def _segment(self, a: Floats, b: Floats, kind: int) -> list[int]:
        """Add one straight piece."""
        first, last = self.node(a), self.node(b)
        for point in self._crossings(a, b):
            self.node(point)
        at = np.asarray(self.points)
        ab = b - a
        length = math.hypot(*ab)
        t = (at - a) @ ab / length
        off = np.abs((at - a) @ np.array([-ab[1], ab[0]])) / length
        on = np.flatnonzero((off < SNAP_M) & (t > 0) & (t < length))
        inner = [int(i) for i in on[np.argsort(t[on], kind="stable")] if i not in (first, last)]
        ids = [first, *inner, last]
        for p, q in zip(ids, ids[1:]):
            if p != q:
                self.edges.setdefault((min(p, q), max(p, q)), kind)
        return ids

    def _crossings(self, a: Floats, b: Floats) -> list[Floats]:
        """Return where a piece crosses edges."""
        if not self.edges:
            return []
        at = np.asarray(self.points)
        pairs = np.asarray(list(self.edges))
        p, r = at[pairs[:, 0]], at[pairs[:, 1]] - at[pairs[:, 0]]
        d = b - a
        cross = r[:, 0] * d[1] - r[:, 1] * d[0]
        w = a - p
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (w[:, 0] * d[1] - w[:, 1] * d[0]) / cross
            s = (w[:, 0] * r[:, 1] - w[:, 1] * r[:, 0]) / cross
        met = (np.abs(cross) > 1e-9) & (t > 0) & (t < 1) & (s > 0) & (s < 1)
        return [np.asarray(p[i] + t[i] * r[i]) for i in np.flatnonzero(met)]

    def neighbours(self) -> dict[int, list[tuple[int, float]]]:
        """Give the neighbours of each node and the metres to them."""
        near: dict[int, list[tuple[int, float]]] = {i: [] for i in range(len(self.points))}
        for i, j in self.edges:
            length = math.dist(self.points[i], self.points[j])
            near[i].append((j, length))
            near[j].append((i, length))
        return near

    def ways(self, starts: Iterable[int]) -> tuple[dict[int, float], dict[int, int]]:
        """Give the metres to the nearest of some nodes and the next node towards it."""
        return nearest(self.neighbours(), starts)


def nearest(
    near: dict[int, list[tuple[int, float]]], starts: Iterable[int]
) -> tuple[dict[int, float], dict[int, int]]:
    """Give the metres from each node to the nearest of some, and the next node towards it.

    Parameters
    ----------
    near
        Neighbours of each node and the metres to them.
    starts
        The nodes to reach; nodes from which none is reached are left out of the answer.
    """
    far = dict.fromkeys(starts, 0.0)
    towards: dict[int, int] = {}
    queue = [(0.0, i) for i in sorted(far)]
    heapq.heapify(queue)
    done: set[int] = set()
    while queue:
        d, i = heapq.heappop(queue)
        if i in done:
            continue
        done.add(i)
        for j, length in near[i]:
            if d + length < far.get(j, math.inf):
                far[j] = d + length
                towards[j] = i
                heapq.heappush(queue, (d + length, j))
    return far, towards
