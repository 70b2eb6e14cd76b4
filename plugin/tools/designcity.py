"""A whole municipality designed, sub-region by sub-region between its major roads."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from qgis.core import (
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFile,
    QgsProcessingParameterString,
)

from ...algorithms.errors import InputError
from .. import compat, deps, executors, fields, parameters, presets
from ..city_fields import CITY_JUNCTIONS, CITY_STREETS, SUB_REGIONS
from ..help import About
from ..outputs import Result, destination_text, file_of
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool

#: Classes of OpenStreetMap that divide, from the largest roads down.
_ORDER = ("motorway", "trunk", "primary", "secondary", "tertiary")
MAJOR = {
    "motorway to tertiary": "and their links; usual in towns",
    "motorway to secondary": "and their links",
    "motorway to primary": "and their links; few, large sub-regions",
    "other classes": "those that 'Road classes' names",
}


class DesignCity(Tool):
    """Designs the streets of a whole municipality."""

    about = About(
        name="designcity",
        title="Design city",
        group="streets",
        tags=(
            "city", "municipality", "town", "street network", "major roads", "arterial",
            "sub-region", "superblock", "division", "parallel", "dask", "cluster", "platwright",
        ),
        summary="Divides a municipality by its major roads and designs the streets of every "
        "sub-region, so that streets of both sides of a road meet.",
        paragraphs=(
            "Major roads of a road layer cut the municipality into sub-regions (CND section 5.1). "
            "Medians, roundabouts and ground between ramps belong to the roads; obstacles are "
            "taken out; what is larger than the largest area is cut by new collectors. All other "
            "streets of the layer are designed anew, but where they meet a major road today is a "
            "junction that is kept first.",
            "Junctions are planned along every major road before anything is designed, and both "
            "sides are given the same ones. Streets leave a sub-region nowhere else, so that they "
            "cross the road or end there in a T-junction. Nobody enters from a motorway.",
            "Every sub-region is designed apart from the others, by several processes or by a Dask "
            "cluster. Its search ends by its work, not by the clock: the streets are the same "
            "wherever they are designed. What fails is tried once more, then it is left with its "
            "reason in the layer of problems, and the rest is kept.",
            "With a file for finished sub-regions a run that was cancelled, or that broke off, "
            "goes on where it was; after a change of the roads only the sub-regions that the "
            "change concerns are designed again.",
        ),
        picture="Major roads divide a town; streets that meet across them.",
        references=("CND",),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": CITY_STREETS,
        "SUB_REGIONS": SUB_REGIONS,
        "JUNCTIONS": CITY_JUNCTIONS,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "REGION_COUNT": "Number of sub-regions",
        "DONE": "Sub-regions that were designed",
        "FAILED": "Sub-regions that failed",
        "RESUMED": "Sub-regions taken from the file",
        "TOTAL_LENGTH": "Length of the new streets (m)",
        "MEAN_DISTANCE": "Mean way out of a sub-region (m)",
        "OBJECTIVE": "Price of all designs",
        "BOUND": "Lower bound of that price, proven program by program",
        "ACHIEVED_GAP": "Gap between the two (share of the price)",
        "AGREEMENT": "Places on major roads where both sides agree or keep their distance (%)",
        "CROSSINGS": "Places where streets of both sides meet",
        "STAGGERED": "Places where the other side ends nearby",
        "COMPUTING": "Time of all workers together (s)",
        "SECONDS": "Time of the run (s)",
    }
    needs = (*deps.LAYERS, *deps.SOLVERS)

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the eight basic parameters, then the advanced ones."""
        yield parameters.layer(
            "INPUT",
            "Municipality",
            "Polygons, all designed together. Any coordinate reference system will do.",
            "polygon",
        )
        yield parameters.layer(
            "ROADS",
            "Roads",
            "Centre lines with the road class of OpenStreetMap (highway, fclass or class), or "
            "with a field level: 1 divides. The smaller ones say where junctions are today.",
            "line",
        )
        yield parameters.choice(
            "MAJOR_ROADS", "Major roads", "Roads that divide.", MAJOR,
            default="motorway to tertiary",
        )  # fmt: skip
        yield parameters.layer(
            "OBSTACLES",
            "Obstacles",
            "Polygons that must stay free of streets: water, parks, railways. Large ones part the "
            "ground.",
            "polygon",
            optional=True,
        )
        yield presets.parameter()
        for key, text, most in (
            ("BLOCK_WIDTH", "Block width", 2000.0),
            ("BLOCK_LENGTH", "Block length", 5000.0),
        ):
            yield parameters.number(
                key,
                text,
                "Wished size of the blocks. Empty: as the kind of neighbourhood says.",
                unit="m",
                minimum=10.0,
                maximum=most,
                unset="by kind",
            )
        file = QgsProcessingParameterFile(
            "FINISHED",
            "File of finished sub-regions",
            extension="gpkg",
            defaultValue=None,
            optional=True,
        )
        file.setHelp(
            "A GeoPackage, made if it is not there. Each sub-region is kept in it as soon as it is "
            "designed, and what it has already is not designed again. Layers may be saved in it, "
            "too, as tables of a database (Save to GeoPackage). Optional."
        )
        yield file
        yield from _division()
        yield from _search()
        yield from executors.inputs()

    def check(self, request: Request) -> None:
        """Check numbers, classes and the file before the run."""
        rules_of(request)
        specification_of(request)
        store = store_of(request)
        if store is not None:
            self._spare(request, store.path)

    def _spare(self, request: Request, path: Path) -> None:
        """Refuse an output that would replace the file of finished sub-regions."""
        for key in self.layers:
            destination = destination_text(request, key)
            file = file_of(destination)
            # into a database a table is written, beside the others
            if file is None or destination.startswith("ogr:") or file.resolve() != path.resolve():
                continue
            title = self.parameterDefinition(key).description()
            raise InputError(
                f"Output '{title}' would replace {path.name}, the file of finished sub-regions.",
                f"Save it in another file, or as a table of this one: ogr:dbname='{path}' "
                f'table="{key.lower()}".',
            )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Divide, design and collect the layers."""
        from ...algorithms.city import city_layers, design_city, divide_city

        presets.tell(request, progress)
        rules, specification = rules_of(request), specification_of(request)
        reading = progress.part(0.0, 0.04)
        frames = {key: request.frame(key, reading) for key in ("INPUT", "ROADS", "OBSTACLES")}
        city = divide_city(
            frames["INPUT"],
            frames["ROADS"],
            frames["OBSTACLES"],
            rules,
            polygon_layer=request.name("INPUT"),
            road_layer=request.name("ROADS"),
            obstacle_layer=request.name("OBSTACLES"),
            progress=progress.part(0.04, 0.08),
        )
        progress.info(
            f"{len(city.regions)} sub-regions, of which {len(city.to_design)} are designed; "
            f"{len(city.junctions)} junctions are planned along the roads between them."
        )
        plan = design_city(
            city,
            specification,
            executor=executors.executor(request, reading),
            store=store_of(request),
            progress=progress.part(0.08, 0.96),
        )
        _tell(plan, progress)
        progress.stage("Joining the sub-regions", 0.97)
        found = city_layers(plan)
        own = plan.numbers
        return Result(
            crs=request.crs("INPUT"),
            layers={key: found[kind.key] for key, kind in self.layers.items()},
            numbers={key: own["SUB_REGIONS" if key == "REGION_COUNT" else key]
                     for key in self.numbers},
            specification=to_json(
                {"rules": vars(rules), "streets": json.loads(specification.to_json())}
            ),
            keep=True,
        )  # fmt: skip


def _division() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how the municipality is divided."""
    classes = QgsProcessingParameterString("ROAD_CLASSES", "Road classes", "", False, optional=True)
    classes.setHelp(
        "Classes that divide, with commas between them, where 'Major roads' says other classes. "
        "Roads with a level of 1 divide in any case. Optional."
    )
    classes.setFlags(classes.flags() | compat.ADVANCED)
    yield classes
    for key, text, help_text, unit, usual, least, most in (
        ("SPACING", "Spacing of junctions", "Wished distance of the junctions along major roads.",
         "m", 180.0, 40.0, 2000.0),
        ("LEAST_AREA", "Least area", "Smaller sub-regions stay as they are.",
         "ha", 1.0, 0.1, 100.0),
        ("MOST_AREA", "Largest area", "Larger sub-regions are cut by new collectors.",
         "ha", 60.0, 2.0, 300.0),
        ("STREET_SPACE", "Street space",
         "Ground between roads into which no disc of this radius fits belongs to the roads.",
         "m", 15.0, 1.0, 100.0),
        ("TOLERANCE", "Tolerance of junctions",
         "Ends of streets that are nearer than this to a junction, or to each other across a "
         "road, become one.", "m", 20.0, 0.1, 25.0),
    ):  # fmt: skip
        yield parameters.number(
            key, text, help_text, unit=unit, default=usual, minimum=least, maximum=most,
            advanced=True,
        )  # fmt: skip


