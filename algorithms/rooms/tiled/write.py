"""Files of levels for Tiled, written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from ...errors import InputError
from ...progress import Progress
from ..levels.graph import Level
from .document import document
from .png import png
from .raster import rasterise
from .tileset import draw_tileset
from .tmj import tmj, tsj
from .tmx import tmx, tsx


def write_tiled(
    path: str | Path,
    level: Level,
    *,
    tiles_per_cell: int = 5,
    tile_m: float | None = None,
    tile_px: int = 16,
    embed: bool = False,
    crs: str = "",
    progress: Progress | None = None,
) -> tuple[Path, ...]:
    """Write a level for the map editor Tiled, in the format of its version 1.10.

    Parameters
    ----------
    path
        The map: ".tmx" for XML, ".tmj" for JSON. Beside it go the picture of its tiles,
        "<name>_tiles.png", and their description, "<name>_tiles.tsx" or ".tsj". Files that are
        there are replaced.
    level
        From `read_level`.
    tiles_per_cell
        Tiles along the side of a square of the mesh, at least 3; on meshes that are no grid,
        along an edge of the length that was asked.
    tile_m
        Side of a tile, metres, instead of that.
    tile_px
        Side of a tile, pixels, at least 8.
    embed
        Whether to put the description of the tiles into the map.
    crs
        Name of the working CRS, such as "EPSG:3067", which the map then remembers.
    progress
        Asked for cancellation.

    Returns
    -------
    tuple of Path
        The files, the map first.

    Raises
    ------
    InputError
        If the file has another extension or cannot be written, or tiles cannot show the level;
        no file is changed then.
    CancelledError
        If the caller wants no more.
    """
    files = tiled_files(
        path,
        level,
        tiles_per_cell=tiles_per_cell,
        tile_m=tile_m,
        tile_px=tile_px,
        embed=embed,
        crs=crs,
        progress=progress,
    )
    _write(files)
    return tuple(reversed(files))


def tiled_files(
    path: str | Path,
    level: Level,
    *,
    tiles_per_cell: int = 5,
    tile_m: float | None = None,
    tile_px: int = 16,
    embed: bool = False,
    crs: str = "",
    progress: Progress | None = None,
) -> dict[Path, bytes]:
    """Return what `write_tiled` writes, by file; the map is the last.

    Parameters
    ----------
    path, level, tiles_per_cell, tile_m, tile_px, embed, crs, progress
        As of `write_tiled`.

    Raises
    ------
    InputError
        If the file has another extension, or tiles cannot show the level.
    CancelledError
        If the caller wants no more.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in {".tmx", ".tmj"}:
        raise InputError(
            f"{path.name} is no map of Tiled.", "Give it the extension .tmx (XML) or .tmj (JSON)."
        )
    tileset = draw_tileset(level.problem.templates, tile_px)
    tiles = rasterise(level, tiles_per_cell=tiles_per_cell, tile_m=tile_m, progress=progress)
    made = document(level, tiles, tileset, crs)
    image = path.with_name(f"{path.stem}_tiles.png")
    described = image.with_suffix(".tsx" if kind == ".tmx" else ".tsj")
    source = None if embed else described.name
    as_map, as_tileset = (tmx, tsx) if kind == ".tmx" else (tmj, tsj)
    files = {image: png(tileset.pixels)}
    if not embed:
        files[described] = as_tileset(tileset, image.name).encode()
    # the map last: who sees it finds what it refers to
    files[path] = as_map(made, source, image.name).encode()
    return files


def _write(files: Mapping[Path, bytes]) -> None:
    """Write files beside where they go, then put them there; all, or none where one fails."""
    begun: dict[Path, Path] = {}
    kept: dict[Path, bytes | None] = {}
    try:
        for path, data in files.items():
            with tempfile.NamedTemporaryFile(
                dir=path.parent, suffix=path.suffix, delete=False
            ) as file:
                begun[path] = Path(file.name)
                file.write(data)
            # as any other new file, not for its owner alone
            begun[path].chmod(0o666 & ~_umask())
        for path in files:
            kept[path] = path.read_bytes() if path.exists() else None
            os.replace(begun[path], path)
            del begun[path]
    except OSError as error:
        _put_back(kept)
        raise InputError(
            f"{error.filename or path} cannot be written ({error.strerror or error}).",
            "Choose a folder in which you may write.",
        ) from error
    finally:
        for left in begun.values():
            with contextlib.suppress(OSError):
                left.unlink()


def _put_back(kept: Mapping[Path, bytes | None]) -> None:
    """Undo what was replaced."""
    for path, data in kept.items():
        with contextlib.suppress(OSError):
            if data is None:
                path.unlink(missing_ok=True)
            elif path.read_bytes() != data:
                path.write_bytes(data)


def _umask() -> int:
    """Return which rights new files do not get."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
