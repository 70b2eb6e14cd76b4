"""The parameters of floor plans and game levels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from qgis.core import QgsProcessingParameterDefinition, QgsProcessingParameterFile

from ...algorithms.errors import InputError
from .. import compat, parameters
from ..progress import FeedbackProgress
from ..request import Request

#: Widest corridor as a share of the module.
WIDEST = 0.8
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


#: How ends of corridors that are no exits count (`RoomRules.dead_ends`).
DEAD_ENDS = {
    "avoid": ("few: each costs as much as three cells of corridor", 3.0),
    "allow": ("they cost nothing", 0.0),
    "forbid": ("none: there are two ways from every room", math.inf),
}


#: Places where corridors fork (`RoomRules.branches`).
BRANCHES = {
    "allow": ("they cost nothing", 0.0),
    "avoid": ("few: each costs as much as three cells of corridor", 3.0),
    "forbid": ("none: each corridor is one way or one ring", math.inf),
}
#: What ways are for (`RoomRules.links`): the cost of each that is missing.
WAYS = {
    "to exits": ("corridors lead from every room to an exit", 0.0),
    "to exits and within": (
        "besides, ways between neighbouring parts of the storey are short; each that is missing "
        "costs as much as six cells of corridor",
        6.0,
    ),
}


def corridors() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what corridors should do."""
    yield parameters.number(
        "CORRIDOR_WIDTH",
        "Corridor width",
        "Rooms are narrower by half of it where a corridor runs between them, by all of it along "
        "walls and shafts.",
        unit="m",
        default=1.8,
        minimum=0.3,
        maximum=50.0,
    )
    yield parameters.number(
        "STOREYS",
        "Storeys",
        "Number of storeys, numbered from 0. Empty: those that the field 'floor' of the layers "
        "names, or one.",
        minimum=1,
        maximum=200,
        integer=True,
    )
    yield parameters.choice(
        "DEAD_ENDS",
        "Dead ends",
        "Ends of corridors that are no exits.",
        {word: text for word, (text, _) in DEAD_ENDS.items()},
        default="avoid",
        advanced=True,
    )
    yield parameters.choice(
        "BRANCHES",
        "Branches",
        "Places where three corridors or more meet.",
        {word: text for word, (text, _) in BRANCHES.items()},
        default="allow",
        advanced=True,
    )
    yield parameters.flag(
        "OUTER",
        "Corridors along outer walls",
        "Whether corridors may run along outer walls, where they take windows from rooms.",
        default=False,
        advanced=True,
    )
    yield parameters.flag(
        "CLOSE",
        "Corridors one cell apart",
        "Whether two corridors may run side by side with one row of cells between them.",
        default=False,
        advanced=True,
    )
    yield from _wishes()


