"""Files of plans in 3D, written whole or not at all."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from pathlib import Path

from ...errors import InputError
from .cityjson import city_json
from .gltf import gltf
from .scene import Layers


def write_city_json(path: str | Path, layers: Layers, *, title: str = "Residential zone") -> None:
    """Write a CityJSON file (.city.json or .json).

    Parameters
    ----------
    path
        A file, which is replaced where it is there.
    layers, title
        As of `city_json`.

    Raises
    ------
    InputError
        If there is nothing to write, or the file cannot be written; one that was there stays.
    """
    text = json.dumps(city_json(layers, title=title), separators=(",", ":"), allow_nan=False)
    _write(Path(path), text.encode())


def write_gltf(path: str | Path, layers: Layers) -> None:
    """Write a binary glTF file (.glb).

    Parameters
    ----------
    path
        A file, which is replaced where it is there.
    layers
        As of `gltf`.

    Raises
    ------
    InputError
        If there is nothing to write, or the file cannot be written; one that was there stays.
    """
    _write(Path(path), gltf(layers))


def _write(path: Path, data: bytes) -> None:
    """Write a file beside the place where it goes, then put it there."""
    begun = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=path.suffix, delete=False) as file:
            begun = Path(file.name)
            file.write(data)
        # as any other new file, not for its owner alone
        begun.chmod(0o666 & ~_umask())
        os.replace(begun, path)
        begun = None
    except OSError as error:
        raise InputError(
            f"{path} cannot be written ({error.strerror or error}).",
            "Choose a folder in which you may write.",
        ) from error
    finally:
        if begun is not None:
            with contextlib.suppress(OSError):
                begun.unlink()


def _umask() -> int:
    """Return which rights new files do not get."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
