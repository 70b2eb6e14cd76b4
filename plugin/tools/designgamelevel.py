"""A game level: blocks that fill an outline, and a route through all of them."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import deps, fields, files, parameters, room_fields
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import roominputs
from .collect import without_places

LEVEL_TYPES = {
    "branching": "the route may branch; blocks with one passage hold treasure",
    "circular": "one ring from the start through all blocks and back",
    "linear": "one way from the start through all blocks to the goal",
}
#: Fewer tiles cannot hold walls on both sides and a way between them.
LEAST_TILES = 3


class DesignGameLevel(Tool):
    """Designs the level of a game."""

    about = About(
        name="designgamelevel",
        title="Design game level",
        group="rooms",
        tags=(
            "game", "level", "dungeon", "castle", "blocks", "rooms", "route", "tiled", "tmx",
            "tmj", "tiles", "maze", "map", "platwright",
        ),
        summary="Fills an outline with blocks of admissible shapes and leads a route through all "
        "of them: branching, in a ring, or from start to goal.",
        paragraphs=(
            "The outline is cut into cells, and blocks of the shapes that you choose fill it "
            "without gaps. The route runs through every block, never along the border of one, and "
            "crosses each in one go; the blocks and the route are found together by an integer "
            "program.",
            "Doors are where the route gets from one block into the next. The table of connected "
            "blocks is the graph of the level.",
            "The file for Tiled holds tiles of floor, walls and doors, and the blocks, start, goal "
            "and route as objects. A picture of the tiles is written beside it.",
            "Where no level is possible, the layer of problems says why, with the cells that "
            "cannot be filled.",
        ),
        picture="An outline; blocks that fill it, with the route through them.",
        references=("CND",),
    )  # fmt: skip
    layers: ClassVar = {
        "BLOCKS": room_fields.BLOCKS,
        "ROUTE": room_fields.ROUTE,
        "DOORS": room_fields.DOORS,
        "START_GOAL": room_fields.ENDS,
        "ADJACENCY": room_fields.ADJACENCY,
        "PROBLEMS": fields.PROBLEMS,
    }
    files: ClassVar = {
        "TILED_FILE": files.FileKind(
            "Tiled map",
            "tmx",
            "Map of the editor Tiled, as XML (.tmx) or JSON (.tmj), with a picture of its tiles "
            "beside it.",
            others=("tmj",),
            beside=("_tiles.png",),
        ),
    }
    numbers: ClassVar = {
        "BLOCK_COUNT": "Number of blocks",
        "DOOR_COUNT": "Number of doors",
        "TREASURES": "Blocks with one passage only, beside start and goal",
        "ROUTE_LENGTH": "Length of the route (m)",
        "OBJECTIVE": "Objective of the program, smaller is better",
        "BOUND": "Proven lower bound of the objective",
        "GAP": "Gap between the two (%)",
        "SECONDS": "Time of the run (s)",
    }
    needs = (*deps.LAYERS, *deps.SOLVERS)

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the outline, shapes and places, and how long to search."""
        yield parameters.layer(
            "INPUT",
            "Outline",
            "One polygon, or one that is selected; holes are kept. A castle, a cave, a real "
            "building: any coordinate reference system will do.",
            "polygon",
        )
        yield parameters.number(
            "MODULE",
            "Cell size",
            "Side of the cells that blocks are made of. Cells follow the outline, so that they "
            "are a little larger or smaller.",
            unit="m",
            default=5.0,
            minimum=0.01,
            maximum=1000.0,
        )
        yield parameters.choice(
            "LEVEL_TYPE", "Type of level", "How the route runs.", LEVEL_TYPES, default="branching"
        )
        yield from roominputs.shapes("caves")
        yield parameters.layer(
            "SINKS",
            "Start and goal",
            "Points: the first is the start, the second the goal. A ring has a start only. Without "
            "points the places are chosen.",
            "point",
            optional=True,
        )
        yield parameters.layer(
            "OBSTACLES",
            "Obstacles",
            "Polygons that no block covers, such as pillars, ponds or rock.",
            "polygon",
            optional=True,
        )
        yield from _route_inputs()
        yield from roominputs.search(20.0)
        yield parameters.number(
            "TILES",
            "Tiles per cell",
            "Tiles along the side of a cell in the map for Tiled.",
            default=5,
            minimum=LEAST_TILES,
            maximum=32,
            integer=True,
            advanced=True,
        )

    def check(self, request: Request) -> None:
        """Check wishes for the route and the name of the map before any work is done."""
        _route_rules(request).check(_level_type(request))
        path = files.place(request, "TILED_FILE")
        kind = self.files["TILED_FILE"]
        endings = [f".{own}" for own in (kind.ending, *kind.others)]
        if path is not None and path.suffix.lower() not in endings:
            raise InputError(
                f"The Tiled map '{path.name}' ends neither in .tmx nor in .tmj.",
                "Give it one of these endings: .tmx for XML, .tmj for JSON.",
            )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Lay the mesh, design the level and collect its layers."""
        from ...algorithms.errors import InfeasibleError
        from ...algorithms.rooms.levels import empty_layers, level_layers, read_level
        from ...algorithms.rooms.problems import problem_layer, reasons_of

        begun = time.monotonic()
        floor, places = _ground(request, progress.part(0.0, 0.15))
        remarks = list(floor.remarks)
        name = request.name("INPUT")
        contents: dict[str, files.Content] = {}
        numbers: dict[str, float] = {}
        try:
            level = _design(request, floor, places, progress.part(0.15, 0.9))
        except InfeasibleError as error:
            progress.warn(str(error))
            remarks += reasons_of(floor, error)
            found = empty_layers(floor.source_crs)
        else:
            remarks += level.remarks
            ends = {"start": level.start, "goal": level.goal}
            plan = level.plan
            found = level_layers(level.problem, plan, floor.crs, floor.source_crs, **ends)
            contents = _tiled(request, read_level(level.problem, plan, **ends), floor, progress)
            numbers = _figures(found, plan)
        found["problems"] = problem_layer(remarks, name, floor.feature, floor.crs, floor.source_crs)
        # Processing writes tables as features without a place
        found["adjacency"] = without_places(found["adjacency"])
        return Result(
            crs=request.crs("INPUT"),
            layers={key: found[kind.key] for key, kind in self.layers.items()},
            numbers={**numbers, "SECONDS": time.monotonic() - begun},
            specification=to_json(
                {
                    "level_type": request.word("LEVEL_TYPE"),
                    "least_length": request.number("MIN_LENGTH"),
                    "most_length": request.optional_number("MAX_LENGTH"),
                    "treasures": request.optional_number("TREASURE_ROOMS"),
                    "module": request.number("MODULE"),
                    "shapes": roominputs.shapes_of(request),
                    "seed": request.integer("SEED"),
                }
            ),
            keep=True,
            files=contents,
        )


def _route_inputs() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what is asked of the route."""
    yield parameters.number(
        "MIN_LENGTH",
        "Least length of the route",
        "All of the route together, branches too, is at least this long; 0 for any length. It runs "
        "along cells, so leave two or three cells between least and greatest length.",
        unit="m",
        default=0.0,
        minimum=0.0,
        advanced=True,
    )
    yield parameters.number(
        "MAX_LENGTH",
        "Greatest length of the route",
        "All of the route together, branches too, is at most this long. Empty: any length.",
        unit="m",
        minimum=0.0,
        advanced=True,
    )
    yield parameters.number(
        "TREASURE_ROOMS",
        "Number of treasure rooms",
        "Exactly so many blocks, start and goal left out, have one passage only. Branching levels "
        "have them; 0 for none. Empty: any number.",
        minimum=0,
        maximum=10_000,
        integer=True,
        advanced=True,
    )


