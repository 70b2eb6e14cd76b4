"""What a run knows so far: the best design, the bound, and whether that will do."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Optional

from ..errors import CancelledError
from ..progress import Deadline, Progress, SearchState
from .evaluate import Evaluator
from .problem import BoolArray, Design

#: Relative difference of objective and bound that counts as none.
TOLERANCE = 1e-5
#: Seconds that the thread beside the search gets to end; then it is left to end by itself.
GRACE = 0.2
#: Seconds between two looks at whether a model that is being built is still wanted.
POLL = 0.05


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
    alone
        Whether only the thread that made the run may change the design, and proofs do not end
        it: then nothing depends on timing.
    best, value, bound
        Best design (shape (e,)) or None, its exact objective, proven lower bound.
    """

    evaluator: Evaluator
    deadline: Deadline
    gap: float = 0.0
    progress: Optional[Progress] = None
    grain: int = 0
    proven: bool = False
    alone: bool = False
    best: Optional[BoolArray] = None
    value: float = math.inf
    bound: float = 0.0
    history: list[tuple[float, float]] = field(default_factory=list)
    finished: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        """Prepare what threads share."""
        self._lock = threading.Lock()
        self._owner = threading.get_ident()
        self._told: tuple[float, float] = (math.inf, 0.0)

    def take(self, active: BoolArray) -> bool:
        """Keep a design if it is valid and better; return whether it is."""
        if self.alone and threading.get_ident() != self._owner:
            return False
        value = self.evaluator.objective(active)
        with self._lock:
            if not value < self.value - slight(value):
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
        if self.best is None or self.alone:
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

    def beside(self, work: Callable[[], None], *, later: bool = False) -> Companion:
        """Run `work` in a thread of its own until it ends or the run is finished.

        With `later` it begins when `Companion.start` is called.
        """
        return Companion(work, self, later=later)

    def wanted(self) -> Callable[[], None]:
        """Return what to call often while a model is built in the caller's thread.

        It raises `CancelledError` once the caller has cancelled.
        """
        return patience(self.cancelled)

    def wanted_beside(self) -> Callable[[], None]:
        """Return the same for the thread beside the search: an error once the run is over."""
        return patience(self.finished.is_set)

    def design(self) -> Design:
        """Return the best design; there must be one."""
        if self.best is None:
            msg = "there is no design yet"
            raise ValueError(msg)
        with self._lock:
            # a thread that was left behind may still find something
            best, bound, history = self.best, self.bound, tuple(self.history)
        found = self.evaluator.evaluate(best)
        bound = min(bound, found.objective)
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
            # a search that ends by its work depends on no clock, as long as none strikes
            stopped = "effort" if self.alone and not self.deadline.passed() else "time"
        return Design(
            active=best,
            objective=found.objective,
            bound=bound,
            seconds=self.deadline.elapsed,
            stopped=stopped,
            distance=found.distance,
            uncovered=found.uncovered,
            broken_clauses=found.broken_clauses,
            history=history,
        )


def slight(value: float) -> float:
    """Return the difference of objectives that counts as none; small objectives have less."""
    return 1e-9 * min(1.0, abs(value))


def patience(over: Callable[[], bool]) -> Callable[[], None]:
    """Return a function that raises `CancelledError` once `over` is true, asked now and then."""
    due = 0.0

    def check() -> None:
        nonlocal due
        now = time.monotonic()
        if now < due:
            return
        if over():
            raise CancelledError("The run was cancelled while a model was being built.")
        due = time.monotonic() + POLL

    return check


class Companion:
    """A thread beside the search; leaving the `with` block ends it.

    Parameters
    ----------
    work
        What it does; must look at `run.finished` often.
    run
        The run; it is finished when the block is left.
    later
        Whether to wait for `start`.
    """

    def __init__(self, work: Callable[[], None], run: Incumbent, *, later: bool = False) -> None:
        self._of = run
        self._later = later
        self._started = False
        self._failure: list[BaseException] = []
        self._work = work
        # not a daemon: the interpreter must not end while a solver works
        self._thread = threading.Thread(target=self._run, name="bound")

    def _run(self) -> None:
        """Work, and keep what goes wrong for the thread that waits."""
        try:
            self._work()
        except BaseException as error:
            ended = isinstance(error, CancelledError) and self._of.finished.is_set()
            if not ended:
                self._failure.append(error)

    @property
    def alive(self) -> bool:
        """Whether the work goes on."""
        return self._thread.is_alive()

    def __enter__(self) -> Companion:
        """Start, unless that is for later."""
        if not self._later:
            self.start()
        return self

    def start(self) -> bool:
        """Start the work; return False if it has been started before."""
        if self._started:
            return False
        self._started = True
        self._thread.start()
        return True

    def __exit__(self, kind: object, *_: object) -> None:
        """End the thread; raise what went wrong in it if there is no design, else warn."""
        self._of.finished.set()
        if self._started:
            self._thread.join(GRACE)
        if not self._failure or kind is not None:
            return
        error = self._failure[0]
        if self._of.best is None or not isinstance(error, Exception):
            raise error
        if self._of.progress is not None:
            self._of.progress.warn(
                "The proof of a bound failed, so that the gap of the design is not known well "
                f"({type(error).__name__}: {error}). The best design found is kept."
            )
