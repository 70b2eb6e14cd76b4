"""Polygons in any state in, valid simple polygons out, with a record of every repair."""

from __future__ import annotations

from typing import Any, Callable

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from shapely.geometry import Polygon

from ..progress import Progress
from .watch import ask, in_chunks

GRID = 1e-3
"""Side of the grid to which site coordinates are rounded, metres."""

NO_AREA = 1e-4
"""Polygons of less than this are taken to have no area, square metres."""

POLYGON_TYPE = 3
"""Shapely's number of the geometry type polygon."""

_MULTI_POLYGON = 6
_COLLECTION = 7

Geometries = npt.NDArray[Any]


class Problems:
    """Collects findings, one row each, with the geometry in its own CRS."""

    def __init__(self) -> None:
        self._rows: list[tuple[str, str, str, str, str]] = []
        self._geometries: list[shapely.Geometry | None] = []
        self._crs: list[CRS] = []

    def __len__(self) -> int:
        """Count the rows."""
        return len(self._rows)

    def add(
        self,
        layer: str,
        feature: object,
        problem: str,
        action: str,
        severity: str,
        geometry: shapely.Geometry | None,
        crs: CRS,
    ) -> None:
        """Note one finding.

        Parameters
        ----------
        layer
            Name of the layer.
        feature
            Id of the feature.
        problem
            What was found.
        action
            What was done about it, or what the planner should do.
        severity
            "info", "warning" or "error".
        geometry
            Where it is, or None.
        crs
            CRS of `geometry`.
        """
        self._rows.append((layer, str(feature), problem, action, severity))
        self._geometries.append(geometry)
        self._crs.append(crs)

    def extend(self, other: Problems) -> None:
        """Take over the findings of another collection.

        Parameters
        ----------
        other
            Its rows are added after the own ones.
        """
        self._rows += other._rows
        self._geometries += other._geometries
        self._crs += other._crs

    def to_frame(self, crs: CRS) -> gpd.GeoDataFrame:
        """Give the findings as a layer.

        Parameters
        ----------
        crs
            CRS of the layer.

        Returns
        -------
        geopandas.GeoDataFrame
            Columns layer, feature, problem, action, severity and the geometry.
        """
        columns = ["layer", "feature", "problem", "action", "severity"]
        data = {c: [row[k] for row in self._rows] for k, c in enumerate(columns)}
        geometry = np.array(self._geometries, dtype=object)
        for own in set(self._crs):
            which = np.array([c == own for c in self._crs])
            if own != crs:
                moved = gpd.GeoSeries(geometry[which], crs=own).to_crs(crs)
                geometry[which] = moved.to_numpy()
        series = gpd.GeoSeries(geometry, crs=crs)
        return gpd.GeoDataFrame(data, geometry=series, columns=[*columns, "geometry"], crs=crs)


