"""One code base for QGIS 3.22 (Qt 5) to the newest (Qt 6): enumerations and field types.

Members of enumerations are always written with the name of their enumeration, since Qt 6 has
no others. Where QGIS has moved an enumeration to another class, `_first` takes the place that
the running version knows.
"""

from __future__ import annotations

from typing import Any

from qgis import core
from qgis.core import NULL, Qgis, QgsField
from qgis.PyQt.QtCore import QVariant

_QMETATYPE_FIELDS = 33800
_STYLE_CATEGORIES = 32600


def _first(*paths: str) -> Any:
    """Return what the first of the dotted names in `qgis.core` that exists stands for."""
    for path in paths:
        found: Any = core
        for part in path.split("."):
            found = getattr(found, part, None)
            if found is None:
                break
        else:
            return found
    msg = f"This version of QGIS has none of: {', '.join(paths)}"
    raise AttributeError(msg)


def _source(name: str) -> Any:
    return _first(f"Qgis.ProcessingSourceType.{name}", f"QgsProcessing.SourceType.Type{name}")


def _wkb(name: str) -> Any:
    return _first(f"Qgis.WkbType.{name}", f"QgsWkbTypes.Type.{name}")


SOURCE_POLYGON = _source("VectorPolygon")
SOURCE_LINE = _source("VectorLine")
SOURCE_POINT = _source("VectorPoint")
SOURCE_TABLE = _source("Vector")
#: What those are called.
SOURCE_NAMES = {SOURCE_POLYGON: "polygon", SOURCE_LINE: "line", SOURCE_POINT: "point"}

#: Geometry types of the output layers by the names that `fields` uses.
WKB = {
    name: _wkb(name)
    for name in (
        "Point", "LineString", "MultiLineString", "Polygon", "MultiPolygon", "NoGeometry",
    )
}  # fmt: skip

#: Geometry type of a layer that may hold any.
UNKNOWN = _wkb("Unknown")

NUMBER_FLOAT = _first(
    "Qgis.ProcessingNumberParameterType.Double", "QgsProcessingParameterNumber.Type.Double"
)
NUMBER_INTEGER = _first(
    "Qgis.ProcessingNumberParameterType.Integer", "QgsProcessingParameterNumber.Type.Integer"
)
#: Limits of a number that are this large are none.
NO_LIMIT = 1e300
ADVANCED = _first(
    "Qgis.ProcessingParameterFlag.Advanced", "QgsProcessingParameterDefinition.Flag.FlagAdvanced"
)
OPTIONAL = _first(
    "Qgis.ProcessingParameterFlag.Optional", "QgsProcessingParameterDefinition.Flag.FlagOptional"
)
NUMERIC_FIELD = _first(
    "Qgis.ProcessingFieldParameterDataType.Numeric", "QgsProcessingParameterField.DataType.Numeric"
)
ANY_FIELD = _first(
    "Qgis.ProcessingFieldParameterDataType.Any", "QgsProcessingParameterField.DataType.Any"
)
#: Sizes of symbols on the ground.
METRES_ON_GROUND = _first(
    "Qgis.RenderUnit.MetersInMapUnits", "QgsUnitTypes.RenderUnit.RenderMetersInMapUnits"
)
LINE_SYMBOL = _first("Qgis.SymbolType.Line", "QgsSymbol.SymbolType.Line")
#: Labels stand upright, anywhere inside their polygon.
LABEL_INSIDE = _first("Qgis.LabelPlacement.Horizontal", "QgsPalLayerSettings.Placement.Horizontal")
POSITIVE_NUMBER = _first("QgsPropertyDefinition.StandardPropertyTemplate.DoublePositive")
SKIP_VALIDITY_CHECK = _first(
    "Qgis.ProcessingFeatureSourceFlag.SkipGeometryValidityChecks",
    "QgsProcessingFeatureSource.Flag.FlagSkipGeometryValidityChecks",
)
FOLDER = _first(
    "Qgis.ProcessingFileParameterBehavior.Folder", "QgsProcessingParameterFile.Behavior.Folder"
)
FAST_INSERT = _first("QgsFeatureSink.Flag.FastInsert")
#: Features are read without their geometry.
NO_GEOMETRY = _first("Qgis.FeatureRequestFlag.NoGeometry", "QgsFeatureRequest.Flag.NoGeometry")
#: A feature of a layer exists from a moment on that a field tells.
TEMPORAL_INSTANT = _first(
    "Qgis.VectorTemporalMode.FeatureDateTimeInstantFromField",
    "QgsVectorLayerTemporalProperties.TemporalMode.ModeFeatureDateTimeInstantFromField",
)
METRES = _first("Qgis.DistanceUnit.Meters", "QgsUnitTypes.DistanceUnit.DistanceMeters")
#: A table that counts its features itself does so anew, whatever ids they bring.
COUNT_ANEW = _first("QgsFeatureSink.SinkFlag.RegeneratePrimaryKey")


def _field_types() -> dict[str, Any]:
    if Qgis.versionInt() >= _QMETATYPE_FIELDS:
        from qgis.PyQt.QtCore import QMetaType

        kinds = QMetaType.Type
        return {
            "integer": kinds.Int,
            "number": kinds.Double,
            "text": kinds.QString,
            "yes/no": kinds.Bool,
            "date and time": kinds.QDateTime,
        }
    return {
        "integer": QVariant.Type.Int,
        "number": QVariant.Type.Double,
        "text": QVariant.Type.String,
        "yes/no": QVariant.Type.Bool,
        "date and time": QVariant.Type.DateTime,
    }


FIELD_TYPES = _field_types()


def make_field(name: str, kind: str) -> QgsField:
    """Return a field of a kind: "integer", "number", "text", "yes/no" or "date and time".

    QGIS wants a `QMetaType` from 3.38 on and a `QVariant` type before.
    """
    return QgsField(name, FIELD_TYPES[kind])


def save_default_style(layer: Any) -> None:
    """Keep the style of a layer beside its file; QGIS wants to know which parts from 3.26 on."""
    if Qgis.versionInt() >= _STYLE_CATEGORIES:
        layer.saveDefaultStyle(core.QgsMapLayer.StyleCategory.AllStyleCategories)
    else:
        layer.saveDefaultStyle()


def is_null(value: Any) -> bool:
    """Tell whether an attribute is missing: None, or the NULL of QGIS, which is not None."""
    return value is None or value == NULL
