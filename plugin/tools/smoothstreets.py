"""Gentler streets and squarer junctions for any street layer."""

from __future__ import annotations

import dataclasses
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
from . import siteinputs

SHAPES = {
    "curved": "bends become gentle curves",
    "straight": "streets become straight, with few bends",
}
#: Under this nothing has moved, as far as a planner is concerned (metres).
STILL = 0.05


class SmoothStreets(Tool):
    """Smooths the streets of a layer and squares its junctions, without changing its network."""

    about = About(
        name="smoothstreets",
        title="Smooth streets",
        group="streets",
        tags=(
            "smooth", "straighten", "streets", "snakes", "curves", "fillet", "junctions", "angles",
            "generalise", "platwright",
        ),
        summary="Straightens and curves the streets of any layer and draws their junctions towards "
        "right angles, while the network stays what it is.",
        paragraphs=(
            "Where a street runs through a junction it becomes straight there, and the street that "
            "ends at it square to it. What was connected stays connected: every drawing is "
            "checked, and where streets would cross, come nearer than 6 m to an obstacle, leave "
            "the site or change places at a junction, they are held back as far as needed. The "
            "features that were held back are in the layer of problems.",
            "Dead ends keep their place, and so do existing streets (the field status says "
            "existing or given), roundabouts, and streets that lie on each other. Ends within "
            "0.5 m of each other, or of a street, are joined; lines that cross without a shared "
            "vertex are taken as bridges and stay crossed.",
            "All features and fields of the input are kept, and length_m, where it is there and "
            "true, tells the new length. Other lengths and distances, such as dist_to_sink_m, stay "
            "what they were: Validate street network computes them afresh.",
        ),
        picture="A design by the rules of the paper, crooked as it comes from the mesh; the same "
        "streets smoothed.",
        references=("CND", "SNAKES"),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": fields.SMOOTHED_STREETS,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "ANGLE_BEFORE": "Mean deviation of junction corners from 90 degrees before (degrees)",
        "ANGLE_AFTER": "Mean deviation of junction corners from 90 degrees after (degrees)",
        "ANGLE_P90_BEFORE": "The same, exceeded by a tenth of the corners, before (degrees)",
        "ANGLE_P90_AFTER": "The same, exceeded by a tenth of the corners, after (degrees)",
        "BENDS_BEFORE": "Bends of more than 20 degrees between junctions before",
        "BENDS_AFTER": "Bends of more than 20 degrees between junctions after",
        "SHORTEST_BEFORE": "Shortest street between two junctions before (m)",
        "SHORTEST_AFTER": "Shortest street between two junctions after (m)",
        "LENGTH_BEFORE": "Length of the streets before (m)",
        "LENGTH_AFTER": "Length of the streets after (m)",
        "LARGEST_MOVE": "Largest move of a street (m)",
        "HELD_BACK": "Number of features that were held back",
    }
    # The room of the library that it is in solves integer programs, too.
    needs = (*deps.LAYERS, *deps.SOLVERS)

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the streets, what is around them, and how they are to be smoothed."""
        yield parameters.layer(
            "INPUT",
            "Streets",
            "Lines of streets, designed, drawn or surveyed, that meet at their ends or at shared "
            "vertices. Streets with existing or given in the field status keep their course.",
            "line",
        )
        yield parameters.layer(
            "SITE",
            "Site",
            "Polygons that streets must not leave. Streets outside them, and along their edge, "
            "keep their course; ends at the edge slide along it.",
            "polygon",
            optional=True,
        )
        yield siteinputs.obstacles()
        yield parameters.layer(
            "FIXED_POINTS",
            "Fixed points",
            "The street within 5 m of each keeps its place there and, where it ends, its "
            "direction. The access points of Prepare site do where streets continue existing ones.",
            "point",
            optional=True,
        )
        yield parameters.choice("SHAPE", "Shape", "What streets become.", SHAPES, default="curved")
        yield parameters.number(
            "STRENGTH",
            "Strength",
            "How long the bends are that are smoothed out: at 0 only junctions are squared, at 50 "
            "bends of up to about a block, at 100 of up to about two blocks.",
            unit="percent",
            default=50.0,
            minimum=0.0,
            maximum=100.0,
        )
        yield parameters.number(
            "MAX_MOVE",
            "Largest move",
            "No street moves further than this. Empty: 0.3 of the median street between two "
            "junctions, at most 20 m.",
            unit="m",
            minimum=0.01,
            maximum=1000.0,
            unset="by the length of the streets",
        )
        yield parameters.number(
            "FILLET_RADIUS",
            "Fillet radius",
            "Radius of the arcs at the bends that remain between junctions, where there is room "
            "for it; 0 for no arcs.",
            unit="m",
            default=15.0,
            minimum=0.0,
            maximum=1000.0,
        )
        yield from _details()

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layers, smooth the streets and tell what has changed."""
        from ...algorithms.streets import Smoothing, smooth_streets

        keys = ("INPUT", "SITE", "OBSTACLES", "FIXED_POINTS")
        frames = {
            key: request.frame(key, progress.part(0.04 * at, 0.04 * (at + 1)))
            for at, key in enumerate(keys)
        }
        asked = Smoothing(
            shape=request.word("SHAPE"),
            strength=request.number("STRENGTH") / 100,
            max_move=request.optional_number("MAX_MOVE"),
            fillet_radius=request.number("FILLET_RADIUS"),
            fillet_angle=request.number("FILLET_ANGLE"),
            square=request.flag("SQUARE_JUNCTIONS"),
            slide=request.flag("SLIDING_ENDS"),
        )
        done = smooth_streets(
            frames["INPUT"],
            asked,
            site=frames["SITE"],
            obstacles=frames["OBSTACLES"],
            fixed_points=frames["FIXED_POINTS"],
            street_layer=request.name("INPUT"),
            site_layer=request.name("SITE"),
            obstacle_layer=request.name("OBSTACLES"),
            point_layer=request.name("FIXED_POINTS"),
            progress=progress.part(0.16, 1.0),
        )
        _tell(done, progress)
        return Result(
            crs=request.crs("INPUT"),
            layers={"STREETS": done.streets, "PROBLEMS": done.problems},
            numbers=_numbers(done),
            specification=to_json(dataclasses.asdict(asked)),
            keep=True,
        )


