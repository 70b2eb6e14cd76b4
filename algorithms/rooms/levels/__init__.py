"""Game levels: their blocks as a graph, their layers, and whether they keep the rules."""

from .checks import LEVEL_TYPES, LevelType, faults, level_type
from .collect import COLUMNS, block_polygons, empty_layers, level_layers
from .graph import Level, Passage, dead_ends, is_cycle, is_path, neighbours, read_level

__all__ = [
    "COLUMNS",
    "LEVEL_TYPES",
    "Level",
    "LevelType",
    "Passage",
    "block_polygons",
    "dead_ends",
    "empty_layers",
    "faults",
    "is_cycle",
    "is_path",
    "level_layers",
    "level_type",
    "neighbours",
    "read_level",
]
