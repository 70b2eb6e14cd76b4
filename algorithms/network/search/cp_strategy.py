"""How a run proceeds with CP-SAT: start, improve window by window, prove a bound beside it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Optional

import numpy as np

from ...errors import CancelledError, InfeasibleError
from ..bounds.beside import LARGEST, bound_beside, bounded_network, packing_bound, rounds_bound
from ..cp.sat import CpOptions, full_network, run_cp
from ..incumbent import Companion, Incumbent
from ..problem import BoolArray
from ..structure import Structure
from .parallel import Course, Crew
from .repair import has_links, repaired_starts
from .starts import first_design
from .window_search import WindowSearch
from .windows import Windows

#: What a run says that is cancelled before it has a design.
TOO_EARLY = "The run was cancelled before a first design was found."
#: Problems with at most this many usable edges are first tried as a whole.
SMALL = 200
#: Effort of that trial, in CP-SAT's deterministic units.
TRIAL = 0.4
#: Effort of the first attempt to find any design; later ones take twice as much each.
FIRST_EFFORT = 0.4
#: Threads that solve windows, until the proof of a bound begins beside them.
THREADS = 2
#: Seconds, and share of the time, in which the search has all threads to itself.
ALONE, ALONE_SHARE = 5.0, 0.5
#: Effort per window with which searches after the first begin.
LATER_EFFORT = 0.1


def no_design_yet(run: Incumbent) -> Exception:
    """Return the error of a run that ends before any design was found."""
    if run.cancelled():
        return CancelledError(TOO_EARLY)
    return InfeasibleError(
        f"No street network was found in {run.deadline.elapsed:.0f} s, and none was proven "
        "impossible. Allow more time, a larger coverage range or dead ends."
    )


def first_designs(run: Incumbent, index: Structure, seed: int) -> list[BoolArray]:
    """Find valid designs without a search, if there are any; return them, best first.

    They are straight lines, or designs without requirements that were mended to keep them.
    """
    starts: list[BoolArray] = []
    if run.best is not None:
        return starts
    linked = has_links(index.problem)
    if linked:
        starts = repaired_starts(run, index, seed)
    if run.best is None:
        starts = first_design(run, index)
    if run.best is None and not linked:
        starts = repaired_starts(run, index, seed)
    run.report()
    return starts


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
    network = bounded_network(run, index, run.wanted())
    # a full linear relaxation: on plans of cells as wide as blocks forty times as fast
    options = CpOptions(run.deadline.left, effort=effort, seed=seed, linearization=2)
    # the caller's thread may report only from its own thread, so solutions come at the end
    result = run_cp(network, options, stop=run.enough, on_bound=run.raise_bound)
    if result.active is not None:
        run.take(result.active)
    # an optimum of rounded costs is one if the bound, rounded down, comes near enough
    run.raise_bound(result.bound)
    return result.status


def window_search(
    run: Incumbent,
    index: Structure,
    seed: int,
    *,
    iterations: Optional[int] = None,
    threads: Optional[int] = None,
    beside: Optional[Companion] = None,
    starts: Sequence[BoolArray] = (),
) -> None:
    """Improve the best design until the run is to stop, with a new seed when it goes stale.

    New searches start from the best design and from other starts in turn: where a search ends
    depends on its seed and its start.

    Parameters
    ----------
    run
        The run; it has a design.
    index
        The problem.
    seed
        Seed of all choices.
    iterations
        Number of windows after which to stop; None for no limit.
    threads
        How many windows are solved at the same time; None for the usual number.
    beside
        Work that begins once the search has had `ALONE` seconds to itself.
    starts
        Other valid designs to start from.
    """
    if run.best is None or not index.edges:
        return
    windows = Windows(index, run.wanted())
    rng = np.random.default_rng(seed)
    alone = min(ALONE, ALONE_SHARE * run.deadline.seconds)
    run.alone = iterations is not None
    others = itertools.cycle([*starts[1:], run.best])
    again = itertools.cycle((False, True))
    steps = 0
    with Crew(windows, threads or THREADS) as crew:
        course = _course(run, crew, run.best, rng, later=False)
        while not run.enough() and (iterations is None or steps < iterations):
            late = run.deadline.elapsed > alone and len(index.edges) <= LARGEST
            if late and beside is not None and beside.start():
                crew.limit()
            if not course.step(run, run.enough):
                break
            steps += 1
            if course.search.value < run.value:
                run.take(course.search.active)
            if course.search.exhausted:
                start = run.best if next(again) else next(others)
                course = _course(run, crew, start, rng, later=True)


def _course(
    run: Incumbent, crew: Crew, active: BoolArray, rng: np.random.Generator, later: bool
) -> Course:
    """Return a search from a design; later ones begin with more effort per window."""
    seed = int(rng.integers(2**31))
    search = WindowSearch(crew.windows, run.evaluator, active.copy(), seed=seed)
    if later:
        search.effort = LATER_EFFORT
    return Course(search, crew)


def solve_by_cp(
    run: Incumbent,
    index: Structure,
    seed: int,
    iterations: Optional[int] = None,
    threads: Optional[int] = None,
) -> bool:
    """Run start, improvement and bound; return False if there is no valid design."""
    starts = first_designs(run, index, seed)
    if run.best is None and not first_start(run, index, seed):
        return False
    if run.best is None:
        raise no_design_yet(run)
    if run.enough():
        return True
    if len(index.edges) <= SMALL:
        whole_problem(run, index, seed, TRIAL)
    if run.enough():
        return True
    # at once, since the proof of a better one begins later
    run.raise_bound(packing_bound(index, run.wanted()))
    if iterations is not None:
        # how far a proof beside the search comes depends on timing
        window_search(run, index, seed, iterations=iterations, threads=threads, starts=starts)
        rounds_bound(run, index)
        return math.isfinite(run.value)
    with run.beside(lambda: bound_beside(run, index, seed), later=True) as beside:
        window_search(run, index, seed, threads=threads, beside=beside, starts=starts)
    return math.isfinite(run.value)
