"""How layers with heights look in a 3D view."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsProperty, QgsPropertyCollection

from .fields import LayerKind

#: Heights in metres, as expressions, by the name of the style.
HEIGHTS = {"buildings": 'coalesce("height_m", 6)'}


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
    symbol = _3d.QgsPolygon3DSymbol()
    kinds = type(symbol)
    # The name that the enumeration has from QGIS 3.36 on, then the older one.
    scope = getattr(kinds, "Property", kinds)
    key = getattr(scope, "ExtrusionHeight", None)
    key = getattr(kinds, "PropertyExtrusionHeight", None) if key is None else key
    if key is None:
        return None
    values = QgsPropertyCollection()
    values.setProperty(key, QgsProperty.fromExpression(HEIGHTS[kind.style]))
    symbol.setDataDefinedProperties(values)
    return _3d.QgsVectorLayer3DRenderer(symbol)
