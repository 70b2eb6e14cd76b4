"""What proves a bound beside the search, by the means that suit the problem."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from ..cp.model import CpNetwork
from ..cp.sat import CpOptions, full_network, run_cp
from ..incumbent import Incumbent
from ..structure import Structure
from .by_mip import mip_bound
from .relaxation import Relaxation, raise_by_rounds

#: Problems with at most this many usable edges are given to CP-SAT once rounds pay no more:
#: it proves their optimum.
SMALL = 150
#: Problems with at most this many are given to it after that part of the time.
MIDDLE = 400
SHARE = 0.5
#: Above this many usable edges a relaxation takes more memory and time than it is worth.
LARGEST = 20_000


def bounded_network(run: Incumbent, index: Structure, check: Callable[[], None]) -> CpNetwork:
    """Build the whole model with what the best design implies."""
    weight = index.problem.weight_distance
    limit = None
    if run.best is not None and weight > 0:
        limit = run.value / weight
    return full_network(index, start=run.best, distance_limit=limit, check=check)


def bound_beside(run: Incumbent, index: Structure, seed: int) -> None:
    """Prove a bound until the run is finished; the work of the second thread.

    First the linear relaxation, round by round, then the same in whole numbers. What it
    leaves out (connection as far as it was not missing, long detours) only CP-SAT can prove,
    on problems that are small enough for it.
    """
    size = len(index.edges)
    if size > LARGEST:
        return
    relaxation = Relaxation(index, run.wanted_beside())
    end = time.monotonic() + (SHARE * run.deadline.left if size <= MIDDLE else float("inf"))

    def stop() -> bool:
        return run.finished.is_set() or run.deadline.passed()

    def turn() -> bool:
        return stop() or (size <= MIDDLE and time.monotonic() > end)

    if not raise_by_rounds(relaxation, run.raise_bound, stop) or stop():
        return
    if size > SMALL:
        relaxation_bound(run, relaxation, turn)
    if size <= MIDDLE and not stop():
        cp_bound(run, index, seed)
    if not stop() and not run.closed():
        # costs that CP-SAT has to round too much, and relaxations solved for good
        mip_bound(run, index)


def rounds_bound(run: Incumbent, index: Structure) -> None:
    """Prove a bound after the search by the linear relaxation, round by round.

    No clock ends it but the run's, so that the same problem has the same bound every time.
    """
    if len(index.edges) <= LARGEST and not run.deadline.passed():
        relaxation = Relaxation(index, run.wanted())
        raise_by_rounds(relaxation, run.raise_bound, run.deadline.passed)


def packing_bound(index: Structure, check: Callable[[], None] = lambda: None) -> float:
    """Return a weak bound at once: what coverage costs where no two places can share it.

    Of each ball one vertex is active. It costs its least distance and one edge, or two where
    dead ends are forbidden; balls that touch no common edge pay apart.
    """
    problem = index.problem
    total, used = index.fixed, [False] * len(index.ends)
    for _, ball in index.cover:
        check()
        touching = {e for u in ball for e in index.incident[u]}
        if any(used[e] for e in touching):
            continue
        for e in touching:
            used[e] = True
        total += min(problem.cover_penalty, *(_least_cost(index, u) for u in ball))
    return total


def _least_cost(index: Structure, u: int) -> float:
    """Return what an active vertex costs at least, with its own edges."""
    problem = index.problem
    costs = sorted(index.cost[e] for e in index.incident[u])
    cost = sum(costs[: 2 if index.two[u] else 1])
    if index.with_distance and not problem.sinks[u] and math.isfinite(index.reach[u]):
        cost += problem.weight_distance * index.reach[u]
    return cost


def relaxation_bound(run: Incumbent, relaxation: Relaxation, stop: Callable[[], bool]) -> None:
    """Branch on a relaxation; tighten it where its optimum is no design, and branch again."""
    while not stop():
        result = relaxation.solve_whole(stop, run.raise_bound)
        if result.values is None:
            return
        run.raise_bound(result.bound)
        active = relaxation.chosen()
        # its design may count, since the same inequalities lead to the same optimum every time
        if active is not None and run.take(active) and run.closed():
            return
        if not relaxation.tighten():
            return


def cp_bound(run: Incumbent, index: Structure, seed: int) -> None:
    """Prove a bound of the whole problem by CP-SAT, until the run is finished."""
    network = bounded_network(run, index, run.wanted_beside())
    options = CpOptions(run.deadline.left, seed=seed + 1, linearization=2)
    result = run_cp(network, options, stop=run.finished.is_set, on_bound=run.raise_bound)
    run.raise_bound(result.bound)
    # what it finds on the way would make runs depend on timing; an optimum does not
    if result.status == "optimal" and result.active is not None:
        run.take(result.active)
