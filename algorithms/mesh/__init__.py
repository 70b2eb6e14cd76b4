"""Candidate meshes: semi-regular quads whose edges may become streets."""

from .foreign import foreign_edges
from .grids import fan, grid
from .polysquare import quadrangulate
from .quadmesh import QuadMesh
from .quality import MeshQuality, quality
from .subdivide import subdivide

__all__ = [
    "MeshQuality",
    "QuadMesh",
    "fan",
    "foreign_edges",
    "grid",
    "quadrangulate",
    "quality",
    "subdivide",
]
