"""What QGIS holds on to while Platwright is switched on."""

from __future__ import annotations

from qgis.core import QgsApplication

from .provider import PlatwrightProvider


class PlatwrightPlugin:
    """Adds the Processing provider and takes it away again.

    Parameters
    ----------
    iface
        The interface of the QGIS window, or None in `qgis_process`.
    """

    def __init__(self, iface=None):
        self.iface = iface
        self.provider: PlatwrightProvider | None = None

    def initProcessing(self) -> None:
        """Add the provider; the only hook that `qgis_process` calls."""
        if self.provider is None:
            self.provider = PlatwrightProvider()
            QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        """Add the provider in a QGIS window."""
        self.initProcessing()

    def unload(self) -> None:
        """Take the provider away."""
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
