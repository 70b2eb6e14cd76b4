"""The energy of a street mesh and the step that lowers it (UP section 6, eqs. 3 to 7)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, csr_array, diags
from scipy.sparse.linalg import splu

from ..roadmesh import StreetMesh
from ..rules import ParcelRules
from .freedom import Freedom, freedom_of
from .roads import Roads, roads_of
from .strips import Strips, strips_of
from .weights import Weights

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: Junctions that would slide too far are held at the end of their way so many times.
HOLDS = 3
#: How SuperLU orders and pivots a symmetric positive definite matrix.
_SYMMETRIC = {
    "permc_spec": "MMD_AT_PLUS_A",
    "diag_pivot_thresh": 0.0,
    "options": {"SymmetricMode": True},
}


@dataclass(frozen=True)
class Terms:
    """All terms of the energy as |A v - b|^2, v the x of all vertices and then their y.

    Attributes
    ----------
    matrix, wished
        A and b, weights included.
    """

    matrix: csr_array
    wished: Floats

    def value(self, xy: Floats) -> float:
        """Return the energy, square metres, at places of shape (n, 2)."""
        return float(((self.matrix @ xy.ravel(order="F") - self.wished) ** 2).sum())


@dataclass(frozen=True)
class Energy:
    """How far a mesh is from what is wished.

    Attributes
    ----------
    start
        Places of the vertices at the beginning, shape (n, 2), metres.
    freedom, roads, strips
        What may move, the streets, and the regions with four sides.
    weights
        Of the terms.
    """

    start: Floats
    freedom: Freedom
    roads: Roads
    strips: Strips
    weights: Weights

    @classmethod
    def of(cls, mesh: StreetMesh, rules: ParcelRules, weights: Weights) -> Energy:
        """Set up the energy of a mesh, whose vertices should stay near to where they are.

        Parameters
        ----------
        mesh
            The mesh.
        rules, weights
            See `optimise_mesh`.
        """
        return cls(
            mesh.xy.copy(),
            freedom_of(mesh),
            roads_of(mesh),
            strips_of(mesh, rules, sorted(mesh.regions)),
            weights,
        )

    def renewed(self, mesh: StreetMesh, junctions: Collection[int]) -> Energy | None:
        """Set up the same energy after junctions have passed vertices of the edge.

        Parameters
        ----------
        mesh
            The mesh as it is then.
        junctions
            Vertices of these junctions.

        Returns
        -------
        Energy or None
            With the same strips and streets; None if a strip lost a corner.
        """
        strips = self.strips.again(mesh)
        if strips is None:
            return None
        roads = self.roads.renewed(mesh, junctions)
        return replace(self, freedom=freedom_of(mesh), roads=roads, strips=strips)

    def at(self, xy: Floats) -> Terms:
        """All terms at places of the vertices, strips and directions fitted to them.

        Parameters
        ----------
        xy
            Shape (n, 2), metres.
        """
        n = len(xy)
        targets, count = self.strips.targets(xy)
        near = np.flatnonzero(count > 0)
        every = np.arange(n)
        a, v, b = self.roads.fair.T
        share = 2 * self.roads.bends(xy)
        twice = np.full(len(v), 2.0)
        shape, fair, close = (
            np.sqrt(w) for w in (self.weights.shape, self.weights.fairness, self.weights.closeness)
        )
        rows = _Rows(n)
        wish = shape * np.sqrt(np.minimum(count[near], 1.0))
        rows.both([(near, wish)], wish[:, None] * targets[near])
        # twice the way to the place on the line from the vertex before to the one after: for
        # even steps, the second difference of eq. 6
        rows.both(
            [(a, fair * (twice - share)), (v, -fair * twice), (b, fair * share)],
            np.zeros((len(v), 2)),
        )
        rows.both([(every, np.full(n, close))], close * self.start)
        self._square(xy, rows)
        return rows.terms()

    def step(self, xy: Floats, terms: Terms, drag: Floats) -> tuple[Floats, Floats]:
        """Find the way to where the energy is least, strips and directions staying as they are.

        Parameters
        ----------
        xy
            Places of the vertices, shape (n, 2), metres.
        terms
            Of the energy there.
        drag
            Weight of the square of each vertex's own step, shape (n,): what must not go far.

        Returns
        -------
        step
            Shape (n, 2), metres; 0 for what is fixed, along their edges for junctions that
            slide, within the room that they have.
        held
            Which of these junctions would go on, over their neighbour before (-1) or after (1);
            0 for the others, shape (s,).
        """
        moves = self.freedom.matrix(xy)
        own = csc_array(terms.matrix @ moves)
        brake = np.r_[np.tile(drag[self.freedom.free], 2), drag[self.freedom.sliders]]
        lack = terms.wished - terms.matrix @ xy.ravel(order="F")
        low, high = self.freedom.room(xy)
        first = 2 * len(self.freedom.free)
        q = np.zeros(own.shape[1])
        held = np.zeros(len(q), dtype=bool)
        beyond = np.zeros(len(low))
        for _ in range(HOLDS):
            # what is held stays at the end of its way; all else takes that into account
            left = np.flatnonzero(~held)
            part = own[:, left] if held.any() else own
            right = part.T @ (lack - own @ np.where(held, q, 0.0))
            system = part.T @ part + diags(brake[left])
            q[left] = splu(csc_array(system), **_SYMMETRIC).solve(right)
            slide = np.clip(q[first:], -low, high)
            over = slide != q[first:]
            beyond[over] = np.sign(q[first:] - slide)[over]
            q[first:] = slide
            if not (over & ~held[first:]).any():
                break
            held[first:] |= over
        return np.asarray((moves @ q).reshape(2, -1).T), beyond

    def _square(self, xy: Floats, rows: _Rows) -> None:
        """How far the ends of streets are from right angles, as metres `roads.REACH` away."""
        junction, stem = self.roads.square[:, 0], self.roads.square[:, 1]
        factor = np.sqrt(self.weights.square * self.roads.share) * self.roads.scale(xy)
        x, y = (self.roads.ways(xy) * factor[:, None]).T
        n = len(xy)
        rows.add([(stem, x), (stem + n, y), (junction, -x), (junction + n, -y)], np.zeros(len(x)))


class _Rows:
    """Gathers the rows of a sparse system on the x and then the y of n vertices."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._size = 0
        self._row: list[Ints] = []
        self._column: list[Ints] = []
        self._value: list[Floats] = []
        self._wished: list[Floats] = []

    def add(self, entries: Sequence[tuple[Ints, Floats]], wished: Floats) -> None:
        """Add rows: each entry gives one column and one value per row."""
        rows = self._size + np.arange(len(wished))
        for column, value in entries:
            self._row.append(rows)
            self._column.append(column)
            self._value.append(value)
        self._wished.append(wished)
        self._size += len(wished)

    def both(self, entries: Sequence[tuple[Ints, Floats]], wished: Floats) -> None:
        """Add the same rows for x and for y."""
        self.add(entries, wished[:, 0])
        self.add([(column + self._n, value) for column, value in entries], wished[:, 1])

    def terms(self) -> Terms:
        """Return the system."""
        where = (np.concatenate(self._row), np.concatenate(self._column))
        matrix = csr_array((np.concatenate(self._value), where), shape=(self._size, 2 * self._n))
        return Terms(matrix, np.concatenate(self._wished))
