"""Directions of boundary pieces: every piece of every ring runs east, north, west or south.

The mesh of a part of a site is a lattice of unit cells, bent into place. On the lattice every
piece of the boundary runs along an axis; at a vertex of the boundary it turns by a number of
quarter turns: 1 (a corner with one quad), 0 (two), -1 (three) or -2 (four). A dynamic
programme round each ring chooses them all at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .quadmesh import BoolArray, FloatArray, IntArray
from .rings import Ring, Stations, wrap

TURNS = np.array([1, 0, -1, -2])
LARGEST_DEVIATION = 1.8
"""Quarter turns by which a piece may run off its direction."""
CANDIDATE_SPACING = 0.8
TURN_WINDOW = 0.45


@dataclass(frozen=True, eq=False)
class Labels:
    """The pieces of one ring: piece i begins at `start[i]` and ends where the next begins.

    Attributes
    ----------
    start
        Shape (p,). Arc lengths, rising; the last piece runs on to ``start[0] + length``.
    turn
        Shape (p,). Quarter turns at the start of each piece, left positive.
    direction
        Shape (p,). 0 east, 1 north, 2 west, 3 south.
    station
        Shape (p,). Index of the station at the start of a piece, -1 where none.
    """

    start: FloatArray
    turn: IntArray
    direction: IntArray
    station: IntArray

    def key(self) -> tuple[tuple[float, int, int], ...]:
        """Return what makes two labellings equal."""
        return tuple(
            (round(float(s), 6), int(t), int(d))
            for s, t, d in zip(self.start, self.turn, self.direction)
        )

    def ends(self, ring: Ring) -> FloatArray:
        """Return the arc lengths (p,) where the pieces end."""
        return np.append(self.start[1:], self.start[0] + ring.length)


def main_axis(rings: Sequence[Ring]) -> float:
    """Return the direction (radians, modulo a quarter turn) along which most boundary runs."""
    total = 0j
    for ring in rings:
        v = np.diff(ring.closed, axis=0)
        total += (np.hypot(*v.T) * np.exp(4j * np.arctan2(v[:, 1], v[:, 0]))).sum()
    return float(np.angle(total)) / 4


def label_ring(
    ring: Ring,
    stations: Stations,
    h: float,
    axis: float,
    weights: Sequence[tuple[float, float]],
    *,
    outer: bool,
) -> list[Labels | None]:
    """Choose the turns at the candidate points of a ring, once for each pair of weights.

    The cost of a turn k is (2 - k) * (a / 90 - 1)**2 with a the angle of each of its 2 - k
    quads in degrees, plus a penalty for each corner (four times where the boundary has none);
    a piece that runs off its direction by q quarter turns costs w * length / h * q**2.

    Parameters
    ----------
    ring, stations
        The ring and the points of it that become vertices.
    h
        Edge length, metres.
    axis
        Direction that counts as east, radians.
    weights
        Pairs (w, penalty per corner).
    outer
        True for the exterior ring (total turn 4), False for a hole (-4).

    Returns
    -------
    list
        Labels for each pair of weights, None where there is no solution.
    """
    arc, station = _candidates(ring, stations, h)
    m = len(arc)
    following = np.append(arc[1:], arc[0] + ring.length)
    length = (following - arc) / h
    heading = ring.heading(arc, following)
    window = np.minimum(TURN_WINDOW, 0.9 * length) * h
    turn = np.degrees(ring.turn(arc, np.roll(window, 1), window))
    unrolled = heading[0] + np.concatenate([[0.0], np.cumsum(wrap(np.diff(heading)))])
    quarter = (unrolled - axis) / (np.pi / 2)
    quads = 2 - TURNS
    angle_cost = ((180 - turn[:, None]) / quads / 90 - 1) ** 2 * quads
    w = np.array([x[0] for x in weights])
    penalty = np.array([x[1] for x in weights])
    corner = np.where(station >= 0, 1.0, 4.0)[:, None] * (TURNS != 0)
    turn_cost = angle_cost[None] + penalty[:, None, None] * corner[None]
    total = 4 if outer else -4
    low = int(np.floor(quarter.min() - LARGEST_DEVIATION)) - 5
    high = int(np.ceil(quarter.max() + LARGEST_DEVIATION)) + 5
    states = np.arange(low, high + 1)
    begin = np.round(quarter[0]) + np.arange(-2, 3)
    cost = np.full((len(w), 5, len(states)), np.inf)
    cost[:, np.arange(5), (begin - low).astype(int)] = 0.0
    choices = np.zeros((m, len(w), 5, len(states)), dtype=np.int8)
    for i in range(m):
        options = np.full((4, *cost.shape), np.inf)
        for c, k in enumerate(TURNS.tolist()):
            source = cost[:, :, max(0, -k) : len(states) - max(0, k)]
            options[c][:, :, max(0, k) : len(states) - max(0, -k)] = source
            options[c] += turn_cost[:, i, c][:, None, None]
        choices[i] = options.argmin(axis=0)
        off = np.abs(quarter[i] - states)
        step = np.where(off > LARGEST_DEVIATION, np.inf, off**2)
        cost = options.min(axis=0) + np.where(
            np.isinf(step), np.inf, w[:, None] * length[i] * np.where(np.isinf(step), 0, step)
        )[:, None, :]
    return [
        _trace(cost[j], choices[:, j], begin, total, low, arc, station) for j in range(len(w))
    ]


def _candidates(ring: Ring, stations: Stations, h: float) -> tuple[FloatArray, IntArray]:
    """Return arc lengths where a piece may begin, and the station at each, -1 between."""
    arcs = stations.arc if len(stations.arc) else np.zeros(1)
    numbers = np.arange(len(stations.arc)) if len(stations.arc) else np.full(1, -1)
    ends = np.append(arcs[1:], arcs[0] + ring.length)
    where: list[float] = []
    which: list[int] = []
    least = 4 if len(arcs) == 1 else 1
    for a, b, number in zip(arcs.tolist(), ends.tolist(), numbers.tolist()):
        parts = max(least, int((b - a) // (CANDIDATE_SPACING * h)))
        where += [a + (b - a) * i / parts for i in range(parts)]
        which += [number] + [-1] * (parts - 1)
    return np.array(where), np.array(which, dtype=np.int64)


def _trace(
    cost: FloatArray,
    choices: IntArray,
    begin: FloatArray,
    total: int,
    low: int,
    arc: FloatArray,
    station: IntArray,
) -> Labels | None:
    """Read the cheapest closed sequence of turns back from the tables."""
    last = (begin + total - low).astype(int)
    inside = (last >= 0) & (last < cost.shape[1])
    ending = np.where(inside, cost[np.arange(5), np.clip(last, 0, cost.shape[1] - 1)], np.inf)
    best = int(np.argmin(ending))
    if not np.isfinite(ending[best]):
        return None
    state = int(last[best])
    turns = np.zeros(len(arc), dtype=np.int64)
    directions = np.zeros(len(arc), dtype=np.int64)
    for i in range(len(arc) - 1, -1, -1):
        directions[i] = (state + low) % 4
        turns[i] = TURNS[choices[i, best, state]]
        state -= int(turns[i])
    kept: BoolArray = (station >= 0) | (turns != 0)
    return Labels(arc[kept], turns[kept], directions[kept], station[kept])
