"""Hours of sun of buildings that are put down and taken up one by one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rules import SunRule
from ..shape import residences
from ..sun.hours import reaches
from ..sun.rays import NEEDED, SPOTS, Facades, hits, near_pairs
from ..sun.shade import ROUNDING_H
from ..sun.track import sun_steps
from ..types import BuildingType, Floats, Ints, Placements
from ..zone import Zone


class Daylight:
    """Counts for each façade, instant and spot how many buildings hide the sun.

    What one more building takes is found without looking at the others again; the hours are
    those of `sun.sun_hours`.

    Parameters
    ----------
    zone, types
        Place and kinds of buildings.
    rule
        A rule with hours.
    """

    def __init__(self, zone: Zone, types: Sequence[BuildingType], rule: SunRule) -> None:
        self.types, self.rule = types, rule
        self._steps = sun_steps(zone, rule)
        self._asked = (rule.hours or 0.0) - ROUNDING_H
        self._hidden: Ints = np.zeros((len(self._steps), 0, len(SPOTS)), dtype=np.int64)

    def allows(self, placed: Placements, one: Placements) -> bool:
        """Tell whether a new residence and all those around it have their hours.

        Parameters
        ----------
        placed
            What was put down and not taken up, in that order.
        one
            A single building.
        """
        home = bool(residences(self.types, one)[0])
        if home and self._hours(one, self._count(one, placed))[0] < self._asked:
            return False
        taken = self._count(placed, one)
        hit = np.flatnonzero(taken.any(axis=(0, 2)) & residences(self.types, placed))
        if not len(hit):
            return True
        left = self._hours(placed.take(hit), (self._hidden + taken)[:, hit])
        return bool((left >= self._asked).all())

    def put(self, placed: Placements, one: Placements) -> None:
        """Put a building down beside what is placed."""
        self._hidden = np.concatenate(
            [self._hidden + self._count(placed, one), self._count(one, placed)], axis=1
        )

    def lift(self, rest: Placements, one: Placements, at: int) -> None:
        """Take up the building with number `at`; the others stay."""
        self._hidden = np.delete(self._hidden, at, axis=1) - self._count(rest, one)

    def hours(self, placed: Placements) -> Floats:
        """Return the hours of sun of what stands, shape (n,)."""
        return self._hours(placed, self._hidden)

    def _hours(self, placed: Placements, hidden: Ints) -> Floats:
        if not len(self._steps):
            return np.zeros(len(placed))
        front = Facades.of(self.types, placed, self._steps).front
        lit = front & ((hidden == 0).sum(axis=2) >= NEEDED)
        return np.asarray(self._steps.weight @ lit, dtype=float)

    def _count(self, seen: Placements, by: Placements) -> Ints:
        """Return at which instants how many blockers hide which spots of façades, (k, n, 3)."""
        count: Ints = np.zeros((len(self._steps), len(seen), len(SPOTS)), dtype=np.int64)
        if not len(seen) or not len(by) or not len(self._steps):
            return count
        facades, sill = Facades.of(self.types, seen, self._steps), self.rule.sill_m
        reach = reaches(self.types, by, facades, sill, float(self._steps.tangent.min()))
        for pairs in near_pairs(facades, self.types, by, reach):
            for hit in hits(facades, self.types, by, pairs, self._steps, sill):
                np.add.at(count[hit.step], pairs[0][hit.pair], hit.hidden)
        return count
