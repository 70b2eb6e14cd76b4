"""Ground that is taken by buildings and paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import MultiLineString
from shapely.geometry.base import BaseGeometry

from ..layout import PathPlan
from ..rules import LayoutRules
from ..shape import footprints
from ..types import BuildingType, Floats, Placements
from ..zone import Zone

Shapes = npt.NDArray[np.object_]
#: Sides of a patch along streets that end so near to each other are one, metres.
SEAM = 0.5


@dataclass(frozen=True, eq=False)
class Taken:
    """Buildings and paths, ready to be asked for distances.

    Attributes
    ----------
    buildings
        Outlines, shape (n,).
    paths
        Centre lines, shape (k,).
    path_m
        Width of paths, metres.
    ground
        Patches, shape (p,).
    """

    buildings: Shapes
    paths: Shapes
    path_m: float
    ground: Shapes

    def strips(self, more: float = 0.0) -> Shapes:
        """Give the ground of paths, widened on each side by `more` metres, shape (k,)."""
        made: Shapes = shapely.buffer(self.paths, self.path_m / 2 + more, quad_segs=4)
        return made

    def aprons(self, wide: float) -> Shapes:
        """Give buildings with `wide` metres around them, shape (n,)."""
        made: Shapes = shapely.buffer(self.buildings, wide, join_style="mitre")
        return made


def taken_ground(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    placed: Placements,
    plan: PathPlan,
) -> Taken:
    """Collect what buildings and paths take.

    Parameters
    ----------
    zone, types, rules, placed, plan
        As of `lay_details`.
    """
    return Taken(
        footprints(types, placed),
        shapes([path.line for path in plan.paths]),
        rules.path_m,
        shapes([patch.polygon for patch in zone.patches]),
    )


def shapes(geometries: Sequence[BaseGeometry]) -> Shapes:
    """Give geometries as an array, shape (n,)."""
    made = np.empty(len(geometries), dtype=object)
    made[:] = list(geometries)
    return made


def street_sides(access: MultiLineString) -> list[Floats]:
    """Give the sides of a patch along streets as long lines.

    Parameters
    ----------
    access
        Parts of the ring of a patch along street space, in any pieces.

    Returns
    -------
    list of numpy.ndarray
        Coordinates of each line, shape (m, 2).
    """
    if access.is_empty:
        return []
    pieces = shapely.get_parts(shapely.force_2d(access))
    ends = np.array([line[[0, -1]] for line in map(shapely.get_coordinates, pieces)])
    ends = ends.reshape(-1, 2)
    joints = [
        shapely.linestrings(ends[[one, other]])
        for one, other in sorted(cKDTree(ends).query_pairs(SEAM))
        if one // 2 != other // 2 and (ends[one] != ends[other]).any()
    ]
    merged = shapely.line_merge(shapely.multilinestrings([*pieces, *joints]))
    return [
        shapely.get_coordinates(line)
        for line in shapely.get_parts(merged)
        if shapely.length(line) > SEAM
    ]
