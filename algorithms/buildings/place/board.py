"""The ground while buildings are placed on it one by one (RZ section 4.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from ..paths.exitcheck import ExitCheck
from ..rules import LayoutRules
from ..shape import footprints
from ..sun import shade_pairs
from ..types import BuildingType, Floats, Ints, Placements
from ..zone import ControlLine, Zone
from .daylight import Daylight
from .ground import buildable
from .groups import WALL, bordering, group_lengths, groups_of
from .overlap import overlapping

#: Distances that are short by rounding (metres), and overlaps of those that touch (square metres).
ROUNDING, ROUNDING_M2 = 1e-3, 0.05


class Board:
    """What stands, and whether another building fits.

    Parameters
    ----------
    zone, types, rules, lines
        What is asked.

    Attributes
    ----------
    placed
        What stands.
    """

    def __init__(
        self,
        zone: Zone,
        types: Sequence[BuildingType],
        rules: LayoutRules,
        lines: Sequence[ControlLine],
    ) -> None:
        self.zone, self.types, self.rules, self.lines = zone, types, rules, lines
        self.placed = Placements.empty()
        self._shapes = footprints(types, self.placed)
        self._ground = buildable(zone, rules)
        self._exits = ExitCheck(zone, types, rules)
        self._daylight = None if rules.sun.hours is None else Daylight(zone, types, rules.sun)
        self._floor = np.array([kind.floor_area_m2 for kind in types])
        self._cover = np.array([kind.footprint_m2 for kind in types])
        self._high = max(kind.height_m for kind in types)
        self._long = max(max(kind.length_m, kind.width_m) for kind in types)

    def at(self, kind: int, line: int, t: Floats) -> Placements:
        """Return buildings of a type on a line, `t` metres from its start, shape (n,)."""
        own = self.lines[line]
        start, end = np.asarray(own.start), np.asarray(own.end)
        share = np.asarray(t, dtype=float) / own.length if own.length else np.zeros(len(t))
        return Placements(
            np.full(len(t), kind, dtype=np.int64),
            start + share[:, None] * (end - start),
            np.full(len(t), own.facing_deg),
            np.full(len(t), own.patch, dtype=np.int64),
            np.full(len(t), line, dtype=np.int64),
        )

    def room_for(self, kind: int) -> bool:
        """Tell whether FAR, density and count allow one more building of a type."""
        area = self.zone.polygon.area
        floor = self._floor[self.placed.type].sum() + self._floor[kind]
        cover = self._cover[self.placed.type].sum() + self._cover[kind]
        most = self.types[kind].count
        return bool(
            floor <= self.rules.most_far * area
            and cover <= self.rules.most_density * area
            and (most is None or int((self.placed.type == kind).sum()) < most)
        )

    def possible(self, many: Placements) -> npt.NDArray[np.bool_]:
        """Tell quickly which places on a line are worth trying: without them `fits` says no.

        Parameters
        ----------
        many
            Single buildings of one patch, n of them.

        Returns
        -------
        numpy.ndarray
            Shape (n,): whether each is on the ground, in nobody's way and, by the coefficient
            rule, in the sun and shades nobody.
        """
        free = np.zeros(len(many), dtype=bool)
        if not len(many):
            return free
        free |= shapely.covers(self._ground[many.patch[0]], footprints(self.types, many))
        for tell in (self._crossing, self._dark):
            some = np.flatnonzero(free)
            if len(some) and len(self.placed):
                free[some[tell(many.take(some))]] = False
        return free

    def fits(self, one: Placements) -> bool:
        """Tell whether a building fits: ground, distance, groups, sun, ways out."""
        shape = footprints(self.types, one)[0]
        if not shapely.covers(self._ground[one.patch[0]], shape):
            return False
        if not (self._apart(one, shape) and self._spaced(one) and self._sunny(one)):
            return False
        # patches have their ways out of their own
        neighbours = self.placed.take(self.placed.patch == one.patch[0])
        return bool(self._exits.reached(neighbours.join(one)).all())

    def put(self, one: Placements) -> None:
        """Put a building down."""
        if self._daylight is not None:
            self._daylight.put(self.placed, one)
        self.placed = self.placed.join(one)
        self._shapes = np.append(self._shapes, footprints(self.types, one))

    def lift(self, at: int) -> Placements:
        """Take a building up again, and return it; those after it move up in the list."""
        stays = np.arange(len(self.placed)) != at
        one = self.placed.take(~stays)
        self.placed, self._shapes = self.placed.take(stays), self._shapes[stays]
        if self._daylight is not None:
            self._daylight.lift(self.placed, one, at)
        return one

    def _around(self, many: Placements, reach: float) -> Ints:
        """Return what stands no further than this from any of some buildings, or a bit more."""
        low, high = many.xy.min(axis=0) - reach, many.xy.max(axis=0) + reach
        within = (self.placed.xy >= low) & (self.placed.xy <= high)
        return np.flatnonzero(within.all(axis=1))

    def _crossing(self, many: Placements) -> npt.NDArray[np.bool_]:
        """Tell which of some buildings overlap one that stands, shape (n,)."""
        near = self.placed.take(self._around(many, 2 * self._long))
        return np.asarray(overlapping(self.types, many, near, WALL).any(axis=1))

    def _dark(self, many: Placements) -> npt.NDArray[np.bool_]:
        """Tell which of some buildings are shaded by or shade one that stands, shape (n,)."""
        dark = np.zeros(len(many), dtype=bool)
        rule = self.rules.sun
        if rule.hours is None:
            reach = self._high * rule.coefficient + 2 * self._long
            near = self.placed.take(self._around(many, reach))
            dark[shade_pairs(self.zone, self.types, many, near, rule)[:, 0]] = True
            dark[shade_pairs(self.zone, self.types, near, many, rule)[:, 1]] = True
        return dark

    def _sunny(self, one: Placements) -> bool:
        if self._daylight is not None:
            return self._daylight.allows(self.placed, one)
        return not bool(self._dark(one)[0])

    def _apart(self, one: Placements, shape: shapely.Geometry) -> bool:
        """Tell whether a building keeps the gap, or borders upon a group that may be longer."""
        # as far as a group reaches on either side
        near = self._around(one, max(2 * self._long, self.rules.group_m + self._long)
                            + self.rules.gap_m)  # fmt: skip
        if not len(near):
            return True
        distance = shapely.distance(self._shapes[near], shape)
        close = near[distance < self.rules.gap_m - ROUNDING]
        if not len(close):
            return True
        around, last = self.placed.take(near).join(one), len(near)
        if not (bordering(self.types, around) == last).any():
            return False
        group = groups_of(self.types, around)
        mates = near[group[:last] == group[last]]
        overlap = shapely.area(shapely.intersection(self._shapes[close], shape))
        long = group_lengths(self.types, around, group)[group[last]]
        return bool(
            np.isin(close, mates).all()
            and (overlap < ROUNDING_M2).all()
            and long <= self.rules.group_m + ROUNDING
        )

    def _spaced(self, one: Placements) -> bool:
        line = self.lines[one.line[0]]
        if line.spacing_m <= 0:
            return True
        own = self.placed.xy[self.placed.line == one.line[0]]
        return bool((np.hypot(*(own - one.xy).T) >= line.spacing_m - ROUNDING).all())
