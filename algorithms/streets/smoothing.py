"""Smoothing of a street network, never at the price of its topology (CND appendix).

Streets become gentle curves or straight lines with few bends, junctions right-angled. What was
connected stays connected, and nothing new crosses: every drawing is checked, and where
something is wrong those streets are held back, half as far each time, until nothing is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from ..errors import CancelledError, InputError
from ..network.problem import BoolArray, FloatArray
from ..progress import Progress, Silent
from .angles import chain_lines
from .fillets import fillet_streets
from .smooth_anchors import Anchors
from .smooth_checks import Faults, Guard
from .smooth_graph import Geometries, StreetNet, chains_of
from .smooth_points import Points, arcs, sample
from .snakes import RENEW, SETTLED, Elasticity, Snakes

#: What streets may become.
SHAPES = ("curved", "straight")
#: Distance of the points that move, by shape (metres).
SPACING = {"curved": 8.0, "straight": 20.0}
#: Smoothing length at full strength (metres): see `snakes.Elasticity`.
FULL_LENGTH = 100.0
#: Unless it is given, the furthest move is this share of the median street between junctions,
#: but no more than the second figure (metres).
MOVE_SHARE, MOST_MOVE = 0.3, 20.0
#: Corners are told from the steps of a staircase over this many times the furthest move.
CORNER_LOOK = 3.0
#: Points within this of a straight line are left out of the result, by shape (metres).
CRUMB = {"curved": 0.02, "straight": 0.4}
#: Points of a street's line stray at most this far from the street (metres).
KEEP = 0.3
#: Points that moved less are where they were (metres).
UNMOVED = 1e-6
#: So often the system is set up for the first approach, and for each correction.
SYSTEMS, MORE_SYSTEMS = 12, 3
#: So often at most it is set up after that to bring points within their limits, which they
#: are if they exceed them by less than this share: the rest is cut off.
FITTING, FITS = 10, 0.05
#: Points of a street that are held back lie this near to a fault, or next to it (metres).
NEAR = 25.0
#: After that points up to this far from them are moved again (metres).
AROUND = 150.0
#: Rounds of holding back, after how many of them what is still wrong stays where it was, and the
#: share of its way below which a street does so, too.
ROUNDS, PATIENCE, LEAST_SHARE = 30, 16, 0.1


@dataclass(frozen=True)
class Smoothing:
    """What a planner asks of smoothing.

    Attributes
    ----------
    shape
        "curved": bends become gentle curves. "straight": streets become straight with few bends.
    strength
        From 0, where only junctions are drawn square, to 1.
    max_move
        No street moves further than this, metres, greater than 0; None for 0.3 of the median
        street between two junctions, at most 20 m.
    fillet_radius
        Radius of the arcs at bends that remain between junctions, metres; 0 for none.
    fillet_angle
        Smallest turn that gets an arc, degrees, from 1 to 160.
    square
        Whether junction angles are drawn towards 90 degrees.
    slide
        Whether ends slide along the edge of the site.

    Raises
    ------
    InputError
        A figure is out of range.
    """

    shape: str = "curved"
    strength: float = 0.5
    max_move: float | None = None
    fillet_radius: float = 0.0
    fillet_angle: float = 20.0
    square: bool = True
    slide: bool = True

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(f"The shape '{self.shape}' is unknown.", "Choose curved or straight.")
        if not 0 <= self.strength <= 1:
            raise InputError(f"The strength is {self.strength}.", "Give a number from 0 to 1.")
        if self.max_move is not None and not 0 < self.max_move < math.inf:
            raise InputError(
                f"The largest move is {self.max_move} m.", "Give a length in metres above 0."
            )
        if not 0 <= self.fillet_radius < math.inf:
            raise InputError(
                f"The fillet radius is {self.fillet_radius} m.", "Give a radius, or 0 for none."
            )
        if not 1 <= self.fillet_angle <= 160:
            raise InputError(
                f"The smallest turn of a fillet is {self.fillet_angle} degrees.",
                "Give a number from 1 to 160.",
            )


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A smoothed network.

    Attributes
    ----------
    lines
        Shape (e,). Geometries of the edges; those that did not move are the network's own.
    max_move
        Furthest that any was allowed to move, metres.
    held_back
        Shape (e,). Edges that moved less than they would have, so that nothing crosses, touches
        an obstacle or leaves the site.
    complete
        False where the caller cancelled: then `lines` is the last drawing that was safe, which
        may be the one that came in.
    """

    lines: Geometries
    max_move: float
    held_back: BoolArray
    complete: bool = True


