"""Solving whole network problems with CP-SAT (Google OR-Tools)."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np

from ..cuts.balls import BallCut, ball_cuts
from ..problem import BoolArray
from ..structure import Structure
from .connect import add_distances, add_ranks
from .model import FINEST, CpNetwork
from .ortools_access import cp_model

#: Seconds between two looks at whether a running solve should stop.
POLL = 0.05


@dataclass(frozen=True, eq=False)
class CpResult:
    """What CP-SAT found.

    Attributes
    ----------
    status
        "optimal", "feasible", "infeasible" or "unknown".
    active
        Shape (e + k,). Chosen edges and what follows them (`CpNetwork.tail`), or None.
    bound
        Proven lower bound of the objective; -inf if there is none.
    effort
        Work done, in CP-SAT's deterministic units.
    """

    status: str
    active: Optional[BoolArray]
    bound: float
    effort: float = 0.0


@dataclass(frozen=True)
class CpOptions:
    """How CP-SAT works.

    Attributes
    ----------
    time_limit
        Seconds of wall time.
    effort
        Limit in CP-SAT's deterministic units (about seconds), or None. A run that ends by it
        gives the same result every time.
    seed
        Seed of its random choices.
    workers
        Number of threads.
    interleave
        Whether several strategies take turns in the same order every time.
    linearization, probing, symmetry
        Levels of CP-SAT's own means; None for its defaults. Small models solve faster without.
    first_only
        Whether the first solution will do.
    """

    time_limit: float
    effort: Optional[float] = None
    seed: int = 1
    workers: int = 1
    interleave: bool = False
    linearization: Optional[int] = None
    probing: Optional[int] = None
    symmetry: Optional[int] = None
    first_only: bool = False


def run_cp(
    network: CpNetwork,
    options: CpOptions,
    *,
    stop: Optional[Callable[[], bool]] = None,
    on_solution: Optional[Callable[[BoolArray], None]] = None,
    on_bound: Optional[Callable[[float], None]] = None,
) -> CpResult:
    """Solve a CP-SAT model of a network.

    Parameters
    ----------
    network
        The model, complete but for its objective.
    options
        How to work.
    stop
        Asked about 20 times a second; true ends the run, which keeps what it has.
    on_solution, on_bound
        Told chosen edges and lower bounds; called from a thread of the solver.

    Returns
    -------
    CpResult
    """
    scale = network.minimise()
    cp = cp_model()
    solver = cp.CpSolver()
    _configure(solver, options)
    shift = network.constant

    class Watch(cp.CpSolverSolutionCallback):  # type: ignore[misc,name-defined]
        """Hands every solution on."""

        def on_solution_callback(self) -> None:
            """Take the solution."""
            if on_solution is not None:
                on_solution(network.chosen(self.boolean_value))

    if on_bound is not None:
        tell = on_bound
        solver.best_bound_callback = lambda bound: tell(bound / scale + shift)
    status = watched(solver, network.model, stop, Watch())
    names = {
        cp.OPTIMAL: "optimal",
        cp.FEASIBLE: "feasible",
        cp.INFEASIBLE: "infeasible",
    }
    name = names.get(status, "unknown")
    active = network.chosen(solver.boolean_value) if name in ("optimal", "feasible") else None
    bound = -np.inf if name == "infeasible" else solver.best_objective_bound / scale + shift
    effort = float(solver.response_proto.deterministic_time)
    return CpResult(name, active, float(bound), effort)


def _configure(solver: Any, options: CpOptions) -> None:
    """Hand the options to the solver."""
    p = solver.parameters
    p.max_time_in_seconds = max(0.01, options.time_limit)
    if options.effort is not None:
        p.max_deterministic_time = options.effort
    p.random_seed = options.seed % 2**31
    p.num_workers = options.workers
    p.interleave_search = options.interleave
    if options.linearization is not None:
        p.linearization_level = options.linearization
    if options.probing is not None:
        p.cp_model_probing_level = options.probing
    if options.symmetry is not None:
        p.symmetry_level = options.symmetry
    p.stop_after_first_solution = options.first_only
    # CP-SAT would take the handler of interrupts away from whoever runs us, for good
    p.catch_sigint_signal = False


def watched(solver: Any, model: Any, stop: Optional[Callable[[], bool]], watch: Any = None) -> Any:
    """Solve in a thread of its own while the caller's thread asks whether to stop.

    Parameters
    ----------
    solver, model
        A `CpSolver` and a `CpModel`.
    stop
        Asked about 20 times a second; None for never.
    watch
        Told of solutions.

    Returns
    -------
    int
        The status, in CP-SAT's words.
    """
    if stop is None:
        return solver.solve(model, watch)
    result: list[Any] = []
    failure: list[BaseException] = []

    def work() -> None:
        try:
            result.append(solver.solve(model, watch))
        except BaseException as error:
            failure.append(error)

    thread = threading.Thread(target=work, name="cpsat", daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(POLL)
        if thread.is_alive() and stop():
            solver.stop_search()
    if failure:
        raise failure[0]
    return result[0]


def full_network(
    index: Structure,
    *,
    cuts: Optional[list[BallCut]] = None,
    start: Optional[BoolArray] = None,
    distance_limit: Optional[float] = None,
    ranks: bool = False,
    finest: int = FINEST,
    check: Optional[Callable[[], None]] = None,
) -> CpNetwork:
    """Build the model of a whole problem.

    Parameters
    ----------
    index
        The problem.
    cuts
        Ball-exit inequalities; None for all.
    start
        A design to start from.
    distance_limit
        No vertex whose distance counts may be farther than this from a sink; None for no limit.
    ranks
        Connect by ranks even if distances count, which then are left out.
    finest, check
        See `CpNetwork`.
    """
    none = np.zeros(len(index.ends), dtype=bool)
    network = CpNetwork(index, index.edges, none, finest=finest, check=check)
    network.constant = index.fixed
    network.add_terms(index.terms)
    network.add_cover(index.cover)
    network.add_cuts(ball_cuts(index, check) if cuts is None else cuts)
    network.add_requirements()
    if index.with_distance and not ranks:
        add_distances(network, distance_limit)
    else:
        add_ranks(network)
    if start is not None:
        network.hint(start)
    return network
