"""The one place that imports OR-Tools, which is optional and has no type information."""

from __future__ import annotations

import importlib
from typing import Any

from ...errors import MissingDependencyError


def available() -> bool:
    """Tell whether OR-Tools can be imported."""
    try:
        cp_model()
    except MissingDependencyError:
        return False
    return True


def cp_model() -> Any:
    """Return the module `ortools.sat.python.cp_model`.

    Raises
    ------
    MissingDependencyError
        If OR-Tools is not installed or cannot be loaded.
    """
    try:
        return importlib.import_module("ortools.sat.python.cp_model")
    except ImportError as error:
        msg = (
            "The solver 'cpsat' needs the Python package 'ortools', which is not installed. "
            "Install it, or choose the solver 'highs'."
        )
        raise MissingDependencyError(msg) from error
