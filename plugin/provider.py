"""The Processing provider: one group per step of the planner's work."""

from __future__ import annotations

from qgis.core import QgsApplication, QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .icons import icon_path
from .models import models
from .tools import TOOLS


class PlatwrightProvider(QgsProcessingProvider):
    """Lists the tools of Platwright in the Processing toolbox."""

    def id(self) -> str:
        """Return the prefix of every tool id; saved models depend on it."""
        return "platwright"

    def name(self) -> str:
        """Return the name that the toolbox shows."""
        return "Platwright"

    def longName(self) -> str:
        """Return the name with what it is about."""
        return "Platwright (street networks and site plans)"

    def icon(self) -> QIcon:
        """Return the picture beside the name."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """Return the path of that picture."""
        return icon_path("platwright")

    def loadAlgorithms(self) -> None:
        """Add every tool and, once QGIS knows the tools, the models that are made of them."""
        for tool in TOOLS:
            self.addAlgorithm(tool())
        if QgsApplication.processingRegistry().providerById(self.id()) is not None:
            for model in models():
                self.addAlgorithm(model)
