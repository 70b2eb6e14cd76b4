"""Where an existing street runs along the edge of a site.

A site polygon often stops at the property line, half a street width from the centre line;
a stretch of its boundary is frontage where a road runs beside it, roughly parallel, with
no other part of the site between.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon
from shapely.ops import substring

from .roadnetwork import RoadNetwork, Section
from .types import BoundaryStreet

STEP = 2.0
"""Spacing of the samples on the boundary, metres."""

WINDOW = 8.0
"""Directions are measured over this far to either side, metres."""

PARALLEL = 30.0
"""Largest angle between boundary and road, degrees."""

INSIDE = 10.0
"""A road up to this far inside the polygon still counts as one along its edge, metres."""

CLOSE_GAPS = 20.0
"""Shorter gaps in the frontage, such as the mouths of streets, are closed, metres."""

SCRAP = 15.0
"""Shorter stretches of frontage are dropped, metres."""

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]


@dataclass(frozen=True)
class RingSamples:
    """Samples along one ring.

    Attributes
    ----------
    ring
        The ring as a closed line.
    cuts
        Distances along the ring between which the samples sit, shape (n + 1,).
    points
        Middles of the n stretches, shape (n,).
    tangents
        Unit direction of the ring there, over the window, shape (n, 2).
    """

    ring: LineString
    cuts: FloatArray
    points: npt.NDArray[Any]
    tangents: FloatArray


@dataclass(frozen=True)
class Frontage:
    """The street frontage of a site.

    Attributes
    ----------
    stretches
        Parts of the site's rings.
    streets
        Centre lines beside them, cut at junctions.
    lines
        Indices of the roads of the network that these are parts of.
    reaches
        The parts of the network that are `streets`: index of the line, start and end along
        it, metres, one for each street.
    """

    stretches: MultiLineString
    streets: list[BoundaryStreet]
    lines: frozenset[int]
    reaches: list[tuple[int, float, float]]


def frontage(polygon: Polygon, roads: RoadNetwork, snap_distance: float) -> Frontage:
    """Find the street frontage of a site and the streets that make it.

    Parameters
    ----------
    polygon
        The site, metres.
    roads
        Roads near it.
    snap_distance
        Largest distance of a road that runs along the boundary, metres.

    Returns
    -------
    Frontage
        Parts of the rings and the streets beside them; empty where no road runs.
    """
    stretches: list[LineString] = []
    beside: list[tuple[IntArray, FloatArray]] = []
    for ring in [polygon.exterior, *polygon.interiors]:
        samples = sample_ring(ring)
        line, position = roads_beside(samples, polygon, roads, snap_distance)
        flags = _close_and_drop(line >= 0, samples.cuts)
        stretches += _stretches(samples, flags)
        use = flags & (line >= 0)
        beside.append((line[use], position[use]))
        beside.append(_around_corners(samples, roads, use, line, position))
    lines = np.concatenate([b[0] for b in beside])
    positions = np.concatenate([b[1] for b in beside])
    used = frozenset(int(j) for j in np.unique(lines))
    streets, reaches = [], []
    for j, section, start, end in _along(roads, lines, positions, snap_distance):
        piece = substring(roads.lines[j], start, end)
        streets.append(BoundaryStreet(piece, section.name, section.kind))
        reaches.append((j, start, end))
    return Frontage(MultiLineString(stretches), streets, used, reaches)


def sample_ring(ring: LineString) -> RingSamples:
    """Sample a ring at about `STEP` between its vertices.

    Parameters
    ----------
    ring
        A ring.

    Returns
    -------
    RingSamples
        Points and directions.
    """
    line = LineString(ring.coords)
    length = line.length
    n = max(8, round(length / STEP))
    cuts = np.linspace(0.0, length, n + 1)
    middle = (cuts[:-1] + cuts[1:]) / 2
    window = min(WINDOW, length / 8)
    before = shapely.line_interpolate_point(line, (middle - window) % length)
    after = shapely.line_interpolate_point(line, (middle + window) % length)
    chord = shapely.get_coordinates(after) - shapely.get_coordinates(before)
    return RingSamples(line, cuts, shapely.line_interpolate_point(line, middle), _unit(chord))


def roads_beside(
    samples: RingSamples, polygon: Polygon, roads: RoadNetwork, snap_distance: float
) -> tuple[IntArray, FloatArray]:
    """Find the road that runs beside each sample.

    Parameters
    ----------
    samples
        Samples of one ring of `polygon`.
    polygon
        The site.
    roads
        Roads near it.
    snap_distance
        Largest distance, metres.

    Returns
    -------
    line : ndarray of int
        Index of the road, -1 for none, shape (n,).
    position : ndarray
        Distance along that road of the point beside the sample, shape (n,).
    """
    n = len(samples.points)
    line = np.full(n, -1, dtype=np.intp)
    position = np.zeros(n)
    if len(roads.lines) == 0:
        return line, position
    tree = shapely.STRtree(roads.lines)
    i, j = tree.query(samples.points, predicate="dwithin", distance=snap_distance)
    points, along = samples.points[i], roads.lines[j]
    where = shapely.line_locate_point(along, points)
    keep = _runs_beside(points, samples.tangents[i], along, where)
    i, j, where, points, along = i[keep], j[keep], where[keep], points[keep], along[keep]
    foot = shapely.line_interpolate_point(along, where)
    reach = shapely.distance(points, foot)
    clear = _clear(polygon, points, foot, reach)
    i, j, where, reach = i[clear], j[clear], where[clear], reach[clear]
    order = np.lexsort((reach, i))
    first = np.unique(i[order], return_index=True)[1]
    best = order[first]
    line[i[best]] = j[best]
    position[i[best]] = where[best]
    return line, position


def _runs_beside(
    points: npt.NDArray[Any], tangents: FloatArray, along: npt.NDArray[Any], where: FloatArray
) -> npt.NDArray[np.bool_]:
    """Tell which roads are parallel to the boundary and beside it, not ahead of it."""
    length = shapely.length(along)
    low = np.clip(where - WINDOW, 0.0, np.maximum(length - 2 * WINDOW, 0.0))
    high = np.minimum(low + 2 * WINDOW, length)
    chord = _xy(shapely.line_interpolate_point(along, high)) - _xy(
        shapely.line_interpolate_point(along, low)
    )
    parallel = np.abs(np.sum(_unit(chord) * tangents, axis=1)) >= np.cos(np.radians(PARALLEL))
    link = _xy(shapely.line_interpolate_point(along, where)) - _xy(points)
    size = np.hypot(link[:, 0], link[:, 1])
    lengthwise = np.abs(np.sum(link * tangents, axis=1))
    beside = (lengthwise <= size * np.cos(np.radians(45.0))) | (size < STEP)
    return np.asarray(parallel & beside)


def _clear(
    polygon: Polygon, points: npt.NDArray[Any], foot: npt.NDArray[Any], reach: FloatArray
) -> npt.NDArray[np.bool_]:
    """Tell where the way from boundary to road is free of other parts of the site."""
    if len(points) == 0:
        return np.zeros(0, dtype=bool)
    a, b = _xy(points), _xy(foot)
    step = np.minimum(0.5, reach)[:, None] * _unit(b - a)  # off the boundary that it starts on
    shapely.prepare(polygon)
    meets = shapely.intersects(polygon, shapely.linestrings(np.stack([a + step, b], axis=1)))
    inside = np.zeros(len(points))
    ways = shapely.linestrings(np.stack([a[meets], b[meets]], axis=1))
    inside[meets] = shapely.length(shapely.intersection(ways, polygon))
    wholly = (inside > 0.9 * reach) & (reach <= INSIDE)
    return np.asarray((inside < 1.0) | wholly)


def _close_and_drop(flags: npt.NDArray[np.bool_], cuts: FloatArray) -> npt.NDArray[np.bool_]:
    """Drop specks, close gaps, drop scraps, round a ring."""
    step = float(cuts[1] - cuts[0])
    flags = _flip_short_runs(flags, True, 2.5 * STEP, step)
    flags = _flip_short_runs(flags, False, CLOSE_GAPS, step)
    return _flip_short_runs(flags, True, SCRAP, step)


def _flip_short_runs(
    flags: npt.NDArray[np.bool_], value: bool, length: float, step: float
) -> npt.NDArray[np.bool_]:
    """Flip the runs of `value` shorter than `length` in a cyclic array."""
    if np.all(flags) or not np.any(flags):
        return flags
    turn = int(np.flatnonzero(flags != np.roll(flags, 1))[0])
    rolled = np.roll(flags, -turn)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(rolled)) + 1, [len(rolled)]])
    for a, b in zip(edges[:-1], edges[1:]):
        if rolled[a] == value and (b - a) * step < length:
            rolled[a:b] = not value
    return np.roll(rolled, turn)


def _stretches(samples: RingSamples, flags: npt.NDArray[np.bool_]) -> list[LineString]:
    """Parts of the ring whose samples are flagged."""
    if np.all(flags):
        return [samples.ring]
    if not np.any(flags):
        return []
    length = samples.ring.length
    # two rounds, so that a stretch may run over the start of the ring
    double = LineString([*samples.ring.coords, *samples.ring.coords[1:]])
    n = len(flags)
    starts = np.flatnonzero(flags & ~np.roll(flags, 1))
    result = []
    for a in starts:
        count = int(np.argmin(np.roll(flags, -int(a))))
        end = samples.cuts[(a + count) % n] + (length if a + count >= n else 0.0)
        result.append(substring(double, float(samples.cuts[a]), float(end)))
    return result


def _around_corners(
    samples: RingSamples,
    roads: RoadNetwork,
    use: npt.NDArray[np.bool_],
    line: IntArray,
    position: FloatArray,
) -> tuple[IntArray, FloatArray]:
    """Follow the roads around the corners of a ring: lines, and positions on them.

    Outside a corner lies a stretch of road that is beside no sample. It is as long as the corner
    is sharp and the road away, so what counts is how near the samples before and after it are to
    each other along the ring.
    """
    n, step = len(use), float(samples.cuts[1] - samples.cuts[0])
    before = np.flatnonzero(use)
    after = np.roll(before, -1)
    gap = (after - before) % n * step
    lines: list[IntArray] = [np.zeros(0, dtype=np.intp)]
    positions: list[FloatArray] = [np.zeros(0)]
    for k in np.flatnonzero((gap > 0.0) & (gap <= CLOSE_GAPS + step)).tolist():
        pair = np.array([before[k], after[k]])
        j, at = line[pair], position[pair]
        if j[0] == j[1] and abs(at[1] - at[0]) <= CLOSE_GAPS:
            continue
        foot = shapely.line_interpolate_point(roads.lines[j], at)
        reach = float(np.sum(shapely.distance(samples.points[pair], foot)))
        for own, a, b in _shortest_way(roads, j, at, float(gap[k]) + 2 * reach):
            places = np.linspace(a, b, 2 + int(abs(b - a) / STEP))
            lines.append(np.full(len(places), own, dtype=np.intp))
            positions.append(places)
    return np.concatenate(lines), np.concatenate(positions)


def _shortest_way(
    roads: RoadNetwork, pair: IntArray, at: FloatArray, longest: float
) -> list[tuple[int, float, float]]:
    """Find the way between two places along their roads: lines with the start and end on each.

    It leads along one line, or from the end of one to the end of the other; empty where none is
    as short as asked.
    """
    i, j = int(pair[0]), int(pair[1])
    a, b = float(at[0]), float(at[1])
    ways: list[tuple[float, list[tuple[int, float, float]]]] = []
    if i == j:
        ways.append((abs(b - a), [(i, a, b)]))
    ends = [(0.0, float(roads.lines[k].length)) for k in (i, j)]
    tips = [[roads.lines[k].coords[0], roads.lines[k].coords[-1]] for k in (i, j)]
    for first in (0, 1):
        for second in (0, 1):
            if (i != j or first != second) and tips[0][first] == tips[1][second]:
                x, y = ends[0][first], ends[1][second]
                ways.append((abs(x - a) + abs(y - b), [(i, a, x), (j, y, b)]))
    length, way = min(ways, key=lambda found: found[0], default=(np.inf, []))
    return way if length <= longest else []


def _along(
    roads: RoadNetwork, lines: IntArray, positions: FloatArray, snap_distance: float
) -> list[tuple[int, Section, float, float]]:
    """Find what of the roads runs beside the frontage: line, section, start and end."""
    result = []
    for j in np.unique(lines).tolist():
        sections = roads.sections[j]
        cuts = np.array([0.0, *(s.end for s in sections)])
        own = np.sort(positions[lines == j])
        for run in np.split(own, np.flatnonzero(np.diff(own) > CLOSE_GAPS) + 1):
            start, end = float(run[0]), float(run[-1])
            low = _rounded_out(start, cuts, snap_distance)
            high = -_rounded_out(-end, -cuts[::-1], snap_distance)
            if high <= low:  # scraps of two sections
                low, high = start, end
            if high - low <= SCRAP / 2:
                continue
            for section in sections:
                a, b = max(low, section.start), min(high, section.end)
                if b - a > 0.0:
                    result.append((j, section, a, b))
    return result


def _rounded_out(start: float, cuts: FloatArray, snap_distance: float) -> float:
    """Move the start of a run to where the road is cut, if that is near.

    Junctions a street width further on belong to the street; but a scrap of a section
    under another name does not, unless that section is no more than a scrap itself.
    """
    before, after = cuts[cuts <= start], cuts[cuts > start]
    back = start - before[-1] if len(before) > 0 else np.inf
    # the last cut is the end of the road
    if len(after) > 1 and after[0] - start < SCRAP / 2 < back:
        return float(after[0])
    return float(before[-1]) if back <= snap_distance else start


def _xy(points: npt.NDArray[Any]) -> FloatArray:
    return np.asarray(shapely.get_coordinates(points), dtype=float)


def _unit(vectors: FloatArray) -> FloatArray:
    size = np.hypot(vectors[:, 0], vectors[:, 1])
    return np.asarray(vectors / np.maximum(size, 1e-12)[:, None])
