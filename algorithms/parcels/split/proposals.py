"""Streets that a region might be split along, from the field, best first."""

from __future__ import annotations

from dataclasses import dataclass

from shapely.geometry import LineString


@dataclass(frozen=True)
class Proposal:
    """A street that a region might be split along.

    Attributes
    ----------
    line
        Centre line from edge to edge of the region, metres.
    quality
        Smaller is better, see `field.score`.
    """

    line: LineString
    quality: float
