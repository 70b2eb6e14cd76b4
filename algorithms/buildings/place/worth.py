"""What a set of buildings is worth: RZ's objective as sums over buildings and groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..rules import LayoutRules
from ..types import RESIDENCE, BuildingType, Floats, Ints
from ..zone import Zone
from .score import GABLE, buildings_needed, facing_cost


@dataclass(frozen=True, eq=False)
class Worth:
    """The objective of RZ section 3.1, taken apart so that a linear program can hold it.

    O = missing / 2 (max(0, 1 - sum of far) + max(0, 1 - sum of density)) + sum of all other costs.

    Attributes
    ----------
    missing
        Price of the remainder S: w1 / (w1 + w2 + w3).
    far, density
        What one building of a type adds to the wished FAR and density, as a share of the wish,
        shape (types,).
    gable, way, turn
        Price of a group's cost 1, of a way 1 and of a pattern distance 1.
    group_m
        Longest group, metres.
    zone
        Says where the equator is.
    length
        Façade of the types, metres, shape (types,).
    residence
        Which types are residences, shape (types,).
    """

    missing: float
    far: Floats
    density: Floats
    gable: float
    way: float
    turn: float
    group_m: float
    zone: Zone
    length: Floats
    residence: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, zone: Zone, types: Sequence[BuildingType], rules: LayoutRules) -> Worth:
        """Take the objective apart for a zone."""
        area = zone.polygon.area
        floor = np.array([t.floor_area_m2 for t in types])
        ground = np.array([t.footprint_m2 for t in types])
        number = buildings_needed(zone, types, rules)
        w1, w2, w3 = rules.weights
        total = w1 + w2 + w3
        return cls(
            missing=w1 / total,
            far=floor / (rules.far * area),
            density=ground / (rules.density * area),
            gable=w2 / total / number,
            way=w3 / total / number,
            turn=rules.pattern_penalty / number,
            group_m=rules.group_m,
            zone=zone,
            length=np.array([t.length_m for t in types]),
            residence=np.array([t.use == RESIDENCE for t in types], dtype=bool),
        )

    def turned(self, type_: Ints, facing: Floats) -> Floats:
        """Give the pattern distance of buildings, shape (n,): 0 for those that face the sun."""
        return np.where(self.residence[type_], facing_cost(self.zone, facing), 0.0)

    def remainder(self, type_: Ints) -> float:
        """Give the cost of what buildings of these types leave of the wishes."""
        far = max(0.0, 1.0 - float(self.far[type_].sum()))
        density = max(0.0, 1.0 - float(self.density[type_].sum()))
        return self.missing / 2 * (far + density)

    def groups(self, count: Ints) -> Floats:
        """Give what groups of so many buildings cost, none of them too long, shape (n,)."""
        return self.gable * (count - GABLE * np.maximum(0, count - 1))
