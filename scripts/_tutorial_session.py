"""Runs inside a QGIS window (`qgis --code`): does what the tutorial says, and takes its pictures.

Started by scripts/tutorial. `story` yields the seconds to wait before it goes on.
"""

import os
import time
import traceback
from pathlib import Path

import processing
from qgis.core import QgsFeature, QgsGeometry, QgsPointXY, QgsProject, QgsRectangle
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import QAction, QApplication, QDockWidget, QListView, QTableView, QTreeView
from qgis.utils import iface

SHOTS = Path(os.environ["TUTORIAL_SHOTS"])
EXTRACT = os.environ["TUTORIAL_EXTRACT"]
WIDTH, HEIGHT = 1200, 800
#: A place in the extract.
PLACE = "L'Anse du Portier"


def picture(name, widget=None):
    """Take a picture of the screen, or of one window."""
    iface.messageBar().clearWidgets()
    QApplication.processEvents()
    taken = widget.grab() if widget else QApplication.primaryScreen().grabWindow(0)
    taken.save(str(SHOTS / f"{name}.png"))


def layer(name):
    """Return the layer of a name."""
    return QgsProject.instance().mapLayersByName(name)[-1]


def unfold(*names):
    """Show the legends of some layers only."""
    tree = QgsProject.instance().layerTreeRoot()
    for node in (*tree.findGroups(), *tree.findLayers()):
        node.setExpanded(False)
    QApplication.processEvents()
    for name in names:
        tree.findLayer(layer(name)).setExpanded(True)


def table(found, name, size):
    """Open the attribute table of a layer, as wide as its texts, and take its picture."""
    window = iface.showAttributeTable(found)
    window.resize(*size)
    yield 1
    for view in window.findChildren(QTableView):
        view.resizeColumnsToContents()
    yield 1
    picture(name, window)
    window.close()


def show(found, scale=1.12):
    """Show the extent of a layer."""
    box = QgsRectangle(found.extent())
    box.scale(scale)
    iface.mapCanvas().setExtent(
        iface.mapCanvas().mapSettings().layerExtentToOutputExtent(found, box)
    )
    iface.mapCanvas().refresh()


def in_dialog(name, tab=""):
    """Take a picture of the dialog that is open, and close it."""
    dialog = QApplication.activeModalWidget()
    if tab:
        for view in dialog.findChildren((QListView, QTreeView)):
            model = view.model()
            for row in range(model.rowCount() if model else 0):
                if tab in str(model.index(row, 0).data()):
                    view.setCurrentIndex(model.index(row, 0))
    dialog.resize(1080, 660)
    QTimer.singleShot(1500, lambda: (picture(name, dialog), dialog.reject()))


def run(dialog, seconds=90):
    """Press Run, and wait until the layers are there."""
    done = []
    dialog.algorithmFinished.connect(lambda good, _: done.append(good))
    dialog.runAlgorithm()
    end = time.monotonic() + seconds
    while not done and time.monotonic() < end:
        yield 0.3
    if not done or not done[0]:
        msg = f"{dialog.windowTitle()} did not come to its end"
        raise RuntimeError(msg)
    yield 2


def tool(name, given, size=(940, 720)):
    """Open the dialog of a tool."""
    dialog = processing.createAlgorithmDialog(f"platwright:{name}", given)
    dialog.resize(*size)
    dialog.show()
    dialog.raise_()
    return dialog


def toolbox(text):
    """Search in the toolbox."""
    (dock,) = [
        d
        for d in iface.mainWindow().findChildren(QDockWidget)
        if d.objectName() == "ProcessingToolbox"
    ]
    dock.setUserVisible(True)
    iface.mainWindow().resizeDocks([dock], [300], 1)
    dock.searchBox.setText(text)
    QApplication.processEvents()
    dock.algorithmTree.expandAll()


def install():
    """Show where the zip is installed, and where the packages are."""
    QTimer.singleShot(2500, lambda: in_dialog("1_install", "Install from ZIP"))
    iface.actionManagePlugins().trigger()
    yield 1
    QTimer.singleShot(1500, lambda: in_dialog("2_packages"))
    iface.showOptionsDialog(iface.mainWindow(), "PlatwrightOptions")
    yield 1


def sample():
    """Open the sample project, and hide the finished design."""
    iface.mainWindow().findChild(QAction, "platwrightSample").trigger()
    yield 3
    iface.messageBar().clearWidgets()
    toolbox("platwright")
    show(layer("Rail yard"))
    yield 2
    picture("3_sample")
    QgsProject.instance().layerTreeRoot().findGroup("Finished design").setItemVisibilityChecked(
        False
    )
    iface.setActiveLayer(layer("Rail yard"))


