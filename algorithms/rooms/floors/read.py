"""Layers of a building as shapes in one working CRS, each with its storey."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from ...errors import InputError
from ...progress import Progress
from ...site.crs import layer_crs, working_crs
from ...site.repair import Problems, repair_polygons
from .types import Feature, Remark

WHOLE = 0.99
"""Share of a repaired footprint that its largest piece must hold."""


@dataclass(frozen=True)
class Part:
    """A shape of a layer.

    Attributes
    ----------
    feature
        Id of its feature.
    storey
        Storey, None for all.
    shape
        Point, LineString or Polygon, metres in the working CRS.
    """

    feature: Feature
    storey: int | None
    shape: BaseGeometry


@dataclass(frozen=True)
class PolygonPart(Part):
    """A polygon of a layer."""

    shape: Polygon


@dataclass(frozen=True)
class PointPart(Part):
    """A point of a layer."""

    shape: Point


@dataclass(frozen=True)
class LinePart(Part):
    """A line of a layer."""

    shape: LineString


def metric_crs(frame: gpd.GeoDataFrame, layer: str) -> tuple[CRS, CRS]:
    """Choose the CRS in which a layer is worked on.

    Returns
    -------
    tuple of CRS
        The working CRS in metres and the layer's own.

    Raises
    ------
    InputError
        If the layer is empty, has no CRS, or its coordinates do not fit it.
    """
    source = layer_crs(frame, layer)
    bounds = np.asarray(frame.total_bounds, dtype=float)
    if len(frame) == 0 or not np.isfinite(bounds).all():
        raise InputError("It has no shapes.", "Choose a layer with features.", layer=layer)
    return working_crs(source, bounds, layer), source


def storeys_in(frames: Sequence[tuple[gpd.GeoDataFrame | None, str]], field: str) -> list[int]:
    """Return the storeys that are named in layers, ascending.

    Raises
    ------
    InputError
        If a value is no whole number.
    """
    found: set[int] = set()
    for frame, layer in frames:
        if frame is not None:
            found.update(s for s in _storeys(frame, layer, field) if s is not None)
    return sorted(found)


def read_footprints(
    frame: gpd.GeoDataFrame,
    layer: str,
    field: str,
    crs: CRS,
    remarks: list[Remark],
    progress: Progress | None,
) -> list[PolygonPart]:
    """Read footprints.

    Parameters
    ----------
    frame, layer, field
        The layer, its name and its field with the storey.
    crs
        Working CRS.
    remarks
        Takes what was repaired.
    progress
        Asked for cancellation.

    Raises
    ------
    InputError
        If a footprint has several parts, or no footprint can be used.
    """
    shapes = _moved(frame, layer, crs)
    for at, shape in enumerate(shapes):
        parts = 0 if shape is None else sum(not p.is_empty for p in shapely.get_parts(shape))
        if parts > 1:
            raise InputError(
                f"It has {parts} parts; a footprint is one piece.",
                "Split it into single parts (Multipart to singleparts).",
                layer=layer,
                feature=_name(frame, at),
            )
    found = _repaired(frame, shapes, layer, field, crs, remarks, progress)
    whole: dict[Feature, list[PolygonPart]] = {}
    for part in found:
        whole.setdefault(part.feature, []).append(part)
    kept = []
    for feature, rest in whole.items():
        largest = max(rest, key=lambda part: part.shape.area)
        if largest.shape.area < WHOLE * sum(part.shape.area for part in rest):
            raise InputError(
                f"Its outline crosses itself, so that it encloses {len(rest)} pieces.",
                "Redraw its outline as one ring.",
                layer=layer,
                feature=feature,
            )
        kept.append(largest)
    if not kept:
        raise InputError(
            "It holds no polygon with an area.", "Draw the footprint of the building.", layer=layer
        )
    return kept


def read_polygons(
    frame: gpd.GeoDataFrame | None,
    layer: str,
    field: str,
    crs: CRS,
    remarks: list[Remark],
    progress: Progress | None,
) -> list[PolygonPart]:
    """Read polygons such as obstacles; arguments as of `read_footprints`, None for no layer."""
    if frame is None:
        return []
    shapes = _moved(frame, layer, crs)
    return _repaired(frame, shapes, layer, field, crs, remarks, progress)


def read_points(
    frame: gpd.GeoDataFrame | None, layer: str, field: str, crs: CRS
) -> list[PointPart]:
    """Read points; None for no layer.

    Raises
    ------
    InputError
        If a feature is something else.
    """
    return [PointPart(*row) for row in _simple(frame, layer, field, crs, Point, "point")]


def read_lines(frame: gpd.GeoDataFrame | None, layer: str, field: str, crs: CRS) -> list[LinePart]:
    """Read lines; None for no layer.

    Raises
    ------
    InputError
        If a feature is something else.
    """
    return [LinePart(*row) for row in _simple(frame, layer, field, crs, LineString, "line")]


def _simple(
    frame: gpd.GeoDataFrame | None, layer: str, field: str, crs: CRS, kind: type[Any], word: str
) -> list[tuple[Feature, int | None, Any]]:
    """Return the parts of a layer that holds shapes of one kind."""
    if frame is None:
        return []
    found = []
    storeys = _storeys(frame, layer, field)
    for at, shape in enumerate(_moved(frame, layer, crs)):
        if shape is None or shape.is_empty:
            continue
        for part in shapely.get_parts(shapely.force_2d(shape)):
            if not isinstance(part, kind) or not np.isfinite(part.bounds).all():
                raise InputError(
                    f"It is a {part.geom_type}, not a {word} with usable coordinates.",
                    f"Choose a layer of {word}s.",
                    layer=layer,
                    feature=_name(frame, at),
                )
            found.append((_name(frame, at), storeys[at], part))
    return found


def _moved(frame: gpd.GeoDataFrame, layer: str, crs: CRS) -> Any:
    """Return the layer's shapes in the working CRS; the layer is left as it is."""
    source = layer_crs(frame, layer)
    shapes = np.asarray(frame.geometry.array, dtype=object).copy()
    if source == crs or not len(shapes):
        return shapes
    return np.asarray(gpd.GeoSeries(shapes, crs=source).to_crs(crs).array, dtype=object).copy()


