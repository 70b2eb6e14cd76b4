"""Shadows on the ground: by the coefficient of sunshine spacing, and true ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ..rules import SunRule
from ..shape import Shapes, corners, footprints, frames, sizes
from ..types import BuildingType, Floats, Placements
from ..zone import Zone
from .track import SunSteps, sun_steps


def shadow_corners(types: Sequence[BuildingType], placed: Placements, coefficient: float) -> Floats:
    """Give the corners of the shadows by the coefficient rule, shape (n, 4, 2), metres.

    Counter-clockwise; the first two are those of the wall behind.
    """
    _, out = frames(placed)
    ring = corners(types, placed)
    depth = out * (coefficient * sizes(types, placed)[:, 2:3])
    near = ring[:, [3, 2]]
    return np.concatenate([near, near[:, ::-1] - depth[:, None]], axis=1)


def shadow_rectangles(
    types: Sequence[BuildingType], placed: Placements, coefficient: float
) -> Shapes:
    """Give the shadow of each building by the coefficient rule (RZ section 3.1 and Fig. 4).

    The rectangle lies behind the building, opposite the balconies, is as long as the façade and
    coefficient x height deep; the building's own ground is not part of it.

    Parameters
    ----------
    types
        Kinds of buildings.
    placed
        Buildings, n of them.
    coefficient
        Coefficient of sunshine spacing, greater than 0.

    Returns
    -------
    numpy.ndarray
        Polygons, shape (n,).
    """
    if not len(placed):
        return np.zeros(0, dtype=object)
    ring = shadow_corners(types, placed, coefficient)
    made: Shapes = shapely.polygons(np.concatenate([ring, ring[:, :1]], axis=1))
    return made


def shadow_polygons(
    zone: Zone, types: Sequence[BuildingType], placed: Placements, rule: SunRule
) -> Shapes:
    """Give what each building shades on the ground under a sun rule.

    By the coefficient rule the rectangles of `shadow_rectangles`. By the rule of hours the ground
    that the shadow of the extruded building sweeps in the window, without the ground that the
    building stands on; between two instants the tip of the shadow is taken to move straight.
    Instants with the sun below `LOW_SUN_DEG` do not count.

    Parameters
    ----------
    zone
        Gives place and grid.
    types
        Kinds of buildings.
    placed
        Buildings, n of them.
    rule
        The sun rule.

    Returns
    -------
    numpy.ndarray
        Polygons, shape (n,); empty polygons where the sun does not shine.

    Raises
    ------
    MissingDependencyError
        If the rule of hours is asked for and pvlib is not installed.
    """
    if rule.hours is None:
        return shadow_rectangles(types, placed, rule.coefficient)
    return cast_shadows(types, placed, sun_steps(zone, rule))


def cast_shadows(types: Sequence[BuildingType], placed: Placements, steps: SunSteps) -> Shapes:
    """Give the ground that true shadows sweep, without the building's own, polygons (n,)."""
    result = np.zeros(len(placed), dtype=object)
    if not len(placed):
        return result
    # Buildings of a type that look the same way have the same shadow, elsewhere.
    keys = np.column_stack([placed.type, np.round(placed.facing, 6)])
    _, first, kind = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    kind = kind.reshape(-1)
    for number, at in enumerate(first):
        one = placed.take([at])
        where = np.flatnonzero(kind == number)
        swept = _swept(types, one, steps)
        shift = placed.xy[where] - one.xy[0]
        points = shapely.get_coordinates(swept)
        copies = np.repeat(np.array([swept], dtype=object), len(where))
        moved = np.tile(points, (len(where), 1)) + np.repeat(shift, len(points), axis=0)
        result[where] = shapely.set_coordinates(copies, moved)
    return result


def _swept(types: Sequence[BuildingType], one: Placements, steps: SunSteps) -> shapely.Geometry:
    """Return the ground swept by the shadow of one building, without its own."""
    if not len(steps):
        return shapely.Polygon()
    ring = corners(types, one)[0]
    tips = -steps.towards * (sizes(types, one)[0, 2] / steps.tangent)[:, None]
    # The shadow at an instant is the footprint moved along to the tip; between two instants it
    # sweeps the footprint moved over a triangle. Footprints are convex, so both are hulls. The
    # instants follow each other, since the sun rises until noon and then sinks.
    later = tips[1:] if len(tips) > 1 else tips
    clouds = np.stack([np.concatenate([ring, ring + a, ring + b]) for a, b in zip(tips, later)])
    hulls = shapely.convex_hull(shapely.multipoints(shapely.points(clouds)))
    swept = shapely.union_all(hulls)
    return shapely.difference(swept, footprints(types, one)[0])
