"""Mesh lines step aside for obstacles before streets are chosen.

With the planner's rules an edge of the candidate mesh is as long as a block is wide, and a
building on it bars it. A planner would shift the street a little. So every obstacle is given
the cells in which it shall lie (one where it fits, several where it does not), and the vertices
move as little and as evenly as they can until the sides of those cells pass it by: a quadratic
programme with second differences along mesh lines as energy and one linear inequality for each
place where an edge would touch, solved in its dual by non-negative least squares and
re-linearised a few times. Obstacles get their cells one by one; a local search improves that.
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
from .wishes import TOUCH

#: Energy of vertex moves: even along mesh lines, alike at both ends of an edge, small; and the
#: weight of a broken inequality against it.
BEND, SHEAR, STAY, HARD = 1.0, 0.1, 0.03, 1e3
#: What a mesh costs: an edge that comes too near, against 1 for a barred one of full length,
#: and the turn of a mesh line at one vertex (radians) that is as bad as that.
NEAR, TURN = 0.1, np.pi / 4
#: Least scaled Jacobian that a cell may get; metres to spare, as inequalities give a little.
SQUARE, SPARE = 0.35, 0.3
#: Positions tried, and how often each is re-linearised.
TRIALS, ROUNDS = 36, 3
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
    judge = _Judge(mesh, site, clearance, reach * mesh.edge_length)
    start = judge.verdict(mesh.vertices)
    if judge.pinned.all() or not start.trouble.any():
        return mesh
    search = _Search(_Pull(mesh, judge), judge, start)
    search.insert()
    search.improve()
    if search.best is start:
        return mesh
    return dataclasses.replace(mesh, vertices=search.best.vertices)


@dataclass(frozen=True, eq=False)
class _Verdict:
    """How good positions are: cost, barred edges, and what each obstacle group has part in."""

    vertices: FloatArray
    cost: float
    barred: int
    trouble: FloatArray


@dataclass(frozen=True, eq=False)
class _Choice:
    """Cells for an obstacle group and the sides (k, 2) of them that pass it on their left."""

    cells: IntArray
    walls: IntArray


class _Judge:
    """Rates positions of the vertices, and takes back moves that spoil cells."""

    def __init__(self, mesh: QuadMesh, site: Site, clearance: float, limit: float) -> None:
        self.mesh, self.limit = mesh, limit
        pinned = mesh.boundary_vertices | mesh.fixed
        pinned[list(mesh.attracted)] = True
        self.pinned: BoolArray = pinned
        self.edges: IntArray = np.flatnonzero(~mesh.boundary_edges & ~mesh.foreign)
        self.solid = shapely.buffer(site.obstacle_union, 0.01)
        # between obstacles nearer than the clearance no street fits: they are one
        joined = shapely.get_parts(shapely.buffer(self.solid, clearance / 2, quad_segs=3))
        self.groups = shapely.buffer(joined, clearance / 2, quad_segs=3)
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
        some = ~shapely.covers(self.ground, lines)
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
        barred = near.copy()
        barred[near] = shapely.length(shapely.intersection(lines[near], self.solid)) > TOUCH
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
        second = _stencil(len(mesh.vertices), judge.triples, (1.0, -2.0, 1.0))[:, free]
        first = _stencil(len(mesh.vertices), mesh.edges, (1.0, -1.0))[:, free]
        energy = BEND * second.T @ second + SHEAR * first.T @ first
        self.factor = splu((energy + STAY * sparse.identity(len(free))).tocsc())
        rings = shapely.simplify(shapely.get_exterior_ring(judge.groups), 0.3)
        spaced = shapely.segmentize(rings, mesh.edge_length / 16)
        self.rings = [shapely.get_coordinates(ring)[:-1] for ring in spaced]

    def positions(self, walls: Sequence[IntArray]) -> FloatArray:
        """Find positions at which the sides ``walls[i]`` pass by obstacle group i."""
        start = now = self.mesh.vertices
        side = np.concatenate(walls)
        if not len(side):
            return now
        rings = [ring for some, ring in zip(walls, self.rings) for _ in some]
        pair = np.repeat(np.arange(len(side)), [len(ring) for ring in rings])
        points = np.concatenate(rings)
        for _ in range(ROUNDS):
            parts = [self._pass_rows(now, side[pair], pair, points), self._reach_rows(now)]
            ends, slopes, gap = (np.concatenate(part) for part in zip(*parts))
            right = gap + (slopes * (now - start)[ends]).sum(axis=(1, 2))
            now = start.copy()
            now[self.free] += self._solve(ends, slopes, right)
        return self.judge.repaired(now)

    def _pass_rows(
        self, now: FloatArray, ends: IntArray, pair: IntArray, points: FloatArray
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Ask that points lie on the left of edges, the worst of a pair in each sixth of it.

        Returns
        -------
        tuple of ndarray
            Rows: further moves of the vertices (r, 2) times the slopes (r, 2, 2) shall sum to
            the gap (r,) at least.
        """
        h = self.mesh.edge_length
        normal, share, offset = _beside(points, now[ends[:, 0]], now[ends[:, 1]])
        offset = offset - SPARE
        within = np.clip(share, 0.0, 1.0)
        weight = np.column_stack([1.0 - within, within])
        lever = np.hypot(*(weight * (self.column[ends] >= 0)).T)
        use = (np.abs(share - 0.5) < 0.55) & (offset < 0.1 * h)
        # what no allowed move can mend would only drag everything else along
        use &= -offset < 1.5 * self.judge.limit * lever
        some = np.flatnonzero(use)
        slot = pair[some] * 6 + np.floor(within[some] * 5.999).astype(np.int64)
        some = some[np.lexsort((offset[some], slot))]
        some = some[np.diff(np.sort(slot), prepend=-1) > 0]
        return ends[some], -weight[some][:, :, None] * normal[some][:, None, :], -offset[some]

    def _reach_rows(self, now: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Ask in the same way that no vertex moves further than allowed."""
        move = now - self.mesh.vertices
        far = np.hypot(*move.T)
        some = np.flatnonzero(far > 0.9 * self.judge.limit)
        slopes = np.zeros((len(some), 2, 2))
        slopes[:, 0] = -move[some] / far[some, None]
        return np.column_stack([some, some]), slopes, far[some] - 0.98 * self.judge.limit

    def _solve(self, ends: IntArray, slopes: FloatArray, right: FloatArray) -> FloatArray:
        """Find the moves (f, 2) of the free vertices of least energy that keep to rows."""
        if not (right > 0).any():
            return np.zeros((len(self.free), 2))
        place = self.column[ends]
        slopes = slopes * (place >= 0)[..., None]
        used, where = np.unique(np.maximum(place, 0), return_inverse=True)
        unit = np.zeros((len(self.free), len(used)))
        unit[used, np.arange(len(used))] = 1.0
        answer = self.factor.solve(unit)
        x, y = np.zeros((2, len(right), len(used)))
        for matrix, slope in ((x, slopes[..., 0]), (y, slopes[..., 1])):
            np.add.at(matrix, (np.arange(len(right))[:, None], where.reshape(-1, 2)), slope)
        gram = x @ answer[used] @ x.T + y @ answer[used] @ y.T
        lower = np.linalg.cholesky(gram + np.identity(len(right)) / HARD)
        try:
            push, _ = nnls(lower.T, np.linalg.solve(lower, right), maxiter=50 * len(right))
        except RuntimeError:  # cycling: no answer is no move
            push = np.zeros(len(right))
        return np.column_stack([answer @ (x.T @ push), answer @ (y.T @ push)])


class _Search:
    """Looks for the cells to give to each obstacle group."""

    def __init__(self, pull: _Pull, judge: _Judge, start: _Verdict) -> None:
        self.pull, self.judge, self.start = pull, judge, start
        self.choices, self.prices = _choices(pull, judge)
        #: Number of the choice of each group: given up where it is contested.
        self.picks = [len(p) - 1 if p[0] > 0 else 0 for p in self.prices]
        self.tried: set[tuple[int, ...]] = set()
        self.here = self.best = start
        self._attempt(self.picks, always=True)

    def _attempt(self, picks: list[int], *, always: bool = False) -> bool:
        """Try a choice; take it up if it is better, or always."""
        if tuple(picks) in self.tried or len(self.tried) >= TRIALS:
            return False
        self.tried.add(tuple(picks))
        walls = [self.choices[g][k].walls for g, k in enumerate(picks)]
        found = self.judge.verdict(self.pull.positions(walls))
        if found.barred <= self.start.barred and found.cost < self.best.cost - 1e-6:
            self.best = found
        if not always and found.cost >= self.here.cost - 1e-6:
            return False
        self.here, self.picks = found, picks
        return True

    def insert(self) -> None:
        """Give cells to one contested group after the other, the largest first."""
        contested = [g for g, k in enumerate(self.picks) if k > 0]
        for g in sorted(contested, key=lambda g: -shapely.area(self.judge.groups[g])):
            # the mesh has moved: what was dear may have become cheap
            prices = [_price(self.pull, self.here.vertices, g, c) for c in self.choices[g]]
            k = int(np.argmin(prices))
            self._attempt([*self.picks[:g], k, *self.picks[g + 1 :]], always=True)

    def improve(self) -> None:
        """Change the cells of one group at a time, most promising first, while that helps."""
        improved = True
        while improved:
            moves = sorted(
                (price - prices[self.picks[g]] - self.here.trouble[g], g, k)
                for g, prices in enumerate(self.prices)
                for k, price in enumerate(prices)
            )
            improved = any(
                self._attempt([*self.picks[:g], k, *self.picks[g + 1 :]]) for _, g, k in moves
            )


def _stencil(n: int, index: IntArray, weights: tuple[float, ...]) -> sparse.csr_matrix:
    """Rows with the same weights at the vertices of each row of `index`."""
    rows = np.repeat(np.arange(len(index)), len(weights))
    return sparse.csr_matrix(
        (np.tile(weights, len(index)), (rows, index.ravel())), shape=(len(index), n)
    )


def _walls(mesh: QuadMesh, cells: IntArray, pinned: BoolArray) -> IntArray:
    """Find the sides (k, 2) of some cells that shall pass what lies in them on their left."""
    inside = np.zeros(len(mesh.faces) + 1, dtype=np.bool_)
    inside[cells] = True
    inside[-1] = True  # where the twin is -1: sides on the boundary stay anyway
    half = (4 * cells[:, None] + np.arange(4)).ravel()
    half = half[~inside[mesh.twins[half] // 4]]
    face, side = half // 4, half % 4
    walls = np.column_stack([mesh.faces[face, side], mesh.faces[face, (side + 1) % 4]])
    movable: IntArray = walls[~pinned[walls].all(axis=1)]
    return movable


def _beside(
    points: FloatArray, tail: FloatArray, head: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Left normals of edges; shares along them and offsets to their left of points."""
    along = head - tail
    size = np.maximum(np.hypot(along[..., 0], along[..., 1]), 1e-9)
    normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
    gap = points - tail
    return normal, (gap * along).sum(axis=-1) / size**2, (gap * normal).sum(axis=-1)


def _choices(pull: _Pull, judge: _Judge) -> tuple[list[list[_Choice]], list[list[float]]]:
    """List what each obstacle group may be given, and the prices, most promising first.

    Sets that leave out cells which the group covers now ask the mesh to move; those of several
    cells leave the edges between barred. Last comes no side at all: the group is given up.
    """
    mesh = judge.mesh
    shapes = shapely.polygons(mesh.vertices[mesh.faces])
    tree = shapely.STRtree(shapes)
    choices, prices = [], []
    for g, group in enumerate(judge.groups):
        faces = np.sort(tree.query(group, predicate="intersects"))
        covered = shapely.area(shapely.intersection(shapes[faces], group))
        order = np.argsort(-covered, kind="stable")
        faces = faces[order][covered[order] > 0.1]
        sets = {tuple(sorted(faces[:k].tolist())) for k in range(1, len(faces) + 1)}
        top = faces[:COMBINED].tolist()
        for k in range(1, len(top) + 1):
            sets |= {tuple(sorted(some)) for some in itertools.combinations(top, k)}
        own = [np.array(some, dtype=np.int64) for some in sorted(sets)]
        found = [_Choice(cells, _walls(mesh, cells, judge.pinned)) for cells in own]
        rated = [_price(pull, mesh.vertices, g, choice) for choice in found]
        kept = np.argsort(rated, kind="stable")[:CHOICES].tolist()
        given_up = _Choice(faces, np.zeros((0, 2), dtype=np.int64))
        choices.append([*(found[k] for k in kept), given_up])
        prices.append([*(rated[k] for k in kept), _price(pull, mesh.vertices, g, given_up)])
    return choices, prices


def _price(pull: _Pull, vertices: FloatArray, g: int, choice: _Choice) -> float:
    """Estimate what it costs to give cells to group g: edges given up, edges moved."""
    mesh, judge = pull.mesh, pull.judge
    h = mesh.edge_length
    sides, uses = np.unique(mesh.face_edges[choice.cells], return_counts=True)
    inner = sides[(uses == 2) & ~mesh.foreign[sides]]
    lines = shapely.linestrings(vertices[mesh.edges[inner]])
    lost = shapely.length(shapely.intersection(lines, judge.groups[g])) > TOUCH
    ends = vertices[choice.walls]
    _, share, offset = _beside(pull.rings[g], ends[:, :1], ends[:, 1:])
    within = np.clip(share, 0.0, 1.0)
    pinned = judge.pinned[choice.walls][:, None]
    lever = np.hypot((1 - within) * ~pinned[..., 0], within * ~pinned[..., 1])
    short = np.where(np.abs(share - 0.5) < 0.55, -offset, 0.0) / np.maximum(lever, 1e-6)
    need = short.max(axis=1, initial=0.0)
    # one vertex out of line by d makes turns of about 2 d / h there and d / h beside
    moved = np.where(need < judge.limit, np.minimum(1.0, 6 * (need / h / TURN) ** 2), 1.0)
    return float(mesh.lengths[inner][lost].sum() / h + moved.sum())
