"""Green: all open ground that is wide enough."""

from __future__ import annotations

from collections.abc import Sequence

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from ..zone import Zone
from .taken import Taken, shapes

#: Paving around buildings, metres.
APRON = 1.0
#: Green narrower than this is paved, metres.
NARROW = 1.5
#: Smaller plots are no green, square metres.
LEAST = 30.0
#: Grids on which ground is opened, metres; 0 is none.
GRIDS = (0.0, 1e-4, 1e-3, 1e-2)
#: Less ground than this is rounding, square metres; results as large as this share of the largest
#: have lost nothing.
SLIVER, ALIKE = 0.01, 0.999


def green_plots(zone: Zone, taken: Taken, parking: Sequence[Polygon]) -> tuple[Polygon, ...]:
    """Find the plots of green: patches without buildings, their aprons, paths and parking.

    Parameters
    ----------
    zone
        The ground.
    taken
        Buildings and paths.
    parking
        Rows of bays.

    Returns
    -------
    tuple of Polygon
        Disjoint and valid, largest first; they may have holes.
    """
    paved = shapely.union_all([*taken.aprons(APRON), *taken.strips(), *parking])
    wide = [opened(open_, NARROW / 2) for open_ in shapely.difference(taken.ground, paved)]
    if zone.obstacles:
        wide = shapely.difference(wide, shapely.union_all(shapes(zone.obstacles)))
    parts = shapely.get_parts(wide)
    parts = parts[
        (shapely.get_type_id(parts) == shapely.GeometryType.POLYGON)
        & (shapely.area(parts) >= LEAST)
    ]
    order = sorted(range(len(parts)), key=lambda k: (-shapely.area(parts[k]), k))
    return tuple(parts[k] for k in order)


def opened(ground: BaseGeometry, reach: float) -> BaseGeometry:
    """Take away what is narrower than twice `reach` metres, and round the corners.

    Where corners are micrometres apart, GEOS may lose a polygon that is set in, or fill a hole of
    it. So this is done on several grids, and a result counts that lies within the ground and
    is about as large as the largest.
    """
    found: list[BaseGeometry] = []
    for grid in GRIDS:
        snapped = shapely.set_precision(ground, grid) if grid else ground
        wide = shapely.buffer(shapely.buffer(snapped, -reach), reach, quad_segs=4)
        if not wide.is_valid:
            continue
        # rounding back must not reach beyond what is open
        wide = shapely.intersection(wide, ground)
        beyond = shapely.buffer(wide, -2 * max(GRIDS)).difference(ground).area
        if wide.is_valid and beyond < SLIVER:
            found.append(wide)
    most = max((wide.area for wide in found), default=0.0)
    # the finest grid on which nothing got lost
    return next((wide for wide in found if wide.area >= ALIKE * most), Polygon())
