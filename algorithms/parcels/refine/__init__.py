"""Refinement of parcels: square corners, even areas, by least squares on all blocks at once."""

from .refining import refine_blocks
from .scores import block_scores

__all__ = ["block_scores", "refine_blocks"]
