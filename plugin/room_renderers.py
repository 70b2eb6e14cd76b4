"""How floor plans and game levels look: rooms in the colours of their shapes."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsAbstractVectorLayerLabeling,
    QgsFeatureRenderer,
    QgsGeometryGeneratorSymbolLayer,
    QgsLineSymbol,
    QgsMapUnitScale,
    QgsPalLayerSettings,
    QgsProperty,
    QgsSingleSymbolRenderer,
    QgsSymbol,
    QgsSymbolLayer,
    QgsTextFormat,
    QgsVectorLayer,
    QgsVectorLayerSimpleLabeling,
)
from qgis.PyQt.QtGui import QColor

from . import compat
from .symbols import INK, by_value, fill, line, marker

#: Thickness of the walls of buildings (metres), and the least and most of it on a map
#: (millimetres).
WALL, THIN, THICK = 0.2, 0.18, 1.4
#: Leaf and swing of a door: the leaf stands open into the room, which lies to the left of the line.
_SWING = (
    "with_variable('s', start_point($geometry), with_variable('e', end_point($geometry), "
    "with_variable('r', distance(@s, @e), with_variable('a', azimuth(@s, @e), make_line(@s, "
    + ", ".join(f"project(@s, @r, @a - {part} * pi() / 12)" for part in (6, 5, 4, 3, 2, 1))
    + ", @e)))))"
)


def _of_template(symbol: QgsSymbol) -> QgsFeatureRenderer:
    """Fill rooms and blocks with the colours that their shapes have."""
    scope = getattr(QgsSymbolLayer, "Property", QgsSymbolLayer)
    key = getattr(scope, "FillColor", None)
    key = getattr(QgsSymbolLayer, "PropertyFillColor", None) if key is None else key
    if key is not None:
        symbol.symbolLayer(0).setDataDefinedProperty(key, QgsProperty.fromField("colour"))
    return QgsSingleSymbolRenderer(symbol)


def _on_ground(layer: QgsSymbolLayer, thin: float = THIN, thick: float = THICK) -> None:
    """Let the width of a line be in metres, within limits on the map in millimetres."""
    limits = QgsMapUnitScale()
    limits.minSizeMMEnabled = limits.maxSizeMMEnabled = True
    limits.minSizeMM, limits.maxSizeMM = thin, thick
    outline = hasattr(layer, "setStrokeWidthUnit")
    (layer.setStrokeWidthUnit if outline else layer.setWidthUnit)(compat.METRES_ON_GROUND)
    (layer.setStrokeWidthMapUnitScale if outline else layer.setWidthMapUnitScale)(limits)


def _walled(colour: str) -> QgsSymbol:
    """Return a fill with walls around it."""
    symbol = fill(colour, INK, WALL)
    _on_ground(symbol.symbolLayer(0))
    return symbol


def _doors() -> QgsFeatureRenderer:
    """Draw doors as architects do: a gap in the wall, the leaf and the way that it swings."""
    symbol = QgsLineSymbol.createSimple(
        {"line_color": "#ffffff", "line_width": str(1.5 * WALL), "capstyle": "flat"}
    )
    _on_ground(symbol.symbolLayer(0), 1.5 * THIN, 1.5 * THICK)
    swing = QgsGeometryGeneratorSymbolLayer.create({"geometryModifier": _SWING})
    swing.setSymbolType(compat.LINE_SYMBOL)
    leaf = line(INK, 0.05)
    _on_ground(leaf.symbolLayer(0), 0.1, 0.3)
    swing.setSubSymbol(leaf)
    symbol.appendSymbolLayer(swing)
    return QgsSingleSymbolRenderer(symbol)


def _room_labels() -> QgsAbstractVectorLayerLabeling:
    """Name rooms and tell their areas where there is room for it."""
    settings = QgsPalLayerSettings()
    settings.fieldName = "concat(\"template\", '\\n', round(\"area_m2\"), ' m²')"
    settings.isExpression = True
    settings.placement = compat.LABEL_INSIDE
    settings.fitInPolygonOnly = True
    settings.autoWrapLength = 9
    text = QgsTextFormat()
    text.setSize(7)
    text.setColor(QColor(INK))
    settings.setFormat(text)
    return QgsVectorLayerSimpleLabeling(settings)


def _by_way(layer: QgsVectorLayer) -> QgsFeatureRenderer:  # noqa: ARG001 (as all of them)
    """Draw rooms by their way to the nearest exit."""
    cases, entries = [], []
    for high, label, colour in _WAYS:
        cases.append(f"WHEN \"distance_m\" <= {high} THEN '{label}'")
        entries.append((label, label, _walled(colour)))
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
    "floor_rooms": lambda: _of_template(_walled("#c8c8c8")),
    "floor_corridors": lambda: QgsSingleSymbolRenderer(_walled("#ffffff")),
    "floor_lines": lambda: QgsSingleSymbolRenderer(line("#b0705f", 0.2, "dash")),
    "floor_doors": _doors,
    "floor_obstacles": lambda: QgsSingleSymbolRenderer(_walled("#8a857c")),
    "floor_cells": lambda: QgsSingleSymbolRenderer(fill("255,255,255,0", "#b9b0a2", 0.1)),
    "level_blocks": lambda: _of_template(fill("#c8c8c8", INK, 0.7)),
    "level_route": lambda: QgsSingleSymbolRenderer(line("#7d3b2f", 0.9)),
    "level_doors": lambda: QgsSingleSymbolRenderer(marker("square", "#7d3b2f", 2.0)),
    "level_ends": _ends,
}
ROOM_LABELS: dict[str, Callable[[], QgsAbstractVectorLayerLabeling]] = {"floor_rooms": _room_labels}
ROOM_TITLES = {"level_blocks": "Shapes", "floor_rooms": "Shapes"}
ROOM_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "floor_rooms": {"Way to an exit": _by_way},
    "level_blocks": {"By role": _by_role},
}
