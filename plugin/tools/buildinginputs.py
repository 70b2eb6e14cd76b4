"""The parameters of residential zones."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, NamedTuple

from qgis.core import QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import parameters
from ..request import Request


class TypeSet(NamedTuple):
    """A shipped set of building types (`buildings.tables.TYPE_SETS`): its text, wishes for it."""

    text: str
    far: float
    density: float


TYPE_SETS = {
    "multistorey": TypeSet("slabs and point houses of six storeys, 18 m high", 1.1, 0.28),
    "highrise": TypeSet("towers of 12 and 20 storeys", 1.8, 0.25),
    "slabs": TypeSet("slabs of four and five storeys", 0.9, 0.25),
    "terraced": TypeSet("terraced houses of two and three storeys", 0.6, 0.3),
    "mixed": TypeSet("towers, slabs and row houses, with a kindergarten and shops", 1.2, 0.25),
}
#: RZ Table 3; the place of a word is its number there.
PATTERNS = {
    "empty": "none",
    "rows": "parallel rows that face the sun, as the sides of the patch allow",
    "centric": "rings around a green centre",
    "enclosed": "along the edge of the patch, around a court",
    "symmetrical": "mirrored at an axis, where both of its sides have room",
    "dotted": "single buildings, well apart",
}
PATH_PATTERNS = {
    "direct": "straight to the street",
    "circle": "paths close to a loop",
    "ending": "branches that end at the buildings",
}
METHODS = {
    "optimise": "an integer program improves the staged plan until the time limit",
    "staged": "the stages of the paper: along the lines, building by building",
}


def land() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the streets of the zone."""
    yield parameters.layer(
        "CORRIDORS",
        "Corridors",
        "Centre lines of streets within the zone, such as those of Design streets or Grow streets. "
        "They cut it into patches. Empty: a corridor plan from the shipped samples is fitted in, "
        "where the zone is large enough to need one.",
        "line",
        optional=True,
    )


def wishes() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what is built, in which pattern, and how much of it."""
    meanings = {
        word: f"{kind.text} (floor area ratio {kind.far:g}, density {kind.density:g})"
        for word, kind in TYPE_SETS.items()
    }
    yield parameters.choice(
        "TYPE_SET",
        "Buildings",
        "A shipped set of building types, and what an empty floor area ratio and density are. A "
        "table of building types of your own replaces the buildings.",
        meanings,
        default="multistorey",
    )
    yield parameters.layer(
        "BUILDING_TYPES",
        "Building types",
        "A table of your own, one row for each type. Fields: name, length and width (m), height "
        "(m) or storeys; and, if you like, use (residence or facility), share, count, entrance "
        "(same or opposite: the side of the balconies or the one behind), dwellings, and parking "
        "(places for a dwelling).",
        "table",
        optional=True,
    )
    yield parameters.choice(
        "PATTERN",
        "Pattern",
        "How residences stand. Patches of a layer of their own may say otherwise.",
        PATTERNS,
        default="rows",
    )
    yield parameters.number(
        "FAR",
        "Floor area ratio",
        "Wished floor area / area of the zone. Empty: as the buildings say.",
        minimum=0.01,
        maximum=20.0,
    )
    yield parameters.number(
        "SUN_COEFFICIENT",
        "Sun spacing",
        "How far the shadow of a building reaches behind it, as a multiple of its height; no "
        "residence stands in it. Hours of sun, if given, replace it.",
        default=1.0,
        minimum=0.01,
        maximum=10.0,
    )


def indices() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield density, green, and how far limits lie from wishes."""
    yield parameters.number(
        "DENSITY",
        "Building density",
        "Wished share of the zone that is built on. Empty: as the buildings say.",
        minimum=0.01,
        maximum=1.0,
        advanced=True,
    )
    yield parameters.number(
        "GREEN_RATIO",
        "Green ratio",
        "Wished share of the zone that is green; less is told among the problems.",
        default=0.35,
        minimum=0.0,
        maximum=1.0,
        advanced=True,
    )
    for key, what in (("FAR_LIMIT", "floor area ratio"), ("DENSITY_LIMIT", "building density")):
        yield parameters.number(
            key,
            f"Limit of the {what}",
            "Never more than this. Empty: 5 % above the wish.",
            minimum=0.01,
            maximum=20.0,
            advanced=True,
            unset="5 % above the wish",
        )
    yield parameters.number(
        "PARKING",
        "Parking places per dwelling",
        "On the ground, beside streets. 0: none, for facilities neither. Empty: as the building "
        "types say.",
        minimum=0.0,
        maximum=10.0,
        advanced=True,
    )


def patterns() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield patterns of single patches, of facilities and of paths."""
    yield parameters.layer(
        "PATCHES",
        "Patches with patterns",
        "Polygons with patterns of their own, in the fields residences and facilities (words of "
        "Pattern), paths (words of Path pattern), path_direction (1 or 0) and facing (degrees from "
        "north). Streets cut them further.",
        "polygon",
        optional=True,
        advanced=True,
    )
    yield parameters.choice(
        "FACILITY_PATTERN",
        "Pattern of facilities",
        "How shops, kindergartens and the like stand.",
        PATTERNS,
        default="rows",
        advanced=True,
    )
    yield parameters.choice(
        "PATH_PATTERN",
        "Path pattern",
        "How footpaths lead to the streets.",
        PATH_PATTERNS,
        default="direct",
        advanced=True,
    )
    yield parameters.number(
        "FACING",
        "Direction of the balconies",
        "In degrees clockwise from north. Empty: the side of the equator, turned to "
        "the sides of the patch where they are near to that.",
        unit="degrees",
        minimum=0.0,
        maximum=360.0,
        advanced=True,
    )


def sun() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the rule of hours of sun."""
    yield parameters.number(
        "SUN_HOURS",
        "Hours of sun",
        "Each residence gets at least so many hours of sun at its balcony façade, by true shadows "
        "on the day below. Empty: the sun spacing counts.",
        unit="h",
        minimum=0.0,
        maximum=24.0,
        advanced=True,
    )
    for key, text, default, most in (("SUN_MONTH", "Month", 1, 12), ("SUN_DAY", "Day", 20, 31)):
        yield parameters.number(
            key,
            f"{text} of the sun",
            "Of the day on which hours of sun are counted.",
            default=default,
            minimum=1,
            maximum=most,
            integer=True,
            advanced=True,
        )
    for key, text, hour in (("SUN_START", "First", 9.0), ("SUN_END", "Last", 15.0)):
        yield parameters.number(
            key,
            f"{text} hour of the sun",
            "Between which hours sun counts, in true solar time: at 12 the sun is highest.",
            unit="h",
            default=hour,
            minimum=0.0,
            maximum=24.0,
            advanced=True,
        )


