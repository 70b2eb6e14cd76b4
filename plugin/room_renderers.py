"""How floor plans and game levels look: rooms in the colours of their shapes."""

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


def _of_template(outline: float) -> QgsFeatureRenderer:
    """Fill rooms and blocks with the colours that their shapes have."""
    symbol = fill("#c8c8c8", INK, outline)
    scope = getattr(QgsSymbolLayer, "Property", QgsSymbolLayer)
    key = getattr(scope, "FillColor", None)
    key = getattr(QgsSymbolLayer, "PropertyFillColor", None) if key is None else key
    if key is not None:
        symbol.symbolLayer(0).setDataDefinedProperty(key, QgsProperty.fromField("colour"))
    return QgsSingleSymbolRenderer(symbol)


def _by_way(layer: QgsVectorLayer) -> QgsFeatureRenderer:  # noqa: ARG001 (as all of them)
    """Draw rooms by their way to the nearest exit."""
    cases, entries = [], []
    for high, label, colour in _WAYS:
        cases.append(f"WHEN \"distance_m\" <= {high} THEN '{label}'")
        entries.append((label, label, fill(colour, INK, 0.5)))
    return by_value(f"CASE {' '.join(cases)} END", entries)


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


#: Ways to an exit of at most so many metres: what is said of them, and their colour.
_WAYS = (
    (10, "to 10 m", "#f6efdd"),
    (20, "10 to 20 m", "#f2d6a2"),
    (35, "20 to 35 m", "#e3a35f"),
    (60, "35 to 60 m", "#c26a43"),
    (100_000, "over 60 m", "#8c3b2e"),
)

ROOM_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "floor_rooms": lambda: _of_template(0.5),
    "floor_corridors": lambda: QgsSingleSymbolRenderer(fill("#ffffff", INK, 0.3)),
    "floor_lines": lambda: QgsSingleSymbolRenderer(line("#7d3b2f", 0.4, "dash")),
    "floor_doors": lambda: QgsSingleSymbolRenderer(line("#ffffff", 1.1)),
    "floor_obstacles": lambda: QgsSingleSymbolRenderer(fill("#8a857c", INK, 0.3)),
    "floor_cells": lambda: QgsSingleSymbolRenderer(fill("255,255,255,0", "#b9b0a2", 0.1)),
    "level_blocks": lambda: _of_template(0.7),
    "level_route": lambda: QgsSingleSymbolRenderer(line("#7d3b2f", 0.9)),
    "level_doors": lambda: QgsSingleSymbolRenderer(marker("square", "#7d3b2f", 2.0)),
    "level_ends": _ends,
}
ROOM_TITLES = {"level_blocks": "Shapes", "floor_rooms": "Shapes"}
ROOM_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "floor_rooms": {"Way to an exit": _by_way},
    "level_blocks": {"Start, goal, treasure": _by_role},
}
