"""Pieces of corridor are joined to streets with round bends."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from ...levels import COLLECTOR, CUL_DE_SAC, LOCAL
from ..types import Floats
from .adapt import Adapted, Edge

#: Radius of bends of the centre line by level (metres).
RADIUS = {COLLECTOR: 30.0, LOCAL: 20.0, CUL_DE_SAC: 12.0}
#: A bend takes at most this share of the straight parts beside it.
SHARE = 0.45
#: Angle between two vertices of an arc (radians).
ARC_STEP = math.radians(7.5)
#: Bends of less than this stay as they are (radians).
SLIGHT = math.radians(3.0)


def runs(adapted: Adapted, ground: BaseGeometry) -> list[tuple[LineString, int]]:
    """Join the pieces of each street; round its bends, except at junctions.

    Parameters
    ----------
    adapted
        Corridors in a zone.
    ground
        Where centre lines may run; bends whose arc leaves it stay sharp.

    Returns
    -------
    list of (LineString, int)
        Lines from junction to junction or further, with their level.
    """
    count: dict[int, int] = {}
    for own in adapted.edges:
        count[own.start] = count.get(own.start, 0) + 1
        count[own.end] = count.get(own.end, 0) + 1
    made: list[tuple[LineString, int]] = []
    for number, street in enumerate(adapted.sample.streets):
        run: list[Edge] = []
        for own in [edge for edge in adapted.edges if edge.street == number]:
            if run and run[-1].end != own.start:
                made += _line(run, count, street.level, ground)
                run = []
            run.append(own)
        made += _line(run, count, street.level, ground)
    return made


def _line(
    run: list[Edge], count: dict[int, int], level: int, ground: BaseGeometry
) -> list[tuple[LineString, int]]:
    """Return a run of edges as a line."""
    if not run:
        return []
    xy = [run[0].xy]
    fixed = [np.zeros(len(run[0].xy), dtype=bool)]
    for before, own in zip(run[:-1], run[1:]):
        fixed[-1][-1] = count[before.end] > 2
        xy.append(own.xy[1:])
        fixed.append(np.zeros(len(own.xy) - 1, dtype=bool))
    points, held = np.vstack(xy), np.concatenate(fixed)
    if run[-1].end == run[0].start:
        points, held = _turned(points, held, count[run[0].start] > 2)
    return [(LineString(rounded_bends(points, held, RADIUS.get(level, 30.0), ground)), level)]


def _turned(points: Floats, held: Floats, junction: bool) -> tuple[Floats, Floats]:
    """Let a ring begin at a junction, or else in the middle of a side, so that all bends round."""
    held = held.copy()
    held[0] = junction
    start = np.flatnonzero(held[:-1])
    if len(start):
        turn = int(start[0])
        body, marks = np.roll(points[:-1], -turn, axis=0), np.roll(held[:-1], -turn)
        return np.vstack([body, body[:1]]), np.append(marks, True)
    middle = (points[0] + points[1]) / 2
    body = np.vstack([middle, points[1:], middle])
    return body, np.concatenate([[True], held[1:], [True]])


def rounded_bends(points: Floats, held: Floats, radius: float, ground: BaseGeometry) -> Floats:
    """Replace bends by arcs.

    Parameters
    ----------
    points
        Vertices of a line, shape (n, 2), metres.
    held
        Whether a vertex stays as it is, shape (n,).
    radius
        Wished radius, metres; less where the straight parts are short.
    ground
        Arcs that leave it are not drawn.

    Returns
    -------
    numpy.ndarray
        Shape (m, 2).
    """
    made = [points[:1]]
    for at in range(1, len(points) - 1):
        here = points[at]
        back, ahead = points[at - 1] - here, points[at + 1] - here
        sizes = math.hypot(*back), math.hypot(*ahead)
        if held[at] or min(sizes) < 1e-6:
            made.append(here[None])
            continue
        back, ahead = back / sizes[0], ahead / sizes[1]
        turn = math.pi - math.acos(float(np.clip(back @ ahead, -1.0, 1.0)))
        if turn < SLIGHT or turn > math.pi - SLIGHT:
            made.append(here[None])
            continue
        tangent = min(radius * math.tan(turn / 2), SHARE * min(sizes))
        steps = max(2, math.ceil(turn / ARC_STEP))
        arc = _arc(here, back, ahead, tangent, turn, steps)
        whole = shapely.covers(ground, LineString(arc))
        made.append(arc if whole else here[None])
    made.append(points[-1:])
    return np.vstack(made)


def _arc(
    here: Floats, back: Floats, ahead: Floats, tangent: float, turn: float, steps: int
) -> Floats:
    """Return the vertices of the arc that touches both sides of a bend, shape (steps + 1, 2)."""
    radius = tangent / math.tan(turn / 2)
    inward = back + ahead
    inward = inward / math.hypot(*inward)
    centre = here + inward * math.hypot(radius, tangent)
    first = here + back * tangent - centre
    side = 1.0 if back[0] * ahead[1] - back[1] * ahead[0] < 0 else -1.0
    angle = side * np.linspace(0.0, turn, steps + 1)
    cos, sin = np.cos(angle), np.sin(angle)
    turned = [first[0] * cos - first[1] * sin, first[0] * sin + first[1] * cos]
    return np.asarray(centre + np.column_stack(turned))
