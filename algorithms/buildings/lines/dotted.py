"""Dotted pattern: towers in a staggered grid."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import LineString

from ..types import Floats
from .draft import Draft, row
from .need import Need

#: A tower may stand so many steps beside its node.
FREEDOM = 1.0
#: Shifts of the grid that are compared, as shares of its meshes.
SHIFTS = np.arange(0.0, 1.0, 0.125)


def dotted_lines(need: Need) -> list[Draft]:
    """Draw a short line around each node of a staggered grid (RZ Table 3, dotted).

    Towers of a row stand in the gaps of the row in front, so that the sun reaches them past its
    sides and rows are only half as far apart as in the determinant pattern.

    Parameters
    ----------
    need
        The patch and what is asked of it.

    Returns
    -------
    list of Draft
        Row by row from the side of the balconies; every second row first.
    """
    across, deep = meshes(need)
    if need.room.empty:
        return []
    free = need.room.standing(need.sizes)
    shapely.prepare(free)
    nodes = _nodes(need, free, across, deep)
    spare = (across - need.longest - need.rules.gap_m) / 2
    reach = min(FREEDOM * need.rules.step_m, max(0.1, spare))
    found = []
    for level, u, v in nodes:
        ends = need.room.world(np.array([[u - reach, v], [u + reach, v]]))
        pieces = shapely.get_parts(LineString(ends).intersection(free))
        node = shapely.Point(need.room.world(np.array([[u, v]]))[0])
        piece = min(pieces, key=node.distance)
        uv = need.room.local(shapely.get_coordinates(piece))
        if uv[-1, 0] - uv[0, 0] > 0.1:
            found.append(row(need.room, v, (uv[0, 0], uv[-1, 0]), level % 2, across))
    return found


def meshes(need: Need) -> tuple[float, float]:
    """Give the distance of towers in a row, and of rows, metres.

    Those of the shortest type and of the mean of spacings: longer and higher ones find their
    places on the same nodes, and a grid for the longest would leave ragged patches half empty.
    """
    room = 2 * FREEDOM * need.rules.step_m
    across = need.shortest + max(need.shortest, need.rules.gap_m) + room
    return across, max(float(need.pitch.mean()) / 2, need.deepest + need.rules.gap_m)


def _nodes(
    need: Need, free: shapely.Geometry, across: float, deep: float
) -> list[tuple[int, float, float]]:
    """Choose the grid with the most nodes that have room: level, u and v of those nodes."""
    low_u, low_v, high_u, high_v = need.room.bounds
    first = need.room.outermost(need.shortest, float(need.sizes[:, 1].min()))
    starts = [low_v + shift * deep for shift in SHIFTS]
    best: Floats = np.zeros((0, 3))
    for v0 in starts if first is None else [first, *starts]:
        v = np.arange(v0, high_v, deep)
        for shift in SHIFTS:
            u = np.arange(low_u + shift * across - across, high_u + across, across)
            level = np.repeat(np.arange(len(v)), len(u))
            grid = np.column_stack(
                [level, np.tile(u, len(v)) + (level % 2) * across / 2, np.repeat(v, len(u))]
            )
            inside = shapely.intersects_xy(free, *need.room.world(grid[:, 1:]).T)
            if inside.sum() > len(best):
                best = grid[inside]
    return [(int(level), float(u), float(v)) for level, u, v in best]
