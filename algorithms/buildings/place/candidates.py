"""Places for groups on control lines, in steps: the columns that a program chooses from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..types import FACILITY, BuildingType, Floats, Ints
from ..zone import ControlLine
from .columns import Columns
from .stretches import Stretches
from .worth import Worth

#: Places closer together than this are one, metres.
SAME = 0.01


@dataclass(frozen=True)
class Raster:
    """Where groups may begin along a line.

    Attributes
    ----------
    step
        Distance of beginnings, metres.
    phase
        Shift of all of them, metres.
    edges
        By line: more places for beginnings and ends, metres from the start of the line.
    """

    step: float
    phase: float = 0.0
    edges: Mapping[int, Floats] | None = None


class Maker:
    """Makes columns of a zone.

    Parameters
    ----------
    types, lines, worth
        Kinds of buildings, control lines, prices.
    stretches
        Where single buildings have room.
    """

    def __init__(
        self,
        types: Sequence[BuildingType],
        lines: Sequence[ControlLine],
        worth: Worth,
        stretches: Stretches,
    ) -> None:
        self.types, self.lines, self.worth, self.stretches = types, lines, worth, stretches
        #: Ways are this much longer than when they were reckoned first, and so much by line.
        self.factor, self.further = 1.0, np.zeros(len(lines))
        self._of_line: dict[int, list[int]] = {}
        for s, line in enumerate(stretches.line):
            self._of_line.setdefault(int(line), []).append(s)
        # the same raster for all lines of a direction, so that rows stand in line
        self._zero = np.zeros(len(lines))
        for i, line in enumerate(lines):
            if line.length > 0:
                way = (np.array(line.end) - np.array(line.start)) / line.length
                self._zero[i] = float(np.array(line.start) @ way)

    def columns(self, lines: Sequence[int], raster: Raster) -> Columns:
        """Make the columns of some lines.

        In a symmetrical pattern a place and its mirror are one column wherever both have room.
        """
        parts = [self._of_stretch(s, raster) for n in lines for s in self._of_line.get(n, ())]
        made = [part for part in parts if part is not None]
        if not made:
            return Columns.empty()
        all_of = made[0]
        if len(made) > 1:
            owner = np.cumsum([0, *[len(part) for part in made]])
            all_of = Columns(
                np.concatenate([part.owner + at for part, at in zip(made, owner)]),
                *[
                    np.concatenate([getattr(part, name) for part in made])
                    for name in (
                        "type", "count", "xy", "facing", "patch", "line", "built", "way"
                    )
                ],
            )  # fmt: skip
        return all_of

    def weights(self) -> Floats:
        """Return the metres of places for groups on each line, shape (lines,).

        Divided by the step they are about the number of columns.
        """
        metres = np.zeros(len(self.lines))
        for s, (number, kind) in enumerate(zip(self.stretches.line, self.stretches.type)):
            length = self.types[kind].length_m
            free = self.stretches.high[s] - self.stretches.low[s]
            k = np.arange(self.longest(kind, number))
            metres[number] += float(np.maximum(0.0, free - k * length).sum()) + 1e-3
        return metres

    def longest(self, kind: int, line: int) -> int:
        """Return how many buildings of a type may border upon each other on a line."""
        if not self.lines[line].along:
            return 1
        own = self.types[kind]
        most = max(1, int((self.worth.group_m + 1e-6) / own.length_m))
        if own.count is not None:
            return max(1, min(most, own.count))
        # facilities without a wish stand alone, one in a patch
        return 1 if own.use == FACILITY and own.share is None else most

    def _of_stretch(self, s: int, raster: Raster) -> Columns | None:
        """Make the columns on one stretch."""
        number, kind = int(self.stretches.line[s]), int(self.stretches.type[s])
        low, high = self.stretches.low[s], self.stretches.high[s]
        length = self.types[kind].length_m
        most = min(self.longest(kind, number), int((high - low) / length + 1 + 1e-9))
        firsts = [self._firsts(number, low, high, length, k, raster) for k in range(1, most + 1)]
        count = np.repeat(np.arange(1, most + 1), [len(first) for first in firsts])
        first = np.concatenate(firsts)
        mirror = self.lines[number].mirror
        if mirror < 0:
            return self._rows(number, kind, s, first, count)
        other = self._mirrored(mirror, kind, first, first + (count - 1) * length)
        alone = self._rows(number, kind, s, first[other < 0], count[other < 0])
        if mirror < number:
            return alone
        pairs = [alone]
        for t in np.unique(other[other >= 0]):
            here = other == t
            one = self._rows(number, kind, s, first[here], count[here])
            two = self._rows(mirror, kind, int(t), first[here], count[here])
            pairs.append(_paired(one, two))
        made = pairs[0]
        for pair in pairs[1:]:
            made = made.join(pair)
        return made

    def _firsts(
        self, number: int, low: float, high: float, length: float, k: int, raster: Raster
    ) -> Floats:
        """Return the centres of the first buildings of groups of k."""
        last = high - (k - 1) * length
        shift = (self._zero[number] - length / 2 - raster.phase) % raster.step
        start = low + (-(low + shift)) % raster.step
        places = [np.arange(start, last, raster.step), np.array([low, last])]
        if raster.edges is not None and number in raster.edges:
            edges = raster.edges[number]
            places += [edges + length / 2, edges - (k - 0.5) * length]
        every: Floats = np.unique(np.concatenate(places))
        every = every[(every >= low - 1e-9) & (every <= last + 1e-9)]
        if not len(every):
            return every
        kept: Floats = every[np.concatenate([[True], np.diff(every) > SAME])]
        return kept

    def _mirrored(self, line: int, kind: int, first: Floats, last: Floats) -> Ints:
        """Return the stretch of the mirroring line that holds each group, -1 for none."""
        found = np.full(len(first), -1, dtype=np.int64)
        for s in self._of_line.get(line, ()):
            if self.stretches.type[s] == kind:
                fits = (first >= self.stretches.low[s] - SAME) & (
                    last <= self.stretches.high[s] + SAME
                )
                found[fits] = s
        return found

    def _rows(self, number: int, kind: int, s: int, first: Floats, count: Ints) -> Columns:
        """Make one column of each group."""
        line, length, n = self.lines[number], self.types[kind].length_m, len(first)
        start = np.array(line.start)
        unit = (np.array(line.end) - start) / max(line.length, 1e-9)
        middle = first + (count - 1) * length / 2
        turned = self.worth.turned(np.array([kind]), np.array([line.facing_deg]))[0]
        built = self.worth.groups(count) + self.worth.turn * turned * count
        way, at = np.zeros(n), self.stretches.at[s]
        ways = self.factor * self.stretches.way[s] + self.further[number]
        for i in range(int(count.max(initial=0))):
            has = count > i
            way[has] += np.interp(first[has] + i * length, at, ways)
        return Columns(
            np.arange(n), np.full(n, kind, dtype=np.int64), count.astype(np.int64),
            start + middle[:, None] * unit, np.full(n, line.facing_deg),
            np.full(n, line.patch, dtype=np.int64), np.full(n, number, dtype=np.int64), built,
            way,
        )  # fmt: skip


def _paired(one: Columns, two: Columns) -> Columns:
    """Join columns one by one with their mirrors."""
    rows = one.join(two)
    owner = np.concatenate([one.owner, two.owner])
    order = np.argsort(owner, kind="stable")
    return Columns(
        owner[order], rows.type[order], rows.count[order], rows.xy[order], rows.facing[order],
        rows.patch[order], rows.line[order], one.built + two.built,
        one.way + two.way,
    )  # fmt: skip
