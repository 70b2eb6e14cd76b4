"""What is asked of the division of a city and of the design of its sub-regions."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import InputError

#: Classes of OpenStreetMap that divide a city, where nothing else is asked.
MAJOR = (
    "motorway", "motorway_link", "trunk", "trunk_link", "primary", "primary_link", "secondary",
    "secondary_link", "tertiary", "tertiary_link",
)  # fmt: skip
#: Classes from which nobody enters the ground beside them.
CLOSED = ("motorway", "motorway_link", "trunk_link", "type autoroutier", "autoroute")


@dataclass(frozen=True)
class CityRules:
    """How a municipality is divided, and where streets cross its major roads.

    Attributes
    ----------
    classes
        Road classes that divide, in lower case.
    level
        Roads of this level and above divide, too, where the layer says levels (1 major).
    thin
        Ground between roads that a disc of this radius hardly fits into is street space:
        medians, roundabouts, ground between ramps; metres.
    least_ha
        Smaller pieces of ground stay as they are, hectares.
    most_ha
        Larger sub-regions are cut further by new collectors, hectares.
    spacing
        Wished distance of the junctions along major roads, metres.
    tolerance
        Ends of streets nearer to each other than this along a road become one junction, metres.
    apart
        Junctions of the two sides of a road that are nearer than this are staggered, metres.
    """

    classes: tuple[str, ...] = MAJOR
    level: int = 1
    thin: float = 15.0
    least_ha: float = 1.0
    most_ha: float = 60.0
    spacing: float = 180.0
    tolerance: float = 20.0
    apart: float = 25.0

    def __post_init__(self) -> None:
        """Check the ranges; raise `InputError` that names the field."""
        for name in ("thin", "least_ha", "most_ha", "spacing", "tolerance", "apart"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name} must be greater than 0.", "Give a positive number.")
        if self.most_ha < 2 * self.least_ha:
            raise InputError(
                f"The largest sub-region ({self.most_ha:g} ha) is less than twice the least one "
                f"({self.least_ha:g} ha).",
                "Make it larger, or the least one smaller.",
            )
        if self.apart < self.tolerance:
            raise InputError(
                "apart is less than tolerance.", "Let junctions that stay apart be further apart."
            )
