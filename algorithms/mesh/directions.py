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
import numpy.typing as npt

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


@dataclass(frozen=True, eq=False)
class LabelTable:
    """What the dynamic programme of one ring needs: candidate points and costs.

    Attributes
    ----------
    arc, station
        Shape (m,). Arc lengths where a piece may begin; the station there, -1 between.
    length
        Shape (m,). Length of the piece after each candidate, in edge lengths.
    quarter
        Shape (m,). Its direction in quarter turns from the axis, unrolled.
    angle_cost
        Shape (m, 4). Cost of each turn by the angles of its quads.
    total
        Quarter turns all round: 4 for the exterior, -4 for a hole.
    """

    arc: FloatArray
    station: IntArray
    length: FloatArray
    quarter: FloatArray
    angle_cost: FloatArray
    total: int


def label_table(
    ring: Ring, stations: Stations, h: float, axis: float, *, outer: bool
) -> LabelTable:
    """Prepare the choice of turns for a ring.

    The cost of a turn k is (2 - k) * (a / 90 - 1)**2 with a the angle of each of its 2 - k
    quads in degrees.

    Parameters
    ----------
    ring, stations
        The ring and the points of it that become vertices.
    h
        Edge length, metres.
    axis
        Direction that counts as east, radians.
    outer
        True for the exterior ring, False for a hole.
    """
    arc, station = _candidates(ring, stations, h)
    following = np.append(arc[1:], arc[0] + ring.length)
    length = (following - arc) / h
    heading = ring.heading(arc, following)
    window = np.minimum(TURN_WINDOW, 0.9 * length) * h
    turn = np.degrees(ring.turn(arc, np.roll(window, 1), window))
    unrolled = heading[0] + np.concatenate([[0.0], np.cumsum(wrap(np.diff(heading)))])
    quads = 2 - TURNS
    return LabelTable(
        arc,
        station,
        length,
        (unrolled - axis) / (np.pi / 2),
        ((180 - turn[:, None]) / quads / 90 - 1) ** 2 * quads,
        4 if outer else -4,
    )


def label_ring(
    table: LabelTable,
    weights: Sequence[tuple[float, float]],
    barred: Sequence[tuple[int, int] | None] | None = None,
) -> list[tuple[float, Labels] | None]:
    """Choose the turns at the candidate points of a ring, once for each pair of weights.

    To the cost of the angles come a penalty for each quarter turn (four times where the
    boundary has no station) and w * length * q**2 for a piece that runs q quarter turns off
    its direction.

    Parameters
    ----------
    table
        The ring.
    weights
        Pairs (w, penalty per quarter turn).
    barred
        For each pair of weights a candidate and a turn that it must not take, or None.

    Returns
    -------
    list
        Cost and labels for each pair of weights, None where there is no solution.
    """
    w = np.array([x[0] for x in weights])
    penalty = np.array([x[1] for x in weights])
    corner = np.where(table.station >= 0, 1.0, 4.0)[:, None] * np.abs(TURNS)
    turn_cost = table.angle_cost[None] + penalty[:, None, None] * corner[None]
    for j, bar in enumerate(barred or ()):
        if bar is not None:
            turn_cost[j, bar[0], bar[1] == TURNS] = np.inf
    quarter = table.quarter
    low = int(np.floor(quarter.min() - LARGEST_DEVIATION)) - 5
    high = int(np.ceil(quarter.max() + LARGEST_DEVIATION)) + 5
    states = np.arange(low, high + 1)
    begin = (np.round(quarter[0]) + np.arange(-2, 3)).astype(int)
    cost = np.full((len(w), 5, len(states)), np.inf)
    cost[:, np.arange(5), begin - low] = 0.0
    choices = np.zeros((len(quarter), *cost.shape), dtype=np.int8)
    for i in range(len(quarter)):
        options = np.full((4, *cost.shape), np.inf)
        for c, k in enumerate(TURNS.tolist()):
            source = cost[:, :, max(0, -k) : len(states) - max(0, k)]
            options[c][:, :, max(0, k) : len(states) - max(0, -k)] = source
            options[c] += turn_cost[:, i, c][:, None, None]
        choices[i] = options.argmin(axis=0)
        off = np.abs(quarter[i] - states)
        cost = options.min(axis=0) + (w[:, None] * table.length[i] * off**2)[:, None, :]
        cost[:, :, off > LARGEST_DEVIATION] = np.inf
    last = begin + table.total - low
    return [_trace(table, cost[j], choices[:, j], last, low) for j in range(len(w))]


def alternatives(
    table: LabelTable, weight: tuple[float, float], labels: Labels
) -> list[tuple[float, Labels]]:
    """Return the cheapest other labels for each change of one turn, the cheapest first.

    Parameters
    ----------
    table
        The ring.
    weight
        Weights as for `label_ring`.
    labels
        The labels from which to depart.
    """
    turn_at = dict(zip(np.round(labels.start, 6).tolist(), labels.turn.tolist()))
    bars = [
        (i, int(turn_at.get(round(arc, 6), 0)))
        for i, arc in enumerate(table.arc.tolist())
        if table.station[i] >= 0 or round(arc, 6) in turn_at
    ]
    found = label_ring(table, [weight] * len(bars), bars)
    unique = {x[1].key(): x for x in found if x is not None}
    unique.pop(labels.key(), None)
    return sorted(unique.values(), key=lambda x: x[0])


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
    table: LabelTable, cost: FloatArray, choices: npt.NDArray[np.int8], last: IntArray, low: int
) -> tuple[float, Labels] | None:
    """Read the cheapest closed sequence of turns back from the tables."""
    inside = (last >= 0) & (last < cost.shape[1])
    ending = np.where(inside, cost[np.arange(5), np.clip(last, 0, cost.shape[1] - 1)], np.inf)
    best = int(np.argmin(ending))
    if not np.isfinite(ending[best]):
        return None
    state, count = int(last[best]), len(table.arc)
    turns = np.zeros(count, dtype=np.int64)
    directions = np.zeros(count, dtype=np.int64)
    for i in range(count - 1, -1, -1):
        directions[i] = (state + low) % 4
        turns[i] = TURNS[choices[i, best, state]]
        state -= int(turns[i])
    kept: BoolArray = (table.station >= 0) | (turns != 0)
    labels = Labels(table.arc[kept], turns[kept], directions[kept], table.station[kept])
    return float(ending[best]), labels
