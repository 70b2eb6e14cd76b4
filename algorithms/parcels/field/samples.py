"""What lines meet on their way and at their ends, for all lines at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from .crosses import CrossField
from .outline import Bools, Floats, Ints, Outline
from .streamlines import Streamlines

#: Lines are looked at in steps of this length at most (metres).
STEP = 12.0
#: Directions at ends are those of chords this long (metres).
CHORD = 3.0
#: Steps of the search for the boundary to the sides.
REACH = 28


@dataclass(frozen=True)
class Samples:
    """The middles of short segments of lines.

    Attributes
    ----------
    owner
        Which line each is of, shape (m,), ascending.
    place, along
        Middle and direction, shape (m, 2); metres, length 1.
    length
        Shape (m,), metres.
    arc
        From the start of the line to the middle, shape (m,), metres.
    """

    owner: Ints
    place: Floats
    along: Floats
    length: Floats
    arc: Floats

    def mean(self, value: Floats, count: int, use: Bools) -> Floats:
        """Mean of values over each of `count` lines by length, NaN where none is used."""
        weight = np.where(use, self.length, 0.0)
        total = np.bincount(self.owner, weight * np.where(use, value, 0.0), minlength=count)
        whole = np.bincount(self.owner, weight, minlength=count)
        return np.where(whole > 0, total / np.where(whole > 0, whole, 1.0), np.nan)


def sample(lines: Streamlines) -> Samples:
    """Cut lines into short segments."""
    dense = shapely.segmentize(lines.geometry(), STEP)
    xy, owner = shapely.get_coordinates(dense, return_index=True)
    here = np.flatnonzero(owner[1:] == owner[:-1])
    way = xy[here + 1] - xy[here]
    length = np.hypot(*way.T)
    owner = owner[here]
    passed = np.cumsum(length)
    before = np.r_[0.0, passed][np.searchsorted(owner, np.arange(len(lines)))]
    arc = passed - 0.5 * length - before[owner]
    along = way / np.maximum(length, 1e-12)[:, None]
    return Samples(owner, 0.5 * (xy[here] + xy[here + 1]), along, length, arc)


def bends(samples: Samples, count: int) -> Floats:
    """Greatest turn of each of `count` lines within some 25 m, radians, shape (count,)."""
    way = samples.along @ [1, 1j]
    turn = np.angle(way[1:] * way[:-1].conj())
    # 0 from one line to the next
    turn = np.r_[np.where(samples.owner[1:] == samples.owner[:-1], turn, 0.0), 0.0]
    both = np.maximum(np.abs(turn), np.abs(turn + np.r_[turn[1:], 0.0]))
    greatest = np.zeros(count)
    np.maximum.at(greatest, samples.owner, both)
    return greatest


def to_sides(field: CrossField, samples: Samples) -> tuple[Floats, Ints]:
    """How far it is to the boundary at right angles to the lines, and to which edge.

    Walks as far at a time as the distance to the boundary allows.

    Returns
    -------
    distance
        To the left and to the right, shape (2, m), metres.
    edge
        Number of the edge that is met, shape (2, m).
    """
    grid = field.grid
    start = np.tile(samples.place @ [1, 1j], 2)
    left = 1j * (samples.along @ [1, 1j])
    way = np.concatenate([left, -left])
    far = np.zeros(len(start))
    least = 0.5 * grid.step
    walking = np.arange(len(start))
    for _ in range(REACH):
        (inside,) = grid.take(start[walking] + far[walking] * way[walking], grid.inside)
        near = np.asarray(inside).real
        on = near > 0.25 * grid.step
        far[walking] += np.where(on, np.maximum(near, least), near)
        walking = walking[on]
        if not len(walking):
            break
    edge = grid.nearest_edge(start + far * way)
    return np.maximum(far, 0.0).reshape(2, -1), edge.reshape(2, -1)


def outward(lines: Streamlines) -> Floats:
    """Directions in which lines leave the region at their two ends, shape (n, 2, 2)."""
    first, last = lines.first[:-1], lines.first[1:] - 1
    xy = lines.points
    way = np.stack([xy[first] - xy[first + 1], xy[last] - xy[last - 1]], axis=1)
    return np.asarray(way / np.maximum(np.linalg.norm(way, axis=2, keepdims=True), 1e-12))


def ends(lines: Streamlines) -> Floats:
    """End points of lines, shape (n, 2, 2), metres."""
    return np.stack([lines.points[lines.first[:-1]], lines.points[lines.first[1:] - 1]], axis=1)


def meeting_angles(lines: Streamlines, edges: Outline) -> Floats:
    """Smaller angle inside the region between lines and the boundary at their ends.

    Straight on at the corner of a notch is no small angle: there are two boundaries, at 90 and
    180 degrees.

    Returns
    -------
    angle
        Shape (n, 2), degrees.
    """
    inward = -outward(lines)
    place = ends(lines)
    passed = np.r_[0.0, np.cumsum(edges.length)]
    number = edges.first[lines.ring] + lines.edge
    arc = passed[number] + lines.t * edges.length[number]
    low, high = passed[edges.first[lines.ring]], passed[edges.first[lines.ring + 1]]
    found = np.full(lines.ring.shape, 180.0)

    for sense in (CHORD, -CHORD):
        at = low + (arc + sense - low) % np.maximum(high - low, 1e-9)
        edge = np.clip(np.searchsorted(passed, at, side="right") - 1, 0, len(edges.start) - 1)
        t = (at - passed[edge]) / np.maximum(edges.length[edge], 1e-12)
        point = edges.start[edge] + t[..., None] * (edges.end[edge] - edges.start[edge])
        way = point - place
        cosine = (way * inward).sum(-1) / np.maximum(np.linalg.norm(way, axis=-1), 1e-12)
        found = np.minimum(found, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return found
