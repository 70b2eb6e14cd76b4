"""One way to run a mixed-integer program, whichever solver does it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Optional

import pulp

from ..errors import InputError
from .linear import LinearModel

#: Seconds between two looks at whether a running solve should stop.
POLL = 0.1
#: Seconds that HiGHS gets to notice that it should stop; then it is left to itself.
GRACE = 0.3
#: Seconds that any other solver gets after its time limit, among others to start and to write.
OVERTIME = 2.0


@dataclass(frozen=True, eq=False)
class MipResult:
    """What a solver found.

    Attributes
    ----------
    status
        "optimal", "feasible", "infeasible" or "unknown".
    bound
        Proven lower bound of the objective, -inf if there is none.
    values
        Value of each variable by its name, or None if there is no solution.
    """

    status: str
    bound: float
    values: Optional[dict[str, float]] = None


def solver_names() -> list[str]:
    """List the names that `solve_mip` takes and whose solver is there."""
    found = pulp.listSolvers(onlyAvailable=True)
    return sorted({"highs"} | {name for name in found if name not in ("HiGHS", "HiGHS_CMD")})


def check_solver(name: str) -> None:
    """Raise `InputError` if no solver of that name can be used."""
    if name == "highs":
        if not pulp.HiGHS().available():
            raise InputError(
                "The solver 'highs' is not available.", "Install the Python package 'highspy'."
            )
        return
    if name not in pulp.listSolvers(onlyAvailable=False):
        raise InputError(
            f"Unknown solver '{name}'.",
            f"Choose one of: auto, cpsat, {', '.join(solver_names())}.",
        )
    if name not in solver_names():
        raise InputError(
            f"The solver '{name}' is known but not installed, or has no licence.",
            f"Choose one of: auto, cpsat, {', '.join(solver_names())}.",
        )


def solve_mip(
    model: LinearModel,
    *,
    time_limit: float,
    gap: float = 0.0,
    threads: int = 1,
    solver: str = "highs",
    start: Optional[dict[Any, float]] = None,
    on_incumbent: Optional[Callable[[dict[str, float]], None]] = None,
    on_bound: Optional[Callable[[float], None]] = None,
    cancelled: Optional[Callable[[], bool]] = None,
    nodes: Optional[int] = None,
) -> MipResult:
    """Solve a mixed-integer program.

    Parameters
    ----------
    model
        The program; `LinearModel.finish` has been called.
    time_limit
        Seconds.
    gap
        Relative gap at which the solver may stop.
    threads
        Number of threads.
    solver
        "highs", or a solver by the name that PuLP knows it by.
    start
        Value per variable to begin with, for solvers that take one. HiGHS through PuLP does
        not.
    on_incumbent, on_bound
        Told solutions (as `MipResult.values`) and bounds as they come, from a thread of the
        solver; HiGHS only.
    cancelled
        Asked about ten times a second; true ends HiGHS, which keeps its incumbent. Other
        solvers are left behind without an answer and run on until their time limit.
    nodes
        Most nodes of the search tree, None for no limit; HiGHS only. A run that ends by it gives
        the same result every time.

    Returns
    -------
    MipResult

    Raises
    ------
    InputError
        If there is no such solver.
    """
    check_solver(solver)
    if solver == "highs":
        watch = _Watch(model, on_incumbent, on_bound)
        return _solve_highs(model, time_limit, gap, threads, watch, nodes, cancelled)
    return _solve_other(model, time_limit, gap, solver, start, cancelled)


def _solve_other(
    model: LinearModel,
    time_limit: float,
    gap: float,
    solver: str,
    start: Optional[dict[Any, float]],
    cancelled: Optional[Callable[[], bool]],
) -> MipResult:
    """Run any other solver of PuLP, in a thread that may be left behind."""
    options: dict[str, Any] = {"msg": False, "timeLimit": max(1.0, time_limit), "gapRel": gap}
    if start is not None:
        for variable, first in start.items():
            variable.setInitialValue(first, check=False)
        options["warmStart"] = True
    try:
        found = pulp.getSolver(solver, **options)
    except TypeError:  # not every solver of PuLP takes every option
        options.pop("warmStart", None)
        found = pulp.getSolver(solver, msg=False, timeLimit=options["timeLimit"])
    failure: list[BaseException] = []

    def work() -> None:
        try:
            model.problem.solve(found)
        except BaseException as error:
            failure.append(error)

    # a daemon: it only waits for a program of its own, which nothing here can end
    thread = threading.Thread(target=work, name=solver, daemon=True)
    thread.start()
    end = time.monotonic() + options["timeLimit"] + OVERTIME
    while thread.is_alive():
        thread.join(POLL)
        if time.monotonic() > end or (cancelled is not None and cancelled()):
            break
    if failure and isinstance(failure[0], pulp.PulpSolverError):
        raise InputError(
            f"The solver '{solver}' failed: {failure[0]}.", "Choose the solver 'highs'."
        ) from failure[0]
    if failure:
        raise failure[0]
    if thread.is_alive():
        return MipResult("unknown", -math.inf)
    status = _status(model.problem)
    if status not in ("optimal", "feasible"):
        return MipResult(status, -math.inf)
    values = {v.name: float(v.value() or 0.0) for v in model.problem.variables()}
    # PuLP does not hand bounds on; an optimum without a gap is one
    bound = -math.inf
    if status == "optimal" and gap == 0:
        bound = model.cost_of(float(pulp.value(model.problem.objective) or 0.0))
    return MipResult(status, bound, values)


def _status(problem: Any) -> str:
    """Translate PuLP's status of the solution, which is right where that of the solve is not."""
    return {
        pulp.LpSolutionOptimal: "optimal",
        pulp.LpSolutionIntegerFeasible: "feasible",
        pulp.LpSolutionInfeasible: "infeasible",
    }.get(problem.sol_status, "unknown")


