"""Long work on many or large geometries that a caller can still cancel within a second."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any, Callable, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from ..errors import CancelledError
from ..progress import Progress

CHUNK = 20_000
"""So many vertices are worked on between two questions to the caller."""

PATIENCE = 0.1
"""Time between two questions while one long operation runs, seconds."""

PREPARING = "the sites were prepared"
"""The work of this room, as messages call it."""

_Result = TypeVar("_Result")


def ask(progress: Progress | None, work: str = PREPARING) -> None:
    """Stop the work if the caller has cancelled.

    Parameters
    ----------
    progress
        The caller, or None.
    work
        What is going on, as the rest of the sentence "Cancelled while ...".

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    if progress is not None and progress.cancelled():
        raise CancelledError(f"Cancelled while {work}.")


def chunks(geometries: npt.NDArray[Any]) -> list[slice]:
    """Part an array of geometries into runs of about `CHUNK` vertices.

    Parameters
    ----------
    geometries
        Shape (n,).

    Returns
    -------
    list of slice
        Runs that cover the array in its order, at least one.
    """
    number = np.cumsum(shapely.get_num_coordinates(geometries)) // CHUNK
    cuts = (np.flatnonzero(np.diff(number)) + 1).tolist()
    return [slice(a, b) for a, b in zip([0, *cuts], [*cuts, len(geometries)])]


def in_chunks(
    function: Callable[[npt.NDArray[Any]], npt.NDArray[Any]],
    geometries: npt.NDArray[Any],
    progress: Progress | None,
    work: str = PREPARING,
) -> npt.NDArray[Any]:
    """Apply a function, that treats each geometry by itself, chunk by chunk.

    Parameters
    ----------
    function
        Takes an array of k geometries and gives an array of k values.
    geometries
        Shape (n,).
    progress
        Asked for cancellation before each chunk, or None.
    work
        As of `ask`.

    Returns
    -------
    ndarray
        Shape (n, ...).

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    results = []
    for part in chunks(geometries):
        ask(progress, work)
        results.append(function(geometries[part]))
    return results[0] if len(results) == 1 else np.concatenate(results)


def aside(
    function: Callable[..., _Result],
    geometries: npt.NDArray[Any],
    progress: Progress | None,
    *arguments: Any,
    work: str = PREPARING,
) -> _Result:
    """Work on geometries that cannot be parted; where they are large, in a thread.

    GEOS cannot be stopped in the middle of an operation. After a cancel the thread runs to
    the end of its own and the result is thrown away.

    Parameters
    ----------
    function
        Called with `geometries` and `arguments`; must not change what others see.
    geometries
        Shape (n,).
    progress
        Asked for cancellation meanwhile, from the thread of the caller, or None.
    *arguments
        Further arguments.
    work
        As of `ask`.

    Returns
    -------
    object
        What the function returns.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    ask(progress, work)
    if progress is None or int(np.sum(shapely.get_num_coordinates(geometries))) < CHUNK:
        return function(geometries, *arguments)
    pool = ThreadPoolExecutor(max_workers=1)
    try:
        future = pool.submit(function, geometries, *arguments)
        while not wait([future], timeout=PATIENCE).done:
            ask(progress, work)
        return future.result()
    finally:
        pool.shutdown(wait=False)
