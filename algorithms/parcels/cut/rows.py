"""Cuts across a row of parcels, square to its street, at places that share out the area."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..rules import ParcelRules
from .outline import Floats
from .profile import Overhang, Profile, depths, normals, overhangs, profile_of, turning
from .rear import PUSH, along
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


def cut_row(
    front: Floats,
    ring: Floats,
    rules: ParcelRules,
    corners: tuple[bool, bool],
    widest: float = 1.34,
    spare: float = 0.2,
) -> Cuts:
    """Cut a row into parcels.

    Parameters
    ----------
    front
        The side of the block along which the row lies, shape (n, 2), metres.
    ring
        Outline of the row, closed, shape (m, 2).
    rules
        What is asked of parcels.
    corners
        Whether the first and the last parcel lie at the corner of two streets.
    widest
        How many times as large as others slanted parcels at the ends may be.
    spare
        Slanted end parcels are made so wide that the rectangle around is larger by this share.
    """
    length = float(np.hypot(*np.diff(front, axis=0).T).sum())
    place = np.linspace(0.0, length, max(8, int(length / STEP) + 1))
    # a ray along the very end of the block would lie neither inside nor outside
    place[[0, -1]] += 0.01, -0.01
    start, way = along(front, place), normals(front, length, place)
    depth = depths(start, way, ring)
    reached = np.flatnonzero(depth > 1.0)
    cuts = Cuts()
    if len(reached) < 3:
        return cuts
    span = slice(int(reached[0]), int(reached[-1]) + 1)
    place, start, way, depth = place[span], start[span], way[span], depth[span]
    profile = profile_of(place, way, depth, rules)
    extra = overhangs(ring, start, way, profile)
    # land beyond the end of the street that is large enough is a parcel at the corner itself
    own = [x.area > ROUND_CORNER * rules.area for x in extra]
    extra = (Overhang() if own[0] else extra[0], Overhang() if own[1] else extra[1])
    for k, end in ((0, 0), (1, -1)):
        if own[k]:
            cuts.lines.append(
                np.vstack(
                    [start[end] - way[end] * PUSH, start[end] + way[end] * (depth[end] + 0.06)]
                )
            )
    bounds, wedges = _pointed_ends(profile, extra, rules)
    for low, high in wedges:
        middle = (low + high) / 2
        cuts.greens.append(_inside(front, length, middle, profile))
    breaks, goals = _breaks(profile, bounds, ring, start, way, rules)
    places: list[float] = [b for b in bounds if place[0] + 0.5 < b < place[-1] - 0.5]
    for k, (low, high) in enumerate(zip(breaks, breaks[1:])):
        ends = (k == 0, k == len(breaks) - 2)
        more = tuple(
            x if at and abs(b - edge) < 0.5 else Overhang()
            for x, at, b, edge in zip(extra, ends, (low, high), (float(place[0]), float(place[-1])))
        )
        places += _places(
            profile, low, high, (more[0], more[1]), rules, ends, corners, widest, spare
        )
        goal = goals[k + 1]
        if goal is not None:
            at = np.array([high])
            foot, square = along(front, at)[0], normals(front, length, at)[0]
            cuts.lines.append(np.vstack([foot - square * PUSH, goal]))
        elif not ends[1]:
            places.append(high)
    at = np.array(sorted(x for x in places if place[0] + 1.0 < x < place[-1] - 1.0))
    cuts.lines += _lines(front, length, at, ring)
    return cuts


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
    usual = float(np.median(profile.depth))
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


def _inside(front: Floats, length: float, place: float, profile: Profile) -> Floats:
    at = np.array([place])
    depth = float(np.interp(place, profile.place, profile.depth))
    return np.asarray((along(front, at) + normals(front, length, at) * depth / 2)[0])


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
    jumps = np.flatnonzero(np.abs(np.diff(profile.depth)) > JUMP * rules.depth)
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
    from_, to = np.interp([low, high], profile.place, profile.area)
    total = float(to - from_) + more[0].area + more[1].area
    if total <= 0:
        return []
    inside = (profile.place >= low) & (profile.place <= high)
    usual = float(np.median(profile.depth[inside])) if inside.any() else rules.depth
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
    sums = np.cumsum(areas)[:-1] - more[0].area + from_
    return [float(x) for x in np.interp(sums, profile.area, profile.place)]


def _lines(front: Floats, length: float, place: Floats, ring: Floats) -> list[Floats]:
    if len(place) == 0:
        return []
    start, way = along(front, place), normals(front, length, place)
    depth = depths(start, way, ring)
    corners = ring[:-1][turning(ring)]
    found = []
    for p, n, d in zip(start, way, depth):
        if d <= 1.0:
            continue
        end = p + n * d
        goal = end + n * 0.06
        if len(corners):
            gap = np.hypot(*(corners - end).T)
            near = int(np.argmin(gap))
            goal = corners[near] if gap[near] < SNAP else goal
        found.append(np.vstack([p - n * PUSH, goal]))
    return found
