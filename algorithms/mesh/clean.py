"""Bring a real site to a form that quads of a given size can fill."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from .quadmesh import FloatArray

LEAST_PART = 0.8
"""Area under which a part of a site is dropped, in squares of the edge length."""
PLAIN_PART = 1.5
"""Area up to which a part must be nearly rectangular, in squares of the edge length."""
RECTANGULAR = 0.8
LEAST_HOLE = 0.3
LEAST_TIP = 0.03
LARGEST_TIP = 0.6
TIP_WIDTH = 0.65
MITRE = 1.5


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
    options: dict[str, str | float] = {"join_style": "mitre", "mitre_limit": 3.0}
    closed = _buffers(source, (radius, -radius), **options)
    opened = _buffers(closed, (-radius, radius), **options)
    held = [p for p in polygons_of(closed.difference(opened)) if _holds(p, keep, h)]
    shape = shapely.union_all([opened, *held]).simplify(min(h / 100, 0.5))
    shape = _without_tips(shape, h, keep)
    parts = []
    for part in polygons_of(shape):
        if not _worth_a_mesh(part, h):
            continue
        large = [ring for ring in part.interiors if Polygon(ring).area > LEAST_HOLE * h * h]
        parts.append(orient(Polygon(part.exterior, large), 1.0))
    union = shapely.union_all(parts)
    return CleanSite(tuple(parts), float(union.symmetric_difference(source).area / source.area))


def _buffers(
    shape: shapely.Geometry, distances: Sequence[float], **style: str | float
) -> shapely.Geometry:
    """Buffer a shape several times over.

    Mitres of nearly straight corners divide by zero inside the library, which is harmless.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for distance in distances:
            shape = shapely.buffer(shape, distance, **style)
    return shape


def _without_tips(shape: shapely.Geometry, h: float, keep: FloatArray) -> shapely.Geometry:
    """Cut tips sharper than about 45 degrees off where they are 0.3 to 0.5 h wide.

    A tip is what an opening with limited mitres takes away in one place (a right angle
    stays, its mitre is 1.41 long); a neck borders on
    what is left in two. Tips with a point that must be kept stay.
    """
    radius = TIP_WIDTH * h / 2
    mitre: dict[str, str | float] = {"join_style": "mitre", "mitre_limit": MITRE}
    opened = _buffers(shape, (-radius, radius), **mitre)
    tips = []
    for piece in polygons_of(shape.difference(opened)):
        if not LEAST_TIP * h * h <= piece.area <= LARGEST_TIP * h * h:
            continue
        border = shapely.line_merge(piece.boundary.intersection(_buffers(opened, (0.01 * h,))))
        if (
            not _holds(piece, keep, h)
            and len(shapely.get_parts(border)) <= 1 + piece.boundary.is_closed
        ):
            tips.append(piece)
    if not tips:
        return shape
    cut = shape.difference(shapely.union_all(tips))
    return _buffers(cut, (-1e-3 * h, 1e-3 * h), **mitre)


def _worth_a_mesh(part: Polygon, h: float) -> bool:
    """Tell whether a part is large enough, or small and nearly rectangular."""
    if part.area < LEAST_PART * h * h:
        return False
    box = float(part.minimum_rotated_rectangle.area)
    return bool(part.area >= PLAIN_PART * h * h or part.area > RECTANGULAR * box)


def _holds(piece: Polygon, keep: FloatArray, h: float) -> bool:
    """Tell whether a point that must be kept lies at a piece."""
    return len(keep) > 0 and float(shapely.distance(piece, shapely.points(keep)).min()) < 0.1 * h
