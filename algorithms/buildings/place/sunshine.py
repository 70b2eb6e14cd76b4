"""The sun rule as the program sees it: whom a building may shade, and what hours are left."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rules import LayoutRules
from ..shape import facing_vectors, residences
from ..sun.hours import sun_hours
from ..sun.shade import shade_pairs, shaded
from ..sun.track import sun_steps
from ..types import RESIDENCE, BuildingType, Floats, Ints, Placements
from ..zone import Zone
from .columns import Bools

#: Where no spacing leaves the asked hours, buildings keep this many heights apart.
FARTHEST = 3.0


class Sunshine:
    """Shadows for programs.

    Under the coefficient rule they are exact. Under the rule of hours the program keeps rows as
    far apart as an endless row in front would have to be; what several buildings take together
    from the side is found afterwards and cut off.

    Parameters
    ----------
    zone, types, rules
        Where, kinds of buildings, and the sun rule.
    """

    def __init__(self, zone: Zone, types: Sequence[BuildingType], rules: LayoutRules) -> None:
        self.zone, self.types, self.rule = zone, types, rules.sun
        self._height = np.array([t.height_m for t in types])
        self._deep = np.array([t.width_m for t in types]) / 2
        homes = [t.width_m / 2 for t in types if t.use == RESIDENCE]
        self._behind = max(homes, default=0.0)
        self._spacing: dict[float, float] = {}

    @property
    def exact(self) -> bool:
        """Tell whether programs know the rule exactly."""
        return self.rule.hours is None

    def reach(self, type_: Ints, facing: Floats) -> Floats:
        """Give how far behind its centre no centre line of a residence may lie, metres, (n,)."""
        if self.rule.hours is None:
            reach: Floats = self._deep[type_] + self.rule.coefficient * self._height[type_]
            return reach
        above = np.maximum(0.0, self._height[type_] - self.rule.sill_m)
        times = np.array([self._heights(round(float(f) % 360.0, 3)) for f in facing])
        reach = self._deep[type_] + times * above + self._behind
        return reach

    def _heights(self, facing: float) -> float:
        """Give the spacing, in heights, at which an endless row leaves a façade its hours."""
        if facing not in self._spacing:
            steps = sun_steps(self.zone, self.rule)
            ahead = steps.towards @ facing_vectors(np.array([facing]))[0]
            lit = ahead > 0
            length = ahead[lit] / steps.tangent[lit]
            order = np.argsort(length)
            hours = np.cumsum(steps.weight[lit][order])
            at = int(np.searchsorted(hours, (self.rule.hours or 0.0) - 1e-6))
            self._spacing[facing] = (
                min(FARTHEST, float(length[order][at])) if at < len(hours) else FARTHEST
            )
        return self._spacing[facing]

    def darkened(self, fresh: Placements, fixed: Placements) -> Bools:
        """Tell which new buildings cannot stand with those that do, by hours, shape (n,).

        They leave one of those too few hours, or have too few themselves.
        """
        if self.exact or not len(fresh):
            return np.zeros(len(fresh), dtype=bool)
        bad = np.zeros(len(fresh), dtype=bool)
        bad[shade_pairs(self.zone, self.types, fresh, fixed, self.rule)[:, 0]] = True
        bad[shade_pairs(self.zone, self.types, fixed, fresh, self.rule)[:, 1]] = True
        return bad

    def in_shade(self, placed: Placements) -> Bools:
        """Tell which residences of a plan are in the shade, shape (n,)."""
        return shaded(self.zone, self.types, placed, self.rule) & residences(self.types, placed)

    def blockers(self, placed: Placements, seen: int) -> Ints:
        """Return the buildings that take sun from one of a plan, and that one itself."""
        by = [seen]
        own = float(sun_hours(self.zone, self.types, placed.take([seen]), self.rule)[0])
        for other in range(len(placed)):
            if other != seen:
                both = placed.take([seen, other])
                if sun_hours(self.zone, self.types, both, self.rule)[0] < own - 1e-9:
                    by.append(other)
        return np.array(by, dtype=np.int64)
