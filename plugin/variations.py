"""Layers of several variations or storeys on top of each other: one is shown, others by a tick."""

from __future__ import annotations

from qgis.core import QgsFeatureRenderer, QgsRuleBasedRenderer, QgsVectorLayer

#: The fields that tell what lies on top of each other apart, and what one of it is called.
FIELDS = {"variation": "variation", "floor": "storey", "design": "design"}


def by_variation(renderer: QgsFeatureRenderer, layer: QgsVectorLayer) -> QgsFeatureRenderer:
    """Return a renderer that shows one variation or storey of a layer at a time.

    Parameters
    ----------
    renderer
        How the features of one look.
    layer
        The layer; where it has none of the fields, or only one value in it, the renderer stays.
    """
    name = next((own for own in FIELDS if layer.fields().indexOf(own) >= 0), "")
    values = _values(layer, name) if name else []
    look = QgsRuleBasedRenderer.convertFromRenderer(renderer, layer) if len(values) > 1 else None
    if look is None:
        return renderer
    root = QgsRuleBasedRenderer.Rule(None)
    for value in values:
        rule = QgsRuleBasedRenderer.Rule(None)
        rule.setLabel(f"{FIELDS[name]} {value}")
        rule.setFilterExpression(f'"{name}" = {value}')
        rule.setActive(value == values[0])
        for child in look.rootRule().children():
            rule.appendChild(child.clone())
        root.appendChild(rule)
    return QgsRuleBasedRenderer(root)


def _values(layer: QgsVectorLayer, name: str) -> list[int]:
    """Return what a field tells apart, the first one to be shown; variations count from 1."""
    found = layer.uniqueValues(layer.fields().indexOf(name))
    numbers = [own for own in found if isinstance(own, int)]
    return sorted(own for own in numbers if own > 0 or name != "variation")
