"""The same site designed in many ways, side by side."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

from qgis.core import (
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFile,
    QgsProcessingParameterString,
)

from ...algorithms.errors import CancelledError, InputError
from .. import compat, deps, executors, files, parameters, presets
from ..explore_fields import DESIGNS, EXPLORED_PROBLEMS, EXPLORED_STREETS
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import functions, rules, siteinputs
from .collect import joined
from .designstreets import specification_of, wishes_of
from .validatenetwork import describe

#: Layers that name places on top of the site.
PLACES = ("SINKS", "REQUIRED", "FORBIDDEN", "START", "GIVEN")
#: Field of the given exits that says to which set they belong.
SET = "set"
NONE = "none"
#: What can be varied: field of the specification, and what its values are.
AXES = {
    "weight of street length": ("weight_length", "numbers of 0 or more"),
    "weight of the way out": ("weight_distance", "numbers of 0 or more"),
    "weight of straight streets": ("weight_straight", "numbers of 0 or more"),
    "block width": ("block_width", "metres"),
    "block length": ("block_length", "metres"),
    "coverage range": ("coverage", "in the unit chosen below"),
    "dead ends": ("dead_ends", "forbid, discourage, allow, or a price"),
    "zigzags": ("zigzags", "likewise"),
    "T-junctions": ("t_junctions", "likewise"),
    "branches": ("branches", "likewise"),
    "number of exits": ("exits", "whole numbers"),
    "longest way out": ("max_distance", "metres"),
    "length budget": ("length_budget", "metres"),
    "junction spacing": ("junction_spacing", "metres"),
    "where streets leave": ("sink_mode", "streets, boundary, access or points"),
    "traffic": ("traffic", "out, within or through"),
    "rules": ("rules", "planner or paper"),
    "street levels": ("levels", "1 or 2"),
    "seed": ("seed", "whole numbers"),
}
_ENDINGS = {"PLOT": ("svg", "png", "html"), "PICTURE": ("png", "svg")}


class ExploreTradeoffs(Tool):
    """Designs streets in many ways and compares them."""

    about = About(
        name="exploretradeoffs",
        title="Explore trade-offs",
        group="streets",
        tags=(
            "street network", "trade-off", "tradeoff", "pareto", "scenarios", "variants",
            "comparison", "sensitivity", "parameters", "optimisation", "site planning",
            "platwright",
        ),
        summary="Designs the streets of a site in many ways, for instance for several weights of "
        "length against distance, and compares them in a table, a plot and a picture.",
        paragraphs=(
            "Choose one or two parameters and values of each: every combination is designed, as "
            "Design streets would. Or give a list of runs in a file, with a column for each "
            "parameter; what a run does not name is as the other inputs say.",
            "All designs are in one layer; the field design tells them apart, and the layer shows "
            "one at a time. The table compares them. A design stands out (pareto) where no other "
            "is as good in both the length of streets and the mean way out, and better in one.",
            "The plot shows length against mean way out. The picture shows all plans at one scale, "
            "with the length L and the mean way out d of each.",
            "Designs are made at the same time by several processes. Each ends by its work, not by "
            "the clock, so that the result is the same however many work, unless the time limit "
            "is reached first. Cancel keeps the designs that are ready.",
            "Prices can be compared only between designs of which the same was asked. With the "
            "planner rules blocks have the wished size and weights change little; choose the rules "
            "as in the paper to see length against distance clearly.",
        ),
        picture="Two designs of one site, with one number changed: small blocks, and large ones.",
        references=("CND",),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": EXPLORED_STREETS,
        "DESIGNS": DESIGNS,
        "PROBLEMS": EXPLORED_PROBLEMS,
    }
    files: ClassVar = {
        "PLOT": files.FileKind(
            "Plot", "svg",
            "Length against mean way out of all designs, as svg or png; as html with the table and "
            "the plans, on one page that needs no network.",
            binary=True, others=("png", "html"),
        ),
        "PICTURE": files.FileKind(
            "Picture of all plans", "png", "All plans side by side at one scale, as png or svg.",
            binary=True, others=("svg",),
        ),
    }  # fmt: skip
    numbers: ClassVar = {
        "REQUESTED": "Number of designs asked for",
        "ACHIEVED": "Number of designs made",
        "FRONT": "Designs that no other is better than in every way",
        "SHORTEST": "Least length of new streets (m)",
        "NEAREST": "Least mean way out of the site (m)",
    }
    needs = (*deps.LAYERS, *deps.SOLVERS)

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the eight basic parameters, then those of Design streets."""
        yield siteinputs.site()
        yield siteinputs.roads()
        yield from _axis("X", "weight of street length", "1; 5")
        yield from _axis("Y", "weight of the way out", "0; 0.2; 1")
        yield rules.sink_mode()
        file = QgsProcessingParameterFile(
            "SPECIFICATIONS",
            "List of runs",
            defaultValue=None,
            optional=True,
            fileFilter="List of runs (*.csv *.json)",
        )
        file.setHelp(
            "A CSV file whose head line names parameters as specifications do (weight_distance, "
            "dead_ends, traffic...), with a line for each run; or a JSON list of objects. The "
            "column name names runs; the column sinks chooses the given exits whose field set has "
            "that text. It replaces the values above. Optional."
        )
        yield file
        yield from (_advanced(own) for own in _designing())

    def check(self, request: Request) -> None:
        """Check every specification, and that pictures can be drawn, before the run."""
        from ...algorithms.explore.drawing import figures

        functions.check(request)
        runs = runs_of(request)
        for key, endings in _ENDINGS.items():
            path = files.place(request, key)
            if path is not None and path.suffix.lower().lstrip(".") not in endings:
                raise InputError(
                    f"{self.files[key].title}: {path.name} has another ending.",
                    f"Let its name end in {', '.join(endings)}.",
                )
            if path is not None:
                figures()
        for run in runs:
            if run.specification.sink_mode == "points" and not request.has("SINKS"):
                raise InputError(
                    f"Design {run.number}: streets are to leave the site at given points, but no "
                    "layer of points is given.",
                    "Choose a layer for 'Given exits', or another place where streets may leave.",
                )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Prepare the sites, design each run, compare and draw."""
        from ...algorithms.explore import explore

        runs = runs_of(request)
        prepared = siteinputs.prepared_sites(request, progress.part(0.0, 0.04))
        reading = progress.part(0.04, 0.05)
        given = {key: request.frame(key, reading) for key in PLACES}
        wished = functions.preferences(request, reading)
        progress.info(f"{len(runs)} designs are made.")
        found = explore(
            prepared,
            runs,
            wishes=lambda site, run: wishes_of(request, _of_run(given, run), wished)(site),
            given=lambda run: _of_run(given, run),
            executor=executors.executor(request, reading),
            progress=progress.part(0.05, 0.95),
        )
        _tell(found, progress)
        lengths = [one.figures["length_m"] for one in found.done]
        distances = [one.figures["mean_distance_m"] for one in found.done]
        progress.stage("Drawing", 0.96)
        return Result(
            crs=request.crs("INPUT"),
            layers={
                "STREETS": found.layer("streets"),
                "DESIGNS": _table(found),
                "PROBLEMS": _problems(found),
            },
            numbers={
                "REQUESTED": len(runs),
                "ACHIEVED": len(found.done),
                "FRONT": sum(one.pareto for one in found.done),
                "SHORTEST": min(lengths),
                "NEAREST": min(distances),
            },
            specification=to_json(_asked(request)),
            keep=True,
            files=_drawn(request, found),
        )


def _problems(found: Any) -> Any:
    """Return what is wrong with the site, and with each design."""
    broken = found.layer("violations")
    return joined(
        found.prepared.problems,
        found.layer("problems"),
        describe(broken, "Streets") if len(broken) else broken,
    )


def _axis(letter: str, usual: str, values: str) -> Iterator[QgsProcessingParameterDefinition]:
    """Declare a parameter and its values."""
    order = "First" if letter == "X" else "Second"
    none = {} if letter == "X" else {NONE: "only the first parameter is varied"}
    yield parameters.choice(
        f"PARAMETER_{letter}",
        f"{order} parameter",
        "What differs between the designs; each says what its values may be.",
        {**{word: text for word, (_, text) in AXES.items()}, **none},
        default=usual,
    )
    definition = QgsProcessingParameterString(
        f"VALUES_{letter}", f"Values of the {order.lower()} parameter", values, False, True
    )
    definition.setHelp(f"Values with semicolons between them. Default: {values}. Optional.")
    yield definition


def _designing() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what Design streets takes, the time, and who does the work."""
    yield presets.parameter()
    for key, text in (("BLOCK_WIDTH", "Block width"), ("BLOCK_LENGTH", "Block length")):
        yield parameters.number(
            key,
            text,
            "As of Design streets. Empty: as the kind of neighbourhood says.",
            unit="m",
            minimum=10.0,
            maximum=5000.0,
            unset="by kind",
        )
    yield siteinputs.obstacles()
    yield functions.traffic()
    yield rules.sinks()
    yield siteinputs.access_points()
    yield parameters.layer(
        "REQUIRED", "Required streets", "Lines along which a street must run.", "line",
        optional=True,
    )  # fmt: skip
    yield parameters.layer(
        "FORBIDDEN", "Forbidden places", "Lines or polygons that no street may cross or follow.",
        ("line", "polygon"), optional=True,
    )  # fmt: skip
    yield parameters.layer(
        "START", "Earlier design",
        "Streets of an earlier design of this site: each search begins with them.",
        "line", optional=True,
    )  # fmt: skip
    yield from siteinputs.snapping(advanced=True)
    yield parameters.number(
        "EDGE_LENGTH", "Edge length of the candidate mesh", "Empty: as the block width implies.",
        unit="m", minimum=1.0,
    )  # fmt: skip
    yield from functions.inputs()
    yield from rules.rule_set()
    yield from rules.weights()
    yield parameters.number(
        "TIME_LIMIT",
        "Time limit of each design",
        "Where it ends a search before its work is done, another run may give another design; the "
        "table tells.",
        unit="s",
        default=60.0,
        minimum=1.0,
        maximum=86400.0,
    )
    yield parameters.number(
        "EFFORT",
        "Work on each design",
        "Steps of the search for every 100 candidate streets; more takes longer and may give "
        "better designs.",
        default=20.0,
        minimum=1.0,
        maximum=10000.0,
    )
    yield from rules.search()
    yield from executors.inputs()


