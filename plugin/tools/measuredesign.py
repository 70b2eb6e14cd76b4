"""The figures of one design as one row of a table, to be set beside those of another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterString,
)

from .. import deps, fields, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import siteinputs


class MeasureDesign(Tool):
    """Measures a street layer on a site and writes one row of figures."""

    about = About(
        name="measuredesign",
        title="Measure design",
        group="measure",
        tags=("figures", "indicators", "table", "compare", "streets", "blocks", "platwright"),
        summary="Measures streets on a site: how much street, how far out, what blocks, what "
        "rules are broken; one row of a table.",
        paragraphs=(
            "The streets may come from Design streets, be drawn by hand or be surveyed; only "
            "their geometry and the field status count. The blocks are cut out of the site "
            "along the streets, so that every street layer is measured in the same way. Broken "
            "rules are those that Validate street network finds with its defaults.",
            "Run it in batch over several designs, or use the model Compare two designs.",
        ),
    )
    layers: ClassVar = {"FIGURES": fields.FIGURES}
    numbers: ClassVar = {
        field.name.upper(): f"{field.text[0].upper()}{field.text[1:]}"
        for field in fields.FIGURES.fields
        if field.kind != "text"
    }
    needs = (*deps.LAYERS, "networkx")

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the streets, what lies around them, and the name of the row."""
        yield parameters.layer(
            "INPUT",
            "Streets",
            "Lines that meet at their ends. With the field status (existing, connector or new) "
            "the new streets are told from those that are there.",
            "line",
        )
        yield parameters.layer(
            "SITE", "Site", "Polygons on which the streets were designed.", "polygon"
        )
        yield parameters.layer(
            "BOUNDARY_STREETS",
            "Boundary streets",
            "Existing streets along the edge of the site, where they are not in the streets.",
            "line",
            optional=True,
        )
        yield parameters.layer(
            "ACCESS_POINTS",
            "Access points",
            "Where existing streets arrive, as from Prepare site: it is counted how many of them "
            "the design continues.",
            "point",
            optional=True,
        )
        yield siteinputs.obstacles()
        yield parameters.number(
            "BLOCK_WIDTH",
            "Asked block width",
            "Blocks are wide enough or too thin as compared with this.",
            unit="m",
            default=72.0,
            minimum=10.0,
            maximum=2000.0,
        )
        name = QgsProcessingParameterString("NAME", "Name of the design", "", False, True)
        name.setHelp("Stands in the row. Empty: the name of the layer of streets. Optional.")
        yield name

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layers, measure and check."""
        from ...algorithms.measure import measure_plan, validate_network

        keys = ("INPUT", "SITE", "BOUNDARY_STREETS", "ACCESS_POINTS", "OBSTACLES")
        frames = {
            key: request.frame(key, progress.part(0.1 * at, 0.1 * (at + 1)))
            for at, key in enumerate(keys)
        }
        block_width = request.number("BLOCK_WIDTH")
        progress.stage("Measuring the design", 0.5)
        plan = measure_plan(
            frames["INPUT"],
            frames["SITE"],
            block_width=block_width,
            access_points=frames["ACCESS_POINTS"],
            obstacles=frames["OBSTACLES"],
        )
        progress.stage("Checking the streets", 0.7)
        report = validate_network(
            frames["INPUT"],
            site=frames["SITE"],
            obstacles=frames["OBSTACLES"],
            boundary_streets=frames["BOUNDARY_STREETS"],
            edge_length=block_width,
            street_layer=request.name("INPUT"),
        )
        name = self.parameterAsString(request.parameters, "NAME", request.context)
        row = {"design": name or request.name("INPUT"), **figures(plan, report)}
        return Result(
            crs=QgsCoordinateReferenceSystem(),
            layers={"FIGURES": _table(row, frames["INPUT"])},
            numbers={key: row[key.lower()] for key in self.numbers},
            specification=to_json({"block_width": block_width}),
        )


def figures(plan: Any, report: Any) -> dict[str, float]:
    """Return the figures of a `PlanMetrics` and a `ValidationReport` by the names of the fields."""
    return {
        "site_area_ha": plan.area,
        "length_m": plan.length,
        "density_mha": plan.length_per_hectare,
        "mean_way_m": report.numbers["MEAN_DISTANCE"],
        "longest_way_m": report.numbers["MAX_DISTANCE"],
        "continued": plan.continued,
        "arriving": plan.arriving,
        "bends": plan.bends,
        "t_junctions": plan.t_junctions,
        "crossings": plan.crossings,
        "blocks": plan.blocks,
        "block_area_ha": plan.block_area,
        "block_width_m": plan.block_width,
        "block_length_m": plan.block_length,
        "wide_enough_pct": 100.0 * plan.share_wide_enough,
        "too_thin_pct": 100.0 * plan.share_too_thin,
        "rectangular_pct": 100.0 * plan.rectangularity,
        "violations": report.violations,
        "warnings": int((report.problems["severity"] == "warning").sum()),
    }


def _table(row: dict[str, Any], streets: Any) -> Any:
    """Return a row as a frame, without a place."""
    return type(streets)([row], geometry=[None], crs=streets.crs)
