"""Looks for the Python packages of the library and imports them safely inside QGIS.

The plugin loads and lists its tools without any of them; a tool asks for what it needs when it
is opened (`missing_text`) and again when it runs (`load`). Where packages come from, in this
order: the folders that PLATWRIGHT_DEPS names, or else the folder in the profile that the
installer fills; then what Python of QGIS has. How they are imported is told in `guard`.
"""

from __future__ import annotations

import importlib
import importlib.machinery
import importlib.metadata
import importlib.util
import os
import sys
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from . import guard, installer_folder
from .guard import LAYERS, OPTIONAL, OSM, PACKAGES, SOLVERS, SUN

__all__ = [
    "LAYERS", "OPTIONAL", "OSM", "PACKAGES", "SOLVERS", "SUN", "load", "missing", "missing_text",
]  # fmt: skip

#: Names one or more folders with packages, for development and for runs without a window.
ENVIRONMENT_VARIABLE = "PLATWRIGHT_DEPS"
#: "always" runs every tool in a process of its own, see `worker`; "never" none.
WORKER_VARIABLE = "PLATWRIGHT_WORKER"
#: Where packages are installed, as a planner finds it.
WAY_OUT = (
    "Install them in Settings > Options > Platwright, or with the tool 'Install Python packages' "
    "(qgis_process run platwright:installdependencies --CONSENT=true)."
)

_lock = threading.RLock()
_loaded: set[str] = set()
_proj_contexts: list[object] = []


class DependencyError(Exception):
    """A package is missing or cannot work in this process; the text says what to do."""


class ClashError(DependencyError):
    """A package was loaded before us, bound to the libraries of QGIS; see `worker`."""


class Found(NamedTuple):
    """Where a package was found.

    Attributes
    ----------
    version
        Its version, "?" where it has no record, or empty where it was not found.
    place
        "Platwright" for a folder of our own, "QGIS" for what its Python has, or empty.
    """

    version: str
    place: str


def folders() -> list[str]:
    """Return the existing folders that are searched before Python's own, in their order."""
    given = [f for f in os.environ.get(ENVIRONMENT_VARIABLE, "").split(os.pathsep) if f]
    if not given:
        current = installer_folder.current()
        given = [str(current)] if current is not None else []
    return [f for f in given if Path(f).is_dir()]


def _extend_path() -> None:
    # Only now, not through PYTHONPATH: QGIS imports some of the packages itself at start,
    # and must find its own.
    for folder in reversed(folders()):
        if folder not in sys.path:
            sys.path.insert(0, folder)
            importlib.invalidate_caches()


def look(name: str) -> Found:
    """Return the version and the place of a package.

    Nothing is imported and `sys.path` stays as it is, so that this may be asked at any time.
    """
    ours = folders()
    search = [*ours, *sys.path]
    spec = importlib.machinery.PathFinder.find_spec(name, search)
    if spec is None and name not in sys.modules:
        return Found("", "")
    origin = str((spec.origin if spec else None) or "")
    place = "Platwright" if any(origin.startswith(folder) for folder in ours) else "QGIS"
    records = importlib.metadata.distributions(name=PACKAGES[name].install, path=search)
    # Importable but without a record, as in some bundles of QGIS: let it try.
    return Found(next((record.version for record in records), "?"), place)


def missing(packages: Iterable[str]) -> list[str]:
    """Return, for each package that is absent or has a wrong version, what to install."""
    wanted = []
    for name in packages:
        if name in sys.modules:
            continue
        package = PACKAGES[name]
        text = f"version {package.least} or newer"
        text += f", below {package.below}" if package.below else ""
        found = look(name)
        if not found.version:
            wanted.append(f"{package.install} ({text})")
        elif found.version != "?" and not guard.fits(name, found.version):
            wanted.append(f"{package.install} ({text}, found {found.version})")
    return wanted


