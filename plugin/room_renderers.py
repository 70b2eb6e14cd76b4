"""How game levels look: blocks in the colours of their shapes, the route through them."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsFeatureRenderer,
    QgsProperty,
    QgsSingleSymbolRenderer,
    QgsSymbolLayer,
    QgsVectorLayer,
)

from .symbols import INK, by_value, fill, line, marker


def _blocks() -> QgsFeatureRenderer:
    """Fill blocks with the colours that their shapes have."""
    symbol = fill("#c8c8c8", INK, 0.7)
    scope = getattr(QgsSymbolLayer, "Property", QgsSymbolLayer)
    key = getattr(scope, "FillColor", None)
    key = getattr(QgsSymbolLayer, "PropertyFillColor", None) if key is None else key
    if key is not None:
        symbol.symbolLayer(0).setDataDefinedProperty(key, QgsProperty.fromField("colour"))
    return QgsSingleSymbolRenderer(symbol)


def _by_role(layer: QgsVectorLayer) -> QgsFeatureRenderer:  # noqa: ARG001 (as all of them)
    """Tell start, goal and blocks where the route ends from the others."""
    return by_value(
        "role",
        [
            ("start", "start", fill("#8fb174", INK, 0.7)),
            ("goal", "goal", fill("#cf4a33", INK, 0.7)),
            ("treasure", "treasure: one passage only", fill("#e3b04b", INK, 0.7)),
            ("", "others", fill("#efe9dc", INK, 0.7)),
        ],
    )


def _ends() -> QgsFeatureRenderer:
    return by_value(
        "role",
        [
            ("start", "start", marker("circle", "#5f8a45", 4.0)),
            ("goal", "goal", marker("star", "#cf4a33", 5.5)),
        ],
    )


ROOM_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "level_blocks": _blocks,
    "level_route": lambda: QgsSingleSymbolRenderer(line("#7d3b2f", 0.9)),
    "level_doors": lambda: QgsSingleSymbolRenderer(marker("square", "#7d3b2f", 2.0)),
    "level_ends": _ends,
}
ROOM_TITLES = {"level_blocks": "Shapes"}
ROOM_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "level_blocks": {"Start, goal, treasure": _by_role},
}
