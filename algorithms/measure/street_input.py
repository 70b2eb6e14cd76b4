"""Layers of streets in any state as the measures read them, with a record of what is wrong."""

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
from ..site.crs import layer_crs
from ..site.repair import Problems
from ..site.watch import aside, ask
from .graph import IntArray
from .layers import StreetLayer, read_streets

#: What goes on here, for those who cancel it.
_WORK = "the streets were read"
#: Types of geometry that are lines; a collection may hold some.
LINEAR = tuple(
    int(kind)
    for kind in (
        shapely.GeometryType.LINESTRING,
        shapely.GeometryType.LINEARRING,
        shapely.GeometryType.MULTILINESTRING,
    )
)
_COLLECTION = int(shapely.GeometryType.GEOMETRYCOLLECTION)


@dataclass(frozen=True, eq=False)
class MeasuredLayer:
    """The n features of a layer of streets, as a graph of e edges.

    Attributes
    ----------
    streets
        The graph and what fields say.
    feature
        Shape (e,). Position of the feature that each edge is a piece of.
    lines
        Shape (n,). What is line of each feature, in the working CRS; None where nothing is.
    same_as
        Shape (n,). Position of the first feature with the same geometry: mostly its own.
    problems
        What was left out, repaired or is doubtful.
    """

    streets: StreetLayer
    feature: IntArray
    lines: npt.NDArray[Any]
    same_as: IntArray
    problems: Problems

    @property
    def crs(self) -> CRS:
        """Working CRS, in metres."""
        return self.streets.crs


def read_measured(
    frame: gpd.GeoDataFrame, layer: str, progress: Progress | None = None
) -> MeasuredLayer:
    """Read a layer of streets, keeping account of every feature.

    Features of the same geometry, in either direction, are one street: they are measured once.

    Parameters
    ----------
    frame
        Lines in any CRS; the index holds the feature ids. Not changed.
    layer
        Name of the layer, for messages.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    InputError
        If the layer has no CRS, coordinates that do not fit it, or no line at all.
    CancelledError
        If the caller cancels.
    """
    source = layer_crs(frame, layer)
    problems = Problems()
    given = lines_of(frame.geometry)
    ask(progress, _WORK)
    _note_unusable(frame, given, layer, source, problems)
    usable = np.flatnonzero(~shapely.is_missing(given))
    if not len(usable):
        raise InputError("has no lines.", "Choose a layer of street lines.", layer=layer)
    same_as = aside(_first_of_same, given, progress, work=_WORK)
    kept = usable[same_as[usable] == usable]
    names = frame.index.astype(str).to_numpy()
    for k in usable[same_as[usable] != usable].tolist():
        text = f"is drawn on the whole length of street {names[same_as[k]]}"
        problems.add(layer, names[k], text, "counted once", "warning", given[k], source)
    table = frame.iloc[kept].reset_index(drop=True)
    table = table.set_geometry(gpd.GeoSeries(given[kept], crs=source))
    ask(progress, _WORK)
    streets = read_streets(table, layer, progress)
    ask(progress, _WORK)
    at = kept[np.array(streets.names, dtype=np.int64)]
    moved = np.full(len(frame), None, dtype=object)
    flat = gpd.GeoSeries(shapely.force_2d(given[usable]), crs=source)
    moved[usable] = flat.to_crs(streets.crs).to_numpy()
    feature = at[streets.graph.street]
    lost = np.setdiff1d(kept, feature)
    for k in lost.tolist():
        text = "is shorter than 0.5 m, or its ends are one place"
        problems.add(layer, names[k], text, "length only", "warning", given[k], source)
    _note_conflicts(streets, names[at], layer, problems)
    return MeasuredLayer(streets, feature, moved, same_as, problems)


def lines_of(geometries: gpd.GeoSeries) -> npt.NDArray[Any]:
    """Give what is line of each geometry, shape (n,); None where nothing is, or not finite.

    Parameters
    ----------
    geometries
        Any geometries, shape (n,).
    """
    found = np.array(geometries.to_numpy(), dtype=object)
    kind = shapely.get_type_id(found)
    for k in np.flatnonzero(kind == _COLLECTION).tolist():
        parts = [p for p in shapely.get_parts(found[k]) if shapely.get_type_id(p) in LINEAR]
        parts = [p for part in parts for p in shapely.get_parts(part)]
        found[k] = shapely.MultiLineString(parts) if parts else None
    kind = shapely.get_type_id(found)
    good = np.isin(kind, LINEAR) & (shapely.length(found) > 0)
    good &= np.isfinite(shapely.bounds(found)).all(axis=1)
    found[~good] = None
    return found


def _note_unusable(
    frame: gpd.GeoDataFrame, lines: npt.NDArray[Any], layer: str, crs: CRS, problems: Problems
) -> None:
    for k in np.flatnonzero(shapely.is_missing(lines)).tolist():
        shape = frame.geometry.iloc[k]
        if shape is None or shape.is_empty:
            text = f"geometry is {'NULL' if shape is None else 'EMPTY'}"
        elif shapely.get_type_id(shape) in LINEAR:
            text = "geometry is not finite or has no length"
        else:
            text = f"geometry is a {shape.geom_type}, not a line"
        problems.add(layer, frame.index[k], text, "not measured", "warning", None, crs)


def _first_of_same(lines: npt.NDArray[Any]) -> IntArray:
    """Position of the first line that is the same, in any direction, shape (n,)."""
    texts = shapely.to_wkb(shapely.normalize(shapely.force_2d(lines)), hex=True)
    seen: dict[str, int] = {}
    return np.array(
        [k if text is None else seen.setdefault(text, k) for k, text in enumerate(texts)],
        dtype=np.int64,
    )


def _note_conflicts(
    streets: StreetLayer, names: npt.NDArray[Any], layer: str, problems: Problems
) -> None:
    """Tell of streets that cross without a junction, or run on top of each other."""
    for conflict in streets.graph.crossings:
        one, other = (names[k] for k in conflict.streets)
        text = f"crosses street {other} without a junction"
        text = "crosses itself without a junction" if one == other else text
        done = "no junction counted: right for a bridge, else cut the lines or add a vertex to both"
        problems.add(layer, one, text, done, "info", conflict.geometry, streets.crs)
    for conflict in streets.graph.overlaps:
        one, other = (names[k] for k in conflict.streets)
        text = f"runs on top of street {other} for {conflict.geometry.length:.0f} m"
        done = "counted twice; delete one of them"
        problems.add(layer, one, text, done, "warning", conflict.geometry, streets.crs)
