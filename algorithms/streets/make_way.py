"""Mesh lines step aside for obstacles before streets are chosen.

With the planner's rules an edge of the candidate mesh is as long as a block is wide, and a
building on it bars it. A planner would shift the street a little. So every obstacle is given
the cells in which it shall lie (one where it fits, several where it does not), and the vertices
move as little and as evenly as they can until the sides of those cells pass it by: a quadratic
programme with second differences along mesh lines as energy and one linear inequality for each
place where an edge would touch, solved in its dual by non-negative least squares and
re-linearised a few times. Which cells an obstacle gets is improved by local search.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
import shapely
from scipy.optimize import nnls
from scipy.sparse.linalg import splu

from ..mesh import QuadMesh
from ..mesh.foreign import FOREIGN_LENGTH
from ..mesh.quality import line_bends, scaled_jacobians
from ..mesh.relax import line_triples
from ..network.problem import BoolArray, FloatArray, IntArray
from ..site.types import Site
from .survey import TOUCH

#: Energy of vertex moves: even along mesh lines, alike at both ends of an edge, small.
BEND, SHEAR, STAY = 1.0, 0.1, 0.03
#: Weight of a broken inequality against the energy.
HARD = 1e3
#: What a mesh costs: an edge that comes too near, against 1 for a barred one of full length,
#: and the turn of a mesh line at one vertex (radians) that is as bad as that.
NEAR, TURN = 0.2, np.pi / 4
#: Least scaled Jacobian that a cell may get.
SQUARE = 0.35
#: Trials of the local search, and how often each is re-linearised.
TRIALS, ROUNDS = 24, 3
TROUBLE = 1.0
#: Cells that an obstacle may be given in every combination; choices kept per obstacle.
COMBINED, CHOICES = 4, 5


def make_way(
    mesh: QuadMesh, site: Site, *, clearance: float = 4.0, reach: float = 0.35
) -> QuadMesh:
    """Move inner vertices so that few inner edges cross obstacles.

    Parameters
    ----------
    mesh
        The candidate mesh, metres.
    site
        The site with its obstacles.
    clearance
        Wished distance of an edge from an obstacle (half the width of a street), metres.
    reach
        Furthest move of a vertex, in mesh edge lengths.

    Returns
    -------
    QuadMesh
        The same mesh with other positions of inner vertices, or `mesh` itself where nothing is
        gained. Boundary, fixed and attracted vertices stay. No edge that was free becomes
        barred unless more than that is gained elsewhere, and never are more edges barred; no
        cell gets a scaled Jacobian under 0.35 that it did not have before.

    Examples
    --------
    >>> from platwright.mesh import grid
    >>> from pyproj import CRS
    >>> from shapely.geometry import box
    >>> house = box(134, 134, 154, 154)
    >>> utm = CRS(32633)
    >>> site = Site("Field", 1, box(0, 0, 288, 288), utm, utm, obstacles=[house])
    >>> moved = make_way(grid(4, 4, 72.0), site)
    >>> lines = shapely.linestrings(moved.vertices[moved.edges])
    >>> bool(shapely.crosses(lines, house).any())
    False
    """
    if not site.obstacles or mesh.boundary_vertices.all():
        return mesh
    judge = _Judge(mesh, site, clearance, reach * mesh.edge_length)
    start = judge.verdict(mesh.vertices)
    if start.clear:
        return mesh
    pull = _Pull(mesh, judge)
    best = _search(pull, judge, start)
    return mesh if best is start else dataclasses.replace(mesh, vertices=best.vertices)


@dataclass(frozen=True, eq=False)
class _Verdict:
    """How good positions are: cost, barred edges, and the overlap of each obstacle group."""

    vertices: FloatArray
    cost: float
    barred: int
    trouble: FloatArray

    @property
    def clear(self) -> bool:
        """No edge is barred or too near."""
        return not self.trouble.any()

    def beats(self, other: _Verdict, start: _Verdict) -> bool:
        """Tell whether this is better by more than rounding and bars no more than at first."""
        return self.barred <= start.barred and self.cost < other.cost - 1e-6


@dataclass(frozen=True, eq=False)
class _Choice:
    """Sides (k, 2) that pass an obstacle group on their left, and an estimate of their cost."""

    walls: IntArray
    price: float


class _Judge:
    """Rates positions of the vertices, and takes back moves that spoil cells.

    Parameters
    ----------
    mesh, site
        The mesh and the site.
    clearance
        Wished distance from obstacles, metres.
    limit
        Furthest move, metres.
    """

    def __init__(self, mesh: QuadMesh, site: Site, clearance: float, limit: float) -> None:
        self.mesh, self.limit = mesh, limit
        pinned = mesh.boundary_vertices | mesh.fixed
        pinned[list(mesh.attracted)] = True
        self.pinned: BoolArray = pinned
        self.edges: IntArray = np.flatnonzero(~mesh.boundary_edges & ~mesh.foreign)
        solid = shapely.union_all(list(site.obstacles))
        self.solid = shapely.buffer(solid, 0.01)
        # between obstacles nearer than the clearance no street fits: they are one
        joined = shapely.buffer(solid, clearance / 2)
        self.groups = shapely.buffer(shapely.get_parts(joined), clearance / 2)
        self.tree = shapely.STRtree(self.groups)
        self.ground = site.polygon
        shapely.prepare(self.ground)
        shapely.prepare(self.solid)
        self.triples: IntArray = line_triples(mesh)
        self.least: FloatArray = np.minimum(SQUARE, scaled_jacobians(mesh.vertices, mesh.faces))
        self.outside: FloatArray = np.maximum(FOREIGN_LENGTH, self._outside(mesh.vertices))

    def _lines(self, vertices: FloatArray) -> shapely.Geometry:
        return shapely.linestrings(vertices[self.mesh.edges[self.edges]])

    def _outside(self, vertices: FloatArray) -> FloatArray:
        """Length of every inner edge outside the site, metres."""
        lines = self._lines(vertices)
        away = np.zeros(len(lines))
        some = np.flatnonzero(~shapely.covers(self.ground, lines))
        away[some] = shapely.length(shapely.difference(lines[some], self.ground))
        return away

    def verdict(self, vertices: FloatArray) -> _Verdict:
        """Rate positions: barred edges by length, edges too near, turns of mesh lines."""
        lines = self._lines(vertices)
        size = shapely.length(lines)
        edge, group = self.tree.query(lines, predicate="intersects")
        inside = shapely.length(shapely.intersection(lines[edge], self.groups[group]))
        touched = np.zeros(len(lines))
        np.add.at(touched, edge, inside)
        near = touched > TOUCH
        hit = np.flatnonzero(near)
        solid = shapely.length(shapely.intersection(lines[hit], self.solid))
        barred = np.zeros(len(lines), dtype=np.bool_)
        barred[hit] = solid > TOUCH
        weight = np.where(barred, 1.0, NEAR * near) * size / self.mesh.edge_length
        trouble = np.zeros(len(self.groups))
        np.add.at(trouble, group, weight[edge])
        turn = line_bends(vertices, self.triples) / TURN
        cost = float(weight.sum() + (turn**2).sum())
        return _Verdict(vertices, cost, int(barred.sum()), trouble)

    def repaired(self, vertices: FloatArray) -> FloatArray:
        """Take moves back until none is too far, no cell is bad and no edge leaves the site."""
        mesh = self.mesh
        move = vertices - mesh.vertices
        far = np.hypot(*move.T)[:, None]
        move *= np.minimum(1.0, self.limit / np.maximum(far, 1e-9))
        for _ in range(25):
            now = mesh.vertices + move
            worse = scaled_jacobians(now, mesh.faces) < self.least - 1e-9
            out = self._outside(now) > self.outside + 1e-6
            if not worse.any() and not out.any():
                return now
            guilty = [mesh.faces[worse].ravel(), mesh.edges[self.edges[out]].ravel()]
            move[np.unique(np.concatenate(guilty))] *= 0.75
        return mesh.vertices


class _Pull:
    """Finds positions at which the sides of cells pass by the obstacles given to the cells."""

    def __init__(self, mesh: QuadMesh, judge: _Judge) -> None:
        self.mesh, self.judge = mesh, judge
        free = np.flatnonzero(~judge.pinned)
        self.free: IntArray = free
        self.column = np.full(len(mesh.vertices), -1)
        self.column[free] = np.arange(len(free))
        self.factor = splu(self._energy(judge.triples).tocsc())
        self.rings = [_ring_points(group, mesh.edge_length) for group in judge.groups]
        self.choices = _choices(mesh, judge, self.rings)

    def _energy(self, triples: IntArray) -> sparse.spmatrix:
        """The energy of moves in x (the same in y) of the free vertices."""
        n, edges = len(self.mesh.vertices), self.mesh.edges
        second = _stencil(n, triples, (1.0, -2.0, 1.0))
        first = _stencil(n, edges, (1.0, -1.0))
        full = BEND * second.T @ second + SHEAR * first.T @ first + STAY * sparse.identity(n)
        return full.tocsr()[self.free][:, self.free]

    def positions(self, walls: Sequence[IntArray]) -> FloatArray:
        """Find positions at which the sides ``walls[i]`` pass by obstacle group i."""
        mesh = self.mesh
        now = mesh.vertices
        side = np.concatenate(walls)
        if not len(side):
            return now
        pair = np.repeat(
            np.arange(len(side)),
            np.concatenate([[len(r)] * len(w) for w, r in zip(walls, self.rings)]).astype(int),
        )
        points = np.concatenate([r for w, r in zip(walls, self.rings) for _ in w])
        for _ in range(ROUNDS):
            rows = _Rows(self.column, mesh.vertices, now)
            _pass_rows(rows, side[pair], pair, points, mesh.edge_length, self.judge.limit)
            _reach_rows(rows, self.judge.limit)
            now = mesh.vertices.copy()
            now[self.free] += rows.solve(self.factor, len(self.free))
        return self.judge.repaired(now)


class _Rows:
    """Linear inequalities on the moves of the vertices.

    Parameters
    ----------
    column
        Shape (n,). Column of each vertex, -1 where it may not move.
    start, now
        Shape (n, 2). Positions before all moves and those to linearise at.
    """

    def __init__(self, column: IntArray, start: FloatArray, now: FloatArray) -> None:
        self.column, self.now = column, now
        self.moved: FloatArray = now - start
        self.parts: list[tuple[IntArray, FloatArray, FloatArray]] = []

    def add(self, vertices: IntArray, slopes: FloatArray, gap: FloatArray) -> None:
        """Ask that the further move times `slopes` (r, k, 2) is at least `gap` (r,)."""
        so_far = (slopes * self.moved[vertices]).sum(axis=(1, 2))
        self.parts.append((vertices, slopes, gap + so_far))

    def solve(self, factor: splu, count: int) -> FloatArray:
        """Least energy moves (count, 2) of the free vertices that keep to the rows."""
        matrix = np.zeros((2, sum(len(part[2]) for part in self.parts), count + 1))
        first = 0
        for vertices, slopes, _ in self.parts:
            rows = np.arange(first, first + len(vertices))[:, None]
            for axis in (0, 1):
                np.add.at(matrix[axis], (rows, self.column[vertices]), slopes[..., axis])
            first += len(vertices)
        right = np.concatenate([part[2] for part in self.parts])
        if not (right > 0).any():
            return np.zeros((count, 2))
        x, y = matrix[0, :, :-1], matrix[1, :, :-1]
        answer = factor.solve(np.vstack([x, y]).T)
        ax, ay = answer[:, : len(right)], answer[:, len(right) :]
        gram = x @ ax + y @ ay + np.identity(len(right)) / HARD
        lower = np.linalg.cholesky(gram)
        push, _ = nnls(lower.T, np.linalg.solve(lower, right), maxiter=50 * len(right))
        return np.column_stack([ax @ push, ay @ push])


def _search(pull: _Pull, judge: _Judge, start: _Verdict) -> _Verdict:
    """Improve what is given to obstacle groups, one at a time, the most promising first."""
    picks = [0] * len(pull.choices)
    done: set[tuple[int, ...]] = set()

    def tried(picks: Sequence[int]) -> _Verdict:
        done.add(tuple(picks))
        walls = [pull.choices[g][k].walls for g, k in enumerate(picks)]
        return judge.verdict(pull.positions(walls))

    def moves() -> list[tuple[float, int, int]]:
        return sorted(
            (choice.price - pull.choices[g][picks[g]].price - TROUBLE * here.trouble[g], g, k)
            for g, choices in enumerate(pull.choices)
            for k, choice in enumerate(choices)
            if k != picks[g]
        )

    here = tried(picks)
    best = here if here.beats(start, start) else start
    queue = moves()
    while queue and len(done) <= TRIALS:
        _, g, k = queue.pop(0)
        other = [*picks[:g], k, *picks[g + 1 :]]
        if tuple(other) in done:
            continue
        found = tried(other)
        if found.beats(best, start):
            best = found
        if found.cost < here.cost - 1e-6:
            here, picks = found, other
            queue = moves()
    return best


def _stencil(n: int, index: IntArray, weights: tuple[float, ...]) -> sparse.csr_matrix:
    """Rows with the same weights at the vertices of each row of `index`."""
    rows = np.repeat(np.arange(len(index)), len(weights))
    return sparse.csr_matrix(
        (np.tile(weights, len(index)), (rows, index.ravel())), shape=(len(index), n)
    )


def _ring_points(group: shapely.Geometry, edge_length: float) -> FloatArray:
    """Points (k, 2) closely spaced round a group of obstacles."""
    ring = shapely.simplify(shapely.get_exterior_ring(group), 0.3)
    points: FloatArray = shapely.get_coordinates(shapely.segmentize(ring, edge_length / 16))
    return points[:-1]


def _walls(mesh: QuadMesh, cells: IntArray, pinned: BoolArray) -> IntArray:
    """Find the sides (k, 2) of some cells that shall pass what lies in them on their left."""
    inside = np.zeros(len(mesh.faces) + 1, dtype=np.bool_)
    inside[cells] = True
    inside[-1] = True  # where the twin is -1: sides on the boundary stay anyway
    half = (4 * cells[:, None] + np.arange(4)).ravel()
    half = half[~inside[mesh.twins[half] // 4]]
    face, side = half // 4, half % 4
    walls = np.column_stack([mesh.faces[face, side], mesh.faces[face, (side + 1) % 4]])
    return walls[~pinned[walls].all(axis=1)]


def _beside(
    points: FloatArray, tail: FloatArray, head: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Left normals of edges; shares along them and offsets to their left of points."""
    along = head - tail
    size = np.maximum(np.hypot(along[..., 0], along[..., 1]), 1e-9)
    normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
    gap = points - tail
    return normal, (gap * along).sum(axis=-1) / size**2, (gap * normal).sum(axis=-1)


