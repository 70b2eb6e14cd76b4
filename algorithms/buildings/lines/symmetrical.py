"""Symmetrical pattern: rows in mirrored pairs on both sides of an axis."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from ..types import Floats
from .draft import Draft, row
from .need import Need
from .room import Room
from .rows import LEAST, MOST, row_lines

#: Green on both sides of the path along the axis, metres.
AVENUE = 8.0
#: How much less an axis across the rows may be a mirror of the patch to be taken, since both
#: its sides have the same sun.
ACROSS = 0.1
#: Rows without a mirror come so many ranks later.
AFTER = 4
#: Places of the axis that are compared, as shares of the extent.
PLACES = np.linspace(0.35, 0.65, 13)


@dataclass(frozen=True)
class Axis:
    """A mirror axis, square or parallel to the rows.

    Attributes
    ----------
    across
        True if it runs across the rows (u is mirrored), False if along them (v is).
    at
        Its u, or its v, in the frame of the rows, metres.
    """

    across: bool
    at: float

    def mirrored(self, room: Room, shape: BaseGeometry) -> BaseGeometry:
        """Mirror a geometry of the working CRS."""
        column = 0 if self.across else 1

        def flip(xy: Floats) -> Floats:
            uv = room.local(xy)
            uv[:, column] = 2 * self.at - uv[:, column]
            return room.world(uv)

        turned: BaseGeometry = shapely.transform(shape, flip)
        return turned


def axis_of(need: Need) -> Axis:
    """Choose the mirror axis of a patch.

    Of axes across and along the rows at several places the one that maps most of the ground on
    itself; across the rows where both do nearly as well.

    Parameters
    ----------
    need
        The patch and what is asked of it.

    Returns
    -------
    Axis
    """
    low_u, low_v, high_u, high_v = need.room.bounds
    ground = shapely.simplify(need.ground, 0.5)
    tried = []
    for across, low, high in ((True, low_u, high_u), (False, low_v, high_v)):
        for place in PLACES:
            axis = Axis(across, float(low + place * (high - low)))
            twin = axis.mirrored(need.room, ground)
            share = ground.intersection(twin).area / max(ground.area, 1e-9)
            tried.append((round(share + ACROSS * across, 3), -abs(place - 0.5), axis))
    return max(tried, key=lambda item: item[:2])[2]


def symmetrical_lines(need: Need, axis: Axis | None = None) -> list[Draft]:
    """Draw rows in mirrored pairs (RZ Table 3, symmetry); the axis itself stays free.

    Parameters
    ----------
    need
        The patch and what is asked of it.
    axis
        The mirror axis, None for that of `axis_of`.

    Returns
    -------
    list of Draft
        Pairs first, each line beside its mirror; then rows where only one side has ground.
    """
    axis = axis_of(need) if axis is None else axis
    twin = axis.mirrored(need.room, need.ground)
    half = AVENUE / 2 + need.rules.path_m
    if not axis.across:
        # rows on both sides of the axis see each other, so the sun has to come in between
        half = max(half, (float(need.pitch.max()) - need.deepest) / 2)
    both = need.ground.intersection(twin)
    mutual = _beyond(need, both, axis, half)
    rest = replace(need, ground=_areas(need.ground.difference(both)))
    share = mutual.ground.area / max(mutual.ground.area + rest.ground.area / 2, 1e-9)
    pairs: list[Draft] = []
    for line in row_lines(mutual, most=round(MOST * share / 2)):
        ends = need.room.local(np.array([line.start, line.end]))
        span = _off(axis, ends[:, 0], half + need.shortest / 2)
        if span is not None:
            pairs += _pair(need.room, axis, float(ends[0, 1]), span, line.rank, len(pairs))
    single = row_lines(rest, most=max(MOST - len(pairs), LEAST))
    return pairs + [replace(line, rank=line.rank + AFTER) for line in single]


def _beyond(need: Need, ground: BaseGeometry, axis: Axis, half: float) -> Need:
    """Reduce a need to the ground on the far side of the axis and its avenue."""
    low_u, low_v, high_u, high_v = need.room.bounds
    box = [low_u - 1.0, low_v - 1.0, high_u + 1.0, high_v + 1.0]
    box[0 if axis.across else 1] = axis.at + half
    sides = shapely.transform(shapely.box(*box), need.room.world) if box[2] > box[0] else None
    piece = ground.intersection(sides) if sides is not None and box[3] > box[1] else Polygon()
    return replace(need, ground=_areas(piece))


def _off(axis: Axis, span: Floats, least: float) -> tuple[float, float] | None:
    """Let a row begin so far from an axis across it; by the shortest type, so that it has room."""
    if not axis.across:
        return float(span[0]), float(span[1])
    low = max(float(span[0]), axis.at + least)
    return (low, float(span[1])) if span[1] > low else None


def _pair(
    room: Room, axis: Axis, v: float, span: tuple[float, float], rank: int, number: int
) -> list[Draft]:
    """Draw a row and its mirror; `number` is the index of the first."""
    one = row(room, v, span, rank)
    if axis.across:
        two = row(room, v, (2 * axis.at - span[0], 2 * axis.at - span[1]), rank)
    else:
        two = row(room, 2 * axis.at - v, span, rank)
    return [replace(one, mirror=number + 1), replace(two, mirror=number)]


def _areas(shape: BaseGeometry) -> MultiPolygon:
    """Keep what has an area of a geometry."""
    return MultiPolygon([part for part in shapely.get_parts(shape) if part.area > 0])
