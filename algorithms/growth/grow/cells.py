"""Hashed grids: which nodes and segments lie near a place, kept up to date as streets grow.

A grid is a dictionary from one integer per cell to a list of numbers. It has no bounds and is
never rebuilt. Segments are registered in the cells that they pass, not in all of their bounding
box. Cells whose integers fall together only cost time, since callers compare coordinates.
"""

from __future__ import annotations

from math import floor

#: Integer of a cell: column x `COLUMN` + row.
COLUMN = 1 << 32

Segment = tuple[float, float, float, float]


def box(x: float, y: float, reach: float, per: float) -> list[int]:
    """Return the cells that a square around a point touches.

    Parameters
    ----------
    x, y
        Centre, metres.
    reach
        Half of its side, metres.
    per
        Cells per metre.
    """
    low, high = floor((y - reach) * per), floor((y + reach) * per) + 1
    first, last = floor((x - reach) * per), floor((x + reach) * per)
    if first == last:
        return list(range(first * COLUMN + low, first * COLUMN + high))
    return [
        key
        for column in range(first * COLUMN, last * COLUMN + 1, COLUMN)
        for key in range(column + low, column + high)
    ]


def corridor(segment: Segment, reach: float, per: float) -> list[int]:
    """Return the cells that a segment passes, or comes as near as `reach` to.

    Parameters
    ----------
    segment
        Coordinates of its ends, metres.
    reach
        Margin on all sides, metres.
    per
        Cells per metre.
    """
    x0, y0, x1, y1 = segment
    if x0 > x1:
        x0, y0, x1, y1 = x1, y1, x0, y0
    low, high = (y0, y1) if y0 < y1 else (y1, y0)
    first, last = floor((x0 - reach) * per), floor((x1 + reach) * per)
    bottom, top = floor((low - reach) * per), floor((high + reach) * per)
    if last - first < 2 or top - bottom < 2 or x1 - x0 < reach:
        return [
            key
            for column in range(first * COLUMN, last * COLUMN + 1, COLUMN)
            for key in range(column + bottom, column + top + 1)
        ]
    keys: list[int] = []
    slope, side = (y1 - y0) / (x1 - x0), 1.0 / per
    for i in range(first, last + 1):
        # the piece of the segment whose margin reaches into this column
        begin, end = max(x0, i * side - reach), min(x1, (i + 1) * side + reach)
        ya, yb = y0 + slope * (begin - x0), y0 + slope * (end - x0)
        if ya > yb:
            ya, yb = yb, ya
        column = i * COLUMN
        keys.extend(
            range(column + floor((ya - reach) * per), column + floor((yb + reach) * per) + 1)
        )
    return keys


class PointCells:
    """A grid of points.

    Parameters
    ----------
    size
        Side of a cell, metres.

    Attributes
    ----------
    per
        Cells per metre.
    cells
        The numbers of the points in each cell that has any.
    """

    def __init__(self, size: float) -> None:
        self.per = 1.0 / size
        self.cells: dict[int, list[int]] = {}

    def add(self, number: int, x: float, y: float) -> None:
        """Register a point."""
        key = floor(x * self.per) * COLUMN + floor(y * self.per)
        cell = self.cells.get(key)
        if cell is None:
            self.cells[key] = [number]
        else:
            cell.append(number)

    def remove(self, number: int, x: float, y: float) -> None:
        """Forget a point that is registered here."""
        self.cells[floor(x * self.per) * COLUMN + floor(y * self.per)].remove(number)


class SegmentCells:
    """A grid of segments.

    Parameters
    ----------
    size
        Side of a cell, metres.
    reach
        How far beside a segment it is registered too, metres.

    Attributes
    ----------
    per
        Cells per metre.
    cells
        The numbers of the segments in each cell that has any.
    """

    def __init__(self, size: float, reach: float) -> None:
        self.per = 1.0 / size
        self.reach = reach
        self.cells: dict[int, list[int]] = {}

    def add(self, number: int, segment: Segment) -> None:
        """Register a segment."""
        cells = self.cells
        for key in corridor(segment, self.reach, self.per):
            cell = cells.get(key)
            if cell is None:
                cells[key] = [number]
            else:
                cell.append(number)

    def shorten(self, number: int, before: Segment, after: Segment) -> None:
        """Forget a segment where it has been and is no more."""
        left, kept = corridor(before, self.reach, self.per), corridor(after, self.reach, self.per)
        for key in set(left).difference(kept):
            self.cells[key].remove(number)
        # rounding may put the shorter one into a cell that the longer one just missed
        for key in set(kept).difference(left):
            self.cells.setdefault(key, []).append(number)
