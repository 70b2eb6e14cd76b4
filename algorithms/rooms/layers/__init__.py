"""From a solved floor plan to layers: rooms, corridors of a width, doors, distances, figures."""

from __future__ import annotations

from .checks import faults
from .collect import COLUMNS, StoreyPlan, floor_layers
from .figures import dead_ends, floor_figures
from .width import Ground, widen

__all__ = [
    "COLUMNS",
    "Ground",
    "StoreyPlan",
    "dead_ends",
    "faults",
    "floor_figures",
    "floor_layers",
    "widen",
]
