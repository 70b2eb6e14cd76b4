"""An independent check of any street layer against a site and rules."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import deps, fields, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import rules, siteinputs

#: What to do about each kind of problem.
_ADVICE = {
    "no geometry": "Draw the street, or delete the feature.",
    "crossing": "Split both streets where they cross, or mark one as a bridge in another layer.",
    "overlap": "Delete one of the two streets.",
    "lollipop": "Join the ring to another street, or take it away.",
    "island": "Join this part to a street that leads out of the site.",
    "dead end": "Join the end to another street, or give the street level 4 (cul-de-sac).",
    "coverage": "Bring a street nearer, or give a longer coverage range.",
    "obstacle": "Move the street off the obstacle.",
    "outside": "Move the street into the site, or give it the status connector.",
    "required": "Draw a street along the required line.",
    "forbidden": "Move the street off the forbidden line.",
    "one-way": "Turn a one-way street round, or let traffic run both ways.",
    "exits": "Take streets away that lead to existing ones, or allow more exits.",
    "length budget": "Take streets away, or give a larger budget.",
    "way out": "Join the place to a nearer exit, or allow a longer way.",
    "junction spacing": "Move one of the two streets, or allow a smaller spacing.",
    "distance": "The streets were edited or smoothed after the distances were written: delete "
    "the field, or design again.",
}
#: Field with the coverage range of an area, where none is chosen.
_RANGE = "coverage_m"
#: Keys of the input layers.
_LAYERS = (
    "INPUT",
    "SITE",
    "BOUNDARY_STREETS",
    "OBSTACLES",
    "SINKS",
    "REQUIRED",
    "FORBIDDEN",
    "DENSITY",
)
_LOOK = "Look at the place, and edit the street or the rule."


class ValidateNetwork(Tool):
    """Lists every place where a street layer breaks a rule."""

    about = About(
        name="validatenetwork",
        title="Validate street network",
        group="measure",
        tags=("check", "streets", "topology", "islands", "dead ends", "coverage", "platwright"),
        summary="Checks any street layer against a site and rules, and lists every problem.",
        paragraphs=(
            "The streets may come from Design streets, be drawn by hand or be surveyed. Always "
            "checked: parts from which no way leads out of the site, crossings without a "
            "junction, streets on obstacles or outside the site, required and forbidden lines, "
            "the distances in the field dist_to_sink_m, which are computed afresh, and, where the "
            "field oneway marks one-way streets, that every junction can be reached and left.",
            "Limits of exits and lengths are checked where they are given. Courses are drawn "
            "straighter than they were counted, so lengths may miss a limit by 3 %.",
            "The check shares nothing with the search of Design streets.",
        ),
        picture="A design that was spoilt by hand, and what the check finds: a street that joins "
        "no other.",
        references=("CND",),
    )
    layers: ClassVar = {"PROBLEMS": fields.NETWORK_PROBLEMS}
    numbers: ClassVar = {
        "VIOLATIONS": "Broken rules",
        "WARNINGS": "Warnings",
        "TOTAL_LENGTH": "Length of the designed streets (m)",
        "MEAN_DISTANCE": "Mean way out of the site (m)",
        "MAX_DISTANCE": "Longest way out of the site (m)",
        "UNCOVERED_AREA": "Ground beyond the coverage range (m2; empty without a range)",
    }
    needs = (*deps.LAYERS, "networkx")

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the streets, the site and the rules."""
        yield parameters.layer(
            "INPUT",
            "Streets",
            "Lines that meet at their ends. The fields status (existing, connector or new), "
            "level, dist_to_sink_m and oneway are read where they are there; existing streets are "
            "exempt from the rules, two-way, and traffic leaves by them.",
            "line",
        )
        yield parameters.layer(
            "SITE",
            "Site",
            "Polygons in which the streets lie; needed for the coverage and for streets outside.",
            "polygon",
            optional=True,
        )
        yield parameters.layer(
            "BOUNDARY_STREETS",
            "Boundary streets",
            "Existing streets along the edge of the site, where they are not in the streets.",
            "line",
            optional=True,
        )
        yield siteinputs.obstacles()
        yield parameters.layer(
            "SINKS",
            "Exits",
            "Points where traffic leaves: points of your own, or the junctions of Design streets "
            "with those selected for which is_sink is true, and 'Selected features only' ticked. "
            "Empty: at the existing streets or, where there are none, anywhere on the edge of the "
            "site.",
            "point",
            optional=True,
        )
        yield parameters.number(
            "COVERAGE",
            "Coverage range",
            "No ground of the site may be farther than this from a street. Empty: not checked.",
            unit="m",
            minimum=0.0,
        )
        yield parameters.number(
            "EDGE_LENGTH",
            "Scale of the rules",
            "Edge length of the mesh that the streets were designed on, or the block width: the "
            "distance within which turns make a zigzag and streets are too close.",
            unit="m",
            default=72.0,
            minimum=1.0,
        )
        yield from _wishes()
        yield from _limits()
        yield from rules.checked_rules()

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read all layers, check, and list the problems."""
        from ...algorithms.measure import validate_network

        frames = {
            key: request.frame(key, progress.part(0.08 * at, 0.08 * (at + 1)))
            for at, key in enumerate(_LAYERS)
        }
        limits = _limits_given(request)
        weights = rules.rule_weights(request)
        progress.stage("Checking the streets", 0.7)
        report = validate_network(
            frames["INPUT"],
            site=frames["SITE"],
            sinks=frames["SINKS"],
            obstacles=frames["OBSTACLES"],
            boundary_streets=frames["BOUNDARY_STREETS"],
            required=frames["REQUIRED"],
            forbidden=frames["FORBIDDEN"],
            coverage_m=request.optional_number("COVERAGE"),
            coverage_areas=_areas(request, frames["DENSITY"]),
            **limits,
            edge_length=request.number("EDGE_LENGTH"),
            street_layer=request.name("INPUT"),
            **weights,
        )
        found = describe(report.problems, request.name("INPUT"))
        numbers = {key: report.numbers.get(key, 0.0) for key in self.numbers}
        if not request.has("COVERAGE") and frames["DENSITY"] is None:
            numbers["UNCOVERED_AREA"] = math.nan
        return Result(
            crs=request.crs("INPUT"),
            layers={"PROBLEMS": found},
            numbers={
                **numbers,
                "WARNINGS": int((found["severity"] == "warning").sum()),
            },
            specification=to_json(
                {
                    "coverage": request.optional_number("COVERAGE"),
                    "edge_length": request.number("EDGE_LENGTH"),
                    **limits,
                    **{key: "forbid" if value > 1e9 else value for key, value in weights.items()},
                }
            ),
        )


def _wishes() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the lines where streets must and must not be."""
    yield parameters.layer(
        "REQUIRED",
        "Required streets",
        "Lines along which there must be a street.",
        "line",
        optional=True,
        advanced=True,
    )
    yield parameters.layer(
        "FORBIDDEN",
        "Forbidden places",
        "Lines that no street may meet.",
        "line",
        optional=True,
        advanced=True,
    )


