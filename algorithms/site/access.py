"""Where existing streets arrive at the edge of a site: the sinks of CND."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import substring

from ..errors import InputError
from .crs import layer_crs
from .roads import RoadNetwork
from .types import AccessPoint, Site

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

STRAIGHT = 35.0
"""A street goes on through a junction where it turns by less than this, degrees."""

CROSSING = 6.0
"""How far a road that crosses the boundary is followed to either side, metres."""


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
    found = _at_crossings(polygon, roads)
    found += _at_junctions(polygon, roads, along, snap_distance)
    # streets before service ways, then the steepest first
    found.sort(key=lambda c: (_minor(c.point), -round(c.sine, 2), c.point.name == "", c.point.xy))
    kept: list[AccessPoint] = []
    for candidate in found:
        apart = MERGE_MINOR if _minor(candidate.point) else MERGE
        if all(math.dist(candidate.point.xy, p.xy) >= apart for p in kept):
            kept.append(candidate.point)
    return in_ring_order(polygon, kept)


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
    polygon: Polygon, roads: RoadNetwork, along: frozenset[int], snap_distance: float
) -> list[_Candidate]:
    """Junctions and road ends near the boundary that a street reaches from outside."""
    places = shapely.points(roads.nodes)
    near = (shapely.distance(places, polygon.boundary) <= snap_distance) & (roads.degree != 2)
    branches: dict[int, list[_Branch]] = {}
    for j, end in zip(*np.nonzero(near[roads.ends])):
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
            candidate = _candidate(
                polygon, place, places[node], branch.direction, roads, branch.line
            )
            if candidate is not None:
                result.append(candidate)
    return result


@dataclass(frozen=True)
class _Branch:
    """The last stretch of a road before a junction."""

    line: int
    stretch: LineString
    direction: tuple[float, float]


def _branch(roads: RoadNetwork, j: int, end: int) -> _Branch:
    line = roads.lines[j]
    walk = min(WALK, line.length)
    stretch = substring(line, 0.0, walk) if end == 0 else substring(
        line, line.length, line.length - walk
    )  # fmt: skip
    here, away = Point(stretch.coords[0]), Point(stretch.coords[-1])
    return _Branch(j, stretch, _direction(away, here))


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


def _at_crossings(polygon: Polygon, roads: RoadNetwork) -> list[_Candidate]:
    """Roads that cross the boundary into the site."""
    result = []
    boundary = polygon.boundary
    for j in np.flatnonzero(shapely.crosses(roads.lines, polygon)):
        line = roads.lines[j]
        for x, y in shapely.get_coordinates(shapely.intersection(line, boundary)).tolist():
            at = float(line.project(Point(x, y)))
            ends = [
                line.interpolate(max(0.0, at - CROSSING)),
                line.interpolate(min(line.length, at + CROSSING)),
            ]
            inside = [bool(polygon.contains(p)) for p in ends]
            if inside[0] == inside[1]:
                continue
            direction = _direction(ends[inside.index(False)], ends[inside.index(True)])
            place = Point(x, y)
            candidate = _candidate(polygon, place, place, direction, roads, int(j))
            if candidate is not None:
                result.append(candidate)
    return result


def _candidate(
    polygon: Polygon,
    place: Point,
    junction: Point,
    direction: tuple[float, float],
    roads: RoadNetwork,
    line: int,
) -> _Candidate | None:
    """An access point, if its direction is steep to the boundary and leads inside."""
    tangent = boundary_tangent(polygon, place)
    sine = abs(tangent[0] * direction[1] - tangent[1] * direction[0])
    if sine < math.sin(math.radians(STEEP)) or not _leads_inside(polygon, place, direction):
        return None
    xy, origin = (place.x, place.y), (junction.x, junction.y)
    point = AccessPoint(xy, origin, direction, str(roads.names[line]), str(roads.kinds[line]))
    return _Candidate(point, sine)


def _leads_inside(polygon: Polygon, place: Point, direction: tuple[float, float]) -> bool:
    """Tell whether going on from `place` leads into the site, not along its edge."""
    steps = np.array([2.0, *np.arange(5.0, WALK + 1.0, 5.0)])
    ahead = shapely.points(np.array([place.x, place.y]) + steps[:, None] * np.array(direction))
    inside = shapely.contains(polygon, ahead)
    if not inside[0]:
        return False
    ahead = ahead[: len(inside) if np.all(inside) else int(np.argmin(inside))]
    # about the half width of the site: a small site has no place 8 m from its edges
    half_width = 2.0 * polygon.area / polygon.length
    deepest = float(np.max(shapely.distance(ahead, polygon.boundary)))
    return deepest >= min(DEPTH, 0.4 * half_width)


def boundary_tangent(
    polygon: Polygon, place: Point, window: float = 5.0
) -> tuple[float, float]:
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
    return _direction(before, after)


def _direction(a: Point, b: Point) -> tuple[float, float]:
    size = max(math.hypot(b.x - a.x, b.y - a.y), 1e-12)
    return (b.x - a.x) / size, (b.y - a.y) / size


def access_points_from_layer(
    frame: gpd.GeoDataFrame, site: Site, layer_name: str = "Access points"
) -> list[AccessPoint]:
    """Take access points back from a layer, so that the planner can edit them.

    Parameters
    ----------
    frame
        Points; the columns bearing_deg (direction into the site, degrees clockwise from
        north), name and site_id are read where present. Without a bearing the direction
        is square to the boundary.
    site
        The site they belong to; rows with another site_id are passed over.
    layer_name
        Name of the layer, for messages.

    Returns
    -------
    list of AccessPoint
        Moved onto the boundary, in the order in which they lie along the rings.

    Raises
    ------
    InputError
        If the layer has no CRS, a geometry is not a point, or a point lies further than
        the site's snap distance from its boundary.
    """
    crs = layer_crs(frame, layer_name)
    if "site_id" in frame.columns:
        own = frame["site_id"]
        frame = frame[(own == site.site_id) | own.isna()]
    geometry = frame.geometry if crs == site.crs else frame.geometry.to_crs(site.crs)
    bearings = frame["bearing_deg"] if "bearing_deg" in frame.columns else [None] * len(frame)
    names = frame["name"] if "name" in frame.columns else [None] * len(frame)
    result = []
    for feature, place, bearing, name in zip(frame.index, geometry, bearings, names):
        if place is None or place.is_empty:
            continue
        point = _edited_point(place, bearing, site, layer_name, feature)
        result.append(
            AccessPoint(point.xy, point.junction, point.direction, _text(name))
        )
    return in_ring_order(site.polygon, result)


def _edited_point(
    place: Any, bearing: Any, site: Site, layer: str, feature: object
) -> AccessPoint:
    label = feature if isinstance(feature, (int, str)) else str(feature)
    if place.geom_type == "MultiPoint" and len(place.geoms) == 1:
        place = place.geoms[0]
    if place.geom_type != "Point":
        raise InputError(
            f"is a {place.geom_type}, not a point.", "Give a point layer.",
            layer=layer, feature=label,
        )  # fmt: skip
    gap = float(site.polygon.boundary.distance(place))
    if not gap <= site.snap_distance:
        raise InputError(
            f"the point lies {gap:.0f} m from the boundary of {site.name}, further than the "
            f"snap distance of {site.snap_distance:g} m.",
            "Move it to the boundary, or delete it.",
            layer=layer,
            feature=label,
        )
    on = Point(site.polygon.boundary.interpolate(site.polygon.boundary.project(place)))
    junction = place if gap > 0.01 and not site.polygon.contains(place) else on
    number = _number(bearing)
    if number is None:
        direction = inward(site.polygon, on)
    else:
        angle = math.radians(number)
        direction = (math.sin(angle), math.cos(angle))
    return AccessPoint((on.x, on.y), (junction.x, junction.y), direction)


def inward(polygon: Polygon, place: Point) -> tuple[float, float]:
    """Give the direction square to the boundary into the site.

    Parameters
    ----------
    polygon
        The site.
    place
        Point on its boundary.

    Returns
    -------
    tuple of float
        Unit vector.
    """
    tx, ty = boundary_tangent(polygon, place)
    left = Point(place.x - ty, place.y + tx)
    right = Point(place.x + ty, place.y - tx)
    return (-ty, tx) if polygon.distance(left) <= polygon.distance(right) else (ty, -tx)


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""
