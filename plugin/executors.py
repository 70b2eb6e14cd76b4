"""Where independent work of a tool is done: in QGIS, in processes beside it, or on a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from qgis.core import QgsProcessingParameterDefinition, QgsProcessingParameterString

from . import compat, deps, parameters
from .installer_process import InstallError, find_python
from .progress import FeedbackProgress
from .request import Request


def inputs() -> Iterator[QgsProcessingParameterDefinition]:
    """Declare how many work at the same time, and where."""
    yield parameters.number(
        "WORKERS",
        "Workers",
        "How much is done at the same time, each in a process of its own. 1: one after the other "
        "in this program. The results are the same.",
        default=2,
        minimum=1,
        maximum=256,
        integer=True,
        advanced=True,
    )
    address = QgsProcessingParameterString(
        "CLUSTER", "Address of a Dask cluster", "", False, optional=True
    )
    address.setHelp(
        "That of its scheduler, such as tcp://192.168.0.10:8786; its workers need Python of the "
        "same version with platwright installed. Empty: this machine does the work. Optional."
    )
    address.setFlags(address.flags() | compat.ADVANCED)
    yield address


def executor(request: Request, progress: FeedbackProgress) -> Any:
    """Return who does the work, see `tasks.run_tasks`.

    The program that runs here is QGIS: its Python is looked for, and where none is found the
    work is done here.
    """
    from ..algorithms.tasks import Cluster, Processes, Serial

    address = request.field("CLUSTER").strip()
    if address:
        return Cluster(address)
    workers = request.integer("WORKERS")
    if workers == 1:
        return Serial()
    try:
        python = find_python(progress)
    except InstallError as error:
        progress.warn(f"{error} The work is done one after the other.")
        return Serial()
    return Processes(workers, python, deps.folders())
