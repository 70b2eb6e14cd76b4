"""How residential zones look: plans as planners draw them, and hours of sun."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    Qgs25DRenderer,
    QgsExpressionContextUtils,
    QgsFeatureRenderer,
    QgsProperty,
    QgsSingleSymbolRenderer,
    QgsSymbol,
    QgsSymbolLayer,
    QgsVectorLayer,
)
from qgis.PyQt.QtGui import QColor

from . import compat
from .symbols import GREY, INK, by_value, fill, line, marker

#: Tells what a building is, as an expression.
KIND = (
    "if(\"use\" = 'facility', 'facility', if(\"storeys\" < 4, 'low', "
    "if(\"storeys\" < 9, 'middle', 'high')))"
)
#: What it may be: the label and the colour of each.
COLOURS = {
    "low": ("residence, under 4 storeys", "#f2c9a1"),
    "middle": ("residence, 4 to 8 storeys", "#e29a6b"),
    "high": ("residence, 9 storeys and more", "#b5583c"),
    "facility": ("facility", "#7f9fc4"),
}
#: Less than so many hours of sun: what is said of it, and its colour.
_SUN = (
    (1, "under 1 h", "#5b4a8c"),
    (2, "1 to 2 h", "#2f6f73"),
    (3, "2 to 3 h", "#a8b85c"),
    (5, "3 to 5 h", "#e3b04b"),
    (25, "5 h and more", "#f6dc8a"),
)


def _ground(symbol: QgsSymbol, width_field: str = "") -> QgsSymbol:
    """Return a line symbol whose width is metres on the ground, from a field."""
    layer = symbol.symbolLayer(0)
    layer.setWidthUnit(compat.METRES_ON_GROUND)
    scope = getattr(QgsSymbolLayer, "Property", QgsSymbolLayer)
    key = getattr(scope, "StrokeWidth", None)
    key = getattr(QgsSymbolLayer, "PropertyStrokeWidth", None) if key is None else key
    if width_field and key is not None:
        layer.setDataDefinedProperty(key, QgsProperty.fromField(width_field))
    return symbol


def _buildings() -> QgsFeatureRenderer:
    entries = [(key, label, fill(tint, INK, 0.2)) for key, (label, tint) in COLOURS.items()]
    return by_value(KIND, entries)


def _by_sun(layer: QgsVectorLayer) -> QgsFeatureRenderer:  # noqa: ARG001 (as all of them)
    """Draw residences by their hours of sun; facilities are grey."""
    cases, entries = [], []
    for high, label, colour in _SUN:
        cases.append(f"WHEN \"sun_hours\" < {high} THEN '{label}'")
        entries.append((label, label, fill(colour, INK, 0.2)))
    facility = "WHEN \"use\" = 'facility' THEN 'facility'"
    entries.append(("facility", "facility", fill("#d9d5cc", GREY, 0.2)))
    return by_value(f"CASE {facility} {' '.join(cases)} END", entries)


def _raised(layer: QgsVectorLayer) -> QgsFeatureRenderer:
    """Draw buildings as blocks that stand up from the map, in metres of a projected CRS."""
    for name, value in (("height", '"height_m"'), ("angle", "70")):
        QgsExpressionContextUtils.setLayerVariable(layer, f"qgis_25d_{name}", value)
    renderer = Qgs25DRenderer()
    renderer.setRoofColor(QColor("#e29a6b"))
    renderer.setWallColor(QColor("#8f6a55"))
    renderer.setShadowEnabled(False)
    return renderer


def _paths() -> QgsFeatureRenderer:
    return QgsSingleSymbolRenderer(_ground(line("#f6efdd", 3.0), "width_m"))


def _corridors() -> QgsFeatureRenderer:
    return QgsSingleSymbolRenderer(_ground(line("#e2ded6", 12.0), "width_m"))


def _trees() -> QgsFeatureRenderer:
    symbol = marker("circle", "#93b67d", 4.5, "#84a86e")
    symbol.setSizeUnit(compat.METRES_ON_GROUND)
    symbol.setOpacity(0.8)
    return QgsSingleSymbolRenderer(symbol)


def _single(make: Callable[[], QgsSymbol]) -> Callable[[], QgsFeatureRenderer]:
    return lambda: QgsSingleSymbolRenderer(make())


BUILDING_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "zone_buildings": _buildings,
    "zone_shadows": _single(lambda: fill("74,68,91,46", "74,68,91,0", 0.0)),
    "zone_paths": _paths,
    "zone_corridors": _corridors,
    "zone_parking": _single(lambda: fill("#c9c6cf", GREY, 0.1)),
    "zone_green": _single(lambda: fill("#d9e6c3", "#d9e6c3", 0.0)),
    "zone_trees": _trees,
    "zone_patches": _single(lambda: fill("#efe9dc", "#b9b0a2", 0.15)),
}
BUILDING_TITLES = {"zone_buildings": "Use and storeys"}
BUILDING_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "zone_buildings": {"Hours of sun": _by_sun, "2.5D": _raised},
}
