"""How well a distance suits rows of parcels: `opt` of UP section 5."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from .outline import Floats, Ints
from .region import CLOSED, FRONTAGE, STREET

#: Sums of widths that differ by less are one (metres).
SAME = 0.1
#: The largest distances are looked at in so many sums (with one width there are few).
MOST = 400


@dataclass(frozen=True)
class Spacing:
    """Widths that streets should leave between them.

    Attributes
    ----------
    depth
        Of a parcel, metres.
    street
        Width of a street, metres.
    widths
        Of the blocks that fit between streets, metres. Empty: two rows of parcels.
    """

    depth: float = 30.0
    street: float = 15.0
    widths: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        values = (self.depth, *self.widths)
        if not all(math.isfinite(value) and value > 0 for value in values) or not (
            math.isfinite(self.street) and self.street >= 0
        ):
            raise InputError(
                f"Parcels {self.depth:g} m deep, streets {self.street:g} m and blocks "
                f"{self.widths} m wide make no pattern.",
                "Give numbers greater than 0.",
            )

    @property
    def pitch(self) -> float:
        """From one street to the next: the least width of a block and a street, metres."""
        return min(self.widths or (2 * self.depth,)) + self.street

    def sums(self, kind: int, limit: float) -> tuple[Floats, Ints]:
        """Good distances from a boundary to the centre line of a new street.

        Parameters
        ----------
        kind
            Of the boundary: from the centre line of a street blocks follow each other; from a
            property line half a street is missing; along an edge without street there is first
            one row of parcels that backs on to it.
        limit
            Up to which distance, metres; at least one is given.

        Returns
        -------
        distance
            Ascending, shape (k,), metres.
        rows
            How many blocks that is, 1 at least, shape (k,).
        """
        pitches = np.array(sorted(self.widths or (2 * self.depth,))) + self.street
        start = {STREET: 0.0, FRONTAGE: -0.5 * self.street, CLOSED: self.depth + 0.5 * self.street}
        level = np.array([start[kind]])
        found, rows = [], []
        if kind == CLOSED:
            found, rows = [level], [np.ones(1, np.int64)]
        number = 0
        while number == 0 or (level.min() < limit and sum(map(len, found)) < MOST):
            number += 1
            level = (level[:, None] + pitches).ravel()
            level = level[np.unique(np.round(level / SAME), return_index=True)[1]]
            found.append(level)
            rows.append(np.full(len(level), number))
        distance, row = np.concatenate(found), np.concatenate(rows)
        order = np.argsort(distance, kind="stable")
        return distance[order], row[order]

    def opt(self, y: Floats, kind: Ints) -> Floats:
        """How badly distances are explained by rows of blocks (UP: opt(y)).

        The least over all sums S of k widths of |y - S| / (pitch sqrt k): what is amiss is shared
        by the blocks between.

        Parameters
        ----------
        y
            Distances of the centre line of a street to a boundary, shape (n,), metres.
        kind
            What the boundary is, shape (n,).

        Returns
        -------
        cost
            0 for a perfect fit to 1, shape (n,).

        Examples
        --------
        >>> Spacing(30, 15).opt(np.array([75.0, 67.5, 37.5, 90.0]), np.array([0, 1, 2, 0])).tolist()
        [0.0, 0.0, 0.0, 0.2]
        """
        cost = np.ones(len(y))
        for value in (STREET, FRONTAGE, CLOSED):
            here = np.flatnonzero(kind == value)
            if len(here):
                distance, rows = self.sums(value, float(y[here].max()) + self.pitch)
                off = np.abs(y[here, None] - distance) / (self.pitch * np.sqrt(rows))
                cost[here] = np.minimum(off.min(axis=1), 1.0)
        return cost

    def least(self, kind: Ints) -> Floats:
        """Nearest good distance to boundaries of some kinds, shape (n,), metres."""
        table = np.array([self.sums(value, 0.0)[0][0] for value in (STREET, FRONTAGE, CLOSED)])
        return np.asarray(table[kind])