def smooth_net(
    net: StreetNet,
    anchors: Anchors,
    wishes: Smoothing | None = None,
    *,
    obstacles: Geometries | None = None,
    progress: Progress | None = None,
) -> Smoothed:
    """Smooth a network as far as that is safe.

    Parameters
    ----------
    net
        The streets.
    anchors
        What holds them, with the site that they must not leave.
    wishes
        What is asked; None for the usual.
    obstacles
        Shape (k,). Polygons that no street may newly touch, or come near to.
    progress
        Told of the stages, asked for cancellation.

    Returns
    -------
    Smoothed
        The same network, drawn otherwise. The same input gives the same result.
    """
    wishes = wishes or Smoothing()
    told = progress or Silent()
    most = wishes.max_move or usual_move(net)
    back = np.zeros(len(net.lines), dtype=bool)
    if most <= 0 or not len(net.lines) or anchors.held.all():
        return Smoothed(net.lines, most, back)
    told.stage("Preparing the streets", 0.0)
    try:
        work = _Work(net, anchors, wishes, most, obstacles, told)
    except CancelledError:
        return Smoothed(net.lines, most, back, complete=False)
    lines, complete = work.run(told)
    return Smoothed(lines, most, work.held_back, complete)


def usual_move(net: StreetNet) -> float:
    """Furthest move where the planner gives none, metres; 0 without streets."""
    if not len(net.lines):
        return 0.0
    chains, ends = chain_lines(net, net.lines)
    inner = (net.degrees[ends] > 2).all(axis=1)
    lengths = shapely.length(chains[inner] if inner.any() else chains)
    return min(MOVE_SHARE * float(np.median(lengths)), MOST_MOVE)


def _ask(progress: Progress) -> None:
    """Stop where the caller has cancelled."""
    if progress.cancelled():
        raise CancelledError("Cancelled before any street was moved.")


