"""What the patterns of a patch have to go by: ground, sizes of buildings, sun spacing."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from ..rules import LayoutRules
from ..shape import facing_vectors
from ..sun import LOW_SUN_DEG, sun_track
from ..types import BuildingType, Floats
from ..zone import Patch, Zone
from .room import Room

#: Rows follow a side of the patch that is turned from the side of the equator by so much at most,
#: degrees; RZ's cost of orientation is below a tenth there.
FOLLOW = 22.5
#: Sides turned by less than this count as one direction, degrees.
ALIKE = 4.0
#: A direction must have this share of the edge of a patch to be followed.
NOTABLE = 0.15
#: Spacing by height where no spacing gives the hours of sun that are asked.
NO_SUN = 3.0
#: A building that is at most so many times as long as deep is a tower, not a slab.
TOWER = 1.35


@dataclass(frozen=True, eq=False)
class Need:
    """What one use asks of one patch.

    Attributes
    ----------
    zone, patch, rules
        The ground and what is asked.
    number
        Index of the patch.
    types
        Kinds of buildings of the use, none twice.
    ground
        The patch inset by the setback: what footprints may cover.
    facing_deg
        Azimuth of rows, degrees clockwise from grid north.
    sizes
        Length and width of the types, metres, shape (k, 2).
    pitch
        Least distance between the centre lines of a building and of the one behind it, by the
        type of both, metres, shape (k, k).
    """

    zone: Zone
    patch: Patch
    rules: LayoutRules
    number: int
    types: tuple[BuildingType, ...]
    ground: BaseGeometry
    facing_deg: float
    sizes: Floats
    pitch: Floats

    @functools.cached_property
    def room(self) -> Room:
        """Room in the frame of the rows."""
        return self.turned(self.facing_deg)

    @property
    def longest(self) -> float:
        """Longest façade, metres."""
        return float(self.sizes[:, 0].max())

    @property
    def shortest(self) -> float:
        """Shortest façade, metres."""
        return float(self.sizes[:, 0].min())

    @property
    def deepest(self) -> float:
        """Largest depth of a building, metres."""
        return float(self.sizes[:, 1].max())

    @property
    def towers(self) -> bool:
        """Tell whether most types are about as deep as long."""
        compact = (self.sizes.max(axis=1) / self.sizes.min(axis=1)) <= TOWER
        return bool(compact.mean() > 0.5)

    def turned(self, facing_deg: float) -> Room:
        """Give the room for buildings that face so; its frame depends on that and the patch."""
        return Room(self.ground, facing_deg, self.patch.polygon.bounds[:2])

    @functools.cached_property
    def parts(self) -> list[Polygon]:
        """The pieces of the ground, the largest first."""
        return sorted(shapely.get_parts(self.ground), key=lambda part: -part.area)


def need_of(
    zone: Zone, number: int, types: Sequence[BuildingType], rules: LayoutRules, use: str
) -> Need | None:
    """Collect what one use asks of a patch.

    Parameters
    ----------
    zone, number
        The zone and the index of the patch.
    types, rules
        Kinds of buildings, and what is asked.
    use
        "residence" or "facility".

    Returns
    -------
    Need or None
        None if no building of the use is wished or nothing is left of the ground.
    """
    patch = zone.patches[number]
    wished = tuple(t for t in types if t.use == use and t.share != 0 and t.count != 0)
    ground = patch.polygon.buffer(-rules.setback_m, join_style="mitre")
    if not wished or ground.is_empty:
        return None
    facing = rows_facing(patch, zone.equator_deg)
    return Need(
        zone, patch, rules, number, wished, ground, facing,
        np.array([(t.length_m, t.width_m) for t in wished]),
        _pitch(zone, wished, rules, facing),
    )  # fmt: skip


def rows_facing(patch: Patch, equator_deg: float) -> float:
    """Choose the azimuth that rows of a patch face.

    Its wished azimuth; else that of the prevailing sides of the patch if they are turned from the
    equator by 22.5 degrees at most (buildings parallel to streets look better, and RZ's cost of
    orientation hardly rises there); else the side of the equator.

    Parameters
    ----------
    patch
        The ground.
    equator_deg
        Azimuth of the side of the equator, degrees.

    Returns
    -------
    float
        Degrees clockwise from grid north, 0 to 360.

    Examples
    --------
    >>> from shapely.affinity import rotate
    >>> from shapely.geometry import MultiLineString, box
    >>> slanted = Patch(rotate(box(0, 0, 100, 60), 10), MultiLineString())
    >>> round(rows_facing(slanted, 180.0), 6)
    170.0
    """
    if patch.facing_deg is not None:
        return float(patch.facing_deg % 360.0)
    step = np.diff(shapely.get_coordinates(patch.polygon.exterior), axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    bearing = np.degrees(np.arctan2(step[:, 0], step[:, 1]))
    turn = (bearing - equator_deg) % 180.0 - 90.0
    # the other sides say the same with half the weight: end walls along them look well too
    side = np.abs(turn) > 45.0
    turn = np.where(side, turn - np.copysign(90.0, turn), turn)
    weight = length * np.where(side, 0.5, 1.0)
    near = np.abs(turn) <= FOLLOW
    if not near.any():
        return float(equator_deg)
    turn, weight = turn[near], weight[near]
    alike = np.abs(turn[:, None] - turn) <= ALIKE
    best = alike[int(np.argmax((alike * weight).sum(axis=1)))]
    if weight[best].sum() < NOTABLE * length.sum():
        return float(equator_deg)
    return float((equator_deg + np.average(turn[best], weights=weight[best])) % 360.0)


def _pitch(
    zone: Zone, types: tuple[BuildingType, ...], rules: LayoutRules, facing: float
) -> Floats:
    """Give the least distance of rows by the types in front and behind, metres, shape (k, k)."""
    half = np.array([t.width_m for t in types]) / 2
    height = np.array([t.height_m for t in types])
    apart = half[:, None] + half + rules.gap_m
    if types[0].use != "residence":
        return apart
    if rules.sun.hours is None:
        # the shadow may reach up to the centre line of the next (RZ section 3.1)
        return np.maximum(apart, (half + rules.sun.coefficient * height)[:, None])
    above = np.maximum(0.0, height - rules.sun.sill_m)
    return np.maximum(apart, (half + _spacing(zone, rules, facing) * above)[:, None] + half)


def _spacing(zone: Zone, rules: LayoutRules, facing: float) -> float:
    """Give the distance, by height, at which an endless row leaves the asked hours of sun.

    At an instant it throws a shadow of cos(azimuth - facing) / tan(altitude) times its height
    across; the hours are those with the shortest shadows. Where the sun does not shine on the
    façade long enough whatever stands in front, `NO_SUN` heights are taken.
    """
    rule = rules.sun
    track = sun_track(zone.latitude, zone.longitude, rule)
    azimuth = np.radians(track.azimuth_deg - zone.convergence_deg - facing)
    lit = (track.altitude_deg > LOW_SUN_DEG) & (np.cos(azimuth) > 0)
    reach = np.cos(azimuth[lit]) / np.tan(np.radians(track.altitude_deg[lit]))
    order = np.argsort(reach)
    hours = np.cumsum(track.weights[lit][order])
    asked = np.searchsorted(hours, float(rule.hours or 0.0) - 1e-6)
    return float(reach[order][asked]) if asked < len(hours) else NO_SUN


def azimuth_of(vector: Floats) -> float:
    """Give the azimuth of a vector, degrees clockwise from grid north, 0 to 360."""
    return float(np.degrees(np.arctan2(vector[0], vector[1])) % 360.0)


def turn_between(one: float, two: float) -> float:
    """Give the angle between two azimuths, degrees, 0 to 180."""
    return float(abs((one - two + 180.0) % 360.0 - 180.0))


def outward(facing_deg: float) -> Floats:
    """Give the unit vector of an azimuth, shape (2,)."""
    vector: Floats = facing_vectors(np.array([facing_deg]))[0]
    return vector
