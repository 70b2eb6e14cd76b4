"""What a run knows so far: the best design, the bound, and whether that will do."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Optional

from ..progress import Deadline, Progress, SearchState
from .evaluate import Evaluator
from .problem import BoolArray, Design

#: Relative difference of objective and bound that counts as none.
TOLERANCE = 1e-5


@dataclass(eq=False)
class Incumbent:
    """The best design and the best bound of a run; safe to share between threads.

    Attributes
    ----------
    evaluator
        Judges designs.
    deadline
        When to stop.
    gap
        Relative gap that will do.
    progress
        Told what is new, from the thread that calls `report`.
    grain
        Every objective is a whole multiple of 1 / grain; 0 if that is not known.
    proven
        Whether a solver without rounded costs has proven the best design optimal.
    best, value, bound
        Best design (shape (e,)) or None, its exact objective, proven lower bound.
    """

    evaluator: Evaluator
    deadline: Deadline
    gap: float = 0.0
    progress: Optional[Progress] = None
    grain: int = 0
    proven: bool = False
    best: Optional[BoolArray] = None
    value: float = math.inf
    bound: float = 0.0
    history: list[tuple[float, float]] = field(default_factory=list)
    finished: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        """Prepare what threads share."""
        self._lock = threading.Lock()
        self._told: tuple[float, float] = (math.inf, 0.0)

    def take(self, active: BoolArray) -> bool:
        """Keep a design if it is valid and better; return whether it is."""
        value = self.evaluator.objective(active)
        with self._lock:
            if not value < self.value - 1e-9:
                return False
            self.best, self.value = active.copy(), value
            self.history.append((self.deadline.elapsed, value))
            return True

    def raise_bound(self, bound: float) -> None:
        """Take note of a proven bound."""
        if not math.isfinite(bound):
            return
        if self.grain:
            bound = math.ceil(bound * self.grain - 1e-4) / self.grain
        with self._lock:
            self.bound = max(self.bound, bound)

    def report(self) -> None:
        """Tell the caller what is new since the last time."""
        now = (self.value, self.bound)
        if self.progress is not None and now != self._told:
            value = None if self.best is None else self.value
            self.progress.search(SearchState(value, self.bound, self.deadline.elapsed))
        self._told = now

    def closed(self) -> bool:
        """Tell whether the gap will do."""
        if self.best is None:
            return False
        if self.proven:
            return True
        return self.value - self.bound <= max(self.gap, TOLERANCE) * max(1e-9, abs(self.value))

    def enough(self) -> bool:
        """Report, and tell whether to stop: gap reached, time up, cancelled or finished."""
        self.report()
        return self.closed() or self.deadline.passed() or self.finished.is_set()

    def cancelled(self) -> bool:
        """Tell whether the caller wants the run to stop."""
        return self.progress is not None and self.progress.cancelled()

    def beside(self, work: Callable[[], None]) -> Companion:
        """Run `work` in a thread of its own until it ends or the run is finished."""
        return Companion(work, self.finished)

    def design(self) -> Design:
        """Return the best design; there must be one."""
        if self.best is None:
            msg = "there is no design yet"
            raise ValueError(msg)
        found = self.evaluator.evaluate(self.best)
        bound = min(self.bound, found.objective)
        missing = found.objective - bound
        if missing <= TOLERANCE * max(1e-9, found.objective):
            bound, stopped = found.objective, "optimal"
        elif self.proven:
            stopped = "optimal"
        elif missing <= self.gap * found.objective:
            stopped = "gap"
        elif self.cancelled():
            stopped = "cancelled"
        else:
            stopped = "time"
        return Design(
            active=self.best,
            objective=found.objective,
            bound=bound,
            seconds=self.deadline.elapsed,
            stopped=stopped,
            distance=found.distance,
            uncovered=found.uncovered,
            broken_clauses=found.broken_clauses,
            history=tuple(self.history),
        )


class Companion:
    """A thread beside the search; leaving the `with` block ends it.

    Parameters
    ----------
    work
        What it does; must look at `finished` often.
    finished
        Set when it is to end.
    """

    def __init__(self, work: Callable[[], None], finished: threading.Event) -> None:
        self._finished = finished
        self._failure: list[BaseException] = []
        self._work = work
        self._thread = threading.Thread(target=self._run, name="bound", daemon=True)

    def _run(self) -> None:
        """Work, and keep what goes wrong for the thread that waits."""
        try:
            self._work()
        except BaseException as error:
            self._failure.append(error)

    @property
    def alive(self) -> bool:
        """Whether the work goes on."""
        return self._thread.is_alive()

    def __enter__(self) -> Companion:
        """Start."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the thread; raise what went wrong in it."""
        self._finished.set()
        self._thread.join()
        if self._failure:
            raise self._failure[0]
