"""Directions in which streets leave junctions, which go on into which, and figures about both.

A *leg* is one end of an edge: leg 2 e is that at the start of edge e, leg 2 e + 1 that at its end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from ..network.problem import BoolArray, FloatArray, IntArray
from .smooth_graph import Geometries, StreetNet, chains_of

#: Directions are taken to the point this far along a leg, or half-way along a short one (metres).
LOOK = 15.0
#: At a junction a street goes straight on up to this turn (degrees).
THROUGH = 45.0
#: Turns in one direction within this length are one bend (metres).
WINDOW = 15.0
#: Wiggles below this are no bends (metres).
WIGGLE = 0.3
#: Turns above this are bends worth counting (degrees).
BEND = 20.0
#: Corners that are wider than this should be straight, others right (degrees).
WIDE = 135.0


@dataclass(frozen=True)
class NetworkFigures:
    """What a street network looks like, in numbers.

    Attributes
    ----------
    angle_mean, angle_p90
        Mean and 90th percentile of how far the corners at junctions of three and four streets
        are from 90 degrees (from 180 where streets go straight on), degrees; 0 without any.
    bends
        Number of places between junctions where a street turns by more than 20 degrees within
        15 m; an arc is one.
    shortest
        Length of the shortest street between two junctions, metres; 0 without any.
    length
        Length of all streets, metres.
    junctions
        Number of places where three or more streets meet.
    """

    angle_mean: float
    angle_p90: float
    bends: int
    shortest: float
    length: float
    junctions: int


def leg_nodes(net: StreetNet) -> IntArray:
    """Node at which each leg begins, shape (2e,)."""
    return net.ends.ravel()


def leg_directions(lines: Geometries, look: float = LOOK) -> FloatArray:
    """Find the unit vectors in which legs leave their nodes.

    Parameters
    ----------
    lines
        Shape (e,). LineStrings of the edges.
    look
        Distance along a leg at which its direction is taken, at most half its length, metres.

    Returns
    -------
    array
        Shape (2e, 2).
    """
    length = shapely.length(lines)
    reach = np.minimum(look, length / 2)
    away = np.empty((2 * len(lines), 2))
    for side, sign in ((0, 1.0), (1, -1.0)):
        tip = shapely.get_coordinates(shapely.get_point(lines, -side))
        there = shapely.line_interpolate_point(lines, reach if sign > 0 else length - reach)
        away[side::2] = shapely.get_coordinates(there) - tip
    return np.asarray(away / np.maximum(np.hypot(*away.T), 1e-12)[:, None])


def legs_at(net: StreetNet) -> list[list[int]]:
    """List the legs at each node."""
    found: list[list[int]] = [[] for _ in net.nodes]
    for leg, node in enumerate(leg_nodes(net).tolist()):
        found[node].append(leg)
    return found


def partners(net: StreetNet, away: FloatArray, limit: float = THROUGH) -> IntArray:
    """Pair the legs that go straightest on into each other at every node.

    The pairs make the network's snakes: sequences of edges that are smoothed as one
    (CND appendix). Where only two legs meet they are a pair whatever the turn.

    Parameters
    ----------
    net
        The streets.
    away
        Shape (2e, 2). Directions of the legs.
    limit
        Largest turn of a pair at a junction, degrees.

    Returns
    -------
    array
        Shape (2e,). The other leg of the pair, -1 where a leg ends its snake.
    """
    partner = np.full(len(away), -1, dtype=np.int64)
    least = -math.cos(math.radians(limit))
    for legs in legs_at(net):
        if len(legs) == 2:
            partner[legs] = legs[::-1]
            continue
        own = away[legs]
        straight = own @ own.T
        rows, columns = np.triu_indices(len(legs), 1)
        order = np.lexsort((columns, rows, np.round(straight[rows, columns], 9)))
        for i, j in zip(rows[order].tolist(), columns[order].tolist()):
            if straight[i, j] > least:
                break
            if partner[legs[i]] < 0 and partner[legs[j]] < 0:
                partner[legs[i]], partner[legs[j]] = legs[j], legs[i]
    return partner


def rotation(net: StreetNet, lines: Geometries) -> IntArray:
    """Find the next leg counter-clockwise after each leg at its node, shape (2e,).

    Two drawings of a network without crossings have the same blocks if, and only if, these
    are the same.
    """
    first = np.empty((2 * len(lines), 2))
    for side, other in ((0, 1), (-1, -2)):
        tip = shapely.get_coordinates(shapely.get_point(lines, side))
        first[-side::2] = shapely.get_coordinates(shapely.get_point(lines, other)) - tip
    node = leg_nodes(net)
    order = np.lexsort((np.arctan2(first[:, 1], first[:, 0]), node))
    last = np.append(np.diff(node[order]) > 0, True)
    begin = np.flatnonzero(np.append(True, last[:-1]))
    following = np.append(order[1:], 0)
    following[last] = order[begin]
    found = np.empty(len(order), dtype=np.int64)
    found[order] = following
    return found


def corner_deviations(net: StreetNet, away: FloatArray) -> FloatArray:
    """Measure how far corners are from right angles, or from straight, in degrees.

    Parameters
    ----------
    net
        The streets.
    away
        Shape (2e, 2). Directions of the legs.

    Returns
    -------
    array
        Shape (k,): one for each corner at nodes where three or four streets meet.
    """
    angle = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    found: list[FloatArray] = []
    for legs in legs_at(net):
        if len(legs) in (3, 4):
            around = np.sort(angle[legs])
            found.append(np.diff(np.append(around, around[0] + 360.0)))
    corners = np.concatenate(found) if found else np.zeros(0)
    return np.asarray(np.abs(corners - np.where(corners < WIDE, 90.0, 180.0)))


def count_bends(lines: Geometries, least: float = BEND, window: float = WINDOW) -> int:
    """Count the places where lines turn.

    Parameters
    ----------
    lines
        LineStrings from junction to junction, metres.
    least
        Smallest turn that counts, degrees.
    window
        Turns in one direction within this length are one, metres.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> count_bends(np.array([LineString([(0, 0), (50, 0), (50, 50)])], dtype=object))
    1
    """
    return sum(
        _bends(shapely.get_coordinates(line), least, window)
        for line in shapely.simplify(lines, WIGGLE)
    )


def _bends(xy: FloatArray, least: float, window: float) -> int:
    """Count the turns of a line; what goes on in one direction is one."""
    steps = np.diff(xy, axis=0)
    steps = steps[np.hypot(*steps.T) > 0]
    if len(steps) < 2:
        return 0
    place = np.cumsum(np.hypot(*steps.T))[:-1]
    cross = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    angle = np.degrees(np.arctan2(cross, (steps[:-1] * steps[1:]).sum(axis=1)))
    new = np.flatnonzero((angle[1:] * angle[:-1] <= 0) | (np.diff(place) > window)) + 1
    # Turn from each vertex over the window, within what goes on in its direction.
    last = np.minimum(
        np.searchsorted(place, place + window, side="right"),
        np.append(new, len(place))[np.searchsorted(new, np.arange(len(place)), side="right")],
    )
    total = np.concatenate([[0.0], np.cumsum(angle)])
    sharp = np.abs(total[last] - total[:-1]) > least
    return sum(bool(part.any()) for part in np.split(sharp, new))


def chain_lines(net: StreetNet, lines: Geometries) -> tuple[Geometries, IntArray]:
    """Geometries from junction to junction, and the nodes at their ends, shape (c, 2)."""
    coordinates = [shapely.get_coordinates(line) for line in lines]
    made, ends = [], []
    for chain in chains_of(net):
        parts = [coordinates[e] if e >= 0 else coordinates[~e][::-1] for e in chain]
        made.append(np.vstack([parts[0], *(part[1:] for part in parts[1:])]))
        first, last = chain[0], chain[-1]
        ends.append(
            (
                net.ends[first, 0] if first >= 0 else net.ends[~first, 1],
                net.ends[last, 1] if last >= 0 else net.ends[~last, 0],
            )
        )
    shapes = np.empty(len(made), dtype=object)
    shapes[:] = [shapely.linestrings(xy) for xy in made]
    return shapes, np.array(ends, dtype=np.int64).reshape(-1, 2)


def network_figures(
    net: StreetNet, lines: Geometries, moving: BoolArray | None = None
) -> NetworkFigures:
    """Measure a network.

    Parameters
    ----------
    net
        The streets.
    lines
        Shape (e,). Their geometries.
    moving
        Shape (e,). Edges that count; None for all. A junction counts where such an edge ends.
    """
    counts = np.ones(len(lines), dtype=bool) if moving is None else moving
    chains, ends = chain_lines(net, lines)
    own = np.array([bool(counts[[e if e >= 0 else ~e for e in c]].all()) for c in chains_of(net)])
    degree = net.degrees
    inner = own & (degree[ends] > 2).all(axis=1) if len(ends) else np.zeros(0, dtype=bool)
    met = np.zeros(len(net.nodes), dtype=bool)
    met[net.ends[counts].ravel()] = True
    deviation = corner_deviations(net, leg_directions(lines)) if len(lines) else np.zeros(0)
    some = np.repeat(met, np.where(np.isin(degree, (3, 4)), degree, 0))
    deviation = deviation[some]
    return NetworkFigures(
        angle_mean=float(deviation.mean()) if len(deviation) else 0.0,
        angle_p90=float(np.percentile(deviation, 90)) if len(deviation) else 0.0,
        bends=count_bends(chains[own]) if len(chains) else 0,
        shortest=float(shapely.length(chains[inner]).min()) if inner.any() else 0.0,
        length=float(shapely.length(lines[counts]).sum()),
        junctions=int((met & (degree > 2)).sum()),
    )
