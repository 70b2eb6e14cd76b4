"""How fast and how much traffic runs on a street: from its fields, else by its level."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd

from ..errors import InputError
from ..levels import COLLECTOR, CUL_DE_SAC, LOCAL, MAJOR
from ..site.osmlines import tag
from .types import BoolArray, FloatArray, IntArray

#: Metres per second in one km/h; kilometres in one mile.
KMH = 1 / 3.6
MILE = 1.609344
#: 40, 30, 20 and 20 miles per hour in km/h (CND section 5.1).
PAPER_SPEEDS: Mapping[int, float] = {
    MAJOR: 40 * MILE,
    COLLECTOR: 30 * MILE,
    LOCAL: 20 * MILE,
    CUL_DE_SAC: 20 * MILE,
}
#: Vehicles per hour that a lane carries where there are junctions: about half of what it carries
#: without them, less where people park and turn.
CAPACITIES: Mapping[int, float] = {MAJOR: 900.0, COLLECTOR: 700.0, LOCAL: 500.0, CUL_DE_SAC: 300.0}
#: Lanes of each direction where no field says.
LANES: Mapping[int, int] = {MAJOR: 2, COLLECTOR: 1, LOCAL: 1, CUL_DE_SAC: 1}
#: Speeds that a field may say (km/h); others are taken for mistakes.
SLOWEST, FASTEST = 3.0, 150.0
#: Most lanes of a street, and most vehicles per hour of a direction, that a field may say.
MOST_LANES, MOST_CAPACITY = 20, 50_000.0
#: OpenStreetMap's classes of streets by level; all others are local.
_CLASSES: Mapping[int, tuple[str, ...]] = {
    MAJOR: ("motorway", "trunk", "primary"),
    COLLECTOR: ("secondary", "tertiary"),
    CUL_DE_SAC: ("service", "track"),
}
_LEVELS = (MAJOR, COLLECTOR, LOCAL, CUL_DE_SAC)
_LIMIT = re.compile(r"(\d+(?:\.\d+)?)\s*(mph|km/?h|kph)?")


@dataclass(frozen=True)
class StreetRules:
    """What is taken of streets whose fields do not say it.

    Attributes
    ----------
    speeds
        Free speed by level, km/h.
    capacities
        Vehicles per hour and lane, by level.
    lanes
        Lanes of each direction, by level.
    own_speeds
        Whether a speed in the fields `speed_kmh` or `maxspeed` counts before the level's.
    """

    speeds: Mapping[int, float] = field(default_factory=lambda: dict(PAPER_SPEEDS))
    capacities: Mapping[int, float] = field(default_factory=lambda: dict(CAPACITIES))
    lanes: Mapping[int, int] = field(default_factory=lambda: dict(LANES))
    own_speeds: bool = True

    def check(self) -> None:
        """Raise `InputError` where a level has no speed, capacity or lane."""
        for what, values in (
            ("speed", self.speeds),
            ("capacity", self.capacities),
            ("number of lanes", self.lanes),
        ):
            for level in _LEVELS:
                if not values.get(level, 0) > 0:
                    msg = f"The {what} of streets of level {level} must be greater than 0."
                    raise InputError(msg, "Give a larger number.")


def levels_of(frame: gpd.GeoDataFrame) -> IntArray:
    """Level of each street, shape (n,): field `level`, else by `highway`, else local.

    Parameters
    ----------
    frame
        A layer of streets.
    """
    found = numbers_of(frame, "level")
    level = np.full(len(frame), LOCAL, dtype=np.int64)
    classes = tag(frame, "highway")
    for own, names in _CLASSES.items():
        level[np.isin(classes, [*names, *(f"{name}_link" for name in names)])] = own
    known = np.isin(found, _LEVELS)
    level[known] = found[known].astype(np.int64)
    return level


def speeds_of(frame: gpd.GeoDataFrame, level: IntArray, rules: StreetRules) -> FloatArray:
    """Free speed of each street, shape (n,), metres per second.

    Parameters
    ----------
    frame
        A layer of streets.
    level
        Shape (n,). See `levels_of`.
    rules
        What counts where no field says.
    """
    speed = _by_level(level, rules.speeds)
    if rules.own_speeds:
        for own in (_limits(tag(frame, "maxspeed")), numbers_of(frame, "speed_kmh")):
            good = (own >= SLOWEST) & (own <= FASTEST)
            speed[good] = own[good]
    return speed * KMH


def lanes_of(
    frame: gpd.GeoDataFrame, level: IntArray, one_way: BoolArray, rules: StreetRules
) -> IntArray:
    """Lanes of each direction of each street, shape (n,).

    The field `lanes` counts both directions, as in OpenStreetMap.

    Parameters
    ----------
    frame, level, rules
        See `speeds_of`.
    one_way
        Shape (n,). Streets with one direction.
    """
    lanes = _by_level(level, rules.lanes).astype(np.int64)
    own = _limits(tag(frame, "lanes"))
    good = (own >= 1) & (own <= MOST_LANES)
    share = np.where(one_way, own, own / 2)
    lanes[good] = np.maximum(1, np.floor(share[good])).astype(np.int64)
    return lanes


def capacities_of(
    frame: gpd.GeoDataFrame, level: IntArray, lanes: IntArray, rules: StreetRules
) -> FloatArray:
    """Vehicles per hour that a direction of each street carries, shape (n,).

    Parameters
    ----------
    frame, level, rules
        See `speeds_of`.
    lanes
        Shape (n,). See `lanes_of`.
    """
    capacity = _by_level(level, rules.capacities) * lanes
    own = numbers_of(frame, "capacity")
    good = (own > 0) & (own <= MOST_CAPACITY)
    capacity[good] = own[good]
    return np.asarray(capacity, dtype=np.float64)


def unusable(frame: gpd.GeoDataFrame) -> list[tuple[int, str]]:
    """List values of fields that are not used: row, and what is wrong.

    Parameters
    ----------
    frame
        A layer of streets.
    """
    found = []
    for name, low, high in (
        ("speed_kmh", SLOWEST, FASTEST),
        ("capacity", 1e-9, MOST_CAPACITY),
        ("lanes", 1, MOST_LANES),
    ):
        own = numbers_of(frame, name)
        for k in np.flatnonzero(~np.isnan(own) & ~((own >= low) & (own <= high))).tolist():
            found.append((k, f"{name} is {own[k]:g}: no sound value"))
    return found


def numbers_of(frame: pd.DataFrame, name: str) -> FloatArray:
    """Give a field as numbers, shape (n,); NaN where it is absent or not a number.

    Parameters
    ----------
    frame
        Any layer or table.
    name
        Name of the field.
    """
    if name not in frame.columns:
        return np.full(len(frame), np.nan)
    plain = [np.nan if isinstance(value, bool) else value for value in frame[name].tolist()]
    return np.asarray(pd.to_numeric(pd.Series(plain, dtype=object), errors="coerce"), dtype=float)


def _by_level(level: IntArray, values: Mapping[int, float] | Mapping[int, int]) -> FloatArray:
    table = np.array([0.0, *(float(values[k]) for k in _LEVELS)])
    return np.asarray(table[level], dtype=np.float64)


def _limits(values: npt.NDArray[np.object_]) -> FloatArray:
    """Speed limits or lanes as numbers, miles per hour as km/h; NaN where unreadable."""
    found = np.full(len(values), np.nan)
    for k, value in enumerate(values.tolist()):
        match = _LIMIT.fullmatch(str(value).strip())
        if match:
            found[k] = float(match.group(1)) * (MILE if match.group(2) == "mph" else 1.0)
    return found
