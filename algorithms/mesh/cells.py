"""Fill closed lattice rings with unit cells, slits and touching rings included."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .directions import Labels
from .lattice import STEP, LatticeRing
from .quadmesh import BoolArray, IntArray

# For a unit step east, north, west, south: the cell on its left relative to the start of the
# step, and the corners of that cell (counter-clockwise from the lower left) at start and end.
LEFT_CELL = np.array([[0, 0], [-1, 0], [-1, -1], [0, -1]])


def fill_lattice(
    lattice: Sequence[LatticeRing], labels: Sequence[Labels]
) -> tuple[IntArray, list[IntArray]] | None:
    """Return the cells that lattice rings enclose, glued across all but boundary steps.

    Rings may touch themselves and each other: where two boundary steps run along the same
    unit edge in opposite directions, the mesh has a slit and two vertices at one place.

    Parameters
    ----------
    lattice, labels
        Lattice rings, the exterior counter-clockwise, and the directions of their pieces.

    Returns
    -------
    tuple or None
        Faces (m, 4), and for each ring its vertices in order, beginning with the first
        corner; None where some cell would be covered twice or the rings do not fit.
    """
    starts, directions, sizes = _unit_steps(lattice, labels)
    low = starts.min(axis=0) - 1
    shape = tuple((starts.max(axis=0) - low + 2).tolist())
    place = starts - low
    winding = np.zeros(shape, dtype=np.int64)
    for direction, sign, shift in ((3, 1, -1), (1, -1, 0)):
        step = place[directions == direction]
        np.add.at(winding, (step[:, 0], step[:, 1] + shift), sign)
    winding = np.cumsum(winding, axis=0)
    if winding.min() < 0 or winding.max() > 1:
        return None
    cell = np.full(shape, -1, dtype=np.int64)
    inside = np.nonzero(winding)
    cell[inside] = np.arange(len(inside[0]))
    left = place + LEFT_CELL[directions]
    owner = cell[left[:, 0], left[:, 1]]
    if (owner < 0).any():
        return None
    corner = _glued(cell, place, directions)
    begin = corner[4 * owner + directions]
    end = corner[4 * owner + (directions + 1) % 4]
    walks = []
    first = 0
    for size in sizes:
        walk = begin[first : first + size]
        if (np.roll(walk, -1) != end[first : first + size]).any():
            return None
        walks.append(walk)
        first += size
    if len(np.unique(begin)) < len(begin):
        return None
    return corner.reshape(-1, 4), walks


def _unit_steps(
    lattice: Sequence[LatticeRing], labels: Sequence[Labels]
) -> tuple[IntArray, IntArray, list[int]]:
    """Return the starts (s, 2) and directions (s,) of all unit steps, and steps per ring."""
    starts, directions, sizes = [], [], []
    for ring, label in zip(lattice, labels):
        which = np.repeat(np.arange(len(ring.steps)), ring.steps)
        within = np.arange(len(which)) - np.repeat(np.cumsum(ring.steps) - ring.steps, ring.steps)
        direction = label.direction[which]
        starts.append(ring.corners[which] + within[:, None] * STEP[direction])
        directions.append(direction)
        sizes.append(len(which))
    return np.vstack(starts), np.concatenate(directions), sizes


def _glued(cell: IntArray, place: IntArray, directions: IntArray) -> IntArray:
    """Return the vertex at each corner of each cell, shape (4 m,)."""
    # walls on the right of a cell and above it
    right: BoolArray = np.zeros(cell.shape, dtype=np.bool_)
    above: BoolArray = np.zeros(cell.shape, dtype=np.bool_)
    for direction, wall, shift in (
        (0, above, (0, -1)),
        (2, above, (-1, -1)),
        (1, right, (-1, 0)),
        (3, right, (-1, -1)),
    ):
        step = place[directions == direction] + shift
        wall[step[:, 0], step[:, 1]] = True
    pairs = []
    for wall, here, there, corners in (
        (right[:-1], cell[:-1], cell[1:], ((1, 0), (2, 3))),
        (above[:, :-1], cell[:, :-1], cell[:, 1:], ((3, 0), (2, 1))),
    ):
        open_ = ~wall & (here >= 0) & (there >= 0)
        a, b = here[open_], there[open_]
        pairs += [np.column_stack([4 * a + i, 4 * b + j]) for i, j in corners]
    joined = np.vstack(pairs)
    count = 4 * (int(cell.max()) + 1)
    graph = coo_matrix((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(count, count))
    vertex: IntArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return vertex