def missing_text(packages: Iterable[str]) -> str:
    """Return what is missing and what to do about it, or an empty text."""
    wanted = missing(packages)
    if not wanted:
        return ""
    other, this = installer_folder.of_other_python(), installer_folder.this_python()
    reason = f"They were installed for Python {other}, and QGIS now has {this}. " if other else ""
    return (
        f"This tool needs Python packages that were not found: {', '.join(wanted)}. "
        f"{reason}{WAY_OUT}"
    )


def notice(tools: Iterable[tuple[str, Iterable[str]]]) -> str:
    """Return one sentence on what is missing for which tools, or an empty text.

    Parameters
    ----------
    tools
        Title of each tool and the packages that it needs.
    """
    all_missing: dict[str, list[str]] = {}
    total = 0
    for title, needs in tools:
        needed = tuple(needs)
        total += bool(needed)
        for name in needed:
            if missing((name,)):
                all_missing.setdefault(PACKAGES[name].install, []).append(title)
    if not all_missing:
        return ""
    names = sorted(all_missing)
    titles = sorted({title for some in all_missing.values() for title in some})
    which = "all its tools" if len(titles) == total else ", ".join(titles)
    amount = "a Python package" if len(names) == 1 else f"{len(names)} Python packages"
    return (
        f"Platwright needs {amount} that {'is' if len(names) == 1 else 'are'} not installed "
        f"({', '.join(names)}), for {which}."
    )


def _self_test() -> None:
    """Raise `ClashError` where shapely or pyproj was bound to the libraries of QGIS."""
    text = guard.trial()
    if text:
        msg = (
            f"{text} Another plugin has probably loaded it before Platwright could. Start QGIS "
            "again and run a Platwright tool first, or switch the other plugin off."
        )
        raise ClashError(msg)


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


def _with_extras(packages: Iterable[str]) -> set[str]:
    """Return packages with those that are optional beside them and installed."""
    wanted = set(packages)
    for name, beside in OPTIONAL.items():
        if beside in wanted and importlib.util.find_spec(name) is not None:
            wanted.add(name)
    return wanted


def _loaded_too_old(packages: Iterable[str]) -> str:
    """Return what is to be said of packages that others have loaded in a wrong version."""
    for name in packages:
        found = str(getattr(sys.modules.get(name), "__version__", ""))
        if name not in _loaded and found and not guard.fits(name, found):
            return (
                f"Another plugin has loaded {name} {found}, and Platwright needs "
                f"{PACKAGES[name].least} or newer. Start QGIS again and run a Platwright tool "
                "first, or switch the other plugin off."
            )
    return ""


def in_use() -> bool:
    """Tell whether this process has loaded packages, and must start again to see others."""
    return bool(_loaded)


def load(packages: Iterable[str] = LAYERS) -> None:
    """Import `packages`, each bound to its own libraries, and try them out once.

    To be called in every thread that uses them.

    Raises
    ------
    DependencyError
        A package is missing or has a wrong version.
    ClashError
        A package was loaded by others in a way that it cannot work here.
    """
    packages = tuple(packages)
    if not packages:
        return
    with _lock:
        text = missing_text(packages)
        if text:
            raise DependencyError(text)
        if os.environ.get(WORKER_VARIABLE) == "always":
            msg = f"The environment variable {WORKER_VARIABLE} asks for it."
            raise ClashError(msg)
        text = _loaded_too_old(packages)
        if text:
            raise ClashError(text)
        _extend_path()
        wanted = _with_extras(packages)
        for name in (n for n in PACKAGES if n in wanted and n not in _loaded):
            try:
                guard.import_package(name)
            except Exception as error:
                if name in OPTIONAL and name not in packages:
                    _loaded.add(name)
                    continue
                msg = (
                    f"The package {name} is installed but cannot be loaded ({error}). Start QGIS "
                    f"again; if that does not help, install the packages afresh. {WAY_OUT}"
                )
                raise ClashError(msg) from error
            if name == "geopandas":
                _self_test()
            _loaded.add(name)
        if "pyproj" in _loaded:
            _keep_proj_context()