def _wishes() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield weights, and lines that corridors must follow."""
    for key, text, what, usual in (
        ("WEIGHT_LENGTH", "Weight of length", "the length of corridors (lambda L of CND)", 1.0),
        ("WEIGHT_DISTANCE", "Weight of distance", "ways to the exits (lambda D of CND)", 0.0),
    ):
        yield parameters.number(
            key,
            text,
            f"How much {what} should count.",
            default=usual,
            minimum=0.0,
            maximum=1000.0,
            advanced=True,
        )
    yield parameters.choice(
        "WAYS",
        "Ways",
        "Between which places people go (CND section 4.2, point-to-point).",
        {word: text for word, (text, _) in WAYS.items()},
        default="to exits",
        advanced=True,
    )
    yield parameters.number(
        "PART_SIZE",
        "Size of parts",
        "With ways within: side of the parts of a storey between which ways are short. Empty: six "
        "cells.",
        unit="m",
        minimum=1.0,
        maximum=1000.0,
        advanced=True,
    )
    yield parameters.layer(
        "CORRIDORS_GIVEN",
        "Given corridors",
        "Lines along which a corridor must run. A field 'floor' says the storey.",
        "line",
        optional=True,
        advanced=True,
    )


def rules_of(request: Request) -> Any:
    """Return the `RoomRules` that are asked for.

    Raises
    ------
    InputError
        Two of them contradict each other.
    """
    from ...algorithms.rooms.rules import RoomRules

    width = request.number("CORRIDOR_WIDTH")
    if not request.flag("MESH"):
        check_width(width, request.number("MODULE"))
    return RoomRules(
        weight_length=request.number("WEIGHT_LENGTH"),
        weight_distance=request.number("WEIGHT_DISTANCE"),
        dead_ends=DEAD_ENDS[request.word("DEAD_ENDS")][1],
        branches=BRANCHES[request.word("BRANCHES")][1],
        links=WAYS[request.word("WAYS")][1],
        part_size=request.optional_number("PART_SIZE"),
        too_close=0.0 if request.flag("CLOSE") else math.inf,
        outer=request.flag("OUTER"),
        corridor_width=width,
        time_limit=request.number("TIME_LIMIT"),
        seed=request.integer("SEED"),
    )


def check_width(width: float, module: float) -> None:
    """Raise `InputError` where corridors leave nothing of the cells beside them."""
    if width > WIDEST * module:
        raise InputError(
            f"A corridor width of {width:g} m leaves too little of cells of {module:g} m.",
            f"Give at most {math.floor(100 * WIDEST * module) / 100:.2f} m, or larger cells.",
        )


def floors_of(request: Request, progress: FeedbackProgress) -> Any:
    """Return the storeys of all footprints as meshes, or those of a mesh that is given.

    Raises
    ------
    InputError
        A layer cannot be used, or corridors are too wide for the cells.
    """
    from ...algorithms.rooms.floors import LayerNames, floors_of, floors_of_mesh

    storeys = request.optional_number("STOREYS")
    given: dict[str, Any] = {
        "sinks": request.frame("SINKS", progress),
        "obstacles": request.frame("OBSTACLES", progress),
        "corridors": request.frame("CORRIDORS_GIVEN", progress),
        "storeys": None if storeys is None else int(storeys),
        "names": LayerNames(
            footprints=request.name("INPUT"),
            sinks=request.name("SINKS"),
            obstacles=request.name("OBSTACLES"),
            corridors=request.name("CORRIDORS_GIVEN"),
        ),
        "progress": progress,
    }
    frame = request.frame("INPUT", progress)
    if not request.flag("MESH"):
        return floors_of(frame, module=request.number("MODULE"), **given)
    found = floors_of_mesh(frame, **given)
    width = request.number("CORRIDOR_WIDTH")
    check_width(width, min(own.mesh.edge_length for own in found))
    least = min(float(own.mesh.lengths.min()) for own in found)
    if width > WIDEST * least:
        progress.warn(
            f"The shortest side of a cell is {least:.2f} m: corridors of {width:g} m on both sides "
            "of such a cell may leave no room, and then there is no plan. Draw larger cells there."
        )
    return found


def shapes_of(request: Request) -> str:
    """Return whose shapes were used, for the record."""
    if request.has("TEMPLATES"):
        return f"layer {request.name('TEMPLATES')}"
    if request.has("TEMPLATE_FILE"):
        return f"file {Path(request.field('TEMPLATE_FILE')).name}"
    return request.word("TEMPLATE_SET")


def templates_of(request: Request, progress: FeedbackProgress) -> Any:
    """Return the shapes that are asked for.

    Raises
    ------
    InputError
        A layer and a file are given, or one of them cannot be used.
    """
    from ...algorithms.rooms.shapes import (
        coloured,
        drawn_templates,
        read_templates,
        shipped_templates,
    )

    if request.has("TEMPLATES") and request.has("TEMPLATE_FILE"):
        raise InputError(
            "Shapes are given as a layer and as a file.", "Leave one of the two empty."
        )
    if request.has("TEMPLATES"):
        drawn = drawn_templates(request.frame("TEMPLATES", progress), request.name("TEMPLATES"))
        return coloured(drawn)
    if request.has("TEMPLATE_FILE"):
        return coloured(read_templates(Path(request.field("TEMPLATE_FILE"))))
    return shipped_templates(request.word("TEMPLATE_SET"))