def _solve_highs(
    model: LinearModel,
    time_limit: float,
    gap: float,
    threads: int,
    watch: _Watch,
    nodes: Optional[int],
    cancelled: Optional[Callable[[], bool]],
) -> MipResult:
    """Run HiGHS in a thread of its own, with callbacks."""
    kinds = watch.kinds
    more = {} if nodes is None else {"mip_max_nodes": nodes}
    highs = pulp.HiGHS(
        msg=False,
        timeLimit=max(0.05, time_limit),
        gapRel=gap,
        gapAbs=0.0,
        threads=threads,
        callbackTuple=(watch.note, None),
        callbacksToActivate=[kinds.kCallbackMipInterrupt, kinds.kCallbackMipImprovingSolution],
        **more,
    )
    if not _run_highs(model, highs, watch, time_limit, nodes, cancelled):
        return watch.result("unknown")
    status = _status(model.problem)
    dual = float(model.problem.solverModel.getInfo().mip_dual_bound)
    if abs(dual) < 1e20:
        watch.bound = max(watch.bound, dual)
    if status in ("optimal", "feasible"):
        watch.values = [v.value() or 0.0 for v in model.problem.variables()]
    return watch.result(status)


def _run_highs(
    model: LinearModel,
    highs: Any,
    watch: _Watch,
    time_limit: float,
    nodes: Optional[int],
    cancelled: Optional[Callable[[], bool]],
) -> bool:
    """Run HiGHS in a thread of its own; return whether it came to an end."""
    failure: list[BaseException] = []

    def work() -> None:
        try:
            model.problem.solve(highs)
        except BaseException as error:
            failure.append(error)

    # presolve and the first relaxation do not call back, so that it may have to be left to
    # itself; not a daemon: the interpreter must not end while it works
    thread = threading.Thread(target=work, name="highs")
    thread.start()
    end = time.monotonic() + time_limit + GRACE
    while thread.is_alive() and time.monotonic() < end:
        thread.join(POLL)
        if cancelled is not None and not watch.stop.is_set() and cancelled():
            watch.stop.set()
            end = min(end, time.monotonic() + GRACE)
    if failure and isinstance(failure[0], KeyError) and nodes is not None:
        return False  # PuLP has no name for how HiGHS ends at its last node
    if failure:
        raise failure[0]
    if thread.is_alive():
        watch.stop.set()
        return False
    return True


class _Watch:
    """Hears from HiGHS what it finds, and stops it."""

    def __init__(
        self,
        model: LinearModel,
        on_incumbent: Optional[Callable[[dict[str, float]], None]],
        on_bound: Optional[Callable[[float], None]],
    ) -> None:
        self.model = model
        self.kinds = pulp.HiGHS.hscb.HighsCallbackType
        self.on_incumbent = on_incumbent
        self.on_bound = on_bound
        self.stop = threading.Event()
        self.bound = -math.inf
        # order in which PuLP hands the variables over
        self.names = [variable.name for variable in model.problem.variables()]
        self.values: Optional[list[float]] = None

    def note(self, kind: Any, _text: str, out: Any, answer: Any, _data: Any) -> None:
        """Take a callback of HiGHS."""
        if kind == self.kinds.kCallbackMipImprovingSolution:
            self.values = [float(x) for x in out.mip_solution]
            if self.on_incumbent is not None:
                self.on_incumbent(dict(zip(self.names, self.values)))
            return
        if self.stop.is_set():
            answer.user_interrupt = True
        if kind != self.kinds.kCallbackMipInterrupt:
            return
        if self.bound < out.mip_dual_bound < 1e20:
            self.bound = out.mip_dual_bound
            if self.on_bound is not None:
                self.on_bound(self.model.cost_of(self.bound))

    def result(self, status: str) -> MipResult:
        """Return what was found."""
        if status == "infeasible":
            return MipResult(status, -math.inf)
        if status == "unknown" and self.values is not None:
            status = "feasible"
        # an interrupted run calls its incumbent optimal
        if status == "optimal" and self.stop.is_set():
            status = "feasible"
        values = None if self.values is None else dict(zip(self.names, self.values))
        return MipResult(status, self.model.cost_of(self.bound), values)
