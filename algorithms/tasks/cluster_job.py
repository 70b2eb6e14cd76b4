"""What a Dask cluster is sent: it knows nothing but Python, and the library by its name there."""

from __future__ import annotations


def trial(python: str) -> str:
    """Return why this worker cannot do our work; empty where it can.

    Parameters
    ----------
    python
        Version of Python of the caller, such as "3.11".
    """
    import importlib
    import sys

    own = f"{sys.version_info[0]}.{sys.version_info[1]}"
    if own != python:
        return f"it runs Python {own}, not {python}"
    try:
        importlib.import_module("platwright.tasks.job")
    except ImportError as error:
        return f"{type(error).__name__}: {error}"
    return ""


def answer(order: str) -> str:
    """Do a piece of work; see `job.answer`."""
    import importlib

    job = importlib.import_module("platwright.tasks.job")
    silent = importlib.import_module("platwright.progress").Silent()
    return str(job.answer(order, silent))
