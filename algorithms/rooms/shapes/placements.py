"""Everywhere that templates fit on a mesh (CND 5.2, Fig. 9a).

A shape is laid by walking half-edges: from a face and one of its sides, taken for the lower side
of the first square, every other square is reached through the sides of its neighbours. So rooms
follow curved and irregular meshes. What counts as a fit, on any mesh:

* The faces are distinct, and all of them may be used.
* Squares that share a side in the drawing share that side on the mesh. Hence the faces do not
  depend on the way through the shape, and all vertices within a block of 2 x 2 squares are
  regular: around a vertex of valence 3 there are no four faces, and around one of valence 5 four
  faces would leave a wedge open in the middle of the room.
* The faces together have as many holes as the drawing, and touch themselves nowhere else.

An irregular vertex may lie anywhere on the outline, and where the drawing has a corner that turns
inwards it may come to lie within: three squares of an L fill the fan of a vertex of valence 3. Such
a room has the squares that were asked for and is still one disc; the mesh closes a dent of the
drawing, but never tears it open.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...mesh.quadmesh import QuadMesh
from ..types import BoolArray, Cells, FloatArray, IntArray, Placements, Template
from .checks import connected
from .orient import drawings

#: Sides of a square from its lower one counter-clockwise, as steps (column, row).
STEPS = ((0, -1), (1, 0), (0, 1), (-1, 0))
#: Half the angle between two quarter turns, as a cosine, and the slack for ties.
HALF_TURN, SLACK = float(np.cos(np.pi / 4)), 1e-9


def enumerate_placements(
    mesh: QuadMesh,
    templates: Sequence[Template],
    allowed: BoolArray,
    check: Callable[[], None] | None = None,
    *,
    irregular: bool = True,
) -> Placements:
    """Find all places where templates fit on a mesh (CND 5.2, Fig. 9a).

    The room's text says what a fit is. Where not all turns of a template are allowed, a placement
    counts as turned by the multiple of 90 degrees that the mean direction of its rows, from left to
    right, is nearest to, seen from east; halfway between two it counts as both.

    The same faces may hold rooms of several templates. Of templates without limits of their own and
    with the same use only the first keeps them: a second would add variables and no plan. Templates
    with limits or another use all keep theirs.

    Parameters
    ----------
    mesh
        The mesh, m faces.
    templates
        The templates.
    allowed
        Shape (m,). Faces that rooms may cover.
    check
        Called now and then; raises to stop.
    irregular
        Whether faces may share sides that the squares of the drawing do not, as around a vertex of
        valence 3.

    Returns
    -------
    Placements
        By template, then by faces.

    Raises
    ------
    InputError
        If `allowed` has the wrong shape, or a template is empty or does not hang together.

    Examples
    --------
    >>> from ...mesh.grids import grid
    >>> pair = Template("pair", frozenset({(0, 0), (1, 0)}))
    >>> enumerate_placements(grid(2, 2), [pair], np.ones(4, dtype=bool)).faces
    ((0, 1), (0, 2), (1, 3), (2, 3))
    """
    if allowed.shape != (len(mesh.faces),):
        raise InputError(f"'allowed' has shape {allowed.shape}, expected ({len(mesh.faces)},).")
    east = _directions(mesh)
    kinds: list[int] = []
    faces: list[tuple[int, ...]] = []
    inner: list[tuple[int, ...]] = []
    rim: list[tuple[int, ...]] = []
    taken: dict[str, set[tuple[int, ...]]] = {}
    for kind, template in enumerate(templates):
        if not connected(template.cells):
            raise InputError(
                f"Template '{template.name}' is no connected shape.",
                "Join its squares along sides.",
            )
        known = None if _limited(template) else taken.setdefault(template.use, set())
        for room in _rooms_of(template, mesh, allowed, east, irregular, check):
            if known is not None:
                if room.faces in known:
                    continue
                known.add(room.faces)
            kinds.append(kind)
            faces.append(room.faces)
            inner.append(room.inner)
            rim.append(room.rim)
    return Placements(np.array(kinds, dtype=np.int64), tuple(faces), tuple(inner), tuple(rim))


def _limited(template: Template) -> bool:
    """Tell whether a rule counts the rooms of a template."""
    asked = template.least > 0 or template.least_share > 0
    return asked or template.most is not None or template.most_share is not None


@dataclass(frozen=True)
class _Room:
    """One placement."""

    faces: tuple[int, ...]
    inner: tuple[int, ...]
    rim: tuple[int, ...]


def _rooms_of(
    template: Template,
    mesh: QuadMesh,
    allowed: BoolArray,
    east: FloatArray,
    irregular: bool,
    check: Callable[[], None] | None,
) -> Iterator[_Room]:
    """Yield the placements of one template by their faces, none twice."""
    found = []
    for cells, turns in drawings(template):
        if check is not None:
            check()
        lower = _laid(cells, mesh, allowed)
        if len(turns) < 4:
            lower = lower[_is_turned(lower, turns, east)]
        rows = np.unique(np.sort(lower // 4, axis=1), axis=0)
        found.append(rows[_is_whole(rows, cells, mesh, irregular)])
    rows = np.unique(np.vstack(found), axis=0)
    edges = _sorted(mesh.face_edges, rows)
    twice = _doubles(edges)
    once = ~twice
    once[:, 1:] &= ~twice[:, :-1]
    for room, sides, shared, single in zip(rows.tolist(), edges, twice, once):
        yield _Room(tuple(room), tuple(sides[shared].tolist()), tuple(sides[single].tolist()))


def _sorted(table: IntArray, rows: IntArray) -> IntArray:
    """Return what a table (m, 4) holds for faces (number, squares), ascending in each row."""
    return np.sort(table[rows].reshape(len(rows), 4 * rows.shape[1]), axis=1)


def _doubles(rows: IntArray) -> BoolArray:
    """Mark, in ascending rows, what is followed by the same; the last is never."""
    marks = np.zeros(rows.shape, dtype=np.bool_)
    marks[:, :-1] = rows[:, 1:] == rows[:, :-1]
    return marks


def _directions(mesh: QuadMesh) -> FloatArray:
    """Return for each half-edge (4 m, 2), as lower side, the direction of its face's row."""
    corners = mesh.vertices[mesh.faces]
    middle = (corners + np.roll(corners, -1, axis=1)) / 2
    # From the middle of the side before to that of the side after.
    across: FloatArray = np.roll(middle, -1, axis=1) - np.roll(middle, 1, axis=1)
    return across.reshape(-1, 2)


