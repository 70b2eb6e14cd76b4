"""Parcels after Vanegas et al. 2012: recursive halves, and strips of the straight skeleton."""

from __future__ import annotations

from .halve import halve_blocks
from .skeleton import skeleton_blocks

__all__ = ["halve_blocks", "skeleton_blocks"]
