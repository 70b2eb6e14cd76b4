"""Streets moved all at once, until rows of parcels fit better between them (UP section 6)."""

from .optimise import optimise_mesh
from .weights import Weights

__all__ = ["Weights", "optimise_mesh"]
