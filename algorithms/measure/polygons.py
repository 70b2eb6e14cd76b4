"""Layers of polygons as the measures read them: one shape per feature, repairs reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from ..errors import InputError
from ..progress import Progress
from ..site.crs import layer_crs, working_crs
from ..site.repair import NO_AREA, Problems, make_valid
from ..site.watch import aside, in_chunks
from .parcel_shape import Floats, rectangles

#: What goes on here, for those who cancel it.
_WORK = "the polygons were read"
#: Types of geometry that are polygons; a collection may hold some.
AREAL = (int(shapely.GeometryType.POLYGON), int(shapely.GeometryType.MULTIPOLYGON))
_COLLECTION = int(shapely.GeometryType.GEOMETRYCOLLECTION)


@dataclass(frozen=True, eq=False)
class PolygonLayer:
    """The polygons of a layer in metres.

    Attributes
    ----------
    shapes
        Valid polygons of one or several parts, shape (n,), one for each feature; None where
        there is none to measure.
    crs, source_crs
        Working CRS, and that of the layer.
    problems
        What was left out or repaired.
    name
        Name of the layer.
    """

    shapes: npt.NDArray[Any]
    crs: CRS
    source_crs: CRS
    problems: Problems
    name: str

    @property
    def usable(self) -> npt.NDArray[np.bool_]:
        """Which features can be measured, shape (n,)."""
        return np.asarray(~shapely.is_missing(self.shapes))


def read_polygons(
    frame: gpd.GeoDataFrame, layer: str, crs: CRS | None = None, progress: Progress | None = None
) -> PolygonLayer:
    """Read a layer of polygons.

    Parameters
    ----------
    frame
        Polygons in any CRS; the index holds the feature ids. Not changed.
    layer
        Name of the layer, for messages.
    crs
        Working CRS; None: the one that suits the layer.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    InputError
        If the layer has no CRS, has coordinates that do not fit it, or has no polygon at all.
    CancelledError
        If the caller cancels.
    """
    source = layer_crs(frame, layer)
    problems = Problems()
    given = np.array(frame.geometry.to_numpy(), dtype=object)
    kind = shapely.get_type_id(given)
    empty = shapely.is_missing(given) | shapely.is_empty(given)
    areal = np.isin(kind, (*AREAL, _COLLECTION)) & ~empty
    areal &= np.isfinite(shapely.bounds(given)).all(axis=1)
    for k in np.flatnonzero(~areal).tolist():
        what = "not finite" if kind[k] in AREAL else f"a {getattr(given[k], 'geom_type', '')}"
        what = ("NULL" if given[k] is None else "EMPTY") if empty[k] else what
        text = f"geometry is {what}" + ("" if empty[k] or kind[k] in AREAL else ", not a polygon")
        problems.add(layer, frame.index[k], text, "not measured", "warning", None, source)
    if not areal.any():
        raise InputError("has no polygons.", "Choose a layer of polygons.", layer=layer)
    flat = shapely.force_2d(given[areal])
    whole = np.asarray(shapely.total_bounds(flat))
    own = working_crs(source, whole, layer) if crs is None else crs
    moved = flat if own == source else gpd.GeoSeries(flat, crs=source).to_crs(own).to_numpy()
    shapes = np.full(len(given), None, dtype=object)
    rows = np.flatnonzero(areal)
    good = in_chunks(shapely.is_valid, moved, progress, work=_WORK)
    good &= shapely.get_type_id(moved) != _COLLECTION
    moved = np.array(moved, dtype=object)
    for k in np.flatnonzero(~good).tolist():
        reason = shapely.is_valid_reason(flat[k])
        moved[k] = make_valid(moved[k])
        text = "is a collection" if reason == "Valid Geometry" else f"invalid: {reason}"
        label = frame.index[rows[k]]
        problems.add(layer, label, text, "measured as made valid", "info", flat[k], source)
    area = shapely.area(moved)
    for k in np.flatnonzero(~(area > NO_AREA)).tolist():
        label = frame.index[rows[k]]
        problems.add(layer, label, "has no area", "not measured", "warning", flat[k], source)
        moved[k] = None
    shapes[rows] = moved
    if shapely.is_missing(shapes).all():
        raise InputError("has no polygons.", "Choose a layer of polygons.", layer=layer)
    return PolygonLayer(shapes, own, source, problems, layer)


def read_shapes(frame: gpd.GeoDataFrame | None, crs: CRS, layer: str) -> npt.NDArray[Any] | None:
    """Give the valid lines and polygons of a layer in the working CRS; None for no layer.

    Parameters
    ----------
    frame
        Any layer, or None.
    crs
        Working CRS.
    layer
        Name of the layer, for messages.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    if frame is None:
        return None
    layer_crs(frame, layer)
    shapes = shapely.force_2d(frame.geometry.to_crs(crs).to_numpy())
    shapes = shapes[~shapely.is_missing(shapes) & ~shapely.is_empty(shapes)]
    shapes = shapes[np.isfinite(shapely.bounds(shapes)).all(axis=1)]
    areal = np.isin(shapely.get_type_id(shapes), (*AREAL, _COLLECTION))
    wrong = np.flatnonzero(areal & ~shapely.is_valid(shapes))
    for k in wrong.tolist():
        shapes[k] = make_valid(shapes[k])
    return np.asarray(shapes, dtype=object)