def _repaired(
    frame: gpd.GeoDataFrame,
    shapes: Any,
    layer: str,
    field: str,
    crs: CRS,
    remarks: list[Remark],
    progress: Progress | None,
) -> list[PolygonPart]:
    """Return sound polygons, and tell what was done to them."""
    storeys = _storeys(frame, layer, field)
    problems = Problems()
    polygons, row = repair_polygons(shapes, np.arange(len(shapes)), layer, crs, problems, progress)
    for own in problems.to_frame(crs).itertuples():
        shape = Point() if own.geometry is None else own.geometry
        text = f"Layer '{layer}', feature {_name(frame, int(own.feature))}: {own.problem}."
        remarks.append(Remark(text, f"It was {own.action}.", own.severity, shape))
    return [
        PolygonPart(_name(frame, at), storeys[at], polygon)
        for polygon, at in zip(polygons, row.tolist())
    ]


def _storeys(frame: gpd.GeoDataFrame, layer: str, field: str) -> list[int | None]:
    """Return the storey of every feature, None for all."""
    if field not in frame.columns:
        return [None] * len(frame)
    found: list[int | None] = []
    for at, value in enumerate(frame[field]):
        empty = value is None or value is pd.NA or value is pd.NaT or str(value).strip() == ""
        if empty or (isinstance(value, float) and math.isnan(value)):
            found.append(None)
            continue
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not math.isfinite(number) or number != math.floor(number):
            raise InputError(
                f"Its field '{field}' is '{value}', not a whole number.",
                "Give the number of a storey, or leave it empty for all storeys.",
                layer=layer,
                feature=_name(frame, at),
            )
        found.append(int(number))
    return found


def _name(frame: gpd.GeoDataFrame, at: int) -> Feature:
    """Return the id of a row."""
    name = frame.index[at]
    return name if isinstance(name, str) else int(name)
