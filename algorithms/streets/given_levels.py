"""Street levels taken from a layer: given streets divide a site into sub-regions.

CND section 5.1 takes the major roads as given: they cut the ground into sub-regions, and whoever
reaches one of them has arrived. Here any level may be given. Streets of the levels 1 to 3 divide
the site; nothing is designed in the deepest of these levels or above it. Given culs-de-sac
(level 4) divide nothing and stand for those that would be designed.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, Point, Polygon
from shapely.ops import substring

from ..errors import InputError
from ..levels import CUL_DE_SAC
from ..network.problem import FloatArray
from ..progress import Progress
from ..site.types import AccessPoint, BoundaryStreet, Site
from .adopt import existing_lines
from .blocks import GRID, SCRAP
from .joints import NEAR, TOUCHING, Connector, connect, split_at
from .survey import CARRY
from .wishes import TOUCH, Wishes

#: What lies this near to a line is on it (metres).
ON = 0.01
#: Given streets with less inside the site than this lie outside of it; one that is never further
#: from the edge than this runs along it (metres).
LEAST, ALONG = 1.0, 3.0
#: An existing street that arrives this near to the end of a given one goes on into it (metres).
ARRIVES = 15.0
#: Feature ids that a message lists.
LISTED = 5


@dataclass(frozen=True)
class GivenStreet:
    """A piece of a given street inside the site, between two junctions of given streets.

    Attributes
    ----------
    line
        Its course, metres.
    level
        1 major, 2 collector, 3 local, 4 cul-de-sac.
    feature
        Feature id in its layer.
    """

    line: LineString
    level: int
    feature: int | str


@dataclass(frozen=True, eq=False)
class Division:
    """A site that given streets divide.

    Attributes
    ----------
    site
        The whole site.
    streets
        The given streets inside it.
    connectors
        What carries them on to the centre lines of existing streets.
    parts
        The sub-regions as sites of their own, largest first.
    """

    site: Site
    streets: tuple[GivenStreet, ...]
    connectors: tuple[Connector, ...]
    parts: tuple[Site, ...]

    @property
    def deepest(self) -> int:
        """The deepest level that is not designed since it is given, 0 for none."""
        return max((s.level for s in self.streets if s.level < CUL_DE_SAC), default=0)

    @property
    def blind(self) -> bool:
        """Whether culs-de-sac are given."""
        return any(s.level == CUL_DE_SAC for s in self.streets)

    @property
    def lines(self) -> shapely.Geometry:
        """All given streets as one geometry."""
        return shapely.union_all(np.array([s.line for s in self.streets], dtype=object))


def divide(site: Site, wishes: Wishes, progress: Progress) -> Division | None:
    """Divide a site by the given streets; None where none lies in it.

    Parameters
    ----------
    site
        The site.
    wishes
        The given streets by level, their ids and layers.
    progress
        Told which streets are left out or cut off.

    Raises
    ------
    InputError
        If there is no such level, or a given street runs through an obstacle.
    """
    found: list[GivenStreet] = []
    carried: list[Connector] = []
    for level in sorted(wishes.given):
        if level not in (1, 2, 3, 4):
            raise InputError(
                f"Streets of a level {level} cannot be given.",
                "Levels are 1 major, 2 collector, 3 local, 4 cul-de-sac.",
                layer=wishes.given_layer(level),
            )
        own = _of_level(site, wishes, level, [s.line for s in found], progress)
        found += own
        used = {street.feature for street in own}
        for i, line in enumerate(wishes.given[level]):
            if wishes.given_id(level, i) in used:
                carried += _beyond(site, shapely.force_2d(line), level)
    if not found:
        return None
    found = _reaching(site, found)
    streets = _noded(site, found)
    going_on = shapely.union_all(np.array([c.line for c in carried], dtype=object))
    for street in streets:
        course = shapely.get_coordinates(street.line)
        for line in (course[::-1], course):
            end = Point(line[-1])
            if site.polygon.boundary.distance(end) <= ON and not end.dwithin(going_on, ON):
                one = connect(site, line, -1, street.level, None)
                carried += [one] if one is not None else []
    dividing = [s.line for s in streets if s.level < CUL_DE_SAC]
    faces = sorted(_faces(site, dividing), key=lambda face: (-face.area, face.bounds))
    beyond = [c.line for c in carried]
    parts = [_part(site, face, i, len(faces), streets, beyond) for i, face in enumerate(faces)]
    return Division(site, tuple(streets), tuple(carried), tuple(parts))


def _of_level(
    site: Site, wishes: Wishes, level: int, above: Sequence[LineString], progress: Progress
) -> list[GivenStreet]:
    """Given streets of one level inside the site, without what runs on those above."""
    layer = wishes.given_layer(level)
    found: list[GivenStreet] = []
    left: list[int | str] = []
    short: list[int | str] = []
    for i, given in enumerate(wishes.given[level]):
        feature = wishes.given_id(level, i)
        line = shapely.force_2d(given)
        if not np.isfinite(shapely.get_coordinates(line)).all():
            raise InputError(
                "The given street has no usable line.",
                "Repair it or take it out.",
                layer=layer,
                feature=feature,
            )
        inside = shapely.intersection(line, site.polygon)
        edge = shapely.buffer(site.polygon.boundary, ALONG)
        if shapely.length(shapely.difference(inside, edge)) < LEAST:
            left.append(feature)
            continue
        if shapely.length(shapely.intersection(inside, site.obstacle_union)) > TOUCH:
            raise InputError(
                f"The given street of level {level} runs through an obstacle.",
                "Move the street, or take the obstacle out of the obstacle layer.",
                layer=layer,
                feature=feature,
            )
        outside = shapely.difference(line, shapely.buffer(site.polygon, CARRY * site.snap_distance))
        if shapely.length(outside) > TOUCH:
            short.append(feature)
        known = [*above, *(s.line for s in found)]
        doubled = shapely.buffer(shapely.union_all(np.array(known, dtype=object)), 0.5)
        if shapely.length(shapely.intersection(inside, doubled)) > 2.0:
            inside = shapely.difference(inside, doubled)
        merged = inside if inside.geom_type == "LineString" else shapely.line_merge(inside)
        pieces = [p for p in shapely.get_parts(merged) if p.geom_type == "LineString"]
        found += [GivenStreet(p, level, feature) for p in pieces if p.length > LEAST]
    if left:
        progress.warn(
            f"Layer '{layer}': {_named(left)} outside {site.name} or along its edge: left out."
        )
    if short:
        progress.warn(f"Layer '{layer}': {_named(short)} beyond {site.name}: cut off at its edge.")
    return found


def _beyond(site: Site, line: LineString, level: int) -> list[Connector]:
    """Keep what leads from the edge of the site to an existing street, or back over a slot."""
    edge, beside = site.polygon.boundary, existing_lines(site)
    reach = CARRY * site.snap_distance
    outside = shapely.difference(line, site.polygon)
    merged = outside if outside.geom_type == "LineString" else shapely.line_merge(outside)
    found = []
    for part in shapely.get_parts(merged):
        if part.geom_type != "LineString" or part.length <= TOUCHING:
            continue
        on = [edge.distance(Point(xy)) <= ON for xy in (part.coords[0], part.coords[-1])]
        if all(on) and part.length <= 2 * reach:
            met = shapely.get_coordinates(shapely.intersection(part, beside))
            pieces = split_at(part, [(float(x), float(y)) for x, y in met])
            found += [Connector(piece, -1, level) for piece in pieces]
        elif any(on):
            way = part if on[0] else part.reverse()
            met = shapely.get_coordinates(shapely.intersection(way, beside))
            first = min((float(way.project(Point(xy))) for xy in met), default=reach + 1)
            if TOUCHING < first <= reach:
                found.append(Connector(substring(way, 0.0, first), -1, level))
    return found


def _named(features: Sequence[int | str]) -> str:
    """Name features as the subject of a sentence.

    Examples
    --------
    >>> _named([3]), _named([3, 4])
    ('feature 3 runs', 'features 3, 4 run')
    """
    listed = ", ".join(str(f) for f in features[:LISTED])
    more = f" and {len(features) - LISTED} more" if len(features) > LISTED else ""
    return f"feature {listed} runs" if len(features) == 1 else f"features {listed}{more} run"


def _reaching(site: Site, streets: Sequence[GivenStreet]) -> list[GivenStreet]:
    """Let streets that end just short of the edge or of another one reach it.

    Culs-de-sac stay as they are: they may end anywhere.
    """
    edge = site.polygon.boundary
    found = list(streets)
    for i, street in enumerate(found):
        if street.level == CUL_DE_SAC:
            continue
        others = [edge, *(s.line for j, s in enumerate(found) if j != i)]
        goal = shapely.union_all(np.array(others, dtype=object))
        course = shapely.get_coordinates(street.line)
        for _ in range(2):
            course = course[::-1]
            foot = _ahead(course, goal, site)
            if foot is not None:
                course = np.vstack([course, foot])
        if len(course) > shapely.count_coordinates(street.line):
            found[i] = dataclasses.replace(street, line=LineString(course))
    return found


def _ahead(course: FloatArray, goal: shapely.Geometry, site: Site) -> FloatArray | None:
    """Find where a street that stops just short of a goal would meet it."""
    end = course[-1]
    here = Point(end)
    gap = float(here.distance(goal))
    if gap <= ON or gap > NEAR:
        return None
    step = (end - course[-2]) / (np.hypot(*(end - course[-2])) or 1.0)
    ray = LineString([end, end + 2 * gap * step])
    hit = shapely.intersection(ray, goal)
    foot = shapely.get_coordinates(shapely.shortest_line(here, goal if hit.is_empty else hit))[-1]
    way = LineString([end, foot])
    clear = shapely.length(shapely.intersection(way, site.obstacle_union)) <= TOUCH
    return foot if clear and site.polygon.buffer(ON).covers(way) else None


def _noded(site: Site, streets: Sequence[GivenStreet]) -> list[GivenStreet]:
    """Cut given streets where they meet each other and existing streets inside the site."""
    inner = [street.line for street in site.inner_streets]
    found = []
    for i, street in enumerate(streets):
        others = [*inner, *(s.line for j, s in enumerate(streets) if j != i)]
        across = shapely.union_all(np.array(others, dtype=object))
        meeting = shapely.get_coordinates(shapely.intersection(street.line, across))
        ends = shapely.get_coordinates([shapely.boundary(line) for line in others])
        places = [(float(x), float(y)) for x, y in np.vstack([meeting, ends])]
        # one that crosses itself is simple only in pieces
        for whole in shapely.get_parts(shapely.node(street.line)):
            pieces = split_at(whole, places)
            found += [dataclasses.replace(street, line=piece) for piece in pieces]
    return found


def _faces(site: Site, lines: Sequence[LineString]) -> list[Polygon]:
    """Cut the ground of a site along lines."""
    rings = [LineString(r) for r in (site.polygon.exterior, *site.polygon.interiors)]
    noded = shapely.union_all(np.array([*rings, *lines], dtype=object), grid_size=GRID)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    return [
        shapely.geometry.polygon.orient(face)
        for face in faces
        if face.area > SCRAP and site.polygon.contains(face.representative_point())
    ]


def _part(
    site: Site,
    face: Polygon,
    i: int,
    count: int,
    streets: Sequence[GivenStreet],
    beyond: Sequence[LineString],
) -> Site:
    """Make a site of a sub-region; the given streets along it are streets at its edge."""
    ring = face.boundary
    band = shapely.buffer(ring, ON)
    beside, inside = [], []
    for street in streets:
        one = BoundaryStreet(street.line)
        if street.level < CUL_DE_SAC and shapely.length(shapely.intersection(street.line, band)) > (
            0.5 * street.line.length
        ):
            beside.append(one)
        elif face.contains(street.line.interpolate(0.5, normalized=True)):
            inside.append(one)
    for road in site.inner_streets:
        for piece in shapely.get_parts(shapely.intersection(road.line, face)):
            if piece.geom_type == "LineString" and piece.length > LEAST:
                inside.append(dataclasses.replace(road, line=piece))
    ends = [xy for s in streets for xy in (s.line.coords[0], s.line.coords[-1])]
    near = CARRY * site.snap_distance
    given = shapely.union_all(np.array([b.line for b in beside], dtype=object))
    return dataclasses.replace(
        site,
        name=site.name if count == 1 else f"{site.name}, part {i + 1}",
        polygon=face,
        street_frontage=_along(ring, shapely.union(site.street_frontage, given)),
        boundary_streets=(
            *(b for b in site.boundary_streets if b.line.distance(face) <= near),
            *beside,
            *(BoundaryStreet(line) for line in beyond if line.distance(face) <= near),
        ),
        access_points=tuple(
            p
            for p in site.access_points
            if ring.distance(Point(p.xy)) <= 0.5 and all(math.dist(p.xy, e) > ARRIVES for e in ends)
        ),
        inner_streets=tuple(inside),
        obstacles=tuple(
            part
            for obstacle in site.obstacles
            for part in shapely.get_parts(shapely.intersection(obstacle, face))
            if part.geom_type == "Polygon" and part.area > SCRAP
        ),
    )


def _along(ring: shapely.Geometry, lines: shapely.Geometry) -> MultiLineString:
    """Parts of a ring that run on lines."""
    shared = shapely.intersection(ring, shapely.buffer(lines, ON))
    pieces = [p for p in shapely.get_parts(shared) if p.length > 5 * ON]
    merged = shapely.line_merge(MultiLineString(pieces)) if pieces else MultiLineString()
    return MultiLineString([p for p in shapely.get_parts(merged) if p.length > 0])


def across(
    division: Division, part: Site, ends: Sequence[tuple[tuple[float, float], tuple[float, float]]]
) -> list[AccessPoint]:
    """Designed streets of other sub-regions that could go on into one across a given street.

    Parameters
    ----------
    division
        The divided site.
    part
        The sub-region.
    ends
        Ends of designed streets, metres, and unit vectors in which they would go on.
    """
    edge, lines = part.polygon.boundary, division.lines
    found = []
    for xy, way in ends:
        here = Point(xy)
        if here.distance(edge) > 5 * ON or here.distance(lines) > 5 * ON:
            continue
        if part.polygon.contains(Point(xy[0] + way[0], xy[1] + way[1])):
            found.append(AccessPoint(xy, xy, way, kind=ACROSS))
    return found


#: Kind of an access point at which a new street of another sub-region arrives.
ACROSS = "new street across"
