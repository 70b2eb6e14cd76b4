"""Maps of residential zones: sheets of plans, and a plan that is large."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from qgis.core import QgsRectangle, QgsVectorLayer
from qgis.PyQt.QtCore import QSize

from _gallery_growth_maps import beside
from _gallery_pictures import paint, save

#: Width of a sheet (pixels), how high one of its maps may be for its width, and the ratio of width
#: to height of a zone from which on two stand side by side instead of three.
SHEET, TALLEST, WIDE = 1200, 1.5, 1.5
#: Colours of a sheet: small buildings keep theirs.
COLOURS = 224
#: Lines are thinner in small maps (pixels per inch).
THIN, MIDDLE = 44, 80
#: The longer side of a large map (pixels).
LARGE = 900
#: Ground that is shown around a zone (metres).
AROUND = 18.0


def window(site: QgsVectorLayer, width: float, tallest: float) -> tuple[QgsRectangle, QSize]:
    """Return the ground that is shown, and pixels for it."""
    box = QgsRectangle(site.extent()).buffered(AROUND)
    scale = min(width / box.width(), tallest / box.height())
    return box, QSize(round(box.width() * scale), round(box.height() * scale))


def sheet(
    plans: Sequence[tuple[str, Sequence[QgsVectorLayer], Any]], credit: str, target: Path
) -> int:
    """Draw plans of one zone side by side, north up; return the bytes of the picture.

    Parameters
    ----------
    plans
        The title, the layers from the top down, and the zone of each.
    credit
        Whose the data is; stands in the last map.
    target
        The file.
    """
    extent = plans[0][2].extent()
    columns = 2 if extent.width() > WIDE * extent.height() else 3
    cell = SHEET // columns
    box, size = window(plans[0][2], cell, TALLEST * cell)
    cells = []
    for at, (title, layers, site) in enumerate(plans):
        said = credit if at == len(plans) - 1 else ""
        cells.append((title, paint(layers, site, box, size, said, dpi=THIN)))
    return save(beside(cells, columns), target, COLOURS)


def large(layers: Sequence[QgsVectorLayer], site: QgsVectorLayer, credit: str, target: Path) -> int:
    """Draw one plan, north up; return the bytes of the picture."""
    box, size = window(site, LARGE, LARGE)
    return save(paint(layers, site, box, size, credit, dpi=MIDDLE), target, COLOURS)
