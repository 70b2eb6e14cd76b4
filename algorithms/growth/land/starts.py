"""Where growth begins on streets that are there, and which of the places are kept.

Streets go on where they arrive: first where roads from outside reach the ground, then from loose
ends, then from junctions that leave a wide sector free. Where there is none of these, places along
the streets or in the middle of the ground are chosen by `entries`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Tuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from ...levels import COLLECTOR, LOCAL, MAJOR
from ..grammar import LARGE, LEAF, MAIN, SMALL, Grammar, State
from ..types import BoolArray, FloatArray, Start
from .given import GivenNetwork
from .legs import Leg, Legs, Sight, touches_another, widest_gap
from .pieces import with_points

#: Road types of streets by their levels.
ROAD_OF_LEVEL = {MAJOR: MAIN, COLLECTOR: LARGE, LOCAL: SMALL}
#: Junctions with a wider sector free of streets go on into it (degrees).
FREE = 150.0
#: A street goes on where another one leaves within this of its direction (degrees).
AHEAD = 35.0
#: Streets that go on through a junction keep this far from its other streets (degrees).
BETWEEN = 45.0
#: Streets lead apart where the cosine of the angle between them is less.
APART = -0.5
#: Places this near to a node of a street are the node (metres).
AT_NODE = 0.1
#: Blocks smaller than this are no open land: without a domain no street grows into them (m²).
OPEN_LAND = 2e5

Vector = Tuple[float, float]

#: A main street has at least this share of the open ground that the best one has ahead; one that
#: arrives with less, at a corner, soon meets the next street and goes on as a local one.
LONG = 0.25

#: Where places come from, the best first.
ASKED, ARRIVAL, LOOSE_END, JUNCTION, ENTRY = range(5)


@dataclass(frozen=True)
class Place:
    """A place where growth may begin.

    Attributes
    ----------
    xy
        Position, metres.
    way
        Unit vector in which the street there would go on.
    level
        Of that street; 0 for the state with which a grammar starts, -1 for its highest leaf.
    origin
        `ASKED` and so on.
    on_street
        Whether it lies on a street that is there.
    sight
        Open ground ahead, metres.
    """

    xy: tuple[float, float]
    way: tuple[float, float]
    level: int
    origin: int
    on_street: bool = True
    sight: float = 0.0


def state_of(grammar: Grammar, level: int) -> State:
    """Give the state in which a street of a level goes on.

    It is the leaf of its road type; where that has no rules, one of a lower type, then of a higher.

    Parameters
    ----------
    grammar
        The grammar.
    level
        1 to 3; 0 for the state with which the grammar starts, -1 for its highest leaf.
    """
    if level <= 0:
        start = level == 0 and grammar.start in grammar.rules
        return grammar.start if start else grammar.leaf
    order = [*range(level, LOCAL + 1), *range(level - 1, 0, -1)]
    leaves = (State(ROAD_OF_LEVEL[k], LEAF) for k in order)
    return next((leaf for leaf in leaves if leaf in grammar.rules), grammar.leaf)


def street_places(net: GivenNetwork, cut: FloatArray | None = None) -> list[Place]:
    """Find the loose ends of streets, and the junctions that a street may go on from.

    Parameters
    ----------
    net
        The streets.
    cut
        Shape (k, 2). Ends where a street was cut, and goes on outside of the ground; None for none.
    """
    legs, degree = Legs(net), net.degrees
    ends = np.flatnonzero(degree == 1)
    if cut is not None and len(cut) and len(ends):
        ends = ends[cKDTree(cut).query(net.nodes[ends])[0] > AT_NODE]
    found = []
    for node, touches in zip(ends.tolist(), touches_another(net, ends)):
        if not touches:
            leg = legs.at(node)[0]
            way = (-leg.way[0], -leg.way[1])
            found.append(Place(_xy(net, node), way, leg.level, LOOSE_END))
    for node in np.flatnonzero(degree >= 3).tolist():
        on = _through(legs.at(node))
        if on is not None:
            found.append(Place(_xy(net, node), *on, JUNCTION))
    return found


def _through(legs: list[Leg]) -> tuple[tuple[float, float], int] | None:
    """Find the direction in which a street goes on through a junction, and its level."""
    wide, middle = widest_gap(legs)
    if wide <= math.radians(FREE):
        return None
    best, way, level = math.cos(wide / 2 - math.radians(BETWEEN)), middle, 0
    for leg in legs:
        straight = -(leg.way[0] * middle[0] + leg.way[1] * middle[1])
        if straight > best:
            best, way, level = straight, (-leg.way[0], -leg.way[1]), leg.level
    return way, level or min(leg.level for leg in legs)


def goes_on(legs: Sequence[Leg], way: tuple[float, float]) -> bool:
    """Tell whether one of some streets leads the way already.

    Parameters
    ----------
    legs
        Streets at a node.
    way
        Unit vector.
    """
    least = math.cos(math.radians(AHEAD))
    return any(leg.way[0] * way[0] + leg.way[1] * way[1] > least for leg in legs)


def with_sight(places: Sequence[Place], sight: Sight, room: float) -> list[Place]:
    """Keep the places with open ground ahead.

    Parameters
    ----------
    places
        The places.
    sight
        Measures it.
    room
        The least that is asked of arrivals, metres; of other places twice as much, and of those
        that the planner asked for nothing.
    """
    least = {ASKED: 0.0, ARRIVAL: room}
    far = sight.from_places(_array([p.xy for p in places]), _array([p.way for p in places]))
    seen = [replace(place, sight=far_) for place, far_ in zip(places, far.tolist())]
    return [place for place in seen if place.sight >= least.get(place.origin, 2 * room)]


def in_open_land(places: Sequence[Place], net: GivenNetwork) -> list[Place]:
    """Keep the places that do not lead into a block.

    Parameters
    ----------
    places
        The places.
    net
        The streets.
    """
    into = leads_into_block(_array([p.xy for p in places]), _array([p.way for p in places]), net)
    return [place for place, block in zip(places, into.tolist()) if not block]


def leads_into_block(xy: FloatArray, way: FloatArray, net: GivenNetwork) -> BoolArray:
    """Tell where streets would lead into a block smaller than `OPEN_LAND`.

    Parameters
    ----------
    xy, way
        Shape (k, 2). Places on streets, and unit vectors.
    net
        The streets.
    """
    inside = np.zeros(len(xy), dtype=bool)
    blocks = shapely.get_parts(shapely.polygonize(shapely.linestrings(net.nodes[net.ends])))
    blocks = blocks[shapely.area(blocks) < OPEN_LAND]
    if len(blocks) and len(xy):
        ahead = shapely.points(xy + way)
        inside[shapely.STRtree(blocks).query(ahead, predicate="within")[0]] = True
    return inside


def thinned(places: Sequence[Place], spacing: float) -> list[Place]:
    """Of places near each other that lead the same way keep the best.

    Those asked for are better than those found, arrivals better than loose ends, those better than
    junctions; then higher levels, then more open ground. All that were asked for stay.

    Parameters
    ----------
    places
        The places.
    spacing
        Nearer ones are one, metres; loose ends and junctions keep twice as far from all others.
    """
    order = sorted(
        places, key=lambda p: (p.origin, p.level if p.level > 0 else 0, -round(p.sight), p.xy)
    )
    cells: dict[tuple[int, int], list[Place]] = {}
    kept = []
    for place in order:
        apart = spacing if place.origin <= ARRIVAL else 2 * spacing
        i, j = (math.floor(x / (2 * spacing)) for x in place.xy)
        around = [p for a in (i - 1, i, i + 1) for b in (j - 1, j, j + 1)
                  for p in cells.get((a, b), ())]  # fmt: skip
        if place.origin == ASKED or not any(_same(place, other, apart) for other in around):
            kept.append(place)
            cells.setdefault((i, j), []).append(place)
    return kept


def _same(place: Place, other: Place, apart: float) -> bool:
    """Tell whether two places are near and do not lead apart."""
    if place.xy == other.xy:
        return True
    turn = place.way[0] * other.way[0] + place.way[1] * other.way[1]
    return math.dist(place.xy, other.xy) < apart and turn > APART


def with_main(places: Sequence[Place], grammar: Grammar) -> list[Place]:
    """See to it that a street of the highest type grows from somewhere.

    A ground that only local streets reach still needs its main street: it begins where the street
    of the highest level arrives, of these where most open ground lies ahead.

    Parameters
    ----------
    places
        The places, the best first.
    grammar
        The grammar.
    """
    # what arrives from outside is compared with what else does, not with streets inside
    least = min((place.origin for place in places), default=ENTRY)
    far = LONG * max((p.sight for p in places if p.origin == least), default=0.0)
    long = [place.sight >= far for place in places]
    kept = [
        place if room or place.level != MAJOR else replace(place, level=LOCAL)
        for place, room in zip(places, long)
    ]
    states = [state_of(grammar, place.level).road for place in kept]
    if not kept or grammar.leaf.road in states or grammar.start.road in states:
        return kept
    best = min(
        (k for k in range(len(kept)) if long[k]),
        key=lambda k: (kept[k].level, kept[k].origin, -kept[k].sight),
    )
    return [replace(p, level=-1) if k == best else p for k, p in enumerate(kept)]


def settle(
    places: Sequence[Place], net: GivenNetwork, grammar: Grammar
) -> tuple[tuple[Start, ...], GivenNetwork]:
    """Turn places into starts; those on streets become nodes of the streets.

    Parameters
    ----------
    places
        The places.
    net
        The streets.
    grammar
        The grammar.

    Returns
    -------
    tuple
        The starts in the order of the places, one at a position, and the streets, whose nodes where
        growth begins count as bends no more.
    """
    node = np.full(len(places), -1, dtype=np.int64)
    on = np.array([k for k, place in enumerate(places) if place.on_street], dtype=np.int64)
    if len(on) and len(net.ends):
        xy = _array([places[k].xy for k in on])
        tree = shapely.STRtree(shapely.linestrings(net.nodes[net.ends]))
        row, piece = tree.query_nearest(shapely.points(xy), all_matches=False)
        piece = piece[np.argsort(row)]
        near = np.hypot(*np.moveaxis(net.nodes[net.ends[piece]] - xy[:, None], 2, 0))
        side = near.argmin(axis=1)
        at = near.min(axis=1) <= AT_NODE
        node[on[at]] = net.ends[piece[at], side[at]]
        if not at.all():
            nodes, ends, street, fresh = with_points(
                net.nodes, net.ends, net.street, piece[~at], xy[~at]
            )
            node[on[~at]] = fresh
            bends = np.r_[net.bends, np.zeros(len(nodes) - len(net.nodes), dtype=bool)]
            net = replace(net, nodes=nodes, ends=ends, street=street, bends=bends)
    bends = net.bends.copy()
    bends[node[node >= 0]] = False
    spots = [p.xy if k < 0 else _xy(net, k) for p, k in zip(places, node.tolist())]
    chosen: dict[Vector, Place] = {}
    for spot, place in zip(spots, places):
        first = chosen.setdefault(spot, place)
        turn = first.way[0] * place.way[0] + first.way[1] * place.way[1]
        if turn < APART and first.origin != ASKED and grammar.start in grammar.rules:
            # to both sides of a street only the state with which a grammar starts may grow
            chosen[spot] = replace(first, level=0)
    at = dict(zip(spots, node.tolist()))
    starts = tuple(
        Start(spot, place.way, state_of(grammar, place.level), at[spot])
        for spot, place in chosen.items()
    )
    return starts, replace(net, bends=bends)


def _xy(net: GivenNetwork, node: int) -> Vector:
    x, y = net.nodes[node].tolist()
    return x, y


def _array(pairs: Sequence[tuple[float, float]]) -> FloatArray:
    return np.array(pairs, dtype=float).reshape(-1, 2)
