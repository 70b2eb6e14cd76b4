"""What QGIS holds on to while Platwright is switched on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from qgis.core import QgsApplication

from .provider import PlatwrightProvider

if TYPE_CHECKING:
    from .sample import SampleAction
    from .settings_page import SettingsPageFactory


class PlatwrightPlugin:
    """Adds the Processing provider and the settings page, and takes them away again.

    Parameters
    ----------
    iface
        The interface of the QGIS window, or None in `qgis_process`.
    """

    def __init__(self, iface: Any = None) -> None:
        self.iface = iface
        self.provider: PlatwrightProvider | None = None
        self.page: SettingsPageFactory | None = None
        self.sample: SampleAction | None = None

    def initProcessing(self) -> None:
        """Add the provider; the only hook that `qgis_process` calls."""
        if self.provider is None:
            self.provider = PlatwrightProvider()
            QgsApplication.processingRegistry().addProvider(self.provider)
            # Once more, for the models: the tools that they are made of are known from here on.
            self.provider.refreshAlgorithms()

    def initGui(self) -> None:
        """Add everything in a QGIS window, and say once which packages are missing."""
        # Not above: `qgis_process` has no window and may lack the libraries for one.
        from . import notice
        from .sample import SampleAction
        from .settings_page import SettingsPageFactory

        self.initProcessing()
        self.page = SettingsPageFactory()
        self.iface.registerOptionsWidgetFactory(self.page)
        self.sample = SampleAction(self.iface)
        if self.provider is not None:
            notice.tell(self.iface, self.provider.algorithms())

    def unload(self) -> None:
        """Take everything away."""
        if self.sample is not None:
            self.sample.remove()
            self.sample = None
        if self.page is not None:
            from . import installer_task, notice

            notice.withdraw()
            installer_task.cancel()
            self.iface.unregisterOptionsWidgetFactory(self.page)
            self.page = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
