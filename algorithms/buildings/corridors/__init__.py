"""Corridors cut a zone into patches (RZ section 2)."""

from .zone import zone_of_site

__all__ = ["zone_of_site"]
