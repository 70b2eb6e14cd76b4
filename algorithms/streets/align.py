"""Gentle straightening and curving of a chosen network; its topology never changes.

Mesh lines wobble where the outline does. Streets are pulled straight by least squares with
sparse bends (iteratively re-weighted, so that many small turns become few), legs are pulled
square to the street they meet, and what still turns is drawn as a curve. A move that would
cross, leave the site or touch an obstacle is taken back.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
import shapely
from scipy.sparse.linalg import spsolve
from shapely.geometry import LineString

from ..mesh import QuadMesh
from ..network.problem import FloatArray, IntArray
from ..site.types import Site
from .chains import CORNER, chains
from .gaps import keeps_gaps
from .wishes import TOUCH

#: Pull back to the place in the mesh, against 1 for straightness.
STAY = 0.04
#: Furthest move in mesh edge lengths.
REACH = 0.22
#: Offsets under this count as straight (metres).
STRAIGHT = 2.0
ROUNDS = 14
#: The direction of the edge of the site is taken over this far to both sides (metres).
EDGE_LOOK = 8.0
#: Pull that turns the end of a street square to the edge of the site, against 1 for straightness.
EDGE_SQUARE = 0.1


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where the streets of a network run.

    Attributes
    ----------
    positions
        Shape (n, 2). Vertex positions, metres.
    lines
        Edge -> points (k, 2) from ``edges[i, 0]`` to ``edges[i, 1]``.
    chains
        Streets as sequences of vertices.
    """

    positions: FloatArray
    lines: dict[int, FloatArray]
    chains: list[list[int]]


def align(
    site: Site,
    mesh: QuadMesh,
    level: IntArray,
    arrivals: Mapping[int, tuple[float, float]],
    held: Sequence[int] = (),
    forbidden: shapely.Geometry | None = None,
    least_gap: float = 0.0,
) -> Alignment:
    """Straighten and curve the streets of a network, as far as that is safe.

    Parameters
    ----------
    site
        The site; streets stay inside it and off its obstacles.
    mesh
        The candidate mesh.
    level
        Shape (e,). Street level of each edge, 0 for none.
    arrivals
        Vertices where a street continues an existing one -> its direction; they stay.
    held
        Further vertices that stay: those on existing streets inside the mesh.
    forbidden
        Lines or areas that no street may meet, besides the site's obstacles.
    least_gap
        Least distance between junctions along streets that drawing must not undercut, metres.
    """
    ways = chains(mesh, level)
    straight = _straightened(site, mesh, ways, arrivals, held)
    for share in (1.0, 0.5, 0.0):
        positions = mesh.vertices + share * (straight - mesh.vertices)
        for curved in (True, False):
            lines = _drawn(mesh, ways, positions, curved)
            if share == 0.0 and not curved:
                break
            if least_gap and not keeps_gaps(mesh, ways, lines, least_gap):
                continue
            if _safe(site, mesh, lines, forbidden):
                return Alignment(positions, lines, ways)
    return Alignment(mesh.vertices.copy(), _drawn(mesh, ways, mesh.vertices, False), ways)


def _straightened(
    site: Site,
    mesh: QuadMesh,
    ways: Sequence[Sequence[int]],
    arrivals: Mapping[int, tuple[float, float]],
    held: Sequence[int],
) -> FloatArray:
    """Positions after re-weighted least squares."""
    start = mesh.vertices
    now = start.copy()
    used = sorted({v for way in ways for v in way})
    if not used:
        return now
    still = _Rows(len(start))
    _stay_rows(still, site, mesh, used, arrivals)
    for turn in range(ROUNDS):
        rows = still.copy()
        for way in ways:
            for a, b, c in zip(way, way[1:], way[2:]):
                _straight_row(rows, now, a, b, c, sparse_bends=turn > 3)
        _square_rows(rows, now, ways, arrivals)
        _edge_rows(rows, site, mesh, now, ways, {*arrivals, *held})
        moved = rows.solve(now, used) - start
        size = np.hypot(*moved.T)[:, None]
        limit = REACH * mesh.edge_length
        moved[[*arrivals, *held]] = 0.0
        now = start + moved * np.minimum(1.0, limit / np.maximum(size, 1e-9))
    return now


class _Rows:
    """Rows of a least squares problem in the coordinates of the vertices."""

    def __init__(self, n: int) -> None:
        self.n = n
        self.entries: list[tuple[int, int, float]] = []
        self.right: list[float] = []

    def copy(self) -> _Rows:
        """Give the same rows, to which others may be added."""
        other = _Rows(self.n)
        other.entries, other.right = self.entries.copy(), self.right.copy()
        return other

    def add(self, terms: Sequence[tuple[int, float, float]], right: float, weight: float) -> None:
        """Ask that the sum of cx * x_v + cy * y_v over (v, cx, cy) equals `right`."""
        r = len(self.right)
        for v, cx, cy in terms:
            self.entries += [(r, 2 * v, cx * weight), (r, 2 * v + 1, cy * weight)]
        self.right.append(right * weight)

    def solve(self, now: FloatArray, used: Sequence[int]) -> FloatArray:
        """Solve for the used vertices; the others stay."""
        columns = np.repeat(2 * np.asarray(used), 2)
        columns[1::2] += 1
        place = np.full(2 * self.n, -1)
        place[columns] = np.arange(len(columns))
        r, c, x = (np.array(part) for part in zip(*self.entries))
        matrix = sparse.csr_matrix(
            (x, (r.astype(int), place[c.astype(int)])), shape=(len(self.right), len(columns))
        )
        normal = (matrix.T @ matrix + 1e-9 * sparse.identity(len(columns))).tocsc()
        solution = spsolve(normal, matrix.T @ np.array(self.right))
        result = now.copy()
        result[list(used)] = solution.reshape(-1, 2)
        return result


