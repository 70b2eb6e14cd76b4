"""In which order buildings are placed: facilities, then residences in the wished mix."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..rules import LayoutRules
from ..types import EMPTY, FACILITY, RESIDENCE, BuildingType, Floats, Ints
from ..zone import Zone


def building_queue(zone: Zone, types: Sequence[BuildingType], rules: LayoutRules) -> list[int]:
    """Return RZ's array of buildings in the order of placement.

    Facilities come first: those that are counted, and as many others as patches ask for
    facilities. Then residences as many as the floor area ratio allows; at every length the mix is
    as near to the wished shares as can be, until only smaller types have room. At last, for where
    others find no place, more of the types of which no share is wished.

    Parameters
    ----------
    zone, types, rules
        The ground, the kinds of buildings, what is asked.

    Returns
    -------
    list of int
        Index of the type of each building.
    """
    facilities = [at for at, kind in enumerate(types) if kind.use == FACILITY]
    counted = [at for at in facilities if types[at].count is not None]
    queue = [at for at in counted for _ in range(types[at].count or 0)]
    patches = sum(patch.facilities != EMPTY for patch in zone.patches)
    free = [at for at in facilities if one_a_patch(types[at])]
    queue += itertools.islice(_mixed(types, free, math.inf), patches)
    homes = [at for at, kind in enumerate(types) if kind.use == RESIDENCE]
    floor_m2 = rules.most_far * zone.polygon.area
    queue += _mixed(types, homes, floor_m2)
    some = [at for at in homes if types[at].share is None and types[at].count is None]
    return queue + list(_mixed(types, some, floor_m2))


def one_a_patch(kind: BuildingType) -> bool:
    """Tell whether a type is a facility of which no number is given: a patch holds one at most."""
    return kind.use == FACILITY and kind.count is None


def wished_shares(types: Sequence[BuildingType]) -> Floats:
    """Return the shares of types of one use; their sum is 1.

    Types without a wish share what the wishes leave of the whole equally. Where all types have
    wishes, or these are more than the whole, they are parts of their sum.
    """
    given = np.array([math.nan if kind.share is None else kind.share for kind in types])
    free = np.isnan(given)
    wished = float(np.nansum(given))
    if free.any() and wished < 1:
        return np.where(free, (1 - wished) / free.sum(), given)
    if wished > 0:
        return np.where(free, 0.0, given) / wished
    return np.full(len(types), 1 / max(1, len(types)))


def _mixed(types: Sequence[BuildingType], own: Sequence[int], floor_m2: float) -> Iterator[int]:
    """Yield some types by largest remainder, until no more has room or all are counted."""
    share = wished_shares([types[at] for at in own])
    most = np.array([math.inf if (c := types[at].count) is None else c for at in own])
    floor = np.array([types[at].floor_area_m2 for at in own])
    made: Ints = np.zeros(len(own), dtype=np.int64)
    # where a type has run out, the others take its place by the same rule
    while ((made < most) & (floor <= floor_m2)).any():
        left = (made < most) & (floor <= floor_m2)
        best = int(np.argmax(np.where(left, share * (made.sum() + 1) - made, -math.inf)))
        made[best] += 1
        floor_m2 -= floor[best]
        yield own[best]