def _details() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what seldom has to be changed."""
    yield parameters.number(
        "FILLET_ANGLE",
        "Smallest turn with an arc",
        "Bends that turn by less get no arc.",
        unit="degrees",
        default=20.0,
        minimum=1.0,
        maximum=160.0,
        advanced=True,
    )
    yield parameters.flag(
        "SQUARE_JUNCTIONS",
        "Square junctions",
        "Whether streets are drawn towards right angles where they meet. Where they are more than "
        "50 degrees off, as slip roads are, they are left alone.",
        default=True,
        advanced=True,
    )
    yield parameters.flag(
        "SLIDING_ENDS",
        "Sliding ends",
        "Whether streets that end at the edge of the site may slide along it; else their ends keep "
        "their place.",
        default=True,
        advanced=True,
    )


def _tell(done: Any, progress: FeedbackProgress) -> None:
    """Say in the log what a planner should know."""
    progress.info(f"No street may move further than {done.max_move:.1f} m.")
    if done.largest_move < STILL:
        progress.info("No street had to move: they are as smooth as these settings make them.")
    if not done.complete:
        progress.warn("Cancelled while bends were rounded: the streets are smooth, without arcs.")


def _numbers(done: Any) -> dict[str, float]:
    """Return the figures before and after."""
    told: dict[str, float] = {"LARGEST_MOVE": done.largest_move, "HELD_BACK": done.held_back}
    for name, found in (("BEFORE", done.before), ("AFTER", done.after)):
        told[f"ANGLE_{name}"] = found.angle_mean
        told[f"ANGLE_P90_{name}"] = found.angle_p90
        told[f"BENDS_{name}"] = found.bends
        told[f"SHORTEST_{name}"] = found.shortest
        told[f"LENGTH_{name}"] = found.length
    return told
