"""Candidate meshes: semi-regular quads whose edges may become streets."""

from .foreign import foreign_edges
from .grids import fan, grid
from .layers import mesh_from_edges, mesh_from_faces, mesh_layers
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
    "mesh_from_edges",
    "mesh_from_faces",
    "mesh_layers",
    "quadrangulate",
    "quality",
    "subdivide",
]
