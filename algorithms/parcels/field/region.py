"""What the scores know of a region: its boundary, and what is along it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import Polygon

from ...errors import InputError
from .outline import Floats, Ints

#: What an edge of a region is: the centre line of a street; the property line along a street
#: that is there already; an edge without any street.
STREET, FRONTAGE, CLOSED = 0, 1, 2


def _no_points() -> Floats:
    return np.zeros((0, 2))


@dataclass(frozen=True)
class Region:
    """Land to be split by a street.

    Attributes
    ----------
    polygon
        Its outline, metres.
    kinds
        `STREET`, `FRONTAGE` or `CLOSED` for each edge of its rings, the exterior first, in their
        order (as many as vertices, without the closing ones), shape (e,).
    junctions
        Where streets already end on the boundary, from either side, shape (j, 2), metres.
    directions
        Directions of those streets there, of any sense and length, shape (j, 2).

    Raises
    ------
    InputError
        If the numbers of edges and kinds, or of junctions and directions, differ.
    """

    polygon: Polygon
    kinds: Ints
    junctions: Floats = field(default_factory=_no_points)
    directions: Floats = field(default_factory=_no_points)

    def __post_init__(self) -> None:
        rings = (self.polygon.exterior, *self.polygon.interiors)
        count = sum(max(len(ring.coords) - 1, 0) for ring in rings)
        if len(self.kinds) != count:
            raise InputError(
                f"A region has {count} edges, and kinds are given for {len(self.kinds)}.",
                "Give one kind for each edge of its rings.",
            )
        if self.junctions.shape != self.directions.shape:
            raise InputError(
                f"{len(self.junctions)} junctions have {len(self.directions)} directions.",
                "Give one direction for each junction.",
            )

    @classmethod
    def of(cls, polygon: Polygon, kind: int = STREET) -> Region:
        """Region with the same kind of edge all around."""
        rings = (polygon.exterior, *polygon.interiors)
        count = sum(max(len(ring.coords) - 1, 0) for ring in rings)
        return cls(polygon, np.full(count, kind))