def _laid(cells: Cells, mesh: QuadMesh, allowed: BoolArray) -> IntArray:
    """Lay a shape from every half-edge; return the lower sides (number, squares) where it fits.

    All starts walk at once, one square after the other. A start is given up at the first square
    that is missing, not allowed, or differs from what another way leads to.
    """
    order = _order(cells)
    lower = 4 * np.flatnonzero(allowed)[:, None] + np.arange(4)
    lower = lower.reshape(-1, 1)
    for number, cell in enumerate(order[1:], 1):
        ways = [
            (order.index(before), side)
            for side, step in enumerate(STEPS)
            if (before := (cell[0] - step[0], cell[1] - step[1])) in order[:number]
        ]
        ends = [_beyond(lower[:, at], side, mesh) for at, side in ways]
        keep = ends[0] >= 0
        keep &= np.where(keep, allowed[ends[0] // 4], False)
        for end in ends[1:]:
            keep &= end == ends[0]
        lower = np.column_stack([lower, ends[0]])[keep]
    faces = np.sort(lower // 4, axis=1)
    return np.asarray(lower[~_doubles(faces).any(axis=1)])


def _order(cells: Cells) -> list[tuple[int, int]]:
    """Order squares so that each but the first has a side in common with an earlier one."""
    rows = sorted(cells, key=lambda cell: (cell[1], cell[0]))
    order = rows[:1]
    for column, row in order:  # grows on the way
        for side in (1, 3, 2, 0):
            beside = (column + STEPS[side][0], row + STEPS[side][1])
            if beside in cells and beside not in order:
                order.append(beside)
    return order


def _beyond(lower: IntArray, side: int, mesh: QuadMesh) -> IntArray:
    """Step over a side of squares: lower sides to the lower sides of the next, -1 outside."""
    twin = mesh.twins[lower // 4 * 4 + (lower + side) % 4]
    # It is the opposite side there, so many steps from the lower one.
    turned = twin // 4 * 4 + (twin - side - 2) % 4
    return np.asarray(np.where(twin < 0, -1, turned))


def _is_turned(lower: IntArray, turns: frozenset[int], east: FloatArray) -> BoolArray:
    """Tell which laid shapes (number, squares) are turned in one of the allowed ways."""
    mean = east[lower].sum(axis=1)
    least = np.hypot(*mean.T) * (HALF_TURN - SLACK)
    fits = np.zeros(len(lower), dtype=np.bool_)
    for quarters in turns:
        angle = quarters * np.pi / 2
        fits |= mean @ np.array([np.cos(angle), np.sin(angle)]) >= least
    return fits


def _is_whole(rows: IntArray, cells: Cells, mesh: QuadMesh, irregular: bool) -> BoolArray:
    """Tell which faces (number, squares) have the holes of the drawing and touch as is allowed."""
    inner = _doubles(_sorted(mesh.face_edges, rows)).sum(axis=1)
    corners = _sorted(mesh.faces, rows)
    vertices = corners.shape[1] - _doubles(corners).sum(axis=1)
    shared = sum((c + 1, r) in cells for c, r in cells) + sum((c, r + 1) in cells for c, r in cells)
    points = {(c + i, r + j) for c, r in cells for i in (0, 1) for j in (0, 1)}
    # Vertices less edges plus faces is one less the number of holes, and the faces are as many.
    whole = vertices + inner == len(points) + shared
    return np.asarray(whole if irregular else whole & (inner == shared))