def _stay_rows(
    rows: _Rows,
    site: Site,
    mesh: QuadMesh,
    used: Sequence[int],
    arrivals: Mapping[int, tuple[float, float]],
) -> None:
    """Hold vertices near their place; on the boundary they may only slide."""
    edge = [v for v in used if mesh.boundary_vertices[v]]
    along = dict(zip(edge, _along_edge(site, mesh.vertices[edge], EDGE_LOOK).tolist()))
    for v in used:
        x, y = mesh.vertices[v].tolist()
        if not mesh.boundary_vertices[v]:
            rows.add([(v, 1.0, 0.0)], x, STAY)
            rows.add([(v, 0.0, 1.0)], y, STAY)
            continue
        # sliding along a curved outline would leave it: only straight stretches may slide
        slide = 2 * STAY if v not in arrivals and not mesh.fixed[v] else 50.0
        tx, ty = along[v]
        rows.add([(v, -ty, tx)], -ty * x + tx * y, 50.0)
        rows.add([(v, tx, ty)], tx * x + ty * y, slide)


def _straight_row(
    rows: _Rows, now: FloatArray, a: int, b: int, c: int, *, sparse_bends: bool
) -> None:
    """Pull b onto the line from a to c."""
    span = now[c] - now[a]
    length = float(np.hypot(*span)) or 1.0
    nx, ny = -span[1] / length, span[0] / length
    la, lc = np.hypot(*(now[b] - now[a])), np.hypot(*(now[c] - now[b]))
    s = float(la / (la + lc)) if la + lc > 0 else 0.5
    off = abs(float((now[b] - (1 - s) * now[a] - s * now[c]) @ (nx, ny)))
    weight = 1.0 / max(off / STRAIGHT, 0.5) if sparse_bends else 1.0
    terms = [(b, nx, ny), (a, -nx * (1 - s), -ny * (1 - s)), (c, -nx * s, -ny * s)]
    rows.add(terms, 0.0, weight)


def _square_rows(
    rows: _Rows,
    now: FloatArray,
    ways: Sequence[Sequence[int]],
    arrivals: Mapping[int, tuple[float, float]],
) -> None:
    """Turn legs square to the street they meet, and arrivals into their street's direction."""
    through: dict[int, tuple[int, int]] = {}
    for way in ways:
        for a, b, c in zip(way, way[1:], way[2:]):
            through[b] = (a, c)
    for way in ways:
        for end, nxt in ((way[0], way[1]), (way[-1], way[-2])):
            leg = now[nxt] - now[end]
            length = float(np.hypot(*leg)) or 1.0
            if end in arrivals:
                dx, dy = arrivals[end]
                if float(leg @ (dx, dy)) > 0.8 * length:
                    rows.add([(nxt, -dy, dx), (end, dy, -dx)], 0.0, 0.3)
            elif end in through:
                a, c = through[end]
                t = (now[c] - now[a]) / (np.hypot(*(now[c] - now[a])) or 1.0)
                if abs(float(t @ leg)) < 0.75 * length:
                    rows.add([(nxt, t[0], t[1]), (end, -t[0], -t[1])], 0.0, 0.4)


def _edge_rows(
    rows: _Rows,
    site: Site,
    mesh: QuadMesh,
    now: FloatArray,
    ways: Sequence[Sequence[int]],
    stay: Container[int],
) -> None:
    """Turn streets that end at the edge of the site square to it; their ends slide along it."""
    legs = [
        (end, nxt)
        for way in ways
        for end, nxt in ((way[0], way[1]), (way[-1], way[-2]))
        if mesh.boundary_vertices[end] and end not in stay and not mesh.fixed[end]
    ]
    along = _along_edge(site, now[[end for end, _ in legs]], EDGE_LOOK).tolist()
    for (end, nxt), (tx, ty) in zip(legs, along):
        leg = now[nxt] - now[end]
        if abs(float(leg @ (tx, ty))) < 0.75 * (float(np.hypot(*leg)) or 1.0):
            rows.add([(nxt, tx, ty), (end, -tx, -ty)], 0.0, EDGE_SQUARE)


