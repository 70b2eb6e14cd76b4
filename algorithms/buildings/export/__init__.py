"""Laid out zones in 3D for other programs: CityJSON and glTF."""

from .cityjson import city_json
from .files import write_city_json, write_gltf
from .gltf import gltf

__all__ = ["city_json", "gltf", "write_city_json", "write_gltf"]