def _pass_rows(
    rows: _Rows,
    ends: IntArray,
    pair: IntArray,
    points: FloatArray,
    edge_length: float,
    limit: float,
) -> None:
    """Ask that points lie on the left of edges, the worst of each pair in each sixth of it."""
    normal, share, offset = _beside(points, rows.now[ends[:, 0]], rows.now[ends[:, 1]])
    free = rows.column[ends] >= 0
    share_in = np.clip(share, 0.0, 1.0)
    weight = np.column_stack([1.0 - share_in, share_in])
    lever = np.hypot(*(weight * free).T)
    # what no allowed move can mend would only drag everything else along
    use = (np.abs(share - 0.5) < 0.55) & (offset < 0.1 * edge_length)
    use &= -offset < 1.5 * limit * lever
    some = np.flatnonzero(use)
    slot = pair[some] * 6 + np.floor(share_in[some] * 5.999).astype(np.int64)
    some = some[np.lexsort((offset[some], slot))]
    slot = np.sort(slot)
    some = some[np.diff(slot, prepend=-1) > 0]
    slopes = -weight[some][:, :, None] * normal[some][:, None, :]
    rows.add(ends[some], slopes, -offset[some])


def _reach_rows(rows: _Rows, limit: float) -> None:
    """Ask that no vertex moves further than `limit` metres."""
    far = np.hypot(*rows.moved.T)
    some = np.flatnonzero(far > 0.9 * limit)
    slopes = -(rows.moved[some] / far[some, None])[:, None, :]
    rows.add(some[:, None], slopes, far[some] - 0.98 * limit)


