"""From lattice rings to a first mesh: cells, boundary vertices, extra rows, first positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

from .cells import fill_lattice
from .directions import Labels
from .lattice import LatticeRing
from .quadmesh import BoolArray, FloatArray, IntArray
from .rings import Ring

FLAT = np.radians(45.0)
ROW_WINDOW = 0.45


@dataclass(frozen=True, eq=False)
class Draft:
    """A mesh of one part of a site before and while it is smoothed.

    Attributes
    ----------
    vertices, faces
        As in `QuadMesh`.
    loops
        Boundary vertices of each ring, in the order of the ring.
    ring, arc
        Shape (n,). Ring of a boundary vertex (-1 inside) and its arc length there.
    station
        Shape (n,). Station of its ring that a vertex stands on, or -1.
    """

    vertices: FloatArray
    faces: IntArray
    loops: tuple[IntArray, ...]
    ring: IntArray
    arc: FloatArray
    station: IntArray


@dataclass(frozen=True)
class Row:
    """An extra row of quads along the boundary, from one corner to another.

    `first` and `last` are pieces of ring `ring` at whose starts the row begins and ends;
    None for a row that runs all the way round.
    """

    ring: int
    first: int | None
    last: int | None


def plan_rows(
    rings: Sequence[Ring], labels: Sequence[Labels], h: float
) -> tuple[list[Row], dict[int, int], dict[int, int]]:
    """Plan rows that take corners away from places where the boundary has none.

    Where the labels want a corner on a flat spot, a row between the nearest real corners to
    both sides moves it inside, where it is a vertex of valence 3 or 5.

    Returns
    -------
    tuple
        The rows; extra rows along pieces; extra steps of pieces at the ends of rows (pieces
        counted through all rings).
    """
    rows: list[Row] = []
    along: dict[int, int] = {}
    extra: dict[int, int] = {}
    offset = 0
    for r, (ring, label) in enumerate(zip(rings, labels)):
        count = len(label.start)
        window = ROW_WINDOW * h
        turn = ring.turn(label.start, window, window)
        false = ((label.turn == 1) & (turn < FLAT)) | ((label.turn == -1) & (turn > -FLAT))
        real = (label.turn == 1) & (turn >= FLAT)
        if false.any() and real.sum() < 2:
            rows.append(Row(r, None, None))
            along.update({offset + j: 1 for j in range(count)})
        elif false.any():
            spans: set[tuple[int, int]] = set()
            for bad in np.flatnonzero(false).tolist():
                first, last = bad, bad
                while not real[first % count]:
                    first -= 1
                while not real[last % count]:
                    last += 1
                spans.add((first % count, last % count))
            for first, last in sorted(spans):
                rows.append(Row(r, first, last))
                j = first
                while j != last:
                    along[offset + j] = 1
                    j = (j + 1) % count
                for end in ((first - 1) % count, last):
                    extra[offset + end] = extra.get(offset + end, 0) + 1
        offset += count
    return rows, along, extra


def build_draft(
    rings: Sequence[Ring],
    labels: Sequence[Labels],
    lattice: Sequence[LatticeRing],
    rows: Sequence[Row] = (),
) -> Draft | None:
    """Fill the lattice polygon with unit cells, lay extra rows, place all vertices.

    Returns
    -------
    Draft or None
        None where the lattice polygon crosses itself.
    """
    filled = fill_lattice(lattice, labels)
    if filled is None:
        return None
    faces, walks = filled
    loops: list[list[tuple[int, int]]] = []
    for ring, walk in zip(lattice, walks):
        starts = np.cumsum(ring.steps) - ring.steps
        piece = np.full(len(walk), -1)
        piece[starts] = np.arange(len(starts))
        loops.append(list(zip(walk.tolist(), piece.tolist())))
    count = int(faces.max()) + 1
    quads = [faces]
    for row in rows:
        count = _lay_row(row, loops, quads, count)
    return _placed(rings, labels, loops, np.vstack(quads), count)


def _lay_row(
    row: Row, loops: list[list[tuple[int, int]]], quads: list[IntArray], count: int
) -> int:
    """Add a row of quads outside a boundary path; return the new number of vertices."""
    loop = loops[row.ring]
    size = len(loop)
    closed = row.first is None
    begin, length = 0, size
    if not closed:
        piece = [j for _, j in loop]
        begin = piece.index(row.first if row.first is not None else -1)
        end = piece.index(row.last if row.last is not None else -1)
        length = (end - begin) % size + 1
    path = [loop[(begin + i) % size] for i in range(length)]
    old = np.array([v for v, _ in path])
    new = np.arange(count, count + length)
    i = np.arange(length if closed else length - 1)
    k = (i + 1) % length
    quads.append(np.column_stack([new[i], new[k], old[k], old[i]]))
    fresh = [(int(v), j) for v, (_, j) in zip(new, path)]
    if closed:
        loops[row.ring] = fresh
    else:
        rest = [loop[(begin + length + i) % size] for i in range(size - length)]
        loops[row.ring] = [(int(old[0]), -1), *fresh, (int(old[-1]), -1), *rest]
    return count + length


def _placed(
    rings: Sequence[Ring],
    labels: Sequence[Labels],
    loops: Sequence[Sequence[tuple[int, int]]],
    faces: IntArray,
    count: int,
) -> Draft:
    """Spread boundary vertices evenly between the ends of pieces, inner ones harmonically."""
    vertices = np.zeros((count, 2))
    ring_of = np.full(count, -1, dtype=np.int64)
    arc = np.zeros(count)
    station = np.full(count, -1, dtype=np.int64)
    for r, (ring, label, loop) in enumerate(zip(rings, labels, loops)):
        ends = label.ends(ring)
        size = len(loop)
        tagged = [i for i in range(size) if loop[i][1] >= 0]
        for a, b in zip(tagged, [*tagged[1:], tagged[0] + size]):
            piece = loop[a][1]
            for i in range(a, b):
                v = loop[i % size][0]
                share = (i - a) / (b - a)
                ring_of[v] = r
                arc[v] = label.start[piece] + (ends[piece] - label.start[piece]) * share
            station[loop[a][0]] = label.station[piece]
        members = np.array([v for v, _ in loop])
        vertices[members] = ring.at(arc[members])
    inner = ring_of < 0
    if inner.any():
        vertices[inner] = harmonic(vertices, faces, inner)
    order = tuple(np.array([v for v, _ in loop], dtype=np.int64) for loop in loops)
    return Draft(vertices, faces, order, ring_of, arc, station)


def harmonic(vertices: FloatArray, faces: IntArray, inner: BoolArray) -> FloatArray:
    """Return positions of inner vertices that are the means of their neighbours."""
    n = len(vertices)
    pair = np.sort(np.column_stack([faces.ravel(), np.roll(faces, -1, axis=1).ravel()]), axis=1)
    pair = np.unique(pair, axis=0)
    ones = np.ones(2 * len(pair))
    where = (np.r_[pair[:, 0], pair[:, 1]], np.r_[pair[:, 1], pair[:, 0]])
    adjacency = coo_matrix((ones, where), shape=(n, n)).tocsr()
    laplace = (diags(np.asarray(adjacency.sum(axis=1)).ravel()) - adjacency).tocsr()[inner]
    right = -laplace[:, ~inner] @ vertices[~inner]
    return np.asarray(splu(laplace[:, inner].tocsc()).solve(np.ascontiguousarray(right)))
