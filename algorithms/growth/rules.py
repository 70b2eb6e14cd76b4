"""What is asked of a growth: grammar, size, when to stop, and how near streets may come."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError
from .grammar import Grammar

#: People per metre of road: 154.15 per hectometre (CitySprout, read from its repository).
PEOPLE_PER_METRE = 1.5415
#: Least intersect radius, in units of the grammar: without any no street joins another, and their
#: number explodes.
LEAST_RADIUS = 0.01


@dataclass(frozen=True)
class GrowthRules:
    """Everything that a planner asks of streets that grow.

    Growth stops as soon as one of the four limits is reached, or nothing is left that grows.

    Attributes
    ----------
    grammar
        The production rules.
    scale
        Metres per unit of the grammar, greater than 0. CitySprout's unit is 100 m.
    intersect_radius
        Nodes nearer than this are joined (check 2 of CS), in units of the grammar, at least
        `LEAST_RADIUS`.
    iterations
        Most iterations, or None.
    max_segments
        Number of grown streets between nodes from which growth stops, or None.
    max_length
        Length of grown streets from which growth stops, metres, or None.
    population
        People from which growth stops, or None: length of grown streets (m) x `people_per_metre`.
    people_per_metre
        People that a metre of street stands for.
    min_angle
        Streets that would meet another at a smaller angle than this are not built, degrees, 0 to
        89. Not asked of streets as published.
    clearance
        Ends nearer than this to a street are joined to it, and streets that pass a junction
        nearer than this lead to it, as a share of `intersect_radius`, 0 to 1. Not asked of
        streets as published.
    as_published
        Grow as CitySprout does, for comparison: a node that is put on a street does not split
        it, and a street to a near node is not checked for crossings again.
    seed
        Of all random choices, a whole number, at least 0.

    Raises
    ------
    InputError
        If a number is out of bounds, or nothing ever stops the growth.
    """

    grammar: Grammar
    scale: float = 100.0
    intersect_radius: float = 0.8
    iterations: int | None = None
    max_segments: int | None = None
    max_length: float | None = None
    population: float | None = None
    people_per_metre: float = PEOPLE_PER_METRE
    min_angle: float = 30.0
    clearance: float = 0.5
    as_published: bool = False
    seed: int = 42

    def __post_init__(self) -> None:
        limits = {
            "number of iterations": self.iterations,
            "number of streets": self.max_segments,
            "length of streets": self.max_length,
            "population": self.population,
        }
        for what, limit in limits.items():
            if limit is not None and not limit > 0:
                raise InputError(
                    f"The {what} to stop at is {limit:g}.",
                    "Give a number greater than 0, or none.",
                )
        for what, whole in (
            ("number of iterations", self.iterations),
            ("number of streets", self.max_segments),
            ("seed", self.seed),
        ):
            if whole is not None and not (whole >= 0 and float(whole).is_integer()):
                raise InputError(
                    f"The {what} is {whole:g}.", "Give a whole number that is not negative."
                )
        if all(limit is None for limit in limits.values()):
            raise InputError(
                "Nothing says when growth stops.",
                "Give a number of iterations, of streets, of metres or of people.",
            )
        for what, value, low, high in (
            ("scale", self.scale, 1e-6, 1e6),
            ("intersect radius (nearness of junctions)", self.intersect_radius, LEAST_RADIUS, 1e6),
            ("number of people per metre", self.people_per_metre, 1e-9, 1e6),
            ("least angle between streets", self.min_angle, 0.0, 89.0),
            ("clearance (nearness of streets)", self.clearance, 0.0, 1.0),
        ):
            if not low <= value <= high:
                raise InputError(f"The {what} is {value:g}.", f"Give {low:g} to {high:g}.")

    @property
    def radius(self) -> float:
        """`intersect_radius` in metres."""
        return self.intersect_radius * self.scale
