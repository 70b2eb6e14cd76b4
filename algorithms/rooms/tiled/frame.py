"""Where the tiles of a map lie on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...mesh.quadmesh import QuadMesh
from ...network.problem import FloatArray
from ..types import IntArray

#: Fewest tiles along the side of a square: two are walls, one is left to walk on.
LEAST_TILES = 3
#: Most tiles of a map; more would neither open nor be of use.
MOST_TILES = 4_000_000
#: Vertices of a grid may be off their place by this share of a square's side.
GRID_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Frame:
    """A raster of tiles over a level, rows counted downwards.

    Attributes
    ----------
    width, height
        Number of tiles.
    tile_m
        Side of a tile, metres.
    origin
        The lower left corner of the raster, metres in the working CRS.
    angle
        Direction of the rows, radians counter-clockwise from the x axis.
    cells
        Shape (m, 2). Column and row, counted upwards from the lower left, of each face of a
        mesh that is a grid; None where it is not.
    """

    width: int
    height: int
    tile_m: float
    origin: tuple[float, float]
    angle: float
    cells: IntArray | None

    def to_tiles(self, points: FloatArray) -> FloatArray:
        """Turn points (k, 2) in metres into (column, row) of the map, in tiles."""
        turned = (points - np.array(self.origin)) @ _turn(self.angle) / self.tile_m
        found: FloatArray = np.column_stack([turned[:, 0], self.height - turned[:, 1]])
        return found


def frame_of(mesh: QuadMesh, tiles_per_cell: int, tile_m: float | None) -> Frame:
    """Lay a raster over a mesh.

    Parameters
    ----------
    mesh
        The mesh. Where it is a grid of squares, turned or not, the tiles follow it.
    tiles_per_cell
        Tiles along the side of a square, at least 3; on other meshes along an edge of the
        length that was asked.
    tile_m
        Side of a tile, metres, greater than 0, which then lie along the axes whatever the
        mesh; None for the above.

    Raises
    ------
    InputError
        If a number is too small, or the map would be too large.
    """
    if tiles_per_cell < LEAST_TILES:
        raise InputError(
            f"{tiles_per_cell} tiles for each square leave no room between walls.",
            f"Take {LEAST_TILES} or more.",
        )
    if tile_m is not None and not (tile_m > 0 and math.isfinite(tile_m)):
        raise InputError(f"Tiles of {tile_m} m are impossible.", "Take more than 0 m.")
    found = lattice(mesh) if tile_m is None else None
    if found is not None:
        angle, origin, side, cells = found
        columns, rows = (cells.max(axis=0) + 1) * tiles_per_cell
        _check_size(float(columns), float(rows))
        return Frame(int(columns), int(rows), side / tiles_per_cell, origin, angle, cells)
    size = mesh.edge_length / tiles_per_cell if tile_m is None else tile_m
    points = np.vstack([mesh.vertices, *mesh.boundary_arcs.values()])
    low, high = points.min(axis=0), points.max(axis=0)
    _check_size(*((high - low) / size))
    width, height = (max(1, math.ceil(n - 1e-9)) for n in (high - low) / size)
    return Frame(width, height, size, (float(low[0]), float(low[1])), 0.0, None)


def lattice(mesh: QuadMesh) -> tuple[float, tuple[float, float], float, IntArray] | None:
    """Find the squares of a mesh that is a grid.

    Returns
    -------
    tuple or None
        Direction of the rows (radians, within 45 degrees of the x axis), lower left corner and
        side of a square (metres), column and row of each face (m, 2); None if the mesh is no
        grid of equal squares.
    """
    first = np.diff(mesh.vertices[mesh.faces[0, :2]], axis=0)[0]
    quarter = math.pi / 2
    angle = math.atan2(first[1], first[0])
    angle -= round(angle / quarter) * quarter
    side = float(mesh.lengths.mean())
    turned = mesh.vertices @ _turn(angle)
    low = turned.min(axis=0)
    place = (turned - low) / side
    whole = np.rint(place).astype(np.int64)
    corners = whole[mesh.faces]
    cells: IntArray = corners.min(axis=1)
    # each corner one step on from the one before, and no two faces in one place
    square = (np.abs(np.diff(corners, axis=1)).sum(axis=2) == 1).all()
    square &= (corners.max(axis=1) - cells == 1).all()
    exact = np.abs(place - whole).max() <= GRID_TOLERANCE
    straight = np.abs(mesh.lengths - side).max() <= GRID_TOLERANCE * side
    if not (square and exact and straight and len(np.unique(cells, axis=0)) == len(cells)):
        return None
    corner = _turn(angle) @ low
    return angle, (float(corner[0]), float(corner[1])), side, cells


def _turn(angle: float) -> FloatArray:
    """Return the matrix that turns row vectors clockwise (and column vectors back)."""
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def _check_size(columns: float, rows: float) -> None:
    """Refuse maps of too many tiles."""
    if columns * rows > MOST_TILES:
        raise InputError(
            f"The map would have {columns * rows:.2g} tiles, the most is {MOST_TILES:.2g}.",
            "Take larger tiles, or fewer for each square.",
        )
