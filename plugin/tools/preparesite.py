"""Real parcels and roads become a site to design."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import fields
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import siteinputs


class PrepareSite(Tool):
    """Repairs, projects and snaps polygons and roads, and finds where streets may leave."""

    about = About(
        name="preparesite",
        title="Prepare site",
        group="site",
        tags=("site", "parcels", "roads", "boundary", "access", "repair", "platwright"),
        summary="Turns parcels or polygons and the roads around them into a site to design.",
        paragraphs=(
            "Polygons are repaired and joined where they adjoin. Roads along the edge become "
            "boundary streets, cut at junctions; an edge without a road is no street. Where "
            "other roads arrive are the access points. Everything that was repaired or left out "
            "is a feature of the problems layer.",
            "The layers may be edited before they go into Candidate mesh or Design streets; "
            "both also take raw polygons and roads.",
        ),
        picture="Parcels and roads as they come; site (green), boundary streets (thick), access "
        "points (triangles) and obstacles (hatched).",
    )
    layers: ClassVar = {
        "SITE": fields.SITE,
        "BOUNDARY_STREETS": fields.BOUNDARY_STREETS,
        "ACCESS_POINTS": fields.ACCESS_POINTS,
        "SITE_OBSTACLES": fields.SITE_OBSTACLES,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "SITES": "Number of sites",
        "AREA": "Area of all sites (ha)",
        "REPAIRS": "Number of problems found",
    }

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the site, the roads, the obstacles and how they are brought together."""
        yield siteinputs.site()
        yield siteinputs.roads()
        yield siteinputs.obstacles()
        yield from siteinputs.snapping(advanced=False)

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Prepare all sites of the layer."""
        from ...algorithms.site import site_layers

        prepared = siteinputs.prepared_sites(request, progress)
        found: dict[str, Any] = site_layers(prepared)
        return Result(
            crs=request.crs("INPUT"),
            layers={key: found[kind.key] for key, kind in self.layers.items()},
            numbers={
                "SITES": len(prepared.sites),
                "AREA": sum(site.area_ha for site in prepared.sites),
                "REPAIRS": len(prepared.problems),
            },
            specification=to_json(
                {
                    "snap_distance": request.number("SNAP_DISTANCE"),
                    "inner_roads": request.word("INNER_ROADS"),
                }
            ),
        )
