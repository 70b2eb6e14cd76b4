"""Culs-de-sac into ground that is left too deep (CND section 5.1, the last level).

With the planner's rules a cell of the mesh is as wide as a block, so that no mesh line is left
for a cul-de-sac. It is a straight street instead, square to the street that it leaves, into
ground that no street is near: the middle of a block that is too wide, the back row along a wall,
an arm of the site that is narrower than a block. One after the other is built where it serves
most for its length, until none is worth it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from ..levels import CUL_DE_SAC
from ..network.problem import BoolArray, FloatArray, IntArray
from ..network.specification import Specification
from ..progress import Progress, Silent
from .blocks import Block
from .chords import BEND, ON, STEP, Joint, Outline, joints_at
from .cross_streets import OBSTACLE_CLEARANCE, STAGGERED, CrossStreet, Surroundings
from .fitting import GOOD_FROM
from .program import DEEP

#: Least distance of a cul-de-sac from walls, for a plot between (share of the block width, 25 m
#: at 72 m), and of its end from what it might run into.
PLOT = 0.35
#: Least distance to other streets: a block with plots on both sides lies between (share).
APART = GOOD_FROM
#: A street that leaves another one stays off it: its distance from what it passes grows by this
#: share of the way at least.
LEAVES = 0.85
#: Least ground served by one (square block widths) and least length (block widths).
LEAST_GROUND, LEAST_LENGTH = 0.15, 0.45
#: Price of a metre in square metres of ground served; a street in the middle between its sides
#: is worth this more per metre than one beside a side.
PRICE, MIDDLE = 15.0, 10.0
#: What it is worth to begin opposite another street, and to continue one that arrives (square
#: block widths).
OPPOSITE, CONTINUED = 0.12, 0.2
#: Least spacing of the ground samples and of the places along a cul-de-sac (metres), and about
#: how many samples there are at most.
SAMPLE, SAMPLES = 4.0, 3000
#: The sides of a cul-de-sac are looked at from this far along on (metres).
BEGIN = 10.0


def reach_of(spec: Specification) -> float:
    """Range within which ground is served by a street, metres."""
    own = spec.level_settings.get(CUL_DE_SAC)
    if own is None or own.coverage is None:
        return DEEP * spec.block_width
    # with the planner's rules a cell of the mesh is as wide as a block
    return own.coverage * (spec.block_width if own.coverage_unit == "edges" else 1.0)


def served(places: FloatArray, streets: Sequence[CrossStreet], spec: Specification) -> BoolArray:
    """Whether a cul-de-sac comes near places.

    Parameters
    ----------
    places
        Shape (k, 2), metres.
    streets
        Culs-de-sac.
    spec
        Says how near is near.

    Returns
    -------
    numpy.ndarray
        Shape (k,).
    """
    lines = shapely.union_all(np.array([s.line for s in streets], dtype=object))
    if lines.is_empty or not len(places):
        return np.zeros(len(places), dtype=np.bool_)
    return np.asarray(shapely.distance(shapely.points(places), lines) <= reach_of(spec))


def culs_de_sac(
    blocks: Sequence[Block],
    spec: Specification,
    around: Surroundings,
    progress: Progress | None = None,
) -> list[CrossStreet]:
    """Find the culs-de-sac of a plan.

    Parameters
    ----------
    blocks
        The blocks of the plan.
    spec
        Block width, greatest length and turning circle of culs-de-sac, and the settings of
        their level.
    around
        Streets, the places where they end, arriving streets that are not continued, and where
        no street may run.
    progress
        Asked for cancellation before each block; what is found by then is returned.

    Returns
    -------
    list of CrossStreet
        Straight streets from their street to the blind end.
    """
    progress = progress or Silent()
    joints = [Joint((float(x), float(y))) for x, y in around.ends]
    arrivals = dict(enumerate(around.arrivals, len(joints)))
    joints += [Joint(point.xy, point.direction) for point in around.arrivals]
    found: list[CrossStreet] = []
    streets = around.streets
    for block in sorted(blocks, key=lambda b: (-b.polygon.area, b.polygon.bounds)):
        if progress.cancelled():
            break
        while True:
            ground = _Ground(block.polygon, spec, streets, around.blocked)
            stem = ground.best(joints)
            if stem is None:
                break
            found.append(CrossStreet(stem.line, arrivals.get(stem.joint), blind=True))
            joints.append(Joint((float(stem.line.coords[0][0]), float(stem.line.coords[0][1]))))
            streets = shapely.union(streets, stem.line)
    return found


@dataclass(frozen=True, eq=False)
class _Stem:
    """A cul-de-sac, and the joint that it continues, -1 for none."""

    line: LineString
    joint: int


@dataclass(frozen=True, eq=False)
class _Ways:
    """Straight ways into a block, k of them, each looked at in m places.

    Attributes
    ----------
    start, heading
        Shape (k, 2). Where they begin, metres, and unit vectors along them.
    joint
        Shape (k,). The joint that each continues, -1 for none.
    along
        Shape (m,). Distances of the places from the start, metres.
    ends
        Shape (k, m). Whether the way may end there.
    clear
        Shape (k, m). Mean distance from the sides up to there, as a share of half a block.
    """

    start: FloatArray
    heading: FloatArray
    joint: IntArray
    along: FloatArray
    ends: BoolArray
    clear: FloatArray

    @property
    def places(self) -> FloatArray:
        """Shape (k, m, 2). The places along the ways, metres."""
        return np.asarray(self.start[:, None] + self.along[None, :, None] * self.heading[:, None])


class _Ground:
    """One block with the streets around it: which ground is deep, and which ways lead there."""

    def __init__(
        self,
        polygon: Polygon,
        spec: Specification,
        streets: shapely.Geometry,
        blocked: shapely.Geometry,
    ) -> None:
        self.polygon, self.spec = polygon, spec
        self.width, self.reach = spec.block_width, reach_of(spec)
        # what lies beyond a wall or another block is near to nobody here
        own = shapely.intersection(streets, polygon.buffer(ON))
        self.streets = own
        self.blocked = shapely.intersection(blocked, polygon.buffer(self.width))
        self.spacing = SAMPLE
        self.deep = self._deep()

    def _deep(self) -> FloatArray:
        """Give samples, shape (n, 2), of the ground that no street is near."""
        if self.streets.is_empty:
            return np.zeros((0, 2))
        land = self.polygon.difference(self.blocked)
        left = land.difference(shapely.buffer(self.streets, self.reach))
        if left.area < LEAST_GROUND * self.width**2:
            return np.zeros((0, 2))
        west, south, east, north = left.bounds
        self.spacing = d = max(SAMPLE, float(np.sqrt(left.area / SAMPLES)))
        x, y = np.meshgrid(np.arange(west + d / 2, east, d), np.arange(south + d / 2, north, d))
        grid = np.column_stack([x.ravel(), y.ravel()])
        shapely.prepare(left)
        return np.asarray(grid[shapely.contains_xy(left, *grid.T)])

    def best(self, joints: Sequence[Joint]) -> _Stem | None:
        """Find the way that serves most deep ground for its length, if any is worth it."""
        if len(self.deep) * self.spacing**2 < LEAST_GROUND * self.width**2:
            return None
        ways = self._ways(joints)
        if ways is None or not ways.ends.any():
            return None
        gain = self._gain(ways)
        price = (PRICE + MIDDLE * (1 - ways.clear)) * ways.along[None, :]
        own = self.spec.level_settings.get(CUL_DE_SAC)
        if own is not None and own.weight_length is not None:
            price = price * own.weight_length
        price = price - self._continued(ways, joints)[:, None]
        worth = np.where(ways.ends & (gain >= LEAST_GROUND * self.width**2), gain - price, -np.inf)
        k, m = np.unravel_index(int(worth.argmax()), worth.shape)
        if not worth[k, m] > 0:
            return None
        line = LineString([ways.start[k], ways.places[k, m]])
        return _Stem(line, int(ways.joint[k]))

    def _continued(self, ways: _Ways, joints: Sequence[Joint]) -> FloatArray:
        """Give what it is worth to go on into a street opposite or from one that arrives, (k,)."""
        worth = np.where(ways.joint >= 0, OPPOSITE, 0.0)
        for k in np.flatnonzero(ways.joint >= 0).tolist():
            heading = joints[int(ways.joint[k])].heading
            if heading is not None:
                on = float(ways.heading[k] @ np.asarray(heading)) >= np.cos(np.radians(BEND))
                worth[k] = CONTINUED if on else 0.0
        return np.asarray(worth * self.width**2)

    def _gain(self, ways: _Ways) -> FloatArray:
        """Deep ground that each way serves if it ends at each place, square metres, (k, m)."""
        off = self.deep[None] - ways.start[:, None]
        ahead = (off * ways.heading[:, None]).sum(axis=2)
        beside = np.abs(
            off[..., 0] * ways.heading[:, None, 1] - off[..., 1] * ways.heading[:, None, 0]
        )
        half = np.sqrt(np.maximum(self.reach**2 - beside**2, 0.0))
        # a sample is served from where the street has come near enough
        needed = np.where((beside < self.reach) & (ahead > -half), ahead - half, np.inf)
        counts = [np.searchsorted(np.sort(row), ways.along, side="right") for row in needed]
        return np.array(counts, dtype=float) * self.spacing**2

    def _ways(self, joints: Sequence[Joint]) -> _Ways | None:
        """Straight ways that leave the streets of the block at a right angle."""
        outline = Outline(self.polygon, self.streets)
        near = joints_at(outline, joints)
        fixed = outline.along(np.array([joints[i].xy for i in near]).reshape(-1, 2))
        plain = np.arange(0.0, outline.length, STEP)
        if len(fixed):
            gap = np.abs(plain[:, None] - fixed[None, :])
            gap = np.minimum(gap, outline.length - gap).min(axis=1)
            plain = plain[gap >= STAGGERED * self.width]
        at = np.concatenate([plain, fixed])
        joint = np.concatenate([np.full(len(plain), -1), near]).astype(np.int64)
        free = outline.open(at)
        at, joint = at[free], joint[free]
        if not len(at):
            return None
        tangent = outline.tangents(at)
        heading = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        longest = min(self.spec.cul_de_sac_length, outline.length / 2)
        along = np.arange(SAMPLE, longest + 0.01, SAMPLE)
        if not len(along):
            return None
        return self._checked(outline.points(at), heading, joint, along)

    def _checked(
        self, start: FloatArray, heading: FloatArray, joint: IntArray, along: FloatArray
    ) -> _Ways:
        """Tell where ways may end: they keep their distances all the way up to there."""
        nothing = np.zeros((len(start), len(along)))
        ways = _Ways(start, heading, joint, along, nothing > 0, nothing)
        places = ways.places
        points = shapely.points(places)
        off = shapely.distance(points, self.polygon.boundary)
        plot, apart = PLOT * self.width, APART * self.width
        good = off >= np.minimum(LEAVES * along, plot)[None, :]
        shapely.prepare(self.polygon)
        good &= shapely.contains_xy(self.polygon, places[..., 0], places[..., 1])
        good &= shapely.distance(points, self.streets) >= np.minimum(LEAVES * along, plot)[None, :]
        away = np.full(off.shape, np.inf)
        if not self.blocked.is_empty:
            away = shapely.distance(points, self.blocked)
            # corners of obstacles may lie between two places
            before = np.concatenate([start[:, None], places[:, :-1]], axis=1)
            steps = shapely.linestrings(np.stack([before, places], axis=2))
            good &= shapely.distance(steps, self.blocked) >= OBSTACLE_CLEARANCE
        good = np.logical_and.accumulate(good, axis=1)
        side = np.stack([-heading[:, 1], heading[:, 0]], axis=1)[:, None] * apart
        late = (along >= BEGIN)[None, :]
        good &= np.logical_and.accumulate(
            ~(self._meets(places - side, places + side, good) & late), axis=1
        )
        ends = good & (off >= plot) & (along >= LEAST_LENGTH * self.width)[None, :]
        ends &= away >= self.spec.turning_radius + 1.0
        ends &= ~self._meets(places, places + heading[:, None] * apart, ends)
        clear = np.minimum(off / (self.width / 2), 1.0)
        mean = np.cumsum(clear, axis=1) / np.arange(1, len(along) + 1)[None, :]
        return dataclasses.replace(ways, ends=ends, clear=mean)

    def _meets(self, begin: FloatArray, end: FloatArray, asked: BoolArray) -> BoolArray:
        """Whether straight lines of sight (k, m) within the block meet a street, where asked."""
        hit = np.zeros(asked.shape, dtype=np.bool_)
        if asked.any():
            lines = shapely.linestrings(np.stack([begin[asked], end[asked]], axis=1))
            shapely.prepare(self.streets)
            hit[asked] = shapely.intersects(self.streets, lines)
        return hit
