"""Which sides of a block get rows of parcels: the choice that matters most for their shape."""

from __future__ import annotations

import numpy as np

from ..rules import ParcelRules
from .outline import Side

#: Blocks whose largest circle has a smaller radius than this share of the depth hold one row.
ONE_ROW = 0.72
#: From this share on, two rows are worth a try as well.
TWO_ROWS = 0.6
#: A side of that many depths is a front by the first rule.
LONG = 2.87
#: Convex corners that turn by more take land from one of their rows (degrees).
TAKES = 45.0
#: Sides shorter than that share of the longest are no second front.
MINOR = 0.2
#: Shallower blocks than this share of the depth lose only their radius at a corner.
SHALLOW = 1.55


def choices(sides: list[Side], radius: float, rules: ParcelRules) -> list[tuple[int, ...]]:
    """Return the sets of fronting sides worth a try, without repeats.

    Long sides; sides that keep two parcels after they lose the corners at both ends; the same
    where only convex corners take land; the two longest sides that face each other; as many as
    keep two parcels each. Thin blocks get one row of parcels from street to street.

    Parameters
    ----------
    sides
        All sides of the block.
    radius
        Of the largest circle in the block, metres.
    rules
        What is asked of parcels.

    Returns
    -------
    list of tuple of int
        Indices of open sides, ascending; empty where no side gives access.
    """
    usable = [
        k
        for k, s in enumerate(sides)
        if s.open and s.length >= rules.min_frontage and not s.rounding
    ]
    if not usable:
        return []
    longest = max(usable, key=lambda k: sides[k].length)
    found: list[tuple[int, ...]] = []
    if radius < ONE_ROW * rules.depth:
        found.append((longest,))
        if radius < TWO_ROWS * rules.depth:
            return found
    lost = radius if radius < SHALLOW * rules.depth else rules.depth
    for rule in range(3):
        fronts = tuple(k for k in usable if _fronts(sides, k, rule, lost, rules))
        found.append(fronts if len(fronts) > 1 else _facing(sides, usable, longest))
    found.append(_facing(sides, usable, longest))
    found.append(_most(sides, usable, lost, rules))
    return list(dict.fromkeys(found))


def _fronts(sides: list[Side], k: int, rule: int, lost: float, rules: ParcelRules) -> bool:
    side = sides[k]
    if rule == 0:
        return side.length > LONG * rules.depth
    corners = [(side.before, sides[side.before].turn), (side.after, side.turn)]
    takes = sum(sides[j].open and (rule == 1 or turn > 0) for j, turn in corners)
    return side.length > 2 * rules.width + lost * takes


def _most(sides: list[Side], usable: list[int], lost: float, rules: ParcelRules) -> tuple[int, ...]:
    """Return as many sides as keep two parcels each, the shortest given up first."""
    fronts = set(usable)
    for k in sorted(usable, key=lambda k: sides[k].length):
        side = sides[k]
        convex = (side.before in fronts and sides[side.before].turn > TAKES) + (
            side.after in fronts and side.turn > TAKES
        )
        if len(fronts) > 1 and side.length < 2 * rules.width + lost * convex:
            fronts.remove(k)
    return tuple(sorted(fronts))


def _facing(sides: list[Side], usable: list[int], longest: int) -> tuple[int, ...]:
    """Return the longest side and the one that faces it best, or the next longest."""
    if len(usable) == 1:
        return (longest,)
    way = [sides[k].xy[-1] - sides[k].xy[0] for k in range(len(sides))]
    length = max(float(np.hypot(*way[longest])), 1.0)
    others = [k for k in usable if k != longest]
    score = {k: -float(way[k] @ way[longest]) / length for k in others}
    best = max(others, key=lambda k: score[k])
    if score[best] > 0.3 * length:
        return tuple(sorted((longest, best)))
    # nothing faces it: where the rest is closed, one row is all that there is
    best = max(others, key=lambda k: sides[k].length)
    if sides[best].length < MINOR * sides[longest].length:
        return (longest,)
    return tuple(sorted((longest, best)))
