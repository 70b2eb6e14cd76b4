"""The one seam at which it is chosen where independent work is done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Optional, Protocol

from ..progress import Progress, Silent
from .job import Function, Teller, answer, order
from .ledger import Ledger, Outcome


class Executor(Protocol):
    """Who does the work: `Serial`, `Processes` or `Cluster`."""

    def run(self, ledger: Ledger) -> None:
        """Take pieces from the ledger and bring their answers, until none is left.

        It returns within a second after `ledger.progress.cancelled()` is true.
        """


class Serial:
    """Does one piece after the other in this process.

    A piece that brings the process down takes all with it. When the run is cancelled the piece
    under way decides what it still returns.
    """

    def run(self, ledger: Ledger) -> None:
        """Do the work; see `Executor.run`."""
        while not ledger.progress.cancelled():
            number = ledger.take()
            if number is None:
                return
            listener = _listener(ledger, number)
            ledger.answer(number, answer(ledger.orders[number], listener))


def _listener(ledger: Ledger, number: int) -> Progress:
    return Teller(lambda said: ledger.hear(number, said), ledger.progress.cancelled)


def run_tasks(
    function: Function,
    items: Iterable[Any],
    executor: Optional[Executor] = None,
    progress: Optional[Progress] = None,
    *,
    retries: int = 1,
    labels: Optional[Sequence[str]] = None,
    settled: Optional[Callable[[int, Outcome], None]] = None,
) -> list[Outcome]:
    """Do the same with each of many items, here, in processes of their own, or on a cluster.

    The results are the same bit for bit wherever the work is done, if the function depends on
    nothing but its item: no clock, no random numbers without a seed. Items and results travel as
    text (`wire`), also where they need not, so that the function sees the same everywhere.

    Parameters
    ----------
    function
        Takes an item and a `Progress` and returns a value. It is found by its name: a function
        of this library, or of a module that can be imported where the work is done. It should
        end within a second after the progress says that the run is cancelled.
    items
        What it is done with; of the kinds that `wire.to_text` knows.
    executor
        Who does the work; None for `Serial`.
    progress
        Told how many items are done and what is told of each; asked whether to stop.
    retries
        How often an item is begun again whose process ended, or for which the function failed
        for a reason that nobody foresaw. What the library refuses with a sentence
        (`PlatwrightError`) is not tried again.
    labels
        How the items are called in what is told; None for their numbers from 1.
    settled
        Told the position and the outcome of each item as soon as it has one, to keep it at once.

    Returns
    -------
    list of Outcome
        One for each item, in their order: the value, or the reason why there is none.

    Raises
    ------
    TypeError
        An item or the function cannot be handed over.
    ExecutorError
        There is no Python to start, or no cluster at the address.
    MissingDependencyError
        The cluster needs a package that is not installed.

    Examples
    --------
    >>> [one.value for one in run_tasks(shortened, ["a b", "c"])]
    ['a', 'c']
    """
    orders = [order(function, item) for item in items]
    names = list(labels) if labels is not None else [str(i + 1) for i in range(len(orders))]
    if len(names) != len(orders):
        msg = f"{len(names)} labels for {len(orders)} items"
        raise ValueError(msg)
    ledger = Ledger(orders, retries, progress or Silent(), names, settled)
    if orders:
        (executor or Serial()).run(ledger)
    return ledger.outcomes()


def shortened(item: str, _: Progress) -> str:
    """Return the first word of a text: the least that `run_tasks` can be tried with."""
    return item.partition(" ")[0]
