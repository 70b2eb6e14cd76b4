"""From a network problem to a design."""

from __future__ import annotations

from typing import Optional

import numpy as np

from ..errors import CancelledError, InfeasibleError
from ..progress import Deadline, Progress
from . import ortools_access
from .conflicts import explain
from .cpmodel import cost_grain
from .evaluate import Evaluator
from .incumbent import Incumbent
from .mipstrategy import solve_by_mip
from .problem import BoolArray, Design, NetworkProblem
from .solvers import check_solver
from .strategies import first_start, no_design_yet, solve_by_cp
from .structure import Structure, structure

#: Seconds for finding out which rules are in conflict.
DIAGNOSIS = 5.0


def solve(
    problem: NetworkProblem,
    *,
    time_limit: float,
    gap: float = 0.0,
    seed: int = 1,
    solver: str = "auto",
    start: Optional[BoolArray] = None,
    progress: Optional[Progress] = None,
) -> Design:
    """Design a network.

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
        Shape (e,). A design to start from; ignored if it is not valid.
    progress
        Told incumbents and bounds, asked for cancellation.

    Returns
    -------
    Design
        The best design found, with a proven bound.

    Raises
    ------
    InfeasibleError
        If no design satisfies the hard rules, or none was found in time.
    InputError
        If there is no such solver.
    MissingDependencyError
        If "cpsat" is asked for and OR-Tools is not installed.
    CancelledError
        If the run was cancelled before there was any design.
    """
    by_cp = _uses_cp(solver)
    deadline = Deadline(time_limit, progress)
    index = structure(problem)
    run = Incumbent(Evaluator(problem), deadline, gap, progress, cost_grain(index))
    run.raise_bound(index.fixed)
    if start is not None:
        run.take(np.asarray(start, dtype=bool))
    if index.conflicts or not _search(run, index, seed, solver, by_cp):
        raise InfeasibleError(_why(problem, by_cp, progress))
    if run.best is None:
        raise no_design_yet(run)
    run.report()
    return run.design()


def _uses_cp(solver: str) -> bool:
    """Tell whether CP-SAT does the work; raise an error if the solver is not there."""
    if solver == "cpsat":
        ortools_access.cp_model()  # says what is missing
    elif solver != "auto":
        check_solver(solver)
    return solver == "cpsat" or (solver == "auto" and ortools_access.available())


def _search(run: Incumbent, index: Structure, seed: int, solver: str, by_cp: bool) -> bool:
    """Run the strategy of a solver; return False if there is no valid design."""
    try:
        if by_cp:
            return solve_by_cp(run, index, seed)
        return solve_by_mip(run, index, seed, "highs" if solver == "auto" else solver)
    except CancelledError:
        # while a model was being built
        if run.best is None:
            raise no_design_yet(run) from None
        return True


def _why(problem: NetworkProblem, by_cp: bool, progress: Optional[Progress]) -> str:
    """Say which rules contradict each other, within a few seconds."""
    deadline = Deadline(DIAGNOSIS, progress)

    def feasible(relaxed: NetworkProblem) -> bool:
        index = structure(relaxed)
        if index.conflicts:
            return False
        trial = Incumbent(Evaluator(relaxed), Deadline(min(1.0, deadline.left), progress))
        if by_cp:
            first_start(trial, index, 1)
        else:
            # any design will do, and a relative gap of 1 is any design
            trial.gap = 1.0
            solve_by_mip(trial, index, 1, "highs")
        return trial.best is not None

    return explain(problem, feasible, deadline.passed)
