"""What land is used for, how large blocks are, how much street there is: figures to compare."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import deps, fields, parameters
from ..help import About
from ..outputs import Result
from ..parcel_fields import LAND_USE
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool


class MeasureLandUse(Tool):
    """Measures shares of land use, blocks and streets of a layout."""

    about = About(
        name="measurelanduse",
        title="Measure land use",
        group="measure",
        tags=(
            "land use", "shares", "blocks", "density", "intersections", "dead ends", "parcels",
            "streets", "statistics", "platwright",
        ),
        summary="Measures what the land of a layout is used for: shares of streets, parcels, parks "
        "and the rest; blocks, street length, junctions and parcels per square kilometre.",
        paragraphs=(
            "The measures are those of Urban Pattern, section 7. Ground that no polygon covers is "
            "street space, so that a cadastre without streets can be measured. Where polygons "
            "overlap, ground counts once, as street before park, other use and parcel, and the "
            "layer of problems says so.",
            "The use is read from words: parcel, lot, residential, house, apartments...; park, "
            "green, court, garden, playground...; street, road, lane, path, square...; anything "
            "else is other, and words that are not known are listed among the problems.",
            "Blocks are the land between streets: polygons that are no street, joined where less "
            "than 1 m is between them, of at least 50 m2 and somewhere 10 m wide.",
        ),
        references=("UP",),
    )  # fmt: skip
    layers: ClassVar = {"OUTPUT": LAND_USE, "PROBLEMS": fields.PROBLEMS}
    numbers: ClassVar = {
        "GROUND_HA": "Area of the ground (ha): the site or, without one, the polygons with the "
        "gaps between them up to 40 m",
        "STREETS_PCT": "Share of streets (%)",
        "PARCELS_PCT": "Share of parcels (%)",
        "PARKS_PCT": "Share of parks (%)",
        "OTHER_PCT": "Share of other uses (%)",
        "BLOCKS": "Number of blocks",
        "BLOCKS_KM2": "Blocks per square kilometre",
        "BLOCK_MAX": "Longest boundary of a block (m)",
        "BLOCK_MEAN": "Mean boundary of the blocks (m)",
        "BLOCK_MIN": "Shortest boundary of a block (m)",
        "STREET_KM_KM2": "Length of streets, km per square kilometre (empty without streets)",
        "INTERSECTIONS": "Places where three or more streets meet (empty without streets)",
        "INTERSECTIONS_KM2": "The same per square kilometre",
        "DEAD_ENDS": "Ends of streets farther than 10 m from the edge of the ground",
        "DEAD_ENDS_KM2": "The same per square kilometre",
        "PARCELS": "Number of parcels",
        "PARCELS_KM2": "Parcels per square kilometre",
    }
    needs = (*deps.LAYERS, "networkx")

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the land and what divides it."""
        yield parameters.layer(
            "INPUT",
            "Land use",
            "Polygons of parcels, parks and whatever else there is, streets among them or not.",
            "polygon",
        )
        yield parameters.field(
            "USE_FIELD",
            "Field with the use",
            "Words for what each polygon is. Empty: land_use, use, label, landuse or theme, the "
            "first that has a word for a use; without one all are parcels.",
            "INPUT",
            numeric=False,
            advanced=False,
        )
        yield parameters.layer(
            "STREETS",
            "Streets",
            "Centre lines that meet at their ends or at shared vertices, for the length of "
            "streets, junctions and dead ends.",
            "line",
            optional=True,
        )
        yield parameters.layer(
            "BLOCKS",
            "Blocks",
            "Polygons. Empty: the land between streets.",
            "polygon",
            optional=True,
        )
        yield parameters.layer(
            "SITE",
            "Site",
            "Polygons; what lies outside does not count. Empty: the polygons with the gaps "
            "between them up to 40 m.",
            "polygon",
            optional=True,
        )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layers and measure."""
        from ...algorithms.measure import measure_land_use

        keys = ("INPUT", "STREETS", "BLOCKS", "SITE")
        frames = {
            key: request.frame(key, progress.part(0.1 * at, 0.1 * (at + 1)))
            for at, key in enumerate(keys)
        }
        report = measure_land_use(
            frames["INPUT"],
            streets=frames["STREETS"],
            blocks=frames["BLOCKS"],
            site=frames["SITE"],
            field=request.field("USE_FIELD"),
            land_layer=request.name("INPUT"),
            street_layer=request.name("STREETS"),
            block_layer=request.name("BLOCKS"),
            site_layer=request.name("SITE"),
            progress=progress.part(0.4, 1.0),
        )
        what = (
            f"The field {report.use_field} tells the use."
            if report.use_field
            else ("No field tells the use: all polygons count as parcels.")
        )
        progress.info(what)
        if len(report.problems):
            count = len(report.problems)
            entries = "1 entry" if count == 1 else f"{count} entries"
            progress.warn(f"The layer of problems has {entries}.")
        return Result(
            crs=request.crs("INPUT"),
            layers={"OUTPUT": report.table, "PROBLEMS": report.problems},
            numbers={key: report.figures.as_dict()[key.lower()] for key in self.numbers},
            specification=to_json({"field": report.use_field}),
        )
