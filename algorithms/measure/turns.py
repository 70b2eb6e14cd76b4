"""Turns along streets: bends, zigzags, and where a street runs too close to another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Point
from shapely.ops import substring

from .graph import Chain, FloatArray

#: A turn of a zigzag is sharper than this (degrees; CND section 4.3 has right angles).
SHARP = 45.0
#: Streets whose directions differ by less than this run alongside each other (degrees).
ALONGSIDE = 30.0


@dataclass(frozen=True)
class Turn:
    """A change of direction on the way along a chain.

    Attributes
    ----------
    at
        Distance from the start of the chain, metres.
    angle
        Degrees, positive to the left.
    """

    at: float
    angle: float


def turns(line: LineString, window: float) -> list[Turn]:
    """Find the turns of a line; a curve within a window counts as one turn.

    Parameters
    ----------
    line
        Line in metres.
    window
        Turns in the same direction closer than this are added up, in metres; bends that
        stray less than a tenth of it from a straight line are ignored.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> [round(t.angle) for t in turns(LineString([(0, 0), (50, 0), (50, 50)]), 20.0)]
    [90]
    """
    xy = np.asarray(line.simplify(window / 10).coords, dtype=float)[:, :2]
    steps = np.diff(xy, axis=0)
    size = np.hypot(*steps.T)
    steps, size = steps[size > 0], size[size > 0]
    places = np.cumsum(size)[:-1]
    cross = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    dot = (steps[:-1] * steps[1:]).sum(axis=1)
    found: list[Turn] = []
    reach = -math.inf
    for at, angle in zip(places.tolist(), np.degrees(np.arctan2(cross, dot)).tolist()):
        last = found[-1] if found else None
        if last is not None and last.angle * angle > 0 and at - reach < window:
            total = last.angle + angle
            found[-1] = Turn((last.at * last.angle + at * angle) / total, total)
        else:
            found.append(Turn(at, angle))
        reach = at
    return found


def bends(chains: Sequence[Chain], least: float, window: float) -> list[Point]:
    """Find the places where a street turns between junctions.

    Parameters
    ----------
    chains
        Streets between junctions, metres.
    least
        Smallest turn that counts, degrees.
    window
        See `turns`, metres.
    """
    return [
        chain.line.interpolate(turn.at)
        for chain in chains
        for turn in turns(chain.line, window)
        if abs(turn.angle) > least
    ]


def zigzags(chains: Sequence[Chain], edge_length: float) -> list[tuple[Chain, LineString]]:
    """Find stretches between two opposite sharp turns (CND section 4.3).

    The turns may be bends or, at a junction, ways on into another street.

    Parameters
    ----------
    chains
        Streets between junctions; streets that are not among them do not count.
    edge_length
        The turns lie at most 1.5 times this apart, in metres.

    Returns
    -------
    list
        The chain and the stretch, one for each chain at most.
    """
    away = leaving([chain.line for chain in chains], 0.4 * edge_length).tolist()
    ends: dict[int, list[tuple[int, int]]] = {}
    for k, chain in enumerate(chains):
        for side in (0, 1):
            ends.setdefault(chain.ends[side], []).append((k, side))
    found = []
    for k, chain in enumerate(chains):
        inner = [t for t in turns(chain.line, 0.5 * edge_length) if abs(t.angle) > SHARP]
        first, last = (_turns_off(away, ends[chain.ends[side]], k, side) for side in (0, 1))
        stations = [(0.0, first)] if first else []
        stations += [(t.at, {1 if t.angle > 0 else -1}) for t in inner]
        stations += [(chain.line.length, last)] if last else []
        for (a, before), (b, after) in zip(stations, stations[1:]):
            if b - a <= 1.5 * edge_length and any(-sign in after for sign in before):
                found.append((chain, substring(chain.line, a, b)))
                break
    return found


def too_close(chains: Sequence[Chain], edge_length: float) -> list[tuple[Chain, Chain, LineString]]:
    """Find streets that run alongside another one (CND section 4.3, opposite edges).

    Parameters
    ----------
    chains
        Streets between junctions.
    edge_length
        Streets closer than 0.6 times this, over more than 0.5 times this, are too close;
        in metres.

    Returns
    -------
    list
        The two chains and the stretch of the first.
    """
    step = edge_length / 10
    pieces, owner, at = _sample([chain.line for chain in chains], step)
    if not len(pieces):
        return []
    one, other = _alongside(pieces, 0.6 * edge_length)
    same = owner[one] == owner[other]
    apart = np.abs(at[one] - at[other])
    keep = (owner[one] > owner[other]) | (same & (apart > 0.5 * edge_length) & (one > other))
    one, other = one[keep], other[keep]
    order = np.lexsort((at[one], owner[other], owner[one]))
    one, other = one[order], other[order]
    i, j, places = owner[one], owner[other], at[one]
    # A run ends where the pair of chains changes, the stretch has a gap or turns sharply.
    heading = _directions(pieces)[one]
    bend = (heading[1:] * heading[:-1]).sum(axis=1) < math.cos(math.radians(SHARP))
    fresh = (np.diff(i) != 0) | (np.diff(j) != 0) | (np.diff(places) > 1.6 * step) | bend
    found = []
    for run in np.split(np.arange(len(one)), np.flatnonzero(fresh) + 1):
        if not len(run):
            continue
        first, last = float(places[run[0]]), float(places[run[-1]])
        if last - first + step > 0.5 * edge_length:
            chain = chains[int(i[run[0]])]
            stretch = substring(chain.line, max(0.0, first - step / 2), last + step / 2)
            found.append((chain, chains[int(j[run[0]])], stretch))
    return found


def leaving(lines: Sequence[LineString], look: float) -> FloatArray:
    """Find the directions in which lines leave their two ends.

    Parameters
    ----------
    lines
        The k lines, metres.
    look
        Over which distance the direction is taken, metres.

    Returns
    -------
    array
        Shape (k, 2, 2). Vectors from the start and from the end, up to `look` long.
    """
    shapes = np.array(lines, dtype=object)
    if not len(shapes):
        return np.zeros((0, 2, 2))
    size = shapely.length(shapes)
    far = np.minimum(look, size)
    stations = np.stack([np.zeros_like(size), far, size, size - far])
    xy = shapely.get_coordinates(shapely.line_interpolate_point(shapes, stations))
    start, onward, end, back = xy.reshape(4, -1, 2)
    return np.stack([onward - start, back - end], axis=1)


def _turns_off(
    away: list[list[list[float]]], ends: list[tuple[int, int]], chain: int, side: int
) -> set[int]:
    """Signs of the sharp turns between a chain and the other streets at one of its ends.

    The sign is that of the turn met on the way along the chain: from another street into
    its start, or from its end into another street; 1 to the left, -1 to the right.
    """
    ax, ay = away[chain][side]
    signs = set()
    for other, end in ends:
        if (other, end) == (chain, side):
            continue
        bx, by = away[other][end]
        # Walked towards the node along one, away from it along the other.
        turn = math.degrees(math.atan2(ay * bx - ax * by, -(ax * bx + ay * by)))
        if side == 0:
            turn = -turn
        if abs(turn) > SHARP:
            signs.add(1 if turn > 0 else -1)
    return signs


def _sample(lines: Sequence[LineString], step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut lines into short straight pieces.

    Returns
    -------
    pieces
        Shape (k, 2, 2).
    owner
        Shape (k,). Index of the line.
    at
        Shape (k,). Distance of the middle of the piece from the start of its line.
    """
    pieces, owner, at = [], [], []
    for i, line in enumerate(lines):
        xy = shapely.get_coordinates(shapely.segmentize(line, step))
        size = np.hypot(*np.diff(xy, axis=0).T)
        pieces.append(np.stack([xy[:-1], xy[1:]], axis=1))
        at.append(np.cumsum(size) - size / 2)
        owner.append(np.full(len(size), i))
    if not pieces:
        return np.zeros((0, 2, 2)), np.zeros(0), np.zeros(0)
    return np.concatenate(pieces), np.concatenate(owner), np.concatenate(at)


def _directions(pieces: FloatArray) -> FloatArray:
    """Give unit vectors along straight pieces, shape (k, 2)."""
    step = pieces[:, 1] - pieces[:, 0]
    return np.asarray(step / np.maximum(np.hypot(*step.T), 1e-12)[:, None])


def _alongside(pieces: FloatArray, distance: float) -> tuple[FloatArray, FloatArray]:
    """Pairs of pieces that are near, have nearly one direction and lie side by side."""
    middles = pieces.mean(axis=1)
    direction = _directions(pieces)
    tree = shapely.STRtree(shapely.points(middles))
    one, other = tree.query(shapely.points(middles), predicate="dwithin", distance=distance)
    one, other = one[one != other], other[one != other]
    between = middles[other] - middles[one]
    size = np.maximum(np.hypot(*between.T), 1e-12)
    parallel = np.abs((direction[one] * direction[other]).sum(axis=1))
    across = np.abs((between * direction[one]).sum(axis=1)) / size
    beside = (parallel > math.cos(math.radians(ALONGSIDE))) & (across < 0.5)
    return one[beside], other[beside]
