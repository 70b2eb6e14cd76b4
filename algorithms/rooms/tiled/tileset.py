"""The tiles of a level, drawn: one floor for each template, walls, doors and marks."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...network.problem import BoolArray, FloatArray
from ..types import Template
from .png import Pixels

#: Tiles after the floors, in this order.
MARKS = ("wall", "door", "route", "start", "goal", "treasure")
#: Smallest side of a tile in pixels that its drawing fits.
LEAST_PIXELS = 8
_COLOURS = {
    "stone": (74, 78, 92),
    "mortar": (46, 49, 60),
    "wood": (156, 106, 58),
    "plank": (112, 72, 36),
    "route": (250, 250, 245),
    "start": (38, 158, 92),
    "goal": (206, 52, 60),
    "treasure": (240, 186, 40),
    "rim": (40, 34, 30),
}
_HEX = re.compile(r"#[0-9a-fA-F]{6}")


@dataclass(frozen=True, eq=False)
class Tileset:
    """The tiles of a map in one row.

    Attributes
    ----------
    size
        Side of a tile, pixels.
    kinds
        Of each tile "floor" or one of `MARKS`.
    templates
        Of each floor its template, in the same order; they come first.
    pixels
        Shape (size, size * number of tiles, 4). The picture.
    """

    size: int
    kinds: tuple[str, ...]
    templates: tuple[Template, ...]
    pixels: Pixels

    def index(self, kind: str) -> int:
        """Return the number, from 0, of a mark."""
        return self.kinds.index(kind)


def draw_tileset(templates: Sequence[Template], size: int) -> Tileset:
    """Draw the tiles for a set of templates.

    Parameters
    ----------
    templates
        At least one; floors have their colours.
    size
        Side of a tile, pixels, at least 8.

    Raises
    ------
    InputError
        If the tiles are too small or a colour is none.
    """
    if size < LEAST_PIXELS:
        raise InputError(f"Tiles of {size} pixels are too small.", f"Take {LEAST_PIXELS} or more.")
    drawn = [_floor(_rgb(template), size) for template in templates]
    drawn += [_wall(size), _door(size), _dot(size), _disc(size, "start"), _disc(size, "goal")]
    drawn.append(_gem(size))
    kinds = ("floor",) * len(templates) + MARKS
    return Tileset(size, kinds, tuple(templates), np.hstack(drawn))


def _rgb(template: Template) -> tuple[int, int, int]:
    """Read the colour of a template."""
    if not _HEX.fullmatch(template.colour):
        raise InputError(
            f"Template '{template.name}' has the colour '{template.colour}'.",
            "Write it as #rrggbb.",
        )
    red, green, blue = bytes.fromhex(template.colour[1:])
    return red, green, blue


def _blank(size: int) -> Pixels:
    """Return an empty tile."""
    return np.zeros((size, size, 4), dtype=np.uint8)


def _paint(tile: Pixels, where: BoolArray, colour: tuple[int, int, int], alpha: int = 255) -> None:
    """Colour some pixels of a tile."""
    tile[where] = (*colour, alpha)


def _shade(colour: tuple[int, int, int], factor: float) -> tuple[int, int, int]:
    """Make a colour darker or lighter."""
    red, green, blue = (min(255, round(part * factor)) for part in colour)
    return red, green, blue


def _grid(size: int) -> tuple[FloatArray, FloatArray]:
    """Return x and y of the middle of each pixel, -1 to 1 across the tile."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) * 2 / size - 1
    return x, y


def _floor(colour: tuple[int, int, int], size: int) -> Pixels:
    """Draw a paving stone: its colour, a light upper left and a dark lower right edge."""
    tile = _blank(size)
    _paint(tile, np.ones((size, size), dtype=np.bool_), colour)
    tile[0, :, :3] = tile[:, 0, :3] = _shade(colour, 1.06)
    tile[-1, :, :3] = tile[:, -1, :3] = _shade(colour, 0.9)
    return tile


def _wall(size: int) -> Pixels:
    """Draw two courses of bricks."""
    tile = _blank(size)
    _paint(tile, np.ones((size, size), dtype=np.bool_), _COLOURS["stone"])
    half, quarter = size // 2, size // 4
    tile[[half - 1, size - 1], :, :3] = _COLOURS["mortar"]
    tile[:half, quarter, :3] = _COLOURS["mortar"]
    tile[half:, quarter + half, :3] = _COLOURS["mortar"]
    return tile


def _door(size: int) -> Pixels:
    """Draw planks of a threshold."""
    tile = _blank(size)
    _paint(tile, np.ones((size, size), dtype=np.bool_), _COLOURS["wood"])
    tile[:: max(2, size // 4), :, :3] = _COLOURS["plank"]
    return tile


def _dot(size: int) -> Pixels:
    """Draw a dot, as of a trail, on nothing."""
    tile = _blank(size)
    x, y = _grid(size)
    _paint(tile, np.asarray(np.hypot(x, y) < 0.32), _COLOURS["route"], 210)
    return tile


def _disc(size: int, kind: str) -> Pixels:
    """Draw a rimmed disc on nothing; that of the goal has a light middle."""
    tile = _blank(size)
    x, y = _grid(size)
    far = np.hypot(x, y)
    _paint(tile, np.asarray(far < 0.92), _COLOURS["rim"])
    _paint(tile, np.asarray(far < 0.74), _COLOURS[kind])
    if kind == "goal":
        _paint(tile, np.asarray(far < 0.36), _COLOURS["route"])
    return tile


def _gem(size: int) -> Pixels:
    """Draw a rimmed diamond on nothing."""
    tile = _blank(size)
    x, y = _grid(size)
    far = np.abs(x) + np.abs(y)
    _paint(tile, np.asarray(far < 0.98), _COLOURS["rim"])
    _paint(tile, np.asarray(far < 0.72), _COLOURS["treasure"])
    return tile