def _route_rules(request: Request) -> Any:
    """Return the `RouteRules` that are asked for."""
    from ...algorithms.rooms.rules import RouteRules

    most = request.optional_number("MAX_LENGTH")
    rooms = request.has("TREASURE_ROOMS")
    return RouteRules(
        least_length=request.number("MIN_LENGTH"),
        most_length=math.inf if most is None else most,
        treasures=request.integer("TREASURE_ROOMS") if rooms else None,
    )


def _level_type(request: Request) -> Any:
    """Return the type of level, a `LevelType`."""
    return request.word("LEVEL_TYPE")


def _ground(request: Request, progress: FeedbackProgress) -> tuple[Any, list[Any]]:
    """Return the floor of the outline, and where start and goal are wished."""
    from ...algorithms.rooms.floors import LayerNames, floors_of

    outline = request.frame("INPUT", progress)
    if len(outline) > 1:
        raise InputError(
            f"It has {len(outline)} polygons, and a level has one outline.",
            "Select one of them and tick 'Selected features only'.",
            layer=request.name("INPUT"),
        )
    points = request.frame("SINKS", progress)
    names = LayerNames(
        footprints=request.name("INPUT"),
        sinks=request.name("SINKS"),
        obstacles=request.name("OBSTACLES"),
        floor="",
    )
    (floor,) = floors_of(
        outline,
        module=request.number("MODULE"),
        # without points places are chosen later, by the type of the level
        sinks=outline.representative_point().to_frame("geometry") if points is None else points,
        obstacles=request.frame("OBSTACLES", progress),
        names=names,
        progress=progress,
    )
    if points is None:
        return floor, []
    moved = points.geometry.to_crs(floor.crs).explode(index_parts=False)
    return floor, [
        (point.x, point.y) for point in moved if point is not None and not point.is_empty
    ]


def _design(request: Request, floor: Any, places: list[Any], progress: FeedbackProgress) -> Any:
    """Return the `LevelDesign` that is asked for."""
    from ...algorithms.rooms.level import design_level
    from ...algorithms.rooms.rules import RoomRules

    rules = RoomRules(time_limit=request.number("TIME_LIMIT"), seed=request.integer("SEED"))
    templates = roominputs.templates_of(request, progress)
    progress.stage("Searching for blocks and a route", 0.05)
    return design_level(
        floor, templates, rules, _level_type(request), places, progress, _route_rules(request)
    )


def _tiled(
    request: Request, level: Any, floor: Any, progress: FeedbackProgress
) -> dict[str, files.Content]:
    """Return the map for Tiled and the picture of its tiles, where they are asked for."""
    from ...algorithms.rooms.tiled import tiled_files

    path = files.place(request, "TILED_FILE")
    if path is None:
        return {}
    progress.stage("Drawing tiles", 0.95)
    made = tiled_files(
        path,
        level,
        tiles_per_cell=request.integer("TILES"),
        embed=True,
        crs=floor.crs.to_string(),
    )
    parts: Mapping[str, bytes] = {
        "" if own == path else own.name[len(path.stem) :]: data for own, data in made.items()
    }
    return {"TILED_FILE": parts}


def _figures(found: Any, plan: Any) -> dict[str, float]:
    """Return the numbers of a level."""
    blocks = found["blocks"]
    return {
        "BLOCK_COUNT": len(blocks),
        "DOOR_COUNT": len(found["doors"]),
        "TREASURES": int((blocks["role"] == "treasure").sum()),
        "ROUTE_LENGTH": float(found["route"]["length_m"].sum()),
        "OBJECTIVE": plan.objective,
        "BOUND": plan.bound,
        "GAP": 100.0 * plan.gap,
    }
