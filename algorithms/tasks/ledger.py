"""What becomes of each piece of work: waiting, under way, done, or given up with a reason."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Callable, Optional

from ..errors import PlatwrightError
from ..progress import Progress
from .wire import from_text

DONE, FAILED, CANCELLED = "done", "failed", "cancelled"


class ExecutorError(PlatwrightError):
    """No work can be done there at all; the text says why and what to do."""


@dataclass(frozen=True)
class Outcome:
    """What became of one piece of work.

    Attributes
    ----------
    state
        "done", "failed", or "cancelled" where the run was stopped before.
    value
        What the function returned; None where it failed.
    reason
        Why it failed, as a sentence; empty where it is done.
    attempts
        How often it was begun.
    """

    state: str
    value: Any = None
    reason: str = ""
    attempts: int = 0

    @property
    def done(self) -> bool:
        """Whether there is a value."""
        return self.state == DONE


class Ledger:
    """Hands out work, takes answers, and decides what is tried again.

    Parameters
    ----------
    orders
        The pieces of work as texts, see `job`.
    retries
        How often work is begun again that was lost with its process, or that failed for a
        reason that nobody foresaw. What the library refuses with a sentence it would refuse again.
    progress
        Told of what is done.
    labels
        How the pieces are called in what is told.
    settled
        Told the number and the outcome of each piece as soon as it has one; None for nobody.
    """

    def __init__(
        self,
        orders: Sequence[str],
        retries: int,
        progress: Progress,
        labels: Sequence[str],
        settled: Optional[Callable[[int, Outcome], None]] = None,
    ) -> None:
        self.orders = orders
        self.retries = retries
        self.progress = progress
        self.labels = labels
        self.settled = settled
        self.attempts = [0] * len(orders)
        self._waiting = deque(range(len(orders)))
        self._outcomes: dict[int, Outcome] = {}
        self._shares: dict[int, float] = {}

    @property
    def left(self) -> int:
        """How many pieces have no outcome yet."""
        return len(self.orders) - len(self._outcomes)

    @property
    def waiting(self) -> bool:
        """Whether there is a piece that nobody works on."""
        return bool(self._waiting)

    def take(self) -> Optional[int]:
        """Return the number of the next piece to work on; None where there is none."""
        if not self._waiting:
            return None
        number = self._waiting.popleft()
        self.attempts[number] += 1
        return number

    def hear(self, number: int, said: dict[str, Any]) -> None:
        """Take note of what is told of a piece that is under way."""
        if "fraction" in said:
            self._shares[number] = min(1.0, max(0.0, float(said["fraction"])))
            self._tell(f"{self.labels[number]}: {said['stage']}" if said["stage"] else "")
        elif "warning" in said:
            self.progress.warn(f"{self.labels[number]}: {said['warning']}")
        elif "info" in said:
            self.progress.info(f"{self.labels[number]}: {said['info']}")

    def answer(self, number: int, text: str) -> None:
        """Take the answer to a piece, see `job.answer`."""
        said = from_text(text)
        if "value" in said:
            self._settle(number, Outcome(DONE, said["value"], "", self.attempts[number]))
        elif said.get("cancelled"):
            self._settle(number, Outcome(CANCELLED, attempts=self.attempts[number]))
        else:
            self.lose(number, said["reason"], final=bool(said["final"]))

    def lose(self, number: int, reason: str, *, final: bool = False) -> None:
        """Take note that a piece failed; it waits again if it has attempts left."""
        self._shares.pop(number, None)
        if not final and self.attempts[number] <= self.retries:
            self._waiting.append(number)
            self.progress.info(f"{self.labels[number]}: {reason} It is tried again.")
            return
        self._settle(number, Outcome(FAILED, None, reason, self.attempts[number]))

    def outcomes(self) -> list[Outcome]:
        """Return all outcomes in the order of the orders; what is open counts as cancelled."""
        return [
            self._outcomes.get(i, Outcome(CANCELLED, attempts=self.attempts[i]))
            for i in range(len(self.orders))
        ]

    def _settle(self, number: int, outcome: Outcome) -> None:
        self._outcomes[number] = outcome
        self._shares.pop(number, None)
        if self.settled is not None:
            self.settled(number, outcome)
        self._tell("")

    def _tell(self, text: str) -> None:
        total = len(self.orders)
        share = (len(self._outcomes) + sum(self._shares.values())) / total
        counted = f"{len(self._outcomes)} of {total} done"
        self.progress.stage(f"{counted}; {text}" if text else counted, share)


#: What an executor is given to pass on what a piece of work tells.
Hearer = Callable[[int, "dict[str, Any]"], None]
