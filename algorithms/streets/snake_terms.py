"""What snakes are made of: which points bend together, which legs are pulled square, corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..network.problem import BoolArray, FloatArray, IntArray
from .angles import leg_nodes, legs_at
from .smooth_anchors import Anchors
from .smooth_graph import StreetNet
from .smooth_points import Points

#: Corners this near to 90 degrees are pulled there with full force, and beyond the second
#: figure not at all: a slip road should not become a T-junction (degrees).
SQUARE_UP_TO, SQUARE_NONE = 30.0, 50.0
#: Weight of bending where a street runs through a junction, against 1 between junctions.
THROUGH_WEIGHT = 2.0
#: A point of a corner, or of a tight curve, turns by more than this (degrees).
CORNER_TURN = 8.0
#: It turns by more than this within so many metres on either side, and by more than the third
#: figure over some greater length (metres, degrees, degrees).
NEAR_LOOK, NEAR_TURN, CORNER = 20.0, 35.0, 50.0
#: The direction of a leg is that to the first point at this share of the spacing or beyond.
LEG_REACH = 0.8


@dataclass(frozen=True, eq=False)
class Bends:
    """Triples of neighbours along snakes.

    Attributes
    ----------
    triples
        Shape (t, 3). Points; the middle one bends.
    factor
        Shape (t,). Weight of the bend.
    corner
        Shape (t,). Bends that keep their shape.
    """

    triples: IntArray
    factor: FloatArray
    corner: BoolArray


@dataclass(frozen=True, eq=False)
class Legs:
    """Legs with a direction that they should take, k in all.

    Attributes
    ----------
    node, point
        Shape (k,). Where each begins, and the point further on that gives its direction.
    weight
        Shape (k,). From 0 to 1.
    back, ahead
        Shape (k,). Points on both sides of the node along the street that the leg meets.
    side
        Shape (k,). +1 where the leg leaves that street to the left, -1 to the right.
    share
        Shape (k,). Share of the turn that the leg takes on; the street that it meets takes the
        rest. 0 for legs with a direction of their own.
    direction
        Shape (k, 2). That direction, as a unit vector.
    """

    node: IntArray
    point: IntArray
    weight: FloatArray
    back: IntArray
    ahead: IntArray
    side: FloatArray
    share: FloatArray
    direction: FloatArray


def find_bends(net: StreetNet, points: Points, partner: IntArray, look: float) -> Bends:
    """Gather the triples of points whose bending costs: along edges and through junctions.

    Parameters
    ----------
    net
        The streets.
    points
        Points along them.
    partner
        Shape (2e,). See `angles.partners`.
    look
        Length over which corners are told from the steps of a staircase, metres; 0 for no
        corners.
    """
    s, inner = points.sequence, points.links
    middle = inner[1:][np.diff(inner) == 1]
    along = np.column_stack([s[middle - 1], s[middle], s[middle + 1]])
    first = np.empty(2 * len(net.ends), dtype=np.int64)
    first[0::2], first[1::2] = s[points.offset[:-1] + 1], s[points.offset[1:] - 2]
    legs = np.flatnonzero(partner > np.arange(len(partner)))
    node = leg_nodes(net)[legs]
    through = np.column_stack([first[legs], node, first[partner[legs]]])
    triples = np.vstack([along, through])
    factor = np.ones(len(triples))
    factor[len(along) :] = np.where(net.degrees[node] > 2, THROUGH_WEIGHT, 1.0)
    corner = np.zeros(len(triples), dtype=bool)
    if look > 0:
        corner[_corners(points.start, triples, look)] = True
    return Bends(triples, factor, corner)


def find_legs(
    net: StreetNet,
    points: Points,
    partner: IntArray,
    away: FloatArray,
    anchors: Anchors,
    spacing: float,
    *,
    square: bool,
) -> Legs:
    """Find the legs to be pulled square to the street that they meet, and those that are held.

    Parameters
    ----------
    net, points, anchors
        The streets, the points along them, and what holds them.
    partner, away
        Shape (2e,) and (2e, 2). See `angles.partners` and `angles.leg_directions`.
    spacing
        Distance of points, metres.
    square
        Whether legs are pulled square at all.
    """
    further = _further(net, points, spacing)
    rows = _square_rows(net, partner, away, anchors) if square else []
    at = legs_at(net)
    ends = [(at[v][0], direction) for v, direction in sorted(anchors.tangents.items())]
    held = [leg for leg, _ in ends]
    leg = np.array([row[0] for row in rows] + held, dtype=np.int64)
    back = np.array([row[1] for row in rows] + held, dtype=np.int64)
    ahead = np.array([row[2] for row in rows] + held, dtype=np.int64)
    numbers = np.array([row[3:] for row in rows] + [(1.0, 1.0, 0.0)] * len(ends)).reshape(-1, 3)
    return Legs(
        node=leg_nodes(net)[leg],
        point=further[leg],
        weight=numbers[:, 0],
        back=further[back],
        ahead=further[ahead],
        side=numbers[:, 1],
        share=numbers[:, 2],
        direction=np.array([(1.0, 0.0)] * len(rows) + [d for _, d in ends]).reshape(-1, 2),
    )


def _further(net: StreetNet, points: Points, spacing: float) -> IntArray:
    """Find the first point along each leg that is about the spacing away, shape (2e,)."""
    found = np.empty(2 * len(net.ends), dtype=np.int64)
    for e in range(len(net.ends)):
        own = points.sequence[points.offset[e] : points.offset[e + 1]]
        gone = np.cumsum(np.hypot(*np.diff(points.start[own], axis=0).T))
        last = len(own) - 1
        reach = LEG_REACH * spacing
        found[2 * e] = own[min(int(np.searchsorted(gone, reach)) + 1, last)]
        rest = gone[-1] - np.append(0.0, gone[:-1])[::-1]
        found[2 * e + 1] = own[::-1][min(int(np.searchsorted(rest, reach)) + 1, last)]
    return found


def _square_rows(
    net: StreetNet, partner: IntArray, away: FloatArray, anchors: Anchors
) -> list[tuple[int, int, int, float, float, float]]:
    """Legs to be pulled square: leg, legs back and ahead, weight, side, share."""
    held = np.repeat(anchors.held, 2)
    rows: list[tuple[int, int, int, float, float, float]] = []
    for legs in legs_at(net):
        pairs = [(a, int(partner[a])) for a in legs if a < partner[a]]
        if len(legs) < 3 or not pairs or len(pairs) > 2:
            continue
        for a, b in pairs:
            others = [leg for leg in legs if leg not in (a, b)]
            along = away[b] - away[a]
            along = along / np.hypot(*along)
            sides = [float(along[0] * away[k][1] - along[1] * away[k][0]) for k in others]
            for k, lean in zip(others, sides):
                alone = sum(s * lean > 0 for s in sides) == 1
                off = math.degrees(math.acos(min(abs(lean), 1.0)))
                weight = min(1.0, (SQUARE_NONE - off) / (SQUARE_NONE - SQUARE_UP_TO))
                if alone and weight > 0 and not held[k]:
                    # Where two streets cross each takes half of the turn, unless one is held.
                    half = partner[k] >= 0 and not (held[a] or held[b])
                    share = 0.5 if half else 1.0
                    rows.append((k, a, b, weight, math.copysign(1.0, lean), share))
    return rows


def _corners(start: FloatArray, triples: IntArray, look: float) -> list[int]:
    """Triples at which a street turns a corner, and not just the step of a staircase."""
    onward: dict[tuple[int, int], int] = {}
    for a, b, c in triples.tolist():
        onward[b, a], onward[b, c] = c, a

    def away(point: int, towards: int, look: float) -> FloatArray:
        """Direction from a point to where its snake is after the look."""
        before, at, gone = point, towards, 0.0
        while True:
            gone += math.dist(start[before], start[at])
            on = onward.get((at, before))
            if gone >= look or on is None or on == point:
                return np.asarray(start[at] - start[point])
            before, at = at, on

    def turns(k: int, look: float, least: float) -> bool:
        """Tell whether a street turns by more than that over the look on either side."""
        a, b, c = triples[k].tolist()
        return float(_turn(-away(b, a, look), away(b, c, look))) > least

    a, b, c = (start[triples[:, k]] for k in range(3))
    some = np.flatnonzero(_turn(b - a, c - b) > CORNER_TURN).tolist()
    return [k for k in some if turns(k, NEAR_LOOK, NEAR_TURN) and turns(k, look, CORNER)]


def _turn(arriving: FloatArray, leaving: FloatArray) -> FloatArray:
    """Measure turns between directions, degrees."""
    dot = (arriving * leaving).sum(axis=-1)
    size = np.hypot(*arriving.T) * np.hypot(*leaving.T)
    return np.asarray(np.degrees(np.arccos(np.clip(dot / np.maximum(size, 1e-12), -1, 1))))