def _choices(mesh: QuadMesh, judge: _Judge, rings: Sequence[FloatArray]) -> list[list[_Choice]]:
    """List what each obstacle group may be given, as sides that pass it, most promising first.

    Sets that leave out cells which the group covers now ask the mesh to move; those of several
    cells leave the edges between barred. Last comes no cell at all: the group is given up.
    """
    shapes = shapely.polygons(mesh.vertices[mesh.faces])
    tree = shapely.STRtree(shapes)
    choices = []
    for group, ring in zip(judge.groups, rings):
        faces = np.sort(tree.query(group, predicate="intersects"))
        covered = shapely.area(shapely.intersection(shapes[faces], group))
        order = np.argsort(-covered, kind="stable")
        faces = faces[order][covered[order] > 0.1]
        sets = {tuple(sorted(faces[:k].tolist())) for k in range(1, len(faces) + 1)}
        top = faces[:COMBINED].tolist()
        for k in range(1, len(top) + 1):
            sets |= {tuple(sorted(some)) for some in itertools.combinations(top, k)}
        rated = []
        for some in sorted(sets):
            cells = np.array(some, dtype=np.int64)
            walls = _walls(mesh, cells, judge.pinned)
            rated.append(_Choice(walls, _price(mesh, judge, cells, walls, group, ring)))
        rated.sort(key=lambda choice: choice.price)
        none = np.zeros((0, 2), dtype=np.int64)
        given_up = _Choice(none, _price(mesh, judge, faces, none, group, ring))
        choices.append([*rated[:CHOICES], given_up])
    return choices


