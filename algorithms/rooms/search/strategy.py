"""How a run proceeds: any plan, then windows of it, with the proof of a bound beside."""

from __future__ import annotations

from collections.abc import Callable
from typing import Optional

import numpy as np

from ...network.bounds.beside import packing_bound
from ...network.bounds.relaxation import Relaxation, raise_by_rounds
from ...network.cp.model import CpNetwork
from ...network.cp.sat import CpOptions, full_network, run_cp
from ...network.incumbent import Incumbent
from ...network.problem import BoolArray
from ...network.search.parallel import Course, Crew
from ...network.structure import Structure, structure
from ..program.cp import add_rooms
from ..program.index import RoomIndex, covered_problem
from ..program.parts import cut_parts
from .descent import descend, limited
from .passing import least_length_cost, passing_bound
from .windows import RoomSearch, RoomWindows

#: Effort of the first attempt to find any plan, in CP-SAT's deterministic units; later ones take
#: half as much more each.
FIRST_EFFORT, GROWTH = 2.0, 1.5
#: Threads that solve windows.
THREADS = 2


def whole_network(
    index: Structure,
    rooms: RoomIndex,
    *,
    ranks: bool = False,
    start: Optional[BoolArray] = None,
    check: Optional[Callable[[], None]] = None,
) -> CpNetwork:
    """Build the model of a whole plan.

    Parameters
    ----------
    index, rooms
        The problem.
    ranks
        Connect by ranks and leave distances out.
    start
        A design to start from.
    check
        Called often; may raise an error to end that.
    """
    network = full_network(index, cuts=None if start is not None else [], ranks=ranks, check=check)
    none = np.zeros(len(rooms.problem.placements.faces), dtype=bool)
    add_rooms(network, rooms, np.flatnonzero(rooms.problem.floor).tolist(), none)
    if start is not None:
        network.hint(start)
    return network


def first_plan(
    run: Incumbent,
    index: Structure,
    rooms: RoomIndex,
    seed: int,
    *,
    attempts: Optional[int] = None,
) -> bool:
    """Let CP-SAT find any valid plan; return False if it proves that there is none.

    With a number of attempts it may end without either.
    """
    network = whole_network(index, rooms, ranks=True, check=run.wanted())
    if not any(cost > 0 for _, cost, _ in network.costs):
        for x in network.edge.values():
            network.cost(x, 1.0)
    effort = FIRST_EFFORT
    while True:
        # some seeds take many times as long as others, so that restarts pay
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
        if result.active is not None and cut_parts(network, rooms, result.active):
            if run.enough():
                return True
            continue
        if result.active is not None:
            run.take(result.active)
        if result.status != "unknown" or run.enough():
            return result.status != "infeasible"
        effort, seed = GROWTH * effort, seed + 1
        attempts = None if attempts is None else attempts - 1
        if attempts == 0:
            return True


def window_search(
    run: Incumbent,
    index: Structure,
    rooms: RoomIndex,
    seed: int,
    *,
    iterations: Optional[int] = None,
) -> None:
    """Improve the best plan window by window until the run is to stop."""
    if run.best is None or not index.edges:
        return
    windows = RoomWindows(index, rooms, run.wanted())
    rng = np.random.default_rng(seed)
    run.alone = iterations is not None
    steps = 0
    with Crew(windows, THREADS) as crew:
        course: Optional[Course] = None
        while not run.enough() and (iterations is None or steps < iterations):
            if course is None:
                own = int(rng.integers(2**31))
                course = Course(RoomSearch(windows, run.evaluator, run.best.copy(), seed=own), crew)
            if not course.step(run, run.enough):
                break
            steps += 1
            if course.search.value < run.value:
                run.take(course.search.active)
            if course.search.exhausted:
                course = None


def bound_beside(run: Incumbent, index: Structure, rooms: RoomIndex, seed: int) -> None:
    """Prove a bound until the run is finished: of tilings and of coverage first."""

    def stop() -> bool:
        return run.finished.is_set() or run.deadline.passed()

    if rooms.problem.kind == "level":
        run.raise_bound(least_length_cost(index))
        run.raise_bound(passing_bound(index, rooms, stop, run.wanted_beside()))
    loose = structure(covered_problem(rooms), check=run.wanted_beside())
    run.raise_bound(packing_bound(loose, run.wanted_beside()))
    relaxation = Relaxation(loose, run.wanted_beside())
    raise_by_rounds(relaxation, run.raise_bound, stop)
    if stop():
        return
    relaxation.solve_whole(stop, run.raise_bound)
    if stop():
        return
    network = whole_network(index, rooms, start=run.best, check=run.wanted_beside())
    while not stop():
        options = CpOptions(run.deadline.left, seed=seed + 1, linearization=2)
        result = run_cp(network, options, stop=stop, on_bound=run.raise_bound)
        run.raise_bound(result.bound)
        if result.status != "optimal" or result.active is None:
            return
        if not cut_parts(network, rooms, result.active):
            run.take(result.active)
            return


def solve_by_cp(
    run: Incumbent, index: Structure, rooms: RoomIndex, seed: int, iterations: Optional[int] = None
) -> bool:
    """Run start, improvement and bound; return False if there is no valid plan."""
    if run.best is None and limited(rooms):
        # a short route is seldom found at once
        if not first_plan(run, index, rooms, seed, attempts=1):
            return False
        loose = run.best is not None or run.enough()
        if not loose and not descend(run, rooms, seed, first_plan, window_search):
            return False
    if run.best is None and not run.enough() and not first_plan(run, index, rooms, seed):
        return False
    if run.best is None or run.enough():
        return True
    with run.beside(lambda: bound_beside(run, index, rooms, seed)):
        window_search(run, index, rooms, seed, iterations=iterations)
    return True
