"""The parameters that say how streets should function: traffic, exits, budgets, the ground."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCsException,
    QgsProcessingParameterDefinition,
    QgsRectangle,
)

from ...algorithms.errors import InputError
from .. import bridge, parameters
from ..progress import FeedbackProgress
from ..request import Request
from .drawnstreets import single_shapes

TRAFFIC = {
    "out of the site": ("out", "every street leads out of the site"),
    "within the site": ("within", "also short ways between neighbouring parts of the site"),
    "through the site": ("through", "also routes without side streets from edge to edge"),
}
ONE_WAY = {
    "none": ("none", "all streets are two-way"),
    "local streets": ("local", "new local streets are one-way, collectors two-way"),
    "all new streets": ("all", "all new streets are one-way"),
}
#: Layers with a value per feature: layer, parameter of its field, field where none is chosen.
FIELDS = (("DENSITY", "DENSITY_FIELD", "coverage_m"), ("PRICES", "PRICE_FIELD", "price"))
#: Keys of the input layers.
LAYERS = ("PARTITION", "ROUTES", "DENSITY", "PRICES")


def traffic() -> QgsProcessingParameterDefinition:
    """Declare what the streets are for."""
    return parameters.choice(
        "TRAFFIC",
        "Traffic",
        "What the streets are for.",
        {word: meaning for word, (_, meaning) in TRAFFIC.items()},
        default="out of the site",
    )


def inputs() -> Iterator[QgsProcessingParameterDefinition]:
    """Declare all that goes beyond block size, exits and rules."""
    yield from _levels()
    yield from _links()
    yield from _limits()
    yield from _ground()


def _levels() -> Iterator[QgsProcessingParameterDefinition]:
    yield parameters.layer(
        "GIVEN",
        "Given streets",
        "Streets that are decided: major roads, or parts of an earlier design that are to stay "
        "(select them, and tick 'Selected features only'). They divide the site, and what lies "
        "between them is designed. The field level tells the level (1 major, 2 collector, 3 "
        "local, 4 cul-de-sac); without it they are major roads.",
        "line",
        optional=True,
        advanced=True,
    )
    yield parameters.flag(
        "CUL_DE_SACS",
        "Culs-de-sac where blocks are too deep",
        "Adds short streets that end blind, after the local streets, where ground lies too far "
        "from any street.",
        default=False,
        advanced=True,
    )


def _links() -> Iterator[QgsProcessingParameterDefinition]:
    yield parameters.layer(
        "PARTITION",
        "Parts of the site",
        "Polygons that together cover the site, for traffic within it: neighbouring ones get a "
        "short way from one to the other. Empty: the tool makes parts of the size below.",
        "polygon",
        optional=True,
        advanced=True,
    )
    yield parameters.number(
        "PATCH_SIZE",
        "Size of the parts",
        "Side of the parts between which ways are short, for traffic within the site.",
        unit="m",
        minimum=20.0,
        maximum=10_000.0,
        advanced=True,
        unset="three block lengths",
    )
    yield parameters.layer(
        "ROUTES",
        "Through routes",
        "Lines from one way into the site to another, for traffic through it: the route runs "
        "between their ends as the mesh allows. Empty: between the two streets that arrive "
        "farthest apart.",
        "line",
        optional=True,
        advanced=True,
    )
    yield parameters.number(
        "DETOUR",
        "Detour",
        "By how much a way between parts, or a through route, may be longer than the shortest "
        "possible one.",
        unit="mesh edges",
        default=2.0,
        minimum=0.0,
        maximum=100.0,
        advanced=True,
    )


def _limits() -> Iterator[QgsProcessingParameterDefinition]:
    yield parameters.number(
        "EXITS",
        "Number of exits",
        "Greatest number of places where new streets meet existing streets or leave the site; "
        "the tool finds out which. Where given streets divide the site it holds for each part, "
        "and given streets count as existing. Empty: any number.",
        minimum=1,
        maximum=1000,
        integer=True,
        advanced=True,
    )
    yield parameters.number(
        "LENGTH_BUDGET",
        "Length budget",
        "Greatest length of all new streets of a site; parts between given streets share it. "
        "Empty: any length.",
        unit="m",
        minimum=1.0,
        advanced=True,
    )
    yield parameters.number(
        "MAX_DISTANCE",
        "Longest way out",
        "No junction is farther than this from an exit or a given street, along streets. Empty: "
        "any distance.",
        unit="m",
        minimum=1.0,
        advanced=True,
    )
    yield parameters.number(
        "JUNCTION_SPACING",
        "Junction spacing",
        "No two junctions are nearer than this, along a street. Empty: any spacing.",
        unit="m",
        minimum=1.0,
        advanced=True,
    )
    yield parameters.choice(
        "ONE_WAY",
        "One-way streets",
        "Which new streets are one-way. Every place can then still be reached and left, for "
        "which there are at least two ways to it.",
        {word: meaning for word, (_, meaning) in ONE_WAY.items()},
        default="none",
        advanced=True,
    )


def _ground() -> Iterator[QgsProcessingParameterDefinition]:
    yield parameters.layer(
        "DENSITY",
        "Density by area",
        "Polygons with a coverage range of their own, in metres: small where streets are to be "
        "dense, large where few will do.",
        "polygon",
        optional=True,
        advanced=True,
    )
    yield parameters.field(
        "DENSITY_FIELD",
        "Field with the coverage range (m)",
        f"A number field of 'Density by area'. Empty: {FIELDS[0][2]}.",
        "DENSITY",
    )
    yield parameters.layer(
        "PRICES",
        "Price of the ground",
        "Polygons or lines with a factor on the cost of streets: 0.5 on an existing right of "
        "way, 3 where building is dear.",
        ("polygon", "line"),
        optional=True,
        advanced=True,
    )
    yield parameters.field(
        "PRICE_FIELD",
        "Field with the price factor",
        f"A number field of 'Price of the ground'. Empty: {FIELDS[1][2]}.",
        "PRICES",
    )
    yield parameters.raster(
        "ELEVATION",
        "Elevation",
        "A raster of heights in metres: streets up steep ground are dearer.",
    )
    yield parameters.number(
        "SLOPE_WEIGHT",
        "Weight of slopes",
        "A street with a grade of 6 % costs this much more of its length; the price grows with "
        "the square of the grade.",
        default=1.0,
        minimum=0.0,
        maximum=1000.0,
        advanced=True,
    )


def specification(request: Request) -> dict[str, Any]:
    """Return the fields of the `Specification` that these parameters give."""
    fields: dict[str, Any] = {
        "traffic": TRAFFIC[request.word("TRAFFIC")][0],
        "one_way": ONE_WAY[request.word("ONE_WAY")][0],
        "detour": request.number("DETOUR"),
        "slope_weight": request.number("SLOPE_WEIGHT"),
        "exits": request.integer("EXITS") if request.has("EXITS") else None,
        "cul_de_sacs": request.flag("CUL_DE_SACS"),
    }
    for key in ("PATCH_SIZE", "LENGTH_BUDGET", "MAX_DISTANCE", "JUNCTION_SPACING"):
        fields[key.lower()] = request.optional_number(key)
    return fields


def check(request: Request) -> None:
    """Check before any long work that layers have the fields that are read.

    Raises
    ------
    InputError
        A field is missing; the text names the layer.
    """
    request.raster("ELEVATION")
    for key, field_key, usual in FIELDS:
        source = request.source(key)
        name = request.field(field_key, usual)
        if source is not None and source.featureCount() and source.fields().indexOf(name) < 0:
            title = parameters.title(request.tool.parameterDefinition(field_key))
            raise InputError(
                f"It has no field '{name}'.",
                f"Choose the field in '{title}'.",
                layer=request.name(key),
            )


def preferences(request: Request, progress: FeedbackProgress) -> Callable[[Any], Any]:
    """Return a function that gives the `Preferences` of a site in its working CRS.

    Raises
    ------
    InputError
        A layer lacks the field with its values, or a value is missing or out of range.
    """
    from ...algorithms.streets import Preferences, Zone

    frames = {key: request.frame(key, progress) for key in LAYERS}
    fields = {
        key: _values(request, key, request.field(field_key, usual), frames[key])
        for key, field_key, usual in FIELDS
    }
    raster = request.raster("ELEVATION")

    def zones(key: str, crs: Any) -> list[Any]:
        values = fields[key]
        return [
            Zone(shape, values[i], i) for i, shape in single_shapes(frames[key], crs) if i in values
        ]

    def of_site(site: Any) -> Any:
        return Preferences(
            density=zones("DENSITY", site.crs),
            prices=zones("PRICES", site.crs),
            elevation=None if raster is None else _heights(raster, request, site),
            partition=[(shape, i) for i, shape in single_shapes(frames["PARTITION"], site.crs)],
            routes=[(line, i) for i, line in single_shapes(frames["ROUTES"], site.crs)],
            density_layer=request.name("DENSITY"),
            price_layer=request.name("PRICES"),
            partition_layer=request.name("PARTITION"),
            route_layer=request.name("ROUTES"),
        )

    return of_site


def remarks(request: Request, specification: Any, progress: FeedbackProgress) -> None:
    """Say what is asked and has no effect together with the rest that is asked."""
    used = {"PARTITION": "within", "PATCH_SIZE": "within", "ROUTES": "through"}
    words = {value: word for word, (value, _) in TRAFFIC.items()}
    for key, traffic in used.items():
        if request.has(key) and specification.traffic != traffic:
            title = parameters.title(request.tool.parameterDefinition(key))
            progress.warn(f"'{title}' counts only where Traffic is '{words[traffic]}': left out.")
    drawn = specification.cul_de_sacs and specification.rules == "planner"
    if drawn and (specification.length_budget or specification.junction_spacing):
        progress.warn(
            "No culs-de-sac are added: with a length budget or a junction spacing there are only "
            "streets that the program counts. Leave these empty, or take the rules of the paper."
        )


def _values(request: Request, key: str, name: str, frame: Any) -> dict[int, float]:
    """Return the value of every feature that has one."""
    found = {}
    for i, value in frame[name].items() if frame is not None else ():
        if value is None or value != value:
            continue
        try:
            found[int(i)] = float(value)
        except (TypeError, ValueError):
            raise InputError(
                f"'{value}' in the field '{name}' is no number.",
                "Choose a field of numbers.",
                layer=request.name(key),
                feature=int(i),
            ) from None
    return found


def _heights(raster: Any, request: Request, site: Any) -> Any:
    """Return the heights at a site as a function of positions in its working CRS."""
    from ...algorithms.streets import no_heights

    crs = QgsCoordinateReferenceSystem.fromWkt(site.crs.to_wkt())
    turn = QgsCoordinateTransform(crs, raster.crs(), request.context.transformContext())
    try:
        around = turn.transformBoundingBox(QgsRectangle(*site.polygon.bounds))
    except QgsCsException:  # the CRS of the raster does not reach there
        return no_heights
    grid = bridge.read_raster(raster, around)
    return no_heights if grid is None else grid.seen_from(site.crs)
