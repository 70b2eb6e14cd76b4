"""Determinant pattern: parallel rows, one behind the other at the spacing of the sun."""

from __future__ import annotations

import numpy as np

from ..types import Floats
from .draft import Draft, row
from .need import Need

#: Lines that a patch should have at most, and lines per shortest pitch.
MOST, DENSITY = 40, 2.0
#: However much rows are cut, there are lines for so many.
LEAST = 4


def row_lines(need: Need, *, most: int = MOST, density: float = DENSITY) -> list[Draft]:
    """Draw parallel rows (RZ Table 3, determinant).

    Parameters
    ----------
    need
        The patch and what is asked of it.
    most
        Lines that there should be at most, and are but for the main rows; they lie farther apart
        where need be.
    density
        Lines per shortest distance of rows. With more of them a program that chooses rows has
        more freedom, and improves less in the same time: of 1, 2, 4 and 8, 1 and 2 gave the best
        plans within 6 seconds.

    Returns
    -------
    list of Draft
        The main rows first, from the side of the balconies to the back.
    """
    levels = most
    while True:
        drafts = [
            row(need.room, v, span, rank)
            for rank, v in row_levels(need, most=levels, density=density)
            for span in need.room.stretches(v, need.sizes)
        ]
        if len(drafts) <= most or levels <= LEAST:
            return drafts
        # holes and notches cut rows: fewer of them, all over the patch
        levels = max(LEAST, min(int(levels * most / len(drafts)), levels - 1))


def row_levels(
    need: Need, *, most: int = MOST, density: float = DENSITY
) -> list[tuple[int, float]]:
    """Choose where rows may stand across a patch.

    First the main rows: as many as the largest spacing of the types allows between the first and
    the last row with room for a building, evenly spread, so that the shadow of the last falls
    beyond the patch. Then rows at the spacing of each type by itself, counted from the front and
    from the back; then what fills the gaps.

    Parameters
    ----------
    need
        The patch and what is asked of it.
    most, density
        As of `row_lines`.

    Returns
    -------
    list of (int, float)
        Rank (0 for the main rows) and v in the frame of the rows, in order of use.
    """
    ends = [_ends(need, size) for size in need.sizes]
    fitting = [k for k, end in enumerate(ends) if end is not None]
    if not fitting:
        return []
    first = np.array([ends[k][0] for k in fitting])  # type: ignore[index]
    last = np.array([ends[k][1] for k in fitting])  # type: ignore[index]
    own = np.diag(need.pitch)[fitting]
    # the main rows have room for the deepest type, unless that costs much of the ground
    close = first - first.min() <= need.deepest / 2
    front, back = float(first[close].max()), float(max(last.min(), last.max() - need.deepest / 2))
    back = max(front, back)
    apart = max(need.rules.step_m, float(own.min()) / density, (last.max() - first.min()) / most)
    kept: list[tuple[int, float]] = []

    def offer(rank: int, levels: Floats) -> None:
        for v in levels:
            if all(abs(v - other) >= apart - 1e-6 for _, other in kept):
                kept.append((rank, float(v)))

    deep = float(need.pitch[fitting].max())
    offer(0, np.linspace(front, back, int((back - front) / deep + 1e-6) + 1))
    if len(kept) == 1 and back - front > apart:
        offer(1, np.array([back]))
    for k in np.argsort(-own, kind="stable"):
        offer(1, np.arange(first[k], last[k] + 1e-6, own[k]))
        offer(2, np.arange(last[k], first[k] - 1e-6, -own[k]))
    offer(3, np.array([first.min(), last.max()]))
    offer(3, _between(np.array([v for _, v in kept]), apart))
    return sorted(kept)


def _ends(need: Need, size: Floats) -> tuple[float, float] | None:
    """Give the first and last row with room for a building of a size."""
    first = need.room.outermost(*size)
    if first is None:
        return None
    last = need.room.outermost(*size, back=True)
    return first, first if last is None else last


def _between(levels: Floats, apart: float) -> Floats:
    """Divide gaps evenly into pieces of at least the least distance."""
    at = np.sort(levels)
    found = [
        np.linspace(a, b, int((b - a) / apart + 1e-9) + 1)[1:-1]
        for a, b in zip(at, at[1:])
        if b - a >= 2 * apart
    ]
    return np.concatenate([*found, np.zeros(0)])
