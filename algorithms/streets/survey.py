"""What the ground says about every edge of a candidate mesh: street, wall, barred or free."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from ..errors import InputError
from ..mesh import QuadMesh
from ..network.problem import BoolArray, FloatArray, IntArray
from ..network.specification import Specification
from ..site.types import AccessPoint, Site
from .adopt import existing_lines, right_of_way
from .earlier import start_levels
from .preferences import Preferences, check_elevation, edge_prices
from .wishes import NEVER, TOUCH, Whole, Wishes, nearest_vertex, required_edges, sink_vertex

#: A street is carried on to a centre line over at most this many times the snap distance.
CARRY = 1.5
#: No street ends at the edge of the site further than this from where a street runs (metres).
BEYOND = 6.0
#: A new street this near to an existing one runs beside it (metres).
BESIDE = 8.0
#: Length of an edge on foreign ground that is let pass (metres), and at its end on the
#: outline (mesh edge lengths).
FOREIGN, FOREIGN_TIP = 1.5, 0.3


@dataclass(frozen=True, eq=False)
class Ground:
    """A site as seen from the edges (e) and vertices (n) of its candidate mesh.

    Attributes
    ----------
    site, mesh
        The site and its mesh.
    street
        Shape (e,). Boundary edges along existing streets, and kept streets inside.
    barred
        Shape (e,). Edges where no street may run: walls, obstacles, foreign ground,
        forbidden places.
    required
        Shape (e,). Edges that must be streets.
    sinks
        Shape (n,). Vertices where traffic leaves.
    arrivals
        Boundary vertex -> the access point that it meets.
    green_faces
        Faces that lie mostly on obstacles: they need no street.
    forbidden
        Where the planner wants no street, besides obstacles; may be empty.
    closed
        Shape (e,). Edges at which a block may end without a street: walls, obstacles, foreign
        ground and forbidden places, but not the edges that would only lead to a wall.
    exits
        Given sink -> the vertex that stands for it.
    preferences
        Where streets are wanted more or less.
    prices
        Shape (e,). Factors on the cost of streets that follow from the preferences.
    start
        Shape (e,). Level of the street of an earlier design along each edge, see `start_levels`.
    whole
        The site of which this is a sub-region; None where it is all of it.
    required_by
        Shape (e,). The level by which a required edge must be a street; None for the first.
    """

    site: Site
    mesh: QuadMesh
    street: BoolArray
    barred: BoolArray
    required: BoolArray
    sinks: BoolArray
    arrivals: dict[int, AccessPoint]
    green_faces: frozenset[int]
    forbidden: shapely.Geometry
    closed: BoolArray
    exits: dict[tuple[float, float], int] = field(default_factory=dict)
    preferences: Preferences = field(default_factory=Preferences)
    prices: FloatArray | None = None
    start: IntArray | None = None
    whole: Whole | None = None
    required_by: IntArray | None = None

    def required_at(self, level: int) -> BoolArray:
        """Shape (e,). Edges that must be streets once a level is designed."""
        if self.required_by is None:
            return self.required
        return self.required & (self.required_by <= level)

    @property
    def free(self) -> BoolArray:
        """Shape (e,). Edges that may be chosen, before pruning."""
        return ~self.street & ~self.barred & ~self.mesh.boundary_edges

    @property
    def walls(self) -> BoolArray:
        """Shape (e,). Boundary edges without a street."""
        return self.mesh.boundary_edges & ~self.street


def arriving_streets(site: Site, spacing: float) -> list[AccessPoint]:
    """Choose the access points that are worth continuing, no two nearer than `spacing`.

    The one that meets the boundary most squarely goes first; ties by position, so that the
    choice does not depend on the order of the layer.
    """
    rings = [site.polygon.exterior, *site.polygon.interiors]
    rated = []
    for point in site.access_points:
        here = Point(point.xy)
        ring = min(rings, key=here.distance)
        along = ring.project(here)
        a, b = (
            np.array(ring.interpolate((along + d) % ring.length).coords[0]) for d in (-5.0, 5.0)
        )
        tangent = (b - a) / (np.hypot(*(b - a)) or 1.0)
        square = abs(float(tangent[0] * point.direction[1] - tangent[1] * point.direction[0]))
        rated.append((-round(square, 3), point.xy, point))
    chosen: list[AccessPoint] = []
    for _, _, point in sorted(rated, key=lambda item: item[:2]):
        if all(math.dist(point.xy, other.xy) >= spacing for other in chosen):
            chosen.append(point)
    return chosen


def survey(
    site: Site,
    mesh: QuadMesh,
    spec: Specification,
    *,
    attracted: Sequence[AccessPoint] = (),
    wishes: Wishes | None = None,
    adopted: BoolArray | None = None,
) -> Ground:
    """Read from a site what each edge and vertex of its mesh is.

    Parameters
    ----------
    site
        The site.
    mesh
        Its candidate mesh.
    spec
        Decides which vertices are sinks.
    attracted
        The access points to which `mesh.attracted` refers.
    wishes
        Given sinks, required and forbidden places.
    adopted
        Shape (e,). Inner edges that lie on existing streets.

    Raises
    ------
    InputError
        If a sink lies outside the site or on an obstacle, a required line on forbidden
        ground, or if no sink is left.
    """
    wishes = wishes or Wishes()
    check_elevation(site, wishes.preferences)
    street = mesh.boundary_edges & (
        _along_frontage(site, mesh) | np.full(len(mesh.edges), spec.sink_mode == "boundary")
    )
    if adopted is not None:
        street |= adopted
    forbidden = shapely.union_all(np.array([*wishes.forbidden], dtype=object))
    # a forbidden line has no width: to cross it at all is too much
    blocked = _overlaps(mesh, site.obstacle_union, TOUCH) | _overlaps(mesh, forbidden, 0.0)
    barred = (_foreign(site, mesh) | blocked) & ~street
    closed = (barred | mesh.boundary_edges) & ~street
    arrivals = {v: attracted[i] for v, i in mesh.attracted.items() if i < len(attracted)}
    exits = _exits(site, mesh, wishes) if spec.sink_mode == "points" else {}
    ends = _street_ends(site, mesh, spec, street, arrivals)
    ends[list(exits.values())] = True
    barred = closed | (_to_walls(mesh, ends) & ~street)
    if (adopted is not None and adopted.any()) or (site.inner_streets and wishes.given):
        barred |= _beside_streets(site, mesh) & ~street
    required_by = required_edges(site, mesh, barred | mesh.boundary_edges, wishes)
    sinks = _sinks(site, mesh, spec, street, arrivals, exits, wishes)
    return Ground(
        site,
        mesh,
        street,
        barred,
        required_by < NEVER,
        sinks,
        arrivals,
        _green_faces(mesh, site),
        forbidden,
        closed,
        exits,
        wishes.preferences,
        edge_prices(mesh, wishes.preferences, spec.slope_weight),
        start_levels(mesh, wishes.start) if wishes.start else None,
        wishes.whole,
        required_by,
    )


def _along_frontage(site: Site, mesh: QuadMesh) -> BoolArray:
    """Mark boundary edges of which most of the course lies along the street frontage."""
    mark = np.zeros(len(mesh.edges), dtype=np.bool_)
    if site.street_frontage.is_empty:
        return mark
    edges = np.flatnonzero(mesh.boundary_edges)
    near = shapely.buffer(site.street_frontage, 1.0)
    shapely.prepare(near)
    ring = site.polygon.boundary
    shares = np.array([0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 0.9])
    lines = np.array([LineString(mesh.edge_line(int(e))) for e in edges])
    samples = shapely.line_interpolate_point(lines[:, None], shares[None, :], normalized=True)
    # the mesh follows a cleaned outline, up to half an edge length off the true one
    feet = shapely.line_interpolate_point(ring, shapely.line_locate_point(ring, samples))
    reached = shapely.intersects(near, feet)
    reached &= shapely.distance(samples, feet) < 0.5 * mesh.edge_length
    mark[edges] = reached.mean(axis=1) > 0.5
    return mark


def _foreign(site: Site, mesh: QuadMesh) -> BoolArray:
    """Mark edges across foreign ground other than that of existing streets.

    Where an edge ends on the mesh's outline it may leave the site there a little further: the
    mesh follows a cleaned outline, and such ends are trimmed or carried on later.
    """
    ground = shapely.union(site.polygon, right_of_way(site))
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    parts, edge = shapely.get_parts(shapely.difference(lines, ground), return_index=True)
    mark = np.zeros(len(mesh.edges), dtype=np.bool_)
    for part, e in zip(parts, edge.tolist()):
        ends = [v for v in mesh.edges[e].tolist() if mesh.boundary_vertices[v]]
        tip = any(part.distance(Point(mesh.vertices[v])) < 0.01 for v in ends)
        mark[e] |= part.length > (FOREIGN_TIP * mesh.edge_length if tip else FOREIGN)
    return mark


def _street_ends(
    site: Site,
    mesh: QuadMesh,
    spec: Specification,
    street: BoolArray,
    arrivals: dict[int, AccessPoint],
) -> BoolArray:
    """Mark the vertices where a new street may end: on a street, and near its centre line."""
    on_street = np.zeros(len(mesh.vertices), dtype=np.bool_)
    on_street[mesh.edges[street].ravel()] = True
    beside = existing_lines(site)
    if not beside.is_empty and spec.sink_mode != "boundary":
        here = shapely.points(mesh.vertices)
        on_street &= shapely.distance(here, beside) <= CARRY * site.snap_distance
        # a boundary edge may reach beyond the end of the street along it
        edge = site.polygon.boundary
        feet = shapely.line_interpolate_point(edge, shapely.line_locate_point(edge, here))
        on_street &= shapely.distance(feet, site.street_frontage) <= BEYOND
    on_street[list(arrivals)] = True
    return on_street


def _to_walls(mesh: QuadMesh, ends: BoolArray) -> BoolArray:
    """Mark inner edges that end at the outline where no street is: they would lead nowhere."""
    wall = mesh.boundary_vertices & ~ends
    return np.asarray(wall[mesh.edges].any(axis=1) & ~mesh.boundary_edges)


def _beside_streets(site: Site, mesh: QuadMesh) -> BoolArray:
    """Mark edges that run along an existing street inside the mesh for a third of their way."""
    ground = shapely.buffer(existing_lines(site), BESIDE)
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    along = shapely.length(shapely.intersection(lines, ground))
    return np.asarray(along > shapely.length(lines) / 3)


def _overlaps(mesh: QuadMesh, blocked: shapely.Geometry, limit: float) -> BoolArray:
    """Mark edges that run on blocked ground for more than `limit` metres."""
    if blocked.is_empty:
        return np.zeros(len(mesh.edges), dtype=np.bool_)
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    ground = shapely.buffer(blocked, 0.01)
    shapely.prepare(ground)
    hit = shapely.intersects(ground, lines)
    inside = shapely.length(shapely.intersection(lines[hit], ground))
    mark = np.zeros(len(mesh.edges), dtype=np.bool_)
    mark[np.flatnonzero(hit)] = inside > limit
    return mark


def _green_faces(mesh: QuadMesh, site: Site) -> frozenset[int]:
    """Faces of which more than half is obstacle."""
    union = site.obstacle_union
    if union.is_empty:
        return frozenset()
    faces = shapely.polygons(mesh.vertices[mesh.faces])
    covered = shapely.area(shapely.intersection(faces, union))
    return frozenset(np.flatnonzero(covered > 0.5 * shapely.area(faces)).tolist())


def _exits(site: Site, mesh: QuadMesh, wishes: Wishes) -> dict[tuple[float, float], int]:
    """Find the vertex of each given sink."""
    return {
        (float(xy[0]), float(xy[1])): sink_vertex(site, mesh, xy, wishes, i)
        for i, xy in enumerate(wishes.sinks)
    }


def _sinks(
    site: Site,
    mesh: QuadMesh,
    spec: Specification,
    street: BoolArray,
    arrivals: dict[int, AccessPoint],
    exits: dict[tuple[float, float], int],
    wishes: Wishes,
) -> BoolArray:
    """Mark the vertices where traffic leaves."""
    mark = np.zeros(len(mesh.vertices), dtype=np.bool_)
    if spec.sink_mode in ("streets", "boundary"):
        mark[mesh.edges[street].ravel()] = True
        # where the outline was cleaned, the true edge may run through an inner vertex, and so may
        # a street that runs along it on the inner side
        here = shapely.points(mesh.vertices)
        at_edge = shapely.distance(here, site.street_frontage) < 1.0
        beside = shapely.distance(here, site.polygon.boundary) <= site.snap_distance
        at_edge |= beside & (shapely.distance(here, existing_lines(site)) < 1.0)
        mark |= at_edge & ~mesh.boundary_vertices
        remedy = (
            "Add the road layer, enlarge the snap distance so that roads beside the site are "
            "found, or let the whole boundary be the sink."
        )
    elif spec.sink_mode == "access":
        on_street = np.flatnonzero(mesh.boundary_vertices)
        mark[list(arrivals)] = True
        for point in site.access_points:
            near = nearest_vertex(mesh, on_street, point.xy)  # type: ignore[arg-type]
            if math.dist(mesh.vertices[near], point.xy) <= 0.6 * mesh.edge_length:
                mark[near] = True
        remedy = "Give a road layer whose streets reach the site, or choose another sink mode."
    else:
        mark[list(exits.values())] = True
        remedy = "Give sink points inside the site or at its edge."
    # whoever reaches a given street of a level above has arrived (CND section 5.1)
    above = [line for level, lines in wishes.given.items() if level < 4 for line in lines]
    if above:
        given = shapely.union_all(np.array(above, dtype=object))
        on_given = shapely.distance(shapely.points(mesh.vertices), given) < 1.0
        mark |= on_given & mesh.boundary_vertices
    if not mark.any():
        raise InputError(
            "Nowhere does traffic leave this site: there is no sink.",
            remedy,
            layer=site.name,
            feature=site.feature,
        )
    return mark
