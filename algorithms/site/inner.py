"""Existing streets inside a site that are to be kept."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.ops import substring

from .roadnetwork import RoadNetwork
from .types import BoundaryStreet

SHORTEST = 5.0
"""Shorter bits of road inside a site are left out, metres."""

ALONG_EDGE = 1.0
"""Roads that get no deeper into a site than this are not inside it, metres."""


def inner_streets(
    polygon: Polygon,
    roads: RoadNetwork,
    edge: list[tuple[int, float, float]],
    *,
    everything: bool,
) -> list[BoundaryStreet]:
    """Cut the roads to the inside of a site.

    Parameters
    ----------
    polygon
        The site, metres.
    roads
        Roads near it.
    edge
        Parts of the roads that count as streets along its edge already: index of the line,
        start and end along it, metres.
    everything
        Take all roads, not only those that the layer says are to be kept.

    Returns
    -------
    list of BoundaryStreet
        Cut at junctions and where name or class change.
    """
    result: list[BoundaryStreet] = []
    inside = shapely.buffer(polygon, -ALONG_EDGE)
    for j in np.flatnonzero(shapely.intersects(roads.lines, inside)).tolist():
        line = roads.lines[j]
        taken = [(a, b) for k, a, b in edge if k == j]
        whole = len(roads.sections[j]) == 1 and not taken
        for section in roads.sections[j]:
            if not (everything or section.inside):
                continue
            for a, b in _left(section.start, section.end, taken):
                part = line if whole else substring(line, a, b)
                if not shapely.intersects(part, inside):
                    continue
                # a short piece with a name of its own goes on in others
                shortest = SHORTEST if whole or taken else min(SHORTEST, 0.99 * (b - a))
                result += [
                    BoundaryStreet(piece, section.name, section.kind)
                    for piece in _clipped(part, polygon)
                    if piece.length >= shortest
                ]
    return result


def _left(start: float, end: float, taken: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Give what is left of an interval when others are taken out of it."""
    left = [(start, end)]
    for a, b in taken:
        left = [(x, y) for p, q in left for x, y in ((p, min(q, a)), (max(p, b), q)) if y - x > 0.0]
    return left


def _clipped(line: LineString, polygon: Polygon) -> list[LineString]:
    if shapely.covered_by(line, polygon):
        return [line]
    cut = shapely.get_parts(shapely.line_merge(shapely.intersection(line, polygon)))
    return [piece for piece in cut if isinstance(piece, LineString)]
