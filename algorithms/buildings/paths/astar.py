"""The modified A* of RZ section 4.2 for a pair of nodes, and its optimal-exit search (Table 2).

Plain and exact; `layered.Layered` gives the same costs for whole patches at once and is tested
against it.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .ground import Ground, Prices

Node = tuple[int, int]  # row, column


@dataclass(frozen=True)
class Way:
    """A way between two nodes.

    Attributes
    ----------
    nodes
        Nodes (row, column) at its ends and turns, in order.
    cost
        G = L + N + E at the given prices, metres.
    length_m
        L, metres.
    turns
        N, a number.
    """

    nodes: tuple[Node, ...]
    cost: float
    length_m: float
    turns: int


def sees(ground: Ground, a: Node, b: Node) -> bool:
    """Tell whether the straight line between two nodes passes free cells only.

    A line through a corner of cells needs both cells beside it free (RZ Fig. 5b: a path does not
    pass diagonal grids).

    Parameters
    ----------
    ground
        The grid; the cell of a node reaches half-way to its neighbours.
    a, b
        Nodes (row, column).
    """
    start = np.array([ground.xs[a[1]], ground.ys[a[0]]])
    step = np.array([ground.xs[b[1]], ground.ys[b[0]]]) - start
    cuts = [0.0, 1.0]
    for axis, at in ((0, ground.xs), (1, ground.ys)):
        if step[axis]:
            t = ((at[1:] + at[:-1]) / 2 - start[axis]) / step[axis]
            cuts.extend(float(v) for v in t[(t > 0) & (t < 1)])
    times = np.unique(np.round(cuts, 12))
    middle = start + ((times[1:] + times[:-1]) / 2)[:, None] * step
    column = np.searchsorted((ground.xs[1:] + ground.xs[:-1]) / 2, middle[:, 0])
    row = np.searchsorted((ground.ys[1:] + ground.ys[:-1]) / 2, middle[:, 1])
    if not ground.free[row, column].all():
        return False
    along, up = ground.steps(0), ground.steps(1)
    for r, c, p, q in zip(row, column, row[1:], column[1:]):
        # Through a corner, both ways round it must be possible.
        for k in {c, q} if r != p else ():
            if not up[min(r, p), k]:
                return False
        for k in {r, p} if c != q else ():
            if not along[k, min(c, q)]:
                return False
    return True


def direct(ground: Ground, a: Node, b: Node, prices: Prices) -> Way | None:
    """Give the straight way between two nodes that see each other, else None."""
    if not sees(ground, a, b):
        return None
    step = (ground.xs[b[1]] - ground.xs[a[1]], ground.ys[b[0]] - ground.ys[a[0]])
    length = math.hypot(*step)
    axis = 0 if abs(step[0]) >= abs(step[1]) else 1
    rough = (ground.rough[(axis, *a)] + ground.rough[(axis, *b)]) / 2
    return Way((a, b) if a != b else (a,), length * (1 + prices.room * rough), length, 0)


def find_way(
    ground: Ground, a: Node, b: Node, prices: Prices, *, straight_first: bool = True
) -> Way | None:
    """Find the way of least cost between two nodes (RZ section 4.2).

    Three things differ from plain A*: a straight way is taken at once where there is one, nodes
    are left by their four sides only, and turns and missing room are part of G.

    Parameters
    ----------
    ground
        The grid.
    a, b
        Nodes (row, column).
    prices
        Of turns and of missing room.
    straight_first
        Whether to test for the direct connection first.

    Returns
    -------
    Way or None
        None where no way exists.
    """
    if not (ground.free[a] and ground.free[b]):
        return None
    way = direct(ground, a, b, prices) if straight_first else None
    return way if way is not None else _search(ground, a, b, prices)


def _search(ground: Ground, a: Node, b: Node, prices: Prices) -> Way | None:
    """Run A* over (node, axis); axis 0 moves along the row, axis 1 along the column."""
    xs, ys, rough = ground.xs, ground.ys, ground.rough
    possible = ground.steps(0), ground.steps(1)

    def ahead(node: Node, axis: int) -> float:
        dx, dy = abs(xs[node[1]] - xs[b[1]]), abs(ys[node[0]] - ys[b[0]])
        bent = (dx > 0 and dy > 0) or (dx > 0 and axis == 1) or (dy > 0 and axis == 0)
        return float(dx + dy + prices.turn * bent)

    best: dict[tuple[Node, int], float] = {(a, 0): 0.0, (a, 1): 0.0}
    before: dict[tuple[Node, int], tuple[Node, int]] = {}
    queue = [(ahead(a, axis), axis, a) for axis in (0, 1)]
    heapq.heapify(queue)
    closed: set[tuple[Node, int]] = set()
    while queue:
        _, axis, node = heapq.heappop(queue)
        if (node, axis) in closed:
            continue
        if node == b:
            return _traced(ground, (node, axis), before, best[node, axis])
        closed.add((node, axis))
        g = best[node, axis]
        steps: list[tuple[Node, int, float]] = [(node, 1 - axis, prices.turn)]
        for sign in (-1, 1):
            r, c = (node[0], node[1] + sign) if axis == 0 else (node[0] + sign, node[1])
            near = min(r, node[0]), min(c, node[1])
            if 0 <= r < len(ys) and 0 <= c < len(xs) and possible[axis][near]:
                length = abs(xs[c] - xs[node[1]]) + abs(ys[r] - ys[node[0]])
                room = (rough[(axis, *node)] + rough[axis, r, c]) / 2
                steps.append(((r, c), axis, length * (1 + prices.room * room)))
        for to, way, cost in steps:
            if g + cost < best.get((to, way), math.inf):
                best[to, way] = g + cost
                before[to, way] = (node, axis)
                heapq.heappush(queue, (g + cost + ahead(to, way), way, to))
    return None


def _traced(
    ground: Ground,
    end: tuple[Node, int],
    before: dict[tuple[Node, int], tuple[Node, int]],
    cost: float,
) -> Way:
    """Follow the search back and keep ends and turns."""
    states = [end]
    while states[-1] in before:
        states.append(before[states[-1]])
    states.reverse()
    nodes = [states[0][0]]
    turns, length = 0, 0.0
    for (p, i), (q, j) in zip(states, states[1:]):
        if i != j and p not in (states[0][0], states[-1][0]):
            turns += 1
            nodes.append(p)
        length += abs(ground.xs[p[1]] - ground.xs[q[1]]) + abs(ground.ys[p[0]] - ground.ys[q[0]])
    if end[0] != nodes[-1]:
        nodes.append(end[0])
    return Way(tuple(nodes), cost, float(length), turns)


def optimal_exit(
    ground: Ground,
    start: Node,
    exits: Sequence[Node],
    prices: Prices,
    *,
    straight_first: bool = True,
) -> tuple[int, Way] | None:
    """Find the exit with the way of least cost (RZ Table 2).

    Exits are tried in the order of their straight distance. The paper stops at the first way
    without turns; here the search stops as soon as the next exit is further away than the best
    way costs, since no way is shorter than the straight line. That stops no later where the paper
    stops rightly (no turn, nothing narrow), and also where the best way has turns.

    Parameters
    ----------
    ground
        The grid.
    start
        Node before the entrance.
    exits
        Nodes at street space.
    prices
        Of turns and of missing room.
    straight_first
        As in `find_way`.

    Returns
    -------
    tuple of int and Way, or None
        Index of the exit and the way; None where no exit can be reached.
    """
    if not len(exits):
        return None
    at = np.asarray(exits)
    far = np.hypot(
        ground.xs[at[:, 1]] - ground.xs[start[1]], ground.ys[at[:, 0]] - ground.ys[start[0]]
    )
    found: tuple[int, Way] | None = None
    for j in np.argsort(far, kind="stable"):
        if found is not None and far[j] >= found[1].cost:
            break
        way = find_way(ground, start, tuple(exits[j]), prices, straight_first=straight_first)
        if way is not None and (found is None or way.cost < found[1].cost):
            found = int(j), way
    return found
