"""A part of a layout made anew, the rest as it is."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import (
    QgsExpression,
    QgsExpressionContext,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterExpression,
    QgsProcessingParameterString,
)

from ...algorithms.errors import InputError
from .. import deps, fields, parameters, parcel_fields
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import parcelinputs, siteinputs, splitinputs

ACTIONS = {
    "parcels": "they are cut anew, the streets stay",
    "streets": "streets with chosen parcels on both sides are given up and laid anew, too",
    "merge": "those that touch become one",
    "use": "they get another use and keep their shape",
}


class ResplitLayout(Tool):
    """Makes chosen parcels of a layout anew; nothing else changes."""

    about = About(
        name="resplitlayout",
        title="Redo part of a layout",
        group="parcels",
        tags=(
            "parcels", "lots", "redo", "resubdivide", "re-split", "merge parcels", "land use",
            "layout", "streets", "variant", "site planning", "platwright",
        ),
        summary="Makes the parcels that you choose anew, with or without the streets between "
        "them, merges them or gives them another use; everything else stays to the last bit.",
        paragraphs=(
            "Choose parcels by a condition, by an area that covers more than half of each, or by "
            "both. To use a selection of the map, take the layer of parcels itself as the area "
            "and tick 'Selected features only' there, not at the parcels.",
            "New parcels have access where the chosen land lies along streets of the layer, along "
            "lanes, and along the edge of the site: everywhere, or where existing roads run if "
            "these are given. Edges beside parcels that stay give none. Lanes that parcels need "
            "which stay are left alone.",
            "All features that are not chosen keep their geometry and their values. New ones get "
            "numbers above the others; the field change tells them apart. Another seed, another "
            "size of parcels or another method gives another result.",
        ),
        picture="Parcels in the middle of a layout, and the streets between them, made anew.",
        references=("UP",),
    )  # fmt: skip
    layers: ClassVar = {
        "PARCELS": parcel_fields.REDONE_PARCELS,
        "STREETS": parcel_fields.REDONE_STREETS,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "CHOSEN": "Number of features that were chosen",
        "MADE": "Number of features that are new",
        "KEPT": "Number of features that stay as they are",
    }
    needs = deps.LAYERS

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the layout, what of it is chosen, and what becomes of that."""
        yield parameters.layer(
            "INPUT",
            "Parcels",
            "All parcels, greens and other land of a layout, such as those of Streets and parcels "
            "or of Parcels in blocks; the field land_use tells lanes from land.",
            "polygon",
        )
        yield _where()
        yield parameters.layer(
            "AREA",
            "Area to redo",
            "Polygons that choose the parcels of which they cover more than half.",
            "polygon",
            optional=True,
        )
        yield parameters.layer(
            "INPUT_STREETS",
            "Streets",
            "Centre lines of the streets of the layout. Without them every edge of the chosen land "
            "that is not beside another parcel counts as lying along a street.",
            "line",
            optional=True,
        )
        yield parameters.choice(
            "ACTION", "What to do", "What becomes of the parcels.", ACTIONS, default="parcels"
        )
        yield _use()
        yield from splitinputs.sizes(wide=False)
        yield from _around()
        yield from parcelinputs.sizes()
        yield from splitinputs.deep()
        yield from splitinputs.streets()

    def check(self, request: Request) -> None:
        """Check that something is chosen, and numbers that must fit together."""
        _asked(request)
        if getattr(request.parameters.get("INPUT"), "selectedFeaturesOnly", False):
            raise InputError(
                "Of the parcels only those that are selected would be left.",
                "Switch off 'Selected features only' at the parcels; take the same layer as the "
                "area to redo, and switch it on there.",
            )
        if not request.has("WHERE") and not request.has("AREA"):
            raise InputError(
                "Nothing says which parcels to make anew.",
                "Give a condition or an area; the parcels with 'Selected features only' will do "
                "as an area.",
            )
        if request.word("ACTION") == "streets" and not request.has("INPUT_STREETS"):
            raise InputError(
                "Streets are to be laid anew, but no layer of streets is given.",
                "Choose the streets of the layout.",
            )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layout, choose, and make the chosen part anew."""
        from ...algorithms.parcels.split.redo import Around, redo_parcels
        from ...algorithms.parcels.streetspace import StreetWidths

        frames = {
            key: request.frame(key, progress.part(0.03 * at, 0.03 * (at + 1)))
            for at, key in enumerate(("INPUT", "AREA", "INPUT_STREETS", "SITE", "ROADS"))
        }
        chosen = _chosen(request, frames)
        progress.info(f"{len(chosen)} of {len(frames['INPUT'])} features are chosen.")
        done = redo_parcels(
            frames["INPUT"],
            chosen,
            _asked(request),
            Around(
                streets=frames["INPUT_STREETS"],
                site=frames["SITE"],
                roads=frames["ROADS"],
                widths=StreetWidths(local=request.number("STREET_WIDTH")),
                snap_distance=request.number("SNAP_DISTANCE"),
                parcel_layer=request.name("INPUT"),
                street_layer=request.name("INPUT_STREETS"),
                site_layer=request.name("SITE"),
                road_layer=request.name("ROADS"),
            ),
            progress=progress.part(0.15, 0.95),
        )
        return Result(
            crs=request.crs("INPUT"),
            layers={
                "PARCELS": done.parcels,
                "STREETS": _streets(done, frames),
                "PROBLEMS": done.problems,
            },
            numbers={
                "CHOSEN": done.chosen,
                "MADE": done.made,
                "KEPT": len(done.parcels) - done.made,
            },
            specification=to_json(_record(request)),
        )


def _where() -> QgsProcessingParameterDefinition:
    """Declare the condition."""
    definition = QgsProcessingParameterExpression(
        "WHERE", "Parcels to redo", defaultValue=None, parentLayerParameterName="INPUT",
        optional=True,
    )  # fmt: skip
    definition.setHelp(
        "A condition that parcels meet, such as block_id = 7, undesirable, or "
        "parcel_id in (12, 13). Optional."
    )
    return definition


def _use() -> QgsProcessingParameterDefinition:
    """Declare the use that is assigned."""
    definition = QgsProcessingParameterString("USE", "Use", defaultValue=None, optional=True)
    definition.setHelp(
        "What parcels become where a use is assigned: park, school, commercial, parcel or any "
        "other word. Merged ones get it, too; empty: that of most of them. Optional."
    )
    return definition


def _around() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what tells where the edge of the site has access."""
    yield parameters.layer(
        "SITE",
        "Site",
        "Site polygons. Empty: what the parcels cover.",
        "polygon",
        optional=True,
        advanced=True,
    )
    yield parameters.layer(
        "ROADS",
        "Existing roads",
        "Roads around the site. Without them its whole outer edge counts as a street.",
        "line",
        optional=True,
        advanced=True,
    )
    yield next(siteinputs.snapping(advanced=True))


