"""Smoothing: cells become near squares of the asked size, mesh lines straight.

The energy per corner of a cell is the foldover-free one of Garanzha et al. (2021), "Foldover-
free maps in 50 lines of code", equations 3-5, with the shape and the area term; inverted
corners have a finite energy and are turned round. Added are the squared second differences
along the mesh lines. Boundary vertices slide along their ring. The minimum is sought by L-BFGS.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix

from .build import Draft
from .quadmesh import BoolArray, FloatArray, IntArray, QuadMesh
from .rings import Ring

AREA = 1.0
STRAIGHT = 0.4
SAFE = 0.05
"""Jacobian (1 for the ideal square) above which a mesh counts as free of foldovers."""


def line_triples(topology: QuadMesh) -> IntArray:
    """Return the vertex triples (k, 3) in a row through inner vertices of valence 4."""
    regular = np.flatnonzero(~topology.boundary_vertices & (topology.valences == 4))
    if not len(regular):
        return np.zeros((0, 3), dtype=np.int64)
    fans = np.array([topology.vertex_edges[v] for v in regular])
    ends = topology.edges[fans]
    other = np.where(ends[..., 0] == regular[:, None], ends[..., 1], ends[..., 0])
    return np.vstack([np.column_stack([other[:, k], regular, other[:, k + 2]]) for k in (0, 1)])


def _rows(columns: int, *blocks: Sequence[tuple[IntArray, float]]) -> csr_matrix:
    """Stack blocks of rows, each the sum of some vertices times a factor."""
    rows, indices, values, first = [], [], [], 0
    for block in blocks:
        size = len(block[0][0])
        for index, factor in block:
            rows.append(np.arange(first, first + size))
            indices.append(index)
            values.append(np.full(size, factor))
        first += size
    where = (np.concatenate(rows), np.concatenate(indices))
    return csr_matrix((np.concatenate(values), where), shape=(first, columns))


class Smoother:
    """Smooths drafts of one topology.

    Parameters
    ----------
    draft
        The draft; it is not changed.
    rings
        Rings of the part of the site.
    h
        Edge length, metres.
    """

    def __init__(self, draft: Draft, rings: Sequence[Ring], h: float) -> None:
        self.rings = rings
        self.h = h
        self.faces = draft.faces
        self.topology = QuadMesh(draft.vertices, draft.faces, h)
        self.triples = line_triples(self.topology)
        self.ring = draft.ring
        self.inner: IntArray = np.flatnonzero(draft.ring < 0)
        corner = draft.faces
        self.here: IntArray = corner.ravel()
        self.after: IntArray = np.roll(corner, -1, axis=1).ravel()
        self.before: IntArray = np.roll(corner, 1, axis=1).ravel()
        t = self.triples
        self.differences = _rows(
            len(draft.vertices),
            [(self.after, 1.0), (self.here, -1.0)],
            [(self.before, 1.0), (self.here, -1.0)],
            [(t[:, 0], 1.0), (t[:, 2], 1.0), (t[:, 1], -2.0)],
        )
        self.gathered = self.differences.T.tocsr()

    def smooth(
        self,
        vertices: FloatArray,
        arc: FloatArray,
        held: BoolArray,
        *,
        rounds: int = 5,
        steps: int = 60,
    ) -> tuple[FloatArray, FloatArray]:
        """Move inner vertices freely and boundary vertices along their rings.

        Parameters
        ----------
        vertices, arc
            Positions (n, 2) and arc lengths (n,) to begin with.
        held
            Shape (n,). Boundary vertices that stay where they are.
        rounds, steps
            At most `rounds` minimisations of `steps` iterations each.

        Returns
        -------
        tuple
            New positions and arc lengths.
        """
        state = _State(self, vertices, arc, held)
        if not len(state.x):
            return state.vertices, state.arc
        for i in range(rounds):
            least = self.least_jacobian(state.vertices)
            epsilon = 1e-3
            if least < SAFE:
                epsilon = max(1e-3, float(np.sqrt(1e-4 + 0.04 * min(0.0, least) ** 2)))
            result = minimize(
                state.energy,
                state.x,
                args=(epsilon,),
                jac=True,
                method="L-BFGS-B",
                options={"maxiter": steps, "maxcor": 12, "ftol": 1e-6},
            )
            state.place(result.x)
            if self.least_jacobian(state.vertices) > SAFE and (i >= 1 or result.nit < steps):
                break
        return state.vertices, state.arc

    def least_jacobian(self, vertices: FloatArray) -> float:
        """Return the smallest Jacobian of all corners, 1 for an ideal square."""
        a = (vertices[self.after] - vertices[self.here]) / self.h
        b = (vertices[self.before] - vertices[self.here]) / self.h
        return float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).min())

    def least_sine(self, vertices: FloatArray) -> float:
        """Return the least scaled Jacobian of all corners."""
        a = vertices[self.after] - vertices[self.here]
        b = vertices[self.before] - vertices[self.here]
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        return float((cross / (np.hypot(*a.T) * np.hypot(*b.T) + 1e-12)).min())


class _State:
    """Unknowns of one smoothing: inner positions and arc lengths, both in edge lengths."""

    def __init__(
        self, smoother: Smoother, vertices: FloatArray, arc: FloatArray, held: BoolArray
    ) -> None:
        self.smoother = smoother
        self.vertices = vertices.copy()
        self.arc = arc.copy()
        self.inner = smoother.inner
        sliding = np.flatnonzero((smoother.ring >= 0) & ~held)
        self.slides = [
            (ring, sliding[smoother.ring[sliding] == r]) for r, ring in enumerate(smoother.rings)
        ]
        self.slides = [s for s in self.slides if len(s[1])]
        self.sliding = np.concatenate([s[1] for s in self.slides] or [np.zeros(0, dtype=int)])
        self.x: FloatArray = (
            np.concatenate([self.vertices[self.inner].ravel(), self.arc[self.sliding]]) / smoother.h
        )
        self.place(self.x)

    def place(self, x: FloatArray) -> None:
        """Take over a vector of unknowns."""
        h = self.smoother.h
        split = 2 * len(self.inner)
        self.x = x
        self.vertices[self.inner] = x[:split].reshape(-1, 2) * h
        self.arc[self.sliding] = x[split:] * h
        self.tangents = []
        for ring, members in self.slides:
            self.vertices[members], tangent = ring.walk(self.arc[members])
            self.tangents.append(tangent)

    def energy(self, x: FloatArray, epsilon: float) -> tuple[float, FloatArray]:
        """Return the energy and its gradient.

        This is called thousands of times for a few hundred vertices, so that the number of
        calls into numpy is what it costs.
        """
        self.place(x)
        s = self.smoother
        corners = len(s.here)
        steps = s.differences @ (self.vertices / s.h)
        sides = steps[: 2 * corners].T.reshape(2, 2, corners)
        (ax, bx), (ay, by) = sides
        det = ax * by - ay * bx
        square = det * det
        root = np.sqrt(square + epsilon * epsilon)
        # the same as (det + root) / 2, without its cancellation for badly inverted corners
        chi = np.where(
            det > 0, (det + root) / 2, epsilon * epsilon / (2 * (root - np.minimum(det, 0)))
        )
        value = ((sides * sides).sum(axis=(0, 1)) + AREA * (square + 1)) / (2 * chi)
        by_det = AREA * det / chi - value / chi * (1 + det / root) / 2
        force = np.empty_like(steps)
        force[:corners, 0] = ax / chi + by_det * by
        force[:corners, 1] = ay / chi - by_det * bx
        force[corners : 2 * corners, 0] = bx / chi - by_det * ay
        force[corners : 2 * corners, 1] = by / chi + by_det * ax
        bend = steps[2 * corners :]
        force[2 * corners :] = 2 * STRAIGHT * bend
        total = float(value.sum()) + STRAIGHT * float(np.vdot(bend, bend))
        gradient = s.gathered @ force
        along = [
            np.einsum("ij,ij->i", gradient[members], tangent)
            for (_, members), tangent in zip(self.slides, self.tangents)
        ]
        return total, np.concatenate([gradient[self.inner].ravel(), *along])
