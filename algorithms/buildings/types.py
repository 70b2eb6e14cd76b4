"""Kinds of buildings, and where buildings stand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

RESIDENCE, FACILITY = "residence", "facility"
#: Building patterns by their number (RZ Table 3).
EMPTY, ROWS, CENTRIC, ENCLOSED, SYMMETRICAL, DOTTED = range(6)
BUILDING_PATTERNS = ("empty", "rows", "centric", "enclosed", "symmetrical", "dotted")
#: Path patterns by their number (RZ Table 3); there is no pattern 0.
CIRCLE, DIRECT, ENDING = 1, 2, 3
PATH_PATTERNS = ("", "circle", "direct", "ending")


@dataclass(frozen=True)
class BuildingType:
    """A kind of building (RZ section 3: the vector (A, h, vb, pg) without its position).

    Attributes
    ----------
    name
        What the planner calls it.
    length_m
        Length of the façade with the balconies, metres.
    width_m
        Depth across that façade, metres.
    height_m
        Height, metres.
    storeys
        Number of floors, at least 1.
    use
        "residence" or "facility"; only residences must not stand in the shade.
    share
        Wished share of this type among the buildings of its use, by number; None for no wish.
    count
        Most buildings of this type in the zone, None for no limit. Facilities without a count
        stand one in each patch that asks for facilities, all such types together.
    entrance
        "same": the entrance is on the side of the balconies; "opposite": behind (RZ Fig. 4).
    dwellings
        Dwellings in one building.
    parking
        Parking places per dwelling (residence) or per 100 m2 of floor (facility).

    Raises
    ------
    InputError
        If a number is out of bounds or a word is unknown.
    """

    name: str
    length_m: float
    width_m: float
    height_m: float
    storeys: int
    use: str = RESIDENCE
    share: float | None = None
    count: int | None = None
    entrance: str = "opposite"
    dwellings: int = 0
    parking: float = 0.3

    def __post_init__(self) -> None:
        for what, value in (
            ("length", self.length_m),
            ("width", self.width_m),
            ("height", self.height_m),
            ("number of storeys", self.storeys),
        ):
            if not (np.isfinite(value) and value > 0):
                raise InputError(
                    f"The {what} of building type '{self.name}' is {value:g}.",
                    "Give more than 0.",
                )
        if self.use not in (RESIDENCE, FACILITY):
            raise InputError(
                f"The use of building type '{self.name}' is '{self.use}'.",
                "Choose residence or facility.",
            )
        if self.entrance not in ("same", "opposite"):
            raise InputError(
                f"The entrance of building type '{self.name}' is '{self.entrance}'.",
                "Choose same or opposite (the side of the balconies or the one behind).",
            )
        for what, number in (
            ("share", self.share),
            ("count", self.count),
            ("number of dwellings", self.dwellings),
            ("number of parking places", self.parking),
        ):
            if number is not None and not (np.isfinite(number) and number >= 0):
                raise InputError(
                    f"The {what} of building type '{self.name}' is {number:g}.",
                    "Give 0 or more.",
                )

    @property
    def footprint_m2(self) -> float:
        """Ground that one building covers, square metres."""
        return self.length_m * self.width_m

    @property
    def floor_area_m2(self) -> float:
        """Floor area of one building, square metres."""
        return self.footprint_m2 * self.storeys


@dataclass(frozen=True, eq=False)
class Placements:
    """Buildings by type, position and orientation: RZ's X = {(p, vb, s)} without those not built.

    Attributes
    ----------
    type
        Index of the building type, shape (n,).
    xy
        Centres, metres, shape (n, 2).
    facing
        Azimuth of the balcony side, degrees clockwise from grid north, shape (n,).
    patch, line
        Index of the patch and of the control line, shape (n,).
    """

    type: Ints
    xy: Floats
    facing: Floats
    patch: Ints
    line: Ints

    @classmethod
    def empty(cls) -> Placements:
        """Return no buildings."""
        none = np.zeros(0, dtype=np.int64)
        return cls(none, np.zeros((0, 2)), np.zeros(0), none, none)

    def __len__(self) -> int:
        return len(self.type)

    def take(self, which: Any) -> Placements:
        """Return some of the buildings, by index array or mask."""
        return Placements(
            self.type[which], self.xy[which], self.facing[which], self.patch[which],
            self.line[which],
        )  # fmt: skip

    def join(self, other: Placements) -> Placements:
        """Return these buildings and then the others."""
        return Placements(
            np.concatenate([self.type, other.type]),
            np.concatenate([self.xy, other.xy]),
            np.concatenate([self.facing, other.facing]),
            np.concatenate([self.patch, other.patch]),
            np.concatenate([self.line, other.line]),
        )
