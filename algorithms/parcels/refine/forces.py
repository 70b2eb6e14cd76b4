"""What pulls at parcels: square corners, straight T-junctions, areas, small rectangles around.

UP section 6 optimises streets and leaves parcels to templates that are warped again. Here parcels
themselves are fitted, by nonlinear least squares on what UP section 7 and Fig. 12 judge them by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .layout import Layout, Placed
from .mesh import Flags, Floats, Ints, starts, total

#: Vertices at which outlines turn by less than this at first should be straight (degrees).
BLUNT = 30.0
#: How far along a curved rail its direction is taken (metres).
AHEAD = 6.0
#: Parcels are gathered by their number of corners, up to these; those with more have no pull on
#: their rectangle.
SIZES = (4, 6, 8, 12)
#: Fewer parcels than this are gathered with those of the next size: a call costs more than they do.
FEW = 60
#: Times a swapped pair of coordinates: a quarter turn to the left.
SIDEWAYS = np.array([-1.0, 1.0])


@dataclass(frozen=True)
class Weights:
    """What counts how much beside corners, whose cosines count 1.

    Attributes
    ----------
    area
        Relative error of the area of a plot.
    rectangle
        Excess of the ratio of the rectangle around a parcel to its area over `room`.
    room
        See `rectangle`.
    """

    area: float = 0.6
    rectangle: float = 2.5
    room: float = 1.08


@dataclass(frozen=True)
class Pull:
    """Residuals with their derivatives.

    Attributes
    ----------
    turn
        Cosines of corners and sines of straight vertices, shape (r,).
    by
        Derivatives by the vertex before, at and after, shape (r, 3, 2), per metre.
    size
        Weighted relative errors of area, per plot, shape (f,).
    size_by
        Derivatives by each vertex of the outline, shape (m, 2), per metre.
    room
        Weighted excess of the rectangle around, per plot, shape (f,).
    room_by
        Derivatives by each vertex of the outline, shape (m, 2), per metre.
    """

    turn: Floats
    by: Floats
    size: Floats
    size_by: Floats
    room: Floats
    room_by: Floats


class Forces:
    """Residuals of a layout.

    Parameters
    ----------
    layout
        The outlines.
    parcel, moving
        Faces that should become good parcels; these and those that only keep their size,
        shape (f,).
    target
        Area wished for of each face, shape (f,), m2.
    weights
        What counts how much.
    """

    def __init__(
        self, layout: Layout, parcel: Flags, moving: Flags, target: Floats, weights: Weights
    ) -> None:
        self.layout, self.weights = layout, weights
        member = np.flatnonzero(moving[layout.face])
        number = np.full(len(layout.face), -1)
        number[member] = np.arange(len(member))
        self.after = number[layout.after[member]]
        self.before = number[layout.before[member]]
        self.vertex = layout.vertex[member]
        self.face = layout.face[member]
        self.tail, self.head = layout.tail[member], layout.head[member]
        self.along = layout.rail[member] >= 0
        self.parcel, self.target = parcel, target
        #: members with a corner of a parcel
        self.row = np.flatnonzero(parcel[self.face])
        vertex = self.vertex
        self.rows = np.stack(
            [vertex[self.before[self.row]], vertex[self.row], vertex[self.after[self.row]]], axis=1
        )
        self.corner = np.ones(len(self.row), bool)
        self._pad(parcel, layout.ring[member])
        self._reach()
        _, _, cosine, sine, _, _ = self._angles(layout.place(layout.begin()))
        self.corner = np.degrees(np.arctan2(np.abs(sine), cosine)) < 180.0 - BLUNT

    def _pad(self, parcel: Flags, ring: Ints) -> None:
        """Collect the corners of parcels without holes as rows of one array, see `_rectangle`."""
        corners = np.bincount(self.face, minlength=len(parcel))
        first = starts(ring)
        rings = np.bincount(self.face[first], minlength=len(parcel))
        #: faces of one ring, and how many corners each has
        self.simple, self.corners = rings == 1, corners
        #: faces, and their members padded to rows: the last corner is repeated, so that the
        #: edges are those of the outline and some of no length
        self.boxes: list[tuple[Ints, Ints]] = []
        least = 2
        for most in SIZES:
            fit = parcel & self.simple & (corners > least) & (corners <= most)
            boxed = np.flatnonzero(fit)
            if len(boxed) < FEW and most < SIZES[-1]:
                continue
            least = most
            step = np.minimum(np.arange(most), corners[boxed][:, None] - 1)
            if len(boxed):
                self.boxes.append((boxed, np.searchsorted(self.face, boxed)[:, None] + step))

    def _reach(self) -> None:
        """Find what both edges at corners of parcels reach for, those before first."""
        row, before = self.row, self.before[self.row]
        self.far = np.concatenate([self.rows[:, 0], self.rows[:, 2]])
        edge = np.concatenate([before, row])
        #: edges that run along a rail, the stops at the corner and at the other end
        self.railed = np.flatnonzero(self.along[edge])
        on = edge[self.railed]
        first = self.railed < len(row)
        self.here_stop = np.where(first, self.head[on], self.tail[on])
        self.far_stop = np.where(first, self.tail[on], self.head[on])
        rails = self.layout.rails
        self.rail_here = rails.rail[self.here_stop]
        self.edges_along = np.flatnonzero(self.along)
        self.tail_along, self.head_along = self.tail[self.along], self.head[self.along]

    def _angles(self, placed: Placed) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
        """Give unit vectors of both edges at corners of parcels, cosine, sine, 1 / both lengths."""
        s, count = placed.state.s, len(self.row)
        to = placed.xy[self.far]
        # along rails at most `AHEAD` m on
        here = s[self.here_stop]
        way = np.minimum(np.maximum(s[self.far_stop] - here, -AHEAD), AHEAD)
        to[self.railed] = self.layout.rails.point(self.rail_here, here + way)[0]
        at = placed.xy[self.rows[:, 1]]
        to[:count] -= at
        to[count:] -= at
        one = 1.0 / np.maximum(np.sqrt(to[:, 0] ** 2 + to[:, 1] ** 2), 1e-9)
        to *= one[:, None]
        # directions of rails are taken as fixed
        one[self.railed] = 0.0
        a, b = to[:count], to[count:]
        cosine = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
        sine = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        return a, b, cosine, sine, one[:count], one[count:]

    def areas(self, placed: Placed) -> Floats:
        """Areas of all faces that move, 0 for others, shape (f,), m2."""
        p = placed.xy[self.vertex]
        q = p[self.after]
        swept = 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
        until = placed.until
        swept[self.edges_along] = until[self.head_along] - until[self.tail_along]
        return total(self.face, swept, len(self.target))

    def doubtful(self, placed: Placed) -> Flags:
        """Which faces may have folded, shape (f,): those not seen as a whole from their middle.

        An outline without bends that turns once round its middle, always to the left, is simple.
        """
        p = placed.xy[self.vertex]
        count = len(self.target)
        many = np.maximum(self.corners, 1)
        x = p[:, 0] - (total(self.face, p[:, 0], count) / many)[self.face]
        y = p[:, 1] - (total(self.face, p[:, 1], count) / many)[self.face]
        nx, ny = x[self.after], y[self.after]
        back = x * ny - y * nx <= 0.0
        begin, end, _ = self.layout.bends(placed, self.tail_along, self.head_along)
        back[self.edges_along] |= begin <= end
        rounds = total(self.face, (y < 0) & (ny >= 0), count)
        return np.asarray(~self.simple | (rounds != 1) | (total(self.face, back, count) > 0))

    def _size_by(self, xy: Floats) -> Floats:
        """Give derivatives of the areas by the vertices, shape (m, 2), metres."""
        here = xy[self.vertex]
        straight = ~self.along
        to_last = (xy[self.vertex[self.before]] - here) * straight[self.before][:, None]
        to_next = (xy[self.vertex[self.after]] - here) * straight[:, None]
        turned = [to_next[:, 1] - to_last[:, 1], to_last[:, 0] - to_next[:, 0]]
        return np.asarray(0.5 * np.stack(turned, axis=1))

    def _rectangle(self, xy: Floats, padded: Ints) -> tuple[Floats, Ints, Floats]:
        """Ratio of the least rectangle along an edge to the area, and what it hangs on.

        Returns
        -------
        ratio
            Of each row of `padded`, shape (k,).
        hold
            Columns of `padded`: begin and end of the edge, both extremes along it, both across,
            shape (k, 6).
        sides
            Both sides of the rectangle and the area without bends, shape (k, 3).
        """
        corners = xy[self.vertex[padded]]
        most = padded.shape[1]
        x, y = corners[..., 0], corners[..., 1]
        nxt = np.append(np.arange(1, most), 0)
        nx, ny = x[:, nxt], y[:, nxt]
        ex, ey = nx - x, ny - y
        length = np.sqrt(ex**2 + ey**2)
        one = 1.0 / np.maximum(length, 1e-9)
        ex, ey = ex * one, ey * one
        along = x[:, None, :] * ex[:, :, None] + y[:, None, :] * ey[:, :, None]
        across = y[:, None, :] * ex[:, :, None] - x[:, None, :] * ey[:, :, None]
        width, depth = np.ptp(along, axis=2), np.ptp(across, axis=2)
        best = np.where(length > 0.5, width * depth, np.inf).argmin(axis=1)
        row = np.arange(len(best))
        mine, other = along[row, best], across[row, best]
        hold = np.stack(
            [
                best,
                (best + 1) % most,
                mine.argmin(axis=1),
                mine.argmax(axis=1),
                other.argmin(axis=1),
                other.argmax(axis=1),
            ],
            axis=1,
        )
        # one after the other, so that repeated corners change no bit
        area = (0.5 * (x * ny - y * nx)).cumsum(axis=1)[:, -1]
        sides = np.stack([width[row, best], depth[row, best], np.maximum(area, 1.0)], axis=1)
        return sides[:, 0] * sides[:, 1] / sides[:, 2], hold, sides

    def energy(self, pull: Pull) -> Floats:
        """Sum of squares by block, shape (b,)."""
        block = self.layout.mesh.block_of_face
        blocks = len(self.layout.mesh.sound)
        found = total(block[self.face[self.row]], pull.turn**2, blocks)
        return found + total(block, pull.size**2 + pull.room**2, blocks)

    def _size(self, area: Floats) -> Floats:
        """Weighted relative errors of area, shape (f,)."""
        wished = self.target > 0
        return np.where(
            wished, self.weights.area * (area / np.where(wished, self.target, 1.0) - 1.0), 0.0
        )

    def pull(self, placed: Placed, area: Floats) -> Pull:
        """Residuals and derivatives.

        Parameters
        ----------
        placed
            Where things are.
        area
            See `areas`.
        """
        xy = placed.xy
        a, b, cosine, sine, by_a, by_b = self._angles(placed)
        corner = self.corner[:, None]
        turned_b = b[:, ::-1] * -SIDEWAYS
        turned_a = a[:, ::-1] * SIDEWAYS
        c, s = cosine[:, None], sine[:, None]
        first = np.where(corner, b - c * a, turned_b - s * a) * by_a[:, None]
        last = np.where(corner, a - c * b, turned_a - s * b) * by_b[:, None]
        wished = np.where(self.target > 0, self.weights.area / np.maximum(self.target, 1e-9), 0.0)
        area_by = self._size_by(xy)
        room, room_by = np.zeros(len(self.target)), np.zeros((len(self.vertex), 2))
        for boxed, padded in self.boxes:
            self._add_room(xy, area_by, boxed, padded, room, room_by)
        return Pull(
            np.where(self.corner, cosine, sine),
            np.stack([first, -first - last, last], axis=1),
            self._size(area),
            area_by * wished[self.face][:, None],
            room,
            room_by,
        )

    def _add_room(
        self, xy: Floats, area_by: Floats, boxed: Ints, padded: Ints, excess: Floats, by: Floats
    ) -> None:
        """Add the residuals of some rectangles and their derivatives, see `Pull`."""
        ratio, hold, sides = self._rectangle(xy, padded)
        tight = np.flatnonzero(ratio > self.weights.room)
        if not len(tight):
            return
        width, depth, area = sides[tight].T
        excess[boxed[tight]] = self.weights.rectangle * (ratio[tight] - self.weights.room)
        member = np.take_along_axis(padded[tight], hold[tight], axis=1)
        corner = xy[self.vertex[member]]
        edge = corner[:, 1] - corner[:, 0]
        one = 1.0 / np.maximum(np.sqrt(edge[:, 0] ** 2 + edge[:, 1] ** 2), 1e-9)
        way = edge * one[:, None]
        side = way[:, ::-1] * SIDEWAYS
        # turning the edge turns the rectangle
        wide, deep = corner[:, 3] - corner[:, 2], corner[:, 5] - corner[:, 4]
        turn = (
            (wide[:, 0] * side[:, 0] + wide[:, 1] * side[:, 1]) * depth
            - (deep[:, 0] * way[:, 0] + deep[:, 1] * way[:, 1]) * width
        ) * one
        scale = (self.weights.rectangle / area)[:, None]
        grow = [side * (turn[:, None] * scale), way * (depth[:, None] * scale)]
        grow.append(side * (width[:, None] * scale))
        begin, end = member[:, 0::2].T.ravel(), member[:, 1::2].T.ravel()
        value = np.concatenate(grow)
        for axis in range(2):
            by[:, axis] += total(end, value[:, axis], len(by))
            by[:, axis] -= total(begin, value[:, axis], len(by))
        factor = np.zeros(len(self.target))
        factor[boxed[tight]] = self.weights.rectangle * ratio[tight] / area
        by -= area_by * factor[self.face][:, None]
