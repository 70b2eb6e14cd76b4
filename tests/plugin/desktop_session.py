"""Runs inside a QGIS window (`qgis --code`): does what a planner does, notes what came of it.

Not a test by itself: `test_desktop.py` starts it and reads its notes. The environment says
where the sample is and where pictures and notes go.
"""

import json
import os
import time
import traceback

import processing
import qgis.utils
from qgis.core import (
    QgsApplication,
    QgsFeature,
    QgsGeometry,
    QgsProject,
    QgsRectangle,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import QAction, QApplication, QDockWidget, QTextEdit
from qgis.utils import iface

OUT = os.environ["DESKTOP_OUT"]
SAMPLE = os.environ["DESKTOP_SAMPLE"]
FOLDER = os.environ["DESKTOP_PLUGIN"]
notes = {"steps": []}
held = {}


def picture(name):
    """Grab the whole screen with all windows."""
    QApplication.processEvents()
    QApplication.primaryScreen().grabWindow(0).save(os.path.join(OUT, f"{name}.png"))


def finish():
    with open(os.path.join(OUT, "desktop.json"), "w") as out:
        json.dump(notes, out, indent=1)
    QgsProject.instance().setDirty(False)
    os._exit(0)


def step(function, noted=True):
    """Make a step that ends the session with a note where it fails."""

    def guarded(*arguments):
        try:
            function(*arguments)
            if noted:
                notes["steps"].append(function.__name__)
        except Exception:
            notes["error"] = traceback.format_exc()
            picture("desktop_failed")
            finish()

    return guarded


def later(seconds, function):
    QTimer.singleShot(int(1000 * seconds), function)


def items(model, parent=None):
    """Yield the texts of a tree model."""
    from qgis.PyQt.QtCore import QModelIndex

    parent = parent or QModelIndex()
    for row in range(model.rowCount(parent)):
        index = model.index(row, 0, parent)
        yield str(model.data(index))
        yield from items(model, index)


@step
def open_sample():
    iface.mainWindow().setGeometry(0, 0, 1500, 950)
    for dock in iface.mainWindow().findChildren(QDockWidget):
        if dock.objectName() == "Browser":
            dock.hide()
    for name in ("site", "streets", "obstacles"):
        layer = QgsVectorLayer(f"{SAMPLE}|layername={name}", f"yard {name}", "ogr")
        QgsProject.instance().addMapLayer(layer)
        held[name] = layer
    QgsProject.instance().setCrs(held["site"].crs())
    iface.setActiveLayer(held["site"])
    iface.zoomToActiveLayer()
    later(1.5, find_tool)


@step
def find_tool():
    (toolbox,) = [
        d
        for d in iface.mainWindow().findChildren(QDockWidget)
        if d.objectName() == "ProcessingToolbox"
    ]
    toolbox.setUserVisible(True)
    toolbox.searchBox.setText("design streets")
    QApplication.processEvents()
    toolbox.algorithmTree.expandAll()
    notes["found"] = list(items(toolbox.algorithmTree.model()))
    picture("desktop_1_toolbox")
    toolbox.searchBox.setText("")
    later(0.5, open_dialog)


@step
def open_dialog():
    parameters = {
        "INPUT": held["site"],
        "ROADS": held["streets"],
        "OBSTACLES": held["obstacles"],
        "TIME_LIMIT": 6,
    }
    dialog = processing.createAlgorithmDialog("platwright:designstreets", parameters)
    held["dialog"] = dialog
    dialog.resize(1000, 800)
    dialog.show()
    dialog.raise_()
    notes["title"] = dialog.windowTitle()
    later(2, run_tool)


@step
def run_tool():
    picture("desktop_2_dialog")
    held["began"] = time.monotonic()
    held["dialog"].algorithmFinished.connect(finished)
    held["dialog"].runAlgorithm()
    later(90, lambda: "good" in notes or give_up())


@step
def give_up():
    picture("desktop_gave_up")
    notes["error"] = "the tool did not end in 90 s"
    finish()


@step
def finished(good, results):
    notes["good"] = bool(good)
    notes["results"] = {k: v for k, v in results.items() if isinstance(v, (int, float))}
    notes["seconds"] = time.monotonic() - held["began"]
    later(2, look)


@step
def look():
    picture("desktop_3_log")
    held["dialog"].close()
    notes["layers"] = {
        layer.name(): {
            "features": layer.featureCount(),
            "renderer": layer.renderer().type(),
            "classes": [item.label() for item in layer.renderer().legendSymbolItems()],
            "crs": layer.crs().authid(),
            "specification": layer.customProperty("platwright/specification"),
            "result": layer.customProperty("platwright/result"),
        }
        for layer in QgsProject.instance().mapLayers().values()
    }
    box = QgsRectangle(held["site"].extent())
    box.scale(1.15)
    iface.mapCanvas().setExtent(box)
    iface.mapCanvas().refresh()
    later(3, photograph)


@step
def photograph():
    picture("desktop_4_map")
    iface.mapCanvas().saveAsImage(os.path.join(OUT, "desktop_5_canvas.png"))
    later(0.5, start_and_cancel)


@step
def start_and_cancel():
    """Design a square kilometre, which takes a while, and press Cancel at the first design."""
    ground = QgsVectorLayer("Polygon?crs=EPSG:3067", "big", "memory")
    feature = QgsFeature()
    feature.setGeometry(QgsGeometry.fromRect(QgsRectangle(500000, 6700000, 501000, 6701000)))
    ground.dataProvider().addFeatures([feature])
    held["big"] = ground
    QgsProject.instance().addMapLayer(ground)
    dialog = processing.createAlgorithmDialog(
        "platwright:designstreets", {"INPUT": ground, "TIME_LIMIT": 60, "GAP": 0}
    )
    held["second"] = dialog
    dialog.show()
    dialog.runAlgorithm()
    press_cancel()


def log_of(dialog):
    """Return what the dialog shows of the log; the feedback itself belongs to the tool's thread."""
    return dialog.findChild(QTextEdit, "txtLog").toPlainText()


def press_cancel():
    dialog = held["second"]
    if "Best design" in log_of(dialog):
        held["pressed"] = time.monotonic()
        dialog.cancelButton().click()
        wait_for_end()
    else:
        later(0.1, press_cancel)


def wait_for_end():
    """Look for the last line of the log: newer QGIS gives no signal where a run was cancelled."""
    if "Execution failed" in log_of(held["second"]):
        cancelled()
    else:
        later(0.05, wait_for_end)


@step
def cancelled():
    notes["cancel seconds"] = time.monotonic() - held["pressed"]
    later(1, after_cancel)


@step
def after_cancel():
    notes["cancel log"] = log_of(held["second"])
    picture("desktop_6_cancelled")
    held["second"].close()
    notes["dialogs"] = {}
    provider = QgsApplication.processingRegistry().providerById("platwright")
    held["names"] = sorted(tool.name() for tool in provider.algorithms())
    later(0.5, step(open_next, noted=False))


@step
def open_every_dialog():
    later(0.1, try_models)


def open_next():
    """Open the dialog of the next tool or model, which a planner would fill in now."""
    if not held["names"]:
        open_every_dialog()
        return
    name = held["names"].pop(0)
    dialog = processing.createAlgorithmDialog(f"platwright:{name}")
    dialog.resize(1000, 800)
    dialog.show()
    dialog.raise_()
    later(0.6, lambda: step(photograph_dialog, noted=False)(name, dialog))


def photograph_dialog(name, dialog):
    QApplication.processEvents()
    dialog.grab().save(os.path.join(OUT, f"dialog_{name}.png"))
    tool = dialog.algorithm()
    notes["dialogs"][name] = {
        "title": dialog.windowTitle(),
        "shown": sorted(dialog.mainWidget().wrappers),
        "declared": sorted(p.name() for p in tool.parameterDefinitions()),
        "runnable": dialog.runButton().isEnabled(),
    }
    dialog.close()
    later(0.1, step(open_next, noted=False))


@step
def try_models():
    """Open the sample project, as its menu entry does, and run a model on its layers."""
    QgsProject.instance().clear()
    QgsProject.instance().setDirty(False)
    iface.mainWindow().findChild(QAction, "platwrightSample").trigger()
    later(3, run_model)


@step
def run_model():
    project = QgsProject.instance()
    notes["sample"] = {
        "file": project.fileName(),
        "layers": {layer.name(): layer.isValid() for layer in project.mapLayers().values()},
    }
    picture("desktop_7_sample")
    (ground,) = project.mapLayersByName("Rail yard")
    (ways,) = project.mapLayersByName("Roads")
    parameters = {"INPUT": ground, "ROADS": ways, "SNAP_DISTANCE": 60, "TIME_LIMIT": 4}
    dialog = processing.createAlgorithmDialog("platwright:parcelstodesign", parameters)
    held["model"] = dialog
    dialog.show()
    dialog.algorithmFinished.connect(model_finished)
    later(0.2, dialog.runAlgorithm)


@step
def model_finished(good, results):
    notes["model good"] = bool(good)
    later(2, after_model)


@step
def after_model():
    held["model"].close()
    notes["model layers"] = {
        layer.name(): layer.renderer().type()
        for layer in QgsProject.instance().mapLayers().values()
        if layer.isTemporary()
    }
    picture("desktop_8_model")
    later(0.5, switch_off)


@step
def switch_off():
    registry = QgsApplication.processingRegistry()
    notes["provider before"] = registry.providerById("platwright") is not None
    qgis.utils.unloadPlugin(FOLDER)
    notes["provider after"] = registry.providerById("platwright") is not None
    later(0.2, finish)


later(2.5, open_sample)
later(190, finish)
