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
    "distance": "The streets were edited after the distances were written: design again.",
}
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
            "and the distances in the field dist_to_sink_m, which are computed afresh.",
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
            "level and dist_to_sink_m are read where they are there; existing streets are exempt "
            "from the rules, and traffic leaves by them.",
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
        yield from rules.checked_rules()

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read all layers, check, and list the problems."""
        from ...algorithms.measure import validate_network

        keys = ("INPUT", "SITE", "BOUNDARY_STREETS", "OBSTACLES", "SINKS", "REQUIRED", "FORBIDDEN")
        frames = {
            key: request.frame(key, progress.part(0.1 * at, 0.1 * (at + 1)))
            for at, key in enumerate(keys)
        }
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
            edge_length=request.number("EDGE_LENGTH"),
            street_layer=request.name("INPUT"),
            **weights,
        )
        found = describe(report.problems, request.name("INPUT"))
        numbers = {key: report.numbers.get(key, 0.0) for key in self.numbers}
        if not request.has("COVERAGE"):
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


def describe(problems: Any, layer: str) -> Any:
    """Return the problems of a validation with the fields of a problems layer."""
    return problems.assign(
        layer=layer,
        problem=problems["text"],
        action=[_ADVICE.get(kind, _LOOK) for kind in problems["kind"]],
    )
