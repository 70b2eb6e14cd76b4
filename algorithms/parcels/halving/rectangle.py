"""The smallest rectangle around a ring, as axes to cut along."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

Floats = npt.NDArray[np.float64]
#: Sides of the outline shorter than this have no direction worth a rectangle (metres).
SHORT = 0.1


class Rectangle(NamedTuple):
    """A rectangle around a place.

    Attributes
    ----------
    centre
        Its middle, metres.
    way
        Direction of its longer side, of length 1.
    long, short
        Its sides, metres.
    """

    centre: tuple[float, float]
    way: tuple[float, float]
    long: float
    short: float


def smallest_rectangle(xy: Floats) -> Rectangle:
    """Return the rectangle of least area around a ring.

    Parameters
    ----------
    xy
        Vertices, shape (n, 2), metres.

    Examples
    --------
    >>> around = smallest_rectangle(np.array([(0.0, 0.0), (30.0, 0.0), (30.0, 18.0), (0.0, 18.0)]))
    >>> around.long, around.short, around.centre
    (30.0, 18.0, (15.0, 9.0))
    """
    origin = xy[0]
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(xy - origin)))
    edges = np.diff(hull, axis=0)
    sizes = np.hypot(edges[:, 0], edges[:, 1])
    good = sizes > min(SHORT, float(sizes.max(initial=0.0)) / 2)
    ways = edges[good] / sizes[good, None] if good.any() else np.array([[1.0, 0.0]])
    sides = np.stack([-ways[:, 1], ways[:, 0]], axis=1)
    along, across = hull @ ways.T, hull @ sides.T
    lengths, widths = np.ptp(along, axis=0), np.ptp(across, axis=0)
    best = int(np.argmin(lengths * widths))
    middle = (
        ways[best] * (along[:, best].min() + along[:, best].max()) / 2
        + sides[best] * (across[:, best].min() + across[:, best].max()) / 2
        + origin
    )
    length, width = float(lengths[best]), float(widths[best])
    way = ways[best] if length >= width else sides[best]
    x, y = middle.tolist()
    wx, wy = way.tolist()
    return Rectangle((x, y), (wx, wy), max(length, width), min(length, width))
