"""Cuts across a row of parcels, square to its street, at places that share out the area."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..rules import ParcelRules
from .line import Floats, Line
from .profile import Overhang, Profile, depths, middle_of, overhangs, profile_of, turning
from .rear import PUSH
from .shares import how_many, needs_of, shared, whole_parcels

#: Distance between rays (metres).
STEP = 1.0
#: A jump of the depth by more than that many depths gets a cut of its own.
JUMP = 0.35
#: A slanted end that takes more than that many depths is cut off where that share of the full
#: depth is reached.
POINTED, CUT_OFF = 0.5, 0.85
#: And no more is cut off than that many parcels.
LARGEST_TIP = 0.75
#: Land beyond the end of its street of more than that many parcels is a parcel of its own.
ROUND_CORNER = 0.75
#: A cut that ends within this of a vertex of the row ends at it (metres).
SNAP = 0.9


@dataclass
class Cuts:
    """Where a row is cut.

    Attributes
    ----------
    lines
        Cuts, shape (2, 2) each; metres.
    greens
        Points of the pointed ends cut off, shape (2,) each.
    """

    lines: list[Floats] = field(default_factory=list)
    greens: list[Floats] = field(default_factory=list)


class Row:
    """A row of parcels along a front: what does not change with how large its ends may be.

    Parameters
    ----------
    front
        The side of the block along which the row lies.
    ring
        Outline of the row, closed, shape (m, 2).
    rules
        What is asked of parcels.
    corners
        Whether the first and the last parcel lie at the corner of two streets.
    """

    def __init__(
        self, front: Line, ring: Floats, rules: ParcelRules, corners: tuple[bool, bool]
    ) -> None:
        self.front, self.ring, self.rules, self.corners = front, ring, rules, corners
        self.fixed = Cuts()
        self.stretches: list[tuple[float, float, tuple[Overhang, Overhang], tuple[bool, bool]]] = []
        self.places: list[float] = []
        place = np.linspace(0.0, front.length, max(8, int(front.length / STEP) + 1))
        # a ray along the very end of the block would lie neither inside nor outside
        place[0] += 0.01
        place[-1] -= 0.01
        start, way = front.at(place), front.normals(place)
        depth = depths(start, way, ring)
        reached = (depth > 1.0).nonzero()[0]
        if len(reached) < 3:
            return
        span = slice(int(reached[0]), int(reached[-1]) + 1)
        self.profile = profile_of(place[span], way[span], depth[span], rules)
        self.vertices = ring[:-1][turning(ring)]
        self._divide(start[span], way[span])

    def _divide(self, start: Floats, way: Floats) -> None:
        """Find the stretches to be shared out, and the cuts and greens that come first."""
        profile, rules = self.profile, self.rules
        place, depth = profile.place, profile.depth
        extra = overhangs(self.ring, start, way, profile)
        # land beyond the end of the street that is large enough is a parcel at the corner itself
        own = [x.area > ROUND_CORNER * rules.area for x in extra]
        extra = (Overhang() if own[0] else extra[0], Overhang() if own[1] else extra[1])
        for k, end in ((0, 0), (1, -1)):
            if own[k]:
                far = start[end] + way[end] * (depth[end] + 0.06)
                self.fixed.lines.append(np.stack([start[end] - way[end] * PUSH, far]))
        bounds, wedges = _pointed_ends(profile, extra, rules)
        for low, high in wedges:
            self.fixed.greens.append(self._inside((low + high) / 2))
        breaks, goals = _breaks(profile, bounds, self.ring, start, way, rules)
        rim = (float(place[0]), float(place[-1]))
        self.places = [b for b in bounds if rim[0] + 0.5 < b < rim[1] - 0.5]
        for k, (low, high) in enumerate(zip(breaks, breaks[1:])):
            ends = (k == 0, k == len(breaks) - 2)
            more = tuple(
                x if at and abs(b - edge) < 0.5 else Overhang()
                for x, at, b, edge in zip(extra, ends, (low, high), rim)
            )
            self.stretches.append((low, high, (more[0], more[1]), ends))
            goal = goals[k + 1]
            if goal is not None:
                at = np.array([high])
                foot, square = self.front.at(at)[0], self.front.normals(at)[0]
                self.fixed.lines.append(np.stack([foot - square * PUSH, goal]))
            elif not ends[1]:
                self.places.append(high)

    def _inside(self, place: float) -> Floats:
        at = np.array([place])
        depth = float(np.interp(place, self.profile.place, self.profile.depth))
        return np.asarray((self.front.at(at) + self.front.normals(at) * depth / 2)[0])

    def cuts(self, widest: float = 1.34, spare: float = 0.2) -> Cuts:
        """Cut the row into parcels.

        Parameters
        ----------
        widest
            How many times as large as others slanted parcels at the ends may be.
        spare
            Slanted end parcels are made so wide that the rectangle around is larger by this share.
        """
        places = list(self.places)
        for low, high, more, ends in self.stretches:
            places += _places(
                self.profile, low, high, more, self.rules, ends, self.corners, widest, spare
            )
        lines = list(self.fixed.lines)
        if places:
            first, last = self.profile.place[0] + 1.0, self.profile.place[-1] - 1.0
            at = np.array(sorted(x for x in places if first < x < last))
            lines += self._lines(at)
        return Cuts(lines, list(self.fixed.greens))

    def _lines(self, place: Floats) -> list[Floats]:
        """Return the cuts at some places, square to the street, shape (2, 2) each."""
        if len(place) == 0:
            return []
        start, way = self.front.at(place), self.front.normals(place)
        depth = depths(start, way, self.ring)
        end = start + way * depth[:, None]
        goal = end + way * 0.06
        if len(self.vertices):
            gap = self.vertices - end[:, None]
            square = gap[..., 0] ** 2 + gap[..., 1] ** 2
            near = square.argmin(axis=1)
            close = square[np.arange(len(near)), near] < SNAP**2
            goal[close] = self.vertices[near[close]]
        return list(np.stack([start - way * PUSH, goal], axis=1)[depth > 1.0])


def _pointed_ends(
    profile: Profile, extra: tuple[Overhang, Overhang], rules: ParcelRules
) -> tuple[tuple[float, float], list[tuple[float, float]]]:
    """Cut ends off that slant too much for a parcel.

    Returns
    -------
    bounds
        Where the row of parcels begins and ends, metres along the front.
    wedges
        The stretches of the pointed pieces.
    """
    low, high = float(profile.place[0]), float(profile.place[-1])
    if not rules.greens:
        return (low, high), []
    wedges = []
    usual = middle_of(profile.depth)
    bounds = [low, high]
    for k, order in ((0, 1), (1, -1)):
        depth, place = profile.depth[::order], profile.place[::order]
        if extra[k].area > 0.1 * usual * usual:
            continue
        full = int(np.argmax(depth > 0.85 * usual))
        if abs(place[full] - place[0]) <= POINTED * usual:
            continue
        enough = int(np.argmax(depth > CUT_OFF * min(usual, rules.depth)))
        taken = np.abs(profile.area[::order] - profile.area[::order][0])
        # no more than a small green: what is left of a large tip is cut like any other land
        cut = float(place[min(enough, int(np.argmax(taken > LARGEST_TIP * rules.area)) or enough)])
        if high - low - abs(cut - bounds[k]) < 1.2 * rules.width:
            continue
        wedges.append((min(bounds[k], cut), max(bounds[k], cut)))
        bounds[k] = cut
    if bounds[1] - bounds[0] < rules.width:
        return (low, high), []
    return (bounds[0], bounds[1]), wedges


def _breaks(
    profile: Profile,
    bounds: tuple[float, float],
    ring: Floats,
    start: Floats,
    way: Floats,
    rules: ParcelRules,
) -> tuple[list[float], list[Floats | None]]:
    """Find the jumps of the depth, where cuts are forced.

    Returns
    -------
    places
        Distances along the front, the ends of the row among them, metres.
    goals
        The vertex of the row where the cut at each place ends; None for the ends of the row.
    """
    jumps = (np.abs(profile.depth[1:] - profile.depth[:-1]) > JUMP * rules.depth).nonzero()[0]
    places = [bounds[0]]
    goals: list[Floats | None] = [None]
    for j in jumps.tolist():
        k = j if profile.depth[j] < profile.depth[j + 1] else j + 1
        corner = start[k] + way[k] * profile.depth[k]
        near = int(np.argmin(np.hypot(*(ring - corner).T)))
        place = float((profile.place[j] + profile.place[j + 1]) / 2)
        goal = None
        if np.hypot(*(ring[near] - corner)) < 2 * STEP:
            goal = ring[near]
            across = np.array([way[k, 1], -way[k, 0]])
            place = float(profile.place[k] + (goal - start[k]) @ across)
        least = 0.5 * rules.width
        if place - places[-1] > least and bounds[1] - place > least:
            places.append(place)
            goals.append(goal)
    return [*places, bounds[1]], [*goals, None]


def _places(
    profile: Profile,
    low: float,
    high: float,
    more: tuple[Overhang, Overhang],
    rules: ParcelRules,
    ends: tuple[bool, bool],
    corners: tuple[bool, bool],
    widest: float,
    spare: float,
) -> list[float]:
    """Share out a stretch of a row; return the places of its inner cuts."""
    from_, to = np.interp([low, high], profile.place, profile.area).tolist()
    total = to - from_ + more[0].area + more[1].area
    if total <= 0:
        return []
    inside = (profile.place >= low) & (profile.place <= high)
    usual = middle_of(profile.depth[inside]) if inside.any() else rules.depth
    shares = [rules.corner_width if e and c else 1.0 for e, c in zip(ends, corners)]
    needs = [0.0, 0.0]
    if rules.remainder == "redistribute":
        needs = needs_of(profile, inside, more, usual, ends, rules, widest, spare)
    surplus = sum(max(s, x / rules.area) - 1.0 for s, x in zip(shares, needs))
    wish = max(total / rules.area - surplus, 1.0)
    count = how_many(wish, total, high - low, rules, usual)
    if rules.remainder != "redistribute" and count > 1:
        areas = whole_parcels(total, shares[0], shares[1], usual, rules)
    else:
        areas = shared(total, count, shares, needs)
    if len(areas) < 2:
        return []
    sums = np.cumsum(areas)[:-1] - more[0].area + from_
    return list(np.interp(sums, profile.area, profile.place).tolist())
