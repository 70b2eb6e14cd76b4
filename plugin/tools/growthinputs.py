"""The parameters of streets that grow."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFile,
)

from ...algorithms.errors import InputError
from .. import compat, parameters
from ..bridge import crs_text
from ..request import Request
from . import siteinputs

#: The shipped grammars (`growth.grammars.shipped.GRAMMARS`) and what they make.
GRAMMARS = {
    "organic": "winding main streets that branch, with loops and few right angles, as in old towns",
    "grid": "straight streets at right angles, with blocks of a few sizes",
    "hex": "six main streets from one centre, with blocks of 60 and 90 degrees between",
    "line": "a linear town: one long main street, one beside it on each side, small ones between",
    "radial": "a village of six streets and three rings around each start, which ends by itself",
    "suburb": "curving collectors off main streets, with many culs-de-sac, as in newer suburbs",
}
EDGES = {
    "stop": "streets end there",
    "join": "a street runs along it, and the others end at that",
}
DEAD_ENDS = {
    "keep": "they stay, as culs-de-sac",
    "remove": "streets that lead nowhere, or to an obstacle or a motorway, are taken away again, "
    "but not those that end at the edge of the site",
}
#: North in degrees from east, counter-clockwise.
_NORTH = 90.0


def land() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield where streets grow, and from what."""
    site = siteinputs.site()
    site.setFlags(site.flags() | compat.OPTIONAL)
    site.setHelp(
        f"{site.help()} Empty: streets grow from the existing roads, or from start points, over "
        "open ground. Optional."
    )
    yield site
    yield parameters.layer(
        "ROADS",
        "Existing roads",
        "Centre lines of roads in and around the site. They stay where they are; streets go on "
        "from their loose ends and from where they arrive at the site.",
        "line",
        optional=True,
    )
    obstacles = siteinputs.obstacles()
    obstacles.setHelp(f"{obstacles.help().removesuffix('Optional.')}Only with a site. Optional.")
    yield obstacles
    yield parameters.layer(
        "START_POINTS",
        "Start points",
        "Points where growth begins, instead of the ends and junctions of existing roads. Without "
        "points and roads it begins in the middle of the site or, without a site, at the origin "
        "of the coordinates.",
        "point",
        optional=True,
    )


def grammar() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what the streets look like, and how large they are."""
    yield parameters.choice(
        "GRAMMAR",
        "Kind of streets",
        "The rules by which streets branch.",
        GRAMMARS,
        default="organic",
    )
    yield parameters.number(
        "SCALE",
        "Scale",
        "How long a street of length 1 in the grammar is, which is the distance between junctions "
        "roughly. 100 m makes a sparse town, 40 to 60 m a neighbourhood.",
        unit="m",
        default=60.0,
        minimum=1.0,
        maximum=10000.0,
    )
    yield parameters.number(
        "LARGEST_BLOCK",
        "Largest block",
        "In blocks of a site that are larger than this growth begins anew, where there is room, "
        "once it has ended. 0 leaves them as they are. Without a site it has no effect.",
        unit="ha",
        default=1.5,
        minimum=0.0,
        maximum=10000.0,
    )


def limits() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield when growth stops."""
    first = "Growth stops at whichever limit comes first, or where nothing has room to grow."
    yield parameters.number(
        "MAX_LENGTH",
        "Length to stop at",
        f"Length of the new streets. {first} Empty: no limit.",
        unit="m",
        minimum=1.0,
        maximum=1e9,
        advanced=True,
    )
    yield parameters.number(
        "MAX_SEGMENTS",
        "Number of streets to stop at",
        "Number of new streets between junctions. Empty: no limit.",
        minimum=1,
        maximum=10_000_000,
        integer=True,
        advanced=True,
    )
    yield parameters.number(
        "POPULATION",
        "Population to stop at",
        "Number of people that the new streets stand for. Empty: no limit.",
        minimum=1.0,
        maximum=1e9,
        advanced=True,
    )
    yield parameters.number(
        "PEOPLE",
        "People per metre",
        "Number of people that a metre of new street stands for.",
        default=1.5415,
        minimum=0.0001,
        maximum=1000.0,
        advanced=True,
    )
    yield parameters.number(
        "ITERATIONS",
        "Iterations to stop at",
        "In each iteration every node that still grows does so once. This limit always holds, so "
        "that growth over open ground ends even without another.",
        default=100,
        minimum=1,
        maximum=100_000,
        integer=True,
        advanced=True,
    )


def details() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the grammar of one's own, edges, dead ends and distances."""
    file = QgsProcessingParameterFile(
        "GRAMMAR_FILE", "Grammar file", extension="json", defaultValue=None, optional=True
    )
    file.setHelp(
        "A grammar of your own, instead of the kind of streets: a file whose name ends in .json; "
        "the page on grammars tells how one is written. Optional."
    )
    file.setFlags(file.flags() | compat.ADVANCED)
    yield file
    for key, text, what in (
        ("EDGE", "Edge of the site", "the edge of the site, where no existing road runs along it"),
        ("OBSTACLE_EDGE", "Edge of obstacles", "the edge of obstacles and of holes in the site"),
    ):
        yield parameters.choice(
            key,
            text,
            f"What streets do at {what}. Without a site it has no effect.",
            EDGES,
            default="stop",
            advanced=True,
        )
    yield parameters.choice(
        "DEAD_ENDS",
        "Dead ends",
        "What becomes of new streets that end without meeting another.",
        DEAD_ENDS,
        default="keep",
        advanced=True,
    )
    yield from _distances()
    yield parameters.number(
        "DIRECTION",
        "Direction",
        "Where the first street leads from a start point beside the roads, or from the origin, "
        "clockwise from north. Start points may have a field direction of their own. Empty: along "
        "the site; without a site north.",
        unit="degrees",
        minimum=-360.0,
        maximum=360.0,
        advanced=True,
    )
    yield parameters.flag(
        "AS_PUBLISHED",
        "As CitySprout, for comparison",
        "Streets may touch and cross others without a junction there, as the published program "
        "leaves them. Not for designing.",
        default=False,
        advanced=True,
    )
    yield from _snapping()
    yield _crs()


