"""Windows of a search solved by several threads, with results that do not depend on timing."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Optional

from ...errors import CancelledError
from ..incumbent import Incumbent, patience
from ..problem import BoolArray
from .window_search import Job, WindowSearch
from .windows import Windows, solve_window

#: Seconds between two looks at whether to stop.
POLL = 0.04
#: Windows in flight. Window i is cut from the design after the results of all windows up to
#: i - LAG, whatever the number of threads: that keeps runs with the same seed the same.
LAG = 4

Result = tuple[Optional[BoolArray], float]


class Crew:
    """Threads that solve windows; use it in a `with` block.

    Parameters
    ----------
    windows
        The problem. Its `check` is made to end the building of models once the crew stops.
    threads
        How many work at the same time; `limit` changes it.
    """

    def __init__(self, windows: Windows, threads: int) -> None:
        self.windows = windows
        self.halt = threading.Event()
        self.windows.check = patience(self.halt.is_set)
        self._gate = threading.Semaphore(threads)
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="window")

    def __enter__(self) -> Crew:
        """Begin."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop what is under way; threads that a solver holds up end by themselves."""
        self.halt.set()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def limit(self) -> None:
        """Leave the work to a single thread from now on."""
        while self._threads > 1:
            # taken for good as soon as a thread gives it back
            self._threads -= 1
            self._pool.submit(self._gate.acquire)

    def submit(self, job: Job) -> Future[Result]:
        """Let a thread solve a window."""
        return self._pool.submit(self._solve, job)

    def _solve(self, job: Job) -> Result:
        """Solve a window, or return nothing if the crew has stopped."""
        with self._gate:
            if self.halt.is_set():
                return None, 0.0
            try:
                return solve_window(
                    self.windows,
                    job.free,
                    job.base,
                    job.options,
                    self.halt.is_set,
                    distances=job.distances,
                )
            except CancelledError:
                return None, 0.0


class Course:
    """A search of which some windows are in flight.

    Parameters
    ----------
    search
        Draws windows and takes results.
    crew
        Solves windows.
    """

    def __init__(self, search: WindowSearch, crew: Crew) -> None:
        self.search = search
        self._crew = crew
        self._flying: deque[tuple[Job, Future[Result]]] = deque()

    def step(self, run: Incumbent, enough: Callable[[], bool]) -> bool:
        """Take the oldest window's result; return False if the run is to stop before that."""
        while len(self._flying) < LAG:
            job = self.search.draw(run.deadline.left)
            self._flying.append((job, self._crew.submit(job)))
        job, future = self._flying.popleft()
        done = False
        while not done:
            if enough():
                return False
            done = bool(wait((future,), POLL).done)
        found, effort = future.result()
        self.search.apply(job, found, effort)
        return True
