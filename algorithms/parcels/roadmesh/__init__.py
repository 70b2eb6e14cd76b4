"""Streets and the regions between them as one planar mesh."""

from .begin import GivenStreet, Ground, begin_mesh
from .land import region_blocks
from .layer import street_layer
from .mesh import MeshEdge, Region, StreetMesh
from .streets import MeshStreet, street_lines

__all__ = [
    "GivenStreet",
    "Ground",
    "MeshEdge",
    "MeshStreet",
    "Region",
    "StreetMesh",
    "begin_mesh",
    "region_blocks",
    "street_layer",
    "street_lines",
]
