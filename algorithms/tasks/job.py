"""One piece of work as a text, and the answer to it as a text."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from typing import Any

from ..errors import CancelledError, PlatwrightError
from ..progress import Progress, SearchState
from .wire import ROOT, from_text, to_text

#: What does the work: given an item and whom to tell, it returns a value.
Function = Callable[[Any, Progress], Any]
#: Least seconds between two messages about how far a piece of work is.
EVERY = 0.1


def order(function: Function, item: Any) -> str:
    """Return a piece of work as a text.

    Raises
    ------
    TypeError
        The function cannot be named, or the item cannot be handed over.
    """
    module, name = function.__module__, function.__qualname__
    if "<" in name or module == "__main__":
        msg = f"{name} has no name by which another process finds it"
        raise TypeError(msg)
    # QGIS chooses the name of the package; from its root on it is the same everywhere
    inside = module.startswith(f"{ROOT}.")
    place = module[len(ROOT) :] if inside else module
    return to_text({"function": f"{place}:{name}", "item": item})


def answer(text: str, progress: Progress) -> str:
    """Do a piece of work and return the answer to it.

    Returns
    -------
    str
        A mapping by `wire.to_text`: "value"; or "cancelled"; or the "reason" why it failed, and
        whether that is "final" because it would fail again.
    """
    try:
        asked = from_text(text)
        return to_text({"value": function_of(asked["function"])(asked["item"], progress)})
    except CancelledError:
        return to_text({"cancelled": True})
    except PlatwrightError as error:
        return to_text({"reason": str(error), "final": True})
    except Exception as error:
        # whatever it is, the other pieces go on
        return to_text({"reason": f"{type(error).__name__}: {error}", "final": False})


def function_of(name: str) -> Function:
    """Return the function that a name such as ".explore.design:design" means."""
    module, _, path = name.partition(":")
    found: Any = importlib.import_module(f"{ROOT}{module}" if module.startswith(".") else module)
    for part in path.split("."):
        found = getattr(found, part)
    if not callable(found):
        msg = f"{name} is no function"
        raise TypeError(msg)
    return found  # type: ignore[no-any-return]


class Teller:
    """A `Progress` that passes on what it is told as messages, not too many.

    Parameters
    ----------
    tell
        Takes a message: "stage" and "fraction", "info", or "warning".
    stopped
        Tells whether the work is to stop.
    """

    def __init__(self, tell: Callable[[dict[str, Any]], None], stopped: Callable[[], bool]) -> None:
        self._tell, self._stopped = tell, stopped
        self._due = 0.0

    def stage(self, text: str, fraction: float) -> None:
        """Pass the stage on, unless another was passed on just now."""
        now = time.monotonic()
        if now >= self._due:
            self._due = now + EVERY
            self._tell({"stage": text, "fraction": fraction})

    def search(self, state: SearchState) -> None:
        """Keep it: of many searches at once nobody could follow the bounds."""

    def info(self, text: str) -> None:
        """Pass a remark on."""
        self._tell({"info": text})

    def warn(self, text: str) -> None:
        """Pass a warning on."""
        self._tell({"warning": text})

    def cancelled(self) -> bool:
        """Tell whether the work is to stop."""
        return self._stopped()
