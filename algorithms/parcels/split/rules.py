"""What a planner asks of the streets that split a site."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ...errors import InputError
from ..field.crosses import FieldKind
from ..field.score import Weights
from .choosing import TemplateRules


@dataclass(frozen=True)
class SplitRules:
    """What a planner asks of the streets that split a site.

    Attributes
    ----------
    street_width
        Width of the streets between their property lines, metres.
    max_block_length
        Blocks longer than this get a cross street where both its ends find one, metres.
    field_kind
        Kind of cross field: smooth (as straight as the edges allow), distance (parallel to the
        nearest edge) or guided (along drawn lines).
    weights
        Of the scores.
    least_depth, largest_depth
        Land is at least and at most this many parcel depths from access.
    templates
        Drawn templates that may be used, None for rows of parcels alone.
    tries
        How many poor regions are split anew after the first parcels, at most.
    optimise
        Whether all streets are moved once more so that rows fit better (UP section 6).
    turning_radius
        Of the turning circle where a street ends at an edge without a street, metres.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    street_width: float = 15.0
    max_block_length: float = 260.0
    field_kind: FieldKind = "smooth"
    weights: Weights = field(default_factory=Weights)
    least_depth: float = 0.6
    largest_depth: float = 1.5
    templates: TemplateRules | None = None
    tries: int = 24
    optimise: bool = True
    turning_radius: float = 9.0

    def __post_init__(self) -> None:
        for name in ("street_width", "max_block_length"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"The {name.replace('_', ' ')} is {value:g}.", "Give a number greater than 0."
                )
