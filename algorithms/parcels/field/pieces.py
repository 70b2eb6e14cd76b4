"""What lines make of a region: areas and pieces, from the places of their ends."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import Polygon

from .outline import Bools, Floats, Outline, outline
from .streamlines import Streamlines

#: Pieces must make up the region to this share of its area.
WHOLE = 1e-6


def cut_off(lines: Streamlines, edges: Outline) -> Floats:
    """Area on the left of each line, as far as its ring goes.

    Parameters
    ----------
    lines
        Lines with both ends on the same ring; others get NaN.
    edges
        The rings of the region.

    Returns
    -------
    area
        Enclosed by the line and the part of the ring from its end to its start, holes not taken
        off, shape (n,), square metres, positive.
    """
    at = edges.start.mean(axis=0)
    start, end = edges.start - at, edges.end - at
    sweep = 0.5 * (start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0])
    total = np.r_[0.0, np.cumsum(sweep)]
    first, last = edges.first[lines.ring], edges.first[lines.ring + 1]
    edge = first + lines.edge
    # swept from the beginning of the ring to the end of the line
    point = start[edge] + lines.t[..., None] * (end - start)[edge]
    part = 0.5 * (start[edge][..., 0] * point[..., 1] - start[edge][..., 1] * point[..., 0])
    swept = total[edge] - total[first] + part
    ring = total[last] - total[first]
    back = swept[:, 0] - swept[:, 1]
    position = lines.edge + lines.t
    back = np.where(position[:, 0] < position[:, 1], back + ring[:, 0], back)
    xy = lines.points - at
    cross = 0.5 * (xy[:-1, 0] * xy[1:, 1] - xy[:-1, 1] * xy[1:, 0])
    sums = np.r_[0.0, np.cumsum(cross)]
    own = sums[lines.first[1:] - 1] - sums[lines.first[:-1]]
    area = np.where(lines.ring[:, 0] == lines.ring[:, 1], np.abs(own + back), np.nan)
    return np.asarray(area)


def shares(lines: Streamlines, polygon: Polygon, edges: Outline | None = None) -> Floats:
    """Share of the smaller of the two pieces that a line makes, 0 to 0.5, shape (n,).

    Holes count to neither, and lines that end on different rings get 0.
    """
    edges = outline(polygon) if edges is None else edges
    area = cut_off(lines, edges)
    at = edges.start - edges.start[0], edges.end - edges.start[0]
    sweep = 0.5 * (at[0][:, 0] * at[1][:, 1] - at[0][:, 1] * at[1][:, 0])
    ring = np.abs(np.add.reduceat(sweep, edges.first[:-1]))
    whole = ring[lines.ring[:, 0]]
    other = np.where(lines.ring[:, 0] == 0, whole - area, polygon.area - np.minimum(area, whole))
    share = np.minimum(area, other) / np.maximum(area + other, 1e-9)
    return np.asarray(np.clip(np.nan_to_num(share), 0.0, 0.5))


def _along(edges: Outline, ring: int, begin: tuple[int, float], end: tuple[int, float]) -> Floats:
    """Vertices of a ring between two places on it, in its own order, without the places."""
    low, high = int(edges.first[ring]), int(edges.first[ring + 1])
    count = high - low
    steps = end[0] - begin[0]
    if steps < 0 or (steps == 0 and end[1] < begin[1]):
        steps += count
    return np.asarray(edges.start[low + (begin[0] + 1 + np.arange(steps)) % count])


def _polygon(parts: list[Floats]) -> Polygon | None:
    """Polygon of points one after the other, equal neighbours once."""
    points = np.concatenate(parts)
    keep = np.r_[True, (np.abs(np.diff(points, axis=0)) > 0).any(axis=1)]
    points = points[keep]
    return Polygon(points) if len(points) >= 3 else None


def split(
    polygon: Polygon,
    lines: Streamlines,
    number: int,
    partner: int = -1,
    edges: Outline | None = None,
) -> list[Polygon] | None:
    """Split a region along a line, or along two that meet the same hole.

    The pieces share the vertices of the line, and have all vertices of the region.

    Parameters
    ----------
    polygon
        The region.
    lines, number
        The line is `lines.line(number)`.
    partner
        Number of the second line, where the first one leads to a hole; else -1.
    edges
        The outline of the region, where it is known already.

    Returns
    -------
    pieces
        Two polygons that make up the region; None where the line does not split it so.
    """
    edges = outline(polygon) if edges is None else edges
    rings = np.split(edges.start, edges.first[1:-1])
    line = lines.line(number)
    ring = [int(value) for value in lines.ring[number]]
    ends = [(int(lines.edge[number, k]), float(lines.t[number, k])) for k in (0, 1)]
    taken = {*ring}
    if ring[0] == ring[1]:
        loops = [
            _polygon([line, _along(edges, ring[0], ends[1], ends[0])]),
            _polygon([line[::-1], _along(edges, ring[0], ends[0], ends[1])]),
        ]
    elif partner >= 0 and taken == {*(int(value) for value in lines.ring[partner])}:
        loops = _through(edges, lines, number, partner)
    else:
        return None
    if loops[0] is None or loops[1] is None:
        return None
    first, second = loops[0], loops[1]
    holes = [k for k in range(1, len(rings)) if k not in taken]
    if ring[0] == ring[1] and ring[0] > 0:
        small, large = sorted((first, second), key=lambda loop: loop.area)
        second = Polygon(polygon.exterior, [large.exterior])
        first = small
    pieces = []
    within = _holders(first, [rings[k] for k in holes])
    for loop, mine in ((first, within), (second, ~within)):
        inner = [rings[k] for k, here in zip(holes, mine) if here]
        pieces.append(Polygon(loop.exterior, [*loop.interiors, *inner]))
    both = np.array(pieces, dtype=object)
    if not shapely.is_valid(both).all():
        return None
    off = abs(shapely.area(both).sum() - polygon.area)
    return pieces if off <= WHOLE * polygon.area else None


def _through(edges: Outline, lines: Streamlines, number: int, partner: int) -> list[Polygon | None]:
    """Two loops along two lines that lead to the same hole from the exterior."""
    ways = []
    for k in (number, partner):
        line, sense = lines.line(k), 1 if lines.ring[k, 0] == 0 else -1
        places = [(int(lines.edge[k, j]), float(lines.t[k, j])) for j in (0, 1)][::sense]
        ways.append((line[::sense], places[0], places[1]))
    (a, a_out, a_in), (b, b_out, b_in) = ways
    ring = int(lines.ring[number].max())

    def signed(k: int) -> float:
        start, end = (
            points[edges.first[k] : edges.first[k + 1]] - edges.start[0]
            for points in (edges.start, edges.end)
        )
        return float((start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]).sum())

    against = signed(0) * signed(ring) > 0
    parts = []
    for here, there in ((a_in, b_in), (b_in, a_in)):
        # round the hole with the land on the same side as along the exterior
        parts.append(
            _along(edges, ring, there, here)[::-1] if against else _along(edges, ring, here, there)
        )
    return [
        _polygon([a, parts[0], b[::-1], _along(edges, 0, b_out, a_out)]),
        _polygon([b, parts[1], a[::-1], _along(edges, 0, a_out, b_out)]),
    ]


def _holders(polygon: Polygon, rings: list[Floats]) -> Bools:
    """Which of the rings are within a polygon."""
    if not rings:
        return np.zeros(0, bool)
    points = shapely.point_on_surface(np.array([Polygon(ring) for ring in rings], dtype=object))
    found = shapely.contains(Polygon(polygon.exterior), points)
    for hole in polygon.interiors:
        found &= ~shapely.contains(Polygon(hole), points)
    return np.asarray(found)


def solid(pieces: list[Polygon], radius: float, area: float) -> bool:
    """Whether all pieces hold a circle of a radius (metres) and have an area (square metres)."""
    both = np.array(pieces, dtype=object)
    if shapely.area(both).min() < area:
        return False
    # GEOS divides by zero where a spike folds up, and copes
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = shapely.buffer(both, -radius, join_style="mitre", mitre_limit=2.0)
    return not shapely.is_empty(inner).any()
