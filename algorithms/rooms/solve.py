"""From a room problem to a plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np

from ..errors import CancelledError, InfeasibleError, InputError
from ..mip.solvers import check_solver
from ..network.cp import ortools_access
from ..network.cp.model import cost_grain
from ..network.incumbent import Incumbent
from ..network.problem import BoolArray
from ..network.structure import structure
from ..progress import Deadline, Progress
from .program.evaluate import RoomEvaluator
from .program.index import RoomIndex
from .search.by_mip import solve_by_mip
from .search.strategy import solve_by_cp
from .types import RoomPlan, RoomProblem
from .why import NoPlanError, Reason, why_not


def solve_rooms(
    problem: RoomProblem,
    *,
    time_limit: float,
    gap: float = 0.0,
    seed: int = 1,
    solver: str = "auto",
    start: Optional[tuple[BoolArray, Sequence[int]]] = None,
    iterations: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> RoomPlan:
    """Lay rooms and corridors, or blocks and the route through them.

    Parameters
    ----------
    problem
        What is asked.
    time_limit
        Seconds of wall time.
    gap
        Relative gap at which to stop.
    seed
        Seed of every random choice.
    solver
        "auto", "cpsat", "highs", or the name of another solver that PuLP finds.
    start
        Edges, shape (e,), and placements of a plan to start from; ignored if it is not valid.
    iterations
        Number of windows that the search solves. Then, with the same seed, the plan is the same
        every time, as long as the time limit is not reached first. Of "cpsat" only.
    progress
        Told incumbents and bounds, asked for cancellation.

    Returns
    -------
    RoomPlan
        The best plan found, with a proven bound.

    Raises
    ------
    NoPlanError
        If it is known why there is no plan, with places.
    InfeasibleError
        If no plan satisfies the hard rules, or none was found in time; the text says why.
    InputError
        If there is no such solver, or the problem has existing edges.
    MissingDependencyError
        If "cpsat" is asked for and OR-Tools is not installed.
    CancelledError
        If the run was cancelled before there was any plan.
    """
    by_cp = _uses_cp(solver)
    if problem.network.existing.any():
        raise InputError("Rooms know no existing corridors.", "Require these edges instead.")
    deadline = Deadline(time_limit, progress)
    rooms = RoomIndex(problem)
    reasons = why_not(rooms, by_cp=by_cp, progress=progress)
    if progress is not None and progress.cancelled():
        raise CancelledError(_TOO_EARLY)
    if reasons:
        raise NoPlanError(reasons)
    index = structure(problem.network)
    if index.conflicts:
        raise NoPlanError([_conflict(index.conflicts)])
    evaluator: Any = RoomEvaluator(rooms)
    run = Incumbent(evaluator, deadline, gap, progress, cost_grain(index))
    run.raise_bound(index.fixed)
    if start is not None:
        run.take(_design(rooms, *start))
    try:
        if by_cp:
            possible = solve_by_cp(run, index, rooms, seed, iterations)
        else:
            name = "highs" if solver == "auto" else solver
            possible = solve_by_mip(run, index, rooms, seed, name)
    except CancelledError:
        # while a model was being built
        possible = True
    if not possible:
        raise InfeasibleError(_IMPOSSIBLE[problem.kind] + _loosen(problem))
    if run.best is None:
        raise _none_yet(run, problem)
    run.report()
    return _plan(run, rooms)


_TOO_EARLY = "The run was cancelled before a first plan was found."
_IMPOSSIBLE = {
    "floor": (
        "Rooms of these shapes can tile the floor, but no corridors reach all of them under all "
        "rules at once. Allow dead ends, corridors along the outer wall or close together, give "
        "another exit, or more shapes."
    ),
    "level": (
        "Blocks of these shapes can tile the level, but no route of this type runs through all of "
        "them. Give another start or goal, another cell size or more shapes; a branching level "
        "asks least."
    ),
}


def _conflict(conflicts: Sequence[str]) -> Reason:
    """Return what is said of edges and rules that contradict each other."""
    return Reason(
        f"What is asked of corridors cannot be met: {conflicts[0]}.",
        "Move given corridors to where they lead on to an exit, or allow dead ends.",
    )


def _uses_cp(solver: str) -> bool:
    """Tell whether CP-SAT does the work; raise an error if the solver is not there."""
    if solver == "cpsat":
        ortools_access.cp_model()  # says what is missing
    elif solver != "auto":
        check_solver(solver)
    return solver == "cpsat" or (solver == "auto" and ortools_access.available())


def _design(rooms: RoomIndex, active: BoolArray, chosen: Sequence[int]) -> BoolArray:
    """Return edges and placements as one array."""
    placed = np.zeros(len(rooms.problem.placements.faces), dtype=bool)
    placed[list(chosen)] = True
    return np.concatenate([np.asarray(active, dtype=bool), placed])


def _loosen(problem: RoomProblem) -> str:
    """Return what else may be given up: limits of the route of a level, corridors that fork."""
    wishes = []
    if problem.kind == "floor" and math.isinf(problem.network.branches):
        wishes.append("the ban on branches")
    if problem.kind == "level" and problem.network.requirements:
        wishes.append("the limits of the length of the route")
    if problem.treasures is not None:
        wishes.append("the number of treasure rooms")
    return f" Loosening {' or '.join(wishes)} may help." if wishes else ""


def _none_yet(run: Incumbent, problem: RoomProblem) -> Exception:
    """Return the error of a run that ends before any plan was found."""
    if run.cancelled():
        return CancelledError(_TOO_EARLY)
    return InfeasibleError(
        f"No plan was found in {run.deadline.elapsed:.0f} s, and none was proven impossible. "
        f"Allow more time or more shapes, small ones above all.{_loosen(problem)}"
    )


def _plan(run: Incumbent, rooms: RoomIndex) -> RoomPlan:
    """Return the best plan of a run."""
    design = run.design()
    return RoomPlan(
        rooms=tuple(rooms.rooms_of(design.active)),
        active=design.active[: rooms.edges],
        objective=design.objective,
        bound=design.bound,
        seconds=design.seconds,
        stopped=design.stopped,
        distance=design.distance,
        history=design.history,
    )
