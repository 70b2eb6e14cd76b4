"""Where growth begins because the planner or a road from outside says so."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from shapely.geometry import LineString, Point
from shapely.ops import substring

from ...errors import InputError
from ...site.crs import layer_crs, transformer
from ...site.repair import Problems
from .given import GivenNetwork, levels_of
from .legs import Leg, Legs, Sight, widest_gap
from .starts import ARRIVAL, ASKED, AT_NODE, Place, goes_on

#: Fields of a layer of starts that say in which direction the first street leaves.
DIRECTION_FIELDS = ("direction", "bearing_deg", "bearing")
#: Points this near to a junction or end of a street are there (metres).
AT_END = 3.0
#: A street that arrives across the strip beside the edge reaches this much further than the
#: strip is wide, since it may arrive at an angle.
ASKEW = 1.8
#: Streets that cross that strip need so much of it to either side (metres).
BESIDE = 1.0

Shapes = npt.NDArray[Any]
Vector = tuple[float, float]


@dataclass(frozen=True)
class Arrival:
    """A road from outside that reaches the ground, metres in the working CRS.

    Attributes
    ----------
    xy, junction, way
        Where it reaches the edge, where the centre line of the street along the edge, and the
        direction in which it goes on; as in `AccessPoint`.
    kind
        Its road class.
    """

    xy: Vector
    junction: Vector
    way: Vector
    kind: str


class Streets:
    """Finds places on streets.

    Parameters
    ----------
    net
        The streets.
    domain
        Ground that places must lie in, or None for everywhere.
    """

    def __init__(self, net: GivenNetwork, domain: shapely.Geometry | None) -> None:
        self.net, self.domain, self.legs = net, domain, Legs(net)
        self.lines: Shapes = np.asarray(shapely.linestrings(net.nodes[net.ends]), dtype=object)
        self.tree = shapely.STRtree(self.lines) if len(self.lines) else None

    def holds(self, xy: Vector) -> bool:
        """Tell whether a point lies in the domain.

        Parameters
        ----------
        xy
            The point.
        """
        return self.domain is None or bool(shapely.dwithin(self.domain, Point(xy), 1e-6))

    def near(self, xy: Vector, distance: float) -> Vector | None:
        """Find the nearest place on a street, inside the domain.

        Parameters
        ----------
        xy
            A point.
        distance
            Largest distance, metres.
        """
        if self.tree is None:
            return None
        point = Point(xy)
        found = self.tree.query(point, predicate="dwithin", distance=distance)
        feet = shapely.get_coordinates(shapely.shortest_line(point, self.lines[found]))[1::2]
        size = np.hypot(*(feet - xy).T)
        for k in np.lexsort((found, size)).tolist():
            foot: Vector = (float(feet[k, 0]), float(feet[k, 1]))
            if self.holds(foot):
                return foot
        return None

    def behind(self, xy: Vector, way: Vector, distance: float) -> Vector | None:
        """Find the nearest place on a street that a street has come over, inside the domain.

        Parameters
        ----------
        xy, way
            Where it is, and its direction.
        distance
            Largest distance, metres.
        """
        if self.tree is None:
            return None
        back = LineString([xy, (xy[0] - distance * way[0], xy[1] - distance * way[1])])
        hits = shapely.get_coordinates(
            shapely.intersection(self.lines[self.tree.query(back)], back)
        )
        for x, y in sorted(hits.tolist(), key=lambda hit: math.dist(hit, xy)):
            if self.holds((x, y)):
                return x, y
        return None

    def at(self, xy: Vector) -> tuple[Vector, list[Leg]]:
        """Give the streets that leave a place on a street; a node where it is one, nearly.

        Parameters
        ----------
        xy
            The place.
        """
        if self.tree is None:
            return xy, []
        piece = int(self.tree.nearest(Point(xy)))
        ends = self.net.ends[piece]
        gaps = np.hypot(*(self.net.nodes[ends] - xy).T)
        node = int(ends[int(gaps.argmin())])
        if gaps.min() <= (AT_NODE if self.net.bends[node] else AT_END):
            x, y = self.net.nodes[node].tolist()
            return (x, y), self.legs.at(node)
        way = self.net.nodes[ends[1]] - self.net.nodes[ends[0]]
        u, v = (way / np.hypot(*way)).tolist()
        level = int(self.net.levels[piece])
        return xy, [Leg((u, v), level), Leg((-u, -v), level)]

    def clear(self, spot: Vector, xy: Vector) -> bool:
        """Tell whether a street may lead from a place to the next, with ground to both sides.

        Parameters
        ----------
        spot, xy
            The places.
        """
        size = math.dist(spot, xy)
        if self.domain is None or size < 4 * BESIDE:
            return True
        way = LineString([spot, xy])
        way = substring(way, BESIDE, size - BESIDE)
        return bool(shapely.covers(self.domain, way.buffer(BESIDE / 2, cap_style="flat")))


def arrivals(found: Sequence[Arrival], streets: Streets, reach: float) -> list[Place]:
    """Let roads from outside go on.

    Parameters
    ----------
    found
        The roads.
    streets
        The streets of the ground.
    reach
        Width of the strip between the edge of the sites and the streets along it, metres.
    """
    places = []
    levels = levels_of([arrival.kind for arrival in found])
    for arrival, level in zip(found, levels):
        spot = (
            streets.near(arrival.junction, AT_NODE)
            or streets.behind(arrival.xy, arrival.way, ASKEW * reach)
            or streets.near(arrival.xy, reach)
        )
        if spot is not None and not streets.clear(spot, arrival.xy):
            spot = streets.near(arrival.xy, AT_NODE)
        if spot is None:
            if streets.holds(arrival.xy):
                places.append(Place(arrival.xy, arrival.way, level, ARRIVAL, on_street=False))
            continue
        spot, legs = streets.at(spot)
        if not goes_on(legs, arrival.way):
            places.append(Place(spot, arrival.way, level, ARRIVAL))
    return places


def asked_for(
    points: gpd.GeoDataFrame,
    crs: CRS,
    streets: Streets,
    sight: Sight,
    problems: Problems,
    *,
    layer: str,
    snap_distance: float,
    direction: Vector,
) -> list[Place]:
    """Read the places where the planner lets growth begin.

    On a street growth leaves square to it, to both sides where both are open, or in the direction
    given; at its end straight on.

    Parameters
    ----------
    points
        Points in any CRS; the field direction, degrees clockwise from north, may say in which
        direction the first street leaves.
    crs
        Working CRS.
    streets
        The streets of the ground.
    sight
        Measures open ground.
    problems
        Takes the points that cannot be used.
    layer
        Name of the layer.
    snap_distance
        Points this near to a street are on it, points this near to the domain at its edge; metres.
    direction
        Of points beside streets for which the layer gives none.

    Raises
    ------
    InputError
        If the layer has no CRS, or none of its points lies in the domain.
    """
    own = layer_crs(points, layer)
    bearings = _bearings(points)
    shapes = points.geometry if own == crs else points.geometry.to_crs(crs)
    places: list[Place] = []
    outside: list[tuple[object, float]] = []
    for feature, shape, bearing in zip(points.index, shapes.to_numpy(), bearings):
        spots = _spots(shape)
        if not spots:
            what = "it has no geometry" if shape is None or shape.is_empty else "it is no point"
            problems.add(layer, feature, what, "left out", "warning", shape, crs)
        for spot in spots:
            on = _on_ground(spot, streets, snap_distance)
            if on is None:
                gap = float(streets.domain.distance(Point(spot))) if streets.domain else 0.0
                outside.append((feature, gap))
                what = f"the point lies {gap:.0f} m outside of the ground"
                problems.add(
                    layer, feature, what, "left out; move it inside", "warning", Point(spot), crs
                )
                continue
            places.append(_place(*on, bearing, streets, sight, direction))
    if places:
        return places
    if not outside:
        raise InputError(
            "has no point from which streets could grow.",
            "Draw points, or leave the layer out: growth then begins where streets arrive.",
            layer=layer,
        )
    feature, gap = outside[0]
    raise InputError(
        f"the point lies {gap:.0f} m outside of the ground that streets may grow into"
        + (f", and so do the other {len(outside) - 1}." if len(outside) > 1 else "."),
        "Move it inside, see whether the right polygon and coordinate reference systems are "
        "chosen, or leave the layer out.",
        layer=layer,
        feature=feature if isinstance(feature, (int, str)) else str(feature),
    )


def _place(
    spot: Vector,
    on_street: bool,
    bearing: float | None,
    streets: Streets,
    sight: Sight,
    direction: Vector,
) -> Place:
    given = None if bearing is None else unit(bearing)
    if not on_street:
        return Place(spot, given or direction, 0, ASKED, on_street=False)
    spot, legs = streets.at(spot)
    if given is not None:
        return Place(spot, given, -1, ASKED)
    if len(legs) == 1:
        return Place(spot, (-legs[0].way[0], -legs[0].way[1]), -1, ASKED)
    _, way = widest_gap(legs)
    back = (-way[0], -way[1])
    far = sight.from_places(np.array([spot, spot]), np.array([way, back])).tolist()
    # to both sides of a street only the state with which a grammar starts may grow
    both = len(legs) == 2 and min(far) > AT_END
    return Place(spot, way if far[0] >= far[1] or len(legs) > 2 else back, 0 if both else -1, ASKED)


def unit(bearing: float) -> Vector:
    """Turn degrees clockwise from north into a unit vector.

    Parameters
    ----------
    bearing
        Degrees.

    Examples
    --------
    >>> x, y = unit(90)
    >>> round(x, 12), round(y, 12)
    (1.0, 0.0)
    """
    return math.sin(math.radians(bearing)), math.cos(math.radians(bearing))


def _on_ground(spot: Vector, streets: Streets, reach: float) -> tuple[Vector, bool] | None:
    """Bring a point to a street near it, or to the edge of the domain if it lies outside."""
    foot = streets.near(spot, reach)
    if foot is not None:
        return foot, True
    if streets.holds(spot):
        return spot, False
    domain = streets.domain
    if domain is None or domain.distance(Point(spot)) > reach:
        return None
    x, y = shapely.get_coordinates(shapely.shortest_line(domain, Point(spot)))[0].tolist()
    return (x, y), False


def _spots(shape: shapely.Geometry | None) -> list[Vector]:
    """Give the points of a geometry that has nothing but points."""
    if shape is None or shapely.get_type_id(shape) not in (0, 4):
        return []
    xy = shapely.get_coordinates(shape)
    return [(float(x), float(y)) for x, y in xy[np.isfinite(xy).all(axis=1)]]


def _bearings(points: gpd.GeoDataFrame) -> list[float | None]:
    """Read the field of directions, None where it is missing, empty or no number."""
    by_lower = {str(column).lower(): column for column in reversed(list(points.columns))}
    for name in DIRECTION_FIELDS:
        if name in by_lower:
            return [_number(value) for value in points[by_lower[name]]]
    return [None] * len(points)


def _number(value: object) -> float | None:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


def arrivals_of(site: Any, crs: CRS) -> list[Arrival]:
    """Bring the access points of a site to the working CRS of the ground.

    Parameters
    ----------
    site
        A `Site`.
    crs
        Working CRS of the ground.
    """
    move = transformer(site.crs, crs).transform
    found = []
    for point in site.access_points:
        if site.crs == crs:
            found.append(Arrival(point.xy, point.junction, point.direction, point.kind))
            continue
        (x, y), (u, v) = point.xy, point.direction
        (x0, x1, xj), (y0, y1, yj) = move(
            [x, x + u, point.junction[0]], [y, y + v, point.junction[1]]
        )
        size = math.hypot(x1 - x0, y1 - y0)
        found.append(Arrival((x0, y0), (xj, yj), ((x1 - x0) / size, (y1 - y0) / size), point.kind))
    return found
