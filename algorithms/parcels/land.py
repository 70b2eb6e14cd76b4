"""A piece of land is parted into blocks by the streets that run through it and along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from shapely.geometry import MultiLineString, Polygon
from shapely.geometry.polygon import orient
from shapely.ops import substring

from ..progress import Progress
from ..site.frontage import frontage
from ..site.repair import POLYGON_TYPE, Problems, overlay, rounded
from ..site.roadnetwork import build_network
from ..site.watch import aside
from .blocklines import NEAR, THIN, closed_edges, without_thin_ends
from .streetspace import GRID, StreetLines, street_space
from .types import Block

#: What goes on here, for those who cancel it.
_WORK = "the land was parted into blocks"
#: Streets up to this far outside the edge of land run on its edge; further out the edge is a
#: property line, from which nothing is taken (metres).
ON_EDGE = 2.0
#: Smaller bits of land between streets belong to them (square metres) ...
CRUMB = 1.0
#: ... and so do strips narrower than this in the mean (metres).
STRIP = 0.75
#: Streets on less of its edge do not run along it (share).
ALONG = 0.05

#: Where land has access along its edge: along the streets of the layer; everywhere; nowhere.
Edge = Literal["streets", "open", "closed"]


@dataclass(frozen=True)
class Place:
    """Where land is from.

    Attributes
    ----------
    crs
        Working CRS, in metres.
    site_id
        Number of the site, from 1; 0 where there is none.
    feature
        Id of the feature.
    """

    crs: CRS
    site_id: int = 0
    feature: str = ""


@dataclass(frozen=True)
class Land:
    """A piece of ground.

    Attributes
    ----------
    polygon
        Valid, metres.
    place
        Where it is from.
    frontage
        Where its edge is the property line along a street: lines on its rings.
    obstacles
        What parcels may not cover.
    """

    polygon: Polygon
    place: Place
    frontage: shapely.Geometry
    obstacles: Sequence[Polygon] = ()


@dataclass
class Parted:
    """Blocks, thin land and street space as they come, each with where it is from."""

    layer: str
    problems: Problems
    blocks: list[tuple[Block, Place]] = field(default_factory=list)
    thin: list[tuple[Polygon, Place]] = field(default_factory=list)
    space: list[tuple[shapely.Geometry, Place]] = field(default_factory=list)


def part_land(
    land: Land,
    streets: StreetLines | None,
    drawn: shapely.Geometry | None,
    found: Parted,
    progress: Progress | None = None,
) -> None:
    """Part land into blocks.

    Parameters
    ----------
    land
        The land.
    streets
        Noded streets around, or None where nothing is to be taken off.
    drawn
        Lines without access, or None.
    found
        Takes the blocks, from north to south, and what else comes of it.
    progress
        Asked for cancellation.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    rest: Any = land.polygon
    free: Any = Polygon()
    if land.obstacles:
        rest = overlay(shapely.difference, rest, shapely.union_all(list(land.obstacles)))
    if streets is not None:
        space, free = _space(land.polygon, streets, progress)
        rest = overlay(shapely.difference, rest, space)
    solid, thin, scraps = _pieces(rest, STRIP if streets is not None else 0.0)
    place = land.place
    for end in _in_order(thin):
        what = f"{end.area:.0f} m2 are narrower than {THIN:g} m"
        crs = place.crs
        found.problems.add(found.layer, place.feature, what, "left as a green", "info", end, crs)
        found.thin.append((end, place))
    polygons = np.array(_in_order(solid), dtype=object)
    if len(polygons):
        # strips between a block and street space belong to that, and do not part them
        strips = [own for own in scraps if shapely.dwithin(own, free, NEAR)]
        access = shapely.union_all([free, land.frontage, *strips])
        closed = closed_edges(polygons, access, drawn)
        found.blocks += [(Block(own, shut), place) for own, shut in zip(polygons, closed)]
    if streets is not None:
        taken = shapely.union_all([*polygons, *thin, *land.obstacles])
        left = overlay(shapely.difference, land.polygon, taken)
        if shapely.area(left) > GRID:
            parts = shapely.get_parts(left)
            parts = parts[shapely.get_type_id(parts) == POLYGON_TYPE]
            found.space.append((shapely.multipolygons(parts), place))


def _pieces(rest: shapely.Geometry, least: float) -> tuple[list[Any], list[Any], list[Any]]:
    """Part what streets leave into blocks, thin land, and strips narrower than `least`."""
    solid: list[Any] = []
    thin: list[Any] = []
    for part in _polygons(rest):
        own, ends = without_thin_ends(part)
        solid += own
        thin += ends
    large = [piece for piece in _polygons(solid) if piece.area > CRUMB]
    small = [piece for piece in _polygons(solid) if piece.area <= CRUMB]
    thin = list(_polygons(thin))
    worth = [own.area > CRUMB and 2.0 * own.area > least * own.length for own in thin]
    greens = [own for own, yes in zip(thin, worth) if yes]
    return large, greens, [*small, *(own for own, yes in zip(thin, worth) if not yes)]


def _polygons(geometry: Any) -> npt.NDArray[Any]:
    """Give the polygons of geometries, on the grid."""
    parts = shapely.get_parts(rounded(shapely.get_parts(shapely.get_parts(geometry))))
    return np.asarray(parts[shapely.get_type_id(parts) == POLYGON_TYPE])


