"""Layers with several variations on top of each other: the best is shown, the others by a tick."""

from __future__ import annotations

from qgis.core import QgsFeatureRenderer, QgsRuleBasedRenderer, QgsVectorLayer

#: The field that tells variations apart.
FIELD = "variation"


def by_variation(renderer: QgsFeatureRenderer, layer: QgsVectorLayer) -> QgsFeatureRenderer:
    """Return a renderer that shows one variation of a layer at a time.

    Parameters
    ----------
    renderer
        How the features of a variation look.
    layer
        The layer; where it has no field `variation`, or only one value in it, the renderer stays.
    """
    index = layer.fields().indexOf(FIELD)
    values = sorted(v for v in layer.uniqueValues(index) if v) if index >= 0 else []
    look = QgsRuleBasedRenderer.convertFromRenderer(renderer, layer) if len(values) > 1 else None
    if look is None:
        return renderer
    root = QgsRuleBasedRenderer.Rule(None)
    for value in values:
        rule = QgsRuleBasedRenderer.Rule(None)
        rule.setLabel(f"variation {value}")
        rule.setFilterExpression(f'"{FIELD}" = {value}')
        rule.setActive(value == values[0])
        for child in look.rootRule().children():
            rule.appendChild(child.clone())
        root.appendChild(rule)
    return QgsRuleBasedRenderer(root)