def areas_of(geometries: gpd.GeoSeries) -> npt.NDArray[Any]:
    """Give what is polygon of each geometry, shape (n,): of others nothing, None.

    Parameters
    ----------
    geometries
        Any geometries, shape (n,).
    """
    found = np.array(geometries.to_numpy(), dtype=object)
    kind = shapely.get_type_id(found)
    for k in np.flatnonzero(~np.isin(kind, (-1, *AREAL))).tolist():
        parts = [p for p in shapely.get_parts(found[k]) if shapely.get_type_id(p) in AREAL]
        found[k] = shapely.MultiPolygon(shapely.get_parts(parts).tolist()) if parts else None
    return found


def largest_parts(shapes: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Give the largest polygon of each geometry, shape (n,); None where there is none.

    Parameters
    ----------
    shapes
        Polygons of one or several parts, or None, shape (n,).
    """
    parts, owner = shapely.get_parts(shapes, return_index=True)
    found = np.full(len(shapes), None, dtype=object)
    order = np.argsort(shapely.area(parts), kind="stable")
    # what comes later, and is larger, stays
    found[owner[order]] = parts[order]
    return found


def block_sizes(polygons: npt.NDArray[Any]) -> tuple[Floats, Floats]:
    """Width and length of blocks, shape (n,) each, metres.

    Parameters
    ----------
    polygons
        Polygons, shape (n,), metres.

    Returns
    -------
    width
        Area / length, so that a bent or pointed block is not flattered.
    length
        Longer side of the smallest enclosing rectangle.

    Examples
    --------
    >>> width, length = block_sizes(np.array([shapely.box(0, 0, 150, 72)]))
    >>> width.tolist(), length.tolist()
    ([72.0], [150.0])
    """
    length = rectangles(polygons)[1].max(axis=1)
    area = shapely.area(polygons)
    width = np.divide(area, length, out=np.zeros(len(length)), where=length > 0)
    return np.round(width, 6), np.round(length, 6)


def united(shapes: npt.NDArray[Any], progress: Progress | None = None) -> shapely.Geometry:
    """Unite polygons.

    Parameters
    ----------
    shapes
        Valid polygons, or None, shape (n,).
    progress
        Asked for cancellation, or None.
    """
    return aside(shapely.union_all, shapes[~shapely.is_missing(shapes)], progress, work=_WORK)


def closed(land: shapely.Geometry, gap: float) -> shapely.Geometry:
    """Fill what is narrow between polygons.

    Parameters
    ----------
    land
        Polygons, metres.
    gap
        Gaps up to this width are filled, metres.
    """
    # mitred, so that corners stay what they are
    wide = shapely.buffer(land, gap / 2, join_style="mitre")
    return shapely.buffer(wide, -gap / 2, join_style="mitre")