def _advanced(definition: QgsProcessingParameterDefinition) -> QgsProcessingParameterDefinition:
    definition.setFlags(definition.flags() | compat.ADVANCED)
    return definition


def runs_of(request: Request) -> list[Any]:
    """Return the runs that are asked for.

    Raises
    ------
    InputError
        Values are missing, wrong, or contradict each other.
    """
    import dataclasses

    from ...algorithms.explore import grid, listed, read_rows
    from ...algorithms.explore import runs_of as runs_of_rows

    base = dataclasses.replace(specification_of(request), effort=request.number("EFFORT"))
    if request.has("SPECIFICATIONS"):
        return list(runs_of_rows(base, read_rows(Path(request.field("SPECIFICATIONS")))))
    axes: dict[str, list[Any]] = {}
    for letter in "XY":
        word = request.word(f"PARAMETER_{letter}")
        if word == NONE:
            continue
        key = AXES[word][0]
        if key in axes:
            raise InputError(
                f"Both parameters are '{word}'.", f"Choose '{NONE}' or another for the second."
            )
        axes[key] = listed(key, request.field(f"VALUES_{letter}"))
    return list(grid(base, axes))


def _asked(request: Request) -> dict[str, Any]:
    """Return what is asked of all designs, and what differs between them, for the record."""
    if request.has("SPECIFICATIONS"):
        varied = {"list_of_runs": Path(request.field("SPECIFICATIONS")).name}
    else:
        words = {letter: request.word(f"PARAMETER_{letter}") for letter in "XY"}
        varied = {
            word: request.field(f"VALUES_{letter}")
            for letter, word in words.items()
            if word != NONE
        }
    common = json.loads(specification_of(request).to_json())
    return {**common, "effort": request.number("EFFORT"), "varied": varied}