def _limits() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what the network is asked as a whole."""
    yield parameters.number(
        "EXITS",
        "Number of exits",
        "Greatest number of places where the streets of a site meet existing ones or an edge by "
        "which traffic leaves. Empty: not checked.",
        minimum=1,
        integer=True,
        advanced=True,
    )
    for key, text, help_text in (
        ("LENGTH_BUDGET", "Length budget", "Greatest length of all new streets of a site."),
        (
            "MAX_DISTANCE",
            "Longest way out",
            "No end of a new street is farther than this from an exit, along streets and with the "
            "traffic of one-way streets.",
        ),
        (
            "JUNCTION_SPACING",
            "Junction spacing",
            "No two junctions of three or more streets are nearer than this, along streets.",
        ),
    ):
        yield parameters.number(
            key, text, f"{help_text} Empty: not checked.", unit="m", minimum=0.01, advanced=True
        )
    yield parameters.layer(
        "DENSITY",
        "Density by area",
        "Polygons with a coverage range of their own, in metres; elsewhere the coverage range "
        "above holds.",
        "polygon",
        optional=True,
        advanced=True,
    )
    yield parameters.field(
        "DENSITY_FIELD",
        "Field with the coverage range (m)",
        f"A number field of 'Density by area'. Empty: {_RANGE}.",
        "DENSITY",
    )


def _limits_given(request: Request) -> dict[str, Any]:
    """Return the limits as the checker names them; None where the planner left them empty."""
    return {
        "exits_most": request.integer("EXITS") if request.has("EXITS") else None,
        "length_budget_m": request.optional_number("LENGTH_BUDGET"),
        "max_distance_m": request.optional_number("MAX_DISTANCE"),
        "junction_spacing_m": request.optional_number("JUNCTION_SPACING"),
    }


def _areas(request: Request, frame: Any) -> Any:
    """Return the areas with their range in the field that the checker reads.

    Raises
    ------
    InputError
        The field is missing.
    """
    from ...algorithms.errors import InputError

    if frame is None:
        return None
    name = request.field("DENSITY_FIELD", _RANGE)
    if name not in frame.columns:
        raise InputError(
            f"It has no field '{name}'.",
            "Choose the field in 'Field with the coverage range (m)'.",
            layer=request.name("DENSITY"),
        )
    return frame.assign(**{_RANGE: frame[name]})


def describe(problems: Any, layer: str) -> Any:
    """Return the problems of a validation with the fields of a problems layer."""
    return problems.assign(
        layer=layer,
        problem=problems["text"],
        action=[_ADVICE.get(kind, _LOOK) for kind in problems["kind"]],
    )
