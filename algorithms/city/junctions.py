"""Junctions planned along the roads between sub-regions, so that streets of both sides meet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon

from ..progress import Progress
from ..site.watch import ask
from .faces import ON
from .roads import Lines
from .rules import CityRules
from .types import DESIGN, DividingRoad, PlannedJunction, SubRegion

XY = tuple[float, float]

#: A street that ends this near to a road meets it (metres).
MEETS = 1.0
#: Two junctions on a road are at least this share of the wished spacing apart.
LEAST_SPACING = 0.45
#: The other carriageway of a road is no further than this (metres).
ACROSS = 45.0
#: A sub-region is beside a junction where its edge is as near as this (metres).
BESIDE = 0.05
#: Length over which the direction of an edge is taken (metres).
SHORT = 2.0


@dataclass(eq=False)
class _Chain:
    """A road between two junctions of major roads, with the places chosen on it.

    Attributes
    ----------
    line
        Its course.
    name
        Its name.
    taken
        Distance along it -> what is there: "existing", "planned", or "paired" (across another
        carriageway).
    """

    line: LineString
    name: str
    taken: dict[float, str] = field(default_factory=dict)


def plan_junctions(
    regions: Sequence[SubRegion],
    roads: Sequence[DividingRoad],
    street_space: shapely.Geometry,
    minor: Lines,
    rules: CityRules,
    progress: Progress,
) -> list[PlannedJunction]:
    """Plan the junctions along every road that gives access to a sub-region.

    Places where streets meet the road today are kept first; stretches between them that are
    longer than one and a half times the wished spacing get new ones. Both sides are given the
    same places. Where the road has two carriageways, each place has its pair straight across.

    Parameters
    ----------
    regions
        The sub-regions.
    roads
        The roads between them.
    street_space
        Ground between carriageways.
    minor
        Streets as they are, metres; those that meet a road mark places.
    rules
        Wished spacing.
    progress
        Asked for cancellation.

    Returns
    -------
    list of PlannedJunction
        Numbered from 1, in the order of the roads, the longest first.
    """
    active = [r for r in regions if r.state == DESIGN]
    if not active:
        return []
    sides = _Sides(active)
    chains = _chains(roads, sides)
    tree = shapely.STRtree([chain.line for chain in chains])
    streets = shapely.STRtree(minor)
    cuts = [road for road in roads if road.new]
    found: list[PlannedJunction] = []
    for chain in chains:
        ask(progress)
        corners = _corners(chain.line, cuts)
        for at in [*corners, *_met(chain.line, minor, streets)]:
            _take(chain, at, "existing", rules.spacing)
        _fill(chain, rules.spacing)
        for at, kind in sorted(chain.taken.items()):
            if kind == "paired":
                continue
            here = chain.line.interpolate(at)
            xy = (float(here.x), float(here.y))
            own = dict.fromkeys(sides.at(xy), xy)
            for number in _at_corner(xy, own, cuts, active):
                own.pop(number)
            pair = sides.across(xy, street_space, own)
            if pair is not None and _reserve(pair[1], chains, tree, rules.spacing):
                own[pair[0]] = pair[1]
            if own:
                found.append(PlannedJunction(len(found) + 1, kind, chain.name, own))
    return found


class _Sides:
    """Which sub-regions lie beside a place on a road."""

    def __init__(self, regions: Sequence[SubRegion]) -> None:
        self.numbers = [r.number for r in regions]
        self.rings = np.array([r.polygon.boundary for r in regions], dtype=object)
        self.frontage = np.array([r.frontage for r in regions], dtype=object)
        self.ring_tree = shapely.STRtree(self.rings)
        self.tree = shapely.STRtree(self.frontage)

    def at(self, xy: XY) -> list[int]:
        """Return the sub-regions whose edge runs through a place."""
        near = self.ring_tree.query(Point(xy), predicate="dwithin", distance=BESIDE)
        return sorted(self.numbers[i] for i in near.tolist())

    def across(self, xy: XY, space: shapely.Geometry, own: Iterable[int]) -> tuple[int, XY] | None:
        """Return the sub-region across the other carriageway, and the place on its edge."""
        known = set(own)
        if space.is_empty or len(known) != 1 or space.distance(Point(xy)) > ON:
            return None
        here = Point(xy)
        best: tuple[float, int, XY] | None = None
        ground = shapely.buffer(space, 2 * ON)
        for i in sorted(self.tree.query(here, predicate="dwithin", distance=ACROSS).tolist()):
            if self.numbers[i] in known:
                continue
            way = shapely.shortest_line(here, self.frontage[i])
            if way.length < BESIDE or not ground.covers(way):
                continue
            end = way.coords[-1]
            if best is None or way.length < best[0] - 1e-6:
                best = (way.length, self.numbers[i], (float(end[0]), float(end[1])))
        return None if best is None else (best[1], best[2])


def _chains(roads: Sequence[DividingRoad], sides: _Sides) -> list[_Chain]:
    """Merge pieces of road into chains between junctions, the longest first."""
    pieces = [road for road in roads if not road.closed and road.line.length > 0]
    near = shapely.distance(
        np.array([r.line.interpolate(0.5, normalized=True) for r in pieces], dtype=object),
        shapely.union_all(sides.frontage),
    )
    pieces = [road for road, gap in zip(pieces, near.tolist()) if gap <= BESIDE]
    old = [road.line for road in pieces if not road.new]
    merged = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(old))) if old else []
    lines = [*merged, *(road.line for road in pieces if road.new)]
    tree = shapely.STRtree([road.line for road in pieces])
    found = []
    for line in lines:
        middle = line.interpolate(0.5, normalized=True)
        at = tree.query(middle, predicate="dwithin", distance=BESIDE)
        name = min((pieces[i].name for i in at.tolist() if pieces[i].name), default="")
        coords = line.coords if line.coords[0] <= line.coords[-1] else line.coords[::-1]
        found.append(_Chain(LineString(coords), name))

    def key(chain: _Chain) -> tuple[float, ...]:
        first = chain.line.coords[0]
        return (-round(chain.line.length, 1), round(first[0], 1), round(first[1], 1))

    return sorted(found, key=key)


def _met(line: LineString, minor: Lines, tree: shapely.STRtree) -> list[float]:
    """Where streets meet a road today, as distances along it; crossings before T-junctions."""
    arms: dict[float, int] = {}
    for i in np.sort(tree.query(line, predicate="dwithin", distance=MEETS)).tolist():
        street = minor[i]
        ends = shapely.get_coordinates(street)[[0, -1]]
        places = [Point(xy) for xy in ends if line.distance(Point(xy)) <= MEETS]
        weight = 1
        if not places:
            crossing = shapely.intersection(line, street)
            places = [p for p in shapely.get_parts(crossing) if p.geom_type == "Point"]
            weight = 2
        for place in places:
            at = round(float(line.project(place)), 1)
            arms[at] = arms.get(at, 0) + weight
    return sorted(arms, key=lambda at: (-min(arms[at], 2), at))


def _corners(line: LineString, cuts: Sequence[DividingRoad]) -> list[float]:
    """Where new collectors meet a road, as distances along it."""
    ends = [Point(xy) for cut in cuts for xy in (cut.line.coords[0], cut.line.coords[-1])]
    return sorted(
        float(line.project(end))
        for end in ends
        if line.distance(end) <= MEETS and 1.0 < line.project(end) < line.length - 1.0
    )


def _at_corner(
    xy: XY, own: Iterable[int], cuts: Sequence[DividingRoad], regions: Sequence[SubRegion]
) -> list[int]:
    """Return the sub-regions that only have a corner at a place, between a road and a cut."""
    here, polygons = Point(xy), {r.number: r.polygon for r in regions}
    found = []
    for cut in cuts:
        for line in (cut.line, shapely.reverse(cut.line)):
            if Point(line.coords[0]).distance(here) > MEETS:
                continue
            along = line.interpolate(min(5.0, 0.5 * line.length))
            found += [n for n in own if polygons[n].boundary.distance(along) <= BESIDE]
    return sorted(set(found))


def _take(chain: _Chain, at: float, kind: str, spacing: float) -> bool:
    """Choose a place on a road unless it is too near to its ends or to another place."""
    least = LEAST_SPACING * spacing
    closed = chain.line.is_ring
    if not closed and not least <= at <= chain.line.length - least:
        return False
    if any(abs(at - other) < least for other in chain.taken):
        return False
    chain.taken[at] = kind
    return True


def _fill(chain: _Chain, spacing: float) -> None:
    """Plan places in gaps that are too long."""
    stops = [0.0, *sorted(chain.taken), chain.line.length]
    for a, b in zip(stops, stops[1:]):
        pieces = max(1, round((b - a) / spacing))
        for i in range(1, pieces):
            chain.taken[a + (b - a) * i / pieces] = "planned"


def _reserve(xy: XY, chains: Sequence[_Chain], tree: shapely.STRtree, spacing: float) -> bool:
    """Choose the place across on the other carriageway, if nothing is near it yet."""
    here = Point(xy)
    for i in sorted(tree.query(here, predicate="dwithin", distance=BESIDE).tolist()):
        chain = chains[i]
        return _take(chain, float(chain.line.project(here)), "paired", spacing)
    return False


def inward(polygon: Polygon, xy: XY) -> XY:
    """Return the unit vector that leads square to the edge into a polygon.

    Parameters
    ----------
    polygon
        The ground.
    xy
        A place on its edge, metres.

    Examples
    --------
    >>> from shapely.geometry import box
    >>> inward(box(0, 0, 10, 10), (5.0, 0.0))
    (0.0, 1.0)
    """
    here = Point(xy)
    rings = [polygon.exterior, *polygon.interiors]
    ring = min(rings, key=here.distance)
    at = ring.project(here)
    a = ring.interpolate((at - SHORT) % ring.length)
    b = ring.interpolate((at + SHORT) % ring.length)
    dx, dy = float(b.x - a.x), float(b.y - a.y)
    size = math.hypot(dx, dy) or 1.0
    left = (-dy / size, dx / size)
    inside = polygon.contains(Point(xy[0] + left[0], xy[1] + left[1]))
    way = left if inside else (-left[0], -left[1])
    return (way[0] + 0.0, way[1] + 0.0)
