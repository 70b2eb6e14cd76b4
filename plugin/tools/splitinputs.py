"""The parameters of tools that lay out streets and parcels together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from qgis.core import QgsProcessingParameterDefinition

from .. import parameters
from ..request import Request
from . import parcelinputs, templateinputs

FIELDS = {
    "smooth": "streets follow the edges of the site, as straight as these allow",
    "distance": "streets run parallel to the nearest edge",
    "guided": "streets follow drawn guide lines",
}


def key_elements() -> QgsProcessingParameterDefinition:
    """Declare the areas whose use is fixed."""
    return parameters.layer(
        "KEY_ELEMENTS",
        "Key areas",
        "Polygons whose use is fixed: lakes, parks, school sites, commercial areas. The field use "
        "says what they are (park where it is missing), the field around (yes or no) whether a "
        "street runs around; without it one does around schools, commercial and civic areas.",
        "polygon",
        optional=True,
    )


def sizes(*, wide: bool = True) -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the size of parcels and the width of streets, which may be behind Advanced."""
    yield from parcelinputs.size()
    yield parameters.number(
        "STREET_WIDTH",
        "Street width",
        "Of new streets, from property line to property line.",
        unit="m",
        default=15.0,
        minimum=1.0,
        maximum=200.0,
        advanced=not wide,
    )


def variations() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how many layouts are made and kept, and the seed."""
    yield parameters.number(
        "VARIATIONS",
        "Variations",
        "So many layouts are made, and ranked by their score. The first takes the best street "
        "everywhere, the others choose among the good ones.",
        default=3,
        minimum=1,
        maximum=1000,
        integer=True,
    )
    yield parameters.number(
        "KEEP",
        "Variations in the layers",
        "So many of the best are written to the layers; the table compares all.",
        default=1,
        minimum=1,
        maximum=1000,
        integer=True,
        advanced=True,
    )


def streets() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what is asked of streets in detail."""
    yield parameters.layer(
        "KEY_STREETS",
        "Main streets",
        "Lines of streets that split the site first. The field width_m says how wide they are, "
        "else the street width counts. Ends within 40 m of the edge or of each other are joined.",
        "line",
        optional=True,
        advanced=True,
    )
    yield parameters.number(
        "BLOCK_LENGTH",
        "Longest block",
        "Blocks that are longer get a street across where both its ends find a street.",
        unit="m",
        default=260.0,
        minimum=20.0,
        maximum=5000.0,
        advanced=True,
    )
    yield parameters.choice(
        "FIELD",
        "Course of streets",
        "What streets follow.",
        FIELDS,
        default="smooth",
        advanced=True,
    )
    yield parameters.layer(
        "GUIDES",
        "Guide lines",
        "Lines that the streets around follow where their course is guided.",
        "line",
        optional=True,
        advanced=True,
    )
    yield from _weights()
    yield from _effort()


def _weights() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how much the scores of streets count."""
    for key, text, what in (
        ("WEIGHT_DIVERGENCE", "even distances", "it counts that streets keep their distance"),
        ("WEIGHT_ROWS", "whole rows", "it counts that whole rows of parcels fit on both sides"),
        ("WEIGHT_SINGULARITIES", "irregular points", "it counts that streets run where the field "
         "is irregular"),
        ("WEIGHT_CONTINUITY", "continuity", "it counts that streets go on where others arrive"),
    ):  # fmt: skip
        yield parameters.number(
            key,
            f"Weight of {text}",
            f"How much {what}.",
            default=1.0,
            minimum=0.0,
            maximum=100.0,
            advanced=True,
        )


def _effort() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how long better streets are looked for, and how blind ends turn."""
    yield parameters.number(
        "EFFORT",
        "Second thoughts",
        "At most so many places with poor parcels are split anew in each layout. More take "
        "longer and make better parcels.",
        default=24,
        minimum=0,
        maximum=10000,
        integer=True,
        advanced=True,
    )
    yield parameters.number(
        "TURNING_RADIUS",
        "Turning radius",
        "Of the circle at the end of a street that finds no other.",
        unit="m",
        default=9.0,
        minimum=0.0,
        maximum=50.0,
        advanced=True,
    )


def deep() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what becomes of deep blocks."""
    yield parameters.choice(
        "DEEP_BLOCKS",
        "Deep blocks",
        "What becomes of land that is too deep for two rows of parcels and gets no street.",
        parcelinputs.DEEP,
        default="court",
        advanced=True,
    )
    yield parameters.choice(
        "METHOD",
        "Method",
        "How blocks are cut.",
        parcelinputs.METHODS,
        default="strips",
        advanced=True,
    )


def rules_of(request: Request) -> Any:
    """Return the `ParcelRules` that all parameters together ask for."""
    return parcelinputs.rules_of(request)


def split_of(request: Request) -> Any:
    """Return the `SplitRules` that all parameters together ask for."""
    from ...algorithms.parcels.field.score import Weights
    from ...algorithms.parcels.split import SplitRules

    return SplitRules(
        street_width=request.number("STREET_WIDTH"),
        max_block_length=request.number("BLOCK_LENGTH"),
        field_kind=request.word("FIELD"),
        weights=Weights(
            div=request.number("WEIGHT_DIVERGENCE"),
            db=request.number("WEIGHT_ROWS"),
            ds=request.number("WEIGHT_SINGULARITIES"),
            ct=request.number("WEIGHT_CONTINUITY"),
        ),
        templates=templateinputs.templates_of(request) if request.declares("TEMPLATES") else None,
        tries=request.integer("EFFORT"),
        turning_radius=request.number("TURNING_RADIUS"),
    )
