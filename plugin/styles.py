"""How the output layers look, unless the planner has a style of his own for them.

What counts, the first that there is: a style that the planner has set for an output of a tool or
a model, or for lines, points or polygons in the options of Processing; a style that is stored as
the default with the file that is written; ours.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from pathlib import Path

from qgis.core import (
    QgsExpression,
    QgsFeatureRenderer,
    QgsMapLayerStyle,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsProject,
    QgsVectorLayer,
)
from qgis.PyQt.QtXml import QDomDocument

from . import compat, geopackage, temporal
from .fields import LayerKind
from .record import Record
from .renderers import LABELS, OTHERS, RENDERERS, TITLES
from .solids import solid_renderer
from .variations import by_variation

#: Letters that a GeoPackage has for the name of a style.
LONGEST = 30
#: Begins the description of a style of ours in a database.
OURS = "Platwright: "
#: Tells in a .qml file which layer it was made for.
_MARK = "platwright/style"


@dataclass(frozen=True)
class OwnStyle:
    """A default style of the planner's that was found with a file: its name, its text, QML."""

    name: str
    description: str
    qml: str


def apply(
    layer: QgsVectorLayer, kind: LayerKind, renderer: QgsFeatureRenderer | None = None
) -> None:
    """Give a layer the style of its kind, with the renderer of that style where it was made."""
    if not kind.style:
        return  # a table
    temporal.play(layer, kind)
    layer.setRenderer(renderer or by_variation(RENDERERS[kind.style](), layer))
    if kind.style == "blocks":
        layer.setOpacity(0.8)
    if kind.style in LABELS:
        layer.setLabeling(LABELS[kind.style]())
        layer.setLabelsEnabled(True)
    solid = solid_renderer(kind)
    if solid is not None:
        layer.setRenderer3D(solid)
    layer.triggerRepaint()


def offer_others(layer: QgsVectorLayer, kind: LayerKind) -> None:
    """Add the further styles of its kind to the styles of a layer, which keeps its present one."""
    if not kind.style:
        return
    manager = layer.styleManager()
    shown = layer.renderer().clone()
    for title, make in OTHERS.get(kind.style, {}).items():
        layer.setRenderer(by_variation(make(layer), layer))
        if not _fits(layer):
            continue
        style = QgsMapLayerStyle()
        style.readFromLayer(layer)
        manager.addStyle(title, style)
    layer.setRenderer(shown)


def _fits(layer: QgsVectorLayer) -> bool:
    """Tell whether a layer has the fields that it is drawn by: Shapefiles shorten their names."""
    value = getattr(layer.renderer(), "classAttribute", str)()
    names = {name.lower() for name in layer.fields().names()}
    return all(name.lower() in names for name in QgsExpression(value).referencedColumns())


def own_style(path: Path, table: str, kind: LayerKind) -> OwnStyle | None:
    """Return the default style of the planner's that is stored with a file, or None.

    Parameters
    ----------
    path
        A file that a layer is about to be written to.
    table
        Name of the layer in it.
    kind
        What is to be written.
    """
    if path.suffix.lower() == ".gpkg":
        return _in_geopackage(path, table) if path.is_file() else None
    beside = path.with_suffix(".qml")
    if not beside.is_file():
        return None
    qml = beside.read_text(encoding="utf-8", errors="replace")
    # One that was made here for a layer of another kind is nobody's wish.
    foreign = _MARK in qml and f'value="{kind.style}"' not in qml
    return None if foreign else OwnStyle(kind.style, "", qml)


def _in_geopackage(path: Path, table: str) -> OwnStyle | None:
    dataset = geopackage.open_dataset(str(path))
    if dataset is None or dataset.GetLayerByName("layer_styles") is None:
        return None
    styles = dataset.GetLayerByName("layer_styles")
    found = [
        OwnStyle(row["styleName"] or "", row["description"] or "", row["styleQML"] or "")
        for row in styles
        if row["f_table_name"] == table and row["useAsDefault"]
    ]
    return next((own for own in found if not own.description.startswith(OURS)), None)


def save(source: str, kind: LayerKind, own: OwnStyle | None = None) -> None:
    """Keep a layer's styles with its file, so that it opens like this anywhere.

    Parameters
    ----------
    source
        The layer in the file, as QGIS names it.
    kind
        What it holds.
    own
        The planner's own default, which stays the default.
    """
    layer = QgsVectorLayer(source, kind.title, "ogr")
    if not kind.style or not layer.isValid():
        return
    if layer.dataProvider().storageType() == "GPKG":
        _save_in_geopackage(layer, kind, own)
        del layer
        geopackage.end_journal(geopackage.parts(source)[0])
    elif own is None:  # else it lies beside the file
        apply(layer, kind)
        layer.setCustomProperty(_MARK, kind.style)
        compat.save_default_style(layer)


