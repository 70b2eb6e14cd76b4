"""The parameters about parcels and street space that several tools share."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from qgis.core import QgsProcessingParameterDefinition

from .. import parameters
from ..request import Request
from . import persite

METHODS = {
    "strips": "rows of parcels along the streets, their sides square to them",
    "halving": "blocks are halved again and again, across the smallest rectangle around them",
    "skeleton": "land belongs to the nearest street and is cut across it",
}
DEEP = {
    "court": "a shared green in the middle",
    "lane": "a lane with parcels along it",
    "flag": "parcels behind others, with an access strip of their own",
}
REMAINDERS = {
    "redistribute": "all parcels of a row share it",
    "last": "the last parcel is as wide as what is left",
    "merge": "the last parcel takes it",
}
EDGES = {
    "streets": "along streets of the layer, as far away as the snap distance at most; block "
    "polygons without a layer of streets: everywhere but where two of them adjoin",
    "open": "everywhere, along streets that are in no layer",
    "closed": "nowhere",
}
#: Widths of streets by their level: key, what they are called, metres.
LEVELS = (
    ("MAJOR", "major streets", 20.0),
    ("COLLECTOR", "collectors", 16.0),
    ("LOCAL", "local streets", 12.0),
    ("CUL_DE_SAC", "culs-de-sac", 10.0),
)


def size() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the width and depth of parcels."""
    yield parameters.number(
        "PARCEL_WIDTH",
        "Parcel width",
        "Wished width of parcels along the street.",
        unit="m",
        default=18.0,
        minimum=1.0,
        maximum=1000.0,
    )
    yield parameters.number(
        "PARCEL_DEPTH",
        "Parcel depth",
        "Wished depth of parcels, away from the street.",
        unit="m",
        default=30.0,
        minimum=1.0,
        maximum=1000.0,
    )


def parcels() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the method, the size of parcels and what becomes of deep blocks."""
    yield parameters.choice("METHOD", "Method", "How blocks are cut.", METHODS, default="strips")
    yield from size()
    yield parameters.choice(
        "DEEP_BLOCKS",
        "Deep blocks",
        "What becomes of land that is too deep for two rows of parcels.",
        DEEP,
        default="court",
    )


def sizes() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what more is asked of parcels."""
    yield parameters.number(
        "MIN_FRONTAGE",
        "Least frontage",
        "Parcels have at least so much along a street.",
        unit="m",
        default=6.0,
        minimum=0.1,
        maximum=1000.0,
        advanced=True,
    )
    for key, text, share in (("MIN_AREA", "Least area", 0.45), ("MAX_AREA", "Largest area", 2.2)):
        yield parameters.number(
            key,
            f"{text} of a parcel",
            f"Empty: {share:g} of width x depth.",
            unit="m2",
            minimum=1.0,
            maximum=1e6,
            advanced=True,
            unset=f"{share:g} of width x depth",
        )
    yield from _rows()


def _rows() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how rows of parcels, corners and what lies behind are treated."""
    yield parameters.number(
        "CORNER_WIDTH",
        "Width of corner parcels",
        "Parcels at corners of streets are this many times as wide as others.",
        default=1.0,
        minimum=0.5,
        maximum=4.0,
        advanced=True,
    )
    yield parameters.choice(
        "REMAINDER",
        "Remainder of a row",
        "What becomes of the width that is left over at the end of a row.",
        REMAINDERS,
        default="redistribute",
        advanced=True,
    )
    yield parameters.flag(
        "GREENS",
        "Greens at pointed corners",
        "Whether pointed corners that suit no house become small greens.",
        default=True,
        advanced=True,
    )
    for key, text, width in (
        ("LANE_WIDTH", "Width of lanes", 6.0),
        ("FLAG_WIDTH", "Width of access strips", 4.0),
    ):
        yield parameters.number(
            key,
            text,
            "Where deep blocks have them.",
            unit="m",
            default=width,
            minimum=1.0,
            maximum=50.0,
            advanced=True,
        )
    yield parameters.number(
        "SEED",
        "Seed",
        "The same seed gives the same parcels; another one decides anew where there is a choice.",
        default=0,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
        advanced=True,
    )


def edges() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield where there is access, and where there is no land."""
    yield parameters.layer(
        "CLOSED",
        "Lines without access",
        "Edges of blocks within 2 m of these lines give no access, and neither do streets that "
        "lie on them: railways, walls, arterial roads.",
        "line",
        optional=True,
        advanced=True,
    )
    yield parameters.layer(
        "OBSTACLES",
        "Obstacles",
        "Polygons in the site that stay free of parcels, such as water or buildings to keep.",
        "polygon",
        optional=True,
        advanced=True,
    )
    yield parameters.choice(
        "EDGE",
        "Access along the edge",
        "Where parcels have access along the edge of the site or of block polygons.",
        EDGES,
        default="streets",
        advanced=True,
    )
    yield parameters.number(
        "SNAP_DISTANCE",
        "Snap distance",
        "Largest distance between a property line and the centre line of the street along it.",
        unit="m",
        default=30.0,
        minimum=0.1,
        maximum=500.0,
        advanced=True,
    )


def street_widths() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the widths of streets by their level."""
    for key, text, width in LEVELS:
        yield parameters.number(
            f"WIDTH_{key}",
            f"Width of {text}",
            "Where the street width is left empty and the street has no width_m.",
            unit="m",
            default=width,
            minimum=0.5,
            maximum=200.0,
            advanced=True,
        )


def rules_of(
    request: Request, *, size: tuple[float, float] | None = None, narrow: float | None = None
) -> Any:
    """Return the `ParcelRules` that all parameters together ask for.

    `size` stands for the width and depth; the least frontage is then at most the share `narrow`
    of the width.

    Raises
    ------
    InputError
        Two of them contradict each other.
    """
    from ...algorithms.parcels.rules import ParcelRules

    width, depth = size or (request.number("PARCEL_WIDTH"), request.number("PARCEL_DEPTH"))
    frontage = request.number("MIN_FRONTAGE")
    return ParcelRules(
        width=width,
        depth=depth,
        min_frontage=frontage if narrow is None else min(frontage, narrow * width),
        min_area=request.optional_number("MIN_AREA"),
        max_area=request.optional_number("MAX_AREA"),
        corner_width=request.number("CORNER_WIDTH"),
        remainder=request.word("REMAINDER"),
        deep=request.word("DEEP_BLOCKS"),
        method=request.word("METHOD"),
        lane_width=request.number("LANE_WIDTH"),
        flag_width=request.number("FLAG_WIDTH"),
        greens=request.flag("GREENS"),
    )


def widths_of(request: Request) -> Any:
    """Return the `StreetWidths` that are asked for."""
    from ...algorithms.parcels.streetspace import StreetWidths

    each = bool(persite.per_feature(request, ("STREET_WIDTH",)))
    return StreetWidths(
        **{key.lower(): request.number(f"WIDTH_{key}") for key, _, _ in LEVELS},
        every=None if each else request.optional_number("STREET_WIDTH"),
    )
