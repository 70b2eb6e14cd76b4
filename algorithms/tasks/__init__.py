"""Independent work, done one piece after the other, by processes, or by a Dask cluster."""

from .cluster import Cluster
from .ledger import ExecutorError, Outcome
from .local import Processes
from .run import Executor, Serial, run_tasks

__all__ = [
    "Cluster",
    "Executor",
    "ExecutorError",
    "Outcome",
    "Processes",
    "Serial",
    "run_tasks",
]
