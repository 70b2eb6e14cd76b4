"""Whether entrances have a way out to street space: fast enough to ask at every step of a search.

RZ section 4.1, constraint 4. The answer is a flood over cells; `plan_paths` finds the paths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy import ndimage
from shapely.geometry.base import BaseGeometry

from ..rules import LayoutRules
from ..shape import entrances, frames, sizes
from ..types import BuildingType, Floats, Placements
from ..zone import Patch, Zone
from .frame import Frame, Mask, covered, edge_frame

#: Size of the cells, metres; where paths are narrow, less.
CELL_M = 1.25
#: Passages must be so much wider than a path on either side, metres, so that what is found here
#: by cells is found by `plan_paths`, too, with other ones.
SAFE_M = 0.15
#: Neighbours around a cell, itself first.
AROUND = np.array([(0, 0)] + [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c])


def open_ground(patch: Patch, clearance_m: float) -> BaseGeometry:
    """Give the ground of a patch on which the middle of a path may run if nothing is built.

    It keeps the clearance from the edge of the patch except where that borders on street space.

    Parameters
    ----------
    patch
        The patch.
    clearance_m
        Half of the width of a path, metres.
    """
    walls = patch.polygon.boundary.difference(patch.access.buffer(0.05))
    if walls.is_empty:
        return patch.polygon
    kept: BaseGeometry = patch.polygon.difference(walls.buffer(clearance_m, cap_style="square"))
    return kept


@dataclass(frozen=True)
class _Cells:
    """Cells of one patch: coordinates in its frame, free ground, and cells at street space."""

    frame: Frame
    xs: Floats
    ys: Floats
    free: Mask
    street: Mask
    access: BaseGeometry
    walls: BaseGeometry


def _cells(patch: Patch, clearance_m: float, cell_m: float) -> _Cells:
    """Lay cells over a patch."""
    frame = edge_frame(patch.polygon)
    polygon = frame.geometry(patch.polygon)
    x0, y0, x1, y1 = polygon.bounds
    xs = np.arange(x0 + cell_m / 2, x1, cell_m)
    ys = np.arange(y0 + cell_m / 2, y1, cell_m)
    grid_x, grid_y = np.meshgrid(xs, ys)
    ground = frame.geometry(open_ground(patch, clearance_m))
    access = frame.geometry(patch.access)
    shapely.prepare(ground)
    free = shapely.contains_xy(ground, grid_x, grid_y)
    # The strip along the street is as deep as a cell, so that every way to it holds one of its
    # cells.
    strip = access.buffer(cell_m * 1.01, cap_style="flat").union(access.buffer(cell_m / 2))
    shapely.prepare(strip)
    street = free & shapely.contains_xy(strip, grid_x, grid_y)
    walls = polygon.boundary.difference(access.buffer(0.05))
    return _Cells(frame, xs, ys, free, street, access, walls)


class ExitCheck:
    """Tells which entrances are connected to street space by ground that a path can use.

    Free ground is the patch without footprints and without what lies closer than half a path to
    them or to an edge of the patch that is not street space. An entrance has a way out if the
    cells before it belong to free ground that touches `Patch.access` (cells joined by their
    sides only, as paths do not pass diagonally, RZ Fig. 5b).

    Parameters
    ----------
    zone
        The ground.
    types
        Kinds of buildings.
    rules
        `path_m` is the width of paths.
    """

    def __init__(self, zone: Zone, types: Sequence[BuildingType], rules: LayoutRules) -> None:
        self.types = types
        self.clearance_m = rules.path_m / 2 + SAFE_M
        self.cell_m = min(CELL_M, max(0.5, rules.path_m / 2))
        self._cells = [_cells(p, self.clearance_m, self.cell_m) for p in zone.patches]

    def reached(self, placed: Placements) -> npt.NDArray[np.bool_]:
        """Tell which of the buildings have a way out while all of them stand.

        Patches do not depend on each other: with the buildings of one patch only, the answer for
        these is the same and comes sooner.

        Returns
        -------
        numpy.ndarray
            Shape (n,).
        """
        answer = np.zeros(len(placed), dtype=bool)
        if not len(placed):
            return answer
        point, outward = entrances(self.types, placed)
        along, _ = frames(placed)
        half = sizes(self.types, placed)[:, :2] / 2
        for patch in np.unique(placed.patch):
            here = np.flatnonzero(placed.patch == patch)
            cells = self._cells[patch]
            frame = cells.frame
            built = covered(
                cells.xs, cells.ys, frame.inward(placed.xy[here]), frame.turned(along[here]),
                half[here], self.clearance_m - 1e-6,
            )  # fmt: skip
            answer[here] = self._flooded(
                cells, cells.free & ~built, frame.inward(point[here]), frame.turned(outward[here])
            )
        return answer

    def _flooded(self, cells: _Cells, free: Mask, point: Floats, outward: Floats) -> Mask:
        """Tell which entrances (m, 2) the flood from street space reaches."""
        label, count = ndimage.label(free)
        joined = np.zeros(count + 1, dtype=bool)
        joined[np.unique(label[cells.street & free])] = True
        joined[0] = False
        front = point + outward * (self.clearance_m + 0.75 * self.cell_m)
        column = np.floor((front[:, 0] - cells.xs[0]) / self.cell_m + 0.5).astype(int)
        row = np.floor((front[:, 1] - cells.ys[0]) / self.cell_m + 0.5).astype(int)
        r = row[:, None] + AROUND[:, 0]
        c = column[:, None] + AROUND[:, 1]
        within = (r >= 0) & (c >= 0) & (r < len(cells.ys)) & (c < len(cells.xs))
        r, c = np.where(within, r, 0), np.where(within, c, 0)
        # Cells beside the façade or behind it are not before the entrance.
        ahead = (cells.xs[c] - point[:, :1]) * outward[:, :1]
        ahead = ahead + (cells.ys[r] - point[:, 1:]) * outward[:, 1:]
        before = ahead >= self.clearance_m - 0.25 * self.cell_m
        found: Mask = np.any(within & before & joined[label[r, c]], axis=1)
        for i in np.flatnonzero(~found):
            found[i] = step_out(
                point[i], outward[i], cells.access, cells.walls, self.clearance_m + 2 * self.cell_m
            ) is not None  # fmt: skip
        return found


def step_out(
    point: Floats, outward: Floats, access: BaseGeometry, walls: BaseGeometry, reach_m: float
) -> Floats | None:
    """Give the point where one steps straight from an entrance into the street, or None.

    Parameters
    ----------
    point, outward
        The entrance and the unit vector out of it, shape (2,).
    access, walls
        The edge of the patch that is street space, and the rest of it.
    reach_m
        Longest step, metres.
    """
    step = shapely.linestrings([point, point + outward * reach_m])
    hit = step.intersection(access)
    if hit.is_empty:
        return None
    met = shapely.get_coordinates(hit)
    away = (met - point) @ outward
    nearest = int(np.argmin(away))
    if (
        step.intersects(walls)
        and shapely.Point(point).distance(step.intersection(walls)) < away[nearest]
    ):
        return None
    return np.asarray(met[nearest], dtype=float)
