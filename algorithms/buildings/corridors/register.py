"""The boundaries of a sample and of a zone are registered place by place (RZ section 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import Floats
from .outline import Outline
from .samples import Sample
from .turning import arcs, turns

#: Vertices that turn by less than this are no features (radians).
CORNER = np.radians(20.0)
#: Features this far from each other along the boundary are not the same (share of its length).
FAR = 0.1
#: Between two registered places the boundary is stretched at most so many times.
STRETCH = 3.0
#: An entry moves at most so far to an access point, or to where there is a street (share of the
#: boundary, metres).
REACH, REACH_M = 0.07, 60.0
#: An entry that does not lie at an access point keeps so far from it and from corners (metres).
CLEAR = 30.0
#: Places between features at which the boundaries are registered.
EVENLY = 60


@dataclass(frozen=True, eq=False)
class Registration:
    """How places along the boundary of a sample lie along that of a zone.

    Attributes
    ----------
    own, there
        Registered places along both boundaries, growing, shape (n,); `there` may pass 1.
    entries
        Place of each entry along the outline of the zone, nan for those without a street there,
        shape (e,).
    gate
        Index of the access point that an entry meets, -1 for none, shape (e,).
    moved
        How far entries moved, mean share of the boundary; one that is lost counts as `REACH`.
    """

    own: Floats
    there: Floats
    entries: Floats
    gate: tuple[int, ...]
    moved: float

    def across(self, place: Floats) -> Floats:
        """Return places of the sample's boundary as places of the zone's."""
        return _across(place, self.own, self.there)

    def back(self, place: Floats) -> Floats:
        """Return places of the zone's boundary as places of the sample's."""
        return _across(place, self.there, self.own)

    def rings(self, sample: Sample, outline: Outline) -> tuple[Floats, Floats]:
        """Return V_p and V_p': both boundaries, vertex by vertex, each of shape (n, 2)."""
        places = np.concatenate(
            [
                np.arange(EVENLY) / EVENLY,
                arcs(sample.ring),
                self.back(arcs(outline.ring)),
                self.own,
            ]
        )
        places = np.unique(np.round(places % 1.0, 7))
        if 1.0 - places[-1] + places[0] < 1e-6:
            places = places[:-1]
        return _points(sample.ring, places), outline.at(self.across(places))


def register(sample: Sample, outline: Outline, shift: float) -> Registration:
    """Register the boundary of a sample with that of a zone.

    Corners are laid upon corners, then entries upon access points or, where there is none, upon
    the nearest place with a street outside.

    Parameters
    ----------
    sample
        The sample.
    outline
        The zone.
    shift
        Of `turning.turning_fits`.
    """
    own, there = _corners(sample, outline, shift)
    entries = places_of(sample.ring, sample.nodes[: sample.entries])
    wished = _across(entries, own, there) % 1.0
    reach = max(REACH, REACH_M / outline.length)
    order = _nearest_first(wished, outline)
    found = np.full(sample.entries, np.nan)
    gate = [-1] * sample.entries
    for at in order:
        target, door = _target(wished[at], outline, reach, found, gate)
        if np.isfinite(target):
            found[at], gate[at] = target, door
    step = np.abs((found - wished + 0.5) % 1.0 - 0.5)
    for at in order:
        if np.isfinite(found[at]):
            forward = wished[at] + (found[at] - wished[at] + 0.5) % 1.0 - 0.5
            whole = _across(entries[at : at + 1], own, there)[0]
            own, there = _added(own, there, entries[at], whole + forward - wished[at], 0.15)
    moved = float(np.where(np.isfinite(step), step, 2 * REACH).mean()) if len(step) else 0.0
    return Registration(own, there, found, tuple(gate), moved)


def places_of(ring: Floats, points: Floats) -> Floats:
    """Give the places along a ring that are nearest to points, 0 to 1, shape (k,).

    Parameters
    ----------
    ring
        Vertices, shape (n, 2).
    points
        Shape (k, 2).
    """
    ahead = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(ahead[:, 0], ahead[:, 1])
    away = points[:, None] - ring[None]
    share = np.clip(np.sum(away * ahead, axis=2) / length**2, 0.0, 1.0)
    gap = np.hypot(*np.moveaxis(away - share[..., None] * ahead, 2, 0))
    edge = np.argmin(gap, axis=1)
    along = share[np.arange(len(points)), edge] * length[edge] / length.sum()
    return np.asarray((arcs(ring)[edge] + along) % 1.0)


def _points(ring: Floats, place: Floats) -> Floats:
    """Return the points at places along a ring, shape (k, 2)."""
    at = np.append(arcs(ring), 1.0)
    closed = np.vstack([ring, ring[:1]])
    return np.column_stack([np.interp(place, at, closed[:, k]) for k in (0, 1)])


