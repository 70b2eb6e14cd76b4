"""Runs tools as Processing does and reads back everything that they made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest
from qgis.core import (
    QgsApplication,
    QgsFeature,
    QgsGeometry,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingUtils,
    QgsProject,
    QgsVectorLayer,
)

METRES = "EPSG:3067"
#: A corner in the middle of EPSG:3067, so that its scale is true.
X, Y = 500000.0, 6700000.0


class RefusedError(Exception):
    """The tool would not start; the text is what the dialog shows."""


class FailedError(Exception):
    """The tool stopped; the text is what the log shows in red."""


class Listener(QgsProcessingFeedback):
    """Takes note of everything, and may press Cancel when a text shows up."""

    def __init__(self, cancel_at: str | None = None) -> None:
        super().__init__(False)
        self.cancel_at = cancel_at
        self.stages: list[str] = []
        self.infos: list[str] = []
        self.warnings: list[str] = []
        self.errors: list[str] = []

    def _hear(self, text: str) -> None:
        if self.cancel_at is not None and self.cancel_at in text:
            self.cancel()

    def setProgressText(self, text: str) -> None:  # noqa: N802 - names of QGIS
        self.stages.append(text)
        self._hear(text)

    def pushInfo(self, info: str) -> None:  # noqa: N802
        self.infos.append(info)
        self._hear(info)

    def pushWarning(self, warning: str) -> None:  # noqa: N802
        self.warnings.append(warning)

    def reportError(self, error: str, *_: bool) -> None:  # noqa: N802
        self.errors.append(error)


@dataclass
class Run:
    """What came of a run: Processing's results, layers by output key, and what was said."""

    results: dict[str, Any]
    layers: dict[str, QgsVectorLayer]
    said: Listener
    context: QgsProcessingContext = field(repr=False)

    def rows(self, key: str) -> list[dict[str, Any]]:
        """Return the features of an output as dictionaries, their geometry under 'geometry'."""
        layer = self.layers[key]
        names = [f.name() for f in layer.fields()]
        return [
            {**dict(zip(names, f.attributes())), "geometry": f.geometry()}
            for f in layer.getFeatures()
        ]


class Toolbox:
    """Runs the tools of the provider."""

    def tool(self, name: str) -> Any:
        """Return a fresh tool."""
        found = QgsApplication.processingRegistry().createAlgorithmById(f"platwright:{name}")
        assert found is not None, name
        return found

    def run(
        self,
        name: str,
        *,
        listener: Listener | None = None,
        check: bool = True,
        **parameters: Any,
    ) -> Run:
        """Check, run and read back; every declared output goes to memory unless it is named.

        Without `check` the tool runs as inside a model, where nobody checks before.
        """
        tool = self.tool(name)
        sinks = [p for p in tool.destinationParameterDefinitions() if p.type() == "sink"]
        for output in sinks:
            parameters.setdefault(output.name(), "TEMPORARY_OUTPUT")
        context = QgsProcessingContext()
        context.setProject(QgsProject.instance())
        said = listener or Listener()
        if check:
            good, text = tool.checkParameterValues(parameters, context)
            if not good:
                raise RefusedError(text)
        results, good = tool.run(parameters, context, said)
        if not good:
            raise FailedError("\n".join(said.errors))
        layers = {}
        for output in sinks:
            if results.get(output.name()):
                layer = QgsProcessingUtils.mapLayerFromString(results[output.name()], context)
                assert layer is not None, output.name()
                assert layer.isValid(), output.name()
                # The layer must outlive the context.
                layers[output.name()] = context.takeResultLayer(layer.id()) or layer
        return Run(results, layers, said, context)


def complaints_of(name: str) -> Callable[..., str]:
    """Return what runs a tool that must refuse or stop, and returns what it then says."""

    def complaint(toolbox: Toolbox, **parameters: Any) -> str:
        with pytest.raises((RefusedError, FailedError)) as caught:
            toolbox.run(name, **parameters)
        text = str(caught.value)
        assert text.rstrip().endswith((".", ")"))
        for stray in ("Traceback", 'File "', "something went wrong", "NoneType", "Error:"):
            assert stray not in text
        return text

    return complaint


def layer(
    shapes: list[str | QgsGeometry | None],
    *,
    kind: str = "Polygon",
    crs: str = METRES,
    name: str = "made",
    fields: str = "",
    values: list[list[Any]] | None = None,
) -> QgsVectorLayer:
    """Return a memory layer; shapes are WKT, geometries, or None for NULL."""
    where = f"crs={crs}" if crs else "crs="
    made = QgsVectorLayer(f"{kind}?{where}{fields and '&' + fields}", name, "memory")
    assert made.isValid()
    if not crs:
        from qgis.core import QgsCoordinateReferenceSystem

        made.setCrs(QgsCoordinateReferenceSystem())
    features = []
    for index, shape in enumerate(shapes):
        feature = QgsFeature(made.fields())
        if shape is not None:
            feature.setGeometry(QgsGeometry.fromWkt(shape) if isinstance(shape, str) else shape)
        if values:
            feature.setAttributes(values[index])
        features.append(feature)
    assert made.dataProvider().addFeatures(features)[0] or not features
    made.updateExtents()
    return made


def box(x: float, y: float, width: float, height: float) -> str:
    """Return the WKT of a rectangle, its lower left corner at (X + x, Y + y)."""
    a, b = X + x, Y + y
    c, d = a + width, b + height
    return f"POLYGON(({a} {b},{c} {b},{c} {d},{a} {d},{a} {b}))"


def line(*points: tuple[float, float]) -> str:
    """Return the WKT of a line through points, relative to (X, Y)."""
    return f"LINESTRING({','.join(f'{X + x} {Y + y}' for x, y in points)})"


def point(x: float, y: float) -> str:
    """Return the WKT of a point, relative to (X, Y)."""
    return f"POINT({X + x} {Y + y})"


#: A site of 300 by 200 m whose roads run 8 m outside of it; one more arrives from the south.
SITE = box(0, 0, 300, 200)
ROADS = [
    line((-8, -8), (150, -8), (308, -8)),
    line((308, -8), (308, 208)),
    line((308, 208), (-8, 208)),
    line((-8, 208), (-8, -8)),
    line((150, -8), (150, -120)),
]


def site(**options: Any) -> QgsVectorLayer:
    """Return the site as a layer."""
    return layer([SITE], name="my site", **options)


def roads(**options: Any) -> QgsVectorLayer:
    """Return the roads around it as a layer."""
    return layer(
        list(ROADS),
        kind="LineString",
        name="my roads",
        fields="field=name:string(40)&field=highway:string(20)",
        values=[
            ["South Street", "residential"],
            ["East Street", "residential"],
            ["North Street", "residential"],
            ["West Street", "residential"],
            ["Mill Lane", "residential"],
        ],
        **options,
    )
