"""Streets, designed or real: length, junctions, direction, hierarchy, how central they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import deps, fields, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..street_fields import MEASURED_JUNCTIONS, MEASURED_STREETS, NATURAL_STREETS
from ..tool import Tool


class MeasureStreets(Tool):
    """Measures the streets of any layer."""

    about = About(
        name="measurestreets",
        title="Measure streets",
        group="measure",
        tags=(
            "streets", "roads", "network", "junctions", "intersections", "dead ends", "centrality",
            "betweenness", "closeness", "orientation", "entropy", "natural streets", "circuity",
            "density", "hierarchy", "osmnx", "momepy", "platwright",
        ),
        summary="Measures streets, designed or real: length, direction, junctions, blocks, natural "
        "streets and their hierarchy, circuity, betweenness and closeness; as fields, layers and "
        "numbers.",
        paragraphs=(
            "Lines are one network where they meet at their ends, at shared vertices, or where the "
            "end of one touches another. Where they cross otherwise there is no junction, as on a "
            "bridge; the layer of problems lists these places. A segment is a street between "
            "junctions or dead ends, however many lines it is drawn with. Junctions are counted as "
            "drawn: where two streets of two carriageways cross there are four.",
            "Natural streets go on at each node in the piece that turns least, as a walker would "
            "say. Their classes are head/tail breaks of the number of others that they meet, and "
            "livability is their number times the number of classes.",
            "With a site the numbers are those of what lies in it; without one their ground is "
            "what the triangles between near junctions cover: the convex hull of a quarter, and of "
            "a region the built-up parts. Fields are measured in the whole layer in any case, so "
            "give a layer that reaches beyond the site: at the edge of the layer betweenness and "
            "closeness are too low.",
            "A feature that runs through several junctions has the betweenness of its busiest "
            "part and the mean closeness by length. Every street may be used both ways.",
        ),
        picture="Streets by their betweenness: what would run through each if everybody went to "
        "everybody.",
        references=("ORDER", "NATURAL", "LIVING", "BRANDES", "CS", "OSMNX"),
    )  # fmt: skip
    layers: ClassVar = {
        "OUTPUT": MEASURED_STREETS,
        "NATURAL_STREETS": NATURAL_STREETS,
        "JUNCTIONS": MEASURED_JUNCTIONS,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "AREA_KM2": "Area of the ground (square kilometres): the site or, without one, the "
        "triangles between near junctions",
        "LENGTH_KM": "Length of the streets (km)",
        "STREET_KM_KM2": "Length of streets, km per square kilometre",
        "SEGMENTS": "Number of segments, streets between junctions or dead ends",
        "SEGMENT_MEAN": "Mean length of segments (m)",
        "INTERSECTIONS": "Places where three or more streets meet",
        "INTERSECTIONS_KM2": "The same per square kilometre",
        "THREE_WAY": "Of these, those of three streets",
        "FOUR_WAY": "Those of four streets",
        "FIVE_WAY": "Those of five or more streets",
        "T_PCT": "Share of T-junctions among intersections (%)",
        "Y_PCT": "Share of forks, three streets none of which goes straight on (%)",
        "X_PCT": "Share of crossings, four streets that all go straight on (%)",
        "DEAD_ENDS": "Blind ends of streets; with a site those farther than 10 m from its edge",
        "DEAD_ENDS_KM2": "The same per square kilometre",
        "DEAD_ENDS_PCT": "Share of dead ends among intersections and dead ends (%)",
        "BLOCKS": "Number of blocks: faces of at least 50 m2, somewhere 10 m wide",
        "BLOCK_MEAN_HA": "Mean area of blocks, to the middle of streets (ha)",
        "BLOCK_MEDIAN_HA": "Median area of blocks (ha)",
        "BLOCK_MAX_HA": "Area of the largest block (ha)",
        "ENTROPY": "Entropy of the directions of segments: 1.386 for a grid, 3.584 for all alike",
        "ORDER": "Order of the directions: 1 for a grid, 0 for all directions alike",
        "ENTROPY_LENGTH": "Entropy of the directions, segments weighted by their length",
        "ORDER_LENGTH": "Order of the directions, segments weighted by their length",
        "SINUOSITY": "Length of segments / straight distance of their ends",
        "CIRCUITY": "Mean of the distance along streets / straight distance between junctions",
        "ROADS_PCT": "Share of the ground that street space takes up (%)",
        "NATURAL_COUNT": "Number of natural streets",
        "NATURAL_MAX": "Length of the longest natural street (m)",
        "HT_INDEX": "Classes of the hierarchy of natural streets (ht-index)",
        "LIVABILITY": "Number of natural streets x classes of their hierarchy",
        "BETWEENNESS_MEAN": "Mean betweenness of junctions and dead ends, 0 to 1",
        "BETWEENNESS_MAX": "Largest betweenness of a junction, 0 to 1",
        "CLOSENESS_MEAN": "Mean closeness of junctions and dead ends (per km)",
        "COMPONENTS": "Number of connected parts",
        "LARGEST_PCT": "Share of the length in the longest connected part (%)",
        "MESHEDNESS": "Loops, as a share of those that are possible (alpha index), 0 to 1",
        "BETA": "Segments per junction or dead end (beta index)",
        "GAMMA": "Segments, as a share of those that are possible (gamma index), 0 to 1",
        "CROSSINGS": "Places where streets cross without a junction",
    }
    needs = (*deps.LAYERS, "networkx")

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the streets and how they are measured."""
        yield parameters.layer(
            "INPUT",
            "Streets",
            "Centre lines. All features and fields are kept.",
            "line",
        )
        yield parameters.layer(
            "SITE",
            "Site",
            "Polygons; streets outside are measured, but the numbers do not count them.",
            "polygon",
            optional=True,
        )
        yield from _widths()
        yield parameters.number(
            "MAX_TURN",
            "Greatest turn of a natural street",
            "Streets that turn by more at a node end there.",
            unit="degrees",
            default=45.0,
            minimum=0.0,
            maximum=180.0,
            advanced=True,
        )
        yield from _centrality()

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layers and measure."""
        from ...algorithms.measure.streets import StreetOptions, measure_streets

        frames = {
            key: request.frame(key, progress.part(0.1 * at, 0.1 * (at + 1)))
            for at, key in enumerate(("INPUT", "SITE"))
        }
        asked: dict[str, Any] = {
            "max_turn": request.number("MAX_TURN"),
            "width_field": request.field("WIDTH_FIELD"),
            "width": request.optional_number("WIDTH"),
            "centrality": request.flag("CENTRALITY"),
            "exact": request.integer("EXACT"),
            "sources": request.integer("SOURCES"),
            "seed": request.integer("SEED"),
        }
        report = measure_streets(
            frames["INPUT"],
            site=frames["SITE"],
            options=StreetOptions(**asked),
            street_layer=request.name("INPUT"),
            site_layer=request.name("SITE"),
            progress=progress.part(0.2, 1.0),
        )
        _tell(report, asked, progress)
        return Result(
            crs=request.crs("INPUT"),
            layers={
                "OUTPUT": report.streets,
                "NATURAL_STREETS": report.natural,
                "JUNCTIONS": report.nodes,
                "PROBLEMS": report.problems,
            },
            numbers={key: report.figures.as_dict()[key.lower()] for key in self.numbers},
            specification=to_json(asked),
        )


def _widths() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how wide streets are."""
    yield parameters.field(
        "WIDTH_FIELD",
        "Field with the width",
        "Width of each street between property lines in metres, for the share of street space. "
        "Empty: width_m, where there is one.",
        "INPUT",
    )
    yield parameters.number(
        "WIDTH",
        "Width of streets without one",
        "For the share of street space.",
        unit="m",
        minimum=0.1,
        maximum=200.0,
        advanced=True,
        unset="20, 16, 12 or 10 m by the field level, else 12 m",
    )


