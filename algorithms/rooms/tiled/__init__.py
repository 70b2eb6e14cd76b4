"""Game levels as maps of Tiled, the map editor (mapeditor.org)."""

from .raster import Tiles, rasterise
from .write import tiled_files, write_tiled

__all__ = ["Tiles", "rasterise", "tiled_files", "write_tiled"]
