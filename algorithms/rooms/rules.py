"""What a planner asks of floors and levels, beside the shapes of rooms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Optional

from ..errors import InputError

#: Types of levels by their route (CND-x section 5.3).
LevelType = Literal["branching", "circular", "linear"]
#: Side of the parts of a storey between which ways are short, in cells.
PART = 6.0
LEVEL_TYPES: tuple[LevelType, ...] = ("branching", "circular", "linear")


@dataclass(frozen=True)
class RoomRules:
    """What corridors or routes should do (CND section 4, Table 1), and how long to search.

    Weights are per module: lengths are divided by the length of a cell, so that they carry no
    unit. A weight of 0 allows, an infinite one forbids.

    Attributes
    ----------
    weight_length, weight_distance
        Cost of the length of corridors (CND lambda_L) and of the distance from each of their
        vertices to the nearest sink (lambda_D).
    dead_ends, branches, zigzags, too_close
        Cost of each: an end of a corridor that is no sink; a vertex with three corridors or more;
        two opposite turns over one cell; two corridors one cell apart.
    links
        Cost of each short way between neighbouring parts of a storey that is missing (CND section
        4.2 L1); 0 asks for none.
    part_size
        Side of these parts, metres; None for `PART` cells.
    detour
        By how many cells such a way may be longer than the shortest possible one.
    outer
        Whether corridors may run along outer walls.
    corridor_width
        Metres.
    time_limit
        Seconds for each storey.
    gap
        Relative gap at which to stop.
    seed
        Seed of every random choice.
    solver
        "auto", "cpsat", "highs" or another solver that PuLP finds.
    """

    weight_length: float = 1.0
    weight_distance: float = 0.0
    dead_ends: float = math.inf
    branches: float = 0.0
    zigzags: float = 5.0
    too_close: float = math.inf
    links: float = 0.0
    part_size: Optional[float] = None
    detour: float = 2.0
    outer: bool = False
    corridor_width: float = 2.0
    time_limit: float = 30.0
    gap: float = 0.0
    seed: int = 1
    solver: str = "auto"

    def __post_init__(self) -> None:
        """Check the ranges; raise `InputError` that names the field."""
        for name in ("weight_length", "weight_distance"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(f"{name} must be 0 or more.", "Give a finite number.")
        if self.weight_length == 0 and self.weight_distance == 0:
            raise InputError(
                "weight_length and weight_distance are both 0.", "Give one of them a weight."
            )
        for name in ("dead_ends", "branches", "zigzags", "too_close", "links", "detour", "gap"):
            if not getattr(self, name) >= 0:
                raise InputError(f"{name} must not be negative.", "Give 0 or more.")
        if self.part_size is not None and not 0 < self.part_size < math.inf:
            raise InputError("part_size must be greater than 0.", "Give metres, or nothing.")
        for name in ("corridor_width", "time_limit"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name} must be greater than 0.", "Give a positive number.")


@dataclass(frozen=True)
class RouteRules:
    """What is asked of the route of a level beside its type.

    Attributes
    ----------
    least_length, most_length
        Limits of the length of all of the route, metres; 0 and infinite for none.
    treasures
        Number of treasure rooms, exactly: blocks with one passage only in which the route neither
        begins nor ends. None for any number.

    Raises
    ------
    InputError
        If no route can keep them.
    """

    least_length: float = 0.0
    most_length: float = math.inf
    treasures: Optional[int] = None

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not 0 <= self.least_length < math.inf:
            raise InputError(
                f"The least length of the route is {self.least_length:g} m.", "Give 0 or more."
            )
        if not self.most_length > 0:
            raise InputError(
                f"The greatest length of the route is {self.most_length:g} m.",
                "Give a number greater than 0, or none.",
            )
        if self.least_length > self.most_length:
            raise InputError(
                f"The route is to be at least {self.least_length:g} m and at most "
                f"{self.most_length:g} m long.",
                "Give a least length below the greatest.",
            )
        if self.treasures is not None and self.treasures < 0:
            raise InputError(
                f"The number of treasure rooms is {self.treasures}.", "Give 0 or more."
            )

    def check(self, level_type: LevelType) -> None:
        """Raise `InputError` where a type of level cannot have the treasure rooms."""
        if self.treasures and level_type != "branching":
            raise InputError(
                f"A {level_type} level has no treasure rooms: its route passes through every "
                "block, and no way leads off.",
                "Choose the type 'branching', or ask for no number of treasure rooms.",
            )
