"""Which columns exclude each other, as cliques: sets of which at most one can be chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ..types import Floats, Ints
from ..zone import ControlLine
from .columns import Bools
from .outlines import INWARDS, TOLERANCE, Rows, pairs_between

#: Lines of a frame whose rows are this close across are one, metres.
LEVEL = 0.02


def cliques_of(rows: Rows, lines: Sequence[ControlLine], gap_m: float) -> list[Ints]:
    """Cover all conflicts between columns by cliques.

    Rows on lines that they are parallel to are intervals, so that every conflict of a kind (too
    close on a line, too close across lines, in the shade) is one of intervals that overlap; those
    have a clique at the beginning of one of them. The rest are found one by one.

    Parameters
    ----------
    rows
        Rows of all columns; those of a column are not in each other's way.
    lines
        The control lines.
    gap_m
        Least distance of buildings that do not border upon each other, metres.

    Returns
    -------
    list of numpy.ndarray
        Columns of each clique, two at least.
    """
    along = np.array([line.along for line in lines], dtype=bool)[rows.line]
    found: list[Ints] = []
    for frame in np.unique(rows.frame[along]):
        which = np.flatnonzero(along & (rows.frame == frame))
        found += _in_frame(rows.take(which), gap_m)
    found += _spaced(rows, lines)
    found += _one_by_one(rows, along, gap_m)
    return found


def _in_frame(rows: Rows, gap_m: float) -> list[Ints]:
    """Cover the conflicts of rows that face the same way and stand along their lines."""
    level = _levels(rows.v)
    height = np.array([rows.v[level == k].mean() for k in range(level.max(initial=-1) + 1)])
    found: list[Ints] = []
    low, high = rows.u - rows.half, rows.u + rows.half
    for k in range(len(height)):
        here = np.flatnonzero(level == k)
        # those whose bodies cross this level are apart along it, if at all
        body = np.flatnonzero((level == k) | (np.abs(rows.v - height[k]) < rows.deep))
        found += _stabbed(rows.owner[body], low[body], high[body] + gap_m - TOLERANCE)
        found += _shade(rows, here, height[k], low + INWARDS / 2, high - INWARDS / 2)
    return found + _across(rows, level, height, low, high, gap_m)


def _levels(v: Floats) -> Ints:
    """Give distances across a number each, nearly equal ones the same, shape (n,)."""
    order = np.argsort(v, kind="stable")
    level = np.zeros(len(v), dtype=np.int64)
    level[order] = np.cumsum(np.concatenate([[0], np.diff(v[order]) > LEVEL])) if len(v) else 0
    return level


def _shade(rows: Rows, here: Ints, height: float, low: Floats, high: Floats) -> list[Ints]:
    """Cover who shades the residences of one level.

    Of residences in front whose shadow reaches this level, those farther in front shade the
    others too, so that all over one point exclude each other. A facility is not shaded, so that
    each line of facilities makes cliques of its own.
    """
    homes = here[rows.home[here]]
    if not len(homes):
        return []
    front = (rows.v < height - LEVEL) & (rows.v + rows.reach - INWARDS > height)
    active = np.concatenate([np.flatnonzero(front & rows.home), homes])
    found = []
    if len(active) > len(homes):
        found += _stabbed(rows.owner[active], low[active], high[active])
    others = np.flatnonzero(front & ~rows.home)
    for line in np.unique(rows.line[others]):
        mine = others[rows.line[others] == line]
        behind = active[rows.v[active] > rows.v[mine].max() + LEVEL]
        both = np.concatenate([mine, behind])
        found += _stabbed(rows.owner[both], low[both], high[both])
    return found


def _across(
    rows: Rows, level: Ints, height: Floats, low: Floats, high: Floats, gap_m: float
) -> list[Ints]:
    """Cover which rows of neighbouring lines are too close."""
    kinds, kind = np.unique(
        np.column_stack([level, np.round(rows.deep * 1000).astype(np.int64)]),
        axis=0, return_inverse=True,
    )  # fmt: skip
    kind = np.ravel(kind)
    at, deep = height[kinds[:, 0]], kinds[:, 1] / 1000
    off = at[None, :] - at[:, None]
    between = off - deep[:, None] - deep[None, :]
    near = gap_m - TOLERANCE
    # where one crosses the level of the other they have a clique there
    open_ = (off > LEVEL) & (between < near) & (off >= np.maximum(deep[:, None], deep[None, :]))
    found = []
    for a, b in np.argwhere(open_):
        both = np.flatnonzero((kind == a) | (kind == b))
        needed = float(np.sqrt(near**2 - max(0.0, between[a, b]) ** 2))
        found += _stabbed(rows.owner[both], low[both], high[both] + needed)
    return found


def _stabbed(owner: Ints, low: Floats, high: Floats) -> list[Ints]:
    """Return the largest sets of intervals [low, high) that have a point in common."""
    starts = np.unique(low)
    # a set is largest where an interval ends before the next begins
    ends = np.sort(high)
    after = np.append(starts[1:], np.inf)
    has_end = np.searchsorted(ends, after, "right") > np.searchsorted(ends, starts, "right")
    starts = starts[has_end]
    inside = (low <= starts[:, None]) & (high > starts[:, None])
    found = []
    for mask in inside:
        members = np.unique(owner[mask])
        if len(members) > 1:
            found.append(members)
    return found


def _spaced(rows: Rows, lines: Sequence[ControlLine]) -> list[Ints]:
    """Cover which rows on a line with a least distance of centres are too close."""
    found = []
    for number in np.unique(rows.line):
        line = lines[number]
        if line.spacing_m <= 0 or line.length <= 0:
            continue
        here = np.flatnonzero(rows.line == number)
        centre = _along(rows, here, line)
        half = (line.spacing_m - TOLERANCE) / 2
        found += _stabbed(rows.owner[here], centre - half, centre + half)
    return found


def _along(rows: Rows, here: Ints, line: ControlLine) -> Floats:
    """Return the place of the centre of rows along their line, metres, shape (n,)."""
    way = (np.array(line.end) - np.array(line.start)) / line.length
    centre = shapely.get_coordinates(shapely.centroid(rows.body[here]))
    found: Floats = (centre - np.array(line.start)) @ way
    return found


def _one_by_one(rows: Rows, along: Bools, gap_m: float) -> list[Ints]:
    """Return the other conflicts, as pairs: askew to their line, or facing different ways."""
    found = []
    askew = np.flatnonzero(~along)
    if len(askew):
        pairs = pairs_between(rows.take(askew), rows, gap_m)
        found.append(np.column_stack([rows.owner[askew[pairs[:, 0]]], rows.owner[pairs[:, 1]]]))
    straight = np.flatnonzero(along)
    frames = np.unique(rows.frame[straight])
    for frame in frames[:-1]:
        one = straight[rows.frame[straight] == frame]
        two = straight[rows.frame[straight] > frame]
        pairs = pairs_between(rows.take(one), rows.take(two), gap_m)
        found.append(np.column_stack([rows.owner[one[pairs[:, 0]]], rows.owner[two[pairs[:, 1]]]]))
    if not found:
        return []
    every = np.sort(np.concatenate(found), axis=1)
    every = np.unique(every[every[:, 0] != every[:, 1]], axis=0)
    return list(every)