def _along_edge(site: Site, xy: FloatArray, look: float) -> FloatArray:
    """Give unit vectors along the edge of the site near places (k, 2), over twice this length."""
    if not len(xy):
        return np.zeros((0, 2))
    here = shapely.points(xy)
    rings = np.array([site.polygon.exterior, *site.polygon.interiors], dtype=object)
    ring = rings[shapely.distance(here[:, None], rings[None, :]).argmin(axis=1)]
    at, length = shapely.line_locate_point(ring, here), shapely.length(ring)
    a, b = (
        shapely.get_coordinates(shapely.line_interpolate_point(ring, (at + d) % length))
        for d in (-look, look)
    )
    size = np.hypot(*(b - a).T)[:, None]
    return np.asarray((b - a) / np.where(size > 0, size, 1.0))


def _drawn(
    mesh: QuadMesh, ways: Sequence[Sequence[int]], positions: FloatArray, curved: bool
) -> dict[int, FloatArray]:
    """Draw every edge, straight or as a piece of a smooth curve through its street."""
    lines: dict[int, FloatArray] = {}
    for way in ways:
        points = positions[list(way)]
        tangents = _tangents(points, closed=way[0] == way[-1]) if curved else None
        for i, (u, v) in enumerate(zip(way, way[1:])):
            piece = points[i : i + 2]
            if tangents is not None:
                piece = _hermite(points[i], points[i + 1], tangents[i], tangents[i + 1])
            edge = mesh.edge_between(u, v)
            lines[edge] = piece if mesh.edges[edge, 0] == u else piece[::-1]
    return lines


def _tangents(points: FloatArray, *, closed: bool) -> FloatArray:
    """Give unit tangents of the curve through points: circle-like inside, natural at the ends."""
    steps = np.diff(points, axis=0)
    sizes = np.hypot(*steps.T)[:, None]
    unit = steps / np.maximum(sizes, 1e-9)
    inner = unit[:-1] * sizes[1:] + unit[1:] * sizes[:-1]
    tangents = np.vstack([unit[:1], inner, unit[-1:]])
    if closed:
        seam = unit[-1] * sizes[0] + unit[0] * sizes[-1]
        tangents[0] = tangents[-1] = seam
    elif len(points) > 2:
        # reflect the neighbour's tangent in the chord: the end piece is an arc, too
        for end, near, chord in ((0, 1, unit[0]), (-1, -2, unit[-1])):
            t = tangents[near] / (np.hypot(*tangents[near]) or 1.0)
            tangents[end] = 2 * (t @ chord) * chord - t
    lengths = np.hypot(*tangents.T)[:, None]
    unit_tangents: FloatArray = tangents / np.maximum(lengths, 1e-9)
    return unit_tangents


def _hermite(p: FloatArray, q: FloatArray, tp: FloatArray, tq: FloatArray) -> FloatArray:
    """Points of a cubic from p to q with unit tangents; two where it is straight."""
    chord = q - p
    size = float(np.hypot(*chord))
    unit = chord / (size or 1.0)
    turn = np.degrees(np.arccos(np.clip([tp @ unit, tq @ unit], -1, 1)))
    if turn.max() < 1.0 or turn.max() > CORNER:
        return np.array([p, q])
    s = np.linspace(0.0, 1.0, max(3, int(np.ceil(size / 8.0)) + 1))[:, None]
    bow: FloatArray = (
        (2 * s**3 - 3 * s**2 + 1) * p
        + (s**3 - 2 * s**2 + s) * size * tp
        + (3 * s**2 - 2 * s**3) * q
        + (s**3 - s**2) * size * tq
    )
    return bow


def _safe(
    site: Site,
    mesh: QuadMesh,
    lines: Mapping[int, FloatArray],
    forbidden: shapely.Geometry | None,
) -> bool:
    """Tell whether lines meet at their ends only and stay on good ground."""
    if not lines:
        return True
    edges = sorted(lines)
    shapes = np.array([LineString(lines[e]) for e in edges])
    if not shapely.is_simple(shapes).all():
        return False
    ends = mesh.edges[edges]
    tree = shapely.STRtree(shapes)
    i, j = tree.query(shapes, predicate="intersects")
    pair = i < j
    i, j = i[pair], j[pair]
    joined = (ends[i][:, :, None] == ends[j][:, None, :]).any(axis=(1, 2))
    if not joined.all():
        return False
    meeting = shapely.intersection(shapes[i], shapes[j])
    if not (shapely.get_num_coordinates(meeting) == 1).all():
        return False
    chords = shapely.linestrings(mesh.vertices[mesh.edges[edges]])
    ground = site.polygon.buffer(1.0)
    outside = shapely.length(shapely.difference(shapes, ground))
    # a mesh on a cleaned outline may itself be outside by a little
    if (outside > shapely.length(shapely.difference(chords, ground)) + 1.0).any():
        return False
    if forbidden is not None and shapely.intersects(shapes, forbidden).any():
        return False
    obstacles = site.obstacle_union
    if obstacles.is_empty:
        return True
    hit = shapely.length(shapely.intersection(shapes, obstacles))
    return bool((hit <= TOUCH).all())
