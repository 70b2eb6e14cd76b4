"""From an outline, shapes of blocks and a type to a game level (CND-x section 5.3)."""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional

import numpy as np
from shapely.geometry import MultiPoint, Point

from ..errors import InfeasibleError, InputError
from ..mesh.quadmesh import BoolArray, FloatArray, IntArray
from ..network.problem import Clause, NetworkProblem, Pattern
from ..network.requirements.base import Requirement
from ..network.requirements.budget import LeastLength, LengthBudget
from ..progress import Progress, Silent
from .design import room_problem, solve_storey
from .floors import Floor, Remark
from .rules import LEVEL_TYPES, LevelType, RoomRules, RouteRules
from .types import RoomPlan, RoomProblem, Template, Treasures
from .why import NoPlanError

#: Number of places where the route begins or ends, least and most, by type of level.
PLACES = {"branching": (1, math.inf), "circular": (1, 1), "linear": (2, 2)}
#: Where no place is given so many are tried one after the other, while less than this share of the
#: time has gone.
ATTEMPTS, PATIENCE = 4, 0.5
#: Places that are moved by more than this many cells are told.
TOLD = 1.5


@dataclass(frozen=True, eq=False)
class LevelDesign:
    """A level with its plan.

    Attributes
    ----------
    floor
        Outline and mesh, with the sinks as they were used.
    problem, plan
        What was asked, and the plan.
    start, goal
        Vertices where the route begins and ends; the goal is None where the layers choose it.
    remarks
        What was moved or assumed.
    """

    floor: Floor
    problem: RoomProblem
    plan: RoomPlan
    start: int
    goal: Optional[int]
    remarks: tuple[Remark, ...]


def design_level(
    floor: Floor,
    templates: Sequence[Template],
    rules: RoomRules,
    level_type: LevelType = "branching",
    places: Sequence[tuple[float, float]] = (),
    progress: Optional[Progress] = None,
    route: Optional[RouteRules] = None,
) -> LevelDesign:
    """Partition a domain into blocks with a route through all of them.

    Parameters
    ----------
    floor
        Outline as a mesh; its own sinks are not used.
    templates
        Admissible shapes of blocks.
    rules
        Weights and limits; branches and the like follow from the type.
    level_type
        "branching", "circular" (one ring through the start) or "linear" (from start to goal).
    places
        Where the route begins and ends, metres in the CRS of the floor: the start first. Those
        that are missing are chosen: the start at the middle, start and goal of a linear level far
        apart at the border.
    progress
        Told of plans, asked for cancellation.
    route
        Limits of the length of the route, and the number of treasure rooms.

    Raises
    ------
    InputError
        If there are too many places for the type, no way can begin anywhere, or the type has no
        treasure rooms and some are asked for.
    InfeasibleError
        If there is no level, or none was found in time; see `solve_rooms`.
    CancelledError
        If the run was cancelled before there was any plan.
    """
    if level_type not in LEVEL_TYPES:
        raise InputError(
            f"Unknown type of level '{level_type}'.", f"Give one of {', '.join(LEVEL_TYPES)}."
        )
    wanted = route or RouteRules()
    wanted.check(level_type)
    asked = _rules_of(rules, level_type)
    bare = room_problem(floor, templates, asked, "level")
    progress, begun = progress or Silent(), time.monotonic()
    told = ""
    for attempt in range(ATTEMPTS):
        chosen, remarks = _sinks(floor, bare.network.candidate, level_type, places, attempt)
        own = dataclasses.replace(bare, treasures=_treasures(wanted, chosen, level_type))
        strict = dataclasses.replace(own, network=_route(bare.network, chosen, level_type, wanted))
        left = asked.time_limit - (time.monotonic() - begun)
        try:
            plan = solve_storey(strict, dataclasses.replace(asked, time_limit=left), progress)
            break
        except NoPlanError:
            raise  # whatever the start is
        except InfeasibleError:
            # a start that was chosen may itself be what stands in the way
            short = time.monotonic() - begun > PATIENCE * asked.time_limit
            if told == str(chosen) or short or not remarks or attempt == ATTEMPTS - 1:
                raise
            told = str(chosen)
    sinks = np.zeros(len(floor.sinks), dtype=np.bool_)
    sinks[chosen] = True
    limits = strict.network.requirements
    network = dataclasses.replace(bare.network, sinks=sinks, requirements=limits)
    problem = dataclasses.replace(own, network=network)
    used = dataclasses.replace(floor, sinks=sinks)
    goal = chosen[1] if len(chosen) > 1 else None
    moved = _moved(floor, chosen, places)
    return LevelDesign(used, problem, plan, chosen[0], goal, (*remarks, *moved))


