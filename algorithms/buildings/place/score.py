"""The objective of a placement (RZ sections 3.1 to 3.3), always counted in the same way.

All parts are sums over buildings and groups, so that a program can make them small as well.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ..layout import PathPlan, Score
from ..rules import LayoutRules
from ..shape import entrances, residences
from ..types import RESIDENCE, BuildingType, Floats, Ints, Placements
from ..zone import Zone
from .groups import group_lengths, groups_of

#: What sharing a gable saves of the cost of a building.
GABLE = 0.25
#: What a building beyond the longest group costs more.
TOO_LONG = 1.5
#: Metres that a turn, a step of roominess and an exit stand for, and what a way is measured by.
TURN_M, ROOMY_M, EXIT_M, WAY_M = 5.0, 5.0, 10.0, 100.0
#: Ways are so much longer than the straight line, where no paths are planned yet.
DETOUR = 1.3
#: Façades this near to the sun cost nothing (degrees).
TO_THE_SUN = 15.0


def score(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    placed: Placements,
    plan: PathPlan | None,
) -> Score:
    """Return the augmented objective of a placement and its parts.

    Parameters
    ----------
    zone, types, rules
        The ground, the kinds of buildings, what is asked.
    placed
        The buildings.
    plan
        Their paths; None for an estimate by `straight_ways`.

    Returns
    -------
    Score
    """
    needed = buildings_needed(zone, types, rules)
    group = groups_of(types, placed)
    ways = straight_ways(zone, types, placed) if plan is None else planned_ways(plan)
    facade = facing_cost(zone, placed.facing)[residences(types, placed)]
    s = remainder(zone, types, rules, placed)
    c = float(group_cost(types, rules, placed, group).sum()) / needed
    w = float(ways.sum()) / needed
    p = float(facade.sum()) / needed
    weights = np.asarray(rules.weights, dtype=float)
    total = float(weights @ (s, c, w) / weights.sum() + rules.pattern_penalty * p)
    return Score(s, c, w, p, total)


def buildings_needed(zone: Zone, types: Sequence[BuildingType], rules: LayoutRules) -> float:
    """Return how many residences of mean size the wished FAR takes, at least 1."""
    own = [t.floor_area_m2 for t in types if t.use == RESIDENCE] or [t.floor_area_m2 for t in types]
    return max(1.0, float(rules.far * zone.polygon.area / np.mean(own)))


def remainder(
    zone: Zone, types: Sequence[BuildingType], rules: LayoutRules, placed: Placements
) -> float:
    """Return S: the mean of what is missing of FAR and of density, as shares of the wishes."""
    area = zone.polygon.area
    floor = np.array([t.floor_area_m2 for t in types])[placed.type].sum() / area
    ground = np.array([t.footprint_m2 for t in types])[placed.type].sum() / area
    missing = max(0.0, 1 - floor / rules.far) + max(0.0, 1 - ground / rules.density)
    return float(missing / 2)


def group_cost(
    types: Sequence[BuildingType], rules: LayoutRules, placed: Placements, group: Ints
) -> Floats:
    """Return the cost of each group, linear in its length by sections (RZ section 3.1)."""
    if not len(placed):
        return np.zeros(0)
    count = np.bincount(group).astype(float)
    length = group_lengths(types, placed, group)
    beyond = np.maximum(0.0, length - rules.group_m) / (length / count)
    return np.asarray(count - GABLE * (count - 1) + TOO_LONG * np.ceil(beyond - 1e-9))


def facing_cost(zone: Zone, facing_deg: Floats) -> Floats:
    """Return what the direction of façades costs: 0 near the sun, 1 across, 2 away from it."""
    off = np.abs((facing_deg - zone.equator_deg + 180.0) % 360.0 - 180.0)
    return np.asarray(np.interp(off, [TO_THE_SUN, 90.0, 180.0], [0.0, 1.0, 2.0]))


def planned_ways(plan: PathPlan) -> Floats:
    """Return the cost of each building's way by its path (RZ section 3.3), shape (n,)."""
    metres = plan.length_m + TURN_M * plan.turns + ROOMY_M * plan.roomy + EXIT_M * plan.exits
    return np.asarray(metres / WAY_M)


def straight_ways(zone: Zone, types: Sequence[BuildingType], placed: Placements) -> Floats:
    """Estimate the cost of each building's way by the nearest exit as the crow flies."""
    cost = np.zeros(len(placed))
    points = shapely.points(entrances(types, placed)[0])
    for at, patch in enumerate(zone.patches):
        own = placed.patch == at
        if own.any() and not patch.access.is_empty:
            away = shapely.distance(points[own], patch.access)
            cost[own] = (DETOUR * away + EXIT_M / 2) / WAY_M
    return cost
