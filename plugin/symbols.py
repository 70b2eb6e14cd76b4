"""Plain symbols, and renderers by categories, in the colours of the house."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from qgis.core import (
    QgsCategorizedSymbolRenderer,
    QgsFeatureRenderer,
    QgsFillSymbol,
    QgsLineSymbol,
    QgsMarkerSymbol,
    QgsRendererCategory,
    QgsSymbol,
)

GREY = "#8c867c"
INK = "#4a443b"


def line(colour: str, width: float, style: str = "solid") -> QgsSymbol:
    """Return a line symbol: colour, width in millimetres, style of the pen."""
    return QgsLineSymbol.createSimple(
        {
            "line_color": colour,
            "line_width": str(width),
            "line_style": style,
            "capstyle": "round",
            "joinstyle": "round",
        }
    )


def fill(colour: str, outline: str, width: float = 0.2, style: str = "solid") -> QgsSymbol:
    """Return a fill symbol: its colour, that and the width in millimetres of its outline."""
    return QgsFillSymbol.createSimple(
        {"color": colour, "style": style, "outline_color": outline, "outline_width": str(width)}
    )


def marker(name: str, colour: str, size: float, outline: str = "#ffffff") -> QgsSymbol:
    """Return a marker symbol: shape, colour, size in millimetres, colour of the outline."""
    return QgsMarkerSymbol.createSimple(
        {
            "name": name,
            "color": colour,
            "size": str(size),
            "outline_color": outline,
            "outline_width": "0.2",
        }
    )


def by_value(field: str, entries: Sequence[tuple[Any, str, QgsSymbol]]) -> QgsFeatureRenderer:
    """Return a renderer by categories: value, label and symbol of each."""
    categories = [QgsRendererCategory(value, symbol, label) for value, label, symbol in entries]
    return QgsCategorizedSymbolRenderer(field, categories)
