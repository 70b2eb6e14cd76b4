"""Lengths as whole numbers, so that every model and every check compares the same sums."""

from __future__ import annotations

import math

import numpy as np

from ...errors import InputError
from ..problem import BoolArray, FloatArray, IntArray, NetworkProblem

#: Parts of a metre in which lengths are summed up.
MILLIMETRES = 1000
#: Parts of a unit of `NetworkProblem.length` in which distances to sinks are compared.
MILLIONTHS = 1_000_000


def whole_parts(lengths: FloatArray, parts: int) -> IntArray:
    """Return lengths as whole numbers of 1/parts, rounded to the nearest.

    Parameters
    ----------
    lengths
        Any shape, not negative.
    parts
        Parts of a unit.

    Examples
    --------
    >>> whole_parts(np.array([20.0, 0.0126]), 1000).tolist()
    [20000, 13]
    """
    whole: IntArray = np.rint(np.asarray(lengths, dtype=float) * parts).astype(np.int64)
    return whole


def whole_limit(limit: float, parts: int) -> int:
    """Return a limit on sums of `whole_parts` as a whole number, rounded to the nearest."""
    return round(limit * parts)


def touched_vertices(problem: NetworkProblem, edges: BoolArray) -> BoolArray:
    """Return which vertices, shape (n,), the given edges touch."""
    touched = np.zeros(len(problem.mesh.vertices), dtype=bool)
    touched[problem.mesh.edges[edges].ravel()] = True
    return touched


def check_lengths(lengths: FloatArray, what: str) -> None:
    """Raise `InputError` unless lengths are finite and not negative."""
    if not np.all(np.isfinite(lengths) & (np.asarray(lengths) >= 0)):
        raise InputError(
            f"{what}: edges have no length, or a negative one.",
            "Give the length of every mesh edge in metres.",
        )


def check_number(value: float, what: str, *, least: float = 0.0, strict: bool = False) -> None:
    """Raise `InputError` unless a number is finite and at least (`strict`: above) `least`."""
    fits = value > least if strict else value >= least
    if not (math.isfinite(value) and fits):
        asked = "greater than" if strict else "at least"
        raise InputError(f"{what} is {value:g}.", f"Give a number that is {asked} {least:g}.")


def check_penalty(penalty: float, what: str) -> None:
    """Raise `InputError` unless a penalty is greater than 0; infinite forbids."""
    if not penalty > 0:
        raise InputError(
            f"{what}: a violation costs {penalty:g}.",
            "Give a cost greater than 0, or forbid violations; leave the rule out to allow them.",
        )
