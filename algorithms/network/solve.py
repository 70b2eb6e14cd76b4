"""From a network problem to a design."""

from __future__ import annotations

import math
import time
from typing import Optional

import numpy as np

from ..errors import CancelledError, InfeasibleError, InputError
from ..progress import Deadline, Progress, SearchState
from .cpsat import CpOptions, full_network, run_cp
from .evaluate import Evaluator
from .problem import BoolArray, Design, NetworkProblem
from .structure import structure

#: Relative difference of objective and bound that counts as none.
TOLERANCE = 1e-6


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
    evaluator = Evaluator(problem)
    best: Optional[BoolArray] = None
    value = math.inf
    bound = -math.inf
    history: list[tuple[float, float]] = []
    if start is not None and math.isfinite(evaluator.objective(start)):
        best, value = start.copy(), evaluator.objective(start)

    def take(active: BoolArray) -> None:
        nonlocal best, value
        objective = evaluator.objective(active)
        if objective < value - 1e-9:
            best, value = active, objective
            history.append((deadline.elapsed, objective))
            report()

    def raise_bound(found: float) -> None:
        nonlocal bound
        if found > bound:
            bound = found
            report()

    def report() -> None:
        if progress is not None:
            known = None if bound == -math.inf else bound
            progress.search(SearchState(None if best is None else value, known, deadline.elapsed))

    def enough() -> bool:
        return deadline.passed() or value - bound <= gap * abs(value)

    network = full_network(index, start=best)
    options = CpOptions(time_limit=deadline.left, seed=seed)
    result = run_cp(network, options, stop=enough, on_solution=take, on_bound=raise_bound)
    raise_bound(result.bound)
    if result.active is not None:
        take(result.active)
    if result.status == "infeasible":
        raise InfeasibleError("No street network satisfies all rules at once.")
    if best is None:
        if progress is not None and progress.cancelled():
            raise CancelledError("The run was cancelled before a first design was found.")
        raise InfeasibleError(f"No street network was found in {time_limit:g} s. Allow more time.")
    return _design(evaluator, best, bound, deadline, gap, history)


def _design(
    evaluator: Evaluator,
    best: BoolArray,
    bound: float,
    deadline: Deadline,
    gap: float,
    history: list[tuple[float, float]],
) -> Design:
    """Wrap the best design up."""
    found = evaluator.evaluate(best)
    if found.objective - bound <= TOLERANCE * max(1.0, abs(found.objective)):
        bound, stopped = found.objective, "optimal"
    elif found.objective - bound <= gap * abs(found.objective):
        stopped = "gap"
    elif deadline.left <= 0:
        stopped = "time"
    else:
        stopped = "cancelled"
    return Design(
        active=np.array(best, dtype=bool),
        objective=found.objective,
        bound=max(bound, 0.0),
        seconds=time.monotonic() - deadline.start,
        stopped=stopped,
        distance=found.distance,
        uncovered=found.uncovered,
        broken_clauses=found.broken_clauses,
        history=tuple(history),
    )
