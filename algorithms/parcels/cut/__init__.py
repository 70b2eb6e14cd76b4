"""Rows of parcels along the streets of given blocks: the default way to cut."""

from .blocks import cut_blocks, score
from .core import core_of

__all__ = ["core_of", "cut_blocks", "score"]
