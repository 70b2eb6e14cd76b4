"""Pictures of floor plans and game levels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from qgis.core import QgsFeatureRequest, QgsMarkerSymbol, QgsRectangle, QgsVectorLayer
from qgis.PyQt.QtCore import QSize

from _gallery_growth_maps import beside
from _gallery_pictures import paint, save, single

#: Width of one of several storeys and the greatest height of a picture (pixels), and the share
#: around an outline that is shown.
WIDE, HIGH, AROUND = 730, 900, 0.03
#: Colours of a picture, and pixels per inch: of one plan, and of several side by side.
COLOURS, ALONE, SMALL = 224, 104, 72
#: Exits, which are given to the tool.
EXIT = QgsMarkerSymbol.createSimple(
    {"name": "triangle", "color": "#2f6f73", "size": "3.4", "outline_color": "#ffffff"}
)


def of_storey(layer: QgsVectorLayer, storey: int) -> QgsVectorLayer:
    """Show one storey of a layer that has several, as a tick in its legend does."""
    renderer = layer.renderer()
    if renderer.type() == "RuleRenderer":
        for rule in renderer.rootRule().children():
            rule.setActive(rule.label() == f"storey {storey}")
    return layer


def exits(layer: QgsVectorLayer, storey: int) -> QgsVectorLayer:
    """Show the exits of a storey; those without one are on all."""
    request = QgsFeatureRequest()
    if layer.fields().indexOf("floor") >= 0:
        request.setFilterExpression(f'"floor" = {storey} OR "floor" IS NULL')
    return single(layer.materialize(request), EXIT)


def window(outline: QgsVectorLayer, width: float, height: float) -> tuple[QgsRectangle, QSize]:
    """Return the ground that is shown, and pixels for it."""
    box = QgsRectangle(outline.extent())
    box = box.buffered(AROUND * max(box.width(), box.height()))
    scale = min(width / box.width(), height / box.height())
    return box, QSize(round(box.width() * scale), round(box.height() * scale))


def plan(
    layers: Sequence[Any], outline: QgsVectorLayer, wide: int, credit: str, target: Path
) -> int:
    """Draw one plan; return the bytes of the picture."""
    box, size = window(outline, wide, max(HIGH, 0.8 * wide))
    return save(paint(layers, outline, box, size, credit, dpi=ALONE), target, COLOURS)


def storeys(
    plans: Sequence[tuple[str, Sequence[Any]]], outline: QgsVectorLayer, credit: str, target: Path
) -> int:
    """Draw storeys side by side, in two columns; return the bytes of the picture."""
    box, size = window(outline, WIDE, HIGH)
    cells = [
        (title, paint(layers, outline, box, size, credit, dpi=SMALL)) for title, layers in plans
    ]
    return save(beside(cells, 2), target, COLOURS)
