"""Centric pattern: rings of buildings around a green middle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPolygon, Polygon

from ..types import Floats
from .draft import Draft, pair, row
from .enclosed import wished_azimuth
from .need import Need, azimuth_of, outward, turn_between
from .rows import MOST, row_lines
from .sides import middle_of

#: Of the half depth of the patch, so much is the radius of the green middle, at least.
GREEN = 0.3
#: How round rings are: radius of their corners as a share of their half depth.
ROUND = 0.6
#: Slabs follow the ring while they look less than this away from the equator, degrees; towers,
#: which look the same from all sides, turn less.
TURN_SLAB, TURN_TOWER = 60.0, 30.0
#: Shortest chord of a ring, metres, and by the longest façade.
CHORD, CHORDS = 30.0, 1.3
#: A ring has so many chords at most.
MOST_CHORDS = 16
#: Ground outside of the rings with more than this share of the patch gets rows.
ARM = 0.1
#: Corners of the ring that turn less than this are none, degrees.
STRAIGHT = 2.0


def centric_lines(need: Need) -> list[Draft]:
    """Draw the chords of concentric rings (RZ Table 3, centric).

    Parameters
    ----------
    need
        The patch and what is asked of it.

    Returns
    -------
    list of Draft
        Ring by ring from outside, each from the side of the balconies.
    """
    part = need.parts[0]
    centre, radius = middle_of(part)
    spacing = max(float(need.pitch.max()) / 2, need.deepest + need.rules.gap_m)
    drafts: list[Draft] = []
    depth, rank = need.deepest / 2, 0
    while rank == 0 or radius - depth >= max(GREEN * radius, need.longest):
        for chord in chords(need, _ring(part, depth, radius), centre):
            drafts += _on_chord(need, chord, rank)
        depth, rank = depth + spacing, rank + 1
    return drafts + _beyond(need, _ring(part, 0.0, radius), rank)


def _beyond(need: Need, round_: Polygon, rank: int) -> list[Draft]:
    """Draw rows on arms and pieces of the ground that no ring reaches."""
    left = shapely.get_parts(need.ground.difference(round_.buffer(need.deepest / 2)))
    arms = [arm for arm in left if arm.area > ARM * need.ground.area]
    if not arms:
        return []
    rows = row_lines(replace(need, ground=MultiPolygon(arms)), most=MOST // 2)
    return [replace(line, rank=line.rank + rank) for line in rows]


def _ring(part: Polygon, depth: float, radius: float) -> Polygon:
    """Inset a piece of ground and round its corners."""
    corner = ROUND * max(0.0, radius - depth)
    core = Polygon(part.exterior).buffer(-(depth + corner))
    if core.is_empty:
        return Polygon()
    piece = max(shapely.get_parts(core), key=lambda shape: shape.area)
    return Polygon(piece.buffer(corner, quad_segs=16).exterior)


def chords(need: Need, ring: Polygon, centre: Floats) -> list[Floats]:
    """Divide a ring into straight pieces, shape (2, 2) each.

    The first has its middle in front of the centre, so that a round patch is divided in mirror
    symmetry about the direction of the sun.
    """
    if ring.is_empty:
        return []
    line = ring.exterior
    size = max(CHORDS * need.longest, CHORD)
    n = min(max(6, 2 * round(line.length / (2 * size))), MOST_CHORDS)
    far = centre + outward(need.facing_deg) * line.length
    front = line.project(shapely.Point(_last(line.intersection(LineString([centre, far])), far)))
    at = (front + line.length * (np.arange(n) + 0.5) / n) % line.length
    xy = shapely.get_coordinates(shapely.line_interpolate_point(line, at))
    into, out = xy - np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0) - xy
    cross = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0]
    turn = np.degrees(np.abs(np.arctan2(cross, (into * out).sum(axis=1))))
    xy = xy[turn >= STRAIGHT] if (turn >= STRAIGHT).sum() >= 3 else xy
    return list(np.stack([xy, np.roll(xy, -1, axis=0)], axis=1))


def _last(crossing: shapely.Geometry, otherwise: Floats) -> Floats:
    """Give the point of a crossing that is nearest to a far point."""
    xy = shapely.get_coordinates(crossing)
    if not len(xy):
        return otherwise
    nearest: Floats = xy[int(np.argmin(np.hypot(*(xy - otherwise).T)))]
    return nearest


def _on_chord(need: Need, chord: Floats, rank: int) -> list[Draft]:
    """Draw the lines of a chord: along it where that faces the sun, else askew to it."""
    along = chord[1] - chord[0]
    normal = azimuth_of(np.array([along[1], -along[0]]))
    sun = wished_azimuth(need)
    facing = min((normal, (normal + 180.0) % 360.0), key=lambda a: turn_between(a, sun))
    if turn_between(facing, sun) <= (TURN_TOWER if need.towers else TURN_SLAB):
        room = need.turned(facing)
        ends = room.local(chord)
        spans = room.stretches(float(ends[:, 1].mean()), need.sizes)
        spans = np.clip(spans, ends[:, 0].min(), ends[:, 0].max())
        spans = spans[spans[:, 1] - spans[:, 0] >= need.shortest - 1e-3]
        return [row(room, float(ends[:, 1].mean()), span, rank) for span in spans]
    return askew(need, chord, rank)


def askew(need: Need, ends: Floats, rank: int) -> list[Draft]:
    """Draw the pieces of a line on which centres of buildings that face like rows may stand."""
    pieces = LineString(ends).intersection(need.room.standing(need.sizes))
    return [
        Draft(pair(xy[0]), pair(xy[-1]), need.facing_deg, rank)
        for piece in shapely.get_parts(pieces)
        if piece.length > need.rules.step_m
        for xy in [shapely.get_coordinates(piece)]
    ]
