"""Ground that paths are searched on: nodes in rows and columns, free or not, roomy or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import Floats
from .frame import Mask

#: Closer than this to buildings or to the edge of the patch is near (RZ section 3.3), metres.
NEAR_M = 5.0
#: Two opposite sides whose distances differ by more than this are uneven, metres.
UNEVEN_M = 5.0


@dataclass(frozen=True)
class Prices:
    """What a way costs besides its length: RZ's G = L + N + E, all in metres.

    Attributes
    ----------
    turn
        One turn.
    room
        One metre of way per degree of missing room (E is 0 to 2).
    exit
        A new exit.
    """

    turn: float = 5.0
    room: float = 0.3
    exit: float = 10.0


@dataclass(frozen=True, eq=False)
class Ground:
    """Nodes of a grid whose rows and columns need not be evenly spaced.

    Attributes
    ----------
    xs, ys
        Coordinates of columns and rows, ascending, metres, shapes (c,) and (r,).
    free
        Where the middle of a path may be, shape (r, c).
    rough
        Roominess E of RZ section 3.3 (0 roomy to 2 narrow or uneven) of a path along the rows and
        of one along the columns, shape (2, r, c).
    """

    xs: Floats
    ys: Floats
    free: Mask
    rough: Floats
    cut: tuple[Mask, Mask] | None = None

    def steps(self, axis: int) -> Mask:
        """Tell which steps along the rows (axis 0) or the columns (1) are possible."""
        free = self.free
        both = free[:, :-1] & free[:, 1:] if axis == 0 else free[:-1] & free[1:]
        return both if self.cut is None else both & ~self.cut[axis]


def _clear(closed: Mask, street: Mask, at: Floats) -> tuple[Floats, Floats]:
    """Give the distance to the nearest closed node before and behind along the rows (r, c).

    Where that is street space, the distance is infinite: the way out narrows nothing.
    """
    position = np.arange(closed.shape[1])
    both = []
    for flip in (False, True):
        wall, road = (closed[:, ::-1], street[:, ::-1]) if flip else (closed, street)
        x = -at[::-1] if flip else at
        last = np.maximum.accumulate(np.where(wall, position, -1), axis=1)
        known = np.where(last >= 0, x[position][None, :] - x[np.maximum(last, 0)], np.inf)
        open_end = np.take_along_axis(road, np.maximum(last, 0), axis=1) & (last >= 0)
        gap = np.where(open_end, np.inf, known)
        both.append(gap[:, ::-1] if flip else gap)
    return both[0], both[1]


def roughness(xs: Floats, ys: Floats, closed: Mask, street: Mask) -> Floats:
    """Measure how little room a path has (RZ section 3.3, roomy degree E).

    The first part looks along the path, both ways since paths are walked both ways: 0 where
    buildings and the edge of the patch are far, else 1. The second looks up, down, left and
    right: 1 where one of the four is near and up and down, or left and right, differ much.

    Parameters
    ----------
    xs, ys
        Coordinates of columns and rows, metres.
    closed
        Nodes outside the patch or in a building, shape (r, c).
    street
        Nodes of street space; there the ground counts as open.

    Returns
    -------
    numpy.ndarray
        For paths along the rows and along the columns, shape (2, r, c), values 0, 1, 2.
    """
    left, right = _clear(closed, street, xs)
    down, up = (side.T for side in _clear(closed.T, street.T, ys))
    across, along = np.minimum(left, right), np.minimum(down, up)
    with np.errstate(invalid="ignore"):
        uneven = (np.abs(left - right) > UNEVEN_M) | (np.abs(up - down) > UNEVEN_M)
    second = (np.minimum(across, along) < NEAR_M) & uneven
    return np.stack([(across < NEAR_M) * 1.0 + second, (along < NEAR_M) * 1.0 + second])
