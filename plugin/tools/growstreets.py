"""Streets that grow into a site, from its roads or over open ground, by the rules of a grammar."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsCoordinateReferenceSystem, QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import deps, fields, growth_fields
from ..bridge import crs_text
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import growthinputs, siteinputs
from .collect import joined, without_frontage

#: What sites without a road along their edge do.
WITHOUT_ROADS = "no matter: streets begin where a road arrives, else in the middle of the site"
#: In a hectare.
SQUARE_METRES = 10_000.0
#: Inputs of which one tells growth over open ground when to stop.
LIMITS = ("MAX_LENGTH", "MAX_SEGMENTS", "POPULATION")
#: What it means for growth that there are no roads.
NO_ROADS = "streets begin in the middle of each site, or at the start points"


class GrowStreets(Tool):
    """Grows streets from a grammar."""

    about = About(
        name="growstreets",
        title="Grow streets",
        group="streets",
        tags=(
            "streets", "growth", "grow", "grammar", "l-system", "procedural", "citysprout",
            "organic", "grid", "village", "town", "animation", "site planning", "platwright",
        ),
        summary="Grows streets into a site from its existing roads by the rules of a grammar: "
        "winding, as a grid, in six directions, along a line, around a centre, or as a suburb.",
        paragraphs=(
            "Streets branch step by step, as old towns did, until there is no room left or a "
            "limit is reached; in blocks of a site that are still too large they begin anew. They "
            "meet in junctions, and join a street or a junction that is near rather than run past "
            "it. Hundreds of hectares take seconds: try several seeds.",
            "They keep out of obstacles, motorways and railways. Between the edge of the site and "
            "the roads along it, as far away as the snap distance, they only cross to these roads, "
            "as straight as they can.",
            "Existing roads stay where they are. Growth goes on from their loose ends and from "
            "where they arrive at the site; start points replace that. Without a site the streets "
            "grow out of the roads, or around the points, over open ground, and one of the limits "
            "tells when to stop.",
            "The field appeared gives each street a day, one for each iteration, so that the "
            "temporal controller of QGIS plays the growth: open it (View > Panels > Temporal "
            "Controller), choose the animated mode and a step of one day, and press play.",
            "The streets fit Parcels in blocks, Smooth streets, Validate street network and "
            "Measure design. Main streets are of level 1, large ones of level 2, small ones of "
            "level 3.",
        ),
        picture="A site with existing roads; streets that grew into it.",
        references=("CS",),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": growth_fields.STREETS,
        "NODES": growth_fields.NODES,
        "ROADS_MERGED": growth_fields.ROADS,
        "BLOCKS": growth_fields.BLOCKS,
        "PROBLEMS": fields.PROBLEMS,
        "STEPS": growth_fields.STEPS,
    }
    numbers: ClassVar = {
        "SEGMENTS": "Number of new streets between junctions",
        "NODE_COUNT": "Number of new junctions, bends and ends",
        "ROAD_COUNT": "Number of new roads",
        "TOTAL_LENGTH": "Length of the new streets (m)",
        "POPULATION_REACHED": "People that the new streets stand for",
        "ITERATIONS_DONE": "Number of iterations",
        "BLOCK_COUNT": "Number of blocks",
        "DEAD_ENDS_LEFT": "Number of dead ends of new streets, without those at the site's edge",
        "LEFT_OUT": "Number of streets that had no room",
        "SECONDS": "Time of the run (s)",
    }
    texts: ClassVar = {"STOPPED": "Why growth stopped"}
    needs = deps.LAYERS

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the ground, the grammar, when to stop, and the details."""
        yield from growthinputs.land()
        yield from growthinputs.grammar()
        yield growthinputs.seed()
        yield from growthinputs.limits()
        yield from growthinputs.details()

    def check(self, request: Request) -> None:
        """Read the grammar and check what is given together."""
        growthinputs.rules_of(request)
        if request.has("OBSTACLES") and not request.has("INPUT"):
            raise InputError(
                "Obstacles are given without a site.",
                "Give a polygon that streets may grow in as site, or leave the obstacles away.",
            )
        if not any(request.has(key) for key in ("INPUT", "ROADS", "START_POINTS")):
            growthinputs.crs_of(request)

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Prepare the ground, let the streets grow, and collect the layers."""
        from ...algorithms.growth.grammars.check import grammar_remarks
        from ...algorithms.growth.grow import grow
        from ...algorithms.growth.layers import growth_layers
        from ...algorithms.growth.layers.prune import without_dead_ends
        from ...algorithms.growth.onward import grow_on

        begun = time.monotonic()
        rules = growthinputs.rules_of(request)
        for remark in grammar_remarks(rules.grammar):
            progress.warn(remark)
        real, crs = _ground(request, rules.grammar, progress.part(0.0, 0.2))
        if real.ground.domain is None and not any(request.has(key) for key in LIMITS):
            progress.warn(
                f"There is neither a site nor a limit, so that streets grow for {rules.iterations} "
                "iterations, or until the grammar ends; 100 can make thousands of kilometres. Give "
                "a length, a number of streets or a population to stop at."
            )
        growing = progress.part(0.2, 0.8)
        largest = SQUARE_METRES * request.number("LARGEST_BLOCK")
        if largest > 0 and real.ground.domain is not None and not rules.as_published:
            growth = grow_on(real, rules, largest, growing)
        else:
            growth = grow(real.ground, rules, growing)
        stopped = progress.cancelled()
        if stopped:
            progress.warn("Cancelled: the layers have what had grown by then.")
        else:
            progress.info(f"Growth stopped, because {growth.stopped}.")
        if request.word("DEAD_ENDS") == "remove":
            growth = without_dead_ends(growth, real)
        progress.stage("Collecting the layers", 0.8)
        # Whoever cancels wants to see what has grown, not to lose it.
        found = growth_layers(growth, real, rules, None if stopped else progress)
        return Result(
            crs=crs,
            layers={key: found[kind.key] for key, kind in self.layers.items()},
            numbers={**_figures(found, rules, growth, real), "SECONDS": time.monotonic() - begun},
            specification=to_json(_asked(rules, request)),
            keep=True,
        )


def _ground(
    request: Request, grammar: Any, progress: FeedbackProgress
) -> tuple[Any, QgsCoordinateReferenceSystem]:
    """Return the `RealGround` of the library, and the CRS of the layers."""
    from ...algorithms.growth.land import ground
    from ...algorithms.growth.land.pointground import ground_of_points

    reading, making = progress.part(0.0, 0.6), progress.part(0.6, 1.0)
    asked: dict[str, Any] = {
        "points": request.frame("START_POINTS", reading),
        "point_layer": request.name("START_POINTS"),
        "direction": request.optional_number("DIRECTION"),
        "scale": request.number("SCALE"),
        # starts keep the distance that junctions keep
        "spacing": request.number("SCALE") * max(request.number("INTERSECT_RADIUS"), 0.1) / 2,
        "road_layer": request.name("ROADS"),
        "progress": making,
    }
    if request.has("INPUT"):
        prepared = siteinputs.prepared_sites(request, reading, no_roads=NO_ROADS)
        edges = {"edge": request.word("EDGE"), "obstacle_edge": request.word("OBSTACLE_EDGE")}
        # what of these is outside of the sites, or no street, holds streets back
        barred = {
            "roads": request.frame("ROADS", reading),
            "obstacles": request.frame("OBSTACLES", reading),
            "obstacle_layer": request.name("OBSTACLES"),
        }
        real = ground.ground_of_sites(prepared.sites, grammar, **barred, **edges, **asked)
        problems = joined(without_frontage(prepared.problems, WITHOUT_ROADS, "info"), real.problems)
        return dataclasses.replace(real, problems=problems), request.crs("INPUT")
    roads = request.frame("ROADS", reading)
    if roads is not None:
        asked["snap_distance"] = request.number("SNAP_DISTANCE")
        return ground.ground_of_roads(roads, grammar, **asked), request.crs("ROADS")
    if asked["points"] is not None:
        own = {key: asked[key] for key in ("direction", "point_layer")}
        return ground_of_points(asked["points"], grammar, **own), request.crs("START_POINTS")
    crs = growthinputs.crs_of(request)
    way = growthinputs.direction_of(request)
    return ground.open_ground(grammar, crs_text(crs), direction=way), crs


def _figures(found: Any, rules: Any, growth: Any, real: Any) -> dict[str, Any]:
    """Return the numbers of the layers."""
    from ...algorithms.growth.layers.outward import at_nodes
    from ...algorithms.growth.layers.ways import node_kinds

    blind = (node_kinds(growth, real) == "dead end") & at_nodes(growth, growth.grown)
    streets, nodes = found["streets"], found["nodes"]
    grown = streets[streets["iteration"] > 0]
    length = float(grown["length_m"].sum())
    return {
        "SEGMENTS": len(grown),
        "NODE_COUNT": int((nodes["iteration"] > 0).sum()),
        "ROAD_COUNT": len(found["roads"]),
        "TOTAL_LENGTH": length,
        "POPULATION_REACHED": length * rules.people_per_metre,
        "ITERATIONS_DONE": len(growth.steps),
        "BLOCK_COUNT": len(found["blocks"]),
        "DEAD_ENDS_LEFT": int(blind.sum()),
        "LEFT_OUT": growth.left_out,
        "STOPPED": growth.stopped,
    }


def _asked(rules: Any, request: Request) -> dict[str, Any]:
    """Return what the metadata of the layers say of what was asked."""
    asked = {
        field.name: getattr(rules, field.name)
        for field in dataclasses.fields(rules)
        if field.name != "grammar"
    }
    words = {key.lower(): request.word(key) for key in ("EDGE", "OBSTACLE_EDGE", "DEAD_ENDS")}
    return {"grammar": rules.grammar.name, **asked, **words}
