"""Normal equations of all blocks, one banded matrix each.

Blocks have nothing in common, and each is solved by itself, so that what becomes of one does not
depend on the others, not even in the last bit.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dpbsv
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from .forces import Forces, Pull
from .layout import Placed
from .mesh import Flags, Floats, Ints, total


class Bands:
    """Assembles and solves the normal equations.

    Parameters
    ----------
    forces
        The residuals.
    like
        Bands of these or more blocks, whose order of unknowns is taken over.
    """

    def __init__(self, forces: Forces, like: Bands | None = None) -> None:
        self.forces = forces
        layout = forces.layout
        mesh, rails = layout.mesh, layout.rails
        used = np.zeros(len(mesh.xy), bool)
        used[forces.vertex] = True
        free = np.flatnonzero(rails.free & used)
        slide = np.arange(len(rails.slider))[used[rails.slider]]
        #: unknowns of each vertex: two of free ones, one of cut ends, else -1
        self.unknown = np.full((len(mesh.xy), 2), -1)
        owner = np.r_[mesh.block[free], mesh.block[free], mesh.block[rails.slider[slide]]]
        order = np.argsort(owner, kind="stable")
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        self.unknown[free, 0] = number[: len(free)]
        self.unknown[free, 1] = number[len(free) : 2 * len(free)]
        self.unknown[rails.slider[slide], 0] = number[2 * len(free) :]
        self.block = owner[order]
        self.first = np.searchsorted(self.block, np.arange(len(mesh.sound) + 1))
        if like is None:
            self._order()
        else:
            known = self.unknown >= 0
            old = like.unknown[known]
            self.unknown[known] = np.searchsorted(np.sort(old), old)
        self._where()

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.block)

    def _pairs(self) -> tuple[Ints, Ints]:
        """Pairs of members of the same plot, each with each, shape (q,)."""
        face = self.forces.face
        first = np.searchsorted(face, face)
        size = np.searchsorted(face, face, side="right") - first
        one = np.repeat(np.arange(len(face)), size)
        step = np.arange(len(one)) - np.repeat(np.cumsum(size) - size, size)
        return one, first[one] + step

    def _order(self) -> None:
        """Give neighbours numbers that are near, block by block."""
        one, other = self._pairs()
        vertex = self.forces.vertex
        i = self.unknown[vertex[one]][:, :, None].repeat(2, axis=2).ravel()
        j = self.unknown[vertex[other]][:, None, :].repeat(2, axis=1).ravel()
        keep = (i >= 0) & (j >= 0)
        graph = coo_matrix((np.ones(keep.sum(), bool), (i[keep], j[keep])), (self.count,) * 2)
        graph = graph.tocsr()
        number = np.arange(self.count)
        for a, b in zip(self.first[:-1].tolist(), self.first[1:].tolist()):
            if b > a:
                near = graph[a:b, a:b]
                number[a + reverse_cuthill_mckee(near, symmetric_mode=True)] = np.arange(a, b)
        self.unknown = np.r_[number, -1][self.unknown]

    def _where(self) -> None:
        """Find which products of derivatives go where in the bands."""
        forces = self.forces
        corner = self.unknown[forces.rows].reshape(-1, 6)
        member = self.unknown[forces.vertex]
        one, other = self._pairs()
        # of the derivatives of rows by six unknowns, and of plots by two of each member
        place = np.arange(corner.size).reshape(-1, 6)
        number = np.arange(member.size).reshape(-1, 2)
        self.turns = _lower(corner, corner, place, place)
        self.sizes = _lower(member[one], member[other], number[one], number[other])
        i, j = np.r_[self.turns[0], self.sizes[0]], np.r_[self.turns[1], self.sizes[1]]
        self.width = np.ones(len(self.first) - 1, int)
        np.maximum.at(self.width, self.block[i], i - j + 1)
        self.offset = np.r_[0, np.cumsum(np.diff(self.first) * self.width)]
        self.diagonal = self._column(np.arange(self.count))
        self.into = self._column(j) + i - j
        self.where = np.r_[corner.ravel(), member.ravel()] + 1

    def _column(self, unknown: Ints) -> Ints:
        """Find where the columns of unknowns begin in the bands."""
        block = self.block[unknown]
        return np.asarray(self.offset[block] + (unknown - self.first[block]) * self.width[block])

    def directions(self, placed: Placed) -> Floats:
        """Give the moves of each vertex by its two unknowns, shape (n, 2, 2)."""
        rails = self.forces.layout.rails
        found = np.zeros((len(self.unknown), 2, 2))
        found[rails.free] = np.eye(2)
        found[rails.slider, 0] = placed.way[: len(rails.slider)]
        return found

    def assemble(self, pull: Pull, ways: Floats) -> tuple[Floats, Floats]:
        """Bands of all blocks one after the other, and the gradient, shape (count,)."""
        forces = self.forces
        way = ways[forces.rows]
        by = pull.by[:, :, None, 0] * way[..., 0] + pull.by[:, :, None, 1] * way[..., 1]
        by = by.reshape(-1, 6)
        way = ways[forces.vertex]
        size = pull.size_by[:, None, 0] * way[..., 0] + pull.size_by[:, None, 1] * way[..., 1]
        room = pull.room_by[:, None, 0] * way[..., 0] + pull.room_by[:, None, 1] * way[..., 1]
        flat, flat_size, flat_room = by.ravel(), size.ravel(), room.ravel()
        _, _, p, q = self.turns
        _, _, u, v = self.sizes
        products = np.concatenate(
            [flat[p] * flat[q], flat_size[u] * flat_size[v] + flat_room[u] * flat_room[v]]
        )
        bands = total(self.into, products, int(self.offset[-1]))
        value = size * pull.size[forces.face][:, None] + room * pull.room[forces.face][:, None]
        terms = np.concatenate([(by * pull.turn[:, None]).ravel(), value.ravel()])
        gradient = total(self.where, terms, self.count + 1)[1:]
        return bands, gradient

    def of_block(self, blocks: Flags) -> tuple[Flags, Flags]:
        """Which numbers of the bands and of the gradient belong to some blocks."""
        size = np.diff(self.first)
        return np.repeat(blocks, size * self.width), np.repeat(blocks, size)

    def solve(self, bands: Floats, gradient: Floats, damping: Floats, active: Flags) -> Floats:
        """Solve for the step of each active block, others stay; shape (count,).

        Parameters
        ----------
        bands, gradient
            See `assemble`.
        damping
            Added to the diagonal, shape (count,).
        active
            Blocks to solve, shape (b,).
        """
        bands = bands.copy()
        bands[self.diagonal] += damping
        step = np.zeros(self.count)
        for b in np.flatnonzero(active & (np.diff(self.first) > 0)).tolist():
            mine = slice(self.first[b], self.first[b + 1])
            matrix = bands[self.offset[b] : self.offset[b + 1]].reshape(-1, self.width[b]).T
            _, found, failed = dpbsv(matrix, -gradient[mine], lower=1, overwrite_ab=1)
            if failed == 0:
                step[mine] = found
        return step


def _lower(i: Ints, j: Ints, p: Ints, q: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Pairs of unknowns of rows, of which the first is not less than the second.

    Parameters
    ----------
    i, j
        Unknowns of each row, -1 for none, shapes (r, a) and (r, b).
    p, q
        What they are numbers of, same shapes.

    Returns
    -------
    tuple
        The pairs of `i` and `j`, and of `p` and `q`, each of shape (k,).
    """
    a, b = i[:, :, None], j[:, None, :]
    keep = (b >= 0) & (a >= b)
    row, first, second = np.nonzero(keep)
    return i[row, first], j[row, second], p[row, first], q[row, second]
