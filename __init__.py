"""Platwright as a QGIS plugin; the planning library is in the folder `algorithms`."""


def classFactory(iface):
    """Return the plugin object; QGIS calls this once when it loads the plugin.

    Nothing heavy is imported here: QGIS and `qgis_process` import this file at start, before
    it is known whether the Python packages that the tools need are installed.

    Parameters
    ----------
    iface
        The interface of the QGIS window, or None in `qgis_process`.
    """
    from .plugin.plugin import PlatwrightPlugin

    return PlatwrightPlugin(iface)
