"""From sites, roads and points to the ground that streets grow into."""

from .ground import GivenStreet, RealGround, ground_of_roads, ground_of_sites, open_ground
from .pointground import ground_of_points

__all__ = [
    "GivenStreet",
    "RealGround",
    "ground_of_points",
    "ground_of_roads",
    "ground_of_sites",
    "open_ground",
]
