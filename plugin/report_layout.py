"""The print layout: a template of QGIS with the title, the place and the ground of a report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from qgis.core import QgsRectangle
from qgis.PyQt.QtXml import QDomDocument, QDomElement

from .report_maps import Sheet

#: A sheet of A4; its items are found by their ids.
TEMPLATE = Path(__file__).with_name("layouts") / "report_a4.qpt"
MAP = "map"


def template(texts: Mapping[str, str], sheet: Sheet | None) -> str:
    """Return the template with texts and ground filled in.

    Parameters
    ----------
    texts
        Texts of labels by their ids; a label without one keeps what it says.
    sheet
        The ground of the map; without one it shows what the window of QGIS shows.
    """
    document = QDomDocument()
    document.setContent(TEMPLATE.read_text(encoding="utf-8"))
    for item in _items(document):
        name = item.attribute("id")
        if name in texts:
            # what stands in [% %] would be evaluated
            item.setAttribute("labelText", texts[name].replace("[%", "[ %"))
        elif name == MAP and sheet is not None:
            _show(document, item, sheet)
    return str(document.toString(1))


def _items(document: QDomDocument) -> Iterator[QDomElement]:
    item = document.documentElement().firstChildElement("LayoutItem")
    while not item.isNull():
        yield item
        item = item.nextSiblingElement("LayoutItem")


def _show(document: QDomDocument, item: QDomElement, sheet: Sheet) -> None:
    """Make the map item show a sheet, as a whole and in its CRS."""
    wide, high = (float(own) for own in item.attribute("size").split(",")[:2])
    box = sheet.box
    scale = max(box.width() / wide, box.height() / high)
    shown = QgsRectangle.fromCenterAndSize(box.center(), scale * wide, scale * high)
    extent = item.firstChildElement("Extent")
    for key, value in (
        ("xmin", shown.xMinimum()),
        ("ymin", shown.yMinimum()),
        ("xmax", shown.xMaximum()),
        ("ymax", shown.yMaximum()),
    ):
        extent.setAttribute(key, repr(value))
    old = item.firstChildElement("crs")
    if not old.isNull():
        item.removeChild(old)
    made = document.createElement("crs")
    sheet.crs.writeXml(made, document)
    item.appendChild(made)
