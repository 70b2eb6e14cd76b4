"""Whether a sun rule can be met at all where a zone lies."""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ..rules import SunRule
from ..shape import facing_vectors
from ..types import Floats
from ..zone import Zone
from .rays import GRAZING
from .track import LOW_SUN_DEG, SunSteps, sun_steps

MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September",
    "October", "November", "December",
)  # fmt: skip
#: Closer to the equator than this the noon sun changes its side with the seasons, degrees.
TROPIC_DEG = 23.44
OTHER_DAY = (
    "Choose a day when the sun is higher (Day, Month), a longer window, fewer hours, or the "
    "coefficient of sunshine spacing instead of hours."
)


def check_sun(zone: Zone, rule: SunRule) -> list[str]:
    """Check that the sun of a rule shines on a zone, before anything is placed.

    Parameters
    ----------
    zone
        Gives place, grid, and the way that buildings of its patches shall look.
    rule
        The sun rule.

    Returns
    -------
    list of str
        Warnings, as sentences, each with what it means for the plan.

    Raises
    ------
    InputError
        If hours of sun are asked and no façade, whichever way it looks, can have them even with
        no other building: polar night, low sun, or too short a window.
    MissingDependencyError
        If pvlib is not installed.
    """
    steps = sun_steps(zone, rule)
    day, place = f"{rule.day} {MONTHS[rule.month - 1]}", f"latitude {zone.latitude:.1f}"
    window = f"between {rule.start:g} and {rule.end:g} h"
    if not rule.hours:
        return _by_coefficient(zone, steps, f"On {day}, {window}, at {place}")
    if not len(steps):
        raise InputError(
            f"On {day}, {window}, the sun does not rise above {LOW_SUN_DEG:g} degrees at {place}, "
            f"so no residence can have {rule.hours:g} h of sun.",
            OTHER_DAY,
        )
    best = float(_front(np.arange(0.0, 360.0, 5.0), steps).max())
    if best < rule.hours - 1e-6:
        raise InputError(
            f"On {day}, {window}, at {place} no façade has more than {best:.1f} h of sun even with "
            f"nothing in the way, fewer than the {rule.hours:g} h asked.",
            OTHER_DAY,
        )
    return _by_hours(zone, steps, rule.hours, f"On {day}, {window}, at {place}")


def _front(azimuths: Floats, steps: SunSteps) -> Floats:
    """Return the hours that the sun stands in front of façades of some grid azimuths."""
    front: Floats = steps.weight @ (steps.towards @ facing_vectors(azimuths).T > GRAZING)
    return front


def _by_hours(zone: Zone, steps: SunSteps, hours: float, when: str) -> list[str]:
    """Return a warning for each way to look that has too little sun."""
    wished = [
        zone.equator_deg if patch.facing_deg is None else patch.facing_deg
        for patch in zone.patches
        if patch.residences
    ] or [zone.equator_deg]
    azimuths = np.unique(np.round(wished, 3))
    texts = []
    for azimuth, has in zip(azimuths, _front(azimuths, steps)):
        if has < hours - 1e-6:
            true = (azimuth + zone.convergence_deg) % 360
            texts.append(
                f"{when}, façades that look to azimuth {true:.0f} have at most {has:.1f} h of sun, "
                f"fewer than the {hours:g} h asked: residences that look this way are left out. "
                "Let them look another way (Facing), ask for fewer hours, or choose another day."
            )
    return texts


def _by_coefficient(zone: Zone, steps: SunSteps, when: str) -> list[str]:
    """Return warnings where the coefficient says little about real sun."""
    if not len(steps):
        return [
            f"{when}, the sun does not rise above {LOW_SUN_DEG:g} degrees: the coefficient of "
            "sunshine spacing keeps buildings apart, but hours of sun are 0. Choose another day "
            "to see them."
        ]
    if abs(zone.latitude) < TROPIC_DEG:
        side = "south" if zone.latitude >= 0 else "north"
        return [
            f"At latitude {zone.latitude:.1f} the noon sun stands in the north in one part of the "
            f"year and in the south in the other. The coefficient of sunshine spacing protects "
            f"only the side of the balconies, here the {side} unless you choose another (Facing)."
        ]
    return []
