"""Drawn templates warped into blocks, and what stands on parcels (UP section 4)."""

from .furnish import Furniture, furnish
from .match import Match, match_templates

__all__ = ["Furniture", "Match", "furnish", "match_templates"]