def stored_name(style: str, title: str) -> str:
    """Return what a further style is called in a GeoPackage, as long as that allows."""
    return f"{style[: max(4, LONGEST - 2 - len(title))]}, {title}"[:LONGEST]


def _save_in_geopackage(layer: QgsVectorLayer, kind: LayerKind, own: OwnStyle | None) -> None:
    temporal.play(layer, kind)
    # Once a style is stored, the values of the file cannot be asked for without spoiling it.
    others = {
        title: by_variation(make(layer), layer)
        for title, make in OTHERS.get(kind.style, {}).items()
    }
    shown = by_variation(RENDERERS[kind.style](), layer)
    for title, renderer in others.items():
        layer.setRenderer(renderer)
        name = stored_name(kind.style, title)
        layer.saveStyleToDatabase(name, f"{OURS}{title}", False, "")
    apply(layer, kind, shown)
    layer.setCustomProperty(_MARK, kind.style)
    layer.saveStyleToDatabase(kind.style, f"{OURS}{kind.title}", own is None, "")
    if own is not None:
        document = QDomDocument()
        document.setContent(own.qml)
        layer.importNamedStyle(document)
        layer.saveStyleToDatabase(own.name, own.description, True, "")


def _planner_has_set(tool: str, key: str, layer: QgsVectorLayer) -> bool:
    """Tell whether Processing has given a layer a style that the planner chose."""
    from processing.core.ProcessingConfig import ProcessingConfig
    from processing.gui.RenderingStyles import RenderingStyles

    general = ("VECTOR_POINT_STYLE", "VECTOR_LINE_STYLE", "VECTOR_POLYGON_STYLE")
    kind = int(layer.geometryType())
    return bool(
        RenderingStyles.getStyle(tool, key)
        or (kind < len(general) and ProcessingConfig.getSetting(general[kind]))
        # A new layer has one symbol: whatever else it has comes from the model that it is of.
        or layer.renderer() is None
        or layer.renderer().type() != "singleSymbol"
    )


class _PostProcessor(QgsProcessingLayerPostProcessorInterface):
    """Styles one layer once it is loaded, unless the planner has set a style for it."""

    def __init__(
        self, tool: str, key: str, kind: LayerKind, record: Record, source: str, stored: bool
    ) -> None:
        super().__init__()
        self.tool = tool
        self.key = key
        self.kind = kind
        self.record = record
        self.source = source
        self.stored = stored

    def postProcessLayer(
        self,
        layer: QgsVectorLayer,
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,  # noqa: ARG002
    ) -> None:
        """Give the layer its style and its record; QGIS calls this in its main thread."""
        # A file has brought its style with it.
        if not self.stored and not _planner_has_set(self.tool, self.key, layer):
            apply(layer, self.kind)
            manager = layer.styleManager()
            if self.kind.style in TITLES:
                manager.renameStyle(manager.currentStyle(), TITLES[self.kind.style])
        # QGIS forgets that part of the style of a file as soon as it has read it.
        temporal.play(layer, self.kind)
        offer_others(layer, self.kind)
        self.record.attach(layer)
        self._rename(layer, context.project())

    def _rename(self, layer: QgsVectorLayer, project: QgsProject | None) -> None:
        """Tell the layer from others of its name, as of the other runs of a batch."""
        if project is None or not self.source or layer.name() != self.kind.title:
            return
        if any(other.id() != layer.id() for other in project.mapLayersByName(layer.name())):
            layer.setName(f"{self.kind.title} ({self.source})")


# QGIS keeps no reference to post-processors: without this they vanish before they are called.
_kept: deque[_PostProcessor] = deque(maxlen=500)


def post_processor(
    tool: str, key: str, kind: LayerKind, record: Record, *, source: str = "", stored: bool = False
) -> _PostProcessor:
    """Return a post-processor for one layer and keep it alive.

    Parameters
    ----------
    tool, key, kind, record
        Id of the tool, key of the output, what it holds and how it was made.
    source
        Name of the layer that it was made from.
    stored
        Whether the layer is a file that has its style with it.
    """
    processor = _PostProcessor(tool, key, kind, record, source, stored)
    _kept.append(processor)
    return processor