class _Work:
    """One run: the snakes, the guard, and how far each point is held back."""

    def __init__(
        self,
        net: StreetNet,
        anchors: Anchors,
        wishes: Smoothing,
        most: float,
        obstacles: Geometries | None,
        progress: Progress,
    ) -> None:
        self.net, self.anchors, self.wishes = net, anchors, wishes
        spacing = SPACING[wishes.shape]
        # What sampling and drawing stray counts as moved, too.
        keep, self.crumb = min(KEEP, most / 10), min(CRUMB[wishes.shape], most / 10)
        self.points: Points = sample(net, anchors, spacing, keep, most - keep - self.crumb)
        _ask(progress)
        elasticity = Elasticity(
            spacing,
            length=max(wishes.strength * FULL_LENGTH, 1.0),
            few_bends=wishes.shape == "straight",
            corner=CORNER_LOOK * most,
        )
        self.snakes = Snakes(net, self.points, anchors, elasticity, square=wishes.square)
        _ask(progress)
        self.guard = Guard(net, most, obstacles, anchors.ground)
        self.lines = net.lines.copy()
        self.share = np.ones(len(self.points.start))
        self.held_back = np.zeros(len(net.lines), dtype=bool)

    def run(self, progress: Progress) -> tuple[Geometries, bool]:
        """Return the drawing, and whether there was time to finish it."""
        active = np.ones(len(self.share), dtype=bool)
        for turn in range(ROUNDS):
            limit = self.points.limits(self.share)
            systems = SYSTEMS if turn == 0 else MORE_SYSTEMS
            for k in range(systems):
                if progress.cancelled():
                    return self.net.lines, False
                done = k / systems if turn == 0 else 1 - 0.5**turn
                progress.stage(
                    "Smoothing" if turn == 0 else "Correcting", 0.6 * done + 0.3 * (turn > 0)
                )
                if self.snakes.relax(limit, RENEW, active) < SETTLED:
                    break
            for _ in range(FITTING):
                if self.snakes.excess(limit) < FITS:
                    break
                self.snakes.relax(limit, 1, active)
            at = self.snakes.within(limit)
            faults = self.guard.faults(self.lines, self._draw(at, active))
            if not faults:
                return self._filleted(progress)
            active = self._hold_back(faults, at, entirely=turn >= PATIENCE)
        return self.net.lines, True

    def _draw(self, at: FloatArray, active: BoolArray) -> BoolArray:
        """Draw the edges with active points anew, unmoved ones as they came; tell which."""
        points = self.points
        redrawn = np.zeros(len(self.lines), dtype=bool)
        moved = redrawn.copy()
        np.logical_or.at(redrawn, points.owner, active[points.sequence])
        away = np.hypot(*(at - points.start).T) > UNMOVED
        np.logical_or.at(moved, points.owner, away[points.sequence])
        self.lines[redrawn] = self.net.lines[redrawn]
        some = redrawn & moved
        if some.any():
            mine = some[points.owner]
            place = (np.cumsum(some) - 1)[points.owner[mine]]
            made = shapely.linestrings(at[points.sequence[mine]], indices=place)
            self.lines[some] = shapely.simplify(made, self.crumb)
        still = ~away[points.sequence[points.links]] & ~away[points.sequence[points.links + 1]]
        partly = np.zeros(len(self.lines), dtype=bool)
        partly[points.owner[points.links[still]]] = True
        for edge in np.flatnonzero(partly & some).tolist():
            self.lines[edge] = self._partly(edge, at, away)
        return redrawn

    def _partly(self, edge: int, at: FloatArray, away: BoolArray) -> shapely.Geometry:
        """Draw an edge that moved in part: the rest is exactly as it came."""
        a, b = self.points.offset[edge : edge + 2]
        own, along = self.points.sequence[a:b], self.points.along[a:b]
        xy = shapely.get_coordinates(self.net.lines[edge])
        arc = arcs(xy)
        stays = ~(away[own[:-1]] | away[own[1:]])
        cuts = [0, *(np.flatnonzero(stays[1:] != stays[:-1]) + 1).tolist(), len(stays)]
        parts = [at[own[:1]]]
        for first, last in zip(cuts[:-1], cuts[1:]):
            if stays[first]:
                inner = xy[(arc > along[first] + UNMOVED) & (arc < along[last] - UNMOVED)]
                parts.append(np.vstack([inner, at[own[last : last + 1]]]))
            else:
                run = shapely.linestrings(at[own[first : last + 1]])
                parts.append(shapely.get_coordinates(shapely.simplify(run, self.crumb))[1:])
        return shapely.linestrings(np.vstack(parts))

    def _hold_back(self, faults: Faults, at: FloatArray, *, entirely: bool) -> BoolArray:
        """Let streets move half as far near a fault; in the end whole streets not at all.

        Returns
        -------
        array
            Shape (N,). Points to be moved again: those around.
        """
        points = self.points
        wrong = np.zeros(len(self.lines), dtype=bool)
        wrong[faults.edges] = True
        self.held_back |= wrong
        less = np.zeros(len(self.share), dtype=bool)
        for edge, place in zip(faults.edges, faults.places):
            own = points.sequence[points.offset[edge] : points.offset[edge + 1]]
            if place is not None:
                gap = shapely.distance(shapely.points(at[own]), place)
                own = own[gap <= max(NEAR, float(gap.min()))]
            less[own] = True
        self.share[less] *= 0.5
        self.share[self.share < LEAST_SHARE] = 0.0
        if entirely:
            near = np.zeros(len(self.net.nodes), dtype=bool)
            near[self.net.ends[wrong].ravel()] = True
            stop = points.sequence[near[self.net.ends].any(axis=1)[points.owner]]
            self.share[stop] = 0.0
            less[stop] = True
        gap, _ = cKDTree(points.start[less]).query(points.start, distance_upper_bound=AROUND)
        return np.asarray(np.isfinite(gap))

    def _filleted(self, progress: Progress) -> tuple[Geometries, bool]:
        """Round the bends that remain, but for those where that would do harm."""
        if self.wishes.fillet_radius <= 0:
            return self.lines, True
        progress.stage("Rounding bends", 0.9)
        radius = np.where(self.anchors.held, 0.0, self.wishes.fillet_radius)
        runs = self._runs()
        for _ in range(ROUNDS):
            if progress.cancelled():
                return self.lines, False
            made = fillet_streets(
                self.lines, radius, self.wishes.fillet_angle, runs, self.anchors.outside
            )
            changed = np.array([a is not b for a, b in zip(made, self.lines)], dtype=bool)
            faults = self.guard.faults(made, changed)
            if not faults:
                return made, True
            radius[list(set(faults.edges))] *= 0.5
        return self.lines, True

    def _runs(self) -> list[list[int]]:
        """Edges between junctions and fixed points, in order along each street."""
        found: list[list[int]] = []
        for chain in chains_of(self.net):
            found.append([])
            for step in chain:
                begin = self.net.ends[step, 0] if step >= 0 else self.net.ends[~step, 1]
                if found[-1] and self.anchors.fixed[begin]:
                    found.append([])
                found[-1].append(step)
        return found
