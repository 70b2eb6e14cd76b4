"""The quality of parcels, designed or surveyed: as fields, as numbers, as a histogram."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import fields, parameters
from ..files import FileKind
from ..help import About
from ..outputs import Result
from ..parcel_fields import MEASURED_PARCELS, PARCEL_HISTOGRAM
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool

#: Outlines look surveyed where p_angle falls under this share once they are simplified by 1 m.
ROUGH = 0.8
#: Simplified by so much, surveyed outlines are what they should be (metres).
ENOUGH = 0.5


class MeasureParcels(Tool):
    """Measures the shape, the size and the street access of parcels."""

    about = About(
        name="measureparcels",
        title="Measure parcels",
        group="measure",
        tags=(
            "parcels", "lots", "plots", "quality", "frontage", "access", "shape", "area", "angle",
            "histogram", "cadastre", "platwright",
        ),
        summary="Measures parcels, designed or real: corners, shape, size, frontage, depth, street "
        "access; as fields, numbers, a map from blue to red and a histogram.",
        paragraphs=(
            "The measures are those of Urban Pattern, section 7, and are computed in the same way "
            "for parcels of any origin. p_angle is how far corners are from right angles on "
            "average (a corner is where the outline turns by more than 20 degrees), p_area how "
            "much larger the smallest rectangle around a parcel is, p_ideal how many times it is "
            "larger or smaller than the ideal parcel, and p_similarity how far its outline is from "
            "that, laid over it and scaled, on average. A parcel is undesirable where p_angle is "
            "over 15 degrees or p_area over 1.2.",
            "Without streets, outlines that no other polygon of the layer shares lie along a "
            "street. Where a field tells the use (land_use, use, label, landuse or theme), streets "
            "and parks are no parcels: they get an area only and do not count, and edges along "
            "streets are frontage.",
            "Surveyed and digitised parcels have small jogs, each of which counts as two corners: "
            "give 1 m as the tolerance for them, and the same for a design that is held against "
            "them, or the comparison flatters the design.",
        ),
        references=("UP",),
    )  # fmt: skip
    layers: ClassVar = {
        "OUTPUT": MEASURED_PARCELS,
        "HISTOGRAM": PARCEL_HISTOGRAM,
        "PROBLEMS": fields.PROBLEMS,
    }
    files: ClassVar = {
        "HISTOGRAM_HTML": FileKind(
            "Histogram page", "html", "Page with the figures and the histograms as drawings."
        ),
    }
    numbers: ClassVar = {
        "COUNT": "Number of parcels",
        "PER_KM2": "Parcels per square kilometre of ground",
        "GROUND_HA": "Area of the ground (ha): the site or, without one, the polygons with the "
        "gaps between them up to 40 m",
        "MEAN_AREA": "Mean area (m2)",
        "MEDIAN_AREA": "Median area (m2)",
        "CV_AREA": "Standard deviation of the areas / mean area",
        "MEAN_FRONTAGE": "Mean frontage (m)",
        "MEAN_WIDTH": "Mean width (m)",
        "MEAN_DEPTH": "Mean depth (m)",
        "P_ANGLE": "Mean deviation of corners from 90 degrees (degrees)",
        "P_AREA": "Mean of smallest rectangle / area",
        "P_IDEAL": "Mean of the area against the ideal one, the larger / the smaller",
        "P_SIMILARITY": "Mean distance from the ideal parcel (m)",
        "UNDESIRABLE": "Number of undesirable parcels",
        "UNDESIRABLE_PCT": "Share of undesirable parcels (%)",
        "NO_ACCESS": "Number of parcels with less than 3 m along a street",
        "ACCESS_PCT": "Share of parcels with access to a street (%)",
        "FRONTAGE_PCT": "Share of all outlines that lies along streets (%)",
    }

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the parcels, what lies around them, and what they are held against."""
        yield parameters.layer(
            "INPUT",
            "Parcels",
            "Polygons; of several parts the largest tells the shape. All features and fields are "
            "kept.",
            "polygon",
        )
        yield parameters.layer(
            "STREETS",
            "Streets",
            "Centre lines or polygons of streets. A parcel has frontage where no other polygon "
            "lies between it and a street within the distance below. Empty: outlines that no "
            "other polygon shares lie along streets.",
            ("line", "polygon"),
            optional=True,
        )
        yield parameters.layer(
            "SITE",
            "Site",
            "Polygons; parcels outside are measured, but the numbers do not count them.",
            "polygon",
            optional=True,
        )
        yield from _ideal()
        yield parameters.number(
            "STREET_DISTANCE",
            "Distance of streets",
            "Parcels have frontage on streets that are no farther than this: half the width of "
            "the widest street where streets are centre lines.",
            unit="m",
            default=15.0,
            minimum=0.1,
            maximum=100.0,
            advanced=True,
        )
        yield parameters.field(
            "USE_FIELD",
            "Field with the use",
            "Tells parcels from streets and parks. Empty: land_use, use, label, landuse or theme, "
            "the first that has a word for a use; without one all are parcels.",
            "INPUT",
            numeric=False,
        )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layers, measure, and write the page."""
        from ...algorithms.measure import Ideal, measure_parcels
        from ...algorithms.measure.histogram import histogram_rows
        from ...algorithms.measure.histogram_page import histogram_page

        frames = {
            key: request.frame(key, progress.part(0.1 * at, 0.1 * (at + 1)))
            for at, key in enumerate(("INPUT", "STREETS", "SITE"))
        }
        ideal = Ideal(
            request.number("PARCEL_WIDTH"),
            request.number("PARCEL_DEPTH"),
            request.number("SIMPLIFY"),
        )
        asked = {"reach": request.number("STREET_DISTANCE"), "field": request.field("USE_FIELD")}
        report = measure_parcels(
            frames["INPUT"],
            streets=frames["STREETS"],
            site=frames["SITE"],
            ideal=ideal,
            **asked,
            parcel_layer=request.name("INPUT"),
            street_layer=request.name("STREETS"),
            site_layer=request.name("SITE"),
            progress=progress.part(0.3, 0.95),
        )
        _tell(report, ideal, progress)
        table = type(frames["INPUT"])(
            histogram_rows(report.histograms),
            geometry=[None] * sum(len(one.counts) for one in report.histograms),
            crs=frames["INPUT"].crs,
        )
        numbers = {key: report.figures.as_dict()[key.lower()] for key in self.numbers}
        said = [(text, _plain(numbers[key])) for key, text in self.numbers.items()]
        title = f"Parcels of {request.name('INPUT')}"
        return Result(
            crs=request.crs("INPUT"),
            layers={"OUTPUT": report.parcels, "HISTOGRAM": table, "PROBLEMS": report.problems},
            numbers=numbers,
            specification=to_json(
                {
                    "width": ideal.width,
                    "depth": ideal.depth,
                    "tolerance": ideal.tolerance,
                    **asked,
                }
            ),
            files={"HISTOGRAM_HTML": histogram_page(title, said, report.histograms)},
        )


def _ideal() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what parcels are held against."""
    for key, text, size in (
        ("PARCEL_WIDTH", "Width of the ideal parcel", 18.0),
        ("PARCEL_DEPTH", "Depth of the ideal parcel", 30.0),
    ):
        yield parameters.number(
            key,
            text,
            "What p_ideal and p_similarity are measured against.",
            unit="m",
            default=size,
            minimum=1.0,
            maximum=1000.0,
        )
    yield parameters.number(
        "SIMPLIFY",
        "Tolerance of outlines",
        "Outlines are simplified by this before corners are looked at: 0.05 m for designs, "
        "1 m for surveyed and digitised parcels. The output keeps its outlines.",
        unit="m",
        default=0.05,
        minimum=0.0,
        maximum=10.0,
    )


def _plain(value: float) -> str:
    """Return a number for a page; a dash where there is none."""
    return "-" if value != value else f"{value:,.6g}"


def _tell(report: Any, ideal: Any, progress: FeedbackProgress) -> None:
    """Say in the log what a planner should know."""
    if report.use_field:
        progress.info(f"The field {report.use_field} tells what is a parcel.")
    found, coarse = report.figures.p_angle, report.p_angle_surveyed
    if ideal.tolerance < ENOUGH and coarse < ROUGH * found:
        progress.warn(
            f"The outlines look surveyed or digitised: with a tolerance of 1 m p_angle is "
            f"{coarse:.1f} degrees instead of {found:.1f}. Take 1 m before you compare them with "
            "a design."
        )
    if len(report.problems):
        count = len(report.problems)
        entries = "1 entry" if count == 1 else f"{count} entries"
        progress.warn(f"The layer of problems has {entries}.")
