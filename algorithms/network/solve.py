"""From a network problem to a design."""

from __future__ import annotations

from typing import Optional

from ..errors import InfeasibleError, InputError
from ..progress import Deadline, Progress
from .evaluate import Evaluator
from .incumbent import Incumbent
from .problem import BoolArray, Design, NetworkProblem
from .strategies import solve_by_cp
from .structure import structure


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
    CancelledError
        If the run was cancelled before there was any design.
    """
    if solver not in ("auto", "cpsat"):
        raise InputError(f"Unknown solver '{solver}'.", "Choose 'auto' or 'cpsat'.")
    deadline = Deadline(time_limit, progress)
    index = structure(problem)
    if index.conflicts:
        raise InfeasibleError("No street network is possible: " + "; ".join(index.conflicts) + ".")
    run = Incumbent(Evaluator(problem), deadline, gap, progress)
    run.raise_bound(index.fixed)
    if start is not None:
        run.take(start)
    if not solve_by_cp(run, index, seed):
        raise InfeasibleError("No street network satisfies all rules at once.")
    run.report()
    return run.design()
