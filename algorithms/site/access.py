"""Where existing streets arrive at the edge of a site: the sinks of CND."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import substring

from .roadnetwork import RoadNetwork, Section
from .types import AccessPoint

ISOLATED = 200.0
"""Service lanes that hang together over less than this lead nowhere, metres."""

STEEP = 40.0
"""Smallest angle between an incoming street and the boundary, degrees."""

WALK = 25.0
"""Length over which the direction of a street is measured, metres."""

MERGE = 12.0
"""Access points closer than this are one, metres."""

MERGE_MINOR = 40.0
"""Driveways and alleys closer than this to another access point are left out, metres."""

MINOR = frozenset({"service", "driveway", "alley", "parking_aisle"})
"""Road classes that make an access point only where no better one is near."""

DEPTH = 8.0
"""Within `WALK` of the boundary an incoming street gets this far from all edges, metres."""

PROBES = np.array([2.0, 5.0, 10.0, 15.0, 20.0, 25.0])
"""Distances ahead of the boundary at which that is looked at, metres."""

STRAIGHT = 35.0
"""A street goes on through a junction where it turns by less than this, degrees."""

CROSSING = 6.0
"""How far a road that crosses the boundary is followed to either side, metres."""


OUTSIDE = 2.0
"""A road that crosses the boundary comes from at least this far outside, metres."""


@dataclass(frozen=True)
class _Candidate:
    point: AccessPoint
    sine: float


def access_points(
    polygon: Polygon, roads: RoadNetwork, along: frozenset[int], snap_distance: float
) -> list[AccessPoint]:
    """Find where streets from outside arrive at the boundary.

    Parameters
    ----------
    polygon
        The site, metres.
    roads
        Roads near it.
    along
        Indices of the roads that run along the boundary.
    snap_distance
        Largest distance of a junction from the boundary, metres.

    Returns
    -------
    list of AccessPoint
        In the order in which they lie along the rings.
    """
    leads = _leads_somewhere(roads)
    found = _at_crossings(polygon, roads, leads)
    found += _at_junctions(polygon, roads, along, snap_distance, leads)
    # streets before service ways, then the steepest first
    found.sort(key=lambda c: (_minor(c.point), -round(c.sine, 2), c.point.name == "", c.point.xy))
    kept: list[AccessPoint] = []
    for candidate in found:
        apart = MERGE_MINOR if _minor(candidate.point) else MERGE
        if all(math.dist(candidate.point.xy, p.xy) >= apart for p in kept):
            kept.append(candidate.point)
    return in_ring_order(polygon, kept)


def _leads_somewhere(roads: RoadNetwork) -> npt.NDArray[np.bool_]:
    """Tell which lines belong to a network worth the name, shape (n,).

    A few service lanes that hang together with nothing else, such as those of a car park
    whose driveway is not drawn, lead nowhere.
    """
    n = len(roads.nodes)
    links = coo_matrix((np.ones(len(roads.ends)), (roads.ends[:, 0], roads.ends[:, 1])), (n, n))
    part = connected_components(links, directed=False)[1][roads.ends[:, 0]]
    if not len(part):
        return np.zeros(0, dtype=np.bool_)
    length = np.bincount(part, weights=shapely.length(roads.lines))
    minor = np.array([str(kind).lower() in MINOR for kind in roads.kinds])
    streets = np.bincount(part, weights=~minor)
    return np.asarray((length[part] >= ISOLATED) | (streets[part] > 0))


def _minor(point: AccessPoint) -> bool:
    return point.kind.lower() in MINOR


def in_ring_order(polygon: Polygon, points: list[AccessPoint]) -> list[AccessPoint]:
    """Sort access points by ring and by distance along it.

    Parameters
    ----------
    polygon
        The site.
    points
        Access points.

    Returns
    -------
    list of AccessPoint
        The same, sorted.
    """
    rings = [polygon.exterior, *polygon.interiors]

    def key(point: AccessPoint) -> tuple[int, float]:
        place = Point(point.xy)
        nearest = min(range(len(rings)), key=lambda k: rings[k].distance(place))
        return nearest, float(rings[nearest].project(place))

    return sorted(points, key=key)


def _at_junctions(
    polygon: Polygon,
    roads: RoadNetwork,
    along: frozenset[int],
    snap_distance: float,
    leads: npt.NDArray[np.bool_],
) -> list[_Candidate]:
    """Junctions and road ends near the boundary that a street reaches from outside."""
    places = shapely.points(roads.nodes)
    near = (shapely.distance(places, polygon.boundary) <= snap_distance) & (roads.degree != 2)
    branches: dict[int, list[_Branch]] = {}
    for j, end in zip(*np.nonzero(near[roads.ends] & leads[:, None])):
        branch = _branch(roads, int(j), int(end))
        branches.setdefault(int(roads.ends[j, end]), []).append(branch)
    result = []
    for node, around in branches.items():
        for branch in around:
            if not _comes_from_outside(polygon, branch) or _goes_on_along(branch, around, along):
                continue
            place = _hit(polygon, places[node], branch.direction, snap_distance)
            if place is None:
                continue
            candidate = _candidate(polygon, place, places[node], branch.direction, branch.section)
            if candidate is not None:
                result.append(candidate)
    return result


@dataclass(frozen=True)
class _Branch:
    """The last stretch of a road before a junction."""

    line: int
    section: Section
    stretch: LineString
    direction: tuple[float, float]


def _branch(roads: RoadNetwork, j: int, end: int) -> _Branch:
    line = roads.lines[j]
    walk = min(WALK, line.length)
    stretch = substring(line, 0.0, walk) if end == 0 else substring(
        line, line.length, line.length - walk
    )  # fmt: skip
    here, away = Point(stretch.coords[0]), Point(stretch.coords[-1])
    section = roads.sections[j][0 if end == 0 else -1]
    return _Branch(j, section, stretch, direction_between(away, here))


def _comes_from_outside(polygon: Polygon, branch: _Branch) -> bool:
    """Tell whether a branch lies outside the site, but for a bit at the junction."""
    away = Point(branch.stretch.coords[-1])
    if branch.stretch.length < 1.0 or polygon.contains(away):
        return False
    inside = float(branch.stretch.intersection(polygon).length)
    return inside < 0.4 * float(branch.stretch.length)


def _goes_on_along(branch: _Branch, around: list[_Branch], along: frozenset[int]) -> bool:
    """Tell whether a street goes straight on past the site, along its edge."""
    least = math.cos(math.radians(STRAIGHT))
    for other in around:
        if other is branch or other.line not in along:
            continue
        turn = -(
            branch.direction[0] * other.direction[0] + branch.direction[1] * other.direction[1]
        )
        if turn > least:
            return True
    return False


def _hit(
    polygon: Polygon, here: Point, direction: tuple[float, float], snap_distance: float
) -> Point | None:
    """Where a street that goes on through `here` meets the boundary."""
    reach = 1.8 * snap_distance
    ahead = (here.x + direction[0] * reach, here.y + direction[1] * reach)
    hits = shapely.get_coordinates(
        shapely.intersection(LineString([(here.x, here.y), ahead]), polygon.boundary)
    )
    if len(hits) > 0 and not polygon.contains(here):
        return Point(min(hits.tolist(), key=lambda p: math.dist(p, (here.x, here.y))))
    if polygon.intersects(here):  # the junction lies inside: the street came in behind it
        return Point(polygon.boundary.interpolate(polygon.boundary.project(here)))
    return None


def _at_crossings(
    polygon: Polygon, roads: RoadNetwork, leads: npt.NDArray[np.bool_]
) -> list[_Candidate]:
    """Roads that cross the boundary into the site."""
    result = []
    boundary = polygon.boundary
    for j in np.flatnonzero(shapely.crosses(roads.lines, polygon) & leads):
        line = roads.lines[j]
        for x, y in shapely.get_coordinates(shapely.intersection(line, boundary)).tolist():
            at = float(line.project(Point(x, y)))
            for sign in (-1.0, 1.0):
                steps = at + sign * np.array([-CROSSING, CROSSING])
                tail, head = shapely.line_interpolate_point(line, np.clip(steps, 0.0, line.length))
                if polygon.contains(tail) or not polygon.contains(head):
                    continue
                if (at if sign > 0 else line.length - at) < OUTSIDE:
                    continue  # a road inside that only begins at the edge
                ahead = at + sign * PROBES
                ahead = ahead[(ahead >= 0.0) & (ahead <= line.length)]
                path = shapely.line_interpolate_point(line, ahead)
                if _goes_deep(polygon, path):
                    direction = direction_between(tail, head)
                    sine = _sine(polygon, Point(x, y), direction)
                    section = roads.at(int(j), at)
                    point = AccessPoint((x, y), (x, y), direction, section.name, section.kind)
                    result.append(_Candidate(point, sine))
    return result


def _candidate(
    polygon: Polygon,
    place: Point,
    junction: Point,
    direction: tuple[float, float],
    section: Section,
) -> _Candidate | None:
    """Make an access point, if its direction is steep to the boundary and leads inside."""
    sine = _sine(polygon, place, direction)
    ahead = shapely.points(np.array([place.x, place.y]) + PROBES[:, None] * np.array(direction))
    if sine < math.sin(math.radians(STEEP)) or not _goes_deep(polygon, ahead):
        return None
    xy, origin = (place.x, place.y), (junction.x, junction.y)
    point = AccessPoint(xy, origin, direction, section.name, section.kind)
    return _Candidate(point, sine)


def _sine(polygon: Polygon, place: Point, direction: tuple[float, float]) -> float:
    """Sine of the angle between a direction and the boundary at a point on it."""
    tangent = boundary_tangent(polygon, place)
    return abs(tangent[0] * direction[1] - tangent[1] * direction[0])


def _goes_deep(polygon: Polygon, ahead: npt.NDArray[Any]) -> bool:
    """Tell whether the points ahead lead into the site, not along its edge."""
    inside = shapely.contains(polygon, ahead)
    if len(inside) == 0 or not inside[0]:
        return False
    ahead = ahead[: len(inside) if np.all(inside) else int(np.argmin(inside))]
    # about the half width of the site: a small site has no place 8 m from its edges
    half_width = 2.0 * polygon.area / polygon.length
    deepest = float(np.max(shapely.distance(ahead, polygon.boundary)))
    return bool(deepest >= min(DEPTH, 0.4 * half_width))


def boundary_tangent(polygon: Polygon, place: Point, window: float = 5.0) -> tuple[float, float]:
    """Give the direction of the boundary at a point on it.

    Parameters
    ----------
    polygon
        The site.
    place
        Point on its boundary.
    window
        How far to either side to measure, metres.

    Returns
    -------
    tuple of float
        Unit vector along the ring.
    """
    rings = [polygon.exterior, *polygon.interiors]
    ring = min(rings, key=lambda r: r.distance(place))
    at = float(ring.project(place))
    before = ring.interpolate((at - window) % ring.length)
    after = ring.interpolate((at + window) % ring.length)
    return direction_between(before, after)


def direction_between(a: Point, b: Point) -> tuple[float, float]:
    """Give the unit vector from one point to another.

    Parameters
    ----------
    a, b
        From and to.

    Returns
    -------
    tuple of float
        Unit vector, zero where the points coincide.
    """
    size = max(math.hypot(b.x - a.x, b.y - a.y), 1e-12)
    return (b.x - a.x) / size, (b.y - a.y) / size
