"""Growth that goes on where it has left blocks that are too large.

Where nothing grows any more a grammar may leave much of a site bare: it was made for open ground,
where there is always a loose end that comes along. Here growth then begins anew at the streets
around each block that is too large, and goes on until none is left or there is no room. CitySprout
has nothing like it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from ..errors import CancelledError, InputError
from ..levels import COLLECTOR, LOCAL
from ..progress import Held, Progress, Share, Silent
from ..site.watch import ask
from .bends import bends_of
from .grow import grow
from .grow.stops import CANCELLED
from .land.entries import entries
from .land.findstarts import FAR, SPACING
from .land.given import GivenNetwork
from .land.ground import RealGround
from .land.legs import Sight
from .land.starts import Place, settle, thinned
from .layers.blocks import block_faces
from .layers.outward import Shapes
from .rules import GrowthRules
from .types import GROWN, Ground, Growth, IntArray, Step

#: Most times that growth begins anew.
ROUNDS = 30
#: Most times that it does in a block that stays the same.
TRIES = 4
#: From a block so many times the largest on the first street is a collector.
WIDE = 4.0
#: Share of the progress that the first growth has; each round leaves so much of what is left.
FIRST, LATER = 0.7, 0.8

_Key = tuple[int, int, int]


def grow_on(
    real: RealGround, rules: GrowthRules, largest: float, progress: Progress | None = None
) -> Growth:
    """Grow streets, and begin anew in blocks that are too large.

    Limits count for all of it. The same ground, rules and seed give the same growth.

    Parameters
    ----------
    real
        Where streets may grow, and from where.
    rules
        What is asked.
    largest
        Area of blocks from which growth begins anew, square metres.
    progress
        As of `grow`.

    Raises
    ------
    InputError, CancelledError
        As of `grow`, of the first growth.
    """
    progress = progress or Silent()
    if not largest > 0:
        raise InputError(f"The largest block is {largest:g} m2.", "Give an area greater than 0.")
    growth = grow(real.ground, rules, Share(progress, 0.0, FIRST))
    large = _TooLarge(real, rules, largest)
    try:
        for number in range(1, ROUNDS + 1):
            left = _left(growth, rules)
            if left is None:
                break
            part = _share(progress, number)
            ground = large.ground(growth, part)
            if ground is None:
                break
            more = _more(ground, replace(left, seed=rules.seed + number), part)
            if more is not None:
                more = _without_idle(more, len(growth.xy), len(ground.nodes))
                growth = joined(growth, more, len(real.ground.nodes))
    except CancelledError:
        return replace(growth, stopped=CANCELLED)
    return growth


def _share(progress: Progress, number: int) -> Share:
    """Give a round its part of the progress: nobody knows how many will follow."""
    begin, end = (1 - (1 - FIRST) * LATER**k for k in (number - 1, number))
    return Share(progress, begin, end)


def _more(ground: Ground, rules: GrowthRules, progress: Progress) -> Growth | None:
    """Grow again; None where nothing could be built. The first growth has said all warnings."""
    try:
        return grow(ground, rules, Held(progress))
    except InputError:
        return None


def _left(growth: Growth, rules: GrowthRules) -> GrowthRules | None:
    """Give the rules with what is left of their limits, None where one is reached."""
    length = float(growth.lengths[growth.grown].sum())
    iterations = _rest(rules.iterations, len(growth.steps))
    segments = _rest(rules.max_segments, int(growth.grown.sum()))
    metres = _rest(rules.max_length, length)
    people = _rest(rules.population, length * rules.people_per_metre)
    if any(rest is not None and rest <= 0 for rest in (iterations, segments, metres, people)):
        return None
    return replace(
        rules,
        iterations=None if iterations is None else int(iterations),
        max_segments=None if segments is None else int(segments),
        max_length=metres,
        population=people,
    )


def _rest(limit: float | None, done: float) -> float | None:
    return None if limit is None else limit - done


class _TooLarge:
    """The blocks that are too large, from one round to the next.

    Parameters
    ----------
    real
        Where streets may grow.
    rules
        What is asked.
    largest
        Area of blocks from which growth begins anew, square metres.
    """

    def __init__(self, real: RealGround, rules: GrowthRules, largest: float) -> None:
        self.real, self.rules, self.largest = real, rules, largest
        self._tried: Counter[_Key] = Counter()
        self._last: Shapes | None = None

    def ground(self, growth: Growth, progress: Progress) -> Ground | None:
        """Give the ground as it has become, with starts around blocks that are too large.

        Each edge is a street of its own, by its number. Blocks in which growth has begun `TRIES`
        times and that are still the same are passed over. None where there is nothing to do.

        Raises
        ------
        CancelledError
            If the caller cancels.
        """
        domain, rules = self.real.ground.domain, self.rules
        # blocks are only ever parted: what was small enough stays so
        blocks = block_faces(growth, domain, progress, within=self._last)
        self._last = blocks = blocks[shapely.area(blocks) > self.largest]
        fresh = [block for block in blocks if self._tried[_key(block)] < TRIES]
        self._tried.update(_key(block) for block in fresh)
        if not fresh:
            return None
        what = "1 block that is" if len(fresh) == 1 else f"{len(fresh):,} blocks that are"
        progress.stage(f"Going on in {what} too large", 0.0)
        net = GivenNetwork((), growth.xy, growth.ends, np.arange(len(growth.ends)), growth.bends)
        sight = Sight(domain, net, FAR * rules.scale)
        room = SPACING * rules.scale
        places: list[Place] = []
        for block in fresh:
            ask(progress)
            again = self._tried[_key(block)] - 1
            found = entries(
                net, block, rules.grammar, sight, scale=rules.scale, room=room, again=again
            )
            wide = block.area > WIDE * self.largest
            places += [replace(p, level=COLLECTOR if wide else LOCAL) for p in found]
        if not places:
            return None
        ask(progress)
        starts, net = settle(thinned(places, room), net, rules.grammar)
        strip = self.real.ground.strip
        return Ground(starts, domain, net.nodes, net.ends, net.street, net.bends, strip)


def _key(block: shapely.Geometry) -> _Key:
    """Give a block a name by which it is known again."""
    return round(block.area), round(block.centroid.x), round(block.centroid.y)


def _without_idle(more: Growth, first: int, count: int) -> Growth:
    """Take places back at which growth was to begin and did not: the street goes on through them.

    These are nodes from the number `first` to `count`, in the middle of a street.
    """
    fresh = more.street == GROWN
    idle = np.zeros(len(more.xy), dtype=bool)
    idle[first:count] = True
    idle[more.ends[fresh].ravel()] = False
    ends, kept = more.ends.copy(), np.ones(len(more.ends), dtype=bool)
    at: dict[int, list[int]] = {}
    for edge in np.flatnonzero(idle[ends].any(axis=1)).tolist():
        for node in ends[edge].tolist():
            at.setdefault(node, []).append(edge)
    for node in np.flatnonzero(idle).tolist():
        one, other = sorted(at[node])
        far = int(ends[other].sum()) - node
        ends[one, int(ends[one, 1] == node)] = far
        at[far][at[far].index(other)] = one
        kept[other] = False
    number = np.cumsum(~idle) - 1
    return replace(
        more,
        xy=more.xy[~idle],
        road_type=more.road_type[~idle],
        node_type=more.node_type[~idle],
        born=more.born[~idle],
        incoming_road=more.incoming_road[~idle],
        incoming=more.incoming[~idle],
        bends=more.bends[~idle],
        ends=number[ends[kept]].astype(np.int64),
        road=more.road[kept],
        edge_type=more.edge_type[kept],
        step=more.step[kept],
        street=more.street[kept],
    )


def joined(before: Growth, more: Growth, given: int) -> Growth:
    """Join a growth with the one that went on from it.

    Parameters
    ----------
    before
        The growth.
    more
        What grew on from it, with its edges as streets of the ground, by their numbers.
    given
        Number of nodes of the first ground.
    """
    first, done = len(before.xy), len(before.steps)
    fresh = more.street == GROWN
    edge: IntArray = more.street[~fresh]
    roads = int(before.road.max(initial=0))
    road = np.where(fresh, more.road + roads, 0)
    road[~fresh] = before.road[edge]
    step = np.where(fresh, more.step + done, 0)
    step[~fresh] = before.step[edge]
    kind = more.edge_type.copy()
    kind[~fresh] = before.edge_type[edge]
    street = np.full(len(more.street), GROWN)
    street[~fresh] = before.street[edge]
    road_type, node_type = more.road_type.copy(), more.node_type.copy()
    touched = np.zeros(len(more.xy), dtype=bool)
    touched[more.ends[fresh].ravel()] = True
    # a node that was only reached keeps what it was
    same = ~touched[:first] | (road_type[:first] == "")
    road_type[:first][same] = before.road_type[same]
    node_type[:first][same] = before.node_type[same]
    born = more.born + done
    born[:first] = before.born
    reached = np.where(more.incoming_road > 0, more.incoming_road + roads, 0)
    arrived = before.incoming_road > 0
    reached[:first][arrived] = before.incoming_road[arrived]
    incoming = more.incoming.copy()
    known = before.incoming.any(axis=1)
    incoming[:first][known] = before.incoming[known]
    grown = street == GROWN
    return Growth(
        more.xy, road_type, node_type, born, reached, incoming,
        bends_of(len(more.xy), more.ends, street), more.ends, road, kind,
        step, street, _steps(before.steps, more.steps, int(grown.sum()), len(more.xy) - given),
        more.stopped, before.left_out + more.left_out,
    )  # fmt: skip


def _steps(
    before: Sequence[Step], more: Sequence[Step], segments: int, nodes: int
) -> tuple[Step, ...]:
    """Continue the numbers of iterations; after the last there are so many streets and nodes."""
    end, last = before[-1], more[-1]
    return (
        *before,
        *(
            replace(
                step,
                iteration=step.iteration + len(before),
                nodes=step.nodes + nodes - last.nodes,
                segments=step.segments + segments - last.segments,
                length=step.length + end.length,
                population=step.population + end.population,
                seconds=step.seconds + end.seconds,
            )
            for step in more
        ),
    )
