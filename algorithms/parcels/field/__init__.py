"""Cross fields over a region, and the streets that they suggest (UP section 5)."""

from __future__ import annotations

from .crosses import CrossField, FieldKind, cross_field, default_size
from .junctions import meet_streets
from .layers import field_layers, line_layer
from .outline import Outline, outline
from .pieces import shares, solid, split
from .propose import Proposal, good_seeds, propose
from .region import CLOSED, FRONTAGE, STREET, Region
from .score import REASONS, Scores, Weights, score
from .spacing import Spacing
from .streamlines import Streamlines, streamlines
from .triangulation import Triangulation, triangulate

__all__ = [
    "CLOSED",
    "FRONTAGE",
    "REASONS",
    "STREET",
    "CrossField",
    "FieldKind",
    "Outline",
    "Proposal",
    "Region",
    "Scores",
    "Spacing",
    "Streamlines",
    "Triangulation",
    "Weights",
    "cross_field",
    "default_size",
    "field_layers",
    "good_seeds",
    "line_layer",
    "meet_streets",
    "outline",
    "propose",
    "score",
    "shares",
    "solid",
    "split",
    "streamlines",
    "triangulate",
]
