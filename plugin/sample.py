"""The sample project: one entry of the Plugins menu opens a copy of it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from qgis.core import Qgis, QgsProject
from qgis.PyQt.QtCore import QStandardPaths
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QAction

from .icons import icon_path

#: The sample that comes with the plugin, and its project.
FOLDER = Path(__file__).parents[1] / "data" / "helsinki"
PROJECT = "helsinki_yard.qgz"
#: What the copy is called in the folder for documents, and the menu that opens it.
COPY, MENU = "Platwright sample", "Platwright"


def copied(documents: Path) -> Path:
    """Copy the sample into a folder of its own and return its project.

    What is there already stays as the planner left it. The plugin's own folder would not do: it
    is deleted with every new version.

    Parameters
    ----------
    documents
        Where the folder is made.
    """
    folder = documents / COPY
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(FOLDER.iterdir()):
        if path.is_file() and not (folder / path.name).exists():
            shutil.copyfile(path, folder / path.name)
    return folder / PROJECT


class SampleAction:
    """The entry of the menu.

    Parameters
    ----------
    iface
        The interface of the QGIS window.
    """

    def __init__(self, iface: Any) -> None:
        self.iface = iface
        icon = QIcon(icon_path("platwright"))
        self.action = QAction(icon, "Open sample project", iface.mainWindow())
        self.action.setObjectName("platwrightSample")
        self.action.triggered.connect(self.open)
        iface.addPluginToMenu(MENU, self.action)

    def open(self) -> None:
        """Open a copy of the sample, unless the open project would be lost by that."""
        bar = self.iface.messageBar()
        if QgsProject.instance().isDirty():
            text = "Save your project first, then open the sample."
            bar.pushMessage("Platwright", text, Qgis.MessageLevel.Warning)
            return
        place = QStandardPaths.StandardLocation.DocumentsLocation
        documents = Path(QStandardPaths.writableLocation(place) or Path.home())
        try:
            project = copied(documents)
        except OSError as error:
            text = f"The sample cannot be copied to {documents}: {error.strerror or error}."
            bar.pushMessage("Platwright", text, Qgis.MessageLevel.Critical)
            return
        self.iface.addProject(str(project))
        text = f"This is your copy of the sample: {project.parent}"
        bar.pushMessage("Platwright", text, Qgis.MessageLevel.Info)

    def remove(self) -> None:
        """Take the entry away."""
        self.iface.removePluginMenu(MENU, self.action)