def repair_polygons(
    geometries: Geometries,
    ids: Geometries,
    layer: str,
    crs: CRS,
    problems: Problems,
    progress: Progress | None = None,
) -> tuple[Geometries, Geometries]:
    """Turn the geometries of a layer into valid single polygons on the grid.

    Parameters
    ----------
    geometries
        Shape (n,), any geometry or None, metres in `crs`.
    ids
        Feature ids, shape (n,).
    layer
        Name of the layer.
    crs
        CRS of the geometries.
    problems
        Takes the findings.
    progress
        Asked for cancellation, or None.

    Returns
    -------
    polygons : ndarray
        Shape (m,), valid polygons with an area, in the order of the input.
    ids : ndarray
        Feature id of each, shape (m,).

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    geometries, ids = _drop_unusable(geometries, ids, layer, crs, problems)
    for i in np.flatnonzero(~in_chunks(shapely.is_valid, geometries, progress)):
        ask(progress)
        reason = f"invalid: {shapely.is_valid_reason(geometries[i])}"
        problems.add(layer, ids[i], reason, "made valid", "info", geometries[i], crs)
        geometries[i] = make_valid(geometries[i])
    ask(progress)
    parts, origin = _polygon_parts(geometries)
    count = np.bincount(origin, minlength=len(geometries))
    for i in np.flatnonzero(count > 1):
        what = f"has {count[i]} parts"
        problems.add(layer, ids[i], what, "split into its parts", "info", geometries[i], crs)
    snapped, origin = _snap(parts, origin, ids, layer, crs, problems, progress)
    ask(progress)
    for i in np.setdiff1d(np.arange(len(geometries)), origin):
        problems.add(layer, ids[i], "has no area", "skipped", "error", geometries[i], crs)
    return snapped, ids[origin]


def rounded(geometry: Any) -> Any:
    """Round to the grid, keeping the result valid.

    The grid is not kept as a property of the geometry: later operations then work in
    floating point, which is faster and does the same to a geometry read again from a file.

    Parameters
    ----------
    geometry
        Geometry or array of geometries.

    Returns
    -------
    shapely.Geometry or ndarray
        The same, on the grid.
    """
    return shapely.set_precision(shapely.set_precision(geometry, GRID), 0)


def overlay(operation: Callable[..., Any], a: Any, b: Any) -> Any:
    """Apply an overlay of two geometries or arrays; on the grid where plain numbers fail.

    Parameters
    ----------
    operation
        `shapely.difference`, `shapely.intersection` or `shapely.union`.
    a, b
        Geometries or arrays of them.

    Returns
    -------
    shapely.Geometry or ndarray
        The result.
    """
    try:
        return operation(a, b)
    except shapely.errors.GEOSException:
        # a mitred buffer may cross itself by a hair
        return operation(shapely.buffer(a, 0), shapely.buffer(b, 0), grid_size=GRID)


def make_valid(geometry: shapely.Geometry) -> shapely.Geometry:
    """Make an areal geometry valid: the union of its shells less its holes.

    Unlike GEOS's line work method a hole that sticks out of its shell adds nothing.

    Parameters
    ----------
    geometry
        Polygon, multipolygon or collection.

    Returns
    -------
    shapely.Geometry
        Valid areal geometry, perhaps empty.
    """
    result = []
    for polygon in _polygon_parts(np.array([geometry], dtype=object))[0]:
        shell = shapely.make_valid(Polygon(polygon.exterior))
        holes = [shapely.make_valid(Polygon(ring)) for ring in polygon.interiors]
        area = shapely.difference(_areal(shell), shapely.union_all([_areal(h) for h in holes]))
        result.append(_areal(area))
    return shapely.union_all(result)


def _areal(geometry: shapely.Geometry) -> shapely.Geometry:
    parts, _ = _polygon_parts(np.array([geometry], dtype=object))
    return shapely.union_all(parts)


def _polygon_parts(geometries: Geometries) -> tuple[Geometries, npt.NDArray[np.intp]]:
    """All polygons in the geometries, with the index of the geometry that each is from."""
    parts, origin = shapely.get_parts(geometries, return_index=True)
    nested, again = shapely.get_parts(parts, return_index=True)  # collections hold multiparts
    keep = shapely.get_type_id(nested) == POLYGON_TYPE
    return nested[keep], origin[again[keep]]


def _drop_unusable(
    geometries: Geometries, ids: Geometries, layer: str, crs: CRS, problems: Problems
) -> tuple[Geometries, Geometries]:
    """Leave out what is missing, empty, not a polygon or not finite; drop Z and M."""
    empty = shapely.is_missing(geometries) | shapely.is_empty(geometries)
    for i in np.flatnonzero(empty):
        what = "NULL" if geometries[i] is None else "EMPTY"
        problems.add(layer, ids[i], f"geometry is {what}", "skipped", "error", None, crs)
    kind = shapely.get_type_id(geometries)
    other = ~empty & ~np.isin(kind, (POLYGON_TYPE, _MULTI_POLYGON, _COLLECTION))
    for i in np.flatnonzero(other):
        what = f"geometry is a {geometries[i].geom_type}, not a polygon"
        problems.add(layer, ids[i], what, "skipped", "error", geometries[i], crs)
    usable = ~empty & ~other
    bounds = shapely.bounds(geometries)
    infinite = usable & ~np.all(np.isfinite(bounds), axis=1)
    for i in np.flatnonzero(infinite):
        what = "coordinates are not finite or do not fit the CRS"
        problems.add(layer, ids[i], what, "skipped", "error", None, crs)
    usable &= ~infinite
    geometries, ids = geometries[usable], ids[usable]
    raised = shapely.has_z(geometries)
    if np.any(raised):
        first = int(np.flatnonzero(raised)[0])
        what = f"{int(raised.sum())} features have heights (Z), this is the first"
        problems.add(layer, ids[first], what, "heights dropped", "info", None, crs)
    return shapely.force_2d(geometries), ids


def _snap(
    parts: Geometries,
    origin: npt.NDArray[np.intp],
    ids: Geometries,
    layer: str,
    crs: CRS,
    problems: Problems,
    progress: Progress | None,
) -> tuple[Geometries, npt.NDArray[np.intp]]:
    """Round to the grid; report vertices that fall together and parts that vanish."""
    before = shapely.get_num_coordinates(parts)
    snapped = in_chunks(rounded, parts, progress)
    after = shapely.get_num_coordinates(snapped)
    area = shapely.area(snapped)
    for i in np.flatnonzero((after < before) & (area > NO_AREA)):
        what = f"{before[i] - after[i]} vertices coincide or lie on a spike"
        problems.add(layer, ids[origin[i]], what, "removed", "info", parts[i], crs)
    pieces, again = shapely.get_parts(snapped, return_index=True)
    keep = shapely.area(pieces) > NO_AREA
    return pieces[keep], origin[again[keep]]