def _asked(request: Request) -> Any:
    """Return what is to become of the chosen parcels."""
    from ...algorithms.parcels.split.redo import Asked

    return Asked(
        action=request.word("ACTION"),
        rules=splitinputs.rules_of(request),
        split=splitinputs.split_of(request),
        use=request.field("USE").strip(),
        seed=request.integer("SEED"),
    )


def _record(request: Request) -> dict[str, Any]:
    """Return what was asked, for the metadata of the layers."""
    asked = _asked(request)
    return {
        "action": asked.action,
        "where": request.field("WHERE"),
        "use": asked.use,
        "seed": asked.seed,
        "parcels": dataclasses.asdict(asked.rules),
        "streets": dataclasses.asdict(dataclasses.replace(asked.split, templates=None)),
    }


def _chosen(request: Request, frames: dict[str, Any]) -> list[int]:
    """Return the ids of the features that the condition or the area chooses."""
    from ...algorithms.parcels.split.redo import covered

    found = _meeting(request) if request.has("WHERE") else []
    if frames["AREA"] is not None:
        names = {"parcel_layer": request.name("INPUT"), "area_layer": request.name("AREA")}
        found += covered(frames["INPUT"], frames["AREA"], **names)
    return list(dict.fromkeys(found))


def _meeting(request: Request) -> list[int]:
    """Return the ids of the features that meet the condition."""
    source = request.source("INPUT")
    text = request.field("WHERE")
    expression = QgsExpression(text)
    context = QgsExpressionContext(request.context.expressionContext())
    context.appendScope(source.createExpressionContextScope())
    context.setFields(source.fields())
    remedy = "Correct the condition; the fields of the layer are in the expression builder."
    if expression.hasParserError() or not expression.prepare(context):
        problem = expression.parserErrorString() or expression.evalErrorString()
        raise InputError(f"'{text}' is no condition ({problem.strip()}).", remedy)
    own = {name.lower() for name in source.fields().names()}
    missing = [name for name in expression.referencedColumns() if name.lower() not in own]
    missing = [name for name in missing if not name.startswith("#!")]
    if missing:
        raise InputError(
            f"The condition '{text}' names a field that is not there: {missing[0]}.",
            remedy,
            layer=request.name("INPUT"),
        )
    found = []
    for feature in source.getFeatures():
        context.setFeature(feature)
        if expression.evaluate(context):
            found.append(feature.id())
        if expression.hasEvalError():
            raise InputError(
                f"'{text}' cannot be evaluated ({expression.evalErrorString()}).",
                remedy,
                layer=request.name("INPUT"),
                feature=feature.id(),
            )
    return found


def _streets(done: Any, frames: dict[str, Any]) -> Any:
    """Return the layer of streets, an empty one where none was given."""
    if done.streets is not None:
        return done.streets
    return frames["INPUT"].iloc[:0][["geometry"]].assign(change=None)
