"""QGIS features to GeoDataFrames and back; no other module touches both worlds."""

from __future__ import annotations

import contextlib
import datetime
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from qgis.core import (
    Qgis,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsFeatureRequest,
    QgsFeatureSink,
    QgsField,
    QgsFields,
    QgsGeometry,
    QgsProcessingFeatureSource,
    QgsRasterLayer,
    QgsRectangle,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QDate, QDateTime, QTime

from ..algorithms.errors import InputError
from . import compat
from .progress import FeedbackProgress

if TYPE_CHECKING:
    import geopandas

#: Features between two looks at the Cancel button.
CHUNK = 1000


class CancelledWhileReadingError(Exception):
    """The run was cancelled while a layer was read; there is nothing to keep."""


class SinkError(Exception):
    """An output layer refused features."""


def crs_text(crs: QgsCoordinateReferenceSystem) -> str | None:
    """Return a CRS as pyproj reads it, or None where the layer has none."""
    if not crs.isValid():
        return None
    if crs.authid().startswith("EPSG:"):
        return crs.authid()
    return crs.toWkt(QgsCoordinateReferenceSystem.WktVariant.WKT2_2019)


def _wkb(geometry: QgsGeometry) -> bytes | None:
    """Return well-known binary that GEOS reads: curves as segments, no measures."""
    if geometry.isNull():
        return None
    if QgsWkbTypes.isCurvedType(geometry.wkbType()):
        # Not convertToStraightSegment, which leaves curve types without curves as they are.
        geometry = QgsGeometry(geometry.constGet().segmentize())
    if QgsWkbTypes.hasM(geometry.wkbType()):
        geometry.get().dropMValue()
    return bytes(geometry.asWkb().data())


def _plain(value: Any) -> Any:
    """Return an attribute as a plain Python value."""
    if compat.is_null(value):
        return None
    if isinstance(value, (bool, int, float, str, datetime.date, datetime.time)):
        return value
    if hasattr(value, "toPyDateTime"):
        return value.toPyDateTime()
    if hasattr(value, "toPyDate"):
        return value.toPyDate()
    return str(value)


def read_source(source: QgsProcessingFeatureSource, progress: FeedbackProgress) -> Any:
    """Return the features of a source as a GeoDataFrame.

    Selection, filters and edits count as Processing applies them. Invalid geometries are read
    as they are, since the library repairs and reports them; curves become segments; measures
    are dropped; NULL geometries and attributes become None.

    Returns
    -------
    geopandas.GeoDataFrame
        The index is the feature id; the CRS is the source's, or None.

    Raises
    ------
    CancelledWhileReadingError
        The run was cancelled meanwhile.
    """
    import geopandas
    import pandas
    import shapely

    names = [field.name() for field in source.fields()]
    rows: list[list[Any]] = []
    wkb: list[bytes | None] = []
    ids: list[int] = []
    total = max(source.featureCount(), 1)
    features = source.getFeatures(QgsFeatureRequest(), compat.SKIP_VALIDITY_CHECK)
    for count, feature in enumerate(features):
        if count % CHUNK == 0:
            if progress.cancelled():
                raise CancelledWhileReadingError
            progress.fraction(count / total)
        rows.append([_plain(value) for value in feature.attributes()])
        wkb.append(_wkb(feature.geometry()))
        ids.append(feature.id())
    # A column that is called like the geometry must not replace it.
    names = [name if name != "geometry" else "geometry_field" for name in names]
    table = pandas.DataFrame(rows, columns=names, index=ids)
    shapes = shapely.from_wkb(wkb, on_invalid="ignore") if wkb else []
    return geopandas.GeoDataFrame(table, geometry=shapes, crs=crs_text(source.sourceCrs()))


#: A raster is read at no more than this many cells in each direction.
RASTER_CELLS = 2000


def read_raster(layer: QgsRasterLayer, around: QgsRectangle) -> Any:
    """Return the first band of a raster layer around a place as a `HeightGrid`, or None.

    Parameters
    ----------
    layer
        The raster.
    around
        Which part is read, in the CRS of the raster; fine rasters are read more coarsely.

    Returns
    -------
    HeightGrid or None
        None where the raster does not reach the place.

    Raises
    ------
    InputError
        The raster has no numbers that can be read; the text names it.
    """
    import numpy

    from ..algorithms.streets import HeightGrid

    step_x, step_y = layer.rasterUnitsPerPixelX(), layer.rasterUnitsPerPixelY()
    # whole cells, and one more on each side for what lies between the middles of cells
    whole = layer.extent()
    west, north = whole.xMinimum(), whole.yMaximum()
    part = QgsRectangle(
        west + step_x * (math.floor((around.xMinimum() - west) / step_x) - 1),
        north - step_y * (math.ceil((north - around.yMinimum()) / step_y) + 1),
        west + step_x * (math.ceil((around.xMaximum() - west) / step_x) + 1),
        north - step_y * (math.floor((north - around.yMaximum()) / step_y) - 1),
    ).intersect(whole)
    if part.isEmpty():
        return None
    columns = max(1, min(RASTER_CELLS, round(part.width() / step_x)))
    rows = max(1, min(RASTER_CELLS, round(part.height() / step_y)))
    block = layer.dataProvider().block(1, part, columns, rows)
    if not block.isValid() or not block.convert(Qgis.DataType.Float64):
        raise InputError(
            "Its first band has no numbers that can be read.",
            "Choose a raster of heights in metres, no picture and no map service.",
            layer=layer.name(),
        )
    values = numpy.frombuffer(bytes(block.data()), dtype=float).reshape(rows, columns).copy()
    if block.hasNoDataValue():
        values[values == block.noDataValue()] = numpy.nan
    return HeightGrid(
        values,
        part.xMinimum(),
        part.yMaximum(),
        part.width() / columns,
        part.height() / rows,
        crs_text(layer.crs()),
    )


def attributes(
    source: QgsProcessingFeatureSource,
    places: Sequence[int],
    frame: geopandas.GeoDataFrame,
    renewed: Sequence[str],
) -> dict[int, list[Any]]:
    """Return attributes of all features as they are in their layer, by their ids.

    Features that the layer does not have get those of `frame` that fit the fields.

    Parameters
    ----------
    source
        The layer.
    places
        Which of its fields.
    frame
        What was made of it; its index has the ids.
    renewed
        Fields of decimal numbers, in lower case, whose values come from `frame`.
    """
    request = QgsFeatureRequest().setFlags(compat.NO_GEOMETRY)
    features = source.getFeatures(request, compat.SKIP_VALIDITY_CHECK)
    found = {own.id(): [own.attribute(place) for place in places] for own in features}
    for at, place in enumerate(places):
        field = source.fields().at(place)
        name = field.name()
        decimal = field.type() == compat.FIELD_TYPES["number"]
        if name.lower() in renewed and decimal and name in frame.columns:
            for label, value in zip(frame.index, _cast(frame[name].tolist(), "number")):
                if label in found:
                    found[label][at] = value
    for label in frame.index:
        if label not in found:
            found[label] = [_fitting(source.fields().at(at), frame, label) for at in places]
    return found


def _fitting(field: QgsField, frame: geopandas.GeoDataFrame, label: int) -> Any:
    """Return the value of a feature for a field, None where there is none that fits."""
    value = frame.at[label, field.name()] if field.name() in frame.columns else None
    if value is None or value != value:
        return None
    if hasattr(value, "item"):
        value = value.item()
    # QGIS says in different ways that a value does not fit
    with contextlib.suppress(ValueError):
        fits = field.convertCompatible(value)
        return value if isinstance(fits, bool) and not isinstance(value, bool) else fits
    return None


def _moment(value: Any) -> QDateTime:
    """Return a moment without a time zone, so that it reads the same wherever QGIS runs."""
    day = QDate(value.year, value.month, value.day)
    return QDateTime(day, QTime(value.hour, value.minute, value.second))


_CASTS: dict[str, Callable[[Any], Any]] = {
    "integer": int,
    "number": float,
    "text": str,
    "yes/no": bool,
    "date and time": _moment,
}


def _cast(values: Sequence[Any], kind: str) -> list[Any]:
    """Return the values of a column as the kind of its field says; NaN becomes None."""
    cast = _CASTS[kind]
    # NaN is the one value that differs from itself; infinity has no place in a table either.
    return [
        None if value is None or value != value or value in _INFINITE else cast(value)
        for value in values
    ]


_INFINITE = (float("inf"), float("-inf"))


def _to_qgis(shape: bytes | None, geometry_type: Any) -> list[QgsGeometry]:
    """Return a geometry in the type of its sink, several where it has parts and may not."""
    geometry = QgsGeometry()
    if shape is not None:
        geometry.fromWkb(shape)
    if geometry.isEmpty():
        return [QgsGeometry()]
    return list(geometry.coerceToType(geometry_type))


def _as_points(shapes: Any) -> Any:
    """Return one point on each geometry: half way along a line, inside a polygon."""
    import numpy as np
    import shapely

    kinds = shapely.get_type_id(shapes)
    points = shapely.point_on_surface(shapes)
    lines = kinds == shapely.GeometryType.LINESTRING
    points[lines] = shapely.line_interpolate_point(shapes[lines], 0.5, normalized=True)
    return np.where(kinds == shapely.GeometryType.POINT, shapes, points)


def write_frame(
    frame: geopandas.GeoDataFrame,
    fields: QgsFields,
    kinds: Sequence[str],
    sink: QgsFeatureSink,
    geometry_type: Any,
    before: Mapping[int, Sequence[Any]] | None = None,
) -> None:
    """Write all rows of a GeoDataFrame into a sink, the declared fields only.

    Parameters
    ----------
    frame
        Columns that `fields` names and that are absent here are written as NULL.
    fields, kinds
        The fields of the sink and the kind of each, as in `compat.make_field`.
    sink
        Where the features go.
    geometry_type
        Geometry type of the sink. A sink of points takes one point of every other geometry, one
        of single geometries a feature for each part.
    before
        Attributes for the first fields, by the index of the frame; `kinds` are those of the rest.

    Raises
    ------
    SinkError
        The sink refused features, as on a full disk.
    """
    import numpy as np
    import shapely

    given = frame.geometry.to_numpy()
    if geometry_type == compat.WKB["Point"]:
        given = _as_points(given)
    # An empty geometry has no place; as NULL every format takes it.
    given = np.where(shapely.is_empty(given), None, given)
    shapes = shapely.to_wkb(given, include_srid=False, output_dimension=2)
    own = list(fields)[fields.count() - len(kinds) :]
    columns = [
        _cast(frame[field.name()].tolist(), kind)
        if field.name() in frame.columns
        else [None] * len(frame)
        for field, kind in zip(own, kinds)
    ]
    first = [[] if before is None else before[label] for label in frame.index]
    batch: list[QgsFeature] = []
    for row, shape in enumerate(shapes):
        for part in _to_qgis(shape, geometry_type):
            feature = QgsFeature(fields)
            feature.setGeometry(part)
            feature.setAttributes([*first[row], *(column[row] for column in columns)])
            batch.append(feature)
    if batch and not sink.addFeatures(batch, compat.FAST_INSERT):
        text = sink.lastError() if hasattr(sink, "lastError") else ""
        msg = text or "no reason given"
        raise SinkError(msg)