def edge_frontage(polygon: Polygon, streets: StreetLines, edge: Edge, snap: float) -> Any:
    """Give the parts of the edge of land that are the property line along a street.

    Parameters
    ----------
    polygon
        The land.
    streets
        Streets around, some perhaps in it.
    edge
        See `Edge`.
    snap
        Largest distance of a centre line from the edge, metres.
    """
    if edge != "streets":
        return shapely.boundary(polygon) if edge == "open" else MultiLineString()
    window = shapely.box(*(np.array(polygon.bounds) + snap * np.array([-2, -2, 2, 2])))
    near = np.flatnonzero(streets.access & shapely.intersects(window, streets.lines))
    inner = shapely.buffer(polygon, -ON_EDGE, join_style="mitre")
    outer = shapely.get_parts(overlay(shapely.difference, streets.lines[near], inner))
    outer = outer[shapely.length(outer) > GRID]
    none = np.full(len(outer), "", dtype=object)
    network = build_network(outer, none, none)
    return frontage(polygon, network, snap).stretches if len(network.lines) else MultiLineString()


def no_street_along(polygon: Polygon, streets: StreetLines, along: shapely.Geometry) -> bool:
    """Tell whether no street runs along the edge of land, though some run in it.

    Parameters
    ----------
    polygon
        The land.
    streets
        Streets around.
    along
        What `edge_frontage` found.
    """
    if not shapely.is_empty(along):
        return False
    near = streets.lines[shapely.dwithin(streets.lines, polygon, ON_EDGE)]
    on_edge = shapely.intersection(
        shapely.boundary(polygon), shapely.buffer(shapely.union_all(near), ON_EDGE)
    )
    return len(near) > 0 and float(on_edge.length) < ALONG * float(polygon.length)


def _space(
    polygon: Polygon, streets: StreetLines, progress: Progress | None
) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Street space on land, and the part of it that gives access."""
    zone = shapely.buffer(polygon, ON_EDGE, join_style="mitre", mitre_limit=3.0)
    shapely.prepare(zone)
    own = streets.take(shapely.intersects(zone, streets.lines))
    if len(own.lines) == 0:
        return Polygon(), Polygon()
    parts, origin = shapely.get_parts(
        overlay(shapely.intersection, own.lines, zone), return_index=True
    )
    line = (shapely.get_type_id(parts) == 1) & (shapely.length(parts) > 10 * GRID)
    whole = own.lines[origin[line]]
    own = own.with_lines(parts[line], origin[line])
    if len(own.lines) == 0:
        return Polygon(), Polygon()
    lines, free = _through_the_edge(own, whole, polygon)
    own = own.with_lines(lines, np.arange(len(lines)))
    areas, serves = street_space(own, free)
    space = aside(shapely.union_all, areas, progress, work=_WORK)
    open_space = (
        space if own.access.all() else aside(shapely.union_all, areas[serves], progress, work=_WORK)
    )
    return (
        overlay(shapely.intersection, space, polygon),
        overlay(shapely.intersection, open_space, polygon),
    )


def _through_the_edge(
    streets: StreetLines, whole: npt.NDArray[Any], polygon: Polygon
) -> tuple[npt.NDArray[Any], npt.NDArray[np.bool_]]:
    """Draw the ends of streets at the edge of land through it, so that no sliver stays.

    `whole` are the lines that the streets are pieces of, shape (n,). Returns the lines, and which
    of their ends are inside the land, shape (n, 2).
    """
    ends = [shapely.get_point(streets.lines, at) for at in (0, -1)]
    xy = np.stack([shapely.get_coordinates(own) for own in ends], axis=1)
    inner = shapely.buffer(polygon, -ON_EDGE, join_style="mitre")
    shapely.prepare(inner)
    inside = np.stack([shapely.intersects(inner, own) for own in ends], axis=1)
    key = np.round(xy / GRID).reshape(-1, 2)
    _, number, count = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    lone = (count[number.ravel()] == 1).reshape(-1, 2)
    longer = lone & ~inside
    lines = streets.lines.copy()
    for at in np.flatnonzero(longer.any(axis=1)).tolist():
        reach = 5.0 * float(streets.half[at]) + ON_EDGE
        points = shapely.get_coordinates(lines[at])
        # the piece may run against the line that it is of
        low, high = (whole[at].project(shapely.Point(own)) for own in (points[0], points[-1]))
        along = whole[at] if low <= high else shapely.reverse(whole[at])
        for last in np.flatnonzero(longer[at]).tolist():
            turned = points[::-1] if last == 0 else points
            way = shapely.reverse(along) if last == 0 else along
            more = _onward(turned, way, reach, polygon)
            points = np.vstack([turned, more])[::-1] if last == 0 else np.vstack([turned, more])
        lines[at] = shapely.linestrings(points)
    return lines, inside


def _onward(points: Any, whole: shapely.Geometry, reach: float, polygon: Polygon) -> Any:
    """Give the vertices with which a piece of a line goes on beyond its last vertex.

    It follows the line that it is a piece of, and then goes straight on. Where the line ends
    there itself, it goes on only if it leaves the land.
    """
    start = whole.project(shapely.Point(points[-1]))
    rest = whole.length - start
    more = points[:0]
    if rest > 2 * GRID:
        more = shapely.get_coordinates(substring(whole, start, start + min(rest, reach)))[1:]
    if rest < reach:
        before, end = np.vstack([points, more])[-2:]
        way = (end - before) / max(float(np.hypot(*(end - before))), 1e-9)
        beyond = end + way * (reach - max(rest, 0.0))
        leaves = shapely.Point(end + way * 3.0 * ON_EDGE).distance(polygon) > 0.5 * ON_EDGE
        if rest > 2 * GRID or leaves:
            more = np.vstack([more, beyond])
    return more


def _in_order(polygons: list[Any]) -> list[Any]:
    """Polygons counter-clockwise, from north to south and from west to east."""
    return sorted(
        (orient(own) for own in polygons),
        key=lambda own: (-round(own.centroid.y, 1), round(own.centroid.x, 1)),
    )