def distances() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield distances between buildings, streets, paths and trees."""
    for key, text, meaning, default, least in (
        ("SETBACK", "Setback", "Least distance of buildings from streets, the edge of the zone and "
         "obstacles.", 5.0, 0.0),
        ("GAP", "Gap between buildings", "Least distance of buildings that do not border upon each "
         "other.", 6.0, 0.0),
        ("GROUP", "Longest group", "Buildings that border upon each other are together at most so "
         "long.", 60.0, 1.0),
        ("PATH_WIDTH", "Width of paths", "Of footpaths and access lanes.", 3.0, 0.5),
        ("TREE_SPACING", "Distance of trees", "Along streets and paths.", 10.0, 2.0),
    ):  # fmt: skip
        yield parameters.number(
            key, text, meaning, unit="m", default=default, minimum=least, maximum=500.0,
            advanced=True,
        )  # fmt: skip


def search() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield method, time and seed."""
    yield parameters.choice(
        "METHOD",
        "Method",
        "How buildings are placed.",
        METHODS,
        default="optimise",
        advanced=True,
    )
    yield parameters.number(
        "TIME_LIMIT",
        "Time limit",
        "For placing the buildings of one zone; small zones need less.",
        unit="s",
        default=15.0,
        minimum=1.0,
        maximum=3600.0,
        advanced=True,
    )
    yield parameters.number(
        "SEED",
        "Seed",
        "Another seed decides anew where there is a choice. The same seed gives the same plan with "
        "the method staged; with optimise the time limit ends the search, and a faster machine may "
        "come further.",
        default=42,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
        advanced=True,
    )


def rules_of(request: Request) -> Any:
    """Return the `LayoutRules` that all parameters together ask for.

    Raises
    ------
    InputError
        A number is out of bounds or two contradict each other.
    """
    from ...algorithms.buildings.rules import LayoutRules, SunRule

    usual = TYPE_SETS[request.word("TYPE_SET")]
    far, density = request.optional_number("FAR"), request.optional_number("DENSITY")
    limits = {key: request.optional_number(key.upper()) for key in ("far_limit", "density_limit")}
    return LayoutRules(
        far=usual.far if far is None else far,
        density=usual.density if density is None else density,
        green=request.number("GREEN_RATIO"),
        **limits,
        sun=SunRule(
            coefficient=request.number("SUN_COEFFICIENT"),
            hours=request.optional_number("SUN_HOURS"),
            month=request.integer("SUN_MONTH"),
            day=request.integer("SUN_DAY"),
            start=request.number("SUN_START"),
            end=request.number("SUN_END"),
        ),
        setback_m=request.number("SETBACK"),
        gap_m=request.number("GAP"),
        group_m=request.number("GROUP"),
        path_m=request.number("PATH_WIDTH"),
        tree_spacing_m=request.number("TREE_SPACING"),
        method=request.word("METHOD"),
        time_limit=request.number("TIME_LIMIT"),
        seed=request.integer("SEED"),
    )


def types_of(request: Request, progress: Any) -> Any:
    """Return the `BuildingType`s that are asked for.

    Raises
    ------
    InputError
        A row of the table cannot be used.
    """
    from ...algorithms.buildings.tables import building_types, shipped_types

    table = request.frame("BUILDING_TYPES", progress)
    if table is None:
        types = shipped_types(request.word("TYPE_SET"))
    else:
        types = building_types(table, request.name("BUILDING_TYPES"))
    parking = request.optional_number("PARKING")
    if parking is None:
        return types
    return tuple(
        dataclasses.replace(kind, parking=parking)
        if kind.use == "residence" or parking == 0
        else kind
        for kind in types
    )


def choice_of(request: Request) -> Any:
    """Return the `PatchChoice` of patches that say nothing themselves.

    Raises
    ------
    InputError
        Both patterns are empty, so that nothing would be built.
    """
    from ...algorithms.buildings.tables.patches import PatchChoice
    from ...algorithms.buildings.types import BUILDING_PATTERNS
    from ...algorithms.buildings.types import PATH_PATTERNS as PATHS

    residences, facilities = (request.word(key) for key in ("PATTERN", "FACILITY_PATTERN"))
    if residences == facilities == "empty" and not request.has("PATCHES"):
        raise InputError(
            "Both patterns are empty, so that nothing would be built.",
            "Choose a pattern of residences or of facilities, or give patches with patterns.",
        )
    return PatchChoice(
        residences=BUILDING_PATTERNS.index(residences),
        facilities=BUILDING_PATTERNS.index(facilities),
        paths=PATHS.index(request.word("PATH_PATTERN")),
        path_direction=1,
        facing_deg=request.optional_number("FACING"),
    )
