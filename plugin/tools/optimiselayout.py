"""The streets and parcels of a layout improved, as a whole."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import deps, fields, parameters, parcel_fields
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import parcelinputs, siteinputs, splitinputs

#: Size of parcels where neither the planner nor parcels say one (metres).
USUAL = (18.0, 30.0)
#: Least frontage of parcels, as a share of their width, where they are narrow.
NARROW = 0.8


class OptimiseLayout(Tool):
    """Moves all streets of a layout a little so that better parcels fit, and cuts these."""

    about = About(
        name="optimiselayout",
        title="Improve streets and parcels",
        group="parcels",
        tags=(
            "optimise", "optimize", "improve", "streets", "parcels", "lots", "rows", "layout",
            "least squares", "urban pattern", "platwright",
        ),
        summary="Moves the streets of any layout a few metres so that rows of parcels fit between "
        "them, cuts the parcels anew, and keeps what is better.",
        paragraphs=(
            "All streets move together, in one sparse system of equations: towards strips that "
            "are as deep as two rows of parcels, fair along their course, square where they meet, "
            "near to where they were. Ends slide along the edge of the site. Streets whose "
            "status is existing, given or connector stay, and so do those that end in the open "
            "and those that they branch off.",
            "The parcels are then cut anew. Of each site the best is kept: the parcels that were "
            "given, those that the streets make as they are, or those that the moved streets "
            "make. Land whose use is no parcel, green, court or lane stays as it is.",
            "Parcels without streets are improved by themselves: borders between them become "
            "squarer, areas more even, and the outlines of the blocks stay.",
        ),
        picture="Streets drawn by hand and their parcels, from blue (as wished) to red; the same "
        "improved.",
        references=("UP",),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": parcel_fields.IMPROVED_STREETS,
        "PARCELS": parcel_fields.IMPROVED_PARCELS,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "PARCELS_BEFORE": "Number of parcels before",
        "PARCELS_AFTER": "Number of parcels after",
        "P_ANGLE_BEFORE": "Mean deviation of their corners from 90 degrees before (degrees)",
        "P_ANGLE_AFTER": "Mean deviation of their corners from 90 degrees after (degrees)",
        "P_AREA_BEFORE": "Mean of smallest rectangle around / area before",
        "P_AREA_AFTER": "Mean of smallest rectangle around / area after",
        "UNDESIRABLE_BEFORE": "Undesirable parcels before (%)",
        "UNDESIRABLE_AFTER": "Undesirable parcels after (%)",
        "LARGEST_MOVE": "Largest move of a street (m)",
        "BETTER": "Number of sites, or blocks, that are better now",
        "SECONDS": "Time of the run (s)",
    }
    needs = deps.LAYERS

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the layout and what is asked of parcels."""
        yield parameters.layer(
            "INPUT_STREETS",
            "Streets",
            "Centre lines, designed or drawn. The field width_m says how wide they are, else "
            "their level or road class does.",
            "line",
            optional=True,
        )
        yield parameters.layer(
            "INPUT_PARCELS",
            "Parcels",
            "Parcels of the layout, if there are some. They say how large parcels are to be, and "
            "are kept where nothing better is found.",
            "polygon",
            optional=True,
        )
        yield parameters.layer(
            "SITE",
            "Site",
            "Site polygons. Empty: what the parcels and the streets between them cover.",
            "polygon",
            optional=True,
        )
        yield parameters.layer(
            "ROADS",
            "Existing roads",
            "Roads around the site, where they are not among the streets. Where no street and no "
            "road runs along the edge, all of it counts as a street.",
            "line",
            optional=True,
        )
        yield parameters.layer(
            "OBSTACLES",
            "Obstacles",
            "Polygons that stay free of streets and parcels, such as buildings to keep, water or "
            "trees.",
            "polygon",
            optional=True,
        )
        for key, text, usual in (
            ("PARCEL_WIDTH", "width", USUAL[0]),
            ("PARCEL_DEPTH", "depth", USUAL[1]),
        ):
            yield parameters.number(
                key,
                f"Parcel {text}",
                f"Wished {text} of parcels. Empty: the median of the parcels, else {usual:g} m.",
                unit="m",
                minimum=1.0,
                maximum=1000.0,
                unset="as the parcels are",
            )
        yield from parcelinputs.sizes()
        yield from splitinputs.deep()
        yield next(siteinputs.snapping(advanced=True))
        yield from parcelinputs.street_widths()

    def check(self, request: Request) -> None:
        """Check what is given together."""
        if not request.has("INPUT_STREETS") and not request.has("INPUT_PARCELS"):
            raise InputError("There is nothing to improve.", "Choose streets, parcels, or both.")
        if request.has("INPUT_STREETS") and not (
            request.has("SITE") or request.has("INPUT_PARCELS")
        ):
            raise InputError(
                "Nobody knows how far the land of the streets reaches.",
                "Choose the site, or parcels.",
            )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layout, improve it and tell what has changed."""
        from ...algorithms.parcels.split.improved import Given, improve_layout
        from ...algorithms.parcels.streetspace import StreetWidths

        begun = time.monotonic()
        frames = {
            key: request.frame(key, progress.part(0.03 * at, 0.03 * (at + 1)))
            for at, key in enumerate(
                ("INPUT_STREETS", "INPUT_PARCELS", "SITE", "ROADS", "OBSTACLES")
            )
        }
        self._say_what_is_missing(request, frames)
        rules = self._rules(request, frames["INPUT_PARCELS"], progress)
        done = improve_layout(
            Given(
                streets=frames["INPUT_STREETS"],
                parcels=frames["INPUT_PARCELS"],
                site=frames["SITE"],
                roads=frames["ROADS"],
                widths=StreetWidths(
                    **{key.lower(): request.number(f"WIDTH_{key}")
                       for key, _, _ in parcelinputs.LEVELS}
                ),
                snap_distance=request.number("SNAP_DISTANCE"),
                street_layer=request.name("INPUT_STREETS"),
                parcel_layer=request.name("INPUT_PARCELS"),
                site_layer=request.name("SITE"),
                road_layer=request.name("ROADS"),
                obstacles=frames["OBSTACLES"],
                obstacle_layer=request.name("OBSTACLES"),
            ),
            rules,
            seed=request.integer("SEED"),
            progress=progress.part(0.15, 0.95),
        )  # fmt: skip
        if not done.better:
            progress.info("Nothing better was found: the layout is as it was.")
        return Result(
            crs=request.crs("INPUT_STREETS" if done.streets is not None else "INPUT_PARCELS"),
            layers={
                "STREETS": done.parcels.iloc[:0][["geometry"]].assign(moved_m=None)
                if done.streets is None
                else done.streets,
                "PARCELS": done.parcels,
                "PROBLEMS": done.problems,
            },
            numbers={**_numbers(done), "SECONDS": time.monotonic() - begun},
            specification=to_json(dataclasses.asdict(rules)),
            keep=True,
        )

    def _say_what_is_missing(self, request: Request, frames: dict[str, Any]) -> None:
        """Raise `InputError` where a layer that is needed is empty."""
        if frames["INPUT_STREETS"] is None and frames["INPUT_PARCELS"] is None:
            key = "INPUT_STREETS" if request.has("INPUT_STREETS") else "INPUT_PARCELS"
            raise InputError(
                "It has no features.", "Choose streets, parcels, or both.", layer=request.name(key)
            )

    def _rules(self, request: Request, parcels: Any, progress: FeedbackProgress) -> Any:
        """Return what is asked of parcels, as large as those there are where no size is given."""
        from ...algorithms.parcels.split.improved import usual_size

        found = usual_size(parcels) or USUAL
        size = [
            usual if (given := request.optional_number(key)) is None else given
            for key, usual in zip(("PARCEL_WIDTH", "PARCEL_DEPTH"), found)
        ]
        progress.info(f"Parcels are to be {size[0]:.1f} m wide and {size[1]:.1f} m deep.")
        return parcelinputs.rules_of(request, size=(size[0], size[1]), narrow=NARROW)


def _numbers(done: Any) -> dict[str, float]:
    """Return the figures before and after."""
    told: dict[str, float] = {"LARGEST_MOVE": done.largest_move, "BETTER": done.better}
    for name, found in (("BEFORE", done.before), ("AFTER", done.after)):
        told[f"PARCELS_{name}"] = found.parcels
        told[f"P_ANGLE_{name}"] = found.p_angle
        told[f"P_AREA_{name}"] = found.p_area
        told[f"UNDESIRABLE_{name}"] = 100 * found.undesirable
    return told