def _centrality() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how centrality is measured."""
    yield parameters.flag(
        "CENTRALITY",
        "Measure betweenness and closeness",
        "Takes most of the time for large layers.",
        default=True,
        advanced=True,
    )
    yield parameters.number(
        "EXACT",
        "Exact up to",
        "Networks of up to so many junctions and dead ends are measured from every one of them. "
        "The time grows with the square of their number.",
        default=5000,
        minimum=0,
        maximum=100_000,
        integer=True,
        advanced=True,
    )
    yield parameters.number(
        "SOURCES",
        "Sample of larger networks",
        "Betweenness and closeness of larger networks are estimated from the ways from so many "
        "junctions and dead ends of each connected part.",
        default=250,
        minimum=10,
        maximum=100_000,
        integer=True,
        advanced=True,
    )
    yield parameters.number(
        "SEED",
        "Seed",
        "Of the sample; the same seed draws the same one.",
        default=0,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
        advanced=True,
    )


def _tell(report: Any, asked: dict[str, Any], progress: FeedbackProgress) -> None:
    """Say in the log what a planner should know."""
    if asked["centrality"] and report.sources < report.connected:
        progress.info(
            f"Betweenness and closeness are estimated from {report.sources} of "
            f"{report.connected} junctions and dead ends."
        )
    if len(report.problems):
        progress.warn(f"The layer of problems has {len(report.problems)}, each with its place.")
