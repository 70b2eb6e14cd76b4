"""Parcels that no house suits become greens, however they came about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from ...measure.parcel_shape import rectangles
from ..rules import ParcelRules
from ..types import Plot
from .guard import BEHIND

#: Parcels larger than so many of the largest that are asked for ...
LARGE = 2.0
#: ... or nowhere wider than this part of the width asked for are none.
NARROW = 0.35


def without_oddities(rows: Sequence[list[Plot]], rules: ParcelRules) -> list[list[Plot]]:
    """Make greens of parcels that are far too large or too narrow to be built on.

    Parameters
    ----------
    rows
        Plots, block by block.
    rules
        What was asked; without greens everything stays as it is.

    Returns
    -------
    list of list of Plot
        The same plots in the same order, some of another use, with a note that says why.
    """
    every = [plot for row in rows for plot in row]
    if not rules.greens or not every:
        return [list(row) for row in rows]
    shapes = np.array([plot.polygon for plot in every], dtype=object)
    large = shapely.area(shapes) > LARGE * rules.largest_area
    narrow = rectangles(shapes)[1].min(axis=1) < NARROW * rules.width
    found = []
    for plot, big, slim in zip(every, large.tolist(), narrow.tolist()):
        if plot.use != "parcel" or plot.note == BEHIND or not (big or slim):
            found.append(plot)
            continue
        why = "too large for a parcel" if big else "too narrow for a house"
        found.append(replace(plot, use="green", note=why))
    ends = np.cumsum([len(row) for row in rows])
    return [found[end - len(row) : end] for row, end in zip(rows, ends.tolist())]
