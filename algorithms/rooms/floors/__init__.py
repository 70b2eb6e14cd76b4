"""From a building's footprint to the mesh of its storeys, with exits, obstacles and corridors."""

from .build import floors_of, floors_of_mesh
from .tile import Tiling, tile_footprint
from .types import Floor, LayerNames, Remark

__all__ = [
    "Floor",
    "LayerNames",
    "Remark",
    "Tiling",
    "floors_of",
    "floors_of_mesh",
    "tile_footprint",
]
