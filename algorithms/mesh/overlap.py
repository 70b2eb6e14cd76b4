"""Cuts against lattices that touch themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from .directions import Labels
from .lattice import STEP, Cut, LatticeRing
from .quadmesh import FloatArray
from .rings import Ring


def overlap_cuts(
    rings: Sequence[Ring], labels: Sequence[Labels], lattice: Sequence[LatticeRing]
) -> list[Cut]:
    """Find pieces that touch on the lattice although they are not neighbours.

    For each such pair a demand is made that parts them in the direction in which the real
    pieces lie apart.
    """
    lines, owner, spans = [], [], []
    for r, ring in enumerate(lattice):
        after = np.roll(ring.corners, -1, axis=0)
        lines += list(np.stack([ring.corners, after], axis=1).astype(float))
        owner += [(r, j, len(after)) for j in range(len(after))]
        spans += list(zip(labels[r].start.tolist(), labels[r].ends(rings[r]).tolist()))
    pieces = shapely.linestrings(np.array(lines))
    first, second = shapely.STRtree(pieces).query(pieces, predicate="intersects")
    direction = np.concatenate([label.direction for label in labels])
    cuts = []
    for a, b in sorted(zip(first.tolist(), second.tolist())):
        if a >= b:
            continue
        (r, i, count), (s, j, _) = owner[a], owner[b]
        neighbours = r == s and (i - j) % count in (1, count - 1)
        if neighbours and pieces[a].intersection(pieces[b]).length < 0.5:
            continue
        points_a, axis_a = _frame(rings[r], spans[a], int(direction[a]))
        points_b, axis_b = _frame(rings[s], spans[b], int(direction[b]))
        axis, sign = _parting(points_a, axis_a, points_b, axis_b)
        toward_a = STEP[direction[a], axis] * sign
        toward_b = STEP[direction[b], axis] * sign
        other_at = 0.0 if toward_b > 0 else (1.0 if toward_b < 0 else 0.0)
        cuts.append(Cut(a, 1.0 if toward_a > 0 else 0.0, b, other_at, axis, sign))
    return cuts


def _frame(ring: Ring, span: tuple[float, float], direction: int) -> tuple[FloatArray, FloatArray]:
    """Return points of a real piece and the real direction that its label calls east."""
    points = ring.at(np.linspace(*span, 9))
    chord = points[-1] - points[0]
    angle = np.arctan2(chord[1], chord[0]) - direction * np.pi / 2
    return points, np.array([np.cos(angle), np.sin(angle)])


def _parting(
    a: FloatArray, axis_a: FloatArray, b: FloatArray, axis_b: FloatArray
) -> tuple[int, int]:
    """Return the axis and sign in which piece b lies beyond piece a most clearly."""
    east = axis_a + axis_b
    if np.hypot(*east) < 0.3:
        east = axis_a
    east = east / np.hypot(*east)
    best: tuple[float, int, int] | None = None
    for axis, unit in ((0, east), (1, np.array([-east[1], east[0]]))):
        u, v = a @ unit, b @ unit
        for sign, gap, apart in (
            (1, v.min() - u.max(), v.mean() - u.mean()),
            (-1, u.min() - v.max(), u.mean() - v.mean()),
        ):
            clear = float(gap + 0.2 * apart)
            if best is None or clear > best[0]:
                best = (clear, axis, sign)
    return (0, 1) if best is None else best[1:]
