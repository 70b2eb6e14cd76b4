"""What is asked of a residential zone: indices, sun, distances, weights and the method."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ..errors import InputError

#: Over a wished FAR or density without a limit of its own, so much is allowed.
SLACK = 1.05
METHODS = ("staged", "optimise")


@dataclass(frozen=True)
class SunRule:
    """When a residence counts as shaded.

    With `hours` None the coefficient rule of RZ section 3.1 holds: a building's shadow is the
    rectangle behind it, as long as its façade and `coefficient` x height deep, and no residence's
    centre line may touch the shadow of another building. Otherwise the balcony façade of each
    residence needs `hours` hours of sun in the window, by true shadows of the extruded buildings.

    Attributes
    ----------
    coefficient
        Sunshine spacing as a multiple of the height; greater than 0.
    hours
        Least hours of sun, or None for the coefficient rule.
    month, day
        Date of the check: 20 January (Great Cold) by default.
    start, end
        Window in true solar time, hours from 0 to 24.
    step_minutes
        Step in which the sun is followed, minutes.
    sill_m
        Height above the ground at which the façade is looked at, metres.

    Raises
    ------
    InputError
        If a number is out of bounds.
    """

    coefficient: float = 1.0
    hours: float | None = None
    month: int = 1
    day: int = 20
    start: float = 9.0
    end: float = 15.0
    step_minutes: float = 10.0
    sill_m: float = 0.9

    def __post_init__(self) -> None:
        days = (31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)
        if not (1 <= self.month <= 12 and 1 <= self.day <= days[self.month - 1]):
            raise InputError(f"There is no day {self.day} in month {self.month}.", "Give a date.")
        if not 0 <= self.start < self.end <= 24:
            raise InputError(
                f"The sun is looked at from {self.start:g} to {self.end:g} h.",
                "Give a beginning before the end, both from 0 to 24.",
            )
        if not (math.isfinite(self.coefficient) and self.coefficient > 0):
            raise InputError(
                f"The coefficient of sunshine spacing is {self.coefficient:g}.",
                "Give more than 0; 1 means as far as the building is high.",
            )
        if self.hours is not None and not 0 <= self.hours <= self.end - self.start:
            raise InputError(
                f"{self.hours:g} hours of sun are asked within {self.end - self.start:g} hours.",
                "Ask for fewer hours or look at a longer part of the day.",
            )
        if not 0 < self.step_minutes <= 60:
            raise InputError(
                f"The sun is followed in steps of {self.step_minutes:g} minutes.",
                "Give more than 0 and at most 60.",
            )


@dataclass(frozen=True)
class LayoutRules:
    """Everything that a planner asks of the layout of a zone.

    Attributes
    ----------
    far, density, green
        Wished floor area ratio, share of ground that is built on, and share that is green.
    far_limit, density_limit
        Never more than this; None: 5 % above the wish.
    green_limit
        Less than this is reported as a problem; None: the wish.
    sun
        When a residence counts as shaded.
    setback_m
        Least distance of buildings from the edge of their patch (street space, the edge of the
        zone, obstacles), metres.
    gap_m
        Least distance between buildings that do not border upon each other, metres.
    group_m
        Longest group of buildings that border upon each other, metres.
    step_m
        Step in which positions along a control line are tried, metres.
    path_m
        Width of paths, metres.
    tree_spacing_m
        Distance of trees along streets and paths, metres.
    weights
        w1, w2, w3 of RZ section 3.1 for remainder, grouping and ways.
    pattern_penalty
        M of RZ section 3.1.
    method
        "staged" (RZ Table 1) or "optimise".
    time_limit
        Most seconds for placing buildings in one zone.
    iterations
        Rounds of improvement, None for as many as the time allows. With a number the same seed
        gives the same plan on every machine.
    seed
        Of all random choices.

    Raises
    ------
    InputError
        If a number is out of bounds or the indices contradict each other.
    """

    far: float = 1.1
    density: float = 0.28
    green: float = 0.35
    far_limit: float | None = None
    density_limit: float | None = None
    green_limit: float | None = None
    sun: SunRule = field(default_factory=SunRule)
    setback_m: float = 5.0
    gap_m: float = 6.0
    group_m: float = 60.0
    step_m: float = 2.0
    path_m: float = 3.0
    tree_spacing_m: float = 10.0
    weights: tuple[float, float, float] = (10.0, 1.0, 1.0)
    pattern_penalty: float = 0.1
    method: str = "optimise"
    time_limit: float = 15.0
    iterations: int | None = None
    seed: int = 42

    def __post_init__(self) -> None:
        shares = {"density": self.density, "green ratio": self.green}
        if self.green_limit is not None:
            shares["limit of the green ratio"] = self.green_limit
        for what, share in shares.items():
            if not 0 <= share <= 1:
                raise InputError(
                    f"The {what} is {share:g}.", "Give a share of the zone's area, from 0 to 1."
                )
        if not (math.isfinite(self.far) and self.far > 0):
            raise InputError(f"The floor area ratio is {self.far:g}.", "Give more than 0.")
        if not self.density > 0:
            raise InputError("The density is 0.", "Give more than 0: nothing could be built.")
        if self.density + self.green > 1:
            raise InputError(
                f"A density of {self.density:g} and a green ratio of {self.green:g} are more than "
                "the whole zone.",
                "Lower one of them.",
            )
        for what, limit, wish in (
            ("floor area ratio", self.far_limit, self.far),
            ("density", self.density_limit, self.density),
        ):
            if limit is not None and not limit >= wish:
                raise InputError(
                    f"The limit of the {what}, {limit:g}, is below the wish, {wish:g}.",
                    "Raise the limit or lower the wish.",
                )
        for name in ("group_m", "step_m", "path_m", "tree_spacing_m", "time_limit"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"The value of {name} is {value:g}.", "Give more than 0.")
        for name in ("setback_m", "gap_m", "pattern_penalty"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"The value of {name} is {value:g}.", "Give 0 or more.")
        if self.method not in METHODS:
            raise InputError(
                f"Unknown method '{self.method}'.", f"Choose one of: {', '.join(METHODS)}."
            )
        if not (min(self.weights) >= 0 and 0 < sum(self.weights) < math.inf):
            raise InputError(
                f"The weights are {', '.join(f'{w:g}' for w in self.weights)}.",
                "Give 0 or more each, and more than 0 to one of them.",
            )
        for name in ("iterations", "seed"):
            value = getattr(self, name)
            if value is not None and value < 0:
                raise InputError(f"The value of {name} is {value:g}.", "Give 0 or more.")

    @property
    def most_far(self) -> float:
        """Floor area ratio that is never exceeded."""
        return self.far * SLACK if self.far_limit is None else self.far_limit

    @property
    def most_density(self) -> float:
        """Density that is never exceeded."""
        return min(1.0, self.density * SLACK if self.density_limit is None else self.density_limit)
