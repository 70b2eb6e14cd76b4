"""How streets that grow look: by the type of their road, and by when they appeared."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsFeatureRenderer,
    QgsGraduatedSymbolRenderer,
    QgsRendererRange,
    QgsVectorLayer,
)

from .symbols import GREY, INK, by_value, line, marker

#: Main, large and small streets in the colours of the levels that they are of.
TYPES = (
    ("main", "main", "#8e2b1d", 1.9),
    ("large", "large", "#c8442c", 1.4),
    ("small", "small", "#e58a3a", 0.8),
)
#: From early to late.
_RAMP = ("#3b2a5c", "#5b4a8c", "#2f6f73", "#5f9e7a", "#a8b85c", "#e3b04b", "#d9753a", "#a8321f")


def _streets() -> QgsFeatureRenderer:
    renderer = by_value(
        "case when \"status\" = 'existing' then 'existing'"
        " when \"road_type\" in ('main', 'large', 'small') then \"road_type\" else 'edge' end",
        [
            ("existing", "existing", line(GREY, 1.0)),
            *((value, label, line(colour, width)) for value, label, colour, width in TYPES),
            ("edge", "along the edge", line("#c8442c", 1.0)),
        ],
    )
    # Main streets over the others wherever they meet.
    renderer.setUsingSymbolLevels(True)
    return renderer


def _nodes() -> QgsFeatureRenderer:
    return by_value(
        "if(\"node_type\" = 'start', 'start', \"kind\")",
        [
            ("start", "start", marker("star", "#2f6f73", 3.0)),
            ("junction", "junction", marker("circle", INK, 1.0)),
            ("bend", "bend", marker("circle", GREY, 0.7)),
            ("join", "meets an existing street", marker("diamond", "#2f6f73", 1.6)),
            ("at the edge", "at the edge", marker("square", GREY, 1.1)),
            ("dead end", "dead end", marker("square", "#c8442c", 1.2)),
        ],
    )


def _roads() -> QgsFeatureRenderer:
    """Roads by their length: the long ones stand out."""
    classes = (
        ("under 100 m", -1.0, 100.0, "#e8c9a0", 0.4),
        ("100 to 250 m", 100.0, 250.0, "#e3a35c", 0.6),
        ("250 to 500 m", 250.0, 500.0, "#d9753a", 0.9),
        ("500 to 1000 m", 500.0, 1000.0, "#b5402c", 1.3),
        ("1000 m and more", 1000.0, 1e9, "#7a1f1f", 1.8),
    )
    ranges = [
        QgsRendererRange(low, high, line(colour, width), label)
        for label, low, high, colour, width in classes
    ]
    renderer = QgsGraduatedSymbolRenderer("length_m", ranges)
    renderer.setUsingSymbolLevels(True)
    return renderer


def _by_iteration(layer: QgsVectorLayer) -> QgsFeatureRenderer:
    """Streets by when they appeared, in equal steps that span the layer."""
    index = layer.fields().indexOf("iteration")
    most = layer.maximumValue(index) if index >= 0 else None
    most = int(most) if isinstance(most, (int, float)) else 0
    step = max(1, -(-most // len(_RAMP)))
    ranges = [QgsRendererRange(-0.5, 0.5, line(GREY, 0.6), "there before")]
    for at, colour in enumerate(_RAMP):
        low, high = at * step + 1, (at + 1) * step
        if low > max(most, 1):
            break
        label = f"iteration {low}" if low == high else f"iterations {low} to {high}"
        ranges.append(QgsRendererRange(low - 0.5, high + 0.5, line(colour, 1.0), label))
    return QgsGraduatedSymbolRenderer("iteration", ranges)


GROWTH_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "grown_streets": _streets,
    "grown_nodes": _nodes,
    "grown_roads": _roads,
}
GROWTH_TITLES = {"grown_streets": "Type"}
GROWTH_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "grown_streets": {"Iteration": _by_iteration},
}
