"""Which residences stand in the shade, and of which building."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from ..rules import SunRule
from ..shape import frames, residences, sizes
from ..types import BuildingType, Floats, Ints, Placements
from ..zone import Zone
from .hours import front_hours, reaches, sun_hours
from .rays import NEEDED, SPOTS, Facades, hits, near_pairs
from .shadows import shadow_corners
from .track import SunSteps, sun_steps

#: A shadow must reach this far over a centre line to count, metres.
TOLERANCE_M = 0.01
#: Up to so many pairs are compared without a search tree.
FEW = 60_000
#: Hours that are missing by less than this are not.
ROUNDING_H = 1e-6


def shaded(
    zone: Zone, types: Sequence[BuildingType], placed: Placements, rule: SunRule
) -> npt.NDArray[np.bool_]:
    """Tell which residences stand in the shade under a sun rule (RZ section 3.1).

    By the coefficient rule those whose centre line touches the shadow rectangle of another
    building; by the rule of hours those whose façade has fewer hours of sun than asked.

    Parameters
    ----------
    zone
        Gives place and grid.
    types
        Kinds of buildings.
    placed
        Buildings, n of them.
    rule
        The sun rule.

    Returns
    -------
    numpy.ndarray
        Shape (n,); facilities are never in the shade.

    Raises
    ------
    MissingDependencyError
        If the rule of hours is asked for and pvlib is not installed.
    """
    home = residences(types, placed)
    if rule.hours is not None:
        return home & (sun_hours(zone, types, placed, rule) < rule.hours - ROUNDING_H)
    dark = np.zeros(len(placed), dtype=bool)
    dark[shade_pairs(zone, types, placed, placed, rule)[:, 1]] = True
    return dark


def shade_pairs(
    zone: Zone,
    types: Sequence[BuildingType],
    placed: Placements,
    others: Placements,
    rule: SunRule,
) -> Ints:
    """Give the pairs of a building and a residence that cannot both stand there for the sun.

    By the coefficient rule those where the centre line of the residence touches the shadow of the
    building (1 cm less than the shadow all round). By the rule of hours those where the building
    alone leaves the façade fewer hours than asked: a necessary condition, since several buildings
    together may still take more; and a façade that has too few hours by itself (`open_hours`) is
    in no pair.

    Parameters
    ----------
    zone
        Gives place and grid.
    types
        Kinds of buildings.
    placed
        Buildings that cast shadows.
    others
        Buildings of which the residences are looked at; may be the same as `placed`.
    rule
        The sun rule.

    Returns
    -------
    numpy.ndarray
        Indices into `placed` and into `others`, shape (m, 2), sorted. No building shades itself.

    Raises
    ------
    MissingDependencyError
        If the rule of hours is asked for and pvlib is not installed.
    """
    homes = np.flatnonzero(residences(types, others))
    if not len(placed) or not len(homes):
        return np.zeros((0, 2), dtype=np.int64)
    looked_at = others.take(homes)
    if rule.hours is None:
        by, seen = _by_coefficient(types, placed, looked_at, rule.coefficient)
    else:
        by, seen = _by_hours(types, placed, looked_at, rule, sun_steps(zone, rule))
    order = np.argsort(by * len(homes) + seen, kind="stable")
    return np.column_stack([by[order], homes[seen[order]]]).astype(np.int64)


def _by_coefficient(
    types: Sequence[BuildingType], placed: Placements, homes: Placements, coefficient: float
) -> tuple[Ints, Ints]:
    """Return pairs of a shadow rectangle and a centre line that it touches."""
    size = sizes(types, placed)
    along, out = frames(placed)
    depth = coefficient * size[:, 2]
    middle = placed.xy - out * ((size[:, 1] + depth) / 2)[:, None]
    half = np.column_stack([size[:, 0], depth]) / 2 - TOLERANCE_M
    line = frames(homes)[0] * sizes(types, homes)[:, :1] / 2
    if len(placed) * len(homes) <= FEW:
        by, seen = (
            found.reshape(-1)
            for found in np.meshgrid(np.arange(len(placed)), np.arange(len(homes)), indexing="ij")
        )
    else:
        by, seen = _boxes_meet(shadow_corners(types, placed, coefficient), homes.xy, line)
    # The line against the rectangle, in the frame of the rectangle: by the two sides' directions,
    # and by the direction across the line (separating axes).
    gap = homes.xy[seen] - middle[by]
    meet = np.ones(len(by), dtype=bool)
    local = np.empty((2, 2, len(by)))
    for axis, unit in enumerate((along, out)):
        local[0, axis] = _dot(gap, unit[by])
        local[1, axis] = _dot(line[seen], unit[by])
        meet &= np.abs(local[0, axis]) <= half[by, axis] + np.abs(local[1, axis])
    (x, y), (dx, dy) = local
    meet &= np.abs(x * dy - y * dx) <= half[by, 0] * np.abs(dy) + half[by, 1] * np.abs(dx)
    meet &= half[by].min(axis=1) > 0
    return by[meet], seen[meet]


def _boxes_meet(rings: Floats, xy: Floats, line: Floats) -> tuple[Ints, Ints]:
    """Return pairs of rings and lines (middle and half vector) whose upright boxes meet."""
    low, high = rings.min(axis=1), rings.max(axis=1)
    shadows = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    ends = shapely.linestrings(np.stack([xy - line, xy + line], axis=1))
    by, seen = shapely.STRtree(ends).query(shadows)
    return by.astype(np.int64), seen.astype(np.int64)


def _dot(one: Floats, two: Floats) -> Floats:
    """Return the dot products of rows."""
    product: Floats = np.einsum("ij,ij->i", one, two)
    return product


def _by_hours(
    types: Sequence[BuildingType],
    placed: Placements,
    homes: Placements,
    rule: SunRule,
    steps: SunSteps,
) -> tuple[Ints, Ints]:
    """Return pairs of a building and a façade to which it alone leaves too few hours."""
    none = np.zeros(0, dtype=np.int64)
    found = [(none, none)]
    spare = np.round(front_hours(homes, steps) - (rule.hours or 0.0) + ROUNDING_H, 9)
    # Façades that look the same way can spare the same; what spares much has near blockers only.
    for hours in np.unique(spare[spare > 0]) if len(steps) else ():
        some = np.flatnonzero(spare == hours)
        facades = Facades.of(types, homes.take(some), steps)
        reach = _reach(types, placed, facades, steps, rule.sill_m, float(hours))
        for seen, by in near_pairs(facades, types, placed, reach):
            lost = np.zeros(len(seen))
            for hit in hits(facades, types, placed, (seen, by), steps, rule.sill_m):
                dark = hit.pair[len(SPOTS) - hit.hidden.sum(axis=1) < NEEDED]
                lost[dark] += steps.weight[hit.step]
            too_much = lost > hours
            found.append((by[too_much], some[seen[too_much]]))
    by, seen = (np.concatenate(part) for part in zip(*found))
    return by, seen


def _reach(
    types: Sequence[BuildingType],
    placed: Placements,
    facades: Facades,
    steps: SunSteps,
    sill_m: float,
    hours: float,
) -> Floats:
    """Return how far from its centre a building may take more than some hours of sun alone."""
    # It must hide the sun up to this altitude at least,
    order = np.argsort(steps.tangent)
    first = int(np.searchsorted(np.cumsum(steps.weight[order]), hours))
    if first == len(steps):
        return np.zeros(len(placed))
    high = reaches(types, placed, facades, sill_m, float(steps.tangent[order][first]))
    # and over this angle. Of three spots in a row it hides two only if it hides the middle one,
    # so the angle is that at the middle.
    half_angle = _least_angle(steps, hours) / 2
    size = sizes(types, placed)
    radius = np.hypot(size[:, 0], size[:, 1]) / 2
    wide = radius / np.sin(min(half_angle, np.pi / 2)) if half_angle > 0 else np.inf
    return np.minimum(high, wide)


def _least_angle(steps: SunSteps, hours: float) -> float:
    """Return the least angle, radians, within which the sun spends at least some hours."""
    azimuth = np.arctan2(steps.towards[:, 0], steps.towards[:, 1])
    order = np.argsort(azimuth)
    round_twice = np.concatenate([azimuth[order], azimuth[order] + 2 * np.pi])
    spent = np.append(0.0, np.cumsum(np.tile(steps.weight[order], 2)))
    last = np.searchsorted(spent, spent[: len(steps)] + hours - ROUNDING_H) - 1
    return float((round_twice[last] - round_twice[: len(steps)]).min())
