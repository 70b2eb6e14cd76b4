"""A zone that has been laid out: paths, what fills the ground, the objective, findings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from .types import BuildingType, Floats, Ints, Placements
from .zone import Zone


@dataclass(frozen=True)
class Path:
    """A footpath or access lane (RZ's lower grade of road).

    Attributes
    ----------
    line
        Smooth centre line, metres.
    kind
        "entrance" (to one building), "group" (along a group) or "shared" (to an exit that
        several use).
    buildings
        Indices of the buildings whose way out uses it.
    exit
        Where it meets street space, None if it ends on another path.
    turns
        Number of turns.
    patch
        Index of the patch.
    """

    line: LineString
    kind: str
    buildings: tuple[int, ...]
    exit: Point | None
    turns: int
    patch: int


@dataclass(frozen=True, eq=False)
class PathPlan:
    """The paths of a zone and what they cost each building (RZ section 3.3).

    Attributes
    ----------
    paths
        The paths.
    reached
        Whether a building's entrance is connected to street space, shape (n,).
    length_m, turns, roomy, exits
        Per building, shape (n,): length of its way from the entrance to street space, metres;
        turns on it; roomy degree E (0 to 2, larger is narrower or less even); its share of an
        exit (1 / buildings that use it).
    """

    paths: tuple[Path, ...]
    reached: npt.NDArray[np.bool_]
    length_m: Floats
    turns: Floats
    roomy: Floats
    exits: Floats


@dataclass(frozen=True)
class Score:
    """The augmented objective O = (w1 S + w2 C + w3 W) / (w1 + w2 + w3) + M P (RZ section 3.1).

    Attributes
    ----------
    remainder
        S, 0 to 1: mean of what is missing of the wished FAR and of the wished density.
    grouping
        C: cost of groups for the number of buildings that the FAR needs.
    ways
        W: cost of paths for the same number.
    pattern
        P: distance from the pattern for the same number.
    total
        O.
    """

    remainder: float
    grouping: float
    ways: float
    pattern: float
    total: float


@dataclass(frozen=True, eq=False)
class Details:
    """What fills the ground between buildings and paths.

    Attributes
    ----------
    green
        Plots of green, disjoint from buildings, paths, parking and streets.
    trees
        Positions, shape (n, 2), metres.
    tree_of
        "corridor", "path" or "green" per tree.
    parking
        Rectangles of parking bays beside streets.
    places
        Parking places per rectangle.
    """

    green: tuple[Polygon, ...]
    trees: Floats
    tree_of: tuple[str, ...]
    parking: tuple[Polygon, ...]
    places: tuple[int, ...]


@dataclass(frozen=True)
class Finding:
    """Something that the planner should know about a plan, with its place.

    Attributes
    ----------
    problem
        What is the matter, as a sentence.
    action
        What was done, or what to do.
    severity
        "info", "warning" or "error".
    place
        Geometry concerned, working CRS.
    """

    problem: str
    action: str
    severity: str
    place: BaseGeometry


@dataclass(frozen=True, eq=False)
class Layout:
    """A laid out zone.

    Attributes
    ----------
    zone
        The ground.
    types
        Kinds of buildings.
    placements
        Where buildings stand.
    group
        Group of each building: buildings that border upon each other, shape (n,).
    sun_hours
        Hours of sun at the balcony façade within the window of the rule, shape (n,).
    shadows
        Shadow by the sun rule per building.
    paths
        Ways out.
    details
        Green, trees, parking.
    score
        Objective and its parts.
    method, seed, seconds
        How it was made.
    findings
        What could not be done.
    """

    zone: Zone
    types: tuple[BuildingType, ...]
    placements: Placements
    group: Ints
    sun_hours: Floats
    shadows: tuple[BaseGeometry, ...]
    paths: PathPlan
    details: Details
    score: Score
    method: str
    seed: int
    seconds: float
    findings: tuple[Finding, ...] = field(default_factory=tuple)