def _search() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what else is asked of streets, and how long is searched."""
    yield parameters.number(
        "WEIGHT_STRAIGHT",
        "Weight of straight streets",
        "Price of turns; less gives winding streets. Empty: as the kind of neighbourhood says.",
        minimum=0.0,
        advanced=True,
        unset="by kind",
    )
    yield parameters.number(
        "EFFORT",
        "Work on each sub-region",
        "Steps of the search for every 100 candidate streets; more takes longer and may give "
        "better designs.",
        default=30.0,
        minimum=1.0,
        maximum=10000.0,
        advanced=True,
    )
    yield parameters.number(
        "SEED",
        "Seed",
        "The same seed gives the same streets, on however many workers; another one decides anew "
        "where there is a choice.",
        default=1,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
        advanced=True,
    )


def rules_of(request: Request) -> Any:
    """Return how the municipality is to be divided.

    Raises
    ------
    InputError
        Classes are missing, or numbers contradict each other.
    """
    from ...algorithms.city import CityRules

    word = request.word("MAJOR_ROADS")
    named = tuple(
        part.strip().lower() for part in request.field("ROAD_CLASSES").split(",") if part.strip()
    )
    if word == "other classes":
        classes = named
    else:
        if named:
            raise InputError(
                f"Road classes are named, but major roads are '{word}'.",
                "Choose 'other classes', or leave 'Road classes' empty.",
            )
        kept = _ORDER[: _ORDER.index(word.rsplit(" ", 1)[1]) + 1]
        classes = tuple(name for kind in kept for name in (kind, f"{kind}_link"))
    return CityRules(
        classes=classes,
        thin=request.number("STREET_SPACE"),
        least_ha=request.number("LEAST_AREA"),
        most_ha=request.number("MOST_AREA"),
        spacing=request.number("SPACING"),
        tolerance=request.number("TOLERANCE"),
    )


def specification_of(request: Request) -> Any:
    """Return what is asked of the streets of every sub-region."""
    from ...algorithms.network.specification import Specification

    keys = ("BLOCK_WIDTH", "BLOCK_LENGTH", "WEIGHT_STRAIGHT")
    sizes = {key.lower(): presets.number(request, key) for key in keys}
    return Specification(
        **{key: value for key, value in sizes.items() if value is not None},
        effort=request.number("EFFORT"),
        seed=request.integer("SEED"),
    )


def store_of(request: Request) -> Any:
    """Return the file of finished sub-regions, or None where none is named.

    Raises
    ------
    InputError
        It is no GeoPackage, or its folder is not there.
    """
    from ...algorithms.city import CityFile

    path = request.field("FINISHED").strip() if request.has("FINISHED") else ""
    return CityFile(path) if path else None


def _tell(plan: Any, progress: FeedbackProgress) -> None:
    """Say in the log what a planner should know."""
    if plan.resumed:
        progress.info(f"{plan.resumed} sub-regions were in the file already.")
    if plan.cancelled:
        left = plan.count("not reached")
        progress.warn(f"Cancelled: {left} sub-regions have no streets yet; the others are kept.")
    failed = [number for number, own in plan.outcomes.items() if own.state == "failed"]
    if failed:
        listed = ", ".join(str(number) for number in failed[:5])
        more = f" and {len(failed) - 5} more" if len(failed) > 5 else ""
        progress.warn(f"Sub-regions {listed}{more} failed; the layer of problems says why.")
    agreed = plan.agreement
    progress.info(
        f"Streets of both sides meet at {agreed.count('crossing')} places on major roads; at "
        f"{agreed.count('T-junction')} those of one side end; {agreed.count('staggered')} are "
        "staggered."
    )
