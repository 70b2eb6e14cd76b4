"""Does a level keep the rules? Worked out again from the faces, apart from the solvers.

Nothing here is shared with the program: borders and inner edges are counted from the mesh's
faces, connection is that of networkx.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Literal

import networkx as nx
import numpy as np

from ...errors import InputError
from ...network.checks.validation import check_design
from ..types import RoomPlan, RoomProblem

#: Whether the route may branch, is one ring through its sink, or one path between two sinks
#: (CND-x 5.3).
LevelType = Literal["branching", "circular", "linear"]
LEVEL_TYPES: tuple[LevelType, ...] = ("branching", "circular", "linear")


def level_type(problem: RoomProblem) -> LevelType:
    """Tell what type of level is asked: by whether branches are forbidden, and by the sinks."""
    if not math.isinf(problem.network.branches):
        return "branching"
    return "circular" if int(problem.network.sinks.sum()) == 1 else "linear"


def faults(
    problem: RoomProblem,
    plan: RoomPlan,
    kind: LevelType | None = None,
    *,
    one_part: bool = True,
) -> list[str]:
    """List what is wrong with a level, as sentences; an empty list means that it is right.

    Parameters
    ----------
    problem, plan
        What was asked, and what was found.
    kind
        Type of level to check; None for the type that the problem asks.
    one_part
        Whether the route may run through each block in one connected part only, which
        CND-x 5.3 assumes; else a level may have short cuts that its route does not show.

    Raises
    ------
    InputError
        If the type is unknown or arrays do not fit the mesh.
    """
    kind = level_type(problem) if kind is None else kind
    if kind not in LEVEL_TYPES:
        raise InputError(f"'{kind}' is no type of level.", f"Choose one of {LEVEL_TYPES}.")
    mesh = problem.network.mesh
    if plan.active.shape != (len(mesh.edges),):
        raise InputError(f"The plan has {plan.active.shape} edges, the mesh {len(mesh.edges)}.")
    route = set(np.flatnonzero(plan.active | problem.network.existing).tolist())
    ends = mesh.edges.tolist()
    found = _tiling(problem, plan) + _counts(problem, plan)
    found += _blocks(problem, plan, route, one_part)
    way = nx.Graph([ends[e] for e in sorted(route)])
    parts = nx.number_connected_components(way)
    if parts != 1:
        found.append(f"The route is in {parts} parts.")
    found += _degrees(way, problem, kind) + _treasures(problem, plan, route)
    hard = [v for v in check_design(problem.network, plan.active) if v.hard]
    return found + [v.text for v in hard]


def _tiling(problem: RoomProblem, plan: RoomPlan) -> list[str]:
    """Check that every face is in exactly one block, and obstacles in none (CND eq. 15)."""
    count = len(problem.placements.faces)
    unknown = [room for room in plan.rooms if not 0 <= room < count]
    if unknown:
        return [f"Placement {room} does not exist." for room in unknown]
    cover = Counter(face for room in plan.rooms for face in problem.placements.faces[room])
    found = []
    for face, wanted in enumerate(problem.floor.tolist()):
        if cover[face] != int(wanted):
            where = "" if wanted else ", but is an obstacle"
            found.append(f"Face {face} is in {cover[face]} blocks{where}.")
    for block, room in enumerate(plan.rooms):
        template = problem.templates[int(problem.placements.template[room])]
        if len(set(problem.placements.faces[room])) != len(template.cells):
            found.append(f"Block {block + 1} has not the size of template '{template.name}'.")
    return found


def _counts(problem: RoomProblem, plan: RoomPlan) -> list[str]:
    """Check numbers and areas."""
    if any(not 0 <= room < len(problem.placements.faces) for room in plan.rooms):
        return []
    found = []
    for rule in problem.counts:
        value = math.fsum(float(rule.weight[room]) for room in plan.rooms)
        # sums of areas carry rounding
        slack = 1e-9 * max(1.0, abs(value))
        if not rule.least - slack <= value <= rule.most + slack:
            found.append(f"The level has {value:g}, asked was {rule.text}.")
    return found


def _blocks(problem: RoomProblem, plan: RoomPlan, route: set[int], one_part: bool) -> list[str]:
    """Check that the route is in every block and on no border (CND-x eq. 19-20)."""
    mesh = problem.network.mesh
    sides, ends = mesh.face_edges.tolist(), mesh.edges.tolist()
    found, used = [], set()
    for block, room in enumerate(plan.rooms):
        if not 0 <= room < len(problem.placements.faces):
            continue
        times = Counter(e for face in problem.placements.faces[room] for e in sides[face])
        inner = {e for e, number in times.items() if number == 2} & route
        rim = {e for e, number in times.items() if number == 1} & route
        used |= set(times)
        if not inner:
            found.append(f"The route leaves out block {block + 1}.")
        found += [
            f"The route runs along the border of block {block + 1} at mesh edge {e}."
            for e in sorted(rim)
        ]
        part = nx.Graph([ends[e] for e in inner])
        if one_part and len(part) and not nx.is_connected(part):
            found.append(
                f"The route runs through block {block + 1} in "
                f"{nx.number_connected_components(part)} parts."
            )
    outside = sorted(route - used)
    return found + [f"The route is in no block at mesh edge {e}." for e in outside]


def _treasures(problem: RoomProblem, plan: RoomPlan, route: set[int]) -> list[str]:
    """Check the number of blocks with one passage, away from start and goal."""
    asked = problem.treasures
    if asked is None:
        return []
    mesh = problem.network.mesh
    sides, ends = mesh.face_edges.tolist(), mesh.edges.tolist()
    blocks_at: dict[int, set[int]] = {}
    for block, room in enumerate(plan.rooms):
        times = Counter(e for face in problem.placements.faces[room] for e in sides[face])
        for e in route & {e for e, number in times.items() if number == 2}:
            for v in ends[e]:
                blocks_at.setdefault(v, set()).add(block)
    passages = Counter(b for here in blocks_at.values() if len(here) > 1 for b in here)
    away = set().union(*(blocks_at.get(v, set()) for v in asked.apart))
    dead = [b for b, number in passages.items() if number == 1 and b not in away]
    if asked.least <= len(dead) <= asked.most:
        return []
    return [
        f"{len(dead)} blocks away from start and goal have one passage; between {asked.least} and "
        f"{asked.most} were asked for."
    ]


def _degrees(way: nx.Graph, problem: RoomProblem, kind: LevelType) -> list[str]:
    """Check the ends and branches of the route against the type of level."""
    sinks = set(np.flatnonzero(problem.network.sinks).tolist())
    if kind == "branching":
        return [] if sinks & set(way) else ["No sink is on the route."]
    way.add_nodes_from(sinks)
    asked = 1 if kind == "circular" else 2
    found = []
    if len(sinks) != asked:
        found.append(f"A {kind} level has {asked} sinks, this one has {len(sinks)}.")
    for vertex, degree in sorted(way.degree):
        wanted = 1 if kind == "linear" and vertex in sinks else 2
        if degree != wanted:
            place = f"sink {vertex}" if vertex in sinks else f"vertex {vertex}"
            found.append(f"{degree} edges of the route meet at {place}, {wanted} should.")
    return found
