"""From storeys, shapes and rules to plans, storey by storey."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional

import numpy as np
import shapely

from ..errors import CancelledError, InfeasibleError
from ..mesh.quadmesh import BoolArray, FloatArray, QuadMesh
from ..network.partition import patches, point_to_point
from ..network.problem import NetworkProblem
from ..network.requirements.base import View
from ..network.requirements.links import Link
from ..progress import Progress, Share, Silent
from .floors import Floor
from .rules import PART, RoomRules
from .shapes import count_rules, enumerate_placements
from .solve import solve_rooms
from .types import Kind, RoomPlan, RoomProblem, Template


@dataclass(frozen=True, eq=False)
class Storey:
    """A storey with its plan.

    Attributes
    ----------
    floor
        The storey.
    problem
        What was asked.
    plan
        The plan, or None where there is none.
    error
        Why there is none.
    """

    floor: Floor
    problem: RoomProblem
    plan: Optional[RoomPlan]
    error: Optional[InfeasibleError] = None

    @property
    def links(self) -> int:
        """Number of short ways between parts that were asked for."""
        return len(self.problem.network.requirements)

    @property
    def links_missing(self) -> int:
        """Of these, how many the plan has not."""
        if self.plan is None:
            return 0
        network = self.problem.network
        view = View(network, self.plan.active)
        return sum(own.violations(view) for own in network.requirements)


def face_areas(mesh: QuadMesh) -> FloatArray:
    """Return the area of each face, shape (m,), square metres."""
    areas: FloatArray = shapely.area(shapely.polygons(mesh.vertices[mesh.faces]))
    return areas


def room_problem(
    floor: Floor, templates: Sequence[Template], rules: RoomRules, kind: Kind = "floor"
) -> RoomProblem:
    """Make the problem of a storey or of a level.

    Parameters
    ----------
    floor
        Mesh, cells to be tiled, sinks, places that corridors must pass.
    templates
        Admissible shapes.
    rules
        What corridors or routes should do.
    kind
        "floor" (CND 5.2) or "level" (CND-x 5.3).

    Raises
    ------
    InputError
        If a shape cannot be laid.
    """
    mesh = floor.mesh
    placements = enumerate_placements(mesh, templates, floor.floor)
    network = NetworkProblem(
        mesh=mesh,
        existing=np.zeros(len(mesh.edges), dtype=np.bool_),
        candidate=_candidates(floor, rules, kind) | floor.required,
        sinks=floor.sinks,
        length=mesh.lengths / mesh.edge_length,
        required=floor.required,
        edge_factor=np.ones(len(mesh.edges)),
        weight_length=rules.weight_length,
        weight_distance=rules.weight_distance,
        dead_ends=rules.dead_ends,
        branches=rules.branches,
        zigzags=rules.zigzags,
        too_close=rules.too_close,
    )
    if kind == "floor" and rules.links:
        network = dataclasses.replace(network, requirements=tuple(_links(floor, network, rules)))
    counts = count_rules(templates, placements, face_areas(mesh), floor.floor)
    return RoomProblem(kind, network, tuple(templates), placements, floor.floor, tuple(counts))


def _links(floor: Floor, network: NetworkProblem, rules: RoomRules) -> list[Link]:
    """Ask for short ways between neighbouring parts of a storey (CND section 4.2 L1)."""
    mesh = floor.mesh
    side = rules.part_size or PART * mesh.edge_length
    part = np.full(len(mesh.faces), -1, dtype=np.int64)
    # no part of its own for what no room covers
    areas = np.where(floor.floor, face_areas(mesh), 0.0)
    part[floor.floor] = patches(mesh, side**2, weight=areas, seed=rules.seed)[floor.floor]
    part[floor.floor] = np.unique(part[floor.floor], return_inverse=True)[1]
    return point_to_point(
        network, part, tolerance=rules.detour, penalty=rules.links, seed=rules.seed
    )


def _candidates(floor: Floor, rules: RoomRules, kind: Kind) -> BoolArray:
    """Return where corridors or routes may run: at cells of the floor."""
    pairs = floor.mesh.edge_faces
    sides = np.where(pairs >= 0, floor.floor[pairs], False)
    if kind == "level":
        # a border of the level lies inside no block
        return np.asarray(sides.all(axis=1))
    inside = sides.any(axis=1)
    return np.asarray(inside if rules.outer else inside & ~floor.mesh.boundary_edges)


def design_floors(
    floors: Sequence[Floor],
    templates: Sequence[Template],
    rules: RoomRules,
    progress: Optional[Progress] = None,
) -> list[Storey]:
    """Lay rooms and corridors on several storeys; one program for each (CND Fig. 9b).

    Parameters
    ----------
    floors
        Storeys. What they share, such as lifts, lies at the same place in each, since storeys of
        one footprint have the same mesh.
    templates
        Admissible shapes of rooms.
    rules
        What corridors should do.
    progress
        Told of storeys and plans; a cancelled run keeps the plans that it has.

    Returns
    -------
    list of Storey
        In the order of `floors`; those without a plan say why. A cancelled run returns those that
        it came to.

    Raises
    ------
    InputError
        If a shape cannot be laid.
    CancelledError
        If the run was cancelled before there was any plan.
    """
    progress = progress or Silent()
    problems = []
    for floor in floors:
        if progress.cancelled():
            msg = "The run was cancelled before a first plan was found."
            raise CancelledError(msg)
        problems.append(room_problem(floor, templates, rules))
    found: list[Storey] = []
    for at, (floor, problem) in enumerate(zip(floors, problems)):
        if found and progress.cancelled():
            break
        part = Share(progress, at / len(floors), (at + 1) / len(floors))
        part.stage(f"Storey {floor.storey}", 0.0)
        try:
            plan = solve_storey(problem, rules, part)
        except CancelledError:
            if not any(own.plan for own in found):
                raise
            break
        except InfeasibleError as error:
            found.append(Storey(floor, problem, None, error))
            continue
        found.append(Storey(floor, problem, plan))
    return found


def solve_storey(
    problem: RoomProblem, rules: RoomRules, progress: Optional[Progress] = None
) -> RoomPlan:
    """Solve one problem by the rules' limits; see `solve_rooms` for what it raises."""
    return solve_rooms(
        problem,
        time_limit=rules.time_limit,
        gap=rules.gap,
        seed=rules.seed,
        solver=rules.solver,
        progress=progress,
    )
