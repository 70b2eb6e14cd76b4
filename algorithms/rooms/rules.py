"""What a planner asks of floors and levels, beside the shapes of rooms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ..errors import InputError

#: Types of levels by their route (CND-x section 5.3).
LevelType = Literal["branching", "circular", "linear"]
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
        for name in ("dead_ends", "branches", "zigzags", "too_close", "gap"):
            if not getattr(self, name) >= 0:
                raise InputError(f"{name} must not be negative.", "Give 0 or more.")
        for name in ("corridor_width", "time_limit"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name} must be greater than 0.", "Give a positive number.")
