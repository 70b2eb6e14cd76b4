"""A linear program in arrays, given to HiGHS directly: rows can be added between two runs."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np

from ...mip.linear import LinearModel
from ..problem import FloatArray

#: Seconds between two looks at whether a running solve should stop.
POLL = 0.05
#: Seconds that HiGHS gets to notice that it should stop; then it is left to itself.
GRACE = 0.15
#: Part of the value (and of 1) that the tolerances of HiGHS may be worth.
TOLERANCE = 1e-6
#: Options for whole numbers. Designs come from the search; and the smaller programs that HiGHS
#: would solve to find some do not call back, so that they could not be stopped.
WHOLE: dict[str, Any] = {
    "mip_rel_gap": 0.0,
    "mip_heuristic_effort": 0.0,
    "mip_heuristic_run_rins": False,
    "mip_heuristic_run_rens": False,
    "mip_heuristic_run_root_reduced_cost": False,
}


class SparseModel(LinearModel):
    """The linear relaxation of a program; its variables are numbers from 0 on.

    Everything that writes into a `LinearModel` can write into this one. That variables are
    whole is forgotten.

    Attributes
    ----------
    cost, upper
        Of each variable; all are at least 0.
    rows
        (variables, coefficients, low, high) of each row.
    """

    def __init__(self, check: Optional[Callable[[], None]] = None) -> None:
        self.constant = 0.0
        self.factor = 1.0
        self.cost: list[float] = []
        self.upper: list[float] = []
        self.rows: list[tuple[list[int], list[float], float, float]] = []
        self._check = check

    def _variable(self, upper: Optional[float], category: str, cost: float) -> Any:  # noqa: ARG002
        self.cost.append(cost)
        self.upper.append(math.inf if upper is None else upper)
        return len(self.cost) - 1

    def add_cost(self, variable: Any, cost: float) -> None:
        """Add to the cost of a variable."""
        self.cost[variable] += cost

    def row(
        self,
        parts: Iterable[tuple[Any, float]],
        *,
        low: float = -math.inf,
        high: float = math.inf,
    ) -> None:
        """Demand low <= sum of coefficient times variable <= high."""
        if self._check is not None:
            self._check()
        sums: dict[int, float] = {}
        for variable, coefficient in parts:
            sums[variable] = sums.get(variable, 0.0) + coefficient
        self.rows.append((list(sums), list(sums.values()), low, high))

    def finish(self) -> None:
        """Scale the costs to where tolerances see them; call once, after everything else."""
        largest = max(self.cost, default=0.0)
        if 0 < largest < 1:
            self.factor = 2.0 ** math.ceil(-math.log2(largest))


@dataclass(frozen=True, eq=False)
class LpResult:
    """The optimum of a linear program.

    Attributes
    ----------
    bound
        Its value, less what the tolerances may be worth; -inf if it was not found.
    values
        Shape (variables,), or None if the optimum was not found.
    infeasible
        Whether the program has no solution.
    """

    bound: float
    values: Optional[FloatArray] = None
    infeasible: bool = False


class LpSolver:
    """HiGHS with a program in it that can grow by rows.

    Parameters
    ----------
    model
        The program, finished. Rows that it gets later are handed over at the next run.
    interior
        Use the interior point method without a basis: faster on large programs, but it begins
        anew every time.
    """

    def __init__(self, model: SparseModel, *, interior: bool = False) -> None:
        import highspy

        self._highspy = highspy
        self._model = model
        self._highs: Any = highspy.Highs()
        self._stop = threading.Event()
        self._handed = 0
        self._kinds = kinds = highspy.cb.HighsCallbackType
        self._whole_bound = -math.inf
        self._interior = interior
        # the first basis comes several times as fast from the interior point method
        crossover = "off" if interior else "on"
        options = {"output_flag": False, "threads": 1, "solver": "ipm", "run_crossover": crossover}
        for name, value in options.items():
            self._highs.setOptionValue(name, value)
        self._highs.setCallback(self._note, None)
        for kind in (
            kinds.kCallbackSimplexInterrupt,
            kinds.kCallbackIpmInterrupt,
            kinds.kCallbackMipInterrupt,
        ):
            self._highs.startCallback(kind)
        self._columns()

    def _note(self, kind: Any, _text: str, out: Any, answer: Any, _data: Any) -> None:
        """Answer a callback: end the run if it should; take note of a bound."""
        if self._stop.is_set():
            answer.user_interrupt = True
        if kind == self._kinds.kCallbackMipInterrupt:
            bound = float(out.mip_dual_bound)
            if abs(bound) < 1e20:
                self._whole_bound = max(self._whole_bound, bound)

    def _columns(self) -> None:
        """Hand the variables over."""
        program = self._highspy.HighsLp()
        count = len(self._model.cost)
        program.num_col_ = count
        program.num_row_ = 0
        program.col_cost_ = np.array(self._model.cost) * self._model.factor
        program.col_lower_ = np.zeros(count)
        program.col_upper_ = np.array(self._model.upper)
        program.a_matrix_.start_ = np.zeros(count + 1, dtype=np.int32)
        self._highs.passModel(program)

    def _hand_over(self) -> None:
        """Hand new rows over."""
        rows = self._model.rows[self._handed :]
        self._handed = len(self._model.rows)
        if not rows:
            return
        starts = np.cumsum([0] + [len(row[0]) for row in rows[:-1]]).astype(np.int32)
        columns = np.array([c for row in rows for c in row[0]], dtype=np.int32)
        values = np.array([a for row in rows for a in row[1]], dtype=float)
        low = np.array([row[2] for row in rows], dtype=float)
        high = np.array([row[3] for row in rows], dtype=float)
        self._highs.addRows(len(rows), low, high, len(columns), starts, columns, values)

    def solve(self, stop: Callable[[], bool]) -> LpResult:
        """Find the optimum.

        Parameters
        ----------
        stop
            Asked about 20 times a second; true ends the run, which then has no result.
        """
        if not self._run(stop, lambda: None):
            return LpResult(-math.inf)
        if not self._interior:
            self._highs.setOptionValue("solver", "simplex")
        return self._result()

    def solve_whole(
        self, whole: list[int], stop: Callable[[], bool], tell: Callable[[float], None]
    ) -> LpResult:
        """Find the optimum with some variables in whole numbers.

        Parameters
        ----------
        whole
            The variables; their upper bound is 1.
        stop
            Asked about 20 times a second; true ends the run.
        tell
            Told bounds as they come, from the caller's thread.

        Returns
        -------
        LpResult
            `values` only for an optimum.
        """
        kinds = self._highspy.HighsVarType
        columns = np.array(sorted(whole), dtype=np.int32)
        self._whole_bound = -math.inf

        def change(kind: Any, solver: str) -> None:
            self._highs.changeColsIntegrality(len(columns), columns, np.full(len(columns), kind))
            self._highs.setOptionValue("solver", solver)

        def note() -> None:
            if math.isfinite(self._whole_bound):
                tell(self._model.cost_of(self._whole_bound))

        # HiGHS would complete what it has to a first solution, and tell the bounds of that
        # smaller program as if they were those of the whole
        self._highs.clearSolver()
        change(kinds.kInteger, "choose")
        for name, value in WHOLE.items():
            self._highs.setOptionValue(name, value)
        ended = self._run(stop, note)
        note()
        if not ended:
            return LpResult(-math.inf)
        result = self._result()
        self._highs.clearSolver()
        change(kinds.kContinuous, "ipm")
        return result

    def _run(self, stop: Callable[[], bool], note: Callable[[], None]) -> bool:
        """Run HiGHS in a thread of its own; return whether it came to an end."""
        self._hand_over()
        failure: list[BaseException] = []

        def work() -> None:
            try:
                self._highs.run()
            except BaseException as error:
                failure.append(error)

        # presolve does not call back, so that it may have to be left to itself; not a daemon:
        # the interpreter must not end while it works
        thread = threading.Thread(target=work, name="highs")
        thread.start()
        end = math.inf
        while thread.is_alive() and time.monotonic() < end:
            thread.join(POLL)
            note()
            if not self._stop.is_set() and stop():
                self._stop.set()
                end = time.monotonic() + GRACE
        if failure:
            raise failure[0]
        return not thread.is_alive()

    def _result(self) -> LpResult:
        """Read the result of a run."""
        statuses = self._highspy.HighsModelStatus
        status = self._highs.getModelStatus()
        if self._stop.is_set() or status not in (statuses.kOptimal, statuses.kInfeasible):
            return LpResult(-math.inf)
        if status == statuses.kInfeasible:
            return LpResult(-math.inf, infeasible=True)
        value = float(self._highs.getObjectiveValue())
        bound = self._model.cost_of(value - TOLERANCE * (1.0 + abs(value)))
        return LpResult(bound, np.array(self._highs.getSolution().col_value))
