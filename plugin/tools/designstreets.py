"""An integer program designs the streets of a real site."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import deps, fields, parameters, presets
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..request import Request
from ..tool import Tool
from . import drawnstreets, functions, persite, rules, siteinputs
from .collect import joined
from .designcheck import check_design
from .validatenetwork import describe

#: Layers that name places on top of the site.
LINES_AND_PLACES = ("SINKS", "REQUIRED", "FORBIDDEN", "START", "GIVEN")


class DesignStreets(Tool):
    """Designs collectors and local streets for every site of a layer."""

    about = About(
        name="designstreets",
        title="Design streets",
        group="streets",
        tags=(
            "street network",
            "road",
            "blocks",
            "layout",
            "optimisation",
            "optimization",
            "integer programming",
            "site planning",
            "subdivision",
            "platwright",
        ),
        summary=(
            "Designs the streets of a site: give a block width and a block length, and an "
            "integer program chooses the streets."
        ),
        paragraphs=(
            "A raw site polygon and a raw layer of roads will do; layers that went through "
            "Prepare site work as well. Roads along the edge of the site are existing streets, "
            "and the new streets run to their centre lines and continue existing ones where "
            "they can. Every site of the layer is designed; the field site_id tells them apart.",
            "The search first finds a design and then makes it better until the time limit. The "
            "log tells the price of the best design, the proven bound and the gap between them. "
            "The bound is proven for each program (the collectors, then the local streets block "
            "by block), given the mesh and the streets above it, and summed: other collectors or "
            "another mesh may give a better whole. Cancel keeps the best design so far.",
            "The kind of neighbourhood says what a block width and a block length that are left "
            "empty are; numbers that are given always count, and the log tells which were used. "
            "Where the sites of the layer have a block size of their own, take it from a field "
            "by the button beside the number.",
            "The method is that of Peng and others (2016), with the further rules that the option "
            "Rules names.",
        ),
        picture="New streets (red collectors, orange local streets) and blocks by their width.",
        references=("CND",),
    )
    layers: ClassVar = {
        "STREETS": fields.STREETS,
        "JUNCTIONS": fields.JUNCTIONS,
        "BLOCKS": fields.BLOCKS,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "TOTAL_LENGTH": "Length of the new streets (m)",
        "MEAN_DISTANCE": "Mean way out of the site (m)",
        "MAX_DISTANCE": "Longest way out of the site (m)",
        "OBJECTIVE": "Price of the design",
        "BOUND": "Lower bound of the price, proven program by program",
        "ACHIEVED_GAP": "Gap between that price and that bound (share of the price)",
        "SECONDS": "Time of the design (s)",
        "VIOLATIONS": "Broken rules (empty where the check was cancelled)",
    }
    needs = (*deps.LAYERS, *deps.SOLVERS)

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the eight basic parameters, then the advanced ones."""
        yield siteinputs.site()
        yield siteinputs.roads()
        yield siteinputs.obstacles()
        yield from rules.block_size()
        yield rules.sink_mode()
        yield functions.traffic()
        yield rules.sinks()
        yield siteinputs.access_points()
        yield parameters.layer(
            "REQUIRED",
            "Required streets",
            "Lines along which a street must run.",
            "line",
            optional=True,
            advanced=True,
        )
        yield parameters.layer(
            "FORBIDDEN",
            "Forbidden places",
            "Lines or polygons that no street may cross or follow.",
            ("line", "polygon"),
            optional=True,
            advanced=True,
        )
        yield parameters.layer(
            "MESH_EDGES",
            "Candidate mesh",
            "Edges of a mesh that was drawn or edited, as from Candidate mesh. Every face needs "
            "four corners; to bar an edge use 'Forbidden places'. Empty: the tool makes one.",
            "line",
            optional=True,
            advanced=True,
        )
        yield parameters.layer(
            "START",
            "Earlier design",
            "Streets of an earlier design of this site: the search begins with them, so that a "
            "small change of what is asked takes a small time.",
            "line",
            optional=True,
            advanced=True,
        )
        yield from siteinputs.snapping(advanced=True)
        yield parameters.number(
            "EDGE_LENGTH",
            "Edge length of the candidate mesh",
            "Empty: as the block width implies.",
            unit="m",
            minimum=1.0,
            advanced=True,
        )
        yield from functions.inputs()
        yield from rules.rule_set()
        yield from rules.weights()
        yield rules.time_limit()
        yield from rules.search()

    def check(self, request: Request) -> None:
        """Check the specification and that given exits are given."""
        specification = specification_of(request)
        functions.check(request)
        if specification.sink_mode == "points" and not request.has("SINKS"):
            raise InputError(
                "Streets are to leave the site at given points, but no layer of points is given.",
                "Choose a layer for 'Given exits', or another place where streets may leave.",
            )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Prepare the sites, design all of them and collect the layers."""
        from ...algorithms.site import site_layers
        from ...algorithms.streets import NoDesignError, design_streets, no_plan, plan_layers

        specification = specification_of(request)
        presets.tell(request, progress)
        functions.remarks(request, specification, progress)
        prepared = siteinputs.prepared_sites(request, progress.part(0.0, 0.1))
        asked = _asked(request, specification, prepared.sites, progress)
        reading = progress.part(0.1, 0.12)
        given = {key: request.frame(key, reading) for key in LINES_AND_PLACES}
        wishes = wishes_of(request, given, functions.preferences(request, reading))
        of_site = {site.site_id: own for site, own in zip(prepared.sites, asked)}
        try:
            plan = design_streets(
                prepared.sites,
                lambda site: of_site[site.site_id],
                wishes=wishes,
                mesh=_given_mesh(request, progress.part(0.12, 0.14)),
                progress=progress.part(0.14, 0.97),
            )
        except NoDesignError as error:
            # the reasons are worth a map: the layer of problems tells where they lie
            progress.warn(f"{error} The layer of problems shows the places.")
            plan = no_plan(error.failures, asked[0])
        if plan.stopped == "cancelled":
            gap = plan.numbers["ACHIEVED_GAP"]
            progress.warn(
                f"Cancelled: the best design so far is kept. Its gap is {100 * gap:.1f} %, the "
                "distance of what was solved from its proven bound. Places that the search did "
                "not reach have no streets yet."
            )
        found = plan_layers(plan)
        progress.stage("Checking the streets", 0.98)
        around = site_layers(prepared)
        report = check_design(found, around, plan, given, progress.part(0.98, 1.0))
        broken = [] if report is None else [describe(report.problems, "Streets")]
        found["problems"] = joined(prepared.problems, found["problems"], *broken)
        return Result(
            crs=request.crs("INPUT"),
            layers={key: found[kind.key] for key, kind in self.layers.items()},
            numbers={
                **(plan.numbers if plan.plans else dict.fromkeys(plan.numbers, math.nan)),
                "VIOLATIONS": math.nan if report is None else report.violations,
            },
            specification=persite.record(specification, prepared.sites, asked),
            keep=True,
        )


def specification_of(request: Request) -> Any:
    """Return the `Specification` that all parameters together ask for."""
    base = rules.specification(request)
    return dataclasses.replace(base, **functions.specification(request))


def _asked(request: Request, base: Any, sites: Any, progress: FeedbackProgress) -> list[Any]:
    """Return the specification of each site, and say what is its own."""
    keys = persite.per_feature(request, ("BLOCK_WIDTH", "BLOCK_LENGTH"))
    asked = persite.specifications(request, base, keys, sites) if keys else [base] * len(sites)
    for site, own in zip(sites, asked):
        if keys:
            progress.info(f"{site.name}: blocks of {own.block_width:g} m x {own.block_length:g} m.")
    return asked


def wishes_of(
    request: Request, given: Mapping[str, Any], preferences: Callable[[Any], Any]
) -> Callable[[Any], Any]:
    """Return a function that gives the wishes about a site in its working CRS."""
    from ...algorithms.streets import Wishes

    def shapes(key: str, crs: Any) -> Any:
        frame = given[key]
        if frame is None:
            return {}
        parts = frame.geometry.to_crs(crs).explode(index_parts=False)
        return parts[~(parts.isna() | parts.is_empty)]

    def of_site(site: Any) -> Any:
        sinks = shapes("SINKS", site.crs)
        required, levels = drawnstreets.required_streets(given["REQUIRED"], site.crs)
        return Wishes(
            sinks=[(point.x, point.y) for _, point in sinks.items()],
            required=[line for _, line in required],
            required_levels=levels,
            forbidden=[shape for _, shape in shapes("FORBIDDEN", site.crs).items()],
            preferences=preferences(site),
            start=drawnstreets.earlier_streets(given["START"], site.crs),
            start_layer=request.name("START"),
            **drawnstreets.given_streets(request, given["GIVEN"], site.crs),
            sink_ids=[feature for feature, _ in sinks.items()],
            required_ids=[feature for feature, _ in required],
            sink_layer=request.name("SINKS"),
            required_layer=request.name("REQUIRED"),
        )

    return of_site


def _given_mesh(request: Request, progress: FeedbackProgress) -> Callable[[Any], Any] | None:
    """Return a function that gives the drawn mesh of a site, or None where none is drawn."""
    frame = request.frame("MESH_EDGES", progress)
    if frame is None:
        return None
    from ...algorithms.mesh import mesh_from_edges

    def of_site(site: Any) -> Any:
        own = frame
        if "site_id" in frame.columns:
            own = frame[frame["site_id"].isna() | (frame["site_id"] == site.site_id)]
        try:
            return mesh_from_edges(
                own.to_crs(site.crs), site_polygon=site.polygon, layer=request.name("MESH_EDGES")
            )
        except InputError as error:
            raise InputError(_placed(str(error), site)) from error

    return of_site


def _placed(text: str, site: Any) -> str:
    """Return a text with its places in the CRS of the planner's layers."""
    if site.crs == site.source_crs:
        return text
    from pyproj import Transformer

    turn = Transformer.from_crs(site.crs, site.source_crs, always_xy=True)
    digits = 6 if site.source_crs.is_geographic else 1

    def place(found: re.Match[str]) -> str:
        x, y = turn.transform(float(found[1]), float(found[2]))
        return f"({x:.{digits}f}, {y:.{digits}f})"

    return re.sub(r"\((-?[\d.]+), (-?[\d.]+)\)", place, text)