def _across(place: Floats, own: Floats, there: Floats) -> Floats:
    """Carry places from one boundary to the other, linear between registered ones."""
    start = own[0]
    x = np.append(own, start + 1.0)
    y = np.append(there, there[0] + 1.0)
    turned = (np.asarray(place) - start) % 1.0 + start
    return np.asarray(np.interp(turned, x, y))


def _corners(sample: Sample, outline: Outline, shift: float) -> tuple[Floats, Floats]:
    """Register corners that turn alike, the surest first."""
    a, b = arcs(sample.ring), arcs(outline.ring)
    turn_a, turn_b = turns(sample.ring), turns(outline.ring)
    gap = (b[None] - a[:, None] - shift + 0.5) % 1.0 - 0.5
    gain = np.minimum(np.abs(turn_a)[:, None], np.abs(turn_b)[None]) / (np.pi / 2)
    gain = gain - np.abs(gap) / FAR - np.abs(turn_a[:, None] - turn_b[None]) / np.pi
    gain[(np.abs(turn_a) < CORNER)[:, None] | (np.abs(turn_b) < CORNER)[None]] = -1.0
    own, there = np.zeros(0), np.zeros(0)
    for at in np.argsort(-gain, axis=None, kind="stable"):
        i, j = np.unravel_index(at, gain.shape)
        if gain[i, j] <= 0.0:
            break
        own, there = _added(own, there, float(a[i]), float(a[i] + shift + gap[i, j]))
    return (own, there) if len(own) else (np.zeros(1), np.array([shift]))


def _added(
    own: Floats, there: Floats, place: float, target: float, least: float = 0.0
) -> tuple[Floats, Floats]:
    """Register one more pair of places, unless it folds or stretches the boundary too much.

    `least` is a difference of stretch that is always allowed, as a share of the neighbouring
    stretch of boundary.
    """
    if len(own) == 0:
        return np.array([place]), np.array([target])
    if np.min(np.abs((own - place + 0.5) % 1.0 - 0.5)) < 1e-6:
        return own, there
    at = int(np.searchsorted(own, place))
    # the pair may lie beyond the ends of the list, which goes round
    before = (own[at - 1], there[at - 1]) if at > 0 else (own[-1] - 1.0, there[-1] - 1.0)
    after = (own[at], there[at]) if at < len(own) else (own[0] + 1.0, there[0] + 1.0)
    target = target + np.round((before[1] + after[1]) / 2 - target)
    most = STRETCH * (1.0 + least)
    for low, high in ((before, (place, target)), ((place, target), after)):
        size, new = high[0] - low[0], high[1] - low[1]
        if not (size / most <= new <= most * size):
            return own, there
    return np.insert(own, at, place), np.insert(there, at, target)


def _nearest_first(wished: Floats, outline: Outline) -> list[int]:
    """Return the entries in the order in which they choose: those at access points first."""
    if not len(outline.gates):
        return list(range(len(wished)))
    gap = np.abs((outline.gates[None] - wished[:, None] + 0.5) % 1.0 - 0.5).min(axis=1)
    return [int(at) for at in np.argsort(np.round(gap, 6), kind="stable")]


def _target(
    wished: float, outline: Outline, reach: float, found: Floats, gate: list[int]
) -> tuple[float, int]:
    """Return where an entry goes, nan for nowhere, and its access point, -1 for none."""
    apart = CLEAR / outline.length
    gap = np.abs((outline.gates - wished + 0.5) % 1.0 - 0.5)
    for door in np.argsort(gap, kind="stable"):
        if gap[door] > reach:
            break
        if int(door) not in gate and _free(outline.gates[door], found, apart):
            return float(outline.gates[door]), int(door)
    closed = np.concatenate([outline.gates, arcs(outline.ring)[np.abs(turns(outline.ring)) > 0.5]])
    for narrow in (apart, 0.3 * apart):
        free = outline.fronts
        if len(closed):
            away = np.abs((free[:, None] - closed[None] + 0.5) % 1.0 - 0.5).min(axis=1)
            free = free[away >= narrow]
        gap = np.abs((free - wished + 0.5) % 1.0 - 0.5)
        for at in np.argsort(gap, kind="stable"):
            if gap[at] > reach:
                break
            if _free(free[at], found, narrow):
                exact = wished if gap[at] < 2.6 / outline.length else free[at]
                return float(exact), -1
    return float("nan"), -1


def _free(place: float, found: Floats, apart: float) -> bool:
    """Tell whether no other entry is near."""
    gap = np.abs((found - place + 0.5) % 1.0 - 0.5)
    return not bool(np.any(gap[np.isfinite(gap)] < apart))
