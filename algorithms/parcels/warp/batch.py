"""Many matches as one set of flat arrays: initial map, then registration and regression in turn.

The matches may be of different templates; their arrays follow each other, and the fixed matrices
of their templates are the blocks of one block diagonal matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix

from .alignment import circle, straighten
from .form import Form
from .regions import SAMPLES, Sides
from .registration import Allowed, register

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Points = npt.NDArray[np.complex128]

ITERATIONS = 30
#: Steps of the vertices as a multiple of the plain alternation, which crawls.
HASTE = 1.5
#: Most that a vertex of the outline goes in one step, as part of the gap to the next.
STRIDE = 0.4


@dataclass(frozen=True)
class Task:
    """A template and a region whose first sides belong together.

    Attributes
    ----------
    form
        The template.
    sides
        The region; as many sides, the first for the template's first.
    stretch
        Mean logarithm of the factors by which the sides are off.
    """

    form: Form
    sides: Sides
    stretch: float = 0.0


@dataclass
class Warped:
    """Where the templates of a batch came to lie.

    Attributes
    ----------
    points
        Vertices of all tasks, shape (v,).
    t
        Places of the vertices of the outlines on their sides, shape (r,).
    distance
        Registration distance of each face, shape (f,), metres.
    vertex_start, face_start, ring_start
        Where each task begins in them, shape (tasks + 1,).
    """

    points: Points
    t: Floats
    distance: Floats
    vertex_start: Ints
    face_start: Ints
    ring_start: Ints

    def energy(self, tasks: Sequence[Task]) -> Floats:
        """Average the distances of the faces that count, shape (tasks,), metres.

        Parameters
        ----------
        tasks
            The tasks of the batch.
        """
        counted = np.concatenate([task.form.counted for task in tasks])
        total = np.add.reduceat(np.where(counted, self.distance, 0.0), self.face_start[:-1])
        return np.asarray(total / np.add.reduceat(counted.astype(float), self.face_start[:-1]))


def starts(sizes: Sequence[int]) -> Ints:
    """Turn sizes into the places where parts begin, and the whole at the end.

    Parameters
    ----------
    sizes
        The sizes.
    """
    return np.concatenate([[0], np.cumsum(np.asarray(sizes, dtype=np.int64))]).astype(np.int64)


def block_diagonal(blocks: Sequence[csr_matrix]) -> csr_matrix:
    """Put matrices on the diagonal of one.

    Parameters
    ----------
    blocks
        The matrices.
    """
    columns = starts([block.shape[1] for block in blocks])
    entries = starts([block.nnz for block in blocks])
    indices = np.concatenate([b.indices + c for b, c in zip(blocks, columns)])
    pointer = np.concatenate([[0], *(b.indptr[1:] + e for b, e in zip(blocks, entries))])
    data = np.concatenate([block.data for block in blocks])
    return csr_matrix((data, indices, pointer), (len(pointer) - 1, int(columns[-1])))


class Batch:
    """The flat arrays of many tasks.

    Parameters
    ----------
    tasks
        The tasks, at least one.
    least_area, largest_area
        Bounds of the area of faces as factors of what is wished for.
    """

    def __init__(self, tasks: Sequence[Task], least_area: float, largest_area: float) -> None:
        forms = [task.form for task in tasks]
        self.forms, self.tasks = forms, tasks
        self.vertex_start = starts([len(form.points) for form in forms])
        self.face_start = starts([len(form.labels) for form in forms])
        self.ring_start = starts([len(form.ring) for form in forms])
        self.row_start = starts([len(task.sides.signs) for task in tasks])
        self.table = np.concatenate([task.sides.table for task in tasks])
        self.sums = block_diagonal([form.sums for form in forms])
        self.means = block_diagonal([form.means for form in forms])
        self.local = np.concatenate([form.local for form in forms])
        self.mirror = self.local.conj()
        self.face = np.concatenate([f.face + s for f, s in zip(forms, self.face_start)])
        self.vertex = np.concatenate([f.vertex + s for f, s in zip(forms, self.vertex_start)])
        self.ring = np.concatenate([f.ring + s for f, s in zip(forms, self.vertex_start)])
        self.row = np.concatenate([f.side + s for f, s in zip(forms, self.row_start)])
        self.t = np.concatenate([form.t for form in forms])
        table = np.concatenate([form.allowed for form in forms])
        real = table[:, :6].real
        parcel = np.concatenate([form.counted for form in forms])
        self.allowed = Allowed(
            real[:, 0].astype(np.int64), real[:, 1].copy(), real[:, 2].copy(),
            real[:, 3].copy(), real[:, 4].copy(),
            np.where(parcel, least_area, 0.0), np.where(parcel, largest_area, np.inf),
            real[:, 5].copy(), table[:, 6].copy(),
        )  # fmt: skip
        self.corner_start = np.searchsorted(self.face, np.arange(len(table)))
        self._movable()
        self._alignments()

    def _movable(self) -> None:
        """Find the vertices of the outlines that slide, and their neighbours."""
        self.moves = np.flatnonzero(self.t > 0)
        self.on = self.ring[self.moves]
        self.own_row = self.row[self.moves]
        after = np.minimum(self.moves + 1, len(self.t) - 1)
        self.after = after
        self.has_next = (self.row[after] == self.own_row) & (after != self.moves)

    def _alignments(self) -> None:
        """Collect the alignment sets of all tasks by kind."""
        sets: dict[str, list[Ints]] = {"straight": [], "circle": [], "smooth": []}
        matrices: list[csr_matrix] = []
        for form, start in zip(self.forms, self.vertex_start):
            for kind, vertices, matrix in form.sets:
                sets[kind].append(vertices + start)
                if matrix is not None:
                    matrices.append(csr_matrix(matrix + 0j))
        self.sets = {
            kind: (np.concatenate(found), starts([len(v) for v in found])[:-1])
            for kind, found in sets.items()
            if found
        }
        self.smooth: Any = block_diagonal(matrices) if matrices else None

    def place(self, t: Floats, row: Ints) -> Points:
        """Give points of the sides.

        Parameters
        ----------
        t, row
            Places on the sides, and rows of the table of sides.
        """
        f = t * (SAMPLES - 1)
        k = np.minimum(f.astype(np.int64), SAMPLES - 2)
        a = self.table[row, k]
        return np.asarray(a + (self.table[row, k + 1] - a) * (f - k))

    def begin(self) -> Points:
        """Give the initial map: outlines by arc length, mean value coordinates inside."""
        z = np.empty(int(self.vertex_start[-1]), complex)
        sample_row = np.concatenate([f.sample_side + s for f, s in zip(self.forms, self.row_start)])
        samples = self.place(np.concatenate([f.sample_t for f in self.forms]), sample_row)
        at = starts([len(f.sample_t) for f in self.forms])
        for k, form in enumerate(self.forms):
            if len(form.inside):
                z[form.inside + self.vertex_start[k]] = form.weights @ samples[at[k] : at[k + 1]]
        z[self.ring] = self.place(self.t, self.row)
        return z

    def register(self, z: Points) -> Points:
        """Give the places that the faces ask of their corners, shape (i,).

        Parameters
        ----------
        z
            Vertices, shape (v,).
        """
        p, s, centre = (self.sums @ z).reshape(-1, 3).T
        a, b = register(p, s, self.allowed)
        goal: Points = a[self.face] * self.local
        goal += b[self.face] * self.mirror
        goal += centre[self.face]
        return goal

    def align(self, z: Points) -> None:
        """Move vertices onto their alignment elements.

        Parameters
        ----------
        z
            Vertices, shape (v,); changed.
        """
        for kind, (vertices, begin) in self.sets.items():
            here = z[vertices]
            if kind == "smooth":
                z[vertices] = self.smooth @ here
            else:
                fit: Any = straighten if kind == "straight" else circle
                z[vertices] = fit(here, np.ones(len(here)), begin)

    def slide(self, z: Points) -> None:
        """Bring the vertices of the outlines back to their sides, their order kept.

        Parameters
        ----------
        z
            Vertices, shape (v,); changed.
        """
        t = self.t[self.moves]
        f = t * (SAMPLES - 1)
        k = np.minimum(f.astype(np.int64), SAMPLES - 2)
        a = self.table[self.own_row, k]
        along = self.table[self.own_row, k + 1] - a
        here = a + along * (f - k)
        size = (along * along.conj()).real
        step = ((z[self.on] - here) * along.conj()).real / np.maximum(size, 1e-12)
        step /= SAMPLES - 1
        before = t - self.t[self.moves - 1]
        follow = np.where(self.has_next, self.t[self.after], 1.0) - t
        self.t[self.moves] = t + np.clip(step, -STRIDE * before, STRIDE * follow)
        z[self.ring] = self.place(self.t, self.row)

    def run(self, iterations: int = ITERATIONS) -> Warped:
        """Warp.

        Parameters
        ----------
        iterations
            How often registration and regression take turns; 0 for the initial map.
        """
        z = self.begin()
        for _ in range(iterations):
            new = self.means @ self.register(z)
            z += HASTE * (new - z)
            self.align(z)
            self.slide(z)
        away = np.abs(self.register(z) - z[self.vertex])
        count = np.diff(np.append(self.corner_start, len(away)))
        distance = np.add.reduceat(away, self.corner_start) / count
        return Warped(z, self.t, distance, self.vertex_start, self.face_start, self.ring_start)
