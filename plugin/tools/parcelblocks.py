"""Parcels in blocks, or in what any streets leave of a site."""

from __future__ import annotations

import dataclasses
import math
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
from . import parcelinputs, persite


class ParcelBlocks(Tool):
    """Cuts blocks into parcels, wherever the streets are from."""

    about = About(
        name="parcelblocks",
        title="Parcels in blocks",
        group="parcels",
        tags=(
            "parcels",
            "lots",
            "plots",
            "subdivision",
            "parcelling",
            "blocks",
            "frontage",
            "site planning",
            "platwright",
        ),
        summary="Cuts blocks into parcels of the size you ask for, each with access to a street: "
        "give block polygons, or streets of any make and the site that they lie in.",
        paragraphs=(
            "Give one of three things: block polygons; streets and a site, which the streets part "
            "into blocks; or streets alone, then the land that they enclose is parted. Streets "
            "are centre lines: half their width is taken off on each side, and where the edge of "
            "the site is a property line along a street nothing is. The streets of Design "
            "streets, of OpenStreetMap layers and drawn ones will do.",
            "Parcels have access along streets, dead ends among them. Edges of the site without "
            "a street, obstacles, and lines drawn as closed give none. Land without access "
            "becomes green rather than a parcel, and the layer of problems tells where.",
            "Parcels, greens, courts and lanes tile the blocks; nothing overlaps. The field "
            "land_use tells them apart, and further styles of the layer show in blue and red how "
            "square the corners are and how near each parcel is to a rectangle.",
        ),
        picture="Streets of a design; parcels in the blocks between them.",
        references=("UP", "VANEGAS"),
    )
    layers: ClassVar = {
        "PARCELS": parcel_fields.PARCELS,
        "PROBLEMS": fields.PROBLEMS,
        "BLOCKS": parcel_fields.PARCEL_BLOCKS,
        "STREET_SPACE": parcel_fields.STREET_SPACE,
    }
    numbers: ClassVar = {
        "REQUESTED": "Parcels that fit on the land by their area",
        "ACHIEVED": "Parcels",
        "MEAN_P_ANGLE": "Mean deviation of their corners from 90 degrees (degrees)",
        "MEAN_P_AREA": "Mean of smallest rectangle around / area",
        "UNDESIRABLE": "Undesirable parcels (%)",
        "WITH_ACCESS": "Parcels with access to a street (%)",
        "GREEN": "Greens and courts in the area of the blocks (%)",
        "SECONDS": "Time of the run (s)",
    }
    needs = deps.LAYERS

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the land, what is asked of parcels, and the details."""
        yield parameters.layer(
            "INPUT",
            "Blocks",
            "Block polygons, each of which is cut by itself. Where streets are given as well, "
            "half their width is taken off where they run along the edge of a block.",
            "polygon",
            optional=True,
        )
        yield parameters.layer(
            "STREETS",
            "Streets",
            "Centre lines of streets, those around the site among them. Paths and tunnels, by "
            "their road class, part no land; motorways do, and give no access.",
            "line",
            optional=True,
        )
        yield parameters.layer(
            "SITE",
            "Site",
            "Polygons of the land that the streets part into blocks. Empty, without blocks: all "
            "land that the streets enclose.",
            "polygon",
            optional=True,
        )
        yield parameters.number(
            "STREET_WIDTH",
            "Street width",
            "From property line to property line. One width for all streets; a field or an "
            "expression by the button beside it. Empty: the field width_m where a street has it, "
            "else by its level or road class.",
            unit="m",
            minimum=0.5,
            maximum=200.0,
            per_feature_of="STREETS",
            unset="by width_m, level or class",
        )
        yield from parcelinputs.parcels()
        yield from parcelinputs.sizes()
        yield from parcelinputs.edges()
        yield from parcelinputs.street_widths()

    def check(self, request: Request) -> None:
        """Check what is given together."""
        parcelinputs.rules_of(request)
        parcelinputs.widths_of(request)
        if not request.has("INPUT") and not request.has("STREETS"):
            raise InputError(
                "There is no land to cut into parcels.",
                "Choose a layer of block polygons, or a layer of streets and the site.",
            )
        if request.has("INPUT") and request.has("SITE"):
            raise InputError(
                "Both blocks and a site are given.",
                "Give blocks, or a site that the streets part into blocks, and leave the other "
                "empty.",
            )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Make the blocks, cut them, and collect the layers."""
        from ...algorithms.parcels.fill import fill_blocks
        from ...algorithms.parcels.layers import parcel_layers, parcel_numbers

        begun = time.monotonic()
        rules = parcelinputs.rules_of(request)
        prepared = _blocks(request, progress.part(0.0, 0.3))
        filled = fill_blocks(
            prepared.blocks,
            rules,
            seed=request.integer("SEED"),
            progress=progress.part(0.3, 0.9),
        )
        progress.stage("Collecting the layers", 0.9)
        found = parcel_layers(
            prepared.all_blocks,
            prepared.with_thin(filled.plots),
            prepared.all_places,
            prepared.source_crs,
            space=prepared.space,
            progress=progress.part(0.9, 1.0),
        )
        told = parcel_numbers(found["parcels"])
        numbers = {
            "REQUESTED": filled.requested,
            "ACHIEVED": filled.achieved,
            **{key: value for key, value in told.items() if key in self.numbers},
            "SECONDS": time.monotonic() - begun,
        }
        return Result(
            crs=request.crs(land_key(request)),
            layers={
                "PARCELS": found["parcels"],
                "PROBLEMS": _problems(prepared, filled.problems),
                "BLOCKS": found["parcel_blocks"],
                "STREET_SPACE": found["street_space"],
            },
            numbers=numbers,
            specification=to_json(dataclasses.asdict(rules)),
        )


