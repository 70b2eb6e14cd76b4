"""Blocks: what streets and the edge of the site enclose."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from ..site.types import Site

#: Streets this near to the edge of the site reach it (metres).
REACH = 40.0
#: Grid on which lines are noded (metres).
GRID = 0.001
#: Smaller pieces are left-overs of noding (square metres).
SCRAP = 1.0


@dataclass(frozen=True)
class Block:
    """An area enclosed by streets (centre lines) and the edge of the site.

    Attributes
    ----------
    polygon
        Its outline, metres.
    width, length
        Length: longer side of the smallest enclosing rectangle; width: area / length, so
        that a bent or pointed block is not flattered. Metres.
    """

    polygon: Polygon
    width: float
    length: float


def blocks(site: Site, streets: Iterable[LineString]) -> list[Block]:
    """Enclose the blocks of a site.

    Parameters
    ----------
    site
        The site.
    streets
        Centre lines of the designed streets; those that end at the edge must reach it.
    """
    rings = [site.polygon.exterior, *site.polygon.interiors]
    lines = [*(LineString(ring) for ring in rings), *streets]
    noded = shapely.union_all(np.array(lines, dtype=object), grid_size=GRID)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    inside = [
        face
        for face in faces
        if face.area > SCRAP and site.polygon.contains(face.representative_point())
    ]
    return [Block(face, *block_size(face)) for face in inside]


def block_size(polygon: Polygon) -> tuple[float, float]:
    """Width and length of a block in metres, see `Block`.

    Examples
    --------
    >>> block_size(shapely.box(0, 0, 150, 72))
    (72.0, 150.0)
    """
    return block_sizes([polygon])[0]


def block_sizes(polygons: Sequence[Polygon]) -> list[tuple[float, float]]:
    """Width and length of each of many blocks in metres, see `Block`."""
    boxes = shapely.minimum_rotated_rectangle(np.array(polygons, dtype=object))
    counts = shapely.get_num_coordinates(boxes)
    corners = shapely.get_coordinates(boxes)
    first = np.cumsum(counts) - counts
    lengths = np.zeros(len(boxes))
    flat = counts < 3
    a, b, c = (corners[first[~flat] + i] for i in range(3))
    lengths[~flat] = np.maximum(np.hypot(*(b - a).T), np.hypot(*(c - b).T))
    return [
        (round(area / length, 6) if length > 0 else 0.0, round(length, 6))
        for area, length in zip(shapely.area(polygons).tolist(), lengths.tolist())
    ]


def reach_edge(site: Site, xy: tuple[float, float], from_xy: tuple[float, float]) -> LineString:
    """Draw the short piece that takes a street's end from the mesh's outline to the site's.

    The mesh follows a cleaned outline: its boundary vertices may lie a little inside or
    outside the true one.

    Parameters
    ----------
    site
        The site.
    xy
        End of the street, metres.
    from_xy
        Where the street comes from, metres: it goes straight on if that meets the edge soon.
    """
    end = np.asarray(xy)
    step = end - np.asarray(from_xy)
    step = step / (np.hypot(*step) or 1.0)
    here = shapely.Point(xy)
    edge = site.polygon.boundary
    nearest = shapely.get_point(shapely.shortest_line(here, edge), 1)
    gap = here.distance(nearest)
    if gap < 0.05:
        # on the edge but for rounding: a breath beyond it, so that noding finds the crossing
        return LineString([end - step * 0.1, end + step * 0.1])
    ray = LineString([end, end + step * min(REACH, 2 * gap + 0.1)])
    hit = shapely.intersection(ray, edge)
    if not hit.is_empty:
        nearest = shapely.get_point(shapely.shortest_line(here, hit), 1)
    # a breath beyond the edge, so that noding finds the crossing
    beyond = np.array([nearest.x, nearest.y])
    way = (beyond - end) / (np.hypot(*(beyond - end)) or 1.0)
    return LineString([end, beyond + way * 0.05])
