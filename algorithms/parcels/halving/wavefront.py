"""Straight skeletons: the outline moves inwards at one speed, and its corners draw the faces.

After O. Aichholzer, F. Aurenhammer, D. Alberts and B. Gärtner, "A novel type of skeleton for
polygons", Journal of Universal Computer Science 1 (1995). The front is advanced event by event
with all times worked out anew at each, by arrays: quadratic per event, and hard to upset.
Whoever uses the result should check it (`halving.faces` does): one face per edge, faces tile.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
#: Places nearer than this are one node (metres).
SAME = 1e-6
#: Directions whose cross product is below this are parallel.
PARALLEL = 1e-9


class SkeletonError(Exception):
    """The front of an outline could not be followed to its end."""


@dataclass
class Skeleton:
    """Arcs that the corners of the front have drawn.

    Attributes
    ----------
    nodes
        Places: the vertices of the outline, ring after ring, then those of the skeleton; metres.
    arcs
        (start, end, edge on the left, edge on the right) by node and edge; edge i of a ring
        begins at its vertex i, edges are numbered as the vertices are.
    front
        Where the front was stopped, its pieces: (node, node, edge); empty if it ran to the end.
    reach
        How far the front went, metres: the greatest distance of a place from the outline where
        it ran to the end.
    """

    nodes: list[tuple[float, float]]
    arcs: list[tuple[int, int, int, int]] = field(default_factory=list)
    front: list[tuple[int, int, int]] = field(default_factory=list)
    reach: float = 0.0


def straight_skeleton(rings: Sequence[Floats], until: float = math.inf) -> Skeleton:
    """Let the outline of a polygon move inwards.

    Parameters
    ----------
    rings
        Exterior, counter-clockwise, then holes, clockwise: shapes (n, 2), not closed; metres,
        near the origin. No edge may have length 0.
    until
        Distance at which to stop, metres.

    Raises
    ------
    SkeletonError
        If the front does not come to an end, which only degenerate outlines cause.
    """
    return _Front(rings).run(until)


class _Front:
    """The moving outline: vertices in closed lists, each between two edges."""

    def __init__(self, rings: Sequence[Floats]) -> None:
        xy = np.vstack(rings)
        self.out = Skeleton([(x, y) for x, y in xy.tolist()])
        count = len(xy)
        room = 8 * count + 16
        self.place = np.zeros((room, 2))
        self.speed = np.zeros((room, 2))
        self.node = np.zeros(room, dtype=int)
        self.left, self.right = np.zeros(room, dtype=int), np.zeros(room, dtype=int)
        self.prev, self.next = np.zeros(room, dtype=int), np.zeros(room, dtype=int)
        self.live = np.zeros(room, dtype=bool)
        self.reflex = np.zeros(room, dtype=bool)
        self.count = count
        self.now = 0.0
        start = 0
        after = np.empty(count, dtype=int)
        for ring in rings:
            index = start + np.arange(len(ring))
            after[index] = np.roll(index, -1)
            start += len(ring)
        way = xy[after] - xy
        self.way = way / np.hypot(way[:, 0], way[:, 1])[:, None]
        self.normal = np.stack([-self.way[:, 1], self.way[:, 0]], axis=1)
        self.offset = (self.normal * xy).sum(axis=1)
        all_ = np.arange(count)
        self.place[all_], self.node[all_], self.live[all_] = xy, all_, True
        self.right[all_], self.left[after] = all_, all_
        self.next[all_], self.prev[after] = after, all_
        for vertex in range(count):
            self._aim(vertex)

    def _aim(self, vertex: int) -> None:
        """Work out how fast a vertex moves: both its edges move by 1 m per metre of time."""
        a, b = self.left[vertex], self.right[vertex]
        (ax, ay), (bx, by) = self.normal[a].tolist(), self.normal[b].tolist()
        turn = ax * by - ay * bx
        if abs(turn) < PARALLEL:
            # on one line they move together; against each other, the vertex stays on the ridge
            self.speed[vertex] = self.normal[a] if ax * bx + ay * by > 0 else 0.0
        else:
            self.speed[vertex] = (by - ay) / turn, (ax - bx) / turn
        self.reflex[vertex] = turn < -PARALLEL

    def run(self, until: float) -> Skeleton:
        """Advance from event to event."""
        for _ in range(6 * self.count + 20):
            active = np.flatnonzero(self.live[: self.count])
            self.out.reach = self.now
            if not len(active):
                return self.out
            time, kind, vertex, edge_at = self._soonest(active)
            if time > until:
                return self._stop(active, until)
            if not math.isfinite(time) or self.count + 4 > len(self.place):
                break
            self.place[active] += self.speed[active] * (time - self.now)
            self.now = time
            if kind == "edge":
                self._collapse(vertex)
            else:
                self._divide(vertex, edge_at)
        msg = "The moving outline does not come to an end."
        raise SkeletonError(msg)

    def _soonest(self, active: npt.NDArray[np.int_]) -> tuple[float, str, int, int]:
        """Return the next event: an edge vanishes, or a reflex vertex meets an edge."""
        ends = self.next[active]
        way = self.way[self.right[active]]
        gap = (way * (self.place[ends] - self.place[active])).sum(axis=1)
        closing = -(way * (self.speed[ends] - self.speed[active])).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            wait = np.where(closing > PARALLEL, np.maximum(gap, 0.0) / closing, np.inf)
        # ends that already met, and loops of two
        wait[(np.abs(gap) < SAME / 10) & (closing > -PARALLEL) & (self.now > 0)] = 0.0
        wait[self.next[ends] == active] = 0.0
        first = int(np.argmin(wait))
        best = (self.now + float(wait[first]), "edge", int(active[first]), -1)
        reflex = active[self.reflex[active]]
        if not len(reflex):
            return best
        edges = self.right[active]
        normal = self.normal[edges]
        place, speed = self.place[reflex], self.speed[reflex]
        towards = 1.0 - speed @ normal.T
        height = place @ normal.T - self.offset[edges] - self.now
        with np.errstate(divide="ignore", invalid="ignore"):
            wait = np.where(towards > PARALLEL, np.maximum(height, 0.0) / towards, np.inf)
        own = (edges == self.left[reflex][:, None]) | (edges == self.right[reflex][:, None])
        wait[own | (height < -SAME)] = np.inf
        wait[wait >= best[0] - self.now - SAME / 10] = np.inf
        if not np.isfinite(wait).any():
            return best
        i, j = np.nonzero(np.isfinite(wait))
        t = wait[i, j][:, None]
        hit = place[i] + speed[i] * t
        begin = self.place[active[j]] + self.speed[active[j]] * t
        end = self.place[ends[j]] + self.speed[ends[j]] * t
        along = self.way[edges[j]]
        inside = ((hit - begin) * along).sum(axis=1) > -SAME
        inside &= ((end - hit) * along).sum(axis=1) > -SAME
        if not inside.any():
            return best
        pick = int(np.argmin(np.where(inside, t[:, 0], np.inf)))
        return self.now + float(t[pick, 0]), "split", int(reflex[i[pick]]), int(active[j[pick]])

    def _at(self, vertex: int) -> int:
        """Return the node where a vertex is now, a new one unless another is there."""
        x, y = self.place[vertex].tolist()
        for node in range(len(self.out.nodes) - 1, -1, -1):
            nx, ny = self.out.nodes[node]
            if abs(nx - x) < SAME and abs(ny - y) < SAME:
                return node
        self.out.nodes.append((x, y))
        return len(self.out.nodes) - 1

    def _end(self, vertex: int, node: int) -> None:
        """Let a vertex end at a node, its way drawn."""
        self.live[vertex] = False
        if self.node[vertex] != node:
            self.out.arcs.append(
                (int(self.node[vertex]), node, int(self.left[vertex]), int(self.right[vertex]))
            )

    def _new(self, at: int, left: int, right: int, before: int, after: int) -> int:
        """Begin a vertex at a node."""
        vertex = self.count
        self.count += 1
        self.place[vertex], self.node[vertex] = self.out.nodes[at], at
        self.left[vertex], self.right[vertex] = left, right
        self.prev[vertex], self.next[vertex] = before, after
        self.next[before], self.prev[after] = vertex, vertex
        self.live[vertex] = True
        self._aim(vertex)
        return vertex

    def _collapse(self, vertex: int) -> None:
        """Let the edge after a vertex vanish."""
        other = int(self.next[vertex])
        if self.next[other] == vertex:
            # two corners with the same two edges: what is left between them is a ridge
            here, there = self._at(vertex), self._at(other)
            self._end(vertex, here)
            self._end(other, there)
            if here != there:
                self.out.arcs.append((here, there, int(self.left[vertex]), int(self.right[vertex])))
            return
        node = self._at(vertex)
        self._end(vertex, node)
        self._end(other, node)
        before, after = int(self.prev[vertex]), int(self.next[other])
        self._new(node, int(self.left[vertex]), int(self.right[other]), before, after)

    def _divide(self, vertex: int, at: int) -> None:
        """Let a reflex vertex meet the edge after the vertex `at`."""
        edge, end = int(self.right[at]), int(self.next[at])
        node = self._at(vertex)
        before, after = int(self.prev[vertex]), int(self.next[vertex])
        left, right = int(self.left[vertex]), int(self.right[vertex])
        self._end(vertex, node)
        if end == vertex or at == vertex:
            msg = "A corner meets its own edge."
            raise SkeletonError(msg)
        self._new(node, left, edge, before, end)
        self._new(node, edge, right, at, after)

    def _stop(self, active: npt.NDArray[np.int_], until: float) -> Skeleton:
        """End all ways at a distance, and note the front there."""
        self.place[active] += self.speed[active] * (until - self.now)
        self.out.reach = until
        nodes = {int(vertex): self._at(int(vertex)) for vertex in active}
        for vertex, node in nodes.items():
            other = nodes[int(self.next[vertex])]
            if other != node:
                self.out.front.append((node, other, int(self.right[vertex])))
            self._end(vertex, node)
        return self.out


def face_rings(skeleton: Skeleton, after: Sequence[int]) -> list[list[int]]:
    """Return the face of each edge as a ring of nodes, the edge first.

    Parameters
    ----------
    skeleton
        Of an outline.
    after
        For each vertex of the outline, the next one of its ring.

    Returns
    -------
    list of list of int
        Rings of nodes, counter-clockwise, one per edge.

    Raises
    ------
    SkeletonError
        If the arcs do not close around an edge.
    """
    ways: list[dict[int, list[int]]] = [{} for _ in after]
    # land lies on the left of its edge; the corner before an edge has it on its right
    for start, end, left, right in skeleton.arcs:
        for edge in (left, right):
            ways[edge].setdefault(start, []).append(end)
            ways[edge].setdefault(end, []).append(start)
    for start, end, edge in skeleton.front:
        ways[edge].setdefault(start, []).append(end)
        ways[edge].setdefault(end, []).append(start)
    found = []
    for edge, way in enumerate(ways):
        ring = [edge, after[edge]]
        size = sum(map(len, way.values())) // 2
        while ring[-1] != edge:
            ends = [node for node in way.get(ring[-1], []) if node != ring[-2]]
            if len(ends) != 1 or len(ring) > size + 2:
                msg = f"The face of edge {edge} is not closed."
                raise SkeletonError(msg)
            ring.append(ends[0])
        if len(ring) - 2 != size:
            msg = f"The face of edge {edge} is in pieces."
            raise SkeletonError(msg)
        found.append(ring[:-1])
    return found
