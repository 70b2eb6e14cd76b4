"""Paths of one patch grow: row after row is joined to a path or an exit, whichever costs less.

RZ section 4.2: paths among groups share the optimal exits. Each row's way is the least-cost one
(`layered`, the same as A* to every exit, RZ Table 2) to the street or to what has grown so far.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from ..types import Floats, Ints
from .lane import Lane
from .layered import Layered
from .meshwork import Exits
from .net import GROUP, ROUTE, STUB, Net
from .style import Style
from .terminals import Terminal

#: Beside a path another one costs more by this factor, within this distance, metres.
BESIDE, BESIDE_M = 1.6, 4.5
#: An exit on the other side than the path direction asks costs more, metres.
SIDE = 10.0
#: Going straight on across a path into one on its other side is worth so much, metres.
ACROSS = 4.0
#: Along structure lines of the pattern a path costs less, by this factor.
GUIDED = 0.6
#: A loop is closed where the way round is longer than the link by this factor, and longer than
#: this, metres; links are at most so long, metres.
DETOUR, ROUND_M, LINK_M = 1.5, 50.0, 90.0
#: Paths that are joined by the street only count as this far apart, metres.
APART_M = 250.0
#: Inside or outside loops: width of the strip along the edge of the patch, metres, and what the
#: wrong side costs more.
RIM_M, RIM = 12.0, 1.5


@dataclass(eq=False)
class _Seeds:
    """States in which a terminal's ways begin, what that costs, and the step to them."""

    state: Ints
    cost: Floats
    foot: Floats  # where the step leaves the spine or the stub, shape (k, 2)


