"""Rows of parking bays that have room along the streets of a patch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from ..types import Floats
from .taken import Shapes, Taken, street_sides

#: Streets that bend no more than this are straight for bays, metres.
STRAIGHT = 0.3
#: Where a street turns by more than this there is a corner, degrees ...
TURN = 20.0
#: ... from which bays keep away, so that drivers see each other, metres.
CORNER = 6.0
#: Bays keep so much away from buildings and from paths, metres.
FROM_BUILDING, FROM_PATH = 1.0, 0.5


@dataclass(frozen=True)
class BayKind:
    """How cars stand.

    Attributes
    ----------
    along, deep
        Size of a bay along the street and away from it, metres.
    most, least
        Most and fewest bays in a row; a tree has room between rows.
    """

    along: float
    deep: float
    most: int
    least: int


#: Cars at right angles to the street, and cars along it where there is little room.
ACROSS = BayKind(2.5, 5.0, 10, 3)
ALONG = BayKind(5.5, 2.0, 5, 1)


@dataclass(frozen=True, eq=False)
class Row:
    """A row of bays.

    Attributes
    ----------
    corner
        Its first corner on the street side, metres, shape (2,).
    way, inward
        Unit vectors along the street and into the patch, shape (2,).
    places
        Number of bays.
    kind
        How cars stand.
    patch
        Index of the patch.
    ground
        The patch, which the row does not leave.
    """

    corner: Floats
    way: Floats
    inward: Floats
    places: int
    kind: BayKind
    patch: int
    ground: Polygon

    @property
    def length(self) -> float:
        """Length along the street, metres."""
        return self.places * self.kind.along

    @property
    def middle(self) -> Floats:
        """Middle of the row, shape (2,)."""
        middle = self.corner + self.way * self.length / 2 + self.inward * self.kind.deep / 2
        return np.asarray(middle)

    @property
    def polygon(self) -> Polygon:
        """Outline; along bent streets the patch cuts a little of it off."""
        box = _boxes(self.corner[None], self.way, self.inward, self.length, self.kind.deep)[0]
        if shapely.covers(self.ground, box):
            return box
        parts = shapely.get_parts(shapely.intersection(box, self.ground))
        return max(parts, key=shapely.area)

    def ends(self, beyond: float, inside: float) -> Floats:
        """Give places `beyond` its two ends and so far `inside` the patch, metres, shape (2, 2)."""
        base = self.corner + self.inward * inside
        return np.array([base - self.way * beyond, base + self.way * (self.length + beyond)])

    def shortened(self, places: int) -> Row:
        """Return the row with fewer bays."""
        return Row(self.corner, self.way, self.inward, places, self.kind, self.patch, self.ground)


def rows_of_patch(
    access: shapely.MultiLineString,
    patch: int,
    kind: BayKind,
    taken: Taken,
    blocked: shapely.STRtree,
) -> list[Row]:
    """Find rows of bays along the streets of a patch.

    Parameters
    ----------
    access
        Parts of its ring along street space.
    patch
        Its index.
    kind
        How cars stand.
    taken
        For the ground of the patch.
    blocked
        What bays must not touch.
    """
    ground = taken.ground[patch]
    found = []
    for line in street_sides(access):
        for corner, way, inward, length in _straights(line, ground, kind):
            count = int(length / kind.along + 1e-9)
            if count < kind.least:
                continue
            first = corner + way * (length - count * kind.along) / 2
            steps = np.arange(count, dtype=float)[:, None] * kind.along
            starts = np.asarray(first + way * steps, dtype=float)
            boxes = _boxes(starts, way, inward, kind.along, kind.deep)
            inside = shapely.area(shapely.intersection(boxes, ground))
            free = inside >= kind.along * (kind.deep - STRAIGHT)
            free[np.unique(blocked.query(boxes, predicate="intersects")[0])] = False
            for at, places in _rows_in(free, kind):
                found.append(Row(starts[at], way, inward, places, kind, patch, ground))
    return found


def _straights(
    line: Floats, ground: Polygon, kind: BayKind
) -> list[tuple[Floats, Floats, Floats, float]]:
    """Give corner, way, direction into the patch and length of what is straight and no corner."""
    xy = shapely.get_coordinates(
        shapely.simplify(shapely.linestrings(line), STRAIGHT, preserve_topology=True)
    )
    step = np.diff(xy, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    keep = length > 0
    xy, step, length = xy[np.append(keep, True)], step[keep], length[keep]
    ways = step / length[:, None]
    trims = _trims(ways, bool(np.allclose(xy[0], xy[-1])), kind)
    found = []
    for k, way in enumerate(ways):
        room = length[k] - trims[k] - trims[k + 1]
        if room < kind.along:
            continue
        left = np.array([-way[1], way[0]])
        middle = (xy[k] + xy[k + 1]) / 2
        inside = shapely.contains_xy(ground, *(middle + left))
        inward = left if inside else -left
        found.append((xy[k] + way * trims[k], way, inward, float(room)))
    return found


def _trims(ways: Floats, closed: bool, kind: BayKind) -> Floats:
    """Tell what bays leave free at each vertex of a line, metres, shape (m,)."""
    turn = np.zeros(len(ways) + 1)
    cross = ways[:-1, 0] * ways[1:, 1] - ways[:-1, 1] * ways[1:, 0]
    turn[1:-1] = np.arctan2(np.abs(cross), (ways[:-1] * ways[1:]).sum(axis=1))
    ends = np.arctan2(
        abs(ways[-1, 0] * ways[0, 1] - ways[-1, 1] * ways[0, 0]), float(ways[-1] @ ways[0])
    )
    if closed:
        turn[[0, -1]] = ends
    trims = np.where(turn > np.radians(TURN), CORNER, kind.deep * np.tan(turn / 2))
    if not closed:
        # where the street leaves the patch another one or a neighbour begins
        trims[[0, -1]] = 1.0
    return np.asarray(trims)


def _rows_in(free: npt.NDArray[np.bool_], kind: BayKind) -> list[tuple[int, int]]:
    """Cut free bays into rows with a gap of one bay between them: (first, number) each."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], free.astype(int), [0]])))
    found = []
    for begin, end in edges.reshape(-1, 2):
        rows = -(-(end - begin + 1) // (kind.most + 1))
        bays = end - begin - (rows - 1)
        at = int(begin)
        for k in range(rows):
            places = int(bays // rows + (k < bays % rows))
            if places >= kind.least:
                found.append((at, places))
            at += places + 1
    return found


def _boxes(starts: Floats, way: Floats, inward: Floats, along: float, deep: float) -> Shapes:
    """Give rectangles from their first corners, shape (n,)."""
    u, v = way * along, inward * deep
    ring = np.stack([starts, starts + u, starts + u + v, starts + v, starts], axis=1)
    made: Shapes = shapely.normalize(shapely.polygons(ring))
    return made
