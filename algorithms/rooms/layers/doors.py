"""One door for each room, where it meets a corridor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import Polygon

from ...errors import InputError
from ...mesh.quadmesh import FloatArray, IntArray
from ..types import RoomPlan, RoomProblem
from .distance import point_distances
from .width import Ground, corridor_edges

CORNER = 0.3
"""Metres of wall between a door and a corner."""
STEP = 0.25
"""Places for a door are tried in steps of this many metres."""
LEVEL = 0.5
"""Where all places along a wall are as far from a sink within this many metres, the middle is."""
SHORT = 1.0
"""A door has its place in the middle of a wall that leaves it less room than this, metres."""
STAGGER = 1.5
"""Doors that face each other are brought into line if they are off by less, metres."""
SAG = 0.02
"""A wall that bends by less than this, metres, is straight enough for a door."""
OPPOSITE = -math.cos(math.radians(5.0))
"""Doors face each other where the product of unit vectors along their walls is at most this."""
_SIDES = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")


@dataclass(frozen=True, eq=False)
class Door:
    """A door; its room lies to the left of `start` to `end`.

    Attributes
    ----------
    room, corridor
        Places in `Ground.rooms` and `Ground.corridors`.
    start, end
        Shape (2,). Ends of the straight wall that it is in, metres.
    at
        Distance of its middle from `start`, metres.
    low, high
        Least and largest such distance that leaves the corners free.
    width
        Metres; less than asked where the wall is shorter.
    """

    room: int
    corridor: int
    start: FloatArray
    end: FloatArray
    at: float
    low: float
    high: float
    width: float

    @property
    def way(self) -> FloatArray:
        """Unit vector along the wall, shape (2,)."""
        along: FloatArray = (self.end - self.start) / np.hypot(*(self.end - self.start))
        return along

    @property
    def middle(self) -> FloatArray:
        """Where it is, shape (2,), metres."""
        return self.start + self.at * self.way

    @property
    def out(self) -> FloatArray:
        """Unit vector from the room into the corridor, shape (2,)."""
        return np.array([self.way[1], -self.way[0]])

    @property
    def rotation(self) -> float:
        """Direction out of the room in degrees clockwise from north, 0 to 360."""
        return math.degrees(math.atan2(float(self.out[0]), float(self.out[1]))) % 360.0

    @property
    def side(self) -> str:
        """Side of the room that it is on, as a point of the compass."""
        return _SIDES[round(self.rotation / 45.0) % 8]

    @property
    def line(self) -> FloatArray:
        """Ends of its opening, shape (2, 2), metres."""
        half = self.width / 2 * self.way
        return np.array([self.middle - half, self.middle + half])


def place_doors(
    problem: RoomProblem, plan: RoomPlan, ground: Ground, far: FloatArray, width: float = 0.9
) -> list[Door]:
    """Give each room a door in its longest wall to a corridor.

    There it is as near to a sink as the corners allow, or in the middle where the wall is short
    or all its places are as far. Doors that nearly face each other are brought into line.

    Parameters
    ----------
    problem, plan
        A floor and its plan, metres.
    ground
        From `widen`.
    far
        Shape (n,). From `distance.vertex_distances`.
    width
        Of doors, metres, greater than 0.

    Returns
    -------
    list of Door
        One per room, in the order of `Ground.rooms`.

    Raises
    ------
    InputError
        If a room has no wall to a corridor (CND eq. 17), or the width is no length.
    """
    if not (math.isfinite(width) and width > 0):
        raise InputError(f"The door width is {width} m.", "It must be greater than 0.")
    owner = {
        key: k for k, corridor in enumerate(ground.corridors) for key, *_ in _segments(corridor)
    }
    active = corridor_edges(problem, plan)
    doors = []
    for k, room in enumerate(ground.rooms):
        rim = np.array(problem.placements.rim[plan.rooms[k]], dtype=np.int64)
        own = rim[active[rim]]
        walls = _walls(room, owner)
        if not len(own) or not walls:
            raise InputError(
                f"Room {k + 1} does not touch a corridor.", "Let the plan be made again."
            )
        doors.append(_best(problem, far, k, walls, own, width))
    return _in_line(doors, _clear_width(ground, doors))


_Segment = tuple[tuple[float, float], tuple[float, float]]


def _segments(polygon: Polygon) -> list[tuple[_Segment, FloatArray, FloatArray]]:
    """Return key, start and end of each side, the polygon on its left, ring by ring."""
    found = []
    turned = shapely.orient_polygons(polygon)
    for ring in (turned.exterior, *turned.interiors):
        points = np.asarray(ring.coords)[:, :2]
        for a, b in zip(points, points[1:]):
            p, q = (float(a[0]), float(a[1])), (float(b[0]), float(b[1]))
            found.append(((min(p, q), max(p, q)), a, b))
    return found


def _walls(room: Polygon, owner: dict[_Segment, int]) -> list[tuple[FloatArray, FloatArray, int]]:
    """Return the straight walls of a room at corridors: start, end and corridor of each."""
    runs: list[tuple[list[FloatArray], int]] = []
    for key, a, b in _segments(room):
        if key not in owner:
            continue
        if runs and runs[-1][1] == owner[key] and _goes_on(runs[-1][0], [a, b]):
            runs[-1][0].append(b)
        else:
            runs.append(([a, b], owner[key]))
    # a ring may begin in the midst of a wall
    for points, corridor in runs[:-1]:
        if runs[-1][1] == corridor and _goes_on(runs[-1][0], points):
            points[:0] = runs.pop()[0][:-1]
            break
    return [(points[0], points[-1], corridor) for points, corridor in runs]


def _goes_on(run: list[FloatArray], more: list[FloatArray]) -> bool:
    """Tell whether points continue a wall straight on, but for what a door does not notice."""
    if not np.array_equal(run[-1], more[0]):
        return False
    points = np.array([*run, *more[1:]])
    chord = points[-1] - points[0]
    length = float(np.hypot(*chord))
    steps = np.diff(points, axis=0)
    if length == 0 or (steps @ chord <= 0).any():
        return False
    off = points - points[0]
    sag = np.abs(off[:, 0] * chord[1] - off[:, 1] * chord[0]) / length
    return bool(sag.max() <= SAG)


def _best(
    problem: RoomProblem,
    far: FloatArray,
    room: int,
    walls: Sequence[tuple[FloatArray, FloatArray, int]],
    edges: IntArray,
    width: float,
) -> Door:
    """Return the door of a room: the longest wall, there the place nearest to a sink."""
    mesh = problem.network.mesh
    lengths = [float(np.hypot(*(b - a))) for a, b, _ in walls]
    found = []
    for (a, b, corridor), length in zip(walls, lengths):
        # walls of one length differ by rounding
        if length < max(lengths) - 1e-6:
            continue
        own = min(width, length)
        low = own / 2 + min(CORNER, (length - own) / 2)
        high = max(low, length - low)
        middle = (low + high) / 2
        count = 2 * math.ceil((high - low) / (2 * STEP)) + 1
        places = np.linspace(low, high, count)
        points = a + places[:, None] * (b - a) / length
        walked = point_distances(mesh, far, points, edges)
        at = float(places[walked.argmin()])
        same = not np.isfinite(walked).all() or np.ptp(walked) <= LEVEL
        if same or high - low < SHORT:
            at = middle
        found.append((float(walked.min()), Door(room, corridor, a, b, at, low, high, own)))
    return min(found, key=lambda pair: pair[0])[1]


def _clear_width(ground: Ground, doors: Sequence[Door]) -> float:
    """Return how far opposite walls of a corridor are from each other at most, metres."""
    used = {door.corridor for door in doors}
    radii = [shapely.maximum_inscribed_circle(ground.corridors[k]).length for k in sorted(used)]
    return 2.0 * max(radii, default=0.0)


def _in_line(doors: list[Door], width: float) -> list[Door]:
    """Bring doors into line that nearly face each other across a corridor."""
    doors, done = list(doors), set()
    for i, j in combinations(range(len(doors)), 2):
        one, two = doors[i], doors[j]
        if i in done or j in done or one.corridor != two.corridor or one.way @ two.way > OPPOSITE:
            continue
        off = two.middle - one.middle
        across, shift = float(off @ one.out), float(off @ one.way)
        if not 0 < across <= width * 1.1 or abs(shift) > STAGGER:
            continue
        if one.low <= one.at + shift <= one.high:
            doors[i] = replace(one, at=one.at + shift)
        elif two.low <= two.at + shift <= two.high:
            # its wall runs the other way, so that the same shift brings it back
            doors[j] = replace(two, at=two.at + shift)
        else:
            continue
        done |= {i, j}
    return doors
