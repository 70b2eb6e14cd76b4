"""Arcs at the bends of streets, as they are built."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import shapely

from ..network.problem import BoolArray, FloatArray, IntArray
from .smooth_graph import Geometries

#: Turn from one point of an arc to the next (degrees).
ARC_STEP = 6.0
#: An arc takes at most this share of the way to the next bend, or to the end of the street.
BETWEEN_BENDS, AT_JUNCTIONS = 0.48, 0.8
#: Sharper turns are no bends of a street that goes on (degrees).
HAIRPIN = 170.0
#: Arcs of less than this cannot be told from a corner (metres).
SMALLEST = 1.0


def fillet(xy: FloatArray, radius: FloatArray, least: float) -> tuple[FloatArray, IntArray]:
    """Round the bends of a line with arcs that touch both sides.

    Parameters
    ----------
    xy
        Shape (k, 2). Vertices, metres, no two neighbours at one place.
    radius
        Shape (k,). Of the arcs where there is room, metres; 0 for none.
    least
        Smallest turn that is rounded, degrees.

    Returns
    -------
    xy, places
        The new vertices, shape (m, 2), and where the old ones went, shape (k,): corners to the
        middle of their arcs.

    Examples
    --------
    >>> corner = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 100.0]])
    >>> made, places = fillet(corner, np.full(3, 20.0), 20.0)
    >>> made[places[1]].round(2).tolist()
    [94.14, 5.86]
    """
    steps = np.diff(xy, axis=0)
    size = np.hypot(*steps.T)
    unit = steps / np.maximum(size, 1e-12)[:, None]
    turn = np.abs(_turn(unit[:-1], unit[1:]))
    bends = np.flatnonzero(
        (turn > math.radians(least)) & (turn < math.radians(HAIRPIN)) & (radius[1:-1] >= SMALLEST)
    )
    identity = np.arange(len(xy))
    if not len(bends):
        return xy, identity
    arc = np.concatenate([[0.0], np.cumsum(size)])
    at = arc[bends + 1]
    gaps = np.diff(np.concatenate([[0.0], at, arc[-1:]]))
    share = np.full(len(gaps), BETWEEN_BENDS)
    share[[0, -1]] = AT_JUNCTIONS
    room = np.minimum((gaps * share)[:-1], (gaps * share)[1:])
    parts: list[FloatArray] = []
    places = np.empty(len(xy), dtype=np.int64)
    done = count = 0
    for k, here, most in zip((bends + 1).tolist(), at.tolist(), room.tolist()):
        reach = min(float(radius[k]) * math.tan(turn[k - 1] / 2), most)
        if reach / math.tan(turn[k - 1] / 2) < SMALLEST:
            continue
        curve = _curve(xy, arc, unit, here - reach, here + reach)
        first = int(np.searchsorted(arc, here - reach))
        after = int(np.searchsorted(arc, here + reach, side="right"))
        parts += [xy[done:first], curve]
        places[done:first] = count + np.arange(first - done)
        count += first - done
        along = (arc[first:after] - here + reach) / (2 * reach)
        places[first:after] = count + np.round(along * (len(curve) - 1)).astype(np.int64)
        count, done = count + len(curve), after
    parts.append(xy[done:])
    places[done:] = count + np.arange(len(xy) - done)
    return np.vstack(parts), places


def _turn(arriving: FloatArray, leaving: FloatArray) -> FloatArray:
    """Measure turns between unit vectors, positive to the left, radians."""
    cross = arriving[..., 0] * leaving[..., 1] - arriving[..., 1] * leaving[..., 0]
    return np.asarray(np.arctan2(cross, (arriving * leaving).sum(axis=-1)))


def _curve(
    xy: FloatArray, arc: FloatArray, unit: FloatArray, begin: float, end: float
) -> FloatArray:
    """Points of a curve between two places of a line, which it leaves and meets in its direction.

    It is an arc where both sides are straight: the cubic that is nearest to it.
    """
    last = len(unit) - 1
    side = [
        min(int(np.searchsorted(arc, begin, side="right")) - 1, last),
        max(int(np.searchsorted(arc, end, side="left")) - 1, 0),
    ]
    p, q = (xy[s] + (at - arc[s]) * unit[s] for s, at in zip(side, (begin, end)))
    u, v = unit[side[0]], unit[side[1]]
    turn = abs(float(_turn(u, v)))
    chord = math.dist(p, q)
    handle = chord / 3
    if math.sin(turn / 2) > 1e-6:
        handle = 4 / 3 * math.tan(turn / 4) * chord / (2 * math.sin(turn / 2))
    pieces = 2 * max(1, math.ceil(math.degrees(turn) / 2 / ARC_STEP))
    t = np.linspace(0.0, 1.0, pieces + 1)[:, None]
    found: FloatArray = (
        (1 - t) ** 3 * p
        + 3 * (1 - t) ** 2 * t * (p + handle * u)
        + 3 * (1 - t) * t**2 * (q - handle * v)
        + t**3 * q
    )
    return found


def fillet_streets(
    lines: Geometries,
    radius: FloatArray,
    least: float,
    runs: Sequence[Sequence[int]],
    still: Callable[[FloatArray], BoolArray],
) -> Geometries:
    """Round the bends of a network between its junctions.

    Parameters
    ----------
    lines
        Shape (e,). The present geometries of its edges.
    radius
        Shape (e,). Of the arcs on each edge, metres; 0 for edges that stay as they are.
    least
        Smallest turn that is rounded, degrees.
    runs
        Edges that follow one another, e along the edge and ~e against it, as those of
        `smooth_graph.chains_of`. Where one run ends nothing is rounded.
    still
        Tells which positions must not move, shape (k,).

    Returns
    -------
    array
        Shape (e,). Edges without a bend are the very geometries of `lines`.
    """
    found = lines.copy()
    for whole in runs:
        run: list[int] = []
        for step in [*whole, None]:
            if step is not None and radius[step if step >= 0 else ~step] >= SMALLEST:
                run.append(step)
            elif run:
                _fillet_run(found, run, radius, least, still)
                run = []
    return found


def _fillet_run(
    lines: Geometries,
    run: Sequence[int],
    radius: FloatArray,
    least: float,
    still: Callable[[FloatArray], BoolArray],
) -> None:
    """Round the bends of edges that follow one another, in place."""
    parts: list[FloatArray] = []
    radii: list[FloatArray] = []
    cuts = [0]
    for step in run:
        e = step if step >= 0 else ~step
        xy = shapely.get_coordinates(lines[e])
        xy = xy if step >= 0 else xy[::-1]
        if parts:
            # Where two edges meet the smaller radius counts.
            radii[-1][-1] = min(radii[-1][-1], radius[e])
        parts.append(xy[1:] if parts else xy)
        radii.append(np.full(len(parts[-1]), radius[e]))
        cuts.append(cuts[-1] + len(xy) - 1)
    before = np.vstack(parts)
    made, places = fillet(before, np.where(still(before), 0.0, np.concatenate(radii)), least)
    if made is before:
        return
    for step, a, b in zip(run, cuts[:-1], cuts[1:]):
        xy = made[places[a] : places[b] + 1]
        if np.array_equal(xy, before[a : b + 1]):
            continue
        if step >= 0:
            lines[step] = shapely.linestrings(xy)
        else:
            lines[~step] = shapely.linestrings(xy[::-1])
