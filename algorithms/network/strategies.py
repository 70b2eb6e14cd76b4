"""How a run proceeds with CP-SAT: start, improve window by window, prove a bound beside it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Optional

import numpy as np

from ..errors import CancelledError, InfeasibleError
from .cpmodel import CpNetwork
from .cpsat import CpOptions, full_network, run_cp
from .incumbent import Incumbent
from .mipstrategy import mip_bound, straight_start
from .problem import BoolArray
from .search import WindowSearch
from .structure import Structure
from .windows import Windows

#: Problems with at most this many usable edges are first tried as a whole.
SMALL = 400
#: Effort of that trial, in CP-SAT's deterministic units.
TRIAL = 0.4
#: Effort of the first attempt to find any design; later ones take twice as much each.
FIRST_EFFORT = 0.4
#: Problems with at most this many usable edges get their bound from CP-SAT, others from a MIP.
CP_BOUND = 400
#: Windows without improvement after which the search starts anew with another seed.
STALE = 40
#: Efforts per window that the searches take in turn.
EFFORTS = (0.15, 0.4, 0.08)


def no_design_yet(run: Incumbent) -> Exception:
    """Return the error of a run that ends before any design was found."""
    if run.cancelled():
        return CancelledError("The run was cancelled before a first design was found.")
    return InfeasibleError(
        f"No street network was found in {run.deadline.elapsed:.0f} s, and none was proven "
        "impossible. Allow more time, a larger coverage range or dead ends."
    )


def first_start(run: Incumbent, index: Structure, seed: int) -> bool:
    """Let CP-SAT find any valid design; return False if it proves that there is none."""
    if not index.edges:
        return run.take(np.zeros(len(index.ends), dtype=bool))
    network = full_network(index, cuts=[], ranks=True, check=run.wanted())
    if index.problem.weight_length == 0:
        # short networks are found sooner than any
        for x in network.edge.values():
            network.cost(x, 1.0)
    for slack in network.slack.values():
        if not isinstance(slack, bool):
            network.model.add_hint(slack, False)
    effort = FIRST_EFFORT
    while True:
        # some seeds take a hundred times as long as others, so that restarts pay
        options = CpOptions(
            run.deadline.left,
            effort=effort,
            seed=seed,
            linearization=0,
            probing=0,
            symmetry=0,
            first_only=True,
        )
        result = run_cp(network, options, stop=run.enough)
        if result.active is not None:
            run.take(result.active)
        if result.status != "unknown" or run.enough():
            return result.status != "infeasible"
        effort, seed = 2 * effort, seed + 1


def whole_problem(run: Incumbent, index: Structure, seed: int, effort: Optional[float]) -> str:
    """Solve the whole problem by CP-SAT; return its status."""
    network = _bounded(run, index, run.wanted())
    # a full linear relaxation: on plans of cells as wide as blocks forty times as fast
    options = CpOptions(run.deadline.left, effort=effort, seed=seed, linearization=2)
    # the caller's thread may report only from its own thread, so solutions come at the end
    result = run_cp(network, options, stop=run.enough, on_bound=run.raise_bound)
    if result.active is not None:
        run.take(result.active)
    # an optimum of rounded costs is one if the bound, rounded down, comes near enough
    run.raise_bound(result.bound)
    return result.status


def _bounded(run: Incumbent, index: Structure, check: Callable[[], None]) -> CpNetwork:
    """Build the whole model with what the best design implies."""
    weight = index.problem.weight_distance
    limit = None
    if run.best is not None and weight > 0:
        limit = run.value / weight
    return full_network(index, start=run.best, distance_limit=limit, check=check)


def bound_beside(run: Incumbent, index: Structure, seed: int) -> None:
    """Prove a bound by the means that suits the problem; the work of the second thread."""
    if index.with_distance or len(index.edges) > CP_BOUND:
        # the cost of a flow is the better bound of distances; without them the flow only
        # slows the solver down
        mip_bound(run, index, flow=index.with_distance)
    else:
        cp_bound(run, index, seed)


def cp_bound(run: Incumbent, index: Structure, seed: int) -> None:
    """Prove a bound of the whole problem by CP-SAT, until the run is finished."""
    network = _bounded(run, index, run.wanted_beside())
    options = CpOptions(run.deadline.left, seed=seed + 1, linearization=2)
    result = run_cp(network, options, stop=run.finished.is_set, on_bound=run.raise_bound)
    run.raise_bound(result.bound)
    # what it finds on the way would make runs depend on timing; an optimum does not
    if result.status == "optimal" and result.active is not None:
        run.take(result.active)


def window_search(run: Incumbent, index: Structure, seed: int) -> None:
    """Improve the best design until the run is to stop, with a new seed when it goes stale.

    Every second new search starts from the first design instead of the best: where a search
    ends depends on its seed.
    """
    if run.best is None or not index.edges:
        return
    windows = Windows(index, run.wanted())
    rng = np.random.default_rng(seed)
    efforts = itertools.cycle(EFFORTS)
    starts = itertools.cycle((run.best, None))
    search = _search(run, windows, run.best, rng, next(efforts))
    stale = 0
    while not run.enough():
        stale = 0 if search.step(run.deadline.left, run.enough) else stale + 1
        if search.value < run.value:
            run.take(search.active)
        if stale > STALE:
            again = next(starts)
            again = run.best if again is None else again
            search, stale = _search(run, windows, again, rng, next(efforts)), 0


def _search(
    run: Incumbent,
    windows: Windows,
    active: BoolArray,
    rng: np.random.Generator,
    effort: float,
) -> WindowSearch:
    """Return a search from a design."""
    seed = int(rng.integers(2**31))
    return WindowSearch(windows, run.evaluator, active.copy(), seed=seed, effort=effort)


def solve_by_cp(run: Incumbent, index: Structure, seed: int) -> bool:
    """Run start, improvement and bound; return False if there is no valid design."""
    if run.best is None:
        straight_start(run, index)
    run.report()
    small = len(index.edges) <= SMALL
    if run.best is None and not first_start(run, index, seed):
        return False
    if small and not run.enough():
        status = whole_problem(run, index, seed, TRIAL)
        if status == "infeasible" and run.best is None:
            return False
    if run.best is None:
        raise no_design_yet(run)
    if run.enough():
        return True
    with run.beside(lambda: bound_beside(run, index, seed)):
        window_search(run, index, seed)
    return math.isfinite(run.value)