def _problems(prepared: Any, more: Any) -> Any:
    """Return the problems of the land and of the blocks as one layer."""
    import pandas

    from ...algorithms.parcels.layers import block_problems

    crs = prepared.source_crs
    found = block_problems(more, prepared.blocks, prepared.places, prepared.layer, crs)
    full = [layer for layer in (prepared.problems, found) if len(layer)]
    return pandas.concat(full, ignore_index=True) if full else found


def _blocks(request: Request, progress: FeedbackProgress) -> Any:
    """Read the layers and return the `PreparedBlocks` of the library."""
    from ...algorithms.parcels.blocks import blocks_from_polygons, blocks_from_streets

    keys = ("INPUT", "STREETS", "SITE", "CLOSED", "OBSTACLES")
    given = {
        key: request.frame(key, progress.part(0.1 * at, 0.1 * (at + 1)))
        for at, key in enumerate(keys)
    }
    making = progress.part(0.5, 1.0)
    asked: dict[str, Any] = {
        "closed_lines": given["CLOSED"],
        "edge": request.word("EDGE"),
        "snap_distance": request.number("SNAP_DISTANCE"),
        "street_layer": request.name("STREETS"),
        "progress": making,
    }
    if request.has("SITE") and given["SITE"] is None:
        raise InputError(
            "It has no features.", "Choose the layer of the site.", layer=request.name("SITE")
        )
    streets, widths = given["STREETS"], parcelinputs.widths_of(request)
    if streets is not None:
        asked["given_widths"] = _given_widths(request, streets)
    if given["INPUT"] is not None:
        if given["OBSTACLES"] is not None:
            progress.warn("Obstacles are cut out of a site; block polygons are taken as they are.")
        name = request.name("INPUT")
        return blocks_from_polygons(given["INPUT"], streets, widths, polygon_layer=name, **asked)
    if streets is None:
        raise InputError(
            "It has no features, so that there is nothing to part the site into blocks.",
            "Give the streets of the site, or block polygons.",
            layer=request.name("STREETS"),
        )
    return blocks_from_streets(
        given["SITE"],
        streets,
        widths,
        obstacles=given["OBSTACLES"],
        site_layer=request.name("SITE"),
        obstacle_layer=request.name("OBSTACLES"),
        **asked,
    )


def _given_widths(request: Request, streets: Any) -> Any:
    """Return the width of each street by a field or an expression, or None."""
    if not persite.per_feature(request, ("STREET_WIDTH",)):
        return None
    import numpy

    found = persite.values_of_features(request, "STREET_WIDTH", "STREETS")
    own = (found.get(feature, (None, None))[1] for feature in streets.index)
    return numpy.array([math.nan if width is None else width for width in own], dtype=float)


def land_key(request: Request) -> str:
    """Return the key of the layer whose land is cut."""
    return next(key for key in ("INPUT", "SITE", "STREETS") if request.has(key))
