"""Imports the Python packages of the library safely inside a QGIS process.

The plugin loads and lists its tools without any of them; a tool asks for what it needs when it
is opened (`missing_text`) and again when it runs (`load`).

On Linux QGIS holds its own GEOS, PROJ and protobuf where every library of the process looks
first, so compiled packages that bring theirs would call those of QGIS and crash or fail. Their
first import therefore runs with RTLD_DEEPBIND, which makes a library look at home first.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.machinery
import importlib.metadata
import importlib.util
import os
import sys
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path

from qgis.core import QgsApplication

#: Names one or more folders with packages, for development and for runs without a window.
ENVIRONMENT_VARIABLE = "PLATWRIGHT_DEPS"

#: What a tool may ask for: import name -> (name to install, least version, modules to load).
PACKAGES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "numpy": ("numpy", "1.22", ()),
    "scipy": ("scipy", "1.9", ("scipy.optimize", "scipy.sparse")),
    "shapely": ("shapely", "2.0", ("shapely.lib",)),
    "pyproj": ("pyproj", "3.4", ()),
    "pyogrio": ("pyogrio", "0.7", ("pyogrio._io", "pyogrio._geometry")),
    "geopandas": ("geopandas", "0.14", ()),
    "networkx": ("networkx", "2.8", ()),
    "pulp": ("pulp", "3.1", ()),
    "highspy": ("highspy", "1.12", ()),
    "ortools": ("ortools", "9.10", ("ortools.sat.python.cp_model",)),
}
#: What every tool needs to read and write layers.
LAYERS = ("numpy", "scipy", "shapely", "pyproj", "geopandas")
#: What a tool needs that solves integer programs.
SOLVERS = ("networkx", "pulp", "highspy")
#: Imported where installed, so that it is bound to its own libraries; never demanded.
OPTIONAL = ("pyogrio", "ortools")

_lock = threading.RLock()
_loaded: set[str] = set()
_proj_contexts: list[object] = []


class DependencyError(Exception):
    """A package is missing or cannot work in this process; the text says what to do."""


def profile_folder() -> Path:
    """Return the folder in the user's QGIS profile that may hold the packages."""
    return Path(QgsApplication.qgisSettingsDirPath()) / "platwright" / "packages"


def folders() -> list[str]:
    """Return the existing folders that are searched before Python's own, in their order."""
    given = [f for f in os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep) if f]
    return [f for f in given or [str(profile_folder())] if Path(f).is_dir()]


def _extend_path() -> None:
    # Only now, not through PYTHONPATH: QGIS imports some of the packages itself at start,
    # and must find its own.
    for folder in reversed(folders()):
        if folder not in sys.path:
            sys.path.insert(0, folder)
            importlib.invalidate_caches()


def _version(text: str) -> tuple[int, ...]:
    digits = []
    for part in text.split(".")[:3]:
        number = "".join(c for c in part if c.isdigit())
        digits.append(int(number) if number else 0)
    return tuple(digits)


def missing(packages: Iterable[str]) -> list[str]:
    """Return, for each package that is absent or too old, what to install.

    Nothing is imported and `sys.path` stays as it is, so that this may be asked at any time.
    """
    search = [*folders(), *sys.path]
    wanted = []
    for name in packages:
        install, least, _ = PACKAGES[name]
        if name in sys.modules:
            continue
        if importlib.machinery.PathFinder.find_spec(name, search) is None:
            wanted.append(f"{install} (version {least} or newer)")
            continue
        records = importlib.metadata.distributions(name=install, path=search)
        # Importable but without a record, as in some bundles of QGIS: let it try.
        found = next((record.version for record in records), least)
        if _version(found) < _version(least):
            wanted.append(f"{install} (version {least} or newer, found {found})")
    return wanted


def missing_text(packages: Iterable[str]) -> str:
    """Return what is missing and what to do about it, or an empty text."""
    wanted = missing(packages)
    if not wanted:
        return ""
    return (
        f"This tool needs Python packages that were not found: {', '.join(wanted)}. "
        f"Install them with pip into the folder {profile_folder()} "
        "(pip install --target FOLDER --no-deps keeps the packages of QGIS as they are) or set "
        f"the environment variable {ENVIRONMENT_VARIABLE} to the folder that has them, and "
        "start QGIS again."
    )


@contextlib.contextmanager
def _bound_at_home() -> Iterator[None]:
    """Make libraries that are loaded in the block look for symbols in themselves first."""
    if not (sys.platform.startswith("linux") and hasattr(os, "RTLD_DEEPBIND")):
        yield
        return
    before = sys.getdlopenflags()
    sys.setdlopenflags(os.RTLD_NOW | os.RTLD_DEEPBIND)
    try:
        yield
    finally:
        sys.setdlopenflags(before)


def _import(name: str) -> None:
    with _bound_at_home():
        importlib.import_module(name)
        for module in PACKAGES[name][2]:
            importlib.import_module(module)


def _self_test() -> None:
    """Raise `DependencyError` where shapely or pyproj was bound to the libraries of QGIS."""
    import pyproj
    import shapely

    advice = (
        "Another plugin has probably loaded it before Platwright could. Start QGIS again and "
        "run a Platwright tool first, or switch the other plugin off."
    )
    try:
        shapely.to_wkb(shapely.box(0, 0, 1, 1))
        shapely.intersection(shapely.box(0, 0, 2, 2), shapely.box(1, 1, 3, 3), grid_size=0.1)
    except Exception as error:
        msg = f"The package shapely does not work in this QGIS ({error}). {advice}"
        raise DependencyError(msg) from error
    try:
        pyproj.Transformer.from_crs(4326, 32635, always_xy=True).transform(25.0, 60.0)
    except Exception as error:
        msg = f"The package pyproj does not work in this QGIS ({error}). {advice}"
        raise DependencyError(msg) from error


def _keep_proj_context() -> None:
    """Keep the PROJ context of this thread alive for as long as QGIS runs.

    pyproj notes the context in the operating system's thread, but lets go of it with Python's
    idea of the thread, which ends whenever a thread of QGIS has no Python left to run. The next
    tool in the same thread would use what is gone, and QGIS would crash.
    """
    import pyproj
    from pyproj import _context

    pyproj.CRS.from_epsg(4326)  # makes the context, if this thread has none
    manager = getattr(_context, "get_context_manager", lambda: None)()
    if manager is not None and not any(manager is kept for kept in _proj_contexts):
        _proj_contexts.append(manager)


def load(packages: Iterable[str] = LAYERS) -> None:
    """Import `packages`, each bound to its own libraries, and try them out once.

    To be called in every thread that uses them.

    Raises
    ------
    DependencyError
        A package is missing, too old, or fails its trial.
    """
    packages = tuple(packages)
    with _lock:
        text = missing_text(packages)
        if text:
            raise DependencyError(text)
        _extend_path()
        for name in OPTIONAL:
            if name not in _loaded and importlib.util.find_spec(name) is not None:
                packages = (*packages, name)
        # numpy first; ortools and pyogrio before whatever would pull them in unguarded.
        for name in (n for n in PACKAGES if n in packages and n not in _loaded):
            try:
                _import(name)
            except ImportError as error:
                if name in OPTIONAL:
                    _loaded.add(name)
                    continue
                msg = f"The package {name} is installed but cannot be loaded ({error})."
                raise DependencyError(msg) from error
            _loaded.add(name)
            if name == "geopandas":
                _self_test()
        if "pyproj" in _loaded:
            _keep_proj_context()
