"""Heights of the ground from a grid of numbers, as a raster layer has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pyproj import CRS, Transformer
from scipy.interpolate import RegularGridInterpolator

from ..network.problem import FloatArray


@dataclass(frozen=True, eq=False)
class HeightGrid:
    """A raster of heights.

    Attributes
    ----------
    values
        Shape (rows, columns), metres, from north to south; NaN where nothing is known.
    west, north
        Upper left corner of the raster, in its CRS.
    step_x, step_y
        Size of a cell, in units of the CRS, both greater than 0.
    crs
        CRS of the raster.
    """

    values: npt.NDArray[np.float64]
    west: float
    north: float
    step_x: float
    step_y: float
    crs: Any

    def seen_from(self, crs: Any) -> Heights:
        """Return the heights as a function of positions in another CRS."""
        return Heights(self, crs)


class Heights:
    """Heights at positions in a working CRS, between the middles of cells bilinear.

    Parameters
    ----------
    grid
        The raster.
    crs
        CRS of the positions.
    """

    def __init__(self, grid: HeightGrid, crs: Any) -> None:
        rows, columns = grid.values.shape
        x = grid.west + grid.step_x * (np.arange(columns) + 0.5)
        y = grid.north - grid.step_y * (np.arange(rows) + 0.5)
        # a raster of one row or column has no neighbour to interpolate with
        values = np.pad(grid.values, ((0, int(rows == 1)), (0, int(columns == 1))), "edge")
        x = np.append(x, x[-1] + grid.step_x) if columns == 1 else x
        y = np.append(y, y[-1] - grid.step_y) if rows == 1 else y
        self._at = RegularGridInterpolator(
            (y[::-1], x), values[::-1], bounds_error=False, fill_value=np.nan
        )
        self._turn = Transformer.from_crs(CRS(crs), CRS(grid.crs), always_xy=True)

    def __call__(self, places: FloatArray) -> FloatArray:
        """Return heights in metres at positions of shape (k, 2); NaN where none is known."""
        x, y = self._turn.transform(places[:, 0], places[:, 1])
        found: FloatArray = self._at(np.column_stack([y, x]))
        return found


def no_heights(places: FloatArray) -> FloatArray:
    """Return that no height is known at positions of shape (k, 2)."""
    return np.full(len(places), np.nan)
