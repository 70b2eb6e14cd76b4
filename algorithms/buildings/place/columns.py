"""Columns of the program: places for groups of buildings on control lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..shape import facing_vectors
from ..types import BuildingType, Floats, Ints, Placements

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Columns:
    """Things that are built wholly or not at all, each made of one row of buildings or more.

    A row is a number of buildings of one type that border upon each other. Most columns have one;
    a group of several types has one for each, a column of a symmetrical pattern has two.

    Attributes
    ----------
    owner
        Column that a row belongs to, ascending, shape (rows,).
    type, count
        Type of the buildings of a row, and how many they are, shape (rows,).
    xy
        Centre of the row, metres, shape (rows, 2).
    facing
        Azimuth of the balconies, degrees from grid north, shape (rows,).
    patch, line
        Patch and control line, shape (rows,).
    built
        What a column adds to the objective as a group and by its orientation, shape (n,).
    way
        What its ways cost, in the unit of W, shape (n,).
    """

    owner: Ints
    type: Ints
    count: Ints
    xy: Floats
    facing: Floats
    patch: Ints
    line: Ints
    built: Floats
    way: Floats

    def __len__(self) -> int:
        return len(self.built)

    @classmethod
    def empty(cls) -> Columns:
        """Return no columns."""
        none = np.zeros(0, dtype=np.int64)
        zero = np.zeros(0)
        return cls(none, none, none, np.zeros((0, 2)), zero, none, none, zero, zero)

    def take(self, which: Bools | Ints) -> Columns:
        """Return some of the columns, in their order."""
        mask = np.zeros(len(self), dtype=bool)
        mask[which] = True
        rows = mask[self.owner]
        number = np.cumsum(mask) - 1
        return Columns(
            number[self.owner[rows]], self.type[rows], self.count[rows], self.xy[rows],
            self.facing[rows], self.patch[rows], self.line[rows], self.built[mask],
            self.way[mask],
        )  # fmt: skip

    def join(self, other: Columns) -> Columns:
        """Return these columns and then the others."""
        return Columns(
            np.concatenate([self.owner, other.owner + len(self)]),
            np.concatenate([self.type, other.type]),
            np.concatenate([self.count, other.count]),
            np.concatenate([self.xy, other.xy]),
            np.concatenate([self.facing, other.facing]),
            np.concatenate([self.patch, other.patch]),
            np.concatenate([self.line, other.line]),
            np.concatenate([self.built, other.built]),
            np.concatenate([self.way, other.way]),
        )

    def patches(self) -> Ints:
        """Return the patch of each column, shape (n,)."""
        patch = np.zeros(len(self), dtype=np.int64)
        patch[self.owner] = self.patch
        return patch

    def numbers(self, patches: int, types: int) -> Ints:
        """Count the buildings of each column by patch and type, shape (n, patches, types)."""
        table = np.zeros((len(self), patches, types), dtype=np.int64)
        np.add.at(table, (self.owner, self.patch, self.type), self.count)
        return table

    def half_lengths(self, types: Sequence[BuildingType]) -> Floats:
        """Give half the façade of each row, metres, shape (rows,)."""
        half: Floats = self.count * np.array([t.length_m for t in types])[self.type] / 2
        return half

    def buildings(self, types: Sequence[BuildingType]) -> tuple[Placements, Ints]:
        """Give the buildings of all columns, and the column of each.

        Returns
        -------
        placed : Placements
            By column and from the west of a façade that faces south, b buildings.
        owner : numpy.ndarray
            Shape (b,).
        """
        row = np.repeat(np.arange(len(self.type)), self.count)
        first = np.repeat(np.cumsum(self.count) - self.count, self.count)
        place = np.arange(len(row)) - first - (self.count[row] - 1) / 2
        length = np.array([t.length_m for t in types])[self.type[row]]
        out = facing_vectors(self.facing[row])
        along = np.column_stack([out[:, 1], -out[:, 0]])
        placed = Placements(
            self.type[row], self.xy[row] + along * (place * length)[:, None], self.facing[row],
            self.patch[row], self.line[row],
        )  # fmt: skip
        return placed, self.owner[row]


def columns_of(placed: Placements, group: Ints, built: Floats, way: Floats) -> Columns:
    """Make each group of buildings that stand already a column.

    Parameters
    ----------
    placed
        The buildings.
    group
        Group of each building, shape (b,).
    built
        What each group adds to the objective as such, shape (number of groups,).
    way
        What the way of each building costs, shape (b,).

    Returns
    -------
    Columns
        Each building is a row of its own, so that groups of several types keep their places;
        column i is group i.
    """
    order = np.argsort(group, kind="stable")
    here = placed.take(order)
    return Columns(
        group[order], here.type, np.ones(len(here), dtype=np.int64), here.xy, here.facing,
        here.patch, here.line, built,
        np.bincount(group, way, len(built)).astype(np.float64),
    )  # fmt: skip
