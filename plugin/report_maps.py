"""Maps of layers as pictures: drawn by QGIS with their own styles, with the legend beside them.

Nothing here needs the window of QGIS, and all of it may run in the thread of a tool: layers are
copies that belong to that thread, see `copies`.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Sequence

from qgis.core import (
    QgsBearingUtils,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCoordinateTransformContext,
    QgsCsException,
    QgsDistanceArea,
    QgsExpressionContext,
    QgsExpressionContextUtils,
    QgsFeatureRequest,
    QgsMapLayer,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsPointXY,
    QgsRectangle,
    QgsRenderContext,
    QgsSymbol,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QBuffer, QByteArray, QEventLoop, QIODevice, QSize, Qt, QThread
from qgis.PyQt.QtGui import QColor, QImage, QPainter

from ..algorithms.errors import CancelledError
from ..algorithms.report import LegendEntry, Picture
from .progress import FeedbackProgress

#: Width of a map on a sheet of A4 within its margins, mm: symbols have their true size there.
PAPER_MM = 178.0
#: Slimmest and tallest shape of a map: height / width.
FLATTEST, TALLEST = 0.45, 1.05
#: Ground around what is shown, as a share of its larger side.
MARGIN = 0.06
#: Ground around a single point, in units of the map.
LEAST = 50.0
#: Width of the small copy of a picture, pixels.
SMALL = 900
#: Symbols of a legend: size in pixels, and how fine they are.
_SYMBOL, _DPI = (84, 54), 288.0
_MM = 25.4
#: How long one look at events may take, and how long there is none (ms).
_LOOK = 20
_CHUNK = 500


def copies(layers: Iterable[QgsMapLayer]) -> list[QgsMapLayer]:
    """Return copies of layers that belong to no thread yet; `claim` takes them.

    Layers belong to the thread of the window, which may change or delete them while a tool runs.
    """
    made = []
    for layer in layers:
        copy = layer.clone()
        if isinstance(copy, QgsVectorLayer):
            copy.removeSelection()
        copy.moveToThread(None)
        made.append(copy)
    return made


def claim(layers: Iterable[QgsMapLayer]) -> None:
    """Take copies of layers into this thread."""
    here = QThread.currentThread()
    for layer in layers:
        if layer.thread() is None:
            layer.moveToThread(here)


class Sheet:
    """Ground, scale and coordinate reference system that several maps share.

    Parameters
    ----------
    layers
        What must be on it, as a whole.
    width
        Width of its pictures in pixels.
    transforms
        How the project transforms coordinates.
    """

    def __init__(
        self, layers: Sequence[QgsMapLayer], width: int, transforms: QgsCoordinateTransformContext
    ) -> None:
        self.transforms = transforms
        self.crs = _crs_of(layers)
        self.box = box_of(layers, self.crs, transforms)
        side = max(self.box.width(), self.box.height())
        # a single point has no ground of its own
        self.box.grow(MARGIN * side if side > 0 else LEAST)
        shape = min(max(self.box.height() / self.box.width(), FLATTEST), TALLEST)
        self.width, self.height = width, round(width * shape)
        # the shorter side gets more ground, so that a pixel is as wide as it is high
        centre, per_pixel = self.box.center(), self._per_pixel()
        self.box = QgsRectangle.fromCenterAndSize(
            centre, per_pixel * self.width, per_pixel * self.height
        )

    def _per_pixel(self) -> float:
        return max(self.box.width() / self.width, self.box.height() / self.height)

    @property
    def ground(self) -> float:
        """Width of the ground in its middle, m, on the ellipsoid."""
        measure = QgsDistanceArea()
        measure.setSourceCrs(self.crs, self.transforms)
        measure.setEllipsoid(self.crs.ellipsoidAcronym() or "EPSG:7030")
        middle = self.box.center().y()
        ends = [QgsPointXY(x, middle) for x in (self.box.xMinimum(), self.box.xMaximum())]
        return float(measure.measureLine(*ends))

    @property
    def north(self) -> float:
        """Direction of true north in its middle, degrees clockwise from up."""
        try:
            middle = self.box.center()
            return float(QgsBearingUtils.bearingTrueNorth(self.crs, self.transforms, middle))
        except QgsCsException:
            return 0.0

    @property
    def crs_text(self) -> str:
        """The coordinate reference system as a reader knows it."""
        if not self.crs.authid():
            return "metres around the middle of the map"
        return f"{self.crs.description()} ({self.crs.authid()})"

    def picture(
        self,
        title: str,
        alt: str,
        layers: Sequence[QgsMapLayer],
        progress: FeedbackProgress,
        *,
        below: Sequence[QgsMapLayer] = (),
        small: bool = False,
    ) -> Picture:
        """Draw layers, the first on top.

        Parameters
        ----------
        title, alt
            What the picture shows, in few words and in a sentence.
        layers
            The layers.
        progress
            Asked whether to stop.
        below
            Layers below them that the legend leaves out.
        small
            Whether a small copy is made, too.

        Raises
        ------
        CancelledError
            The run was cancelled meanwhile.
        """
        image = self._drawn([*layers, *below], progress)
        parts = [
            legend_of(layer, self.crs, self.box, self.transforms, progress) for layer in layers
        ]
        # what has one symbol first: below a heading it would seem to belong to it
        legend = [own for part in sorted(parts, key=lambda part: len(part) > 1) for own in part]
        copy = b""
        if small:
            smooth = Qt.TransformationMode.SmoothTransformation
            copy = _png(image.scaledToWidth(SMALL, smooth)) if self.width > SMALL else b""
        return Picture(
            title, alt, _png(image), self.width, self.height, self.ground, self.crs_text,
            self.north, tuple(legend), copy,
        )  # fmt: skip

    def _drawn(self, layers: Sequence[QgsMapLayer], progress: FeedbackProgress) -> QImage:
        settings = QgsMapSettings()
        settings.setLayers(list(layers))
        settings.setDestinationCrs(self.crs)
        settings.setTransformContext(self.transforms)
        settings.setOutputSize(QSize(self.width, self.height))
        settings.setOutputDpi(self.width / (PAPER_MM / _MM))
        settings.setExtent(self.box)
        settings.setBackgroundColor(QColor("#ffffff"))
        job = QgsMapRendererParallelJob(settings)
        # a loop of its own: the thread of a tool has none, and the job tells of its end by events
        loop = QEventLoop()
        job.start()
        while job.isActive():
            loop.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, _LOOK)
            if progress.cancelled():
                job.cancel()
                raise CancelledError
            QThread.msleep(_LOOK)
        return job.renderedImage()


def _crs_of(layers: Sequence[QgsMapLayer]) -> QgsCoordinateReferenceSystem:
    """Return the first projected CRS of layers, or one around their middle, in metres."""
    for layer in layers:
        if layer.crs().isValid() and not layer.crs().isGeographic():
            return layer.crs()
    first = next(
        (own for own in layers if own.crs().isValid() and not own.extent().isEmpty()), None
    )
    if first is None:
        return QgsCoordinateReferenceSystem("EPSG:3857")
    middle = first.extent().center()
    text = f"+proj=laea +lat_0={middle.y():.4f} +lon_0={middle.x():.4f} +datum=WGS84 +units=m"
    return QgsCoordinateReferenceSystem.fromProj(f"{text} +no_defs +type=crs")


def box_of(
    layers: Sequence[QgsMapLayer],
    crs: QgsCoordinateReferenceSystem,
    transforms: QgsCoordinateTransformContext,
) -> QgsRectangle:
    """Return the ground of layers in a CRS; those that have no place in it are left out."""
    box = QgsRectangle()
    box.setMinimal()
    for layer in layers:
        own = extent_of(layer)
        if own is None:
            continue
        with contextlib.suppress(QgsCsException):
            turn = QgsCoordinateTransform(layer.crs(), crs, transforms)
            box.combineExtentWith(turn.transformBoundingBox(own))
    return box


def extent_of(layer: QgsMapLayer) -> QgsRectangle | None:
    """Return the extent of a layer, or None where it has none."""
    if isinstance(layer, QgsVectorLayer):
        if not layer.isSpatial() or layer.featureCount() == 0:
            return None
        layer.updateExtents()
    box = layer.extent()
    numbers = (box.xMinimum(), box.yMinimum(), box.xMaximum(), box.yMaximum())
    return box if all(map(math.isfinite, numbers)) and numbers[0] <= numbers[2] else None


def legend_of(
    layer: QgsMapLayer,
    crs: QgsCoordinateReferenceSystem,
    box: QgsRectangle,
    transforms: QgsCoordinateTransformContext,
    progress: FeedbackProgress,
) -> list[LegendEntry]:
    """Return the legend of a layer, with those symbols only that some feature in a box has."""
    if not isinstance(layer, QgsVectorLayer) or layer.renderer() is None:
        return [LegendEntry(layer.name())]
    items = [own for own in layer.renderer().legendSymbolItems() if own.symbol() is not None]
    used = _used_keys(layer, crs, box, transforms, progress)
    # some renderers, as heat maps, do not tell which symbol a feature has
    items = [own for own in items if own.ruleKey() in used] or (items if not used else [])
    if len(items) == 1:
        label = items[0].label()
        whole = f"{layer.name()}: {label}" if label and label != layer.name() else layer.name()
        return [LegendEntry(whole, symbol_png(items[0].symbol()))]
    entries = [LegendEntry(own.label() or "other", symbol_png(own.symbol())) for own in items]
    return [LegendEntry(layer.name()), *entries] if entries else []


def _used_keys(
    layer: QgsVectorLayer,
    crs: QgsCoordinateReferenceSystem,
    box: QgsRectangle,
    transforms: QgsCoordinateTransformContext,
    progress: FeedbackProgress,
) -> set[str]:
    request = QgsFeatureRequest()
    # where the box has no place in the CRS of the layer, all features count
    with contextlib.suppress(QgsCsException):
        turn = QgsCoordinateTransform(crs, layer.crs(), transforms)
        request.setFilterRect(turn.transformBoundingBox(box))
    context = QgsRenderContext()
    scopes = QgsExpressionContext()
    scopes.appendScope(QgsExpressionContextUtils.layerScope(layer))
    scopes.setFields(layer.fields())
    context.setExpressionContext(scopes)
    renderer = layer.renderer().clone()
    renderer.startRender(context, layer.fields())
    found: set[str] = set()
    for count, feature in enumerate(layer.getFeatures(request)):
        if count % _CHUNK == 0 and progress.cancelled():
            renderer.stopRender(context)
            raise CancelledError
        context.expressionContext().setFeature(feature)
        found |= set(renderer.legendKeysForFeature(feature, context))
    renderer.stopRender(context)
    return found


def symbol_png(symbol: QgsSymbol) -> bytes:
    """Return a symbol as a small picture."""
    image = QImage(*_SYMBOL, QImage.Format.Format_ARGB32_Premultiplied)
    image.setDotsPerMeterX(round(_DPI / _MM * 1000))
    image.setDotsPerMeterY(round(_DPI / _MM * 1000))
    image.fill(QColor("#ffffff"))
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    context = QgsRenderContext.fromQPainter(painter)
    symbol.clone().drawPreviewIcon(painter, QSize(*_SYMBOL), context)
    painter.end()
    return _png(image)


def _png(image: QImage) -> bytes:
    data = QByteArray()
    buffer = QBuffer(data)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    image.save(buffer, "PNG")
    buffer.close()
    return bytes(data)
