"""Draw a residential zone in QGIS's own 3D view, without a screen.

Usage: _gallery_building_solids.py LAYERS TARGET, where LAYERS is the GeoPackage of a plan. It needs
an X server, such as that of xvfb-run, and software OpenGL will do (LIBGL_ALWAYS_SOFTWARE=1).

Worker threads of the view ask objects that Python made for their methods, and would wait for Python
forever while it waits for them. So all layers carry the styles that the tool has stored with them,
which C++ reads, and the ground is set by XML.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from qgis import _3d
from qgis.core import (
    QgsApplication,
    QgsLayoutExporter,
    QgsLayoutSize,
    QgsPrintLayout,
    QgsProject,
    QgsReadWriteContext,
    QgsRectangle,
    QgsVector3D,
    QgsVectorLayer,
)
from qgis.PyQt import sip
from qgis.PyQt.QtCore import QRect, QRectF, QSize
from qgis.PyQt.QtGui import QColor, QImage
from qgis.PyQt.QtXml import QDomDocument

from _gallery_building_places import DRAWN
from _gallery_pictures import PAPER, save

#: Millimetres of the page, pixels per inch, and ground around the plan (metres).
WIDE, HIGH, DPI, AROUND = 250, 170, 130, 12.0
#: Camera: distance by the longer side of the plan, degrees from the vertical, and from north.
FAR, PITCH, HEADING = 1.16, 50.0, 24.0
#: Light from the south-west, as in the afternoon: x east, y up, z south.
LIGHT = (0.45, -0.85, -0.55)
#: Around the picture (pixels).
MARGIN = 12


def layers(path: Path) -> list[QgsVectorLayer]:
    """Open the layers of a plan in the styles that are stored with them, from the top down."""
    found = [QgsVectorLayer(f"{path}|layername={name}", name, "ogr") for name in DRAWN.values()]
    for layer in found:
        if layer.renderer3D() is not None:
            raised = sip.cast(layer.renderer3D(), _3d.QgsAbstractVectorLayer3DRenderer)
            raised.setLayer(layer)
    return found


def settings(shown: list[QgsVectorLayer], box: QgsRectangle) -> Any:
    """Return the settings of a view over flat ground."""
    made = _3d.Qgs3DMapSettings()
    middle = box.center()
    document = QDomDocument()
    document.setContent(
        f'<qgis3d><origin x="{middle.x()}" y="{middle.y()}" z="0"/>'
        '<terrain exaggeration="1" texture-size="1024" max-terrain-error="1" max-ground-error="0.5"'
        ' terrain-rendering-enabled="1"><generator type="flat">'
        f'<extent xmin="{box.xMinimum()}" ymin="{box.yMinimum()}" xmax="{box.xMaximum()}"'
        f' ymax="{box.yMaximum()}"/></generator></terrain></qgis3d>'
    )
    root = document.documentElement()
    system = document.createElement("crs")
    shown[-1].crs().writeXml(system, document)
    root.appendChild(system)
    made.readXml(root, QgsReadWriteContext())
    made.setLayers(shown)
    made.setBackgroundColor(QColor(PAPER))
    made.setMapTileResolution(1024)
    light = _3d.QgsDirectionalLightSettings()
    light.setDirection(QgsVector3D(*LIGHT))
    made.setDirectionalLights([light])
    made.setPointLights([])
    return made


def view(path: Path) -> QImage:
    """Draw a plan from above the south-west."""
    shown = layers(path)
    project = QgsProject.instance()
    project.setCrs(shown[-1].crs())
    project.addMapLayers(shown)
    box = QgsRectangle(shown[-1].extent()).buffered(AROUND)
    layout = QgsPrintLayout(project)
    layout.initializeDefaults()
    layout.pageCollection().page(0).setPageSize(QgsLayoutSize(WIDE, HIGH))
    item = _3d.QgsLayoutItem3DMap(layout)
    item.attemptSetSceneRect(QRectF(0, 0, WIDE, HIGH))
    item.setFrameEnabled(False)
    pose = _3d.QgsCameraPose()
    pose.setCenterPoint(QgsVector3D(0, 0, 0))
    pose.setDistanceFromCenterPoint(FAR * max(box.width(), box.height()))
    pose.setPitchAngle(PITCH)
    pose.setHeadingAngle(HEADING)
    item.setCameraPose(pose)
    item.setMapSettings(settings(shown, box))
    layout.addLayoutItem(item)
    image = QgsLayoutExporter(layout).renderPageToImage(0, QSize(), DPI)
    view.kept = (layout, item)  # type: ignore[attr-defined]  # what goes early ends badly
    return image


def trimmed(image: QImage) -> QImage:
    """Cut away what is empty around a plan."""
    plain = image.convertToFormat(QImage.Format_RGB32)
    bits = plain.constBits()
    bits.setsize(plain.sizeInBytes())
    pixels = np.frombuffer(bits, dtype=np.uint32).reshape(plain.height(), -1)
    rows, columns = np.nonzero(pixels != pixels[0, 0])
    corner, far = (columns.min(), rows.min()), (columns.max(), rows.max())
    box = QRect(*(int(v) for v in corner), *(int(b - a) + 1 for a, b in zip(corner, far)))
    return plain.copy(box.adjusted(-MARGIN, -MARGIN, MARGIN, MARGIN).intersected(plain.rect()))


def main() -> None:
    """Draw the plan that is named."""
    source, target = (Path(name) for name in sys.argv[1:3])
    application = QgsApplication([], True)
    application.initQgis()
    _3d.Qgs3D.initialize()
    print(f"{target.name}: {save(trimmed(view(source)), target) / 1000:.0f} kB", flush=True)
    # What lives on at the end of the program would end it badly.
    os._exit(0 if application else 1)


if __name__ == "__main__":
    main()
