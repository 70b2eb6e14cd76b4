"""Shapes of rows of buildings, and which rows are in each other's way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from ..shape import Shapes, facing_vectors
from ..types import RESIDENCE, BuildingType, Floats, Ints
from .columns import Bools, Columns
from .sunshine import Sunshine

#: Buildings may be this much closer than the gap, metres: places are sums of rounded numbers.
TOLERANCE = 1e-3
#: A centre line that reaches less than this into a shadow is not shaded, metres.
INWARDS = 0.01


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of columns as rectangles.

    Attributes
    ----------
    owner, line
        Column and control line, shape (rows,).
    frame
        Number of the direction that they face, shape (rows,).
    u, v
        Centre in that frame: metres along the façade, metres towards the back, shape (rows,).
    half, deep
        Half the façade and half the depth, metres, shape (rows,).
    reach
        How far behind the centre no centre line of a residence may lie, metres, shape (rows,).
    home
        Whether it is of residences, shape (rows,).
    body, shadow, middle
        Outline, shadow up to that reach, and centre line, shape (rows,).
    """

    owner: Ints
    line: Ints
    frame: Ints
    u: Floats
    v: Floats
    half: Floats
    deep: Floats
    reach: Floats
    home: Bools
    body: Shapes
    shadow: Shapes
    middle: Shapes

    def take(self, which: npt.NDArray[np.bool_] | Ints) -> Rows:
        """Return some of the rows."""
        return Rows(
            self.owner[which], self.line[which], self.frame[which], self.u[which], self.v[which],
            self.half[which], self.deep[which], self.reach[which], self.home[which],
            self.body[which], self.shadow[which], self.middle[which],
        )  # fmt: skip


def rows_of(columns: Columns, types: Sequence[BuildingType], sun: Sunshine) -> Rows:
    """Draw the rows of columns."""
    out = facing_vectors(columns.facing)
    along = np.column_stack([out[:, 1], -out[:, 0]])
    half = columns.half_lengths(types)
    deep = np.array([t.width_m for t in types])[columns.type] / 2
    _, frame = np.unique(np.round(columns.facing % 360.0, 3) % 360.0, return_inverse=True)
    reach = sun.reach(columns.type, columns.facing)
    shadow = _boxes(
        columns.xy - out * ((reach + deep) / 2)[:, None], along, out, half - INWARDS,
        np.maximum(0.0, (reach - deep) / 2 - INWARDS),
    )  # fmt: skip
    side = along * half[:, None]
    return Rows(
        owner=columns.owner,
        line=columns.line,
        frame=frame.astype(np.int64),
        u=np.einsum("ij,ij->i", columns.xy, along),
        v=-np.einsum("ij,ij->i", columns.xy, out),
        half=half,
        deep=deep,
        reach=reach,
        home=np.array([t.use == RESIDENCE for t in types], dtype=bool)[columns.type],
        body=_boxes(columns.xy, along, out, half, deep),
        shadow=shadow,
        middle=shapely.linestrings(np.stack([columns.xy - side, columns.xy + side], axis=1)),
    )


def _boxes(centre: Floats, along: Floats, out: Floats, half: Floats, deep: Floats) -> Shapes:
    """Draw rectangles, shape (n,)."""
    a, b = along * half[:, None], out * deep[:, None]
    ring = np.stack([centre + b + a, centre + b - a, centre - b - a, centre - b + a], axis=1)
    made: Shapes = shapely.polygons(np.concatenate([ring, ring[:, :1]], axis=1))
    return made


def pairs_between(
    one: Rows, two: Rows, gap_m: float, *, shade: bool = True
) -> npt.NDArray[np.int64]:
    """Find which rows of one set are in the way of which of another, whatever their owners.

    They are if they are closer than the gap or if one is a residence whose centre line the shadow
    of the other touches (`shade`).

    Returns
    -------
    numpy.ndarray
        Row of `one` and row of `two`, without doubles, shape (m, 2).
    """
    if not len(one.u) or not len(two.u):
        return np.zeros((0, 2), dtype=np.int64)
    near = shapely.STRtree(two.body).query(
        one.body, predicate="dwithin", distance=max(0.0, gap_m - TOLERANCE)
    ).T  # fmt: skip
    found = [near[_too_close(one.body[near[:, 0]], two.body[near[:, 1]], gap_m)]]
    if shade:
        cast = shapely.STRtree(two.middle).query(one.shadow, predicate="intersects").T
        found.append(cast[two.home[cast[:, 1]]])
        suffered = shapely.STRtree(two.shadow).query(one.middle, predicate="intersects").T
        found.append(suffered[one.home[suffered[:, 0]]])
    every: Ints = np.unique(np.concatenate(found), axis=0)
    return every


def at_odds(rows: Rows, gap_m: float) -> Ints:
    """Find columns of two rows, such as mirrored ones, whose rows are in each other's way."""
    pair = np.flatnonzero(rows.owner[1:] == rows.owner[:-1])
    one, two = rows.take(pair), rows.take(pair + 1)
    bad = _too_close(one.body, two.body, gap_m)
    bad |= two.home & shapely.intersects(one.shadow, two.middle)
    bad |= one.home & shapely.intersects(two.shadow, one.middle)
    return one.owner[bad]


def _too_close(one: Shapes, two: Shapes, gap_m: float) -> Bools:
    """Tell which outlines are closer than the gap, or overlap where there is none, (n,)."""
    if gap_m > TOLERANCE:
        close: Bools = shapely.distance(one, two) < gap_m - TOLERANCE
        return close
    overlap: Bools = shapely.area(shapely.intersection(one, two)) > TOLERANCE
    return overlap
