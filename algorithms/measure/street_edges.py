"""Which parts of outlines lie along streets, for many polygons at once.

All edges are laid end to end on one line, so that parts of edges are intervals of numbers and a
sort tells what any number of them cover together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ..progress import Progress
from ..site.watch import ask

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Outlines nearer than this to one another have no street between them (metres).
GAP = 1.0
#: Edges that turn from one another by more than this do not run along one another (degrees).
ALONG = 30.0
#: An edge faces a street up to this angle between them (degrees).
ASLANT = 40.0
#: So many edges are worked on between two questions whether to stop.
CHUNK = 50_000


@dataclass(frozen=True, eq=False)
class Edges:
    """Straight edges.

    Attributes
    ----------
    start, end
        Shape (e, 2), metres. Of rings of polygons: with the land on the left.
    owner
        Index of the geometry that each is of, shape (e,).
    """

    start: Floats
    end: Floats
    owner: Ints

    @property
    def length(self) -> Floats:
        """Lengths, shape (e,), metres."""
        return np.asarray(np.hypot(*(self.end - self.start).T))

    @property
    def direction(self) -> Floats:
        """Unit vectors, shape (e, 2)."""
        return np.asarray((self.end - self.start) / self.length[:, None])

    def __getitem__(self, which: Any) -> Edges:
        """Give some of the edges."""
        return Edges(self.start[which], self.end[which], self.owner[which])


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of edges: `low` to `high` metres from the start of `edge`, each of shape (k,)."""

    edge: Ints
    low: Floats
    high: Floats


def edges_of(geometries: npt.NDArray[Any], *, holes: bool) -> Edges:
    """Take polygons and lines apart into edges; edges without length are left out.

    Parameters
    ----------
    geometries
        Polygons, lines and collections of them, shape (n,), or None. Metres.
    holes
        Whether the rings of holes count, too.
    """
    parts, owner = shapely.get_parts(geometries, return_index=True)
    parts, again = shapely.get_parts(parts, return_index=True)  # collections hold multiparts
    owner = owner[again]
    kind = shapely.get_type_id(parts)
    area = np.flatnonzero(kind == shapely.GeometryType.POLYGON)
    line = np.flatnonzero(np.isin(kind, (1, 2)))
    outer = shapely.get_exterior_ring(parts[area])
    lines, of = [parts[line], outer], [owner[line], owner[area]]
    shell = [np.zeros(len(line), dtype=bool), np.ones(len(area), dtype=bool)]
    if holes:
        rings, at = shapely.get_rings(parts[area], return_index=True)
        inner = np.r_[False, at[1:] == at[:-1]] if len(at) else np.zeros(0, dtype=bool)
        lines.append(rings[inner])
        of.append(owner[area][at[inner]])
        shell.append(np.zeros(int(inner.sum()), dtype=bool))
    return _edges(np.concatenate(lines), np.concatenate(of), np.concatenate(shell), len(line))


def _edges(lines: Any, owner: Any, shell: Any, plain: int) -> Edges:
    """Give the edges of lines; rings (all but the first `plain`) with the land on the left."""
    xy, line = shapely.get_coordinates(lines, return_index=True)
    same = np.flatnonzero(line[1:] == line[:-1])
    start, end, line = xy[same], xy[same + 1], line[same]
    # the signed area, about the first vertex of each ring so that large coordinates do no harm
    first = np.searchsorted(line, np.arange(len(lines))) if len(line) else np.zeros(0, dtype=int)
    origin = start[np.minimum(first, max(len(start) - 1, 0))][line] if len(line) else start
    a, b = start - origin, end - origin
    signed = np.bincount(line, a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], minlength=len(lines))
    turned = (np.arange(len(lines)) >= plain) & ((signed < 0) == shell)
    flip = turned[line]
    start[flip], end[flip] = end[flip], start[flip].copy()
    long = np.hypot(*(end - start).T) > 1e-9 if len(start) else np.zeros(0, dtype=bool)
    return Edges(start[long], end[long], np.asarray(owner[line[long]], dtype=np.int64))


