"""What a planner asks of parcels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from ..errors import InputError

#: strips: rows along the streets; halving: recursive halves of the smallest rectangle around;
#: skeleton: faces of the straight skeleton, cut across (both after Vanegas et al. 2012).
Method = Literal["strips", "halving", "skeleton"]
#: What becomes of the width left over at the end of a row: shared by all its parcels, a parcel
#: that is as wide as what is left, or the last parcel takes it.
Remainder = Literal["redistribute", "last", "merge"]
#: What becomes of land too deep for two rows: a shared green, a lane with parcels along it, or
#: parcels behind others with an access strip of their own.
Deep = Literal["court", "lane", "flag"]


@dataclass(frozen=True)
class ParcelRules:
    """What a planner asks of parcels.

    Attributes
    ----------
    width, depth
        Of the parcel wished for, along the street and away from it; metres.
    min_frontage
        Least length along a street; metres.
    min_area, max_area
        Bounds of the area; square metres. None: 0.45 and 2.2 of width x depth.
    corner_width
        Parcels at corners of streets are this many times as wide as others.
    remainder, deep, method
        See `Remainder`, `Deep`, `Method`.
    lane_width
        Of a rear lane; metres.
    flag_width
        Of the access strip of a parcel behind another; metres.
    greens
        Whether pointed corners that suit no house become small greens.

    Raises
    ------
    InputError
        If a value is out of range, or two contradict each other.

    Examples
    --------
    >>> ParcelRules(width=18, depth=30).area
    540
    """

    width: float = 18.0
    depth: float = 30.0
    min_frontage: float = 6.0
    min_area: float | None = None
    max_area: float | None = None
    corner_width: float = 1.0
    remainder: Remainder = "redistribute"
    deep: Deep = "court"
    method: Method = "strips"
    lane_width: float = 6.0
    flag_width: float = 4.0
    greens: bool = True

    def __post_init__(self) -> None:
        for name in ("width", "depth", "min_frontage", "corner_width", "lane_width", "flag_width"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"The {name.replace('_', ' ')} of parcels is {value:g}.",
                    "Give a number greater than 0.",
                )
        for name, words in (("remainder", Remainder), ("deep", Deep), ("method", Method)):
            if getattr(self, name) not in get_args(words):
                raise InputError(
                    f"'{getattr(self, name)}' is no choice for {name}.",
                    f"Choose one of {', '.join(get_args(words))}.",
                )
        if self.least_area > self.largest_area:
            raise InputError(
                f"The least area of parcels, {self.least_area:g} m2, is above their largest, "
                f"{self.largest_area:g} m2.",
                "Give a least area below the largest.",
            )
        if not self.least_area <= self.area <= self.largest_area:
            raise InputError(
                f"Parcels of {self.width:g} m x {self.depth:g} m have {self.area:g} m2, which is "
                f"not between the least area, {self.least_area:g} m2, and the largest, "
                f"{self.largest_area:g} m2.",
                "Change the width and depth, or the bounds of the area.",
            )
        if self.min_frontage > self.width:
            raise InputError(
                f"The least frontage, {self.min_frontage:g} m, is above the width of parcels, "
                f"{self.width:g} m.",
                "Give a least frontage of at most the width.",
            )

    @property
    def area(self) -> float:
        """Area wished for, square metres."""
        return self.width * self.depth

    @property
    def least_area(self) -> float:
        """Least area, square metres."""
        return 0.45 * self.area if self.min_area is None else self.min_area

    @property
    def largest_area(self) -> float:
        """Largest area, square metres."""
        return 2.2 * self.area if self.max_area is None else self.max_area
