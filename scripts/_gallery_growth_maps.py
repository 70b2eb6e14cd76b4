"""Pictures of growth that are more than one map: sheets, pairs, and frames in time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsDateTimeRange,
    QgsMarkerSymbol,
    QgsRectangle,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QDateTime, QSize, Qt
from qgis.PyQt.QtGui import QColor, QImage, QPainter

from _gallery_pictures import DPI, paint, save

#: Side of a picture of open ground, of one in a sheet, and of a frame (pixels).
SIDE, CELL, FRAME = 700, 284, 310
#: Height of the title of a cell (pixels), and what lies between two.
TITLE, GAP = 20, 4
#: Lines are thinner in small pictures, as on a map of smaller scale (pixels per inch).
THIN, MIDDLE = 34, 56
#: Places where streets meet without a junction.
FAULT = QgsMarkerSymbol.createSimple(
    {"name": "circle", "color": "#00000000", "outline_color": "#2457a6", "outline_width": "0.5",
     "size": "4.2"}
)  # fmt: skip


def square(layer: QgsVectorLayer, margin: float = 60.0) -> QgsRectangle:
    """Return the square around a layer."""
    box = QgsRectangle(layer.extent())
    side = max(box.width(), box.height()) / 2 + margin
    return around(box.center().x(), box.center().y(), 2 * side)


def around(x: float, y: float, side: float) -> QgsRectangle:
    """Return a square around a point."""
    return QgsRectangle(x - side / 2, y - side / 2, x + side / 2, y + side / 2)


def alone(layer: QgsVectorLayer, target: Path) -> int:
    """Draw streets on open ground, as large as they are; return the bytes of the picture."""
    size = QSize(SIDE, SIDE)
    return save(paint([layer], layer, square(layer), size, "", dpi=MIDDLE), target)


def sheet(layers: Sequence[tuple[str, QgsVectorLayer]], columns: int, target: Path) -> int:
    """Draw streets on open ground side by side, each with its title."""
    size = QSize(CELL, CELL)
    cells = [
        (title, paint([layer], layer, square(layer), size, "", dpi=THIN)) for title, layer in layers
    ]
    return save(beside(cells, columns), target)


def beside(cells: Sequence[tuple[str, QImage]], columns: int) -> QImage:
    """Put pictures of one size side by side, each below its title."""
    wide, high = cells[0][1].width() + GAP, cells[0][1].height() + TITLE
    rows = -(-len(cells) // columns)
    whole = QImage(wide * columns - GAP, high * rows, QImage.Format_ARGB32_Premultiplied)
    whole.fill(QColor("#ffffff"))
    painter = QPainter(whole)
    font = painter.font()
    font.setFamily("DejaVu Sans")
    font.setPixelSize(13)
    painter.setFont(font)
    for at, (title, image) in enumerate(cells):
        x, y = wide * (at % columns), high * (at // columns)
        painter.drawText(x + 4, y, wide - 8, TITLE, int(Qt.AlignLeft | Qt.AlignVCenter), title)
        painter.drawImage(x, y + TITLE, image)
    painter.end()
    return whole


def zoomed(layers: Sequence[QgsVectorLayer], box: QgsRectangle, target: Path) -> int:
    """Draw a part of open ground."""
    return save(paint(layers, layers[-1], box, QSize(SIDE, SIDE), ""), target)


def played(
    layers: Sequence[QgsVectorLayer],
    site: QgsVectorLayer,
    days: Sequence[tuple[int, QDateTime]],
    credit: str,
    target: Path,
) -> int:
    """Draw what the temporal controller shows on some days, side by side.

    Parameters
    ----------
    layers
        From the top down; those that play in time do.
    site
        Says what ground is shown.
    days
        Iterations, and the moments in which they begin.
    credit
        Whose the data is.
    target
        The file.
    """
    cells = []
    for at, (iteration, begin) in enumerate(days):
        moment = QgsDateTimeRange(begin, begin.addDays(1), True, False)
        said = credit if at == len(days) - 1 else ""
        image = paint(
            layers, site, square(site), QSize(FRAME, FRAME), said, dpi=MIDDLE, moment=moment
        )
        cells.append((f"day {iteration}", image))
    return save(beside(cells, len(cells)), target)


def whole(layers: Sequence[QgsVectorLayer], credit: str, target: Path, dpi: float = DPI) -> int:
    """Draw all of a layer of streets, as a map of a town."""
    box: Any = QgsRectangle(layers[-1].extent()).buffered(60.0)
    scale = 860 / max(box.width(), box.height())
    size = QSize(round(box.width() * scale), round(box.height() * scale))
    return save(paint(layers, layers[-1], box, size, credit, dpi=dpi), target)
