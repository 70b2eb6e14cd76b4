"""The mesh that a design begins with: the site, cut by the streets that are given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon
from shapely.geometry.polygon import orient

from ..edges import EdgeKind
from .mesh import MeshEdge, StreetMesh

#: An edge whose middle is this near to a line lies on it (metres).
ON_LINE = 0.05
#: Lines whose distances differ by less are equally near (metres).
EQUAL = 1e-6
#: Site edges this near to the centre line of the street along them are that centre line (metres).
ON_CENTRE = 2.0
#: Ends of given streets are drawn on to what lies ahead within this (metres).
REACH = 40.0
#: Ends this near to what they meet have reached it (metres).
THERE = 1e-6
#: Ends go on so far beyond what they meet, so that noding finds the crossing (metres).
BREATH = 1e-3
#: Smaller faces are left-overs of noding (square metres).
SCRAP = 0.01


@dataclass(frozen=True)
class GivenStreet:
    """A street that the planner gives.

    Attributes
    ----------
    line
        Centre line, metres.
    width
        Width of the street, metres.
    name
        Its name, empty where unknown.
    """

    line: LineString
    width: float
    name: str = ""


@dataclass(frozen=True)
class Ground:
    """The ground of a street mesh.

    Attributes
    ----------
    polygon
        Site with holes for what is not to be built on, metres.
    frontage
        Parts of its rings along existing streets; everything else gives no access.
    centre_lines
        Centre lines of these streets; where the ring lies on one, half the street is land of
        the site.
    width
        Width of the existing streets along the edge, metres.
    streets
        Streets through the site that the planner gives.
    """

    polygon: Polygon
    frontage: MultiLineString = field(default_factory=MultiLineString)
    centre_lines: MultiLineString = field(default_factory=MultiLineString)
    width: float = 15.0
    streets: Sequence[GivenStreet] = ()


def begin_mesh(ground: Ground) -> tuple[StreetMesh, list[tuple[shapely.Point, str]]]:
    """Cut the site by the streets that are given.

    Parameters
    ----------
    ground
        See `Ground`.

    Returns
    -------
    mesh
        One region where no street is given. The streets have the numbers 0, 1... of the given
        ones; all edges are fixed.
    problems
        Places and what could not be used there.
    """
    site = orient(ground.polygon)
    rings = [LineString(ring.coords) for ring in (site.exterior, *site.interiors)]
    lines = [reach_on(given.line, k, ground) for k, given in enumerate(ground.streets)]
    cut = [shapely.intersection(line, site) for line in lines]
    if not any(line.length > 0 for line in cut):
        faces = [site]
    else:
        # not as cut: an end that is on the edge but for rounding would not be noded with it
        noded = shapely.union_all([*rings, *lines])
        found = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
        faces = _without_scraps([f for f in found if site.contains(f.representative_point())])
    mesh = _mesh_of([orient(face) for face in faces])
    _tell_edges(mesh, ground, cut)
    return mesh, _unused(mesh, ground, cut)


def _without_scraps(faces: Sequence[Polygon]) -> list[Polygon]:
    """Give faces too small to be a region to the neighbour that they share most with."""
    found = [face for face in faces if face.area > SCRAP]
    for scrap in (face for face in faces if face.area <= SCRAP):
        shared = shapely.length(shapely.intersection(scrap.exterior, np.array(found, dtype=object)))
        home = int(np.argmax(shared)) if len(found) else 0
        whole = shapely.union(found[home], scrap) if len(found) and shared[home] > 0 else None
        if whole is not None and whole.geom_type == "Polygon":
            found[home] = whole
    return found


def reach_on(line: LineString, own: int, ground: Ground) -> LineString:
    """Draw the ends of a given street on to the edge or the street that lies ahead.

    Parameters
    ----------
    line
        The street, metres.
    own
        Its number among those given.
    ground
        The site and the other streets.
    """
    others = [given.line for k, given in enumerate(ground.streets) if k != own]
    stops = shapely.union_all([ground.polygon.boundary, *others])
    vertices = shapely.get_coordinates(stops)
    xy = shapely.get_coordinates(line)
    for end, inner in ((0, 1), (-1, -2)):
        here = shapely.Point(xy[end])
        way = xy[end] - xy[inner]
        if stops.distance(here) < THERE:
            if np.hypot(*(vertices - xy[end]).T).min() > 0:
                xy[end] = xy[end] + way / (np.hypot(*way) or 1.0) * BREATH
            continue
        if not ground.polygon.contains(here):
            continue
        ahead = LineString([xy[end], xy[end] + way / (np.hypot(*way) or 1.0) * REACH])
        hit = shapely.intersection(ahead, stops)
        if not hit.is_empty:
            place = shapely.get_coordinates(shapely.shortest_line(here, hit))[1]
            xy[end] = place + way / (np.hypot(*way) or 1.0) * BREATH
    return LineString(xy)


def _mesh_of(faces: Sequence[Polygon]) -> StreetMesh:
    """Make a mesh of faces that share their vertices."""
    mesh = StreetMesh()
    numbers: dict[tuple[float, float], int] = {}
    places: list[tuple[float, float]] = []
    found: list[list[list[int]]] = []
    for face in faces:
        rings = []
        for ring in (face.exterior, *face.interiors):
            ids: list[int] = []
            for x, y in ring.coords[:-1]:
                if (x, y) not in numbers:
                    numbers[(x, y)] = len(places)
                    places.append((x, y))
                ids.append(numbers[(x, y)])
            rings.append(ids)
        found.append(rings)
    mesh.add_vertices(places)
    for rings in found:
        number = mesh.add_region(rings)
        for a, b in mesh.regions[number].edges():
            mesh.set_edge(a, b, MeshEdge(EdgeKind.CLOSED, fixed=True))
    return mesh


def _tell_edges(mesh: StreetMesh, ground: Ground, cut: Sequence[shapely.Geometry]) -> None:
    """Say what every edge is: a given street, a frontage, or closed."""
    keys = list(mesh.edges)
    ends = mesh.xy[np.array(keys, dtype=int)]
    middles = shapely.points(ends.mean(axis=1))
    street, nearest = np.full(len(keys), -1), np.full(len(keys), ON_LINE)
    for k, line in enumerate(cut):
        if line.length > 0:
            off = shapely.distance(middles, line)
            # two that meet at a point are both near there; the first of two that coincide
            nearer = off < nearest - EQUAL * (street >= 0)
            street[nearer], nearest[nearer] = k, off[nearer]
    fronts = _near(middles, ground.frontage, ON_LINE)
    centred = fronts & _near(middles, ground.centre_lines, ON_CENTRE)
    for at, (a, b) in enumerate(keys):
        if street[at] >= 0:
            given = ground.streets[street[at]]
            edge = MeshEdge(EdgeKind.STREET, int(street[at]), given.width, fixed=True)
        elif centred[at]:
            edge = MeshEdge(EdgeKind.STREET, -1, ground.width, fixed=True)
        else:
            kind = EdgeKind.FRONTAGE if fronts[at] else EdgeKind.CLOSED
            edge = MeshEdge(kind, fixed=True)
        mesh.set_edge(a, b, edge)


def _near(
    points: npt.NDArray[np.object_], lines: shapely.Geometry, distance: float
) -> npt.NDArray[np.bool_]:
    """Tell which points lie near to lines."""
    if lines.is_empty:
        return np.zeros(len(points), dtype=bool)
    return np.asarray(shapely.distance(points, lines) < distance)


def _unused(
    mesh: StreetMesh, ground: Ground, cut: Sequence[shapely.Geometry]
) -> list[tuple[shapely.Point, str]]:
    """Find given streets, or pieces of them, that bound no region."""
    used: dict[int, float] = {}
    for (a, b), edge in mesh.edges.items():
        if edge.street >= 0:
            length = float(np.hypot(*(mesh.xy[a] - mesh.xy[b])))
            used[edge.street] = used.get(edge.street, 0.0) + length
    found = []
    for k, (given, line) in enumerate(zip(ground.streets, cut)):
        lost = line.length - used.get(k, 0.0)
        if line.length == 0:
            where = given.line.interpolate(0.5, normalized=True)
            found.append((where, "the given street lies outside the site and is not used"))
        elif lost > 1.0:
            where = line.representative_point() if hasattr(line, "geoms") else line.centroid
            found.append(
                (where, f"{lost:.0f} m of the given street end in the open and are not used")
            )
    return found
