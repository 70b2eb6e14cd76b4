"""The whole chain from blocks to plots, with fallbacks, deep blocks and a guard."""

from __future__ import annotations

from .chain import fill_blocks
from .result import Filled, FillProblem

__all__ = ["FillProblem", "Filled", "fill_blocks"]
