"""Hours of sun at balcony façades, by true shadows of the extruded buildings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..rules import SunRule
from ..shape import frames, sizes
from ..types import BuildingType, Floats, Placements
from ..zone import Zone
from .rays import GRAZING, NEEDED, SPOTS, Facades, hits, near_pairs
from .track import SunSteps, sun_steps


def sun_hours(
    zone: Zone, types: Sequence[BuildingType], placed: Placements, rule: SunRule
) -> Floats:
    """Give the hours of sun at the balcony façade of each building within the window of a rule.

    Spots at 1/4, 1/2 and 3/4 of the façade's length are looked at, at the height of the sill. The
    façade has sun while at least two of them have: the sun stands in front of the façade, at
    least `LOW_SUN_DEG` high and half a degree from its plane, and no other building, residence or
    facility, hides it. Instants are summed by the trapezoid rule. Ground is level; trees and what
    stands outside the zone hide nothing.

    Parameters
    ----------
    zone
        Gives place and grid.
    types
        Kinds of buildings.
    placed
        Buildings, n of them, all of which cast shadows.
    rule
        Date, window, step and sill; its coefficient and hours are not used.

    Returns
    -------
    numpy.ndarray
        Hours, shape (n,); 0 for all where the sun does not rise.

    Raises
    ------
    MissingDependencyError
        If pvlib is not installed.
    """
    steps = sun_steps(zone, rule)
    if not len(placed) or not len(steps):
        return np.zeros(len(placed))
    facades = Facades.of(types, placed, steps)
    lit = np.repeat(facades.front[:, :, None], len(SPOTS), axis=2)
    reach = reaches(types, placed, facades, rule.sill_m, float(steps.tangent.min()))
    for seen, by in near_pairs(facades, types, placed, reach):
        for hit in hits(facades, types, placed, (seen, by), steps, rule.sill_m):
            for spot in range(len(SPOTS)):
                lit[hit.step, seen[hit.pair[hit.hidden[:, spot]]], spot] = False
    sunny: Floats = steps.weight @ (lit.sum(axis=2) >= NEEDED)
    return sunny


def open_hours(
    zone: Zone, types: Sequence[BuildingType], placed: Placements, rule: SunRule
) -> Floats:
    """Give the hours of sun that each façade would have with no other building.

    Less than the rule asks for means that a residence must not look this way.

    Parameters
    ----------
    zone, types, placed, rule
        As for `sun_hours`.

    Returns
    -------
    numpy.ndarray
        Hours, shape (n,).

    Raises
    ------
    MissingDependencyError
        If pvlib is not installed.
    """
    del types  # the same for all kinds; kept for the likeness to `sun_hours`
    return front_hours(placed, sun_steps(zone, rule))


def front_hours(placed: Placements, steps: SunSteps) -> Floats:
    """Give the hours that the sun stands in front of façades, shape (n,)."""
    _, out = frames(placed)
    front: Floats = steps.weight @ (steps.towards @ out.T > GRAZING)
    return front


def reaches(
    types: Sequence[BuildingType],
    blockers: Placements,
    facades: Facades,
    sill_m: float,
    tangent: float,
) -> Floats:
    """Give how far from its centre a blocker may shade the middle of a façade, shape (m,).

    Parameters
    ----------
    types, blockers
        Buildings that cast shadows.
    facades
        What is looked at.
    sill_m
        Height that is looked at, metres.
    tangent
        Tangent of the least altitude of the sun that matters.
    """
    size = sizes(types, blockers)
    shadow = (size[:, 2] - sill_m) / tangent
    spread = np.hypot(size[:, 0], size[:, 1]) / 2 + facades.length.max() * SPOTS.max()
    reach: Floats = np.where(shadow > 0, shadow + spread, 0.0)
    return reach