def _pairs(edges: Edges, others: Edges, reach: float, progress: Progress | None) -> Any:
    """Yield which edges and others are near by their bounding boxes, chunk by chunk."""
    tree = shapely.STRtree(shapely.linestrings(np.stack([others.start, others.end], axis=1)))
    low = np.minimum(edges.start, edges.end) - reach
    high = np.maximum(edges.start, edges.end) + reach
    for begin in range(0, len(edges.owner), CHUNK):
        ask(progress)
        cut = slice(begin, begin + CHUNK)
        boxes = shapely.box(low[cut, 0], low[cut, 1], high[cut, 0], high[cut, 1])
        at, other = tree.query(boxes)
        yield at + begin, other


def beside(
    edges: Edges,
    others: Edges,
    reach: float,
    *,
    facing: bool,
    progress: Progress | None = None,
) -> Parts:
    """Find the parts of edges that another edge runs along.

    Parameters
    ----------
    edges, others
        Edges in metres.
    reach
        The other one is at most this far, measured square to it; metres.
    facing
        The other one belongs to another owner and has its land on the other side.
    progress
        Asked for cancellation, or None.
    """
    found = []
    turn = np.cos(np.radians(ALONG))
    for edge, other in _pairs(edges, others, reach, progress):
        a, b = edges[edge], others[other]
        way, along = a.direction, b.direction
        cosine = (way * along).sum(axis=1)
        good = cosine < -turn if facing else np.abs(cosine) > turn
        if facing:
            good &= a.owner != b.owner
        edge, a, b, way, along = edge[good], a[good], b[good], way[good], along[good]
        low, high = _slab(a.start - b.start, way, along, b.length, reach)
        found.append(_clipped(edge, low, high, a.length))
    return _joined(found)


def within(edges: Edges, others: Edges, reach: float, progress: Progress | None = None) -> Parts:
    """Find the parts of edges that face others within a distance.

    A part faces another edge where that lies square beside it and turns from it by less than 40
    degrees, and faces its ends (a turning circle, the outer side of a bend) where it is seen from
    there by less than 40 degrees aslant.

    Parameters
    ----------
    edges, others
        Edges in metres.
    reach
        The distance, metres.
    progress
        Asked for cancellation, or None.
    """
    found = []
    for edge, other in _pairs(edges, others, reach, progress):
        a, b = edges[edge], others[other]
        way = a.direction
        low, high = _slab(a.start - b.start, way, b.direction, b.length, reach)
        aslant = np.abs((way * b.direction).sum(axis=1)) < np.cos(np.radians(ASLANT))
        found.append(_clipped(edge, np.where(aslant, np.inf, low), high, a.length))
        for tip in (b.start, b.end):
            low, high = _disc(a.start - tip, way, reach)
            found.append(_clipped(edge, low, high, a.length))
    return _joined(found)


def _slab(gap: Floats, way: Floats, along: Floats, length: Floats, reach: float) -> Any:
    """Where a ray lies square beside an edge; (inf, -inf) for nowhere."""
    low, high = np.full(len(gap), -np.inf), np.full(len(gap), np.inf)
    square = np.stack([-along[:, 1], along[:, 0]], axis=1)
    for axis, least, most in ((along, np.zeros(len(gap)), length), (square, -reach, reach)):
        at, speed = (gap * axis).sum(axis=1), (way * axis).sum(axis=1)
        still = np.abs(speed) < 1e-12
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = (least - at) / speed, (most - at) / speed
        inside = (at >= least) & (at <= most)
        low = np.maximum(
            low, np.where(still, np.where(inside, -np.inf, np.inf), np.minimum(one, two))
        )
        high = np.minimum(
            high, np.where(still, np.where(inside, np.inf, -np.inf), np.maximum(one, two))
        )
    none = low >= high
    return np.where(none, np.inf, low), np.where(none, -np.inf, high)


def _disc(gap: Floats, way: Floats, reach: float) -> Any:
    """Where a ray lies within a distance of a point and passes it, not too much towards it."""
    middle = -(gap * way).sum(axis=1)
    aside = np.maximum((gap**2).sum(axis=1) - middle**2, 0.0)
    half = np.sqrt(
        np.maximum(np.minimum(reach**2 - aside, np.tan(np.radians(ASLANT)) ** 2 * aside), 0.0)
    )
    return np.where(half > 0, middle - half, np.inf), np.where(half > 0, middle + half, -np.inf)


