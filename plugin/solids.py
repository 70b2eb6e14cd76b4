"""How layers with heights look in a 3D view."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsProperty, QgsPropertyCollection
from qgis.PyQt.QtGui import QColor

from .building_renderers import COLOURS, KIND
from .fields import LayerKind

#: Heights in metres, as expressions, by the name of the style.
HEIGHTS = {
    "buildings": 'coalesce("height_m", 6)',
    "zone_buildings": '"height_m"',
}
#: Colours of the kinds of a layer, and the expression that tells its kind; others are grey.
KINDS = {"zone_buildings": (KIND, COLOURS)}


def solid_renderer(kind: LayerKind) -> Any:
    """Return a 3D renderer that raises a layer's polygons, or None where it has no heights.

    None, too, where this QGIS was built without its 3D part.
    """
    if kind.style not in HEIGHTS:
        return None
    try:
        from qgis import _3d
    except ImportError:
        return None
    symbol = _solid(HEIGHTS[kind.style])
    if symbol is None or kind.style not in KINDS:
        return None if symbol is None else _3d.QgsVectorLayer3DRenderer(symbol)
    rules = _3d.QgsRuleBased3DRenderer.Rule(None)
    told, colours = KINDS[kind.style]
    for value, (label, colour) in colours.items():
        own = _solid(HEIGHTS[kind.style], colour)
        rule = _3d.QgsRuleBased3DRenderer.Rule(own, f"{told} = '{value}'", label)
        rules.appendChild(rule)
    return _3d.QgsRuleBased3DRenderer(rules)


def _solid(height: str, colour: str = "") -> Any:
    """Return a symbol of a height and a colour; None where this QGIS knows no such heights."""
    from qgis import _3d

    symbol = _3d.QgsPolygon3DSymbol()
    kinds = type(symbol)
    # The name that the enumeration has from QGIS 3.36 on, then the older one.
    scope = getattr(kinds, "Property", kinds)
    key = getattr(scope, "ExtrusionHeight", None)
    key = getattr(kinds, "PropertyExtrusionHeight", None) if key is None else key
    if key is None:
        return None
    values = QgsPropertyCollection()
    values.setProperty(key, QgsProperty.fromExpression(height))
    symbol.setDataDefinedProperties(values)
    if colour:
        material = _3d.QgsPhongMaterialSettings()
        material.setDiffuse(QColor(colour))
        material.setAmbient(QColor(colour).darker(260))
        material.setSpecular(QColor("#000000"))
        give = getattr(symbol, "setMaterialSettings", None) or symbol.setMaterial
        give(material)
    return symbol
