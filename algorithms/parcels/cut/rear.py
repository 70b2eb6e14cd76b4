"""Lines between the rows of a block: where two fronts are equally far, put straight at corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import Voronoi
from shapely.geometry import Polygon

from .line import Floats, Line
from .outline import Side, direction

#: Distance between the samples of the fronts (metres) and their largest number.
STEP, MOST = 2.0, 400
#: Rear lines are simplified by this (metres).
SMOOTH = 1.2
#: Lines are pushed through the edge of the block by this, past what its sides were simplified by.
PUSH = 0.4
#: Ends of lines that are nearer to each other become one (metres).
WELD = 1.0
#: A line that ends within this of the corner of its two fronts ends there (metres).
AT_CORNER = 1.0


@dataclass
class Chain:
    """A line between the rows of two fronts.

    Attributes
    ----------
    pair
        The two fronts, as indices of sides, the smaller first.
    xy
        Its vertices, shape (n, 2), metres.
    """

    pair: tuple[int, int]
    xy: Floats

    @property
    def length(self) -> float:
        """Length, metres."""
        return Line(self.xy).length


def samples(sides: list[Side], fronts: tuple[int, ...]) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return points along the fronts, shape (n, 2), and the front of each, shape (n,)."""
    step = max(STEP, sum(sides[k].length for k in fronts) / MOST)
    points, owner = [], []
    for k in fronts:
        count = max(4, round(sides[k].length / step))
        points.append(sides[k].line.at((np.arange(count) + 0.5) / count * sides[k].length))
        owner.append(np.full(count, k))
    return np.vstack(points), np.concatenate(owner)


