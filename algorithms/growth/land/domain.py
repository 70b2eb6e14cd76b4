"""The domain: what of the sites streets may grow in, up to the streets along their edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon

from ..types import FloatArray
from .pieces import SAME

#: How far the domain reaches beyond a street along its edge, so that new streets meet the street
#: before they meet the edge (metres).
RIM = 0.1
#: Parts of the domain that are nowhere this wide hold no street (metres).
SLIVER = 4.0
#: Spacing of the places at which the strip between edge and street is measured (metres).
STEP = 2.0
#: Least angle between a street and the way from it to the site (degrees): a street that runs on
#: beyond the corner of a site takes no wedge of foreign ground into the domain.
SQUARE = 30.0
#: The strip to a street overlaps the site by this much (metres).
OVERLAP = 0.2
#: Lines nearer than this are the same (metres).
ON = 0.02
#: Largest angle between an edge and a street beside it (degrees).
PARALLEL = 30.0
#: No street runs around smaller obstacles (square metres).
SMALL = 1000.0

Edge = Literal["stop", "join"]
Geometries = npt.NDArray[Any]


@dataclass(frozen=True)
class Land:
    """What one site gives to the domain, metres in the common CRS.

    Attributes
    ----------
    polygon
        The site.
    streets
        Centre lines of the existing streets along its edge.
    obstacles
        What must stay free.
    reach
        Largest distance of those streets from the edge.
    """

    polygon: Polygon
    streets: Sequence[LineString]
    obstacles: Sequence[shapely.Geometry]
    reach: float


def whole_of(lands: Sequence[Land]) -> shapely.Geometry:
    """Join sites to one area up to their streets, obstacles and all.

    Parameters
    ----------
    lands
        The sites.

    Returns
    -------
    Polygon or MultiPolygon
        Its outer edge is where one leaves the ground.
    """
    parts: list[shapely.Geometry] = []
    for land in lands:
        parts += [land.polygon, *strips(land)]
    return _without_gaps(shapely.union_all(parts), lands)


def domain_of(
    whole: shapely.Geometry, inner: shapely.Geometry, lands: Sequence[Land]
) -> shapely.Geometry:
    """Take the obstacles away, and what is too narrow for a street.

    Parameters
    ----------
    whole
        From `whole_of`.
    inner
        The sites as one; what an obstacle cuts off from them is left out.
    lands
        The sites.

    Returns
    -------
    Polygon or MultiPolygon
        Empty where no part of it is wide enough for a street.
    """
    joined = whole
    barred = [shape for land in lands for shape in land.obstacles]
    if barred:
        joined = shapely.difference(joined, shapely.union_all(barred))
    pieces = shapely.get_parts(joined)
    pieces = pieces[shapely.get_type_id(pieces) == 3]
    own = shapely.area(shapely.intersection(pieces, inner)) > SLIVER * SLIVER
    wide = ~shapely.is_empty(shapely.buffer(pieces, -SLIVER / 2))
    kept = shapely.normalize(pieces[wide & own])
    return shapely.union_all(kept) if len(kept) != 1 else kept[0]


def with_rim(domain: shapely.Geometry, lines: Sequence[LineString]) -> shapely.Geometry:
    """Let a domain reach a little beyond the streets along its edge.

    Parameters
    ----------
    domain
        Polygon or MultiPolygon.
    lines
        All streets.
    """
    ring = shapely.boundary(domain)
    shapely.prepare(ring)
    near = np.array(lines, dtype=object)
    near = near[shapely.dwithin(near, ring, ON)] if len(near) else near
    edge = shapely.buffer(ring, ON)
    along = shapely.get_parts(shapely.intersection(near, edge))
    along = along[shapely.length(along) > 5 * ON]
    if not len(along):
        return domain
    rims = shapely.buffer(along, RIM, cap_style="square")
    return shapely.union_all([domain, *rims])


def with_notches(
    domain: shapely.Geometry, lands: Sequence[Land], lines: Sequence[LineString]
) -> shapely.Geometry:
    """Add the small pieces of ground between a domain and streets that lead on outside of it.

    Parameters
    ----------
    domain
        From `domain_of`.
    lands
        The sites.
    lines
        All streets. Those that lead on from the domain over its edge do so over a strip as wide as
        the streets along the edge are far away, at most.

    Returns
    -------
    Polygon or MultiPolygon
        Nothing of obstacles and of holes of the sites is added.
    """
    reach = max(land.reach for land in lands)
    near = np.array(lines, dtype=object)
    near = near[shapely.dwithin(near, shapely.boundary(domain), ON)] if len(near) else near
    if not len(near):
        return domain
    # holes close though ends lie a hair beside the edge
    around = _holes(shapely.union_all([domain, *shapely.buffer(near, ON)]))
    around = around[shapely.area(around) < reach * reach]
    before = shapely.union_all(_holes(domain))
    around = around[~shapely.intersects(before, shapely.point_on_surface(around))]
    if not len(around):
        return domain
    fill = shapely.union_all(shapely.buffer(around, 2 * ON, join_style="mitre"))
    barred = [shape for land in lands for shape in land.obstacles]
    barred += [Polygon(hole) for land in lands for hole in land.polygon.interiors]
    if barred:
        fill = shapely.difference(fill, shapely.union_all(barred))
    return shapely.union_all([domain, fill])


def _holes(area: shapely.Geometry) -> Geometries:
    rings = [ring for part in shapely.get_parts(area) for ring in part.interiors]
    return np.array([Polygon(ring) for ring in rings], dtype=object)


def strips(land: Land) -> list[shapely.Geometry]:
    """Ground between a site and the centre lines of the streets along its edge.

    Parameters
    ----------
    land
        The site.

    Returns
    -------
    list of Polygon
        They overlap the site and each other.
    """
    if not land.streets:
        return []
    lines = shapely.segmentize(np.array(land.streets, dtype=object), STEP)
    xy, line = shapely.get_coordinates(lines, return_index=True)
    way = shapely.get_coordinates(
        shapely.shortest_line(shapely.points(xy), land.polygon)
    ).reshape(-1, 2, 2)  # fmt: skip
    toward = way[:, 1] - way[:, 0]
    gap = np.hypot(toward[:, 0], toward[:, 1])
    inner = way[:, 1] + toward / np.maximum(gap, 1e-9)[:, None] * OVERLAP
    pair = np.flatnonzero((line[:-1] == line[1:]) & (gap[:-1] + gap[1:] > ON))
    ahead = xy[pair + 1] - xy[pair]
    size = np.maximum(np.hypot(ahead[:, 0], ahead[:, 1]), 1e-9)
    across = np.abs(_cross(ahead, toward[pair] + toward[pair + 1])) / size
    total = np.hypot(*(toward[pair] + toward[pair + 1]).T)
    near = np.maximum(gap[pair], gap[pair + 1]) <= 1.5 * land.reach
    pair = pair[near & (across >= np.sin(np.radians(SQUARE)) * total)]
    if not len(pair):
        return []
    corners = np.stack([xy[pair], xy[pair + 1], inner[pair + 1], inner[pair]], axis=1)
    # a breath wider, so that neighbours overlap
    shapes = shapely.convex_hull(shapely.multipoints(corners))
    shapes = shapes[shapely.get_type_id(shapes) == 3]
    return list(shapely.buffer(shapes, 1e-4, join_style="mitre"))


def joined_edges(
    domain: shapely.Geometry, lands: Sequence[Land], *, outer: bool, obstacles: bool
) -> list[LineString]:
    """Give new streets along the edges of a domain where no existing street runs.

    Parameters
    ----------
    domain
        From `domain_of`.
    lands
        The sites it was made of.
    outer
        Whether they run along the outer edge.
    obstacles
        Whether they run around holes and obstacles, but for those smaller than `SMALL`, inside
        the sites.

    Returns
    -------
    list of LineString
        Ends that come near an existing street lead on to it, where no obstacle is in the way.
    """
    rings = shapely.union_all(shapely.get_rings(shapely.get_parts(domain)))
    barred = [shape for land in lands for shape in land.obstacles]
    barred += [Polygon(hole) for land in lands for hole in land.polygon.interiors]
    areas = shapely.get_parts(shapely.union_all(barred)) if barred else np.zeros(0, dtype=object)
    around = shapely.buffer(shapely.union_all(shapely.boundary(areas)), ON)
    big = shapely.buffer(
        shapely.union_all(shapely.boundary(areas[shapely.area(areas) > SMALL])), ON
    )
    streets = MultiLineString([street for land in lands for street in land.streets])
    reach = max(land.reach for land in lands)
    chosen = []
    if outer:
        chosen.append(_apart(shapely.difference(rings, around), streets, reach))
    if obstacles:
        inner = shapely.buffer(shapely.union_all([land.polygon for land in lands]), ON)
        own = shapely.intersection(shapely.intersection(rings, big), inner)
        chosen.append(_apart(own, streets, reach))
    lines = shapely.get_parts(shapely.line_merge(shapely.union_all(chosen)))
    lines = lines[(shapely.get_type_id(lines) == 1) & (shapely.length(lines) > reach)]
    # without the vertices at which the edge was measured
    lines = shapely.simplify(shapely.normalize(lines), SAME)
    ground = shapely.union_all(areas)
    shapely.prepare(ground)
    return [_led_on(line, streets, lines, reach, ground) for line in lines]


def _apart(edges: shapely.Geometry, streets: MultiLineString, reach: float) -> shapely.Geometry:
    """Keep the edges that no street runs beside."""
    xy, line = shapely.get_coordinates(
        shapely.get_parts(shapely.segmentize(edges, 2 * STEP)), return_index=True
    )
    at = np.flatnonzero(line[:-1] == line[1:])
    sides = np.stack([xy[at], xy[at + 1]], axis=1)
    if not len(at) or streets.is_empty:
        return edges
    street_xy, own = shapely.get_coordinates(shapely.get_parts(streets), return_index=True)
    first = np.flatnonzero(own[:-1] == own[1:])
    pieces = np.stack([street_xy[first], street_xy[first + 1]], axis=1)
    middles = shapely.points(sides.mean(axis=1))
    lines = shapely.linestrings(pieces)
    side, piece = shapely.STRtree(lines).query(middles, predicate="dwithin", distance=reach)
    link = shapely.get_coordinates(shapely.shortest_line(middles[side], lines[piece]))
    link = link.reshape(-1, 2, 2)[:, 1] - link.reshape(-1, 2, 2)[:, 0]
    along, way = _unit(pieces[piece]), _unit(sides[side])
    gap = np.hypot(link[:, 0], link[:, 1])
    parallel = np.abs((along * way).sum(axis=1)) > np.cos(np.radians(PARALLEL))
    abreast = (np.abs(_cross(along, link)) > 0.7 * gap) | (gap < STEP)
    beside = np.zeros(len(sides), dtype=bool)
    beside[side[parallel & abreast]] = True
    return shapely.union_all(shapely.linestrings(sides[~beside]))


def _unit(lines: FloatArray) -> FloatArray:
    way = lines[:, 1] - lines[:, 0]
    return np.asarray(way / np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)[:, None])


def _led_on(
    line: LineString,
    streets: MultiLineString,
    others: Geometries,
    reach: float,
    barred: shapely.Geometry,
) -> LineString:
    """Lead the ends of a line on to the street that runs beside the edge from there."""
    if line.is_closed:
        return line
    xy = [(float(x), float(y)) for x, y in line.coords]
    rest = shapely.union_all([streets, *[o for o in others if not shapely.equals(o, line)]])
    for end in (0, -1):
        tip = shapely.Point(xy[end])
        if rest.is_empty or not 0 < rest.distance(tip) <= reach:
            continue
        foot = _foot(tip, rest, reach, barred)
        if foot is not None:
            xy.insert(len(xy) if end else 0, foot)
    return LineString(xy)


def _foot(
    tip: shapely.Point, lines: shapely.Geometry, reach: float, barred: shapely.Geometry
) -> tuple[float, float] | None:
    """Find the nearest place on lines that is within reach and not behind an obstacle."""
    nearest = shapely.get_coordinates(shapely.shortest_line(tip, lines))[1:]
    near = shapely.intersection(lines, tip.buffer(reach))
    further = shapely.get_coordinates(shapely.segmentize(near, STEP))
    further = further[np.argsort(np.hypot(*(further - (tip.x, tip.y)).T), kind="stable")]
    feet = np.concatenate([nearest, further])
    ways = shapely.linestrings([[(tip.x, tip.y), foot] for foot in feet.tolist()])
    free = shapely.length(shapely.intersection(ways, barred)) < ON
    return None if not free.any() else tuple(feet[free.argmax()].tolist())


def _without_gaps(area: shapely.Geometry, lands: Sequence[Land]) -> shapely.Geometry:
    """Fill the holes between sites and streets that are no holes of a site."""
    holes = shapely.union_all([Polygon(h) for land in lands for h in land.polygon.interiors])
    reach = max(land.reach for land in lands)
    fill = []
    for part in shapely.get_parts(area):
        for ring in part.interiors:
            gap = Polygon(ring)
            inside = gap.representative_point()
            if gap.area < reach * reach and not holes.covers(inside):
                fill.append(shapely.buffer(gap, 1e-3, join_style="mitre"))
    return shapely.union_all([area, *fill]) if fill else area


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], dtype=float)