def _of_run(given: Mapping[str, Any], run: Any) -> dict[str, Any]:
    """Return the given places with the exits of a run only."""
    sinks = given["SINKS"]
    if not run.sinks:
        return dict(given)
    if sinks is None or SET not in sinks.columns:
        raise InputError(
            f"Design {run.number} asks for the exits '{run.sinks}', but no layer of given exits "
            f"has a field '{SET}'.",
            f"Choose a layer for 'Given exits' with a text field '{SET}'.",
        )
    own = sinks[sinks[SET].astype(str) == run.sinks]
    if not len(own):
        names = ", ".join(sorted({str(name) for name in sinks[SET].dropna()}))
        raise InputError(
            f"Design {run.number}: no given exit has '{run.sinks}' in its field '{SET}'.",
            f"There are: {names}.",
        )
    return {**given, "SINKS": own}


def _tell(found: Any, progress: FeedbackProgress) -> None:
    """Say what failed; raise an error where all did."""
    failed = [one for one in found.designs if one.state == "failed"]
    for one in failed:
        progress.warn(f"Design {one.run.number} ({one.run.name}): {one.reason}")
    if found.done:
        left = len(found.designs) - len(found.done) - len(failed)
        if left:
            progress.warn(f"Cancelled: {left} designs were not made; the others are kept.")
        return
    if not failed:
        raise CancelledError
    raise InputError(f"None of the designs could be made. The first: {failed[0].reason}")


def _table(found: Any) -> Any:
    """Return the comparison with the columns of the layer."""
    from ...algorithms.explore import table_of_axes

    return table_of_axes(found)


def _drawn(request: Request, found: Any) -> dict[str, bytes]:
    """Return the files that were asked for."""
    from ...algorithms.explore import page, picture, plot

    made = {}
    for key, draw in (("PLOT", plot), ("PICTURE", picture)):
        path = files.place(request, key)
        if path is None:
            continue
        ending = path.suffix.lower().lstrip(".")
        made[key] = page(found).encode() if ending == "html" else draw(found, ending)
    return made