def middle_lines(
    polygon: Polygon, points: Floats, owner: npt.NDArray[np.int64]
) -> tuple[list[Chain], float]:
    """Return the lines between the rows, and how far land lies from the fronts at most (metres).

    Edges between the Voronoi cells of samples of different fronts: no cell is ever built.

    Parameters
    ----------
    polygon
        The block.
    points, owner
        See `samples`.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    far = 20.0 * float((high - low).max()) + 100.0
    frame = (low + high) / 2 + far * np.array([[1, 0.1], [-0.1, 1], [-1, -0.1], [0.1, -1]])
    graph = Voronoi(np.vstack([points, frame]))
    ridge = np.asarray(graph.ridge_points)
    ends = np.asarray(graph.ridge_vertices)
    inside = (ridge < len(points)).all(axis=1) & (ends >= 0).all(axis=1)
    ridge, ends = ridge[inside], ends[inside]
    within = shapely.contains_xy(polygon, graph.vertices)
    deep = 0.0
    if within.any():
        used = within[ends]
        gap = np.hypot(*(graph.vertices[ends] - points[ridge[:, :1]]).transpose(2, 0, 1))
        deep = float(gap[used].max()) if used.any() else 0.0
    pair = np.sort(owner[ridge], axis=1)
    differs = pair[:, 0] != pair[:, 1]
    pair, lines = pair[differs], graph.vertices[ends[differs]]
    chains: list[Chain] = []
    number = pair[:, 0] * (int(owner.max()) + 1) + pair[:, 1]
    order = np.argsort(number, kind="stable")
    pair, these = pair[order], shapely.linestrings(lines[order])
    which = np.unique(number, return_inverse=True)[1].ravel()[order]
    first = np.searchsorted(which, np.arange(int(which[-1]) + 1)) if len(which) else which
    together = shapely.line_merge(shapely.multilinestrings(these, indices=which))
    for (a, b), merged in zip(pair[first].tolist(), shapely.intersection(together, polygon)):
        merged = shapely.line_merge(merged) if merged.geom_type == "MultiLineString" else merged
        for part in shapely.get_parts(shapely.simplify(merged, SMOOTH)):
            if part.geom_type == "LineString" and part.length > 0:
                chains.append(Chain((a, b), shapely.get_coordinates(part)))
    return _welded(chains, polygon), deep


def _welded(chains: list[Chain], polygon: Polygon) -> list[Chain]:
    """Let lines whose ends inside the block almost meet end at one point."""
    if not chains:
        return chains
    ends = np.vstack([x.xy[[0, -1]] for x in chains])
    inside = shapely.distance(shapely.points(ends), polygon.boundary) > 0.05
    near = np.hypot(*(ends[:, None] - ends[None]).transpose(2, 0, 1)) < WELD
    near &= inside[:, None] & inside[None]
    np.fill_diagonal(near, True)
    group = np.arange(len(ends))
    # the least number spreads among those that are near: there are few ends
    for _ in ends:
        least = np.where(near, group, len(ends)).min(axis=1)
        if (least == group).all():
            break
        group = least
    for j in np.unique(group):
        ends[group == j] = ends[group == j].mean(axis=0)
    found = []
    for chain, a, b, first, last in zip(
        chains, ends[0::2], ends[1::2], group[0::2].tolist(), group[1::2].tolist()
    ):
        if chain.length < 2 * WELD and (first == last or chain.length < 0.2):
            continue
        chain.xy = chain.xy.copy()
        chain.xy[0], chain.xy[-1] = a, b
        found.append(chain)
    return found


def corner_of(chain: Chain, sides: list[Side]) -> tuple[int, int, int] | None:
    """Tell at which corner of its two fronts a chain ends.

    Returns
    -------
    tuple of int or None
        The end of the chain (0 or -1), the side that arrives at the corner, the side that
        leaves it; None if the chain ends at none.
    """
    for first, second in (chain.pair, chain.pair[::-1]):
        if sides[first].after != second:
            continue
        arrive, leave = sides[first].xy[-1], sides[second].xy[0]
        reach = AT_CORNER + 0.6 * float(np.hypot(*(arrive - leave)))
        gaps = [float(np.hypot(*(chain.xy[end] - (arrive + leave) / 2))) for end in (0, -1)]
        end = 0 if gaps[0] <= gaps[1] else -1
        if gaps[end] <= reach:
            return end, first, second
    return None


def pushed(xy: Floats, end: int, by: float = PUSH) -> Floats:
    """Return a line, lengthened at one end (0 or -1)."""
    way = direction(xy, end, reach=2.0)
    longer = xy.copy()
    longer[end] += way * by if end == -1 else -way * by
    return longer


def hit(start: Floats, way: Floats, lines: list[Floats], least: float = 0.05) -> float:
    """Return how far a ray goes until it meets one of some lines, metres; inf if never.

    Parameters
    ----------
    start, way
        Start and unit direction, shape (2,).
    lines
        Polylines, shape (n, 2) each.
    least
        Meetings nearer than this do not count, metres.
    """
    if not lines:
        return float("inf")
    a = np.vstack([x[:-1] for x in lines])
    b = np.vstack([x[1:] for x in lines])
    return float(ray_distances(start[None], way[None], a, b, least)[0])


def ray_distances(start: Floats, way: Floats, a: Floats, b: Floats, least: float = 0.05) -> Floats:
    """Return how far each of some rays goes until it meets an edge, shape (r,); inf if never.

    Parameters
    ----------
    start, way
        Of the rays, shape (r, 2); unit directions.
    a, b
        Ends of the edges, shape (e, 2).
    least
        Meetings nearer than this do not count, metres.
    """
    edge = b - a
    gap = a[None] - start[:, None]
    cross = way[:, None, 0] * edge[None, :, 1] - way[:, None, 1] * edge[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (gap[..., 0] * edge[None, :, 1] - gap[..., 1] * edge[None, :, 0]) / cross
        t = (gap[..., 0] * way[:, None, 1] - gap[..., 1] * way[:, None, 0]) / cross
    valid = (np.abs(cross) > 1e-12) & (t >= -1e-9) & (t <= 1 + 1e-9) & (s > least)
    return np.asarray(np.where(valid, s, np.inf).min(axis=1))