def prepare():
    """Prepare the site."""
    given = {
        "INPUT": layer("Rail yard"),
        "ROADS": layer("Roads"),
        "OBSTACLES": layer("Buildings, parks, water"),
        "SNAP_DISTANCE": 60,
    }
    dialog = tool("preparesite", given)
    yield 1.5
    picture("4_prepare", dialog)
    yield from run(dialog)
    dialog.close()
    show(layer("Boundary streets"))
    unfold()
    yield 2
    picture("5_prepared")


def design():
    """Design the streets."""
    given = {
        "INPUT": layer("Site"),
        "ROADS": layer("Roads"),
        "OBSTACLES": layer("Site obstacles"),
        "SNAP_DISTANCE": 60,
    }
    dialog = tool("designstreets", given)
    yield 1.5
    picture("6_design", dialog)
    yield from run(dialog)
    picture("7_log", dialog)
    dialog.close()
    show(layer("Streets"))
    unfold("Streets", "Blocks")
    yield 2.5
    picture("8_result")


def look():
    """Look at the table and at another style."""
    streets = layer("Streets")
    yield from table(streets, "9_table", (1000, 330))
    streets.styleManager().setCurrentStyle("Distance to the exit")
    streets.triggerRepaint()
    iface.setActiveLayer(streets)
    yield 2.5
    picture("10_distances")
    streets.styleManager().setCurrentStyle("Level")


def spoil():
    """Draw a street that joins no other, and check the layer."""
    streets = layer("Streets")
    block = max(
        (f for f in layer("Blocks").getFeatures() if f["width_m"] < 110), key=lambda f: f["area_m2"]
    )
    middle = block.geometry().pointOnSurface().asPoint()
    drawn = QgsFeature(streets.fields())
    drawn.setAttribute("status", "new")
    drawn.setGeometry(
        QgsGeometry.fromPolylineXY(
            [QgsPointXY(middle.x() - 20, middle.y()), QgsPointXY(middle.x() + 20, middle.y() + 5)]
        )
    )
    streets.startEditing()
    streets.addFeature(drawn)
    streets.commitChanges()
    given = {
        "INPUT": streets,
        "SITE": layer("Site"),
        "BOUNDARY_STREETS": layer("Boundary streets"),
        "OBSTACLES": layer("Site obstacles"),
    }
    dialog = tool("validatenetwork", given)
    yield from run(dialog)
    dialog.close()
    # Named after the layer that was checked, since others are called Problems already.
    (found,) = QgsProject.instance().mapLayersByName("Problems (Streets)")
    iface.setActiveLayer(found)
    unfold(found.name())
    show(streets)
    yield 2
    picture("11_check")
    yield from table(found, "12_problems", (1100, 200))


def place():
    """Design a place by its name, from the extract."""
    QgsProject.instance().clear()
    yield 1
    given = {"PLACE": PLACE, "SOURCE_FILE": EXTRACT, "SINK_MODE": "whole boundary"}
    dialog = tool("placetodesign", given)
    yield 1.5
    picture("13_place", dialog)
    yield from run(dialog)
    dialog.close()
    show(layer("Site"), 1.5)
    unfold("Streets", "Blocks")
    yield 3
    picture("14_place_result")


def story():
    """Do everything, one after the other."""
    main = iface.mainWindow()
    main.setGeometry(0, 0, WIDTH, HEIGHT)
    for dock in main.findChildren(QDockWidget):
        if dock.objectName() == "Browser":
            dock.hide()
    yield 2
    wanted = os.environ.get("TUTORIAL_PARTS", "").split()
    for part in (install, sample, prepare, design, look, spoil, place):
        if not wanted or part.__name__ in wanted:
            yield from part()


def finish(text=""):
    """End the session."""
    if text:
        (SHOTS / "error.txt").write_text(text, encoding="utf-8")
        QApplication.primaryScreen().grabWindow(0).save(str(SHOTS / "failed.png"))
    QgsProject.instance().setDirty(False)
    os._exit(0)


steps = story()


def go_on():
    """Take the next step."""
    try:
        wait = next(steps)
    except StopIteration:
        finish()
    except Exception:
        finish(traceback.format_exc())
    else:
        QTimer.singleShot(int(1000 * wait), go_on)


QTimer.singleShot(2500, go_on)
QTimer.singleShot(280_000, lambda: finish("The session took too long."))
