"""How measured streets look: natural streets by their class, traffic from blue to red."""

from __future__ import annotations

import math
from collections.abc import Callable

from qgis.core import (
    QgsFeatureRenderer,
    QgsGraduatedSymbolRenderer,
    QgsRendererRange,
    QgsVectorLayer,
)

from .symbols import GREY, by_value, line, marker

#: From little to much.
COLD_HOT = ("#3b6ea5", "#7fb0c9", "#c9d6b0", "#f0c572", "#e0803f", "#b5302a")
_WIDTHS = (0.3, 0.4, 0.6, 0.8, 1.1, 1.5)
#: Classes of natural streets that have a colour of their own; there are seldom more.
_CLASSES = 6


def _none() -> QgsRendererRange:
    """Return the class of what was not measured; each renderer owns its symbols."""
    return QgsRendererRange(-2.0, -1e-9, line(GREY, 0.2), "not measured")


def _hierarchy() -> QgsFeatureRenderer:
    """Streets by the class of their natural street, those that meet most on top."""
    labels = ["1: meet few streets", *(str(k) for k in range(2, _CLASSES))]
    labels.append(f"{_CLASSES} and more: meet most")
    ranges = [_none()]
    for at, (colour, width, label) in enumerate(zip(COLD_HOT, _WIDTHS, labels), 1):
        high = at + 0.5 if at < _CLASSES else 1e9
        ranges.append(QgsRendererRange(at - 0.5, high, line(colour, width), label))
    renderer = QgsGraduatedSymbolRenderer('coalesce("hierarchy", -1)', ranges)
    renderer.setUsingSymbolLevels(True)
    return renderer


def _most(layer: QgsVectorLayer, field: str) -> float:
    """Return the largest value of a field, 0 where there is none."""
    index = layer.fields().indexOf(field)
    found = layer.maximumValue(index) if index >= 0 else None
    return float(found) if isinstance(found, (int, float)) and math.isfinite(found) else 0.0


def _by_share(field: str, shares: tuple[float, ...]) -> Callable[..., QgsFeatureRenderer]:
    """Return what makes a renderer by a field, in classes that are shares of its largest value."""

    def make(layer: QgsVectorLayer) -> QgsFeatureRenderer:
        most = _most(layer, field)
        bounds = [0.0, *(share * most for share in shares), most * 1.001 + 1e-9]
        ranges = [_none()]
        for low, high, colour, width in zip(bounds, bounds[1:], COLD_HOT, _WIDTHS):
            label = f"{low:.3g} to {min(high, most):.3g}"
            ranges.append(QgsRendererRange(low, high, line(colour, width), label))
        renderer = QgsGraduatedSymbolRenderer(f'coalesce("{field}", -1)', ranges)
        renderer.setUsingSymbolLevels(True)
        return renderer

    return make


def _bearing(_: QgsVectorLayer) -> QgsFeatureRenderer:
    """Streets by their direction, from east around to east: the colours come back as it does."""
    shades = ("#b5302a", "#e0a03f", "#7f9a3f", "#2f7f86", "#5b5fa8", "#99467f")
    names = ("north", "30", "60", "east", "120", "150")
    ranges = [_none()]
    for at, (shade, name) in enumerate(zip(shades, names)):
        label = f"{name}, {30 * at} degrees" if name.isalpha() else f"{name} degrees"
        ranges.append(QgsRendererRange(30 * at, 30 * at + 30, line(shade, 0.7), label))
    turned = '("bearing_deg" + 15) - 180 * floor(("bearing_deg" + 15) / 180)'
    return QgsGraduatedSymbolRenderer(f"coalesce({turned}, -1)", ranges)


def _dead_ends(_: QgsVectorLayer) -> QgsFeatureRenderer:
    return by_value(
        "if(\"dead_end\", 'dead end', '')",
        [("", "goes on", line(GREY, 0.5)), ("dead end", "dead end", line("#b5302a", 1.0))],
    )


def _junctions() -> QgsFeatureRenderer:
    return by_value(
        "degree",
        [
            (1, "dead end", marker("square", "#b5302a", 1.6)),
            (3, "3 streets", marker("circle", "#7fb0c9", 1.6)),
            (4, "4 streets", marker("circle", "#3b6ea5", 2.0)),
            ("", "5 and more", marker("diamond", "#4a443b", 2.6)),
        ],
    )


def _kinds(_: QgsVectorLayer) -> QgsFeatureRenderer:
    return by_value(
        "kind",
        [
            ("dead end", "dead end", marker("square", "#b5302a", 1.6)),
            ("T", "T", marker("triangle", "#3b6ea5", 2.0)),
            ("Y", "Y", marker("triangle", "#e0803f", 2.0)),
            ("X", "X", marker("diamond", "#3b6ea5", 2.2)),
            ("K", "K: four, not crossing", marker("diamond", "#e0803f", 2.2)),
            ("star", "five and more", marker("star", "#4a443b", 3.0)),
        ],
    )


_TRAFFIC = _by_share("betweenness", (0.01, 0.05, 0.15, 0.3, 0.6))
_NEAR = _by_share("closeness", (0.5, 0.6, 0.7, 0.8, 0.9))
STREET_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "measured_streets": _hierarchy,
    "natural_streets": _hierarchy,
    "measured_junctions": _junctions,
}
STREET_TITLES = {"measured_streets": "Natural streets", "measured_junctions": "Number of streets"}
STREET_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "measured_streets": {
        "Betweenness": _TRAFFIC,
        "Closeness": _NEAR,
        "Direction": _bearing,
        "Dead ends": _dead_ends,
    },
    "measured_junctions": {"Kind": _kinds},
}
