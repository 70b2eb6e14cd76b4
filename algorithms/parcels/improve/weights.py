"""How much each aim counts when streets are moved."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from ...errors import InputError


@dataclass(frozen=True)
class Weights:
    """Weights of the terms of the energy (UP section 6, eq. 3; `square` is an addition).

    Attributes
    ----------
    shape
        Regions are strips between two parallel curves, as far apart as rows of parcels ask.
    fairness
        Streets do not bend more than they must, also where they go on over a junction.
    closeness
        Streets stay where they are.
    square
        Streets meet others, and the edge of the site, at right angles.

    Raises
    ------
    InputError
        If a weight is negative or no number, or if closeness is not greater than 0.
    """

    shape: float = 1.0
    fairness: float = 0.8
    closeness: float = 0.2
    square: float = 1.5

    def __post_init__(self) -> None:
        for own in fields(self):
            value = getattr(self, own.name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(
                    f"The weight of {own.name} is {value:g}.", "Give a number of at least 0."
                )
        # without it, vertices that no other term knows could be anywhere
        if self.closeness <= 0:
            raise InputError("The weight of closeness is 0.", "Give a number greater than 0.")
