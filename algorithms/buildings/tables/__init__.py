"""Tables of building types and of patches are read and checked."""

from .buildings import TYPE_SETS, building_types, shipped_types
from .indices import check_indices
from .patches import PatchChoice, patch_choices

__all__ = [
    "TYPE_SETS",
    "PatchChoice",
    "building_types",
    "check_indices",
    "patch_choices",
    "shipped_types",
]
