"""How long work talks to whoever waits for it: one small protocol, no callbacks of its own."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class SearchState:
    """Where a search stands.

    Attributes
    ----------
    incumbent
        Objective of the best design so far, or None.
    bound
        Proven lower bound of the objective, or None.
    seconds
        Wall time since the search began.
    """

    incumbent: float | None
    bound: float | None
    seconds: float

    @property
    def gap(self) -> float | None:
        """Relative gap (incumbent - bound) / incumbent, or None where one is missing."""
        if self.incumbent is None or self.bound is None:
            return None
        if self.incumbent <= 0:
            return 0.0 if self.bound >= self.incumbent else None
        return max(0.0, (self.incumbent - self.bound) / self.incumbent)


class Progress(Protocol):
    """What the library asks of its caller; see `Silent` for the least that will do."""

    def stage(self, text: str, fraction: float) -> None:
        """Take note that the stage `text` begins; `fraction` of all the work is done."""

    def search(self, state: SearchState) -> None:
        """Take note of a better incumbent or bound."""

    def info(self, text: str) -> None:
        """Take note of a remark."""

    def warn(self, text: str) -> None:
        """Take note of something that the planner should know."""

    def cancelled(self) -> bool:
        """Tell whether the caller wants the work to stop; asked several times a second."""
        ...


class Silent:
    """A `Progress` that keeps quiet and is never cancelled."""

    def stage(self, text: str, fraction: float) -> None:
        """Ignore the stage."""

    def search(self, state: SearchState) -> None:
        """Ignore the state."""

    def info(self, text: str) -> None:
        """Ignore the remark."""

    def warn(self, text: str) -> None:
        """Ignore the warning."""

    def cancelled(self) -> bool:
        """Never cancel."""
        return False


class Share:
    """A part of a longer piece of work, told as its share of the whole.

    Parameters
    ----------
    progress
        Told of the whole.
    begin, end
        Fractions of the whole at which the part begins and ends.

    Examples
    --------
    >>> class Bar(Silent):
    ...     def stage(self, text: str, fraction: float) -> None:
    ...         print(text, fraction)
    >>> Share(Bar(), 0.5, 1.0).stage("half-way through the second half", 0.5)
    half-way through the second half 0.75
    """

    def __init__(self, progress: Progress, begin: float, end: float) -> None:
        self._progress, self._begin, self._end = progress, begin, end

    def stage(self, text: str, fraction: float) -> None:
        """Tell the stage, its fraction as one of the whole."""
        self._progress.stage(text, self._begin + fraction * (self._end - self._begin))

    def search(self, state: SearchState) -> None:
        """Pass the state of a search on."""
        self._progress.search(state)

    def info(self, text: str) -> None:
        """Pass a remark on."""
        self._progress.info(text)

    def warn(self, text: str) -> None:
        """Pass a warning on."""
        self._progress.warn(text)

    def cancelled(self) -> bool:
        """Ask the whole."""
        return self._progress.cancelled()


class Held(Share):
    """Keeps warnings back until it is known whether what they tell of is kept.

    Parameters
    ----------
    progress
        Told of all else at once.

    Attributes
    ----------
    warnings
        What was not told yet.

    Examples
    --------
    >>> held = Held(Silent())
    >>> held.warn("poor")
    >>> held.take(), held.warnings
    (['poor'], [])
    """

    def __init__(self, progress: Progress) -> None:
        super().__init__(progress, 0.0, 1.0)
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        """Keep the warning, once."""
        if text not in self.warnings:
            self.warnings.append(text)

    def take(self) -> list[str]:
        """Return what was not told yet, and forget it."""
        taken, self.warnings = self.warnings, []
        return taken


class Deadline:
    """A moment in time after which work should stop, joined with the caller's cancel.

    Parameters
    ----------
    seconds
        Time from now, in seconds.
    progress
        Asked for cancellation; None for never.
    """

    def __init__(self, seconds: float, progress: Progress | None = None) -> None:
        self.seconds = seconds
        self.start = time.monotonic()
        self.end = self.start + seconds
        self.progress = progress

    @property
    def elapsed(self) -> float:
        """Seconds since the deadline was set."""
        return time.monotonic() - self.start

    @property
    def left(self) -> float:
        """Seconds that remain, never negative."""
        return max(0.0, self.end - time.monotonic())

    def passed(self) -> bool:
        """Tell whether time is up or the caller has cancelled."""
        return self.left <= 0 or (self.progress is not None and self.progress.cancelled())
