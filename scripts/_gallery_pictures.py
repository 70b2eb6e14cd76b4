"""Maps of layouts in the styles that the plugin gives its layers, drawn by QGIS."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsDateTimeRange,
    QgsFillSymbol,
    QgsLineSymbol,
    QgsMapRendererCustomPainterJob,
    QgsMapSettings,
    QgsRectangle,
    QgsSingleSymbolRenderer,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QBuffer, QByteArray, QIODevice, QSize, Qt
from qgis.PyQt.QtGui import QColor, QFont, QImage, QPainter

#: Pixels per metre, the widest picture (pixels), its resolution, and the margin (metres).
SCALE, WIDEST, DPI, MARGIN = 1.4, 860, 96, 45.0
#: Colours of a picture, and the most bytes that it may have.
COLOURS, MOST = 96, 250_000
PAPER, GREY, INK = "#fbfaf7", "#b9b4aa", "#6b6459"
SITE = QgsFillSymbol.createSimple(
    {"color": "#eeeae0", "outline_color": "#8c867c", "outline_width": "0.25"}
)
ROADS = QgsLineSymbol.createSimple(
    {"color": GREY, "width": "0.5", "capstyle": "round", "joinstyle": "round"}
)
GROUND = QgsFillSymbol.createSimple({"color": "#d6e0d8", "outline_color": GREY})


def single(layer: QgsVectorLayer, symbol: Any) -> QgsVectorLayer:
    """Give a layer one symbol."""
    layer.setRenderer(QgsSingleSymbolRenderer(symbol.clone()))
    return layer


def window(layer: QgsVectorLayer) -> tuple[QgsRectangle, QSize]:
    """Return the ground that is shown around a site, and the size of its picture in pixels."""
    box = QgsRectangle(layer.extent()).buffered(MARGIN)
    scale = min(SCALE, WIDEST / max(box.width(), box.height()))
    return box, QSize(round(box.width() * scale), round(box.height() * scale))


def draw(
    layers: Sequence[QgsVectorLayer], around: QgsVectorLayer, credit: str, target: Path
) -> int:
    """Draw layers into a small picture.

    Parameters
    ----------
    layers
        From the top down.
    around
        The site, which says what ground is shown.
    credit
        Whose the data is, in the corner of the picture.
    target
        The file.

    Returns
    -------
    int
        Its bytes.

    Raises
    ------
    ValueError
        If the picture is too large.
    """
    box, size = window(around)
    return save(paint(layers, around, box, size, credit), target)


def paint(
    layers: Sequence[QgsVectorLayer],
    around: QgsVectorLayer,
    box: QgsRectangle,
    size: QSize,
    credit: str,
    *,
    dpi: float = DPI,
    moment: QgsDateTimeRange | None = None,
) -> QImage:
    """Draw layers into an image.

    Parameters
    ----------
    layers
        From the top down.
    around
        Its CRS is that of the map.
    box
        The ground that is shown.
    size
        Pixels.
    credit
        What stands in the lower right corner.
    dpi
        Pixels per inch: fewer make thinner lines.
    moment
        What of layers that play in time is shown, as the temporal controller does; None: all.
    """
    settings = QgsMapSettings()
    settings.setLayers(list(layers))
    settings.setDestinationCrs(QgsCoordinateReferenceSystem(around.crs()))
    settings.setExtent(box)
    settings.setOutputSize(size)
    settings.setOutputDpi(dpi)
    settings.setFlag(QgsMapSettings.Antialiasing)
    if moment is not None:
        settings.setIsTemporal(True)
        settings.setTemporalRange(moment)
    image = QImage(size, QImage.Format_ARGB32_Premultiplied)
    image.fill(QColor(PAPER))
    painter = QPainter(image)
    painter.setRenderHint(QPainter.Antialiasing)
    job = QgsMapRendererCustomPainterJob(settings, painter)
    job.renderSynchronously()
    write(painter, credit, Qt.AlignRight | Qt.AlignBottom)
    painter.end()
    return image


def write(painter: QPainter, text: str, where: Any, pixels: int = 10) -> None:
    """Write a text into a corner of what is painted on."""
    font = QFont("DejaVu Sans")
    font.setPixelSize(pixels)
    painter.setFont(font)
    painter.setPen(QColor(INK))
    painter.drawText(painter.window().adjusted(4, 4, -5, -3), int(where), text)


def save(image: QImage, target: Path, colours: int = COLOURS) -> int:
    """Write a picture with few colours; return its bytes."""
    data = QByteArray()
    buffer = QBuffer(data)
    buffer.open(QIODevice.WriteOnly)
    image.save(buffer, "PNG")
    with Image.open(io.BytesIO(bytes(data))) as opened:
        picture = opened.convert("RGB")
    few = picture.quantize(colours, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    target.parent.mkdir(parents=True, exist_ok=True)
    few.save(target, optimize=True)
    written = target.stat().st_size
    if written > MOST:
        msg = f"{target.name} has {written} bytes, more than {MOST}"
        raise ValueError(msg)
    return written
