"""Whether the planning indices and the kinds of buildings fit together."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...errors import InputError
from ..rules import LayoutRules
from ..types import RESIDENCE, BuildingType

#: More ground than this is never left for buildings and green: paths, parking and streets.
MOST_GROUND = 0.85


def check_indices(types: Sequence[BuildingType], rules: LayoutRules, area_m2: float) -> list[str]:
    """Check that building types can reach the floor area ratio within the density, in a zone.

    Parameters
    ----------
    types
        Kinds of buildings.
    rules
        What is asked.
    area_m2
        Area of the zone, square metres.

    Returns
    -------
    list of str
        Warnings, as sentences: what will hardly be reached, and what to change.

    Raises
    ------
    InputError
        If the zone is smaller than the smallest residence, one building alone exceeds a limit,
        or even the highest kind cannot reach the floor area ratio within the limit of the density.
    """
    built = [kind for kind in types if kind.count != 0 and kind.share != 0]
    homes = [kind for kind in built if kind.use == RESIDENCE]
    if not homes:
        raise InputError(
            "No kind of building that may be built is a residence.",
            "Add a residence to the building types, or give one a count and a share above 0.",
        )
    _check_size(homes, rules, area_m2)
    reachable, left = _most_far(built, rules.most_density, area_m2)
    if reachable >= rules.far - 1e-9:
        return _density_warnings(homes, rules)
    if left > 1e-9:
        return [
            f"All buildings that the counts allow have a floor area ratio of {reachable:.2f}, less "
            f"than the {rules.far:g} asked. Raise the counts or leave one empty."
        ]
    highest = max(kind.storeys for kind in built)
    lower = math.floor(reachable * 100) / 100
    denser = math.ceil(rules.far / highest * 100) / 100
    higher = math.ceil(rules.far / rules.most_density - 1e-9)
    ways = [f"Lower the floor area ratio to {lower:g}"]
    if denser + rules.green <= 1:
        ways.append(f"raise the limit of the density to {denser:.0%} or more")
    raise InputError(
        f"The indices contradict each other: with at most {rules.most_density:.1%} of the zone "
        f"built on and at most {highest} storeys the floor area ratio is at most {reachable:.2f}, "
        f"less where streets and sun take their part, and {rules.far:g} is asked.",
        f"{', '.join(ways)}, or use more buildings of at least {higher} storeys.",
    )


def _most_far(types: Sequence[BuildingType], density: float, area_m2: float) -> tuple[float, float]:
    """Return the floor area ratio of the highest buildings, and the density that is left then."""
    reached, left = 0.0, density
    for kind in sorted(types, key=lambda kind: -kind.storeys):
        room = math.inf if kind.count is None else kind.count * kind.footprint_m2 / area_m2
        taken = min(left, room)
        reached += taken * kind.storeys
        left -= taken
    return reached, left


def _check_size(homes: Sequence[BuildingType], rules: LayoutRules, area_m2: float) -> None:
    """Raise where not even one residence has room, or one alone exceeds a limit."""
    least = min(homes, key=lambda kind: kind.footprint_m2)
    if area_m2 < least.footprint_m2:
        raise InputError(
            f"The zone ({area_m2:.0f} m2) is smaller than the smallest residence "
            f"'{least.name}' ({least.footprint_m2:.0f} m2).",
            "Give a larger zone or smaller building types.",
        )
    if least.footprint_m2 > rules.most_density * area_m2:
        raise InputError(
            f"One building '{least.name}' ({least.footprint_m2:.0f} m2) covers more than the limit "
            f"of the density, {rules.most_density:.1%} of the zone's {area_m2:.0f} m2.",
            "Give a larger zone or smaller building types, or raise the limit.",
        )
    light = min(homes, key=lambda kind: kind.floor_area_m2)
    if light.floor_area_m2 > rules.most_far * area_m2:
        raise InputError(
            f"One building '{light.name}' ({light.floor_area_m2:.0f} m2 of floor) has more than "
            f"the limit of the floor area ratio, {rules.most_far:.2f}, allows in a zone of "
            f"{area_m2:.0f} m2.",
            "Give a larger zone or smaller building types, or raise the limit.",
        )


def _density_warnings(homes: Sequence[BuildingType], rules: LayoutRules) -> list[str]:
    """Return what the usual mix of residences will hardly reach."""
    weight = np.array([1.0 if kind.share is None else kind.share for kind in homes])
    floor = float(weight @ [kind.floor_area_m2 for kind in homes])
    mean = floor / float(weight @ [kind.footprint_m2 for kind in homes])
    covered = rules.far / mean
    if covered > rules.most_density + 1e-9:
        return [
            f"A floor area ratio of {rules.far:g} needs mostly the highest buildings: the "
            f"residences have {mean:.1f} storeys in the mean, which reach "
            f"{rules.most_density * mean:.2f} on at most {rules.most_density:.1%} of the zone. "
            "Lower the floor area ratio, raise the density, or use higher types."
        ]
    if covered + rules.green > MOST_GROUND:
        return [
            f"A floor area ratio of {rules.far:g} takes about {covered:.0%} of the ground with "
            f"{mean:.1f} storeys in the mean; with {rules.green:.0%} green little is left for "
            "streets, paths and parking. Use higher types or ask for less green."
        ]
    return []
