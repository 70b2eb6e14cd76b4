"""What flows through the room: blocks go in, plots come out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from shapely.geometry import MultiLineString, Polygon

#: What a plot is: a parcel to build on; a small green that takes an awkward corner; the court in
#: the middle of a deep block; a lane that gives access to what lies behind; inner street space.
PlotUse = Literal["parcel", "green", "court", "lane", "street"]


@dataclass(frozen=True)
class Block:
    """Land enclosed by street space, to be cut into plots.

    Attributes
    ----------
    polygon
        Its outline, valid, exterior counter-clockwise, possibly with holes; metres.
    closed
        The parts of its rings that give no access (a railway, a neighbour, a lake): lines that
        lie on the rings within 1 cm. Everything else runs along a street.
    block_id
        Its number, from 1.
    """

    polygon: Polygon
    closed: MultiLineString = field(default_factory=MultiLineString)
    block_id: int = 1


@dataclass(frozen=True)
class Plot:
    """A piece of a block.

    Attributes
    ----------
    polygon
        Its outline, metres. The plots of a block tile it.
    use
        What it is, see `PlotUse`.
    note
        Why it is what it is where that is worth telling ("no street access", "pointed corner"),
        else empty.
    template
        Name of the template that it was drawn from, empty for none.
    """

    polygon: Polygon
    use: PlotUse = "parcel"
    note: str = ""
    template: str = ""
