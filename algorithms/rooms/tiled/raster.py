"""A level as tiles: walls along the borders of blocks, doors where the route passes through.

A tile is a wall where one of the eight around it belongs to another block or to none, so that
the tiles to walk on of two blocks never touch, not even at corners. Doors are the walls that
the route crosses at a passage. Borders without passage, and the outside, stay closed; the
result is checked, so that what can be walked is what the route says.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
import shapely.ops
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...errors import CancelledError, InputError
from ...network.problem import BoolArray, FloatArray
from ...progress import Progress, Silent
from ..levels.collect import block_polygons
from ..levels.graph import Level
from ..types import IntArray
from .frame import Frame, frame_of

#: Tiles whose middle is as near as this to the route are on it, in tiles: just more than half
#: the diagonal of a tile, so that they join by their sides.
REACH = 0.75
#: Corners of a block that its walls cut off are closed up to this share of its tiles.
MOST_LOST = 0.2
_TOO_COARSE = "Take smaller tiles, or more for each square."


@dataclass(frozen=True, eq=False)
class Tiles:
    """A level of `height` rows, counted downwards, and `width` columns of tiles.

    Attributes
    ----------
    frame
        Where the tiles lie.
    owner
        Shape (height, width). Block of each tile, -1 outside.
    wall
        Shape (height, width). Walls.
    door
        Shape (height, width). Passage (index into `Level.passages`) of each door, -1 elsewhere.
    route
        Shape (height, width). Tiles along the route that are no walls.
    start, goal
        (row, column) of the tiles where the level begins and ends; the goal is None where it
        is in the block of the start and the same tile.
    treasures
        (row, column) in each block that is a dead end, neither start nor goal, by block.
    """

    frame: Frame
    owner: IntArray
    wall: BoolArray
    door: IntArray
    route: BoolArray
    start: tuple[int, int]
    goal: tuple[int, int] | None
    treasures: dict[int, tuple[int, int]]

    @property
    def free(self) -> BoolArray:
        """Shape (height, width): tiles that can be walked on, doors included."""
        return np.asarray((self.owner >= 0) & ~self.wall)


def rasterise(
    level: Level,
    *,
    tiles_per_cell: int = 5,
    tile_m: float | None = None,
    progress: Progress | None = None,
) -> Tiles:
    """Turn a level into tiles.

    Parameters
    ----------
    level
        The level.
    tiles_per_cell, tile_m
        As of `frame_of`.
    progress
        Asked for cancellation.

    Raises
    ------
    InputError
        If the tiles are so coarse that a block would be cut, or a passage closed, or one opened
        that the route does not have.
    CancelledError
        If the caller wants no more.
    """
    progress = progress or Silent()
    frame = frame_of(level.problem.network.mesh, tiles_per_cell, tile_m)
    owner = _owners(level, frame, progress)
    around = _padded(owner)
    wall = owner >= 0
    rim = np.zeros_like(wall)
    other = np.zeros_like(wall)
    for rows in range(3):
        for columns in range(3):
            near = around[rows : rows + frame.height, columns : columns + frame.width]
            other |= near != owner
            rim |= near < 0
    wall &= other
    route = np.zeros_like(wall)
    door = np.full_like(owner, -1)
    _carve(level, frame, owner, route, door, wall & ~rim, progress)
    wall &= door < 0
    _join(level, owner, wall, door)
    route &= ~wall
    free = (owner >= 0) & ~wall & (door < 0)
    start = _nearest(level, frame, free & (owner == level.start_block), route, level.start)
    goal = _nearest(level, frame, free & (owner == level.goal_block), route, level.goal)
    roles = level.roles
    treasures = {
        block: _nearest(level, frame, free & (owner == block), route, _inmost(level, block))
        for block in range(level.count)
        if roles[block] == "treasure"
    }
    return Tiles(frame, owner, wall, door, route, start, None if goal == start else goal, treasures)


def _padded(owner: IntArray) -> IntArray:
    """Add a ring of ground outside."""
    return np.pad(owner, 1, constant_values=-1)


def _owners(level: Level, frame: Frame, progress: Progress) -> IntArray:
    """Find the block of each tile."""
    owner = np.full((frame.height, frame.width), -1, dtype=np.int64)
    if frame.cells is not None:
        size = frame.cells.max(axis=0) + 1
        table = np.full((size[1], size[0]), -1, dtype=np.int64)
        table[size[1] - 1 - frame.cells[:, 1], frame.cells[:, 0]] = level.face_block
        k = frame.width // int(size[0])
        return np.repeat(np.repeat(table, k, axis=0), k, axis=1)
    for block, ground in enumerate(block_polygons(level)):
        _watch(progress)
        shape = shapely.transform(ground, frame.to_tiles)
        rows, columns = _window(frame, np.reshape(shapely.bounds(shape), (2, 2)), 0.0)
        shapely.prepare(shape)
        y, x = np.mgrid[rows, columns] + 0.5
        part = owner[rows, columns]
        # a middle on the border of two blocks goes to the first
        part[shapely.intersects_xy(shape, x, y) & (part < 0)] = block
    return owner


def _window(frame: Frame, corners: FloatArray, reach: float) -> tuple[slice, slice]:
    """Return the rows and columns within `reach` tiles of a box."""
    low = np.maximum(np.floor(corners.min(axis=0) - reach), 0).astype(int)
    high = np.ceil(corners.max(axis=0) + reach).astype(int)
    return (
        slice(int(low[1]), min(int(high[1]), frame.height)),
        slice(int(low[0]), min(int(high[0]), frame.width)),
    )


def _carve(
    level: Level,
    frame: Frame,
    owner: IntArray,
    route: BoolArray,
    door: IntArray,
    solid: BoolArray,
    progress: Progress,
) -> None:
    """Mark the tiles of the route, and of `solid` the doors that it needs at passages."""
    mesh = level.problem.network.mesh
    passage = {p.vertex: i for i, p in enumerate(level.passages)}
    for e in np.flatnonzero(level.route).tolist():
        _watch(progress)
        line = frame.to_tiles(mesh.edge_line(e))
        whole = shapely.LineString(line)
        rows, columns = _window(frame, line, REACH)
        y, x = np.mgrid[rows, columns] + 0.5
        middles = shapely.points(x, y)
        own = owner[rows, columns] == level.edge_block[e]
        route[rows, columns] |= own & (shapely.distance(middles, whole) <= REACH)
        for vertex, near in zip(mesh.edges[e].tolist(), (0.0, 0.5)):
            if vertex not in passage:
                continue
            # only the half at the passage: the other end may be at another border
            half = shapely.ops.substring(whole, near, near + 0.5, normalized=True)
            gap = own & solid[rows, columns] & (shapely.distance(middles, half) <= REACH)
            door[rows, columns][gap] = passage[vertex]


def _join(level: Level, owner: IntArray, wall: BoolArray, door: IntArray) -> None:
    """Close what is cut off inside its block; refuse tiles that do not connect as the route.

    Changes `wall` and `door`.
    """
    pairs = _sides((owner >= 0) & ~wall)
    mine, at, shut = owner.reshape(-1), door.reshape(-1), wall.reshape(-1)
    same = mine[pairs[:, 0]] == mine[pairs[:, 1]]
    passage = at[pairs]
    # First the rooms without their doors, so that no room hangs together by a door alone; then
    # the doors, each from its room and not through those of another passage.
    rooms = same & (passage < 0).all(axis=1)
    doors = same & ((passage[:, 0] == passage[:, 1]) | (passage < 0).any(axis=1))
    for linked, plain in ((rooms, True), (doors, False)):
        part = _parts(pairs[linked & ~shut[pairs].any(axis=1)], owner.size)
        for block in range(level.count):
            own = np.flatnonzero((mine == block) & ~shut & ((at < 0) if plain else True))
            if not len(own):
                raise InputError(f"Block {block + 1} has no tile but walls.", _TOO_COARSE)
            names, sizes = np.unique(part[own], return_counts=True)
            lost = own[part[own] != names[np.argmax(sizes)]]
            if len(lost) > MOST_LOST * len(own):
                raise InputError(f"Block {block + 1} is cut by its own walls.", _TOO_COARSE)
            # whether what is left of a passage is open is checked below
            shut[lost] = True
            at[lost] = -1
    across = pairs[~same]
    across = across[~shut[across].any(axis=1)]
    _check_doors(level, mine[across], at[across])


def _sides(free: BoolArray) -> IntArray:
    """Return the pairs (k, 2) of free tiles that share a side, numbered row by row."""
    number = np.arange(free.size).reshape(free.shape)
    beside = free[:, :-1] & free[:, 1:]
    below = free[:-1] & free[1:]
    found: IntArray = np.vstack(
        [
            np.column_stack([number[:, :-1][beside], number[:, 1:][beside]]),
            np.column_stack([number[:-1][below], number[1:][below]]),
        ]
    )
    return found


def _check_doors(level: Level, blocks: IntArray, doors: IntArray) -> None:
    """Compare where tiles lead from block to block with the passages of the route.

    Shapes (k, 2): the blocks and the passages of the two tiles wherever two blocks touch.
    """
    allowed = [set(p.blocks) for p in level.passages]
    for pair in np.unique(blocks, axis=0).tolist():
        if not any(set(pair) <= meeting for meeting in allowed):
            raise InputError(
                f"Doors of blocks {pair[0] + 1} and {pair[1] + 1} would touch.", _TOO_COARSE
            )
    for i, passage in enumerate(level.passages):
        here = blocks[(doors == i).all(axis=1)]
        index = {block: k for k, block in enumerate(passage.blocks)}
        ends = np.array([[index[a], index[b]] for a, b in here.tolist()]).reshape(-1, 2)
        if _parts(ends.astype(np.int64), len(index)).any():
            names = " and ".join(str(block + 1) for block in passage.blocks)
            raise InputError(f"The passage between blocks {names} is closed.", _TOO_COARSE)


def _parts(pairs: IntArray, count: int) -> IntArray:
    """Return the part, from 0, of each of `count` nodes joined by pairs (k, 2)."""
    entries = np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])
    matrix = coo_array(entries, shape=(count, count))
    parts: IntArray = connected_components(matrix, directed=False)[1]
    return parts


def _nearest(
    level: Level, frame: Frame, free: BoolArray, route: BoolArray, vertex: int
) -> tuple[int, int]:
    """Return the free tile nearest to a vertex, on the route where there is one."""
    if (free & route).any():
        free = free & route
    tiles = np.argwhere(free)
    if not len(tiles):
        raise InputError("A block has no tile but walls and doors.", _TOO_COARSE)
    x, y = frame.to_tiles(level.problem.network.mesh.vertices[[vertex]])[0]
    far = np.hypot(tiles[:, 1] + 0.5 - x, tiles[:, 0] + 0.5 - y)
    # rounded, so that ties go to the first whatever the noise
    row, column = tiles[int(np.argmin(np.round(far, 6)))]
    return int(row), int(column)


def _inmost(level: Level, block: int) -> int:
    """Return the vertex of a block that is farthest along the route."""
    ends = np.unique(level.problem.network.mesh.edges[level.edge_block == block])
    return int(ends[int(np.argmax(level.along[ends]))])


def _watch(progress: Progress) -> None:
    """Stop where the caller wants to."""
    if progress.cancelled():
        raise CancelledError("The tiles were not drawn: the run was cancelled.")