def _distances() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how near streets come to each other."""
    yield parameters.number(
        "INTERSECT_RADIUS",
        "Nearness of junctions",
        "Streets that would end nearer than this to a junction lead to that junction instead. As "
        "a share of the scale.",
        default=0.8,
        # without any, nothing joins and the number of streets explodes
        minimum=0.1,
        maximum=100.0,
        advanced=True,
    )
    yield parameters.number(
        "CLEARANCE",
        "Nearness of streets",
        "Ends nearer than this to a street are joined to it. As a share of the nearness of "
        "junctions.",
        default=0.5,
        minimum=0.0,
        maximum=1.0,
        advanced=True,
    )
    yield parameters.number(
        "MIN_ANGLE",
        "Least angle between streets",
        "Streets that would meet another at a smaller angle are not built.",
        unit="degrees",
        default=30.0,
        minimum=0.0,
        maximum=89.0,
        advanced=True,
    )


def _snapping() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how roads and site are brought together; roads inside stay, unless told otherwise."""
    for definition in siteinputs.snapping(advanced=True):
        if definition.name() == "INNER_ROADS":
            definition = parameters.choice(
                "INNER_ROADS",
                str(definition.description()),
                "What becomes of roads that run through the site.",
                {
                    "keep": "they stay, and streets grow from them",
                    "ignore": siteinputs.INNER_ROADS["ignore"],
                },
                default="keep",
                advanced=True,
            )
        yield definition


def _crs() -> QgsProcessingParameterDefinition:
    definition = QgsProcessingParameterCrs(
        "CRS", "Coordinate reference system", "ProjectCrs", optional=True
    )
    definition.setHelp(
        "In metres. Asked only where neither a site nor roads nor start points are given; "
        "otherwise the layers have the system of the first of these that is. Empty: that of the "
        "project. Optional."
    )
    definition.setFlags(definition.flags() | compat.ADVANCED)
    return definition


def seed() -> QgsProcessingParameterDefinition:
    """Declare the seed."""
    return parameters.number(
        "SEED",
        "Seed",
        "Another number makes other streets by the same rules; the same number the same streets.",
        default=42,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
    )


def grammar_of(request: Request) -> Any:
    """Return the `Grammar` that is asked for.

    Raises
    ------
    InputError
        The file is missing or no grammar; the text names the rule and the field.
    """
    from ...algorithms.growth.grammars.file import read_grammar
    from ...algorithms.growth.grammars.shipped import shipped_grammar

    if not request.has("GRAMMAR_FILE"):
        return shipped_grammar(request.word("GRAMMAR"))
    name = request.tool.parameterAsFile(request.parameters, "GRAMMAR_FILE", request.context)
    return read_grammar(Path(str(name)))


def rules_of(request: Request) -> Any:
    """Return the `GrowthRules` that all parameters together ask for."""
    from ...algorithms.growth.rules import GrowthRules

    segments = request.integer("MAX_SEGMENTS") if request.has("MAX_SEGMENTS") else None
    return GrowthRules(
        grammar=grammar_of(request),
        scale=request.number("SCALE"),
        intersect_radius=request.number("INTERSECT_RADIUS"),
        iterations=request.integer("ITERATIONS"),
        max_segments=segments,
        max_length=request.optional_number("MAX_LENGTH"),
        population=request.optional_number("POPULATION"),
        people_per_metre=request.number("PEOPLE"),
        min_angle=request.number("MIN_ANGLE"),
        clearance=request.number("CLEARANCE"),
        as_published=request.flag("AS_PUBLISHED"),
        seed=request.integer("SEED"),
    )


def direction_of(request: Request) -> tuple[float, float]:
    """Return the unit vector (east, north) in which growth begins at the origin."""
    angle = math.radians(_NORTH - (request.optional_number("DIRECTION") or 0.0))
    return math.cos(angle), math.sin(angle)


def crs_of(request: Request) -> QgsCoordinateReferenceSystem:
    """Return the CRS of streets over open ground.

    Raises
    ------
    InputError
        None is given, or it is not in metres.
    """
    crs = request.tool.parameterAsCrs(request.parameters, "CRS", request.context)
    remedy = "Choose one in metres, such as that of a UTM zone, for 'Coordinate reference system'."
    if not crs.isValid():
        raise InputError("There is no coordinate reference system to grow streets in.", remedy)
    if crs.isGeographic() or crs.mapUnits() != compat.METRES:
        raise InputError(f"Streets cannot grow in {_named(crs)}, which is not in metres.", remedy)
    return crs


def _named(crs: QgsCoordinateReferenceSystem) -> str:
    return str(crs.userFriendlyIdentifier() or crs_text(crs))
