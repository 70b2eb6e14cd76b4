"""Streamlines of a cross field from boundary to boundary, evenly spread (UP section 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree

from .crosses import CrossField
from .outline import Bools, Complexes, Floats, Ints, on_edges
from .trace import first_hits, trace, turned

#: Seeds nearer than this share of the depth of a parcel to a line are not used again (UP).
NEAR = 0.3
#: So many random seeds are traced for each line that would fit beside others.
BATCH = 6.0
#: Lines are simplified by this (metres).
SIMPLIFY = 0.3
#: Ends nearer than this to a vertex of the boundary are moved to it (metres).
SNAP = 0.5
#: Shorter lines are no streets (metres).
SHORTEST = 20.0


@dataclass(frozen=True)
class Streamlines:
    """Lines of a field that cross a region.

    Attributes
    ----------
    points
        Vertices of all lines one after the other, shape (p, 2), metres. The first and last of
        each line lie on the boundary.
    first
        Where each line begins in `points`, and their number, shape (n + 1,).
    ring, edge
        Which ring of the region, and which of its edges (counted in the ring from 0), the first
        and last end are on, shape (n, 2).
    t
        Where on that edge, 0 to 1, shape (n, 2).
    length
        Of the lines, shape (n,), metres.
    """

    points: Floats
    first: Ints
    ring: Ints
    edge: Ints
    t: Floats
    length: Floats

    def __len__(self) -> int:
        return len(self.length)

    def line(self, number: int) -> Floats:
        """Vertices of a line, shape (k, 2), metres."""
        return self.points[self.first[number] : self.first[number + 1]]

    def geometry(self) -> npt.NDArray[np.object_]:
        """Return the lines as LineStrings, shape (n,)."""
        if not len(self):
            return np.zeros(0, object)
        owner = np.repeat(np.arange(len(self)), np.diff(self.first))
        return np.asarray(shapely.linestrings(self.points, indices=owner), dtype=object)


@dataclass(frozen=True)
class _Traced:
    """Lines as they come: padded points from end to end, and where they end."""

    points: Complexes
    count: Ints
    edge: Ints
    t: Floats
    seed: Ints


def streamlines(
    field: CrossField,
    *,
    depth: float = 30.0,
    seed: int = 0,
    first: Floats | None = None,
    step: float | None = None,
    longest: float = math.inf,
) -> Streamlines:
    """Trace lines of a field from boundary to boundary.

    Seeds are the inner vertices of the triangulation, each for both directions of its cross. Seeds
    near a line in its direction are not used again. UP takes one seed after the other; here many
    random ones are traced at once, enough for some 95 % of all places, and lines are accepted
    one after the other where their seed is still free.

    Parameters
    ----------
    field
        The field.
    depth
        Of a parcel, metres: lines keep 0.3 of it from others.
    seed
        The order of seeds follows from it.
    first
        Points to be traced before all others, shape (k, 2), metres.
    step
        Of the tracing, metres; None: the size of the triangles, 8 to 12 m.
    longest
        Lines that are longer from their seed to one end need not be found, metres.

    Returns
    -------
    lines
        Without those that come to a singularity, to no end, or cross themselves.
    """
    rng = np.random.default_rng(seed)
    mesh, grid = field.mesh, field.grid
    step = float(np.clip(mesh.size, 8.0, 12.0)) if step is None else step
    own = np.zeros((0, 2)) if first is None else first
    seeds = np.concatenate([own, mesh.points[mesh.inner]])
    if not len(seeds):
        return no_lines()
    at = seeds @ [1, 1j]
    (z, depth_there) = grid.take(at, grid.cross, grid.inside)
    ok = (np.abs(z) > 1e-6) & (depth_there.real > 0)
    way = turned(np.where(ok, z / np.maximum(np.abs(z), 1e-9), 1), np.ones(len(at), complex))
    near = NEAR * depth
    batch = int(np.clip(BATCH * math.sqrt(field.polygon.area) / near, 60, 600))
    # two directions a seed
    order = rng.permutation(np.arange(2 * len(own), 2 * len(at)))
    order = np.concatenate([np.arange(2 * len(own)), order])
    order = order[ok[order // 2]][: batch + 2 * len(own)]
    at, way = at[order // 2], np.where(order % 2, 1j, 1.0) * way[order // 2]
    wide = float(np.hypot(*np.ptp(mesh.outline.start, axis=0)))
    most = int(min(2.0 * wide, longest) / step) + 4
    return _finish(field, _thin(_lines(field, at, way, step, most), at, way, near))


def no_lines() -> Streamlines:
    """No lines."""
    pairs = np.zeros((0, 2), np.int64)
    return Streamlines(
        np.zeros((0, 2)), np.zeros(1, np.int64), pairs, pairs, np.zeros((0, 2)), np.zeros(0)
    )


def _lines(field: CrossField, at: Complexes, way: Complexes, step: float, most: int) -> _Traced:
    """Trace seeds to both ends, and join the halves of those that reach the boundary twice."""
    edges = field.mesh.outline
    both = np.concatenate([way, -way])
    path, inside, count = trace(field.grid, np.tile(at, 2), both, step, most)
    reach = step + field.grid.step
    segment, edge, t, place = first_hits(path, inside, count, edges, reach)
    n = len(at)
    good = np.flatnonzero((segment[:n] >= 0) & (segment[n:] >= 0))
    ahead, back = segment[good], segment[good + n]
    count = ahead + back + 3
    k = np.arange(int(count.max(initial=0)))[:, None]
    behind = path[np.clip(back - k + 1, 0, len(path) - 1), good + n]
    before = path[np.clip(k - back - 1, 0, np.maximum(ahead, 0)), good]
    points = np.where(k <= back, behind, before)
    points = np.where(k == 0, place[good + n], points)
    points = np.where(k >= count - 1, place[good], points).T
    ends = np.stack([good + n, good], axis=1)
    lines = _Traced(points, count, edge[ends], t[ends], good)
    keep = _length(points) >= SHORTEST
    keep &= ~_crosses_itself(points, count)
    return _choose(lines, keep)


def _length(points: Complexes) -> Floats:
    """Lengths of padded lines."""
    return np.asarray(np.abs(np.diff(points, axis=1)).sum(axis=1))


def _choose(lines: _Traced, keep: Bools | Ints) -> _Traced:
    """Keep some of the lines."""
    return _Traced(
        lines.points[keep], lines.count[keep], lines.edge[keep], lines.t[keep], lines.seed[keep]
    )


def _crosses_itself(points: Complexes, count: Ints) -> Bools:
    """Whether padded lines cross themselves."""
    found = np.zeros(len(points), bool)
    if not len(points):
        return found
    way = np.diff(points, axis=1)
    turn = np.angle(way[:, 1:] * way[:, :-1].conj())
    turn[(np.abs(way[:, 1:]) < 1e-6) | (np.abs(way[:, :-1]) < 1e-6)] = 0.0
    heading = np.cumsum(turn, axis=1)
    if heading.shape[1]:
        # headings within half a turn: the line is monotone in some direction
        wide = np.flatnonzero(
            np.maximum(heading.max(axis=1), 0) - np.minimum(heading.min(axis=1), 0) > np.pi
        )
        for line in wide:
            xy = points[line, : count[line]]
            found[line] = not shapely.is_simple(shapely.linestrings(np.c_[xy.real, xy.imag]))
    return found


def _thin(lines: _Traced, at: Complexes, way: Complexes, near: float) -> _Traced:
    """Accept lines in their order, while their seeds are off the lines before them."""
    if not len(lines.count):
        return lines
    row, column = np.nonzero(np.arange(lines.points.shape[1]) < lines.count[:, None])
    points = lines.points[row, column]
    on = np.minimum(column + 1, lines.count[row] - 1)
    heading = lines.points[row, on] - lines.points[row, np.maximum(on - 2, 0)]
    seeds, ways = at[lines.seed], way[lines.seed]
    tree = cKDTree(np.c_[points.real, points.imag])
    own = cKDTree(np.c_[seeds.real, seeds.imag])
    found = tree.sparse_distance_matrix(own, near, output_type="ndarray")
    i, j = found["i"], found["j"]
    along = (heading[i].conj() * ways[j]).real
    like = np.abs(along) > math.sqrt(0.5) * np.abs(heading[i])
    # pairs of a line and a seed that it takes
    line, seed = row[i[like]], j[like]
    order = np.argsort(line, kind="stable")
    bounds = np.searchsorted(line[order], np.arange(len(lines.count) + 1))
    taken = seed[order]
    free = np.ones(len(lines.count), bool)
    chosen = []
    for number in range(len(free)):
        if free[number]:
            chosen.append(number)
            free[taken[bounds[number] : bounds[number + 1]]] = False
    return _choose(lines, np.array(chosen))


def _finish(field: CrossField, lines: _Traced) -> Streamlines:
    """Lines in their final form: few vertices, ends on vertices of the boundary or well off."""
    edges = field.mesh.outline
    edge, t, total = lines.edge, lines.t, len(lines.count)
    if not total:
        return no_lines()
    length = edges.length[edge]
    t = np.where(t * length < SNAP, 0.0, np.where((1 - t) * length < SNAP, 1.0, t))
    ends = on_edges(edges, edge, t)
    owners, column = np.nonzero(np.arange(lines.points.shape[1]) < lines.count[:, None])
    flat = lines.points[owners, column]
    points = np.c_[flat.real, flat.imag]
    begin = np.r_[0, np.cumsum(lines.count)]
    points[begin[:-1]], points[begin[1:] - 1] = ends[:, 0], ends[:, 1]
    # points that are nearly at an end would give it a direction of rounding
    off = points - ends[owners].transpose(1, 0, 2)
    keep = np.hypot(off[..., 0], off[..., 1]).min(axis=0) > 1.0
    keep[begin[:-1]] = keep[begin[1:] - 1] = True
    simple = shapely.simplify(shapely.linestrings(points[keep], indices=owners[keep]), SIMPLIFY)
    points, owners = shapely.get_coordinates(simple, return_index=True)
    first = np.searchsorted(owners, np.arange(total + 1))
    ring = edges.ring[edge]
    return Streamlines(points, first, ring, edge - edges.first[ring], t, shapely.length(simple))
