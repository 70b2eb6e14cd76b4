"""How the tools declare their parameters: a unit in the text, help on each, words as choices.

All lengths are metres whatever the CRS of the layers; choices are words rather than numbers,
so that a command line or a saved model reads well and survives a new choice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from qgis.core import (
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterField,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterLayer,
    QgsPropertyDefinition,
)

from . import compat
from .fields import LayerKind

#: Stands in the text of an optional number before what it is where it is left empty; the dialog
#: itself says "Not set" there.
UNSET = ", not set: "
#: Decimals that the dialog shows of metres and seconds, and of what has no such unit.
DECIMALS = {"m": 2, "s": 1, "": 4}
#: Units of fewer letters stand behind a number; longer ones explain it.
SHORT = 8

_SOURCES = {
    "polygon": compat.SOURCE_POLYGON,
    "line": compat.SOURCE_LINE,
    "point": compat.SOURCE_POINT,
    "table": compat.SOURCE_TABLE,
}
_SINKS = {
    "Point": compat.SOURCE_POINT,
    "LineString": compat.SOURCE_LINE,
    "MultiLineString": compat.SOURCE_LINE,
    "Polygon": compat.SOURCE_POLYGON,
    "MultiPolygon": compat.SOURCE_POLYGON,
    "NoGeometry": compat.SOURCE_TABLE,
}


def _finish(
    definition: QgsProcessingParameterDefinition, help_text: str, advanced: bool
) -> QgsProcessingParameterDefinition:
    definition.setHelp(help_text)
    if advanced:
        definition.setFlags(definition.flags() | compat.ADVANCED)
    return definition


def layer(
    key: str,
    text: str,
    help_text: str,
    geometry: str | Sequence[str],
    *,
    optional: bool = False,
    advanced: bool = False,
) -> QgsProcessingParameterDefinition:
    """Declare an input layer of "polygon", "line" or "point" geometry, or a "table"."""
    names = [geometry] if isinstance(geometry, str) else list(geometry)
    types = [_SOURCES[name] for name in names]
    definition = QgsProcessingParameterFeatureSource(key, text, types, None, optional)
    return _finish(definition, f"{help_text} Optional." if optional else help_text, advanced)


def number(
    key: str,
    text: str,
    help_text: str,
    *,
    unit: str = "",
    default: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    integer: bool = False,
    advanced: bool = False,
    per_feature_of: str = "",
    unset: str = "",
) -> QgsProcessingParameterDefinition:
    """Declare a number; without a default it is optional, and empty means "as implied".

    `per_feature_of` names the layer parameter whose features may each have a value of their own,
    by a field or an expression. `unset` says in the dialog what an empty number is.
    """
    limits = {}
    if minimum is not None:
        limits["minValue"] = minimum
    if maximum is not None:
        limits["maxValue"] = maximum
    definition = QgsProcessingParameterNumber(
        key,
        (f"{text} ({unit})" if unit else text) + (UNSET + unset if unset else ""),
        compat.NUMBER_INTEGER if integer else compat.NUMBER_FLOAT,
        default,
        optional=default is None,
        **limits,
    )
    if not integer:
        decimals = DECIMALS.get(unit, DECIMALS[""])
        definition.setMetadata({"widget_wrapper": {"decimals": decimals}})
    if per_feature_of:
        definition.setIsDynamic(True)
        definition.setDynamicLayerParameterName(per_feature_of)
        definition.setDynamicPropertyDefinition(
            QgsPropertyDefinition(key, title(definition), compat.POSITIVE_NUMBER)
        )
    usual = "" if default is None else f"{default:g} {unit if len(unit) < SHORT else ''}".strip()
    ending = "Optional." if default is None else f"Default: {usual}."
    return _finish(definition, f"{help_text} {ending}", advanced)


def title(definition: QgsProcessingParameterDefinition) -> str:
    """Return what a parameter is called in a sentence, without what it is where it is empty."""
    return str(definition.description()).partition(UNSET)[0]


def choice(
    key: str,
    text: str,
    help_text: str,
    choices: Mapping[str, str],
    *,
    default: str,
    advanced: bool = False,
) -> QgsProcessingParameterDefinition:
    """Declare a choice; `choices` maps each word to what it means, which goes into the help."""
    meanings = "; ".join(f"{word}: {meaning}" for word, meaning in choices.items())
    definition = QgsProcessingParameterEnum(key, text, list(choices), False, default, False, True)
    return _finish(definition, f"{help_text} {meanings}. Default: {default}.", advanced)


def field(
    key: str,
    text: str,
    help_text: str,
    parent: str,
    *,
    numeric: bool = True,
    advanced: bool = True,
) -> QgsProcessingParameterDefinition:
    """Declare an optional field of the layer parameter `parent`, of numbers or of any kind."""
    kind = compat.NUMERIC_FIELD if numeric else compat.ANY_FIELD
    definition = QgsProcessingParameterField(key, text, None, parent, kind, False, True)
    return _finish(definition, f"{help_text} Optional.", advanced)


def raster(
    key: str, text: str, help_text: str, *, advanced: bool = True
) -> QgsProcessingParameterDefinition:
    """Declare an optional raster layer."""
    definition = QgsProcessingParameterRasterLayer(key, text, None, True)
    return _finish(definition, f"{help_text} Optional.", advanced)


def flag(
    key: str, text: str, help_text: str, *, default: bool, advanced: bool = False
) -> QgsProcessingParameterDefinition:
    """Declare a yes or no."""
    definition = QgsProcessingParameterBoolean(key, text, default, False)
    return _finish(definition, f"{help_text} Default: {'yes' if default else 'no'}.", advanced)


def extent(
    key: str, text: str, help_text: str, *, advanced: bool = False
) -> QgsProcessingParameterDefinition:
    """Declare an optional rectangle: that of the map, of a layer, or drawn."""
    definition = QgsProcessingParameterExtent(key, text, None, True)
    return _finish(definition, f"{help_text} Optional.", advanced)


def sink(
    key: str, kind: LayerKind, help_text: str, *, optional: bool = True
) -> QgsProcessingParameterDefinition:
    """Declare an output layer; optional ones are made unless they are switched off.

    Those of a kind that is made on request are switched off at first.
    """
    definition = QgsProcessingParameterFeatureSink(
        key, kind.title, _SINKS[kind.geometry], None, optional, not kind.on_request
    )
    return _finish(definition, help_text, advanced=False)
