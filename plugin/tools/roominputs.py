"""The parameters of floor plans and game levels."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from qgis.core import QgsProcessingParameterDefinition, QgsProcessingParameterFile

from ...algorithms.errors import InputError
from .. import compat, parameters
from ..progress import FeedbackProgress
from ..request import Request

#: The shipped sets of shapes (`rooms.shapes.template_sets`).
SETS = {
    "basic": "plain shapes of 2 to 8 squares for any building",
    "hotel": "squares of 3.6 m: rooms, family rooms, suites, lounge, service",
    "office": "squares of 3.6 m: offices, team rooms, open plan, meeting, quiet, service",
    "school": "squares of 4 m: classrooms, science, library, group rooms, staff, stores",
    "hospital": "squares of 3.6 m: patients, isolation, nurses, treatment, day rooms, utility",
    "caves": "blocks of game levels, each wide enough for a route through it",
}


def shapes(default: str) -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the shapes of rooms or blocks."""
    yield parameters.choice(
        "TEMPLATE_SET",
        "Shapes",
        "A shipped set of shapes. Shapes of your own, as a layer or a file, replace it.",
        SETS,
        default=default,
    )
    yield parameters.layer(
        "TEMPLATES",
        "Shapes of your own",
        "Polygons drawn on a grid of equal squares, one for each shape, anywhere on the map. "
        "Fields, if you like: name, min and max (number), min_share and max_share (of the area), "
        "colour, use, rotate and mirror (yes or no), unit (side of a square).",
        "polygon",
        optional=True,
        advanced=True,
    )
    file = QgsProcessingParameterFile(
        "TEMPLATE_FILE", "File of shapes", extension="json", defaultValue=None, optional=True
    )
    file.setHelp(
        "A file whose name ends in .json, with a list of templates; each has a name, cells (rows "
        "of # and .), and, if you like, rotations, mirror, min, max, min_share, max_share, "
        "colour, use. Optional."
    )
    file.setFlags(file.flags() | compat.ADVANCED)
    yield file


def search(limit: float) -> Iterator[QgsProcessingParameterDefinition]:
    """Yield time and seed."""
    yield parameters.number(
        "TIME_LIMIT",
        "Time limit",
        "For the search; a first plan is there after some seconds, and it gets better until then.",
        unit="s",
        default=limit,
        minimum=1.0,
        maximum=3600.0,
    )
    yield parameters.number(
        "SEED",
        "Seed",
        "Another seed decides anew where there is a choice. The time limit ends the search, and a "
        "faster machine may come further with the same seed.",
        default=1,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
        advanced=True,
    )


def templates_of(request: Request, progress: FeedbackProgress) -> Any:
    """Return the shapes that are asked for.

    Raises
    ------
    InputError
        A layer and a file are given, or one of them cannot be used.
    """
    from ...algorithms.rooms.shapes import drawn_templates, read_templates, shipped_templates

    if request.has("TEMPLATES") and request.has("TEMPLATE_FILE"):
        raise InputError(
            "Shapes are given as a layer and as a file.", "Leave one of the two empty."
        )
    if request.has("TEMPLATES"):
        return drawn_templates(request.frame("TEMPLATES", progress), request.name("TEMPLATES"))
    if request.has("TEMPLATE_FILE"):
        return read_templates(Path(request.field("TEMPLATE_FILE")))
    return shipped_templates(request.word("TEMPLATE_SET"))
