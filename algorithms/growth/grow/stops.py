"""When growth stops, and what it says on its way."""

from __future__ import annotations

import time

from ...progress import Progress
from ..rules import GrowthRules
from ..types import Step
from .columns import Columns

#: Iterations in a row in which nothing was built, after which growth stops.
IDLE = 50
#: Why a growth stopped that its caller cancelled.
CANCELLED = "it was cancelled"
#: Least seconds between two reports of progress.
EVERY = 0.25


class Limits:
    """The stop rules of a growth (CS section 1: the first that is met stops it).

    Parameters
    ----------
    rules
        What is asked.
    columns
        What has grown.
    given
        How many nodes there were before.
    progress
        Told and asked.
    """

    def __init__(
        self, rules: GrowthRules, columns: Columns, given: int, progress: Progress
    ) -> None:
        self.rules, self.columns, self.given, self.progress = rules, columns, given, progress
        self.steps: list[Step] = []
        self.began = time.monotonic()
        self._told = -EVERY
        self._idle = 0
        segments = rules.max_segments
        # CitySprout asks for more edges than its limit
        self._segments = float("inf") if segments is None else segments + rules.as_published
        lengths = [rules.max_length or float("inf")]
        if rules.population is not None:
            lengths.append(rules.population / rules.people_per_metre)
        self._length = min(lengths)

    def full(self) -> bool:
        """Tell whether a limit of size is reached; asked after every street."""
        return self.columns.grown >= self._segments or self.columns.length >= self._length

    def step(self, growing: int) -> None:
        """Note the end of an iteration after which `growing` nodes may still grow."""
        columns = self.columns
        before = self.steps[-1].segments if self.steps else 0
        self._idle = 0 if columns.grown > before else self._idle + 1
        self.steps.append(
            Step(
                len(self.steps) + 1,
                len(columns.x) - self.given,
                columns.grown,
                columns.length,
                columns.length * self.rules.people_per_metre,
                growing,
                time.monotonic() - self.began,
            )
        )

    def over(self, growing: int) -> str:
        """Return why growth stops between two iterations, empty if it goes on."""
        rules, columns = self.rules, self.columns
        if rules.max_segments is not None and columns.grown >= self._segments:
            return f"{rules.max_segments:,} streets were reached"
        if rules.max_length is not None and columns.length >= rules.max_length:
            return f"{rules.max_length:,.0f} m of streets were reached"
        if self.full():
            return f"streets for {rules.population:,.0f} people were reached"
        if not growing:
            return "nothing is left that grows"
        if rules.iterations is not None and len(self.steps) >= rules.iterations:
            return (
                "1 iteration was done"
                if rules.iterations == 1
                else f"{rules.iterations:,} iterations were done"
            )
        if self._idle >= IDLE:
            return f"nothing was built in {IDLE} iterations"
        return ""

    def ask(self) -> bool:
        """Tell how far growth is, now and then; return whether it was cancelled."""
        now = time.monotonic() - self.began
        if now - self._told >= EVERY:
            self._told = now
            columns = self.columns
            text = (
                f"Iteration {len(self.steps) + 1}: {columns.grown:,} streets, "
                f"{columns.length / 1000:,.1f} km"
            )
            self.progress.stage(text, self.fraction())
        return self.progress.cancelled()

    def fraction(self) -> float:
        """Return how near the nearest limit is, 0 to 1."""
        columns = self.columns
        parts = [columns.grown / self._segments, columns.length / self._length]
        if self.rules.iterations is not None:
            parts.append(len(self.steps) / self.rules.iterations)
        return min(1.0, max(parts))
