"""How the output layers look: made in code, so that every version of QGIS reads them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from qgis.core import (
    QgsCategorizedSymbolRenderer,
    QgsFeatureRenderer,
    QgsFillSymbol,
    QgsGraduatedSymbolRenderer,
    QgsLineSymbol,
    QgsMarkerSymbol,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsRendererCategory,
    QgsRendererRange,
    QgsSingleSymbolRenderer,
    QgsSymbol,
    QgsVectorLayer,
)

from .fields import LayerKind
from .record import Record

GREY = "#8c867c"
INK = "#4a443b"


def _line(colour: str, width: float, style: str = "solid") -> QgsSymbol:
    return QgsLineSymbol.createSimple(
        {
            "line_color": colour,
            "line_width": str(width),
            "line_style": style,
            "capstyle": "round",
            "joinstyle": "round",
        }
    )


def _fill(colour: str, outline: str, width: float = 0.2, style: str = "solid") -> QgsSymbol:
    return QgsFillSymbol.createSimple(
        {"color": colour, "style": style, "outline_color": outline, "outline_width": str(width)}
    )


def _marker(name: str, colour: str, size: float, outline: str = "#ffffff") -> QgsSymbol:
    return QgsMarkerSymbol.createSimple(
        {
            "name": name,
            "color": colour,
            "size": str(size),
            "outline_color": outline,
            "outline_width": "0.2",
        }
    )


def _by_value(field: str, entries: Sequence[tuple[Any, str, QgsSymbol]]) -> QgsFeatureRenderer:
    categories = [QgsRendererCategory(value, symbol, label) for value, label, symbol in entries]
    return QgsCategorizedSymbolRenderer(field, categories)


def _streets() -> QgsFeatureRenderer:
    renderer = _by_value(
        "if(\"status\" = 'new', \"level\", 'existing')",
        [
            ("existing", "existing", _line(GREY, 1.0)),
            (1, "major", _line("#8e2b1d", 1.9)),
            (2, "collector", _line("#c8442c", 1.4)),
            (3, "local", _line("#e58a3a", 0.8)),
            (4, "cul-de-sac", _line("#f0b56a", 0.6)),
            ("", "connector or other", _line("#c8442c", 0.6, "dash")),
        ],
    )
    # Collectors over locals wherever they meet.
    renderer.setUsingSymbolLevels(True)
    return renderer


def _blocks() -> QgsFeatureRenderer:
    shades = (
        ("under 40 m", 0, 40, "#f6d7c8"),
        ("40 to 60 m", 40, 60, "#f5ecd2"),
        ("60 to 80 m", 60, 80, "#dfe8c9"),
        ("80 to 110 m", 80, 110, "#c2dbc6"),
        ("110 m and more", 110, 1e9, "#a6c8cc"),
    )
    ranges = [
        QgsRendererRange(low, high, _fill(colour, GREY), f"width {label}")
        for label, low, high, colour in shades
    ]
    return QgsGraduatedSymbolRenderer("width_m", ranges)


def _junctions() -> QgsFeatureRenderer:
    return _by_value(
        'coalesce("is_sink", false)',
        [
            (False, "street junction", _marker("circle", INK, 1.2)),
            (True, "way out of the site", _marker("circle", "#2f6f73", 2.2)),
        ],
    )


def _problems() -> QgsFeatureRenderer:
    return _by_value(
        "severity",
        [
            ("error", "error", _marker("cross_fill", "#c00000", 4.0)),
            ("warning", "warning", _marker("triangle", "#f0a000", 3.4)),
            ("info", "information", _marker("circle", "#4f7fb5", 2.2)),
        ],
    )


def _vertices() -> QgsFeatureRenderer:
    return _by_value(
        "role",
        [
            ("corner", "corner", _marker("square", INK, 1.6)),
            ("irregular", "inner, irregular", _marker("diamond", "#c8442c", 1.8)),
            ("boundary", "boundary", _marker("circle", GREY, 0.8)),
            ("inner", "inner", _marker("circle", GREY, 0.8)),
        ],
    )


def _edges() -> QgsFeatureRenderer:
    return _by_value(
        "if(\"blocked\" OR \"foreign\", 'barred', 'open')",
        [
            ("open", "may become a street", _line(GREY, 0.15)),
            ("barred", "crosses an obstacle or foreign ground", _line("#c8442c", 0.2, "dot")),
        ],
    )


#: Styles by the names that `fields` uses; each makes a fresh renderer.
RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "streets": _streets,
    "junctions": _junctions,
    "blocks": _blocks,
    "problems": _problems,
    "vertices": _vertices,
    "edges": _edges,
    "site": lambda: QgsSingleSymbolRenderer(_fill("160,176,96,50", "#55702f", 0.6)),
    "existing": lambda: QgsSingleSymbolRenderer(_line(GREY, 1.0)),
    "access": lambda: QgsSingleSymbolRenderer(_marker("triangle", "#2f6f73", 3.0)),
    "obstacles": lambda: QgsSingleSymbolRenderer(_fill("#9b3a2f", "#9b3a2f", 0.3, "b_diagonal")),
    "faces": lambda: QgsSingleSymbolRenderer(_fill("#f5f1e8", "#d8d2c6", 0.1)),
}


def apply(layer: QgsVectorLayer, kind: LayerKind) -> None:
    """Give a layer the style of its kind."""
    layer.setRenderer(RENDERERS[kind.style]())
    if kind.style == "blocks":
        layer.setOpacity(0.8)
    layer.triggerRepaint()


def save(layer: QgsVectorLayer, kind: LayerKind) -> None:
    """Give a layer its style and keep it with the file, so that it opens like this anywhere."""
    apply(layer, kind)
    if layer.dataProvider().storageType() == "GPKG":
        layer.saveStyleToDatabase(kind.style, kind.title, True, "")
    else:
        layer.saveDefaultStyle()


class _PostProcessor(QgsProcessingLayerPostProcessorInterface):
    """Styles one layer once it is loaded, unless the planner has set a style for it."""

    def __init__(self, tool: str, key: str, kind: LayerKind, record: Record) -> None:
        super().__init__()
        self.tool = tool
        self.key = key
        self.kind = kind
        self.record = record

    def postProcessLayer(
        self,
        layer: QgsVectorLayer,
        context: QgsProcessingContext,  # noqa: ARG002
        feedback: QgsProcessingFeedback,  # noqa: ARG002
    ) -> None:
        """Give the layer its style and its record; QGIS calls this in its main thread."""
        from processing.gui.RenderingStyles import RenderingStyles

        if not RenderingStyles.getStyle(self.tool, self.key):
            apply(layer, self.kind)
        self.record.attach(layer)


# QGIS keeps no reference to post-processors: without this they vanish before they are called.
_kept: deque[_PostProcessor] = deque(maxlen=500)


def post_processor(tool: str, key: str, kind: LayerKind, record: Record) -> _PostProcessor:
    """Return a post-processor for one layer and keep it alive."""
    processor = _PostProcessor(tool, key, kind, record)
    _kept.append(processor)
    return processor
