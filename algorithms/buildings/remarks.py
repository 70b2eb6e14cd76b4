"""What a planner should know of a finished layout: what was asked and not reached, and why."""

from __future__ import annotations

import math

import numpy as np

from .details.parking import places_needed
from .layout import Finding, Layout
from .rules import LayoutRules
from .types import EMPTY

#: FAR and parking this much below the wish are told (share of the wish). Less density is no fault.
SHORT = 0.02
#: Longer ways from an entrance to a street are told (metres).
FAR_OFF = 150.0


def shortfalls(layout: Layout, rules: LayoutRules) -> list[Finding]:
    """Tell what was asked of a zone and is not reached.

    Parameters
    ----------
    layout
        The layout.
    rules
        What was asked.

    Returns
    -------
    list of Finding
        Each with a remedy that fits the rules in force.
    """
    patches = [own for own in layout.zone.patches if not own.access.is_empty]
    if not patches:
        return []  # that no street leads here is told already
    if all(own.residences == own.facilities == EMPTY for own in patches):
        return [
            Finding(
                "All patches of this zone are to stay empty.",
                "Give residences or facilities a pattern.",
                "error",
                layout.zone.polygon.representative_point(),
            )
        ]
    if not len(layout.placements):
        return [
            Finding(
                "No building has room in this zone.",
                "Use smaller types, a smaller setback or a larger zone, or let fewer corridors "
                "cut it.",
                "error",
                layout.zone.polygon.representative_point(),
            )
        ]
    homes = any(own.residences != EMPTY for own in patches)
    return [
        *(_floor(layout, rules) if homes else []),
        *_green(layout, rules),
        *_parking(layout),
        *_ways(layout),
    ]


def _floor(layout: Layout, rules: LayoutRules) -> list[Finding]:
    area = layout.zone.polygon.area
    floor = np.array([own.floor_area_m2 for own in layout.types])[layout.placements.type].sum()
    if floor / area >= rules.far * (1 - SHORT):
        return []
    sun = "less sun spacing" if rules.sun.hours is None else "fewer hours of sun"
    return [
        Finding(
            f"The floor area ratio is {floor / area:.2f}, less than {rules.far:.2f} that is asked.",
            f"Use higher or deeper types, {sun}, a smaller setback, another pattern, or more time.",
            "warning",
            layout.zone.polygon.representative_point(),
        )
    ]


def _green(layout: Layout, rules: LayoutRules) -> list[Finding]:
    green = sum(plot.area for plot in layout.details.green) / layout.zone.polygon.area
    asked = rules.green if rules.green_limit is None else rules.green_limit
    if green >= asked:
        return []
    return [
        Finding(
            f"The green ratio is {green:.2f}, less than {asked:.2f} that is asked.",
            "Use higher types, fewer parking places or narrower corridors.",
            "warning",
            layout.zone.polygon.representative_point(),
        )
    ]


def _parking(layout: Layout) -> list[Finding]:
    places = sum(layout.details.places)
    needed = float(places_needed(layout.types, layout.placements).sum())
    if places >= math.floor(needed * (1 - SHORT)):
        return []
    return [
        Finding(
            f"There is room for {places} parking places beside streets, and {math.ceil(needed)} "
            "are asked.",
            "Ask for fewer, let more streets run through the zone, or put the others under ground.",
            "warning",
            layout.zone.polygon.representative_point(),
        )
    ]


def _ways(layout: Layout) -> list[Finding]:
    """Tell of patches from which it is far to a street."""
    told = []
    for at, patch in enumerate(layout.zone.patches):
        ways = layout.paths.length_m[layout.placements.patch == at]
        if len(ways) and ways.max() > FAR_OFF:
            told.append(
                Finding(
                    f"From patch {at + 1} ({patch.polygon.area / 1e4:.1f} ha) ways of up to "
                    f"{ways.max():.0f} m lead to a street.",
                    "Lead a corridor through it, or choose direct paths.",
                    "warning",
                    patch.polygon.representative_point(),
                )
            )
    return told
