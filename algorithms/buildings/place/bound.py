"""A lower bound of the objective, from what buildings cost at least and bring at most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.optimize import linprog

from ..rules import LayoutRules
from ..shape import entrances
from ..types import RESIDENCE, BuildingType
from ..zone import ControlLine, Zone
from .candidates import Maker
from .score import WAY_M
from .stretches import stand


def lower_bound(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    lines: Sequence[ControlLine],
    maker: Maker,
) -> float:
    """Return a proven lower bound of the objective of any plan on these lines.

    A small linear program over the numbers of buildings of each type: they fill stretches of line
    without regard to sun and gaps, stand in groups of the best length, and walk straight.

    Parameters
    ----------
    zone, types, rules, lines
        What is asked.
    maker
        Knows where single buildings have room.

    Returns
    -------
    float
        0 or more.
    """
    worth, stretches = maker.worth, maker.stretches
    k = len(types)
    cost, most = np.zeros(k), np.zeros(k)
    for t, kind in enumerate(types):
        here = np.flatnonzero(stretches.type == t)
        if not len(here):
            continue
        free = stretches.high[here] - stretches.low[here]
        most[t] = np.floor(free / kind.length_m + 1e-6).sum() + len(here)
        if any(not lines[stretches.line[s]].along for s in here):
            most[t] = np.inf  # they may overlap along the line
        if kind.use != RESIDENCE and kind.share is None and kind.count is None:
            most[t] = min(most[t], len(zone.patches))
        if kind.count is not None:
            most[t] = min(most[t], kind.count)
        longest = max(maker.longest(t, int(stretches.line[s])) for s in here)
        cost[t] = worth.groups(np.array([longest]))[0] / longest
        cost[t] += worth.way * min(_shortest(zone, types, lines, maker, int(s)) for s in here)
    area, price = zone.polygon.area, worth.missing / 2
    floor = np.array([kind.floor_area_m2 for kind in types]) / area
    ground = np.array([kind.footprint_m2 for kind in types]) / area
    # variables: numbers, then what is missing of FAR and density as shares
    rows = np.zeros((4, k + 2))
    rows[0, :k], rows[0, k] = -worth.far, -1.0
    rows[1, :k], rows[1, k + 1] = -worth.density, -1.0
    rows[2, :k], rows[3, :k] = floor, ground
    found = linprog(
        np.append(cost, [price, price]) * 1e4,
        rows,
        [-1.0, -1.0, rules.most_far, rules.most_density],
        bounds=[*((0.0, m if np.isfinite(m) else None) for m in most), (0.0, 1.0), (0.0, 1.0)],
        method="highs",
    )
    return max(0.0, float(found.fun) / 1e4 * (1 - 1e-9)) if found.status == 0 else 0.0


def _shortest(
    zone: Zone,
    types: Sequence[BuildingType],
    lines: Sequence[ControlLine],
    maker: Maker,
    s: int,
) -> float:
    """Return the least cost of a way from a stretch: straight from its entrances to the street."""
    number, kind = int(maker.stretches.line[s]), int(maker.stretches.type[s])
    access = zone.patches[lines[number].patch].access
    if access.is_empty:
        return 0.0
    ends = np.array([maker.stretches.low[s], maker.stretches.high[s]])
    points, _ = entrances(types, stand(lines[number], number, kind, ends))
    return float(shapely.distance(shapely.LineString(points), access)) / WAY_M
