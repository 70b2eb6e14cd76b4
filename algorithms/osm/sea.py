"""The sea, which OpenStreetMap knows by its coast only: water lies to the right of the line."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

#: How far from the coast a place is looked at, in degrees; some 10 cm.
_ASIDE = 1e-6
_ALIKE = 1e-9
_MARGIN = 1e-3
#: A face is sea where so many times more places to the right of the coast lie in it; at sharp
#: corners a place may fall on the other side.
_PURE = 10


def sea(coast: list[shapely.LineString], window: shapely.Geometry) -> shapely.Geometry:
    """Return the part of a window that is sea.

    Parameters
    ----------
    coast
        Lines with land to their left and water to their right, EPSG:4326.
    window
        Polygon.

    Returns
    -------
    shapely.Polygon or shapely.MultiPolygon
        Empty where no coast crosses the window, or where it ends inside.
    """
    # A little more than the window, so that the coast runs over its border and not just up to it.
    around = shapely.box(*shapely.bounds(window)).buffer(_MARGIN)
    inside = shapely.get_parts(shapely.intersection(np.array(coast, dtype=object), around))
    lines = [part for part in inside if part.geom_type == "LineString"]
    if not lines:
        return shapely.Polygon()
    noded = shapely.union_all([*lines, *shapely.get_parts(shapely.boundary(window))])
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    right = shapely.STRtree(_beside(lines))
    left = shapely.STRtree(_beside(lines, side=-1.0))
    # Where the coast ends inside the window, as at the edge of a file, both sides lie in one face.
    water = [face for face in faces if _count(right, face) > _PURE * _count(left, face)]
    return shapely.intersection(shapely.union_all(water), window)


def _count(points: shapely.STRtree, face: shapely.Polygon) -> int:
    return len(points.query(face, predicate="contains"))


def _beside(lines: list[shapely.LineString], side: float = 1.0) -> np.ndarray[Any, np.dtype[Any]]:
    """Return a point to the right of each piece of the lines, to the left with side -1."""
    points = []
    for line in lines:
        xy = shapely.get_coordinates(line)
        step = np.diff(xy, axis=0)
        length = np.hypot(step[:, 0], step[:, 1])
        good = length > _ALIKE
        middle = (xy[:-1] + xy[1:])[good] / 2
        across = np.column_stack([step[good, 1], -step[good, 0]]) / length[good, None]
        points.append(middle + side * _ASIDE * across)
    return np.asarray(shapely.points(np.concatenate(points)))
