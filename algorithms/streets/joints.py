"""Where designed streets meet existing ones: trimmed, carried on, and cut at joints."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.ops import substring

from ..network.problem import FloatArray, IntArray
from ..site.carry import carry_to_centre_line
from ..site.types import AccessPoint, Site
from .adopt import existing_lines
from .align import Alignment
from .blocks import reach_edge
from .survey import CARRY, Ground

#: Points nearer than this are one (metres).
TOUCHING = 0.05
#: An end that misses the edge of the site by no more than this is put onto it (metres).
HAIR = 0.2
#: A street that passes the end of an existing one within this distance goes on from it (metres).
TIP = 1.5
#: A street nearer than this to the end of a new one is met in any case (metres).
NEAR = 12.0


def trim_ends(ground: Ground, level: IntArray, alignment: Alignment) -> Alignment:
    """Let streets end where they first meet an existing street, or leave the site.

    The mesh follows a cleaned outline; where that lies beyond the edge of the site, or beyond
    the street at that edge, a street on the mesh would go too far.
    """
    mesh, site = ground.mesh, ground.site
    beside = existing_lines(site)
    tips = shapely.boundary(shapely.line_merge(beside))
    lines, positions = dict(alignment.lines), alignment.positions.copy()
    # a street of the mesh that stands for an existing one may lie a little beside it
    ends = mesh.boundary_vertices | ground.sinks
    ends[mesh.edges[ground.street].ravel()] = True
    ends[[v for v in ground.exits.values() if not mesh.boundary_vertices[v]]] = False
    for v in np.flatnonzero(ends).tolist():
        active = [int(e) for e in mesh.vertex_edges[v] if level[e] > 0]
        if len(active) != 1:
            continue
        e = active[0]
        forward = mesh.edges[e, 1] == v
        line = LineString(lines[e] if forward else lines[e][::-1])
        ahead = [a for a in _crossings(line, beside) if a > 0.25 * line.length]
        tip = _tip(line, tips)
        outside = site.polygon.distance(shapely.Point(line.coords[-1])) > TOUCHING
        if not ahead and outside:
            ahead = _crossings(line, site.polygon.boundary)[-1:]
        if tip is not None:
            kept = np.vstack([shapely.get_coordinates(substring(line, 0.0, tip[0]))[:-1], tip[1]])
        elif ahead and ahead[0] < line.length - TOUCHING:
            kept = shapely.get_coordinates(substring(line, 0.0, ahead[0]))
        else:
            kept = _on_edge(site, shapely.get_coordinates(line))
        lines[e] = kept if forward else kept[::-1]
        positions[v] = kept[-1]
    return dataclasses.replace(alignment, lines=lines, positions=positions)


def _tip(line: LineString, tips: shapely.Geometry) -> tuple[float, tuple[float, float]] | None:
    """Find the end of an existing street just beside the last stretch of a new one.

    The new street then goes on from there, instead of running along it for a few metres.

    Returns
    -------
    tuple or None
        Distance along the line, metres, and the position of that end.
    """
    found = []
    for x, y in shapely.get_coordinates(tips).tolist():
        here = shapely.Point(x, y)
        along = float(line.project(here))
        if line.distance(here) <= TIP and 0.5 * line.length < along:
            found.append((along, (x, y)))
    return min(found, default=None)


def _on_edge(site: Site, line: FloatArray) -> FloatArray:
    """Put the end of a street that misses the edge of the site by a hair onto it.

    Blocks that others polygonize from the layer would otherwise run together there.
    """
    edge = site.polygon.boundary
    here = shapely.Point(line[-1])
    if not 0 < here.distance(edge) <= HAIR:
        return line
    foot = edge.interpolate(edge.project(here))
    return np.vstack([line[:-1], [(foot.x, foot.y)]])


def _crossings(line: LineString, other: shapely.Geometry) -> list[float]:
    """Where a line meets something, as distances along it in ascending order, metres."""
    meeting = shapely.get_coordinates(shapely.intersection(line, other))
    return sorted(float(line.project(shapely.Point(xy))) for xy in meeting)


@dataclass(frozen=True)
class Connector:
    """A piece of street from the property line to the centre line that it meets.

    Attributes
    ----------
    line
        Its course, metres.
    node
        The junction at which it begins, numbered as in `Piece`.
    level
        Level of the street that it carries on.
    arrival
        The existing street that goes on there, if any.
    """

    line: LineString
    node: int
    level: int
    arrival: AccessPoint | None = None


def connectors(ground: Ground, level: IntArray, alignment: Alignment) -> list[Connector]:
    """Carry streets on from the property line to the centre line of the street they meet.

    Where the boundary is the centre line, or no centre line is known, there is none.
    """
    mesh = ground.mesh
    at_street = np.zeros(len(mesh.vertices), dtype=np.bool_)
    at_street[mesh.edges[ground.street].ravel()] = True
    # sinks that no street of the mesh touches lie where the true edge of the site runs through it
    at_edge = ~mesh.boundary_vertices & ground.sinks & ~at_street
    at_edge[list(ground.exits.values())] = False
    beside = existing_lines(ground.site)
    found = []
    for v in np.flatnonzero(at_edge | (mesh.boundary_vertices & at_street)).tolist():
        active = [int(e) for e in mesh.vertex_edges[v] if level[e] > 0]
        if not active:
            continue
        if at_edge[v] and (
            len(active) > 1
            or any(beside.intersects(LineString(alignment.lines[e])) for e in active)
        ):
            continue  # it meets the street already, or passes the edge and goes on
        line = alignment.lines[active[0]]
        line = line if mesh.edges[active[0], 1] == v else line[::-1]
        line = np.vstack([line[:-1], alignment.positions[v]])
        own = int(min(level[e] for e in active))
        one = connect(ground.site, line, v, own, ground.arrivals.get(v))
        if one is not None:
            found.append(one)
    return found


def connect(
    site: Site, line: FloatArray, node: int, level: int, arrival: AccessPoint | None
) -> Connector | None:
    """Carry one street on from its last point, where there is something to meet.

    Parameters
    ----------
    site
        The site.
    line
        Shape (k, 2). The street, ending at the edge of the site.
    node, level, arrival
        See `Connector`.
    """
    beside = existing_lines(site)
    if beside.distance(shapely.Point(line[-1])) <= TOUCHING:
        return None
    way = _way_out(site, line, arrival)
    if way.length <= TOUCHING:
        return None
    return Connector(_to_first(way, beside), node, level, arrival)


def _way_out(site: Site, line: FloatArray, point: AccessPoint | None) -> LineString:
    """Way from the end of a street over the edge of the site to the centre line beyond."""
    points = [tuple(line[-1].tolist())]
    edge = reach_edge(site, points[0], tuple(line[-2].tolist())).coords[-1]
    if site.polygon.contains(shapely.Point(points[0])) and math.dist(edge, points[0]) > 0.1:
        points.append(edge)
    heading = (float(line[-1, 0] - line[-2, 0]), float(line[-1, 1] - line[-2, 1]))
    target = (
        point.junction
        if point is not None
        else carry_to_centre_line(site, points[-1], heading, CARRY * site.snap_distance)
    )
    if target is None:
        target = _nearest(existing_lines(site), points[-1])
    if target is not None and math.dist(points[-1], target) > TOUCHING:
        points.append(target)
    return LineString(points if len(points) > 1 else [points[0], points[0]])


def _nearest(streets: shapely.Geometry, xy: tuple[float, float]) -> tuple[float, float] | None:
    """Find the nearest point of the streets, if it is very near."""
    here = shapely.Point(xy)
    if streets.is_empty or here.distance(streets) > NEAR:
        return None
    foot = shapely.get_coordinates(shapely.shortest_line(here, streets))[-1]
    return (float(foot[0]), float(foot[1]))


def _to_first(way: LineString, streets: shapely.Geometry) -> LineString:
    """Cut a way short at the first street that it meets."""
    start = shapely.Point(way.coords[0])
    meeting = shapely.get_coordinates(shapely.intersection(way, streets))
    ahead = [xy for xy in meeting.tolist() if math.dist(xy, way.coords[0]) > TOUCHING]
    if not ahead:
        return way
    first = min(ahead, key=lambda xy: start.distance(shapely.Point(xy)))
    return LineString([way.coords[0], first])


def split_at(
    line: LineString, points: Sequence[tuple[float, float]], shortest: float = TOUCHING
) -> list[LineString]:
    """Cut a line where points lie on it, into pieces no shorter than `shortest` metres.

    Examples
    --------
    >>> [part.length for part in split_at(LineString([(0, 0), (10, 0)]), [(4, 0), (6, 9)])]
    [4.0, 6.0]
    """
    at = []
    for xy in points:
        point = shapely.Point(xy)
        if line.distance(point) <= TOUCHING:
            at.append(float(line.project(point)))
    cuts = [0.0]
    for a in sorted(at):
        if a - cuts[-1] > shortest and line.length - a > shortest:
            cuts.append(a)
    cuts.append(line.length)
    return [substring(line, a, b) for a, b in zip(cuts, cuts[1:])]