def _price(
    mesh: QuadMesh,
    judge: _Judge,
    cells: IntArray,
    walls: IntArray,
    group: shapely.Geometry,
    ring: FloatArray,
) -> float:
    """Estimate what it costs to give cells to a group: edges given up, edges moved."""
    h = mesh.edge_length
    sides, uses = np.unique(mesh.face_edges[cells], return_counts=True)
    inner = sides[(uses == 2) & ~mesh.foreign[sides]]
    lines = shapely.linestrings(mesh.vertices[mesh.edges[inner]])
    lost = shapely.length(shapely.intersection(lines, group)) > TOUCH
    ends = mesh.vertices[walls]
    _, share, offset = _beside(ring, ends[:, :1], ends[:, 1:])
    within = np.clip(share, 0.0, 1.0)
    pinned = judge.pinned[walls][:, None]
    lever = np.hypot((1 - within) * ~pinned[..., 0], within * ~pinned[..., 1])
    short = np.where(np.abs(share - 0.5) < 0.55, -offset, 0.0) / np.maximum(lever, 1e-6)
    need = short.max(axis=1, initial=0.0)
    # one vertex out of line by d makes turns of about 2 d / h there and d / h beside
    moved = np.where(need < judge.limit, np.minimum(1.0, 6 * (need / h / TURN) ** 2), 1.0)
    return float(mesh.lengths[inner][lost].sum() / h + moved.sum())
