"""The ground of a patch with its buildings: where the middle of a path may run, exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..rules import LayoutRules
from ..shape import entrances, frames, sizes
from ..types import BuildingType, Floats, Placements
from ..zone import Patch
from .exitcheck import open_ground
from .frame import Frame, facing_frame

#: So much nearer to walls than half its width a path may run, metres: gaps are often just as
#: wide as a path.
GIVE_M = 0.05


@dataclass(frozen=True, eq=False)
class Lane:
    """A patch and its buildings in the frame of the patch, metres.

    Attributes
    ----------
    frame
        The frame.
    street
        The parts of the patch's edge that are street space, in the grid's coordinates.
    polygon, access, walls
        The patch, the parts of its edge that are street space, and the others.
    ground
        Where the middle of a path may run if nothing is built.
    free
        The same with the buildings; prepared.
    clearance_m
        Half of the width of a path less a little.
    entrance, outward
        Of the buildings, shape (n, 2).
    centre, along, half
        Of their footprints: centres, unit vectors along, half sizes; shape (n, 2).
    built
        Their footprints together.
    """

    frame: Frame
    street: BaseGeometry
    polygon: BaseGeometry
    access: BaseGeometry
    walls: BaseGeometry
    ground: BaseGeometry
    free: BaseGeometry
    clearance_m: float
    entrance: Floats
    outward: Floats
    centre: Floats
    along: Floats
    half: Floats
    built: BaseGeometry

    def __len__(self) -> int:
        return len(self.centre)

    def allows(self, line: Floats) -> bool:
        """Tell whether the middle of a path may run along a line (k, 2)."""
        if len(line) < 2 or np.ptp(line, axis=0).max() < 1e-6:
            return True
        return bool(self.free.covers(shapely.linestrings(line)))


def _rectangles(centre: Floats, along: Floats, half: Floats) -> BaseGeometry:
    """Give rectangles as one geometry."""
    across = np.column_stack([-along[:, 1], along[:, 0]])
    u, v = along * half[:, :1], across * half[:, 1:]
    ring = np.stack([centre + u + v, centre - u + v, centre - u - v, centre + u - v], axis=1)
    made: BaseGeometry = shapely.union_all(shapely.polygons(ring))
    return made


def lane_of(
    patch: Patch, types: Sequence[BuildingType], rules: LayoutRules, placed: Placements
) -> Lane:
    """Prepare a patch with the buildings in it.

    Parameters
    ----------
    patch
        The patch.
    types
        Kinds of buildings.
    rules
        `path_m` is the width of paths.
    placed
        Buildings of this patch only.
    """
    frame = facing_frame(patch.polygon, placed.facing)
    clearance = max(rules.path_m / 2 - GIVE_M, 0.1)
    point, out = entrances(types, placed)
    along = frame.turned(frames(placed)[0])
    half = sizes(types, placed)[:, :2] / 2
    centre = frame.inward(placed.xy)
    polygon, access = frame.geometry(patch.polygon), frame.geometry(patch.access)
    ground = frame.geometry(open_ground(patch, clearance))
    free = ground.difference(_rectangles(centre, along, half + clearance))
    # The last step onto the street leaves the ground by nothing but a rounding error.
    free = free.union(access.buffer(0.02, cap_style="flat"))
    shapely.prepare(free)
    return Lane(
        frame=frame,
        street=patch.access,
        polygon=polygon,
        access=access,
        walls=polygon.boundary.difference(access.buffer(0.05)),
        ground=ground,
        free=free,
        clearance_m=clearance,
        entrance=frame.inward(point),
        outward=frame.turned(out),
        centre=centre,
        along=along,
        half=half,
        built=_rectangles(centre, along, half),
    )
