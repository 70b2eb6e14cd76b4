"""From a network problem to a design."""

from __future__ import annotations

from typing import Optional

import numpy as np

from ..errors import CancelledError, InfeasibleError, InputError
from ..mip.solvers import check_solver
from ..progress import Deadline, Progress
from .cp import ortools_access
from .cp.model import cost_grain
from .evaluate import Evaluator
from .incumbent import Incumbent, patience
from .problem import BoolArray, Design, NetworkProblem
from .search.annealing import anneal
from .search.cp_strategy import TOO_EARLY, no_design_yet, solve_by_cp
from .search.mip_strategy import solve_by_mip
from .structure import Structure, structure
from .why.whynot import diagnose

#: Ways to search for a network.
METHODS = ("program", "annealing")


def solve(
    problem: NetworkProblem,
    *,
    time_limit: float,
    gap: float = 0.0,
    seed: int = 1,
    solver: str = "auto",
    start: Optional[BoolArray] = None,
    iterations: Optional[int] = None,
    threads: Optional[int] = None,
    progress: Optional[Progress] = None,
    explain: bool = True,
    method: str = "program",
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
    iterations
        Number of windows that the search solves. Then, with the same seed, the design is the same
        every time, as long as the time limit is not reached first; neither the gap nor the proof
        of a bound ends the search. Of "cpsat" only; None for no limit.
    threads
        How many windows are solved at the same time, which changes no design; None for the usual
        number. Of "cpsat" only.
    progress
        Told incumbents and bounds, asked for cancellation.
    explain
        Whether an `InfeasibleError` is to say why, which takes up to some seconds more.
    method
        "program" for integer programming; "annealing" for the paper's stochastic search, which
        is there to be compared with and takes only the time limit and the seed (CND section 5.4).

    Returns
    -------
    Design
        The best design found, with a proven bound.

    Raises
    ------
    InfeasibleError
        If no design satisfies the hard rules, or none was found in time. In the first case its
        `diagnosis` says why (`whynot.Diagnosis`).
    InputError
        If there is no such solver or method.
    MissingDependencyError
        If "cpsat" is asked for and OR-Tools is not installed.
    CancelledError
        If the run was cancelled before there was any design; a valid start is one.
    """
    if method not in METHODS:
        raise InputError(f"There is no method {method}.", f"Choose {' or '.join(METHODS)}.")
    if method == "annealing":
        return anneal(problem, time_limit=time_limit, seed=seed, progress=progress)
    by_cp = _uses_cp(solver)
    deadline = Deadline(time_limit, progress)
    check = patience(lambda: progress is not None and progress.cancelled())
    begin = None if start is None else np.asarray(start, dtype=bool)
    try:
        index = structure(problem, check=check)
        evaluator = Evaluator(problem, check)
    except CancelledError:
        return _unchanged(problem, begin, deadline)
    run = Incumbent(evaluator, deadline, gap, progress, cost_grain(index))
    run.raise_bound(index.fixed)
    if begin is not None:
        run.take(begin)
    if index.conflicts or not _search(run, index, seed, solver, by_cp, iterations, threads):
        if not explain:
            raise InfeasibleError("No street network satisfies all rules at once.")
        found = diagnose(problem, by_cp=by_cp, seed=seed, progress=progress)
        raise InfeasibleError(found.text, found)
    if run.best is None:
        raise no_design_yet(run)
    run.report()
    return run.design()


def _unchanged(problem: NetworkProblem, begin: Optional[BoolArray], deadline: Deadline) -> Design:
    """Return the start as the design of a run that is cancelled at once."""
    if begin is None:
        raise CancelledError(TOO_EARLY) from None
    run = Incumbent(Evaluator(problem), deadline, progress=None)
    if not run.take(begin):
        raise CancelledError(TOO_EARLY) from None
    return run.design()


def _uses_cp(solver: str) -> bool:
    """Tell whether CP-SAT does the work; raise an error if the solver is not there."""
    if solver == "cpsat":
        ortools_access.cp_model()  # says what is missing
    elif solver != "auto":
        check_solver(solver)
    return solver == "cpsat" or (solver == "auto" and ortools_access.available())


def _search(
    run: Incumbent,
    index: Structure,
    seed: int,
    solver: str,
    by_cp: bool,
    iterations: Optional[int],
    threads: Optional[int],
) -> bool:
    """Run the strategy of a solver; return False if there is no valid design."""
    try:
        if by_cp:
            return solve_by_cp(run, index, seed, iterations, threads)
        return solve_by_mip(run, index, seed, "highs" if solver == "auto" else solver)
    except CancelledError:
        # while a model was being built
        if run.best is None:
            raise no_design_yet(run) from None
        return True
