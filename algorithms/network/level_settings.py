"""What may differ from one street level to the next (CND section 5.1)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ..errors import InputError

#: The street levels: major roads, collectors, local streets, culs-de-sac.
LEVELS = (1, 2, 3, 4)
MAJOR, CUL_DE_SAC = 1, 4
#: What only the design of a level asks for; major roads are never designed.
_SPEED = "speed_kmh"


@dataclass(frozen=True)
class LevelSettings:
    """What a planner asks of one street level; None means: as of the whole network.

    Attributes
    ----------
    coverage, coverage_unit
        Range within which every place has a street of this level or one above. For culs-de-sac
        with the planner's rules, in metres: deeper ground is served by one (default 0.55 times
        the block width).
    weight_length, weight_distance
        Costs of street length and of the way to the nearest sink (CND lambda_L, lambda_D).
    dead_ends
        Cost of each dead end; `math.inf` forbids them.
    time_share
        Share of the time that is left when the level begins, above 0 and at most 1.
    speed_kmh
        Design speed, greater than 0.

    Examples
    --------
    >>> LevelSettings(coverage=2, speed_kmh=40).changes()
    {'coverage': 2}
    """

    coverage: float | None = None
    coverage_unit: Literal["edges", "metres"] | None = None
    weight_length: float | None = None
    weight_distance: float | None = None
    dead_ends: float | None = None
    time_share: float | None = None
    speed_kmh: float | None = None

    def __post_init__(self) -> None:
        """Check the ranges; raise `InputError` that names the field."""
        if self.coverage_unit not in (None, "edges", "metres"):
            raise InputError(
                f"The coverage of a level cannot be in {self.coverage_unit}.",
                "Give 'edges' or 'metres'.",
            )
        for name in ("coverage", "weight_length", "weight_distance", "dead_ends"):
            value = getattr(self, name)
            if value is not None and not _at_least_nothing(value):
                raise InputError(f"{name} of a level must not be negative.", "Give 0 or more.")
        for name in ("coverage", "weight_length", "weight_distance"):
            if getattr(self, name) == math.inf:
                raise InputError(f"{name} of a level must be finite.", "Give a smaller number.")
        if self.time_share is not None and not (
            _at_least_nothing(self.time_share) and 0 < self.time_share <= 1
        ):
            raise InputError(
                "The share of the time of a level must be above 0 and at most 1.",
                "Give a share such as 0.5.",
            )
        if self.speed_kmh is not None and not (
            _at_least_nothing(self.speed_kmh) and 0 < self.speed_kmh < math.inf
        ):
            raise InputError("The speed of a level must be greater than 0.", "Give it in km/h.")

    def changes(self) -> dict[str, Any]:
        """Give what differs from the specification of the whole, by the name of its field."""
        own = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        return {
            name: value
            for name, value in own.items()
            if value is not None and name not in ("time_share", _SPEED)
        }


def checked(settings: Mapping[int, LevelSettings]) -> dict[int, LevelSettings]:
    """Return the settings of levels in order of the levels.

    Raises
    ------
    InputError
        If there is no such level, settings are none, or ask what a level does not have.
    """
    found = {}
    for level in sorted(settings, key=str):
        own = settings[level]
        if level not in LEVELS or not isinstance(own, LevelSettings):
            raise InputError(
                f"There are no settings for a street level {level}.",
                "Levels are 1 major, 2 collector, 3 local, 4 cul-de-sac.",
            )
        if level == MAJOR and own != LevelSettings(speed_kmh=own.speed_kmh):
            raise InputError(
                "Major roads (level 1) are given, not designed.",
                "Give no more than a speed for them.",
            )
        if level == CUL_DE_SAC and own.dead_ends == math.inf:
            raise InputError(
                "Culs-de-sac (level 4) end blind: dead ends cannot be forbidden there.",
                "Allow them at that level, or ask for no culs-de-sac.",
            )
        found[int(level)] = own
    return found


def to_plain(settings: Mapping[int, LevelSettings]) -> dict[str, dict[str, Any]]:
    """Return settings as JSON can hold them; infinity is the text "forbid".

    Examples
    --------
    >>> to_plain({2: LevelSettings(coverage=2.0, dead_ends=math.inf)})
    {'2': {'coverage': 2.0, 'dead_ends': 'forbid'}}
    """
    return {
        str(level): {
            name: "forbid" if value == math.inf else value
            for name, value in dataclasses.asdict(own).items()
            if value is not None
        }
        for level, own in settings.items()
    }


def from_plain(values: Any) -> dict[int, LevelSettings]:
    """Read what `to_plain` returned.

    Raises
    ------
    InputError
        If it is nothing of the kind.
    """
    remedy = "Give for each level (1 to 4) an object with its settings."
    if not isinstance(values, dict):
        raise InputError("The settings of the levels are none.", remedy)
    found = {}
    known = {f.name for f in dataclasses.fields(LevelSettings)}
    for key, own in values.items():
        if not str(key).isdecimal() or not isinstance(own, dict):
            raise InputError(f"The settings of level {key} are none.", remedy)
        unknown = sorted(set(own) - known)
        if unknown:
            raise InputError(
                f"Unknown settings of level {key}: {', '.join(unknown)}.",
                f"Known ones are: {', '.join(sorted(known))}.",
            )
        plain: dict[str, Any] = {n: math.inf if v == "forbid" else v for n, v in own.items()}
        found[int(key)] = LevelSettings(**plain)
    return checked(found)


def _at_least_nothing(value: Any) -> bool:
    """Whether a value is a number and not negative."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and value >= 0
