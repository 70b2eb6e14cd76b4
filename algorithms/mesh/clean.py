"""Bring a real site to a form that quads of a given size can fill."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from .quadmesh import FloatArray

LEAST_PART = 1.5
"""Area under which a part of a site is dropped, in squares of the edge length."""
LEAST_HOLE = 0.3
SHARP = np.radians(40.0)
TIP_WIDTH = 0.55


@dataclass(frozen=True)
class CleanSite:
    """A site without what is finer than the mesh.

    Attributes
    ----------
    parts
        Polygons, exterior counter-clockwise, the largest first.
    moved
        Area that was added or lost, relative to the area of the site.
    """

    parts: tuple[Polygon, ...]
    moved: float


def polygons_of(geometry: shapely.Geometry) -> list[Polygon]:
    """Return the polygons of any geometry, largest first."""
    parts = shapely.get_parts(shapely.get_parts(np.atleast_1d(geometry)))
    found = [g for g in parts if isinstance(g, Polygon) and not g.is_empty]
    return sorted(found, key=lambda g: (-g.area, g.bounds))


def clean_site(
    site: Polygon, h: float, ratio: float, keep: FloatArray, *, holes: bool = True
) -> CleanSite:
    """Close slots, cut necks and spikes, drop tiny parts and holes.

    Parameters
    ----------
    site
        Valid polygon, metres.
    h
        Edge length, metres.
    ratio
        Slots, necks and spikes narrower than 2 * ratio * h go.
    keep
        Shape (k, 2). Sharp tips with one of these points are not cut.
    holes
        False fills all holes.

    Returns
    -------
    CleanSite
        May have no part at all if the site is smaller than a cell.
    """
    source = site if holes else Polygon(site.exterior)
    radius = ratio * h
    options = {"join_style": "mitre", "mitre_limit": 3.0}
    shape = source.buffer(radius, **options).buffer(-2 * radius, **options)
    shape = shape.buffer(radius, **options).simplify(min(h / 100, 0.5))
    if ratio > 0.2:
        shape = _without_tips(shape, h)
    parts = []
    for part in polygons_of(shape):
        if part.area < LEAST_PART * h * h:
            continue
        outline = Polygon(_chamfered(np.asarray(part.exterior.coords)[:-1], h, keep))
        if not outline.is_valid:
            outline = Polygon(part.exterior)
        large = [ring for ring in part.interiors if Polygon(ring).area > LEAST_HOLE * h * h]
        cut = Polygon(outline.exterior, large)
        if not cut.is_valid:
            cut = polygons_of(cut.buffer(0))[0]
        parts.append(orient(cut, 1.0))
    union = shapely.union_all(parts)
    return CleanSite(tuple(parts), float(union.symmetric_difference(source).area / source.area))


def _without_tips(shape: shapely.Geometry, h: float) -> shapely.Geometry:
    """Cut long tips off where they are about 0.6 h wide, unless that costs much ground."""
    radius = 0.3 * h
    lost = polygons_of(shape.difference(shape.buffer(-radius).buffer(radius)))
    long = [g for g in lost if g.area > 1e-6 and _half_perimeter(g) > 0.9 * h]
    if not long:
        return shape
    cut = shape.difference(
        shapely.union_all(long).buffer(0.01 * h, join_style="mitre")
    ).simplify(h / 50)
    return cut if cut.area > 0.85 * shape.area else shape


def _half_perimeter(polygon: Polygon) -> float:
    """Return half the perimeter of the smallest rectangle around a polygon, metres."""
    return float(polygon.minimum_rotated_rectangle.length) / 2


def _chamfered(points: FloatArray, h: float, keep: FloatArray) -> FloatArray:
    """Cut convex corners sharper than 40 degrees where they are 0.55 h wide."""
    result: list[FloatArray] = []
    n = len(points)
    for i in range(n):
        before, here, after = points[i - 1], points[i], points[(i + 1) % n]
        u, v = before - here, after - here
        lu, lv = float(np.hypot(*u)), float(np.hypot(*v))
        cosine = float(u @ v) / (lu * lv + 1e-12)
        angle = float(np.arccos(np.clip(cosine, -1, 1)))
        convex = v[0] * u[1] - v[1] * u[0] > 0
        held = len(keep) and float(np.hypot(*(keep - here).T).min()) < 0.3 * h
        if convex and angle < SHARP and not held:
            back = TIP_WIDTH * h / (2 * np.sin(max(angle, 1e-3) / 2))
            result += [here + u / lu * min(back, 0.8 * lu), here + v / lv * min(back, 0.8 * lv)]
        else:
            result.append(here)
    return np.array(result)


def total_area(polygons: Iterable[Polygon]) -> float:
    """Return the sum of the areas, square metres."""
    return float(sum(p.area for p in polygons))