def _rules_of(rules: RoomRules, level_type: LevelType) -> RoomRules:
    """Return the rules of a type of level; neither turns nor near ways matter in a level."""
    branches = 0.0 if level_type == "branching" else math.inf
    ends = 0.0 if level_type == "branching" else math.inf
    return dataclasses.replace(
        rules, branches=branches, dead_ends=max(ends, 0.0), too_close=0.0, zigzags=0.0
    )


def _treasures(
    wanted: RouteRules, chosen: Sequence[int], level_type: LevelType
) -> Optional[Treasures]:
    """Return how many dead ends make the number of treasure rooms that is asked for.

    Without a second place the goal is put into the farthest dead end, which is then no treasure
    room.
    """
    number = wanted.treasures
    if number is None or level_type != "branching":
        return None
    if len(chosen) > 1:
        return Treasures(number, number, (chosen[0], chosen[1]))
    return Treasures(number + 1 if number else 0, number + 1, (chosen[0],))


def _limits(network: NetworkProblem, wanted: RouteRules) -> tuple[Requirement, ...]:
    """Return what is asked of the length of a route."""
    metres, unit = network.mesh.lengths, network.mesh.edge_length
    found: list[Requirement] = []
    if wanted.least_length > 0:
        found.append(LeastLength(metres, wanted.least_length, unit))
    if math.isfinite(wanted.most_length):
        found.append(LengthBudget(metres, wanted.most_length, unit))
    return tuple(found)


def _route(
    network: NetworkProblem, chosen: Sequence[int], level_type: str, wanted: RouteRules
) -> NetworkProblem:
    """Return the network of a route in one piece from its start, with the ends that are asked for.

    Only the start is a sink, so that all of the route hangs together; several would allow a piece
    for each. Every place has an edge; the ends of a line have one, a ring has two at its start.
    """
    mesh = network.mesh
    own = [[int(e) for e in fan if network.candidate[e]] for fan in mesh.vertex_edges]
    sinks = np.zeros(len(network.sinks), dtype=np.bool_)
    sinks[chosen[0]] = True
    clauses = [Clause(tuple(own[v]), kind="place") for v in chosen]
    patterns: list[Pattern] = []
    if level_type != "branching":
        most = 1 if level_type == "linear" else 2
        for v in chosen:
            sets = itertools.combinations(own[v], most + 1)
            patterns += [Pattern(edges, (), math.inf, "branch") for edges in sets]
    if level_type == "linear":
        # the goal is an end and no sink, so that ends are forbidden one by one
        for v in sorted(set(range(len(own))).difference(chosen)):
            for e in own[v]:
                others = tuple(g for g in own[v] if g != e)
                patterns.append(Pattern((e,), others, math.inf, "dead end"))
    ends = 0.0 if level_type == "linear" else network.dead_ends
    return dataclasses.replace(
        network,
        sinks=sinks,
        clauses=clauses,
        patterns=patterns,
        dead_ends=ends,
        requirements=_limits(network, wanted),
    )


