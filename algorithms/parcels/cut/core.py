"""The land inside a block that is too deep for its rows."""

from __future__ import annotations

import math

import shapely
from shapely.geometry import Polygon

from ..rules import ParcelRules
from ..types import Block
from .fronts import choices
from .line import Floats
from .outline import Side, direction, sides

#: Land further from the streets than that many depths is too deep for a parcel.
DEEP = 1.55
#: The same where a court is not wanted, if that can be helped.
VERY_DEEP = 1.75
#: A core is at least twice as wide as this (metres).
OPENING = 6.0
#: Rows go up to a side that turns off by more (degrees), the rest is left to the court.
SLANT = 55.0
#: Its outline is opened by this (metres), simplified by that, and kept off the block's edge.
CLEAN, SMOOTH, OFF = 3.0, 1.0, 0.1


def core_of_rows(
    polygon: Polygon, outline: list[Side], fronts: tuple[int, ...], rules: ParcelRules
) -> shapely.Geometry:
    """Return what the rows along some sides leave in the middle; empty if that is little.

    Parameters
    ----------
    polygon
        The block.
    outline, fronts
        Its sides and which of them have rows.
    rules
        What is asked of parcels.
    """
    nothing = Polygon()
    lines = shapely.multilinestrings([shapely.linestrings(outline[k].xy) for k in fronts])
    reach = shapely.buffer(lines, DEEP * rules.depth, quad_segs=4)
    deep = shapely.buffer(shapely.difference(polygon, reach), -OPENING, quad_segs=2)
    if deep.is_empty:
        return nothing
    # one band each: bands of neighbours overlap at convex corners and leave the land behind
    # reflex corners, which no parcel can reach squarely, to the court
    bands = shapely.buffer(
        [shapely.linestrings(_lengthened(outline, k, fronts, rules)) for k in fronts],
        rules.depth,
        cap_style="flat",
        join_style="mitre",
    )
    rest = shapely.difference(polygon, shapely.union_all(bands))
    rest = shapely.buffer(rest, -CLEAN, join_style="mitre")
    rest = shapely.buffer(rest, CLEAN, join_style="mitre")
    parts = [
        p
        for p in shapely.get_parts(shapely.simplify(shapely.intersection(rest, polygon), SMOOTH))
        if p.geom_type == "Polygon" and p.area > rules.area and shapely.intersects(p, deep)
    ]
    return shapely.multipolygons(parts) if parts else nothing


def _lengthened(outline: list[Side], k: int, fronts: tuple[int, ...], rules: ParcelRules) -> Floats:
    """Return a front, made longer where its row ends at an obtuse corner: no spike is left."""
    side = outline[k]
    xy = side.xy.copy()
    for end, other, turn in (
        (0, side.before, outline[side.before].turn),
        (-1, side.after, side.turn),
    ):
        if other not in fronts and SLANT < turn < 90.0:
            by = rules.depth / math.tan(math.radians(turn)) * (1 if end == -1 else -1)
            xy[end] += by * direction(xy, end)
    return xy


def core_of(block: Block, rules: ParcelRules) -> shapely.Geometry:
    """Return the core of a block: the land beyond the depth of parcels along all its streets.

    For those who put lanes or parcels behind others there. The court of `cut_blocks` lies in
    about the same place, but leaves out only the streets that have rows.

    Parameters
    ----------
    block
        The block.
    rules
        What is asked of parcels.

    Returns
    -------
    shapely.Geometry
        A polygon or several, empty if two rows reach everything; metres.
    """
    outline = sides(block)
    radius = shapely.maximum_inscribed_circle(block.polygon, tolerance=0.5).length
    best: shapely.Geometry = Polygon()
    for fronts in choices(outline, float(radius), rules):
        core = core_of_rows(block.polygon, outline, fronts, rules)
        if best.is_empty or core.area < best.area:
            best = core
    return best


def core_lines(core: shapely.Geometry, polygon: Polygon) -> list[shapely.Geometry]:
    """Return the outline of a core, without what runs along the edge of the block."""
    if core.is_empty:
        return []
    lines = shapely.difference(core.boundary, shapely.buffer(polygon.boundary, OFF))
    merged = shapely.line_merge(lines) if lines.geom_type == "MultiLineString" else lines
    return [p for p in shapely.get_parts(merged) if p.length > 0.5]
