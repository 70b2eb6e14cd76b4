"""What the planner asked of a tool, read from the parameters of one run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingFeatureSource,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProperty,
    QgsRasterLayer,
)

from ..algorithms.errors import InputError
from . import bridge, compat
from .progress import FeedbackProgress


def with_words(
    parameters: Mapping[str, Any], definitions: Iterable[QgsProcessingParameterDefinition]
) -> dict[str, Any]:
    """Return parameters whose choices are words also where their numbers were given.

    The help of `qgis_process` asks for the number of a choice; models, saved settings and
    dialogs keep the words. A number that may be given feature by feature takes `field:NAME` and
    `expression:TEXT`, as newer versions of QGIS read them by themselves.

    Parameters
    ----------
    parameters
        What Processing hands over.
    definitions
        The parameters of the tool.
    """
    found = dict(parameters)
    for definition in definitions:
        value = found.get(definition.name())
        if definition.isDynamic() and isinstance(value, str):
            found[definition.name()] = _property(value)
        if not isinstance(definition, QgsProcessingParameterEnum) or isinstance(value, bool):
            continue
        if isinstance(value, (int, float)) or (isinstance(value, str) and value.strip().isdigit()):
            words = definition.options()
            if float(value) in range(len(words)):
                found[definition.name()] = words[int(value)]
    return found


def _property(text: str) -> Any:
    """Return the property that a text of a command line means, or the text."""
    kind, _, rest = text.partition(":")
    if kind == "field" and rest:
        return QgsProperty.fromField(rest)
    return QgsProperty.fromExpression(rest) if kind == "expression" and rest else text


class Request:
    """Typed access to the parameters of one run.

    Only the `parameterAs...` functions of Processing are used, so that expressions, models and
    the command line work.

    Parameters
    ----------
    tool, parameters, context
        What Processing hands to `processAlgorithm`.
    """

    def __init__(
        self,
        tool: QgsProcessingAlgorithm,
        parameters: dict[str, Any],
        context: QgsProcessingContext,
    ) -> None:
        self.tool = tool
        self.parameters = parameters
        self.context = context
        self._sources: dict[str, QgsProcessingFeatureSource | None] = {}

    def has(self, key: str) -> bool:
        """Tell whether the planner gave anything for `key`."""
        value = self.parameters.get(key)
        return not compat.is_null(value) and value != ""

    def declares(self, key: str) -> bool:
        """Tell whether the tool has an input of this name."""
        definition = self.tool.parameterDefinition(key)
        return definition is not None and not definition.isDestination()

    def number(self, key: str) -> float:
        """Return a number that always has a value."""
        return float(self.tool.parameterAsDouble(self.parameters, key, self.context))

    def optional_number(self, key: str) -> float | None:
        """Return a number, or None where the planner left it empty."""
        return self.number(key) if self.has(key) else None

    def integer(self, key: str) -> int:
        """Return a whole number."""
        return int(self.tool.parameterAsInt(self.parameters, key, self.context))

    def word(self, key: str) -> str:
        """Return the word of a choice."""
        return str(self.tool.parameterAsEnumString(self.parameters, key, self.context))

    def source(self, key: str) -> QgsProcessingFeatureSource | None:
        """Return an input layer as Processing sees it, or None where none is given.

        Raises
        ------
        InputError
            Something is given that is no layer.
        """
        if key not in self._sources:
            source = self.tool.parameterAsSource(self.parameters, key, self.context)
            if source is None and self.has(key):
                title = self.tool.parameterDefinition(key).description()
                raise InputError(
                    f"{title}: no such layer, or it cannot be read ({self.parameters[key]}).",
                    "Choose a layer that opens in QGIS.",
                )
            self._sources[key] = source
        return self._sources[key]

    def flag(self, key: str) -> bool:
        """Return a yes or no."""
        return bool(self.tool.parameterAsBool(self.parameters, key, self.context))

    def field(self, key: str, usual: str = "") -> str:
        """Return the name of a field of an input layer; `usual` where none is chosen."""
        return str(self.tool.parameterAsString(self.parameters, key, self.context) or usual)

    def raster(self, key: str) -> QgsRasterLayer | None:
        """Return a raster layer, or None where none is given.

        Raises
        ------
        InputError
            Something is given that is no raster layer, or it has no CRS.
        """
        layer = self.tool.parameterAsRasterLayer(self.parameters, key, self.context)
        title = self.tool.parameterDefinition(key).description()
        if layer is None and self.has(key):
            raise InputError(
                f"{title}: no such raster layer, or it cannot be read ({self.parameters[key]}).",
                "Choose a raster that opens in QGIS.",
            )
        if layer is not None and not layer.crs().isValid():
            raise InputError(
                "It has no coordinate reference system.",
                "Assign one with Layer > Set CRS of Layer(s) and run again.",
                layer=layer.name(),
            )
        return layer

    def name(self, key: str) -> str:
        """Return the name of an input layer, or what the parameter is called."""
        source = self.source(key)
        name = source.sourceName() if source is not None else ""
        # A table of a database that is named by its path has the file's name: say which table.
        _, _, table = str(self.parameters.get(key)).partition("|layername=")
        if table:
            name = table.split("|", 1)[0]
        return name or str(self.tool.parameterDefinition(key).description())

    def crs(self, key: str) -> QgsCoordinateReferenceSystem:
        """Return the CRS of an input layer; invalid where none is given."""
        source = self.source(key)
        return QgsCoordinateReferenceSystem() if source is None else source.sourceCrs()

    def check_layer(self, key: str) -> None:
        """Raise `InputError` where a given layer is empty or has no CRS."""
        source = self.source(key)
        if source is None or self._may_be_empty(key):
            return
        if source.featureCount() == 0:
            raise InputError(
                "It has no features, or none is selected.",
                "Choose another layer, or switch off 'Selected features only'.",
                layer=self.name(key),
            )
        # a table lies nowhere
        if source.wkbType() != compat.WKB["NoGeometry"] and not source.sourceCrs().isValid():
            raise InputError(
                "It has no coordinate reference system.",
                "Assign one with Layer > Set CRS of Layer(s) and run again.",
                layer=self.name(key),
            )

    def frame(self, key: str, progress: FeedbackProgress) -> Any:
        """Return an input layer as a GeoDataFrame, or None where none is given or it is empty."""
        source = self.source(key)
        if source is None:
            return None
        if self._may_be_empty(key):
            progress.info(f"Layer '{self.name(key)}' has no features: left out.")
            return None
        self.check_layer(key)
        progress.stage(f"Reading {self.name(key)}", 0.0)
        return bridge.read_source(source, progress)

    def _may_be_empty(self, key: str) -> bool:
        """Tell whether a layer is empty and that is no mistake.

        In a model the layers of one tool go into the next: a site without obstacles has an empty
        layer of them. Where a selection was asked for, none was made.
        """
        source = self.source(key)
        definition = self.tool.parameterDefinition(key)
        value = self.parameters.get(key)
        return bool(
            source is not None
            and source.featureCount() == 0
            and key != "INPUT"
            and definition.flags() & compat.OPTIONAL
            and not getattr(value, "selectedFeaturesOnly", False)
        )