def _sinks(
    floor: Floor,
    candidate: BoolArray,
    level_type: LevelType,
    places: Sequence[tuple[float, float]],
    attempt: int = 0,
) -> tuple[list[int], list[Remark]]:
    """Return the vertices of the places, the start first, and what is said of those chosen."""
    least, most = PLACES[level_type]
    if len(places) > most:
        one = "a start" if most == 1 else "a start and a goal"
        raise InputError(
            f"A {level_type} level has {one} only, and {len(places)} points are given.",
            "Give fewer points, or choose the type 'branching'.",
        )
    mesh = floor.mesh
    ways = np.bincount(mesh.edges[candidate].ravel(), minlength=len(mesh.vertices))
    # a ring leaves its start by another way than it comes back
    fit = np.flatnonzero(ways >= (2 if level_type == "circular" else 1))
    if not len(fit):
        raise InputError(
            "No route can begin anywhere.", "Give a larger outline, or take a smaller module."
        )
    chosen: list[int] = []
    remarks: list[Remark] = []
    for place in places:
        free = fit[~np.isin(fit, chosen)]
        if not len(free):
            break
        at = _nearest(mesh.vertices, free, np.array(place))
        chosen.append(at)
    missing = int(least) - len(chosen)
    if missing > 0:
        chosen += _default(floor, fit, level_type, chosen, attempt)[:missing]
        remarks.append(_remark(floor, chosen[-missing:], level_type))
    return chosen, remarks


def _default(
    floor: Floor, fit: IntArray, level_type: LevelType, chosen: Sequence[int], attempt: int
) -> list[int]:
    """Return vertices for places that were not given: the middle, or far apart at the border.

    Later attempts begin elsewhere: the middle of an outline may lie in its court.
    """
    at = floor.mesh.vertices
    middle = at.mean(axis=0)
    if level_type != "linear":
        own = [_nearest(at, fit, middle)]
        inner = fit[~floor.mesh.boundary_vertices[fit]]
        for _ in range(attempt):
            ground = inner if len(inner) else fit
            own.append(int(ground[np.argmax(_clear(at, ground, own))]))
        return own[-1:]
    border = fit[floor.mesh.boundary_vertices[fit]]
    ends = border if len(border) > 1 else fit
    own = list(chosen) or [_farthest(at, ends, middle)]
    for _ in range(attempt + 1):
        own.append(int(ends[np.argmax(_clear(at, ends, own))]))
    return own[-1:] if chosen else [own[attempt], own[attempt + 1]]


def _clear(at: FloatArray, among: IntArray, others: Sequence[int]) -> FloatArray:
    """Return how far vertices are from the nearest of others, rounded."""
    away = at[among][:, None] - at[list(others)][None]
    return np.asarray(np.round(np.hypot(away[..., 0], away[..., 1]).min(axis=1), 6))


def _moved(
    floor: Floor, chosen: Sequence[int], places: Sequence[tuple[float, float]]
) -> list[Remark]:
    """Return what is said of places from which the route begins or ends a way off."""
    found = []
    for name, v, place in zip(("start", "goal"), chosen, places):
        away = float(np.hypot(*(floor.mesh.vertices[v] - np.array(place))))
        if away > TOLD * floor.mesh.edge_length:
            found.append(
                Remark(
                    f"The {name} was moved by {away:.1f} m to where a route can run.",
                    "Draw the point inside the outline, away from its edge.",
                    "info",
                    Point(floor.mesh.vertices[v]),
                )
            )
    return found


def _nearest(at: FloatArray, among: IntArray, place: FloatArray) -> int:
    """Return the vertex nearest to a place, the first of several."""
    return int(among[np.argmin(np.round(np.hypot(*(at[among] - place).T), 6))])


def _farthest(at: FloatArray, among: IntArray, place: FloatArray) -> int:
    """Return the vertex farthest from a place, the first of several."""
    return int(among[np.argmax(np.round(np.hypot(*(at[among] - place).T), 6))])


def _remark(floor: Floor, vertices: Sequence[int], level_type: LevelType) -> Remark:
    """Return what is said of places that were chosen."""
    what = "start and goal" if level_type == "linear" else "start"
    return Remark(
        f"No place is given for {what}.",
        "It was chosen; give a layer of points to choose it yourself.",
        "info",
        MultiPoint(floor.mesh.vertices[list(vertices)]),
    )