class Grower:
    """Grows the paths of a patch on a grid.

    Parameters
    ----------
    lane
        The patch with its buildings.
    graph
        States of its grid.
    exits
        States that lead into the street.
    style
        Of the path pattern.
    step_m
        Largest distance of rows and columns, metres.
    net
        What has grown so far.
    watch
        Called between searches; raises where the caller wants to stop.
    """

    def __init__(
        self,
        lane: Lane,
        graph: Layered,
        exits: Exits,
        style: Style,
        step_m: float,
        net: Net,
        watch: Callable[[], None],
    ) -> None:
        self.lane, self.graph, self.exits, self.style = lane, graph, exits, style
        self.step_m, self.net, self.watch = step_m, net, watch
        states = 2 * len(graph.at)
        #: What ending in a state costs, and where: an exit or a point on a path.
        self._join = np.full(states, np.inf)
        self._known: set[tuple[int, int]] = set()
        #: Of edges that can be joined: nodes from which, and the share along the edge.
        self._spots: dict[tuple[int, int], tuple[Ints, Floats]] = {}
        self._far: dict[int, float] = {}

    # -- growing ---------------------------------------------------------------------------

    def prepare(
        self, terminals: Sequence[Terminal], guides: Sequence[Floats], inside: bool | None
    ) -> None:
        """Draw rows' own paths, and make ground cheaper or dearer as the pattern wants.

        Parameters
        ----------
        terminals
            Rows and single buildings.
        guides
            Structure lines, shape (k, 2) each.
        inside
            Whether loops run inside (True) or outside (False), None for no wish.
        """
        factor = self.graph.factor
        if inside is not None and len(factor):
            rim = shapely.distance(shapely.points(self.graph.at), self.lane.polygon.boundary)
            wrong = (rim < RIM_M) if inside else (rim > RIM_M)
            factor[wrong] *= RIM
        for guide in guides:
            node, _ = self._near(guide[0], guide[-1], 0.75 * self.step_m)
            factor[node] *= GUIDED
        for t in terminals:
            if t.spine is not None:
                self.net.add(t.spine, GROUP)
                self._crowd(t.spine[0], t.spine[1])
            for stub in t.stubs:
                ids = self.net.add(stub, STUB)
                if t.out is not None:
                    self.net.exits.append(ids[-1])
        self.graph.weigh()
        self._renew()

    def grow(self, terminals: Sequence[Terminal], ahead: Sequence[Floats]) -> None:
        """Connect terminals, nearest (or furthest) first.

        Parameters
        ----------
        terminals
            Those to connect.
        ahead
            Of each, the side on which it likes its exit, unit vectors.
        """
        field, _ = self.graph.search(self.exits.state, self.exits.cost + self.style.exit)
        seeds = [self._seeds(t) for t in terminals]
        price = [
            float((field[s.state] + s.cost).min()) if len(s.state) else math.inf for s in seeds
        ]
        order = sorted(
            range(len(terminals)),
            key=lambda k: (-price[k] if self.style.far_first else price[k], k),
        )
        for k in order:
            self.watch()
            if not math.isinf(price[k]) and not self.connected(terminals[k]):
                self._connect(terminals[k], seeds[k], ahead[k], price[k])

    def connected(self, terminal: Terminal) -> bool:
        """Tell whether all entrances of a terminal have a way out by now."""
        return all(self.net.node(stub[0]) in self._far for stub in terminal.stubs)

    def _connect(self, terminal: Terminal, seeds: _Seeds, ahead: Floats, price: float) -> None:
        """Find the least-cost way of a terminal and add it."""
        centre = np.mean([stub[0] for stub in terminal.stubs], axis=0)
        behind = (self.exits.point - centre) @ ahead < 0
        ends = self._join.copy()
        leave = self.exits.cost + self.style.exit + SIDE * behind
        np.minimum.at(ends, self.exits.state, leave)
        for limit in (1.3 * price + SIDE, math.inf):
            cost, before = self.graph.search(seeds.state, seeds.cost, limit)
            total = cost + ends
            best = int(np.argmin(total))
            if math.isfinite(total[best]):
                break
        else:
            return
        states = self.graph.trace(before, best)
        nodes = self.graph.at[np.asarray(states) // 2]
        foot = seeds.foot[int(np.flatnonzero(seeds.state == states[0])[0])]
        if self._join[best] <= ends[best]:
            self._add([foot[None], nodes, self._meeting(nodes[-1])[None]], out=False)
        else:
            where = self.exits.point[int(np.searchsorted(self.exits.state, best))]
            self._add([foot[None], nodes, where[None]], out=True)

    def _add(self, parts: list[Floats], *, out: bool) -> None:
        """Add a way to the net and take note of it."""
        ids = self.net.add(corners_of(np.concatenate(parts)), ROUTE)
        if out and ids[-1] not in self.net.exits:
            self.net.exits.append(ids[-1])
        self._renew()

    # -- what has grown --------------------------------------------------------------------

    def _renew(self) -> None:
        """Take note of what is connected now: nodes on it can be joined, beside it is dear."""
        self._far, _ = self.net.ways(self.net.exits)
        points = self.net.points
        fresh = [
            e for e in self.net.edges
            if e not in self._known and e[0] in self._far and e[1] in self._far
        ]  # fmt: skip
        for i, j in fresh:
            self._known.add((i, j))
            if self._step_out(i, j):
                continue
            a, b = np.asarray(points[i]), np.asarray(points[j])
            self._crowd(a, b)
            node, t = self._spots[i, j] = self._on(a, b)
            length = math.dist(a, b)
            left = np.minimum(self._far[i] + t * length, self._far[j] + (1 - t) * length)
            axis = 0 if abs(b[0] - a[0]) >= abs(b[1] - a[1]) else 1
            bend = self.graph.prices.turn
            for state, cost in ((2 * node + axis, left), (2 * node + 1 - axis, left + bend)):
                self._join[state] = np.minimum(self._join[state], self.style.way * cost)
        for i, j in fresh:
            if self.net.edges[i, j] == ROUTE:
                self._invite(np.asarray(points[i]), np.asarray(points[j]))
        if fresh:
            self.graph.weigh()

    def _step_out(self, i: int, j: int) -> bool:
        """Tell whether an edge is a step from a door into the street, which nobody else joins."""
        return self.net.edges[i, j] == STUB and (i in self.net.exits or j in self.net.exits)

    def _invite(self, a: Floats, b: Floats) -> None:
        """Make joining cheaper where one goes straight on into a way that begins or ends."""
        axis = 0 if abs(b[0] - a[0]) >= abs(b[1] - a[1]) else 1
        for end in (a, b):
            node, _ = self._near(end, end, 0.02)
            self._join[2 * node + axis] -= ACROSS

    def _crowd(self, a: Floats, b: Floats) -> None:
        """Make the ground beside a path dearer."""
        node, far = self._near(a, b, BESIDE_M)
        beside = node[far > 0.05]
        self.graph.factor[beside] = np.maximum(self.graph.factor[beside], BESIDE)

    def _near(self, a: Floats, b: Floats, reach: float) -> tuple[Ints, Floats]:
        """Give the nodes near a straight piece and their distances from it, metres."""
        ground = self.graph.ground
        low, high = np.minimum(a, b) - reach, np.maximum(a, b) + reach
        c0, c1 = np.searchsorted(ground.xs, [low[0], high[0]])
        r0, r1 = np.searchsorted(ground.ys, [low[1], high[1]])
        node = self.graph.number[r0:r1, c0:c1].ravel()
        node = node[node >= 0]
        far = np.hypot(*(self.graph.at[node] - _feet(self.graph.at[node], a, b)).T)
        return node[far <= reach], far[far <= reach]

    def _on(self, a: Floats, b: Floats) -> tuple[Ints, Floats]:
        """Give the nodes from which a straight piece is joined, and the share along it."""
        node, _ = self._near(a, b, 0.02)
        if len(node) < 2:  # it runs between rows and columns
            node, _ = self._near(a, b, 0.75 * self.step_m)
        length = max(math.dist(a, b), 1e-9)
        t = np.clip(((self.graph.at[node] - a) @ (b - a)) / length**2, 0.0, 1.0)
        return node, t

    def _meeting(self, point: Floats) -> Floats:
        """Give the nearest point on what is connected."""
        pairs = np.asarray([e for e in sorted(self.net.edges) if e in self._spots])
        at = np.asarray(self.net.points)
        feet = _feet(point[None], at[pairs[:, 0]], at[pairs[:, 1]])
        return np.asarray(feet[int(np.argmin(np.hypot(*(feet - point).T)))])

    def _seeds(self, terminal: Terminal) -> _Seeds:
        """Give the states in which the ways of a terminal begin."""
        if terminal.out is not None:
            return _Seeds(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 2)))
        line = terminal.stubs[0][[1, 1]] if terminal.spine is None else terminal.spine
        node, far = self._near(line[0], line[1], 0.02)
        if not len(node):
            node, far = self._near(line[0], line[1], 1.6 * self.step_m)
        if not len(node) or far.max() > 0.02:
            feet = _feet(self.graph.at[node], line[0], line[1])
            seen = np.array(
                [self.lane.allows(np.array(pair)) for pair in zip(feet, self.graph.at[node])],
                dtype=bool,
            )
            node, far = node[seen], far[seen]
        if self.style.loops and terminal.spine is not None and len(node):
            # Ways that leave at the ends make loops round the buildings.
            tips = [np.hypot(*(self.graph.at[node] - tip).T) for tip in terminal.tips]
            end = np.min(tips, axis=0) < self.step_m
            if end.any():
                node, far = node[end], far[end]
        feet = _feet(self.graph.at[node], line[0], line[1])
        own = np.array([stub[1] for stub in terminal.stubs])
        within = np.abs(feet[:, None, :] - own[None]).sum(axis=2).mean(axis=1)
        if terminal.spine is None:
            axis = int(np.argmax(np.abs(terminal.outward)))
        else:
            axis = int(np.argmax(np.abs(terminal.spine[1] - terminal.spine[0])))
        cost = far + self.style.way * (0.0 if terminal.spine is None else 1.0) * within
        both = far > 0.02
        state = np.r_[2 * node + axis, 2 * node[both] + 1 - axis]
        bend = np.full(int(both.sum()), self.graph.prices.turn / 2)
        return _Seeds(state, np.r_[cost, cost[both] + bend], np.r_[feet, feet[both]])

    # -- loops -----------------------------------------------------------------------------

    def close_loops(self, terminals: Sequence[Terminal]) -> None:
        """Join ends to loops (path pattern 1) where the way round is long.

        Parameters
        ----------
        terminals
            Rows and single buildings; the ends of their paths are joined.
        """
        for terminal in terminals:
            for tip in terminal.tips:
                self.watch()
                start = self.net.node(tip)
                if start in self._far and terminal.out is None:
                    self._close(start)

    def _close(self, start: int) -> None:
        """Add the link from an end that shortens the way round most, if any is worth it."""
        point = np.asarray(self.net.points[start])
        node, _ = self._near(point, point, 0.02)
        if not len(node):
            node, _ = self._near(point, point, 1.1 * self.step_m)
        if not len(node):
            return
        states = np.r_[2 * node, 2 * node + 1]
        cost, before = self.graph.search(states, np.zeros(len(states)), LINK_M)
        around, _ = self.net.ways([start])
        spots = [(e, *self._spots[e]) for e in sorted(self.net.edges) if e in self._spots]
        if not spots:
            return
        size = [len(node) for _, node, _ in spots]
        near, t = (np.concatenate([spot[k] for spot in spots]) for k in (1, 2))
        edge = np.repeat(np.array([e for e, _, _ in spots]), size, axis=0)
        at = np.asarray(self.net.points)
        length = np.hypot(*(at[edge[:, 1]] - at[edge[:, 0]]).T)
        # Ways that meet in the street only count as far round.
        far = np.array([around.get(i, APART_M) for i in range(len(at))])
        trip = np.minimum(far[edge[:, 0]] + t * length, far[edge[:, 1]] + (1 - t) * length)
        state = np.concatenate([2 * near, 2 * near + 1])
        trip = np.tile(trip, 2)
        worth = np.where(trip > ROUND_M, trip / (cost[state] + 10.0), 0.0)
        if not len(worth) or worth.max() < DETOUR:
            return
        best = int(state[int(np.argmax(worth))])
        nodes = self.graph.at[np.asarray(self.graph.trace(before, best)) // 2]
        self._add([point[None], nodes, self._meeting(nodes[-1])[None]], out=False)


def _feet(points: Floats, a: Floats, b: Floats) -> Floats:
    """Give the points of straight pieces nearest to points, shape (n, 2)."""
    step = b - a
    square = np.maximum((step * step).sum(axis=-1), 1e-12)
    t = np.clip(((points - a) * step).sum(axis=-1) / square, 0.0, 1.0)
    return np.asarray(a + t[..., None] * step)


def corners_of(line: Floats) -> Floats:
    """Drop points of a line that repeat the one before or lie straight between neighbours.

    Parameters
    ----------
    line
        Shape (k, 2), metres.
    """
    step = np.hypot(*np.diff(line, axis=0).T)
    line = line[np.r_[True, step > 1e-6]]
    if len(line) < 3:
        return line
    a, b = np.diff(line[:-1], axis=0), np.diff(line[1:], axis=0)
    turn: npt.NDArray[np.float64] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    bent = np.abs(turn) > 1e-6 * np.hypot(*a.T) * np.hypot(*b.T)
    back = (a * b).sum(axis=1) < 0
    return np.asarray(line[np.r_[True, bent | back, True]])
