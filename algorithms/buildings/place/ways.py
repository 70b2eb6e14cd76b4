"""What ways cost: reckoned for places where a building might stand, planned for those that do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ..paths.exitcheck import ExitCheck
from ..paths.plan import plan_paths
from ..rules import LayoutRules
from ..shape import entrances, frames
from ..types import BuildingType, Floats, Placements
from ..zone import ControlLine, Zone
from .columns import Bools
from .score import WAY_M, planned_ways

#: Points on the edge of street space are this far apart, metres.
SAMPLE = 3.0
#: Who leaves to the other side goes around half a group, metres.
AROUND = 30.0
#: Turns, narrow places and a share of an exit are worth so many metres of way.
EXTRA = 12.0


class Ways:
    """The costs of ways in a zone, in the unit of W (100 m).

    Parameters
    ----------
    zone, types, rules, lines
        The ground, kinds of buildings, what is asked, and control lines.
    """

    def __init__(
        self,
        zone: Zone,
        types: Sequence[BuildingType],
        rules: LayoutRules,
        lines: Sequence[ControlLine],
    ) -> None:
        self.zone, self.types, self.rules, self.lines = zone, types, rules, lines
        self._exits = ExitCheck(zone, types, rules)
        self._street = [
            shapely.get_coordinates(shapely.segmentize(patch.access, SAMPLE))
            for patch in zone.patches
        ]

    def reckon(self, placed: Placements) -> Floats:
        """Reckon ways along and across rows to the nearest street space, shape (n,).

        A way that begins away from street space leads around its group first.
        """
        metres = np.zeros(len(placed))
        points, outward = entrances(self.types, placed)
        along, _ = frames(placed)
        turned = np.round(placed.facing, 3)
        for patch, facing in sorted(set(zip(placed.patch.tolist(), turned.tolist()))):
            here = np.flatnonzero((placed.patch == patch) & (turned == facing))
            if len(self._street[patch]):
                for way in (1.0, -1.0):  # the entrance is on either side
                    side = along[here[0]]
                    out = np.array([-side[1], side[0]]) * way
                    some = here[outward[here] @ out > 0]
                    if len(some):
                        metres[some] = _nearest(points[some], self._street[patch], side, out)
        return (metres + EXTRA) / WAY_M

    def planned(self, placed: Placements) -> tuple[Floats, Bools]:
        """Plan the paths; return what each way costs and whether there is one, (n,) each."""
        plan = plan_paths(self.zone, self.types, self.rules, self.lines, placed)
        return planned_ways(plan), plan.reached

    def reached(self, placed: Placements) -> Bools:
        """Tell quickly which buildings have a way out, shape (n,)."""
        return self._exits.reached(placed)


def _nearest(points: Floats, street: Floats, side: Floats, out: Floats) -> Floats:
    """Return the length of ways along `side` and `out` to the nearest of some points, (n,)."""
    base = np.column_stack([side, out])
    own, ends = points @ base, street @ base
    metres = np.empty(len(own))
    # by parts: every point against every end is a large table
    for begin in range(0, len(own), 4096):
        part = own[begin : begin + 4096]
        off = ends[None, :, 1] - part[:, 1, None]
        aside = np.abs(ends[None, :, 0] - part[:, 0, None])
        behind = np.where(off < 0, 2.0 * np.maximum(0.0, AROUND - aside), 0.0)
        metres[begin : begin + 4096] = (np.abs(off) + aside + behind).min(axis=1)
    return metres
