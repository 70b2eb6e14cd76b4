"""What the choice of columns must keep to: FAR, density, numbers and shares of types."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rules import LayoutRules
from ..types import RESIDENCE, BuildingType, Floats, Ints
from ..zone import Zone
from .program import Limit

#: The number of a type may be off its wished share by this part of it and one building more.
OFF_SHARE = 0.1


class Limits:
    """Limits of a zone as rows of a program.

    Shares hold within 10 % and one building. A plan that is further off already, since its ground
    leaves no choice, may stay as far off, but no further.

    Parameters
    ----------
    zone, types, rules
        The ground, kinds of buildings, and what is asked.
    standing
        Buildings of the plan to improve by patch and type, shape (patches, types): facilities are
        asked for by their patches, so none of them may be lost.
    """

    def __init__(
        self, zone: Zone, types: Sequence[BuildingType], rules: LayoutRules, standing: Ints
    ) -> None:
        area = zone.polygon.area
        self.patches = len(zone.patches)
        self.types = types
        self._floor = np.array([t.floor_area_m2 for t in types]) / area
        self._ground = np.array([t.footprint_m2 for t in types]) / area
        self._most_far, self._most_density = rules.most_far, rules.most_density
        self._least = standing.sum(axis=0) * np.array([t.use != RESIDENCE for t in types])
        self._shares = _shares(types)
        self._excess = [max(0.0, float(row @ standing.sum(axis=0)) - 1.0) for row in self._shares]

    def rows(self, numbers: Ints, fixed: Ints) -> list[Limit]:
        """Return the limits for some columns while others stand.

        Parameters
        ----------
        numbers
            Buildings of each column by patch and type, shape (n, patches, types).
        fixed
            Those that stand by patch and type, shape (patches, types).
        """
        total, base = numbers.sum(axis=1), fixed.sum(axis=0)
        found = [
            _limit(total @ self._floor, self._most_far - float(base @ self._floor)),
            _limit(total @ self._ground, self._most_density - float(base @ self._ground)),
        ]
        for k, kind in enumerate(self.types):
            if kind.count is not None:
                found.append(_limit(total[:, k], kind.count - base[k]))
            elif kind.use != RESIDENCE and kind.share is None:
                # one in each patch that asks for facilities
                for p in range(self.patches):
                    found.append(_limit(numbers[:, p, k], 1 - fixed[p, k]))
            if self._least[k]:
                found.append(_limit(-total[:, k], base[k] - self._least[k]))
        for row, excess in zip(self._shares, self._excess):
            found.append(_limit(total @ row, 1.0 + excess - float(row @ base)))
        return [row for row in found if len(row.columns)]


def _limit(weight: Floats | Ints, high: float) -> Limit:
    """Return a limit on columns by their weights; what stands already is never too much."""
    columns = np.flatnonzero(weight)
    least = float(np.minimum(weight, 0).sum())
    return Limit(columns, weight[columns].astype(np.float64), max(float(high), least))


def _shares(types: Sequence[BuildingType]) -> list[Floats]:
    """Return rows r over types with r @ numbers <= 1 where shares hold."""
    rows = []
    for use in sorted({t.use for t in types}):
        same = np.array([t.use == use for t in types], dtype=np.float64)
        wished = sum(t.share or 0.0 for t in types if t.use == use)
        every = all(t.share is not None for t in types if t.use == use)
        if wished <= 0:
            continue
        # shares of all types are parts of their sum
        scale = 1.0 / wished if every or wished > 1 else 1.0
        for k, kind in enumerate(types):
            if kind.use != use or kind.share is None:
                continue
            own = np.zeros(len(types))
            own[k] = 1.0
            share = kind.share * scale
            rows.append(own - share * (1 + OFF_SHARE) * same)
            rows.append(share * (1 - OFF_SHARE) * same - own)
    return rows
