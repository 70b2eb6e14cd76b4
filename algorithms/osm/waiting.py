"""Work that may hang, done in a thread that can be left alone.

A request that waits for a server, or for the name of a server, cannot be interrupted. It runs in
a thread of its own, and whoever waits for it looks at the Cancel button meanwhile and gives up
waiting when it is pressed or time is up.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from ..errors import CancelledError
from ..progress import Progress, SearchState

#: Seconds between two looks at the Cancel button.
TICK = 0.05

T = TypeVar("T")


class Relay:
    """The progress of work in another thread: what it says is passed on by the waiting one."""

    def __init__(self) -> None:
        self._said: queue.SimpleQueue[tuple[str, tuple[Any, ...]]] = queue.SimpleQueue()
        self._left = threading.Event()

    def stage(self, text: str, fraction: float) -> None:
        """Pass the stage on."""
        self._said.put(("stage", (text, fraction)))

    def search(self, state: SearchState) -> None:
        """Pass the state on."""
        self._said.put(("search", (state,)))

    def info(self, text: str) -> None:
        """Pass the remark on."""
        self._said.put(("info", (text,)))

    def warn(self, text: str) -> None:
        """Pass the warning on."""
        self._said.put(("warn", (text,)))

    def cancelled(self) -> bool:
        """Tell whether nobody waits any more."""
        return self._left.is_set()

    def leave(self) -> None:
        """Stop waiting for the work."""
        self._left.set()

    def deliver(self, progress: Progress) -> None:
        """Say what was said to the progress of the waiting thread."""
        while not self._said.empty():
            name, values = self._said.get()
            getattr(progress, name)(*values)


def wait_for(work: Callable[[Relay], T], progress: Progress, seconds: float = float("inf")) -> T:
    """Run `work` in a thread, and wait for it no longer than the caller wants to.

    Parameters
    ----------
    work
        Given a `Relay`; should look at its `cancelled` now and then and stop early.
    progress
        Hears what the work says, in this thread; asked for cancellation.
    seconds
        Longest time to wait.

    Returns
    -------
    object
        What the work returns.

    Raises
    ------
    CancelledError
        The caller has cancelled; the work goes on alone and its result is dropped.
    TimeoutError
        Time is up; likewise.
    """
    relay = Relay()
    results: list[T] = []
    errors: list[BaseException] = []
    done = threading.Event()

    def run() -> None:
        try:
            results.append(work(relay))
        except BaseException as error:  # it is raised again where somebody waits
            errors.append(error)
        finally:
            done.set()

    if progress.cancelled():
        raise CancelledError
    end = time.monotonic() + seconds
    # A daemon, so that QGIS can be closed while a server keeps silent.
    threading.Thread(target=run, name="platwright-osm", daemon=True).start()
    try:
        while not done.wait(TICK):
            relay.deliver(progress)
            if progress.cancelled():
                raise CancelledError
            if time.monotonic() > end:
                msg = f"no result within {seconds:.0f} s"
                raise TimeoutError(msg)
        relay.deliver(progress)
    finally:
        relay.leave()
    if errors:
        raise errors[0]
    return results[0]


def pause(seconds: float, progress: Progress) -> None:
    """Do nothing for a time.

    Raises
    ------
    CancelledError
        The caller has cancelled.
    """
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        if progress.cancelled():
            raise CancelledError
        time.sleep(min(TICK, left))
