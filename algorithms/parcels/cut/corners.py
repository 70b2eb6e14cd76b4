"""Corners between two fronts: one row takes the corner, the other begins behind or beside it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import Polygon

from ..rules import ParcelRules
from .line import Floats, Line, along
from .outline import Side, direction
from .rear import PUSH, Chain, corner_of, hit, pushed

#: Gentler turns keep the bisector: both rows end in slightly slanted parcels (degrees).
TURN = 45.0
#: Reflex corners that turn by less keep it too (degrees).
REFLEX = 50.0
#: Up to this turn the land between a straight rear line and a square end goes to the court.
SQUARE = 86.0
#: Fronts whose ends are nearer than this share a corner; else it is rounded or cut off (metres).
SHARED = 3.0
#: How far along the line between two rows the corner may reach, in depths, without a court.
REACH = 1.45
#: The same at acute corners, which turn by more than the second of these angles (degrees): the
#: first marks where it begins to shrink. Two rows are better than one very deep one there.
ACUTE, ACUTE_FROM, ACUTE_TO = 0.75, 95.0, 115.0


@dataclass(frozen=True)
class Style:
    """How convex corners of two fronts are treated.

    Attributes
    ----------
    straight
        Whether the rear line of the row that takes the corner goes straight on to the other
        street; else it bends so as to meet that street at a right angle.
    early
        Whether two rows begin early in acute corners; else one goes from street to street until
        it is as deep as a parcel may be.
    wide
        How many times as large as others slanted parcels at the ends of rows may be.
    spare
        They are made so wide that the rectangle around is larger by this share, but no wider.
    court
        Whether land that is too deep becomes a court; else parcels become deep.
    """

    straight: bool = False
    early: bool = False
    wide: float = 1.34
    spare: float = 0.2
    court: bool = True


@dataclass
class Lines:
    """What divides a block into rows.

    Attributes
    ----------
    chains
        Lines between the rows of two fronts.
    walls
        Further lines, shape (n, 2) each.
    court
        Points of pieces that belong to the court, shape (2,) each.
    """

    chains: list[Chain]
    walls: list[Floats] = field(default_factory=list)
    court: list[Floats] = field(default_factory=list)

    def all(self) -> list[Floats]:
        """Return all the lines."""
        return [x.xy for x in self.chains] + self.walls


def normal(way: Floats) -> Floats:
    """Return the direction to the left of another, shape (2,)."""
    return np.array([-way[1], way[0]])


def settle(
    lines: Lines,
    sides: list[Side],
    polygon: Polygon,
    core: shapely.Geometry,
    rules: ParcelRules,
    style: Style,
) -> None:
    """Put the lines at the corners in order, in place.

    Parameters
    ----------
    lines
        The lines between the rows, up to the court.
    sides, polygon
        The block.
    core
        Its court, maybe empty.
    rules
        What is asked of parcels.
    style
        How convex corners are treated.
    """
    ring = [shapely.get_coordinates(x) for x in (polygon.exterior, *polygon.interiors)]
    for chain in list(lines.chains):
        place = corner_of(chain, sides)
        if place is None:
            continue
        turn = sides[place[1]].turn
        if turn < -REFLEX and core.is_empty and _share_corner(sides, place):
            _reflex(lines, chain, place, sides, ring, rules)
    for chain in list(lines.chains):
        place = corner_of(chain, sides)
        if place is None:
            continue
        _to_the_corner(chain, place, sides)
        if sides[place[1]].turn > TURN:
            _convex(lines, chain, place, sides, core, rules, style)
    for chain in lines.chains:
        at = corner_of(chain, sides)
        for end in (0, -1):
            if at is None or at[0] != end or not _share_corner(sides, at):
                _through_the_edge(chain, end, polygon)


def _through_the_edge(chain: Chain, end: int, polygon: Polygon) -> None:
    """Push a line that ends at the edge of the block through it."""
    if shapely.distance(shapely.points(chain.xy[end]), polygon.boundary) < 0.3:
        chain.xy = pushed(chain.xy, end)


def _share_corner(sides: list[Side], place: tuple[int, int, int]) -> bool:
    """Tell whether two fronts meet in a point, not in a rounding."""
    gap = np.abs(sides[place[1]].xy[-1] - sides[place[2]].xy[0])
    return bool((gap <= SHARED).all())


def _to_the_corner(chain: Chain, place: tuple[int, int, int], sides: list[Side]) -> None:
    """Let a line end exactly at the corner, where its two fronts share one."""
    end, first, _second = place
    if _share_corner(sides, place):
        chain.xy = chain.xy.copy()
        chain.xy[end] = sides[first].xy[-1]


def _reflex(
    lines: Lines,
    chain: Chain,
    place: tuple[int, int, int],
    sides: list[Side],
    ring: list[Floats],
    rules: ParcelRules,
) -> None:
    """Give the land behind a reflex corner to a row that faces it, as one straight piece."""
    _, first, second = place
    corner = sides[first].xy[-1]
    ways = (normal(direction(sides[first].xy, -1)), normal(direction(sides[second].xy, 0)))
    far = 2.2 * rules.depth
    wedge = shapely.Polygon(
        [corner, corner + far * ways[0], corner + far * (ways[0] + ways[1]), corner + far * ways[1]]
    )
    kept: list[Chain] = []
    ends: list[tuple[Chain, int, Floats]] = []
    for other in lines.chains:
        common = {first, second} & set(other.pair)
        if other is chain or not common:
            continue
        for part in shapely.get_parts(shapely.difference(shapely.linestrings(other.xy), wedge)):
            if part.length > 0.5:
                kept.append(Chain(other.pair, shapely.get_coordinates(part)))
    rest = [x for x in lines.chains if x is not chain and not {first, second} & set(x.pair)]
    for k, (way, front) in enumerate(zip(ways, (first, second))):
        for piece in kept:
            for end in (0, -1):
                gap = piece.xy[end] - corner
                if front in piece.pair and abs(gap[0] * way[1] - gap[1] * way[0]) < 0.01:
                    reach = float(gap @ way)
                    if 1.0 < reach < far and not any(x[1] == k for x in ends):
                        ends.append((piece, k, np.array([end], dtype=float)))
    if len(ends) < 2:
        return  # nothing faces it on one side: the bisector stays
    facing = [next(iter(set(p.pair) - {(first, second)[k]})) for p, k, _ in ends]
    if facing[0] == facing[1]:
        return
    best = int(np.argmax([sides[j].length for j in facing]))
    piece, _, end_ = ends[best]
    end = int(end_[0])
    way = direction(piece.xy, end, reach=15.0) * (1 if end == -1 else -1)
    start = piece.xy[end]
    blocking = [x.xy for x in rest] + [x.xy for x in kept if x is not piece] + ring
    length = hit(start, way, blocking, 0.5)
    if not length < 4 * rules.depth:
        return
    goal = start + way * length
    on_line = any(
        shapely.distance(shapely.linestrings(x.xy), shapely.points(goal)) < 0.01 for x in rest
    )
    if not on_line:
        goal = goal + way * PUSH
    lines.chains[:] = kept + [_shortened(x, goal, corner) for x in rest]
    longer = np.vstack([piece.xy, goal]) if end == -1 else np.vstack([goal, piece.xy])
    piece.xy = longer
    for p, _, e in ends:
        at = start if p is piece else p.xy[int(e[0])]
        lines.walls.append(np.vstack([corner, at]))


def _shortened(chain: Chain, goal: Floats, corner: Floats) -> Chain:
    """Drop what a line has beyond a point on it, on the side of a corner."""
    line = shapely.linestrings(chain.xy)
    if shapely.distance(line, shapely.points(goal)) > 0.01:
        return chain
    place = shapely.line_locate_point(line, shapely.points(goal))
    steps = Line(chain.xy).place
    near_start = np.hypot(*(chain.xy[0] - corner)) < np.hypot(*(chain.xy[-1] - corner))
    if near_start:
        return Chain(chain.pair, np.vstack([goal, chain.xy[steps > place + 0.01]]))
    return Chain(chain.pair, np.vstack([chain.xy[steps < place - 0.01], goal]))


def _convex(
    lines: Lines,
    chain: Chain,
    place: tuple[int, int, int],
    sides: list[Side],
    core: shapely.Geometry,
    rules: ParcelRules,
    style: Style,
) -> None:
    """Give a convex corner to the row of the longer street."""
    end, first, second = place
    winner, loser = (
        (first, second) if sides[first].length >= sides[second].length else (second, first)
    )
    xy = chain.xy if end == 0 else chain.xy[::-1]
    # how far the corner goes: to the junction of rear lines, or as deep as a parcel may be
    line = Line(xy)
    steps = line.place
    front = shapely.linestrings(sides[loser].xy)
    fine = np.linspace(0, steps[-1], max(8, int(steps[-1])))
    depth = shapely.distance(shapely.points(line.at(fine)), front)
    most = 1.1 if not core.is_empty else REACH
    if style.early:
        most = float(np.interp(sides[first].turn, [ACUTE_FROM, ACUTE_TO], [most, ACUTE]))
    limit = most * rules.depth
    beyond = np.flatnonzero(depth > limit)
    stop = float(fine[beyond[0]]) if len(beyond) else float(steps[-1])
    junction = line.at(np.array([stop]))[0]
    if stop < 2.0:
        return
    foot = _foot(junction, winner, loser, first, sides, style.straight)
    if foot is None:
        return
    rest = xy[steps > stop + 0.01]
    out = (foot - junction) / max(float(np.hypot(*(foot - junction))), 1e-9)
    # a vertex at the foot itself, for a wall that begins there
    xy = np.vstack([foot + out * PUSH, foot, junction, rest])
    chain.xy = xy
    if style.straight and not core.is_empty and sides[first].turn < SQUARE:
        _beside(lines, foot, junction, loser, sides, core, rules)


def _foot(
    junction: Floats, winner: int, loser: int, first: int, sides: list[Side], straight: bool
) -> Floats | None:
    """Return where the line from a junction of rear lines meets the street that loses."""
    if straight:
        way = direction(sides[winner].xy, -1 if winner == first else 0, reach=20.0)
        way = way if winner == first else -way
        length = hit(junction, way, [sides[loser].xy])
        if not np.isfinite(length):
            return None
        found = junction + way * length
    else:
        line = shapely.linestrings(sides[loser].xy)
        place = float(shapely.line_locate_point(line, shapely.points(junction)))
        if not 1.0 < place < sides[loser].length - 1.0:
            return None
        found = along(sides[loser].xy, np.array([place]))[0]
    return np.asarray(found)


def _beside(
    lines: Lines,
    foot: Floats,
    junction: Floats,
    loser: int,
    sides: list[Side],
    core: shapely.Geometry,
    rules: ParcelRules,
) -> None:
    """Let the court reach out between two rows, so that the second begins at a right angle."""
    line = shapely.linestrings(sides[loser].xy)
    place = float(shapely.line_locate_point(line, shapely.points(foot)))
    near = along(sides[loser].xy, np.clip(np.array([place - 8, place + 8]), 0, line.length))
    inward = normal((near[1] - near[0]) / max(float(np.hypot(*(near[1] - near[0]))), 1e-9))
    ring = [shapely.get_coordinates(x.exterior) for x in shapely.get_parts(core)]
    length = hit(foot, inward, ring)
    if not 0.5 * rules.depth < length < 1.5 * rules.depth:
        return
    goal = foot + inward * length
    if np.hypot(*(goal - junction)) < 1.5:
        return
    # only where it lies on the far side of the rear line, outside the row that takes the corner
    lines.walls.append(np.vstack([foot, goal + inward * 0.05]))
    lines.court.append((foot + goal + junction) / 3)
