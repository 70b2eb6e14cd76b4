"""Floor plans: rooms that tile a storey, and the corridors that reach all of them."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from typing import ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import deps, fields, parameters, room_fields
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import roominputs


class DesignFloor(Tool):
    """Designs floor plans."""

    about = About(
        name="designfloor",
        title="Design floor plan",
        group="rooms",
        tags=(
            "floor plan", "rooms", "corridors", "office", "hospital", "hotel", "school",
            "building", "storey", "egress", "escape", "architecture", "platwright",
        ),
        summary="Fills the storeys of a building with rooms of admissible shapes and leads "
        "corridors to all of them, with doors and the way from each room to an exit.",
        paragraphs=(
            "The footprint is cut into cells. Rooms of the shapes that you choose cover every "
            "cell, and corridors run between them from the exits, so that each room borders on "
            "one. Rooms and corridors are found together by an integer program (CND section 5.2).",
            "Several storeys share shafts and stairs: obstacles and exits without a value in the "
            "field 'floor' stand on all of them at the same place.",
            "Rooms are narrower by the width of their corridors, so that rooms, corridors and "
            "obstacles cover the footprint exactly. Every room has a door; distances are along "
            "the middle of the corridors.",
            "Where there is no plan, the layer of problems says why, with the cells that cannot "
            "be filled.",
        ),
        picture="A footprint with a shaft and an exit; rooms, corridors and doors in it.",
        references=("CND",),
    )  # fmt: skip
    layers: ClassVar = {
        "ROOMS": room_fields.ROOMS,
        "CORRIDORS": room_fields.FLOOR_CORRIDORS,
        "CORRIDOR_LINES": room_fields.CORRIDOR_LINES,
        "DOORS": room_fields.FLOOR_DOORS,
        "SHAFTS": room_fields.FLOOR_OBSTACLES,
        "CELLS": room_fields.FACES,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "ROOM_COUNT": "Number of rooms",
        "CORRIDOR_SHARE": "Corridors in the area without shafts (%)",
        "NET_TO_GROSS": "Rooms in the area of all storeys (%)",
        "CORRIDOR_LENGTH": "Length of corridors (m)",
        "MEAN_EGRESS": "Mean way from a door to an exit (m)",
        "MAX_EGRESS": "Longest way from a door to an exit (m)",
        "OBJECTIVE": "Objective of the program, sum over storeys, smaller is better",
        "BOUND": "Proven lower bound of the objective",
        "GAP": "Gap between the two (%)",
        "SECONDS": "Time of the run (s)",
    }
    needs = (*deps.LAYERS, *deps.SOLVERS)

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the footprint and what stands in it, shapes, corridors and time."""
        yield parameters.layer(
            "INPUT",
            "Footprints",
            "Polygons of buildings, courtyards as holes. Any coordinate reference system will do.",
            "polygon",
        )
        yield parameters.number(
            "MODULE",
            "Module",
            "Side of the cells that rooms are made of. Cells follow the walls, so that they are a "
            "little larger or smaller.",
            unit="m",
            default=3.6,
            minimum=0.5,
            maximum=100.0,
        )
        yield parameters.flag(
            "MESH",
            "Footprints are cells of a mesh",
            "Each polygon is a cell: quadrilaterals that share whole sides, drawn by hand or faces "
            "of Candidate mesh. Their outline is the footprint, and the module does not count.",
            default=False,
            advanced=True,
        )
        yield from roominputs.shapes("office")
        yield parameters.layer(
            "SINKS",
            "Exits",
            "Points: entrances, stairs, lifts. Corridors lead there. A field 'floor' says the "
            "storey; without a value the exit is on all. A storey without exits has one in the "
            "middle of its longest outer wall; an upper one at the largest shaft that all storeys "
            "share.",
            "point",
            optional=True,
        )
        yield parameters.layer(
            "OBSTACLES",
            "Shafts and obstacles",
            "Polygons that no room covers: lift shafts, columns, roof gardens. A field 'floor' "
            "says the storey.",
            "polygon",
            optional=True,
        )
        yield from roominputs.corridors()
        yield from roominputs.search(20.0)

    def check(self, request: Request) -> None:
        """Check weights that must fit together."""
        roominputs.rules_of(request)

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Lay the mesh, design storey by storey and collect the layers."""
        from ...algorithms.rooms.design import design_floors
        from ...algorithms.rooms.storeys import floor_frames

        begun = time.monotonic()
        rules = roominputs.rules_of(request)
        floors = roominputs.floors_of(request, progress.part(0.0, 0.1))
        templates = roominputs.templates_of(request, progress)
        made = design_floors(floors, templates, rules, progress.part(0.1, 0.9))
        if progress.cancelled():
            progress.warn("Cancelled: the layers have the best plans so far.")
        progress.stage("Drawing walls and doors", 0.92)
        found, figures = floor_frames(made, rules.corridor_width, request.name("INPUT"))
        for own in made:
            if own.error is not None:
                progress.warn(f"Storey {own.floor.storey}: {own.error}")
        for own in made:
            if own.links_missing:
                progress.warn(
                    f"Storey {own.floor.storey}: {own.links_missing} of {own.links} short ways "
                    "between its parts are missing."
                )
        plans = [own.plan for own in made if own.plan is not None]
        objective, bound = sum(p.objective for p in plans), sum(p.bound for p in plans)
        return Result(
            crs=request.crs("INPUT"),
            layers={key: found[kind.key] for key, kind in self.layers.items()},
            numbers={
                **figures,
                # no plan is no perfect plan
                "OBJECTIVE": objective if plans else None,
                "BOUND": bound if plans else None,
                "GAP": _gap(objective, bound) if plans else None,
                "SECONDS": time.monotonic() - begun,
            },
            specification=to_json(
                {
                    "rules": dataclasses.asdict(rules),
                    "module": request.number("MODULE"),
                    "mesh": request.flag("MESH"),
                    "shapes": roominputs.shapes_of(request),
                }
            ),
            keep=True,
        )


def _gap(objective: float, bound: float) -> float:
    """Return the gap in percent of the objective."""
    return 100.0 * (objective - bound) / objective if objective > 0 else 0.0
