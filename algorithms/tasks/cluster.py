"""Work on a Dask cluster that exists already, for those who outgrow one machine."""

from __future__ import annotations

import importlib
import sys
import time
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from ..errors import MissingDependencyError
from . import cluster_job
from .ledger import ExecutorError, Ledger

#: Seconds between two looks at whether to stop.
POLL = 0.05


@dataclass(frozen=True)
class Cluster:
    """Does pieces on the workers of a Dask cluster.

    Its workers need the same version of Python as this process and the library installed
    (`pip install platwright`, the same version too). A piece whose worker is lost is begun again
    by the scheduler and, where that gives up, by us. Cancelling returns at once; pieces that a
    worker has begun run on there until their own time limit.

    Attributes
    ----------
    address
        That of the scheduler, such as "tcp://192.168.0.10:8786".
    timeout
        Seconds to wait for it.
    """

    address: str
    timeout: float = 10.0

    def run(self, ledger: Ledger) -> None:
        """Do the work; see `Executor.run`."""
        distributed = _distributed()
        # its code travels with it: only what the library does is installed there
        sys.modules["cloudpickle"].register_pickle_by_value(cluster_job)
        try:
            client = distributed.Client(
                self.address, timeout=self.timeout, set_as_default=False, name="platwright"
            )
        except (OSError, ValueError, TimeoutError) as error:
            text = f"No Dask scheduler answers at {self.address} ({error})."
            raise ExecutorError(f"{text} Start one, or give another address.") from error
        futures: dict[Any, int] = {}
        try:
            _check_workers(client, self.address)
            while ledger.left and not ledger.progress.cancelled():
                while ledger.waiting:
                    number = ledger.take()
                    if number is not None:
                        order = ledger.orders[number]
                        future = client.submit(cluster_job.answer, order, pure=False)
                        futures[future] = number
                _collect(ledger, futures)
        finally:
            client.cancel(list(futures), force=True)
            client.close(timeout=1)


def _distributed() -> ModuleType:
    """Return the package; raise an error that says what to do where it is missing."""
    try:
        found = importlib.import_module("distributed")
        importlib.import_module("cloudpickle")
    except ImportError as error:
        msg = f"Work on a cluster needs the Python package distributed ({error}). Install it."
        raise MissingDependencyError(msg) from error
    return found


def _check_workers(client: Any, address: str) -> None:
    """Refuse a cluster whose workers cannot do the work."""
    said: dict[str, str] = client.run(
        cluster_job.trial, f"{sys.version_info[0]}.{sys.version_info[1]}"
    )
    if not said:
        msg = f"The cluster at {address} has no workers. Start some and try again."
        raise ExecutorError(msg)
    for worker, problem in sorted(said.items()):
        if problem:
            msg = (
                f"The worker {worker} cannot load platwright ({problem}). Install it there, on "
                "the same version of Python."
            )
            raise ExecutorError(msg)


def _collect(ledger: Ledger, futures: dict[Any, int]) -> None:
    """Take the answers that have come, or wait a moment."""
    over = [future for future in futures if future.done()]
    if not over:
        time.sleep(POLL)
    for future in over:
        number = futures.pop(future)
        if future.status == "finished":
            ledger.answer(number, future.result())
        else:
            error = future.exception()
            ledger.lose(number, f"The cluster lost it ({type(error).__name__}: {error}).")
