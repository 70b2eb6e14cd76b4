"""Templates: patterns of streets and parcels that a planner draws (UP section 4)."""

from .check import check_library
from .repeat import Cell, cells, repeated, scaled
from .store import read_library, shipped_library, write_library
from .types import CornerMark, Edge, Face, Template, TemplateLibrary

__all__ = [
    "Cell",
    "CornerMark",
    "Edge",
    "Face",
    "Template",
    "TemplateLibrary",
    "cells",
    "check_library",
    "read_library",
    "repeated",
    "scaled",
    "shipped_library",
    "write_library",
]
