"""The Python packages that the library does without as long as nobody asks for OpenStreetMap."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import MissingDependencyError

if TYPE_CHECKING:
    from types import ModuleType


def _missing(package: str, what: str) -> MissingDependencyError:
    return MissingDependencyError(
        f"{what} the Python package {package}. Install it in Settings > Options > Platwright; "
        f"outside QGIS with pip install '{package}'."
    )


def load_requests() -> ModuleType:
    """Import requests.

    Raises
    ------
    MissingDependencyError
        It is not installed.
    """
    try:
        import requests
    except ImportError as error:
        raise _missing("requests", "The services of OpenStreetMap need") from error
    return requests


def load_osmium() -> ModuleType:
    """Import pyosmium.

    Raises
    ------
    MissingDependencyError
        It is not installed.
    """
    try:
        import osmium
        import osmium.area
        import osmium.filter
        import osmium.geom
        import osmium.io
    except ImportError as error:
        raise _missing("osmium", "Files of OpenStreetMap need") from error
    return osmium


def load_osmnx() -> ModuleType:
    """Import osmnx 2.

    Raises
    ------
    MissingDependencyError
        It is not installed, or another version than this library knows how to steer.
    """
    try:
        import osmnx
        from osmnx import _nominatim, _overpass
    except ImportError as error:
        raise _missing("osmnx", "Streets of OpenStreetMap need") from error
    known = hasattr(_overpass, "_overpass_request") and hasattr(_nominatim, "_nominatim_request")
    version = str(getattr(osmnx, "__version__", "0"))
    if not known or version.split(".")[0] != "2":
        what = f"osmnx {version} is not known here: streets of OpenStreetMap need"
        raise _missing("osmnx>=2.0,<3", what)
    return osmnx
