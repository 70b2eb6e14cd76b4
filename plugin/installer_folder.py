"""The folder of our own in the profile that holds Python packages, and which one is in force.

Each installation is a folder of its own; one small file names the one in force and is replaced
in one step. So no running QGIS loses what it has loaded, also where the system locks files in
use, and a half-made installation is never seen.
"""

from __future__ import annotations

import importlib
import json
import os
import shutil
import sys
import sysconfig
import tempfile
import time
from pathlib import Path
from typing import Any, Optional

from qgis.core import QgsApplication

_POINTER = "current.json"


def base() -> Path:
    """Return the folder in the user's QGIS profile that holds the installations."""
    return Path(QgsApplication.qgisSettingsDirPath()) / "platwright" / "packages"


def this_python() -> str:
    """Return for which Python packages are: version and platform."""
    return f"{sys.version_info[0]}.{sys.version_info[1]} {sysconfig.get_platform()}"


def record() -> dict[str, Any]:
    """Return what is noted of the installation in force; empty where there is none."""
    try:
        text = (base() / _POINTER).read_text(encoding="utf-8")
        found = json.loads(text)
    except (OSError, ValueError):
        return {}
    if not isinstance(found, dict) or not isinstance(found.get("folder"), str):
        return {}
    # A name only: the file must not lead anywhere else.
    folder = base() / Path(found["folder"]).name
    return found if folder.is_dir() else {}


def current() -> Optional[Path]:
    """Return the installation in force, or None where there is none for this Python."""
    found = record()
    if not found or found.get("python") != this_python():
        return None
    return base() / Path(found["folder"]).name


def of_other_python() -> str:
    """Return for which other Python the installation was made; empty where that is no matter."""
    found = record()
    other = str(found.get("python", "")) if found else ""
    return "" if other == this_python() else other


def new() -> Path:
    """Make and return an empty folder for a new installation."""
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S")
    base().mkdir(parents=True, exist_ok=True)
    return Path(tempfile.mkdtemp(prefix=f"{stamp}_", dir=base()))


def put_in_force(folder: Path, noted: dict[str, Any]) -> None:
    """Make an installation the one that is used, in one step."""
    pointer = base() / _POINTER
    fresh = pointer.with_suffix(f".{os.getpid()}")
    noted = {"folder": folder.name, "python": this_python(), **noted}
    fresh.write_text(json.dumps(noted, indent=1, sort_keys=True), encoding="utf-8")
    fresh.replace(pointer)
    importlib.invalidate_caches()


def tidy() -> None:
    """Delete installations that are not in force, as far as the system allows.

    To be called while the lock is held, so that none of them is being made.
    """
    found = record()
    in_force = Path(found["folder"]).name if found else ""
    # In use by this very process: modules may still be read from it.
    used = {str(Path(entry).resolve()) for entry in sys.path if entry}
    for folder in base().glob("*"):
        if folder.is_dir() and folder.name != in_force and str(folder.resolve()) not in used:
            shutil.rmtree(folder, ignore_errors=True)


def remove() -> bool:
    """Put no installation in force and delete what there is.

    Returns
    -------
    bool
        Whether all is gone; what is in use goes the next time.
    """
    (base() / _POINTER).unlink(missing_ok=True)
    for folder in base().glob("*"):
        if folder.is_dir():
            shutil.rmtree(folder, ignore_errors=True)
    return not any(folder.is_dir() for folder in base().glob("*"))
