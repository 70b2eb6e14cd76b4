"""Footpaths from entrances to street space (RZ 3.3 and 4.2)."""

from .exitcheck import ExitCheck
from .plan import plan_paths

__all__ = ["ExitCheck", "plan_paths"]
