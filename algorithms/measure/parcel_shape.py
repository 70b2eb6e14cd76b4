"""Shape of parcels: corners, smallest rectangle around, frontage (UP section 7).

Pure functions of arrays of polygons, for real parcels and designed ones alike.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

Floats = npt.NDArray[np.float64]
#: Vertices at which the outline turns by less are no corners (degrees).
STRAIGHT = 20.0
#: An undesirable parcel has corners that are on average further off 90 degrees, or a smallest
#: rectangle that is larger by this factor (UP Fig. 12).
BAD_ANGLE = 15.0
BAD_AREA = 1.2
#: Vertices nearer than this to the line of their neighbours do not count (metres).
TOLERANCE = 0.05
#: Edges shorter than this have no direction worth a rectangle (metres).
SHORT = 0.1


def corner_angles(polygons: npt.NDArray[Any], tolerance: float = TOLERANCE) -> tuple[Any, Floats]:
    """Angles at the corners of the outlines.

    Parameters
    ----------
    polygons
        Polygons, shape (n,); holes are not looked at. Metres.
    tolerance
        Outlines are simplified by this first; 1 m suits surveyed and digitised parcels, whose
        small jogs would count as corners else. Metres.

    Returns
    -------
    owner
        Index of the polygon of each corner, shape (k,).
    angle
        Angle between the two edges, 0 to 180 degrees, shape (k,); corners are vertices where the
        outline turns by more than 20 degrees, to either side.
    """
    rings = shapely.get_exterior_ring(shapely.simplify(polygons, tolerance))
    xy, owner = shapely.get_coordinates(rings, return_index=True)
    first = np.r_[True, owner[1:] != owner[:-1]] if len(owner) else np.zeros(0, bool)
    last = np.r_[owner[1:] != owner[:-1], True] if len(owner) else np.zeros(0, bool)
    # the closing vertex repeats the first
    before = np.roll(np.arange(len(xy)), 1)
    before[first] = np.flatnonzero(last) - 1
    here = ~last
    back = xy[before[here]] - xy[here]
    on = xy[np.flatnonzero(here) + 1] - xy[here]
    cross = back[:, 0] * on[:, 1] - back[:, 1] * on[:, 0]
    angle = np.degrees(np.arctan2(np.abs(cross), (back * on).sum(axis=1)))
    corner = angle < 180.0 - STRAIGHT
    return owner[here][corner], angle[corner]


def corner_deviation(polygons: npt.NDArray[Any], tolerance: float = TOLERANCE) -> Floats:
    """Mean deviation of the corners from 90 degrees (p_angle of UP), shape (n,), degrees.

    Parameters
    ----------
    polygons, tolerance
        See `corner_angles`.

    Examples
    --------
    >>> corner_deviation(np.array([shapely.box(0, 0, 18, 30)])).tolist()
    [0.0]
    """
    owner, angle = corner_angles(polygons, tolerance)
    count = np.bincount(owner, minlength=len(polygons))
    total = np.bincount(owner, weights=np.abs(angle - 90.0), minlength=len(polygons))
    return np.asarray(total / np.maximum(count, 1))


def rectangles(polygons: npt.NDArray[Any]) -> tuple[Floats, Floats]:
    """Smallest rectangle, by area, around each polygon.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), metres.

    Returns
    -------
    axis
        Direction of the first side, unit vectors, shape (n, 2).
    sides
        Extent along the axis and across it, shape (n, 2), metres; 0 for polygons without area.
    """
    rings = shapely.get_exterior_ring(shapely.convex_hull(polygons))
    axis = np.tile([1.0, 0.0], (len(polygons), 1))
    found = np.zeros((len(polygons), 2))
    sizes = shapely.get_num_points(rings)
    # all hulls of as many vertices at once
    for size in np.unique(sizes[sizes > 3]):
        which = np.flatnonzero(sizes == size)
        xy = shapely.get_coordinates(rings[which]).reshape(len(which), size, 2)
        edge = np.diff(xy, axis=1)
        length = np.hypot(edge[..., 0], edge[..., 1])
        along = edge / np.maximum(length, 1e-12)[..., None]
        across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
        sides = np.stack(
            [np.ptp(np.einsum("mvx,mex->mve", xy[:, :-1], way), axis=1) for way in (along, across)],
            axis=-1,
        )
        areas = np.where(length > SHORT, sides.prod(axis=-1), np.inf)
        best = areas.argmin(axis=1)
        row = np.arange(len(which))
        good = np.isfinite(areas[row, best])
        found[which] = np.where(good[:, None], sides[row, best], np.ptp(xy, axis=1))
        axis[which[good]] = along[row, best][good]
    return axis, found


def rectangle_area(polygons: npt.NDArray[Any]) -> Floats:
    """Area of the smallest rectangle around each polygon, shape (n,), square metres.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), metres.
    """
    return np.asarray(rectangles(polygons)[1].prod(axis=1))


def rectangle_ratio(polygons: npt.NDArray[Any]) -> Floats:
    """Smallest rectangle around / area (p_area of UP), shape (n,), 1 for a rectangle.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), metres.

    Examples
    --------
    >>> rectangle_ratio(np.array([shapely.Polygon([(0, 0), (10, 0), (0, 10)])])).round(9).tolist()
    [2.0]
    """
    area = shapely.area(polygons)
    return np.asarray(
        np.where(area > 0, rectangle_area(polygons) / np.maximum(area, 1e-12), np.inf)
    )


def undesirable(p_angle: Floats, p_area: Floats) -> npt.NDArray[np.bool_]:
    """Which parcels are undesirable: p_angle > 15 degrees or p_area > 1.2 (UP Fig. 12).

    Parameters
    ----------
    p_angle, p_area
        See `corner_deviation` and `rectangle_ratio`, shape (n,).
    """
    return np.asarray((p_angle > BAD_ANGLE) | (p_area > BAD_AREA))


def frontage(
    polygons: npt.NDArray[Any], streets: shapely.Geometry, tolerance: float = TOLERANCE
) -> Floats:
    """Length of each outline that lies along street space, shape (n,), metres.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), metres.
    streets
        The edges of street space, or street space itself; metres.
    tolerance
        How far from them an edge still lies along them; metres.
    """
    near = shapely.buffer(streets, tolerance, cap_style="flat", quad_segs=2)
    rings = shapely.get_exterior_ring(polygons)
    shapely.prepare(near)
    touching = shapely.intersects(near, rings)
    found = np.zeros(len(polygons))
    found[touching] = shapely.length(shapely.intersection(rings[touching], near))
    return found