def _clipped(edge: Ints, low: Floats, high: Floats, length: Floats) -> Parts:
    low, high = np.maximum(low, 0.0), np.minimum(high, length)
    keep = high > low
    return Parts(edge[keep], low[keep], high[keep])


def _joined(parts: list[Parts]) -> Parts:
    if not parts:
        return Parts(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
    return Parts(
        np.concatenate([p.edge for p in parts]),
        np.concatenate([p.low for p in parts]),
        np.concatenate([p.high for p in parts]),
    )


def pieces(edges: Edges, sets: list[Parts]) -> tuple[Ints, Floats, npt.NDArray[np.bool_]]:
    """Cut edges wherever a part begins or ends.

    Parameters
    ----------
    edges
        The edges.
    sets
        s sets of parts of them; parts of one set may overlap.

    Returns
    -------
    edge
        Index of the edge of each piece, shape (k,).
    length
        Metres, shape (k,).
    inside
        Which sets cover it, shape (s, k).
    """
    length = edges.length
    offset = np.r_[0.0, np.cumsum(length)]
    count = len(length)
    at = [offset[:-1]]
    change = [np.zeros((len(sets), count), dtype=np.int64)]
    for number, own in enumerate(sets):
        for where, step in ((own.low, 1), (own.high, -1)):
            # rounding must not carry the end of one edge over the start of the next
            at.append(np.clip(offset[own.edge] + where, offset[own.edge], offset[own.edge + 1]))
            change.append(np.zeros((len(sets), len(where)), dtype=np.int64))
            change[-1][number] = step
    position, steps = np.concatenate(at), np.concatenate(change, axis=1)
    order = np.argsort(position, kind="stable")
    position, inside = position[order], np.cumsum(steps[:, order], axis=1) > 0
    sizes = np.diff(np.r_[position, offset[-1]])
    edge = np.searchsorted(offset, position, side="right") - 1
    keep = sizes > 0
    return np.minimum(edge, count - 1)[keep], sizes[keep], inside[:, keep]


def street_lengths(
    polygons: npt.NDArray[Any],
    neighbours: npt.NDArray[Any],
    streets: npt.NDArray[Any] | None,
    reach: float,
    progress: Progress | None = None,
) -> tuple[Edges, Floats]:
    """Measure how much of each outer edge of polygons lies along a street.

    An edge faces street space where no neighbour lies within 1 m of it. Without streets all of
    that counts; with streets only what lies within `reach` of one, and what runs along one within
    1 m, even where a neighbour shares it (parcels drawn up to the centre line).

    Parameters
    ----------
    polygons
        Parcels, shape (n,), or None; metres.
    neighbours
        Whatever shares edges with them, the parcels among it, in the same order and before
        others; shape (m,).
    streets
        Lines or polygons, shape (k,); None for none given.
    reach
        Greatest distance of an outline from a street line or polygon, metres.
    progress
        Asked for cancellation, or None.

    Returns
    -------
    edges
        The outer edges of the polygons.
    length
        Metres of each along streets, shape (e,).
    """
    edges = edges_of(polygons, holes=False)
    if not len(edges.owner):
        return edges, np.zeros(0)
    around = edges_of(neighbours, holes=True)
    sets = [beside(edges, around, GAP, facing=True, progress=progress)]
    if streets is not None:
        lines = edges_of(streets, holes=True)
        if not len(lines.owner):
            return edges, np.zeros(len(edges.owner))
        sets.append(within(edges, lines, reach, progress))
        sets.append(beside(edges, lines, GAP, facing=False, progress=progress))
    edge, length, inside = pieces(edges, sets)
    open_ = ~inside[0] if streets is None else (~inside[0] & inside[1]) | inside[2]
    return edges, np.asarray(
        np.bincount(edge, weights=length * open_, minlength=len(edges.owner)), dtype=float
    )
