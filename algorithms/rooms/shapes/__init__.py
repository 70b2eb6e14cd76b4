"""Shapes of rooms: read, drawn and shipped, laid on a mesh, and the limits of their numbers."""

from .colours import coloured
from .drawn import drawn_templates, drawn_unit
from .library import shipped_templates, template_sets
from .limits import count_rules
from .orient import orientations
from .placements import enumerate_placements
from .text import read_templates, templates_text

__all__ = [
    "coloured",
    "count_rules",
    "drawn_templates",
    "drawn_unit",
    "enumerate_placements",
    "orientations",
    "read_templates",
    "shipped_templates",
    "template_sets",
    "templates_text",
]
