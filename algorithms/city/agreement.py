"""Where streets of two sub-regions meet the road between them: one junction, or how far apart."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon

from .junctions import ACROSS, inward
from .region import ends_at_edge, line_of
from .types import City, PlannedJunction

XY = tuple[float, float]

#: Kinds of places where streets meet the roads between sub-regions.
CROSSING, ALONE, STAGGERED, UNUSED = "crossing", "T-junction", "staggered", "not used"
#: Two ends are on the same carriageway if they are no further apart across it (metres).
SAME_ROAD = 3.0
#: Length of street that follows an end that is moved (metres).
BENDS = 60.0


@dataclass(frozen=True)
class Meeting:
    """A place where streets of one sub-region or of several meet a road between them.

    Attributes
    ----------
    sides
        Number of a sub-region -> where its streets end, metres.
    planned
        The junction that was planned there, or None.
    state
        "crossing" (streets of two sub-regions), "T-junction" (of one), "staggered" (of one, with
        an end of another sub-region nearby), or "not used".
    offset
        Distance along the road to the nearest end of another sub-region, metres; None where
        there is none nearby.
    """

    sides: Mapping[int, XY]
    planned: PlannedJunction | None
    state: str
    offset: float | None = None


@dataclass(frozen=True)
class Agreement:
    """How far the streets of neighbouring sub-regions agree.

    Attributes
    ----------
    streets
        Number of a sub-region -> its streets, the ends on roads moved onto common junctions.
    meetings
        All places, the planned ones first.
    links
        Pieces across the middle of roads with two carriageways, and the name of the road.
    moved
        Greatest distance by which an end was moved, metres.
    """

    streets: Mapping[int, list[dict[str, Any]]]
    meetings: tuple[Meeting, ...]
    links: tuple[tuple[LineString, str], ...]
    moved: float

    def count(self, state: str) -> int:
        """Return how many places have a state."""
        return sum(m.state == state for m in self.meetings)

    @property
    def share(self) -> float:
        """Share of the used places that are crossings or keep their distance, 0 to 1.

        NaN where none is used.
        """
        used = [m for m in self.meetings if m.state != UNUSED]
        return sum(m.state != STAGGERED for m in used) / len(used) if used else math.nan


@dataclass
class _End:
    """The end of a street on the edge of its sub-region."""

    region: int
    street: int
    which: int
    xy: XY
    planned: int | None = None


def settle(city: City, streets: Mapping[int, Sequence[Mapping[str, Any]]]) -> Agreement:
    """Let the streets of neighbouring sub-regions meet, and say where they do not.

    Ends near a planned junction are moved onto it, then ends of two sub-regions that are nearer
    than the tolerance onto each other. Nothing else is moved.

    Parameters
    ----------
    city
        The divided city.
    streets
        Number of a sub-region -> its streets as `region.design_region` gives them.
    """
    own = {number: [dict(s) for s in rows] for number, rows in sorted(streets.items())}
    ends = _ends(city, own)
    moved = _to_planned(city, own, ends)
    groups = _groups(city, own, ends)
    moved = max([moved, *(g[1] for g in groups)])
    meetings = _meetings(city, ends, [g[0] for g in groups])
    links = []
    for meeting in meetings:
        places = list(dict.fromkeys(meeting.sides.values()))
        if meeting.state == CROSSING and len(places) == 2:
            road = "" if meeting.planned is None else meeting.planned.road
            links.append((LineString(places), road))
    return Agreement(own, tuple(meetings), tuple(links), moved)


def _ends(city: City, streets: Mapping[int, list[dict[str, Any]]]) -> list[_End]:
    """Find the ends of streets on roads that give access."""
    found = []
    for region in city.regions:
        rows = streets.get(region.number)
        if not rows:
            continue
        site = city.site(region)
        for i, which in ends_at_edge(site, rows):
            x, y = rows[i]["xy"][which]
            if region.frontage.distance(Point(x, y)) <= 1.0:
                found.append(_End(region.number, i, which, (float(x), float(y))))
    return found


def _to_planned(
    city: City, streets: Mapping[int, list[dict[str, Any]]], ends: Sequence[_End]
) -> float:
    """Move ends onto the planned junction beside them; return the greatest move."""
    places: dict[int, list[tuple[XY, int]]] = {}
    for k, junction in enumerate(city.junctions):
        for number, xy in junction.sides.items():
            places.setdefault(number, []).append((xy, k))
    moved = 0.0
    for end in ends:
        gap, xy, k = min(
            ((math.dist(end.xy, xy), xy, k) for xy, k in places.get(end.region, [])),
            default=(math.inf, end.xy, -1),
        )
        if gap <= city.rules.tolerance:
            end.planned = k
            moved = max(moved, gap)
            _move(streets, end, xy)
    return moved


def _move(streets: Mapping[int, list[dict[str, Any]]], end: _End, xy: XY) -> None:
    """Put the end of a street somewhere else; what comes before it follows less and less."""
    if end.xy != xy:
        row = streets[end.region][end.street]
        course = np.asarray(row["xy"], dtype=float)
        course = course if end.which else course[::-1]
        steps = np.hypot(*np.diff(course, axis=0).T)
        left = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
        share = np.clip(1.0 - left / min(BENDS, float(left[0])), 0.0, 1.0)
        course = course + share[:, None] * (np.array(xy) - course[-1])
        course[-1] = xy
        row["xy"] = (course if end.which else course[::-1]).tolist()
        row["length_m"] = float(line_of(row).length)
    end.xy = xy


def _groups(
    city: City, streets: Mapping[int, list[dict[str, Any]]], ends: Sequence[_End]
) -> list[tuple[list[_End], float]]:
    """Group ends that no junction was planned for, and move those of a group together.

    Ends straight across on the other carriageway are of the group, too, and stay where they are.
    """
    polygons = {region.number: region.polygon for region in city.regions}
    space = shapely.buffer(city.street_space, 1.0)
    free = [end for end in ends if end.planned is None]
    groups: list[tuple[list[_End], float]] = []
    for end in free:
        best: tuple[float, int] | None = None
        for g, (group, _) in enumerate(groups):
            gap = math.dist(group[0].xy, end.xy)
            across, along = _apart(polygons[group[0].region], group[0].xy, end.xy)
            if across > SAME_ROAD and not (
                along <= SAME_ROAD and space.covers(LineString([group[0].xy, end.xy]))
            ):
                continue
            same = any(e.region == end.region for e in group)
            limit = 0.1 if same else city.rules.tolerance
            if gap <= limit and (best is None or gap < best[0]):
                best = (gap, g)
        if best is None:
            groups.append(([end], 0.0))
            continue
        group, far = groups[best[1]]
        across, _ = _apart(polygons[group[0].region], group[0].xy, end.xy)
        if across <= SAME_ROAD:
            _move(streets, end, group[0].xy)
            far = max(far, best[0])
        groups[best[1]] = ([*group, end], far)
    return groups


def _apart(polygon: Polygon, xy: XY, other: XY) -> tuple[float, float]:
    """Return how far a place is from one on the edge of a polygon: across it, and along it."""
    normal = inward(polygon, xy)
    step = (other[0] - xy[0], other[1] - xy[1])
    return (
        abs(step[0] * normal[0] + step[1] * normal[1]),
        abs(step[0] * normal[1] - step[1] * normal[0]),
    )


def _meetings(city: City, ends: Sequence[_End], free: Sequence[list[_End]]) -> list[Meeting]:
    """Judge all places."""
    sides: list[dict[int, XY]] = [{} for _ in city.junctions]
    for end in ends:
        if end.planned is not None:
            sides[end.planned][end.region] = end.xy
    rows: list[tuple[dict[int, XY], PlannedJunction | None]] = list(zip(sides, city.junctions))
    rows += [({end.region: end.xy for end in group}, None) for group in free]
    places = [(xy, number, r) for r, (own, _) in enumerate(rows) for number, xy in own.items()]
    polygons = {region.number: region.polygon for region in city.regions}
    space = shapely.buffer(city.street_space, 1.0)
    shapely.prepare(space)
    tree = shapely.STRtree([Point(xy) for xy, _, _ in places])
    found = []
    for r, (own, planned) in enumerate(rows):
        if len(own) != 1:
            state = UNUSED if not own else CROSSING
            found.append(Meeting(own, planned, state))
            continue
        ((number, xy),) = own.items()
        offsets = []
        for i in sorted(tree.query(Point(xy), predicate="dwithin", distance=2 * ACROSS).tolist()):
            other, region, row = places[i]
            if row == r or region == number:
                continue
            across, along = _apart(polygons[number], xy, other)
            way = LineString([xy, other])
            if across <= SAME_ROAD or (across <= ACROSS and space.covers(way)):
                offsets.append(along)
        found.append(Meeting(own, planned, *_judged(offsets, city.rules.apart)))
    return found


def _judged(offsets: Sequence[float], apart: float) -> tuple[str, float | None]:
    """Say what the distances to ends of other sub-regions make of a place with one side."""
    offset = min(offsets, default=None)
    if offset is None or offset >= apart:
        return ALONE, offset
    # straight across, on the other carriageway
    return (CROSSING if offset <= SAME_ROAD else STAGGERED), offset
