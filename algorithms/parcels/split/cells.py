"""Regions with what became of them: blocks, plots, and what they cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import LineString

from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ...progress import Progress
from ..fill import fill_blocks
from ..fill.result import FillProblem
from ..refine import refine_blocks
from ..roadmesh import StreetMesh
from ..roadmesh.land import region_blocks
from ..rules import ParcelRules
from ..types import Block, Plot
from ..warp import Match
from .choosing import TemplateRules, matched

#: What land costs: each parcel its p_angle in degrees, its p_area above 1, and what an
#: undesirable one costs besides; green and street for each parcel that would fit there.
ANGLE, AREA, BAD, GREEN, STREET = 1.0, 50.0, 30.0, 12.0, 10.0


@dataclass(frozen=True)
class Cell:
    """A region and what became of it.

    Attributes
    ----------
    blocks, plots
        Its land, and what each piece was cut into.
    problems
        What a planner should know of them.
    cost
        See `cost_of`.
    streets
        Centre lines of the streets of a template, metres.
    """

    blocks: Sequence[Block]
    plots: Sequence[Sequence[Plot]]
    problems: Sequence[FillProblem]
    cost: float
    streets: Sequence[LineString] = ()


def fill_regions(
    mesh: StreetMesh,
    regions: Sequence[int],
    rules: ParcelRules,
    *,
    turning: float = 0.0,
    templates: TemplateRules | None = None,
    seed: int = 0,
    refine: bool = True,
    progress: Progress | None = None,
) -> dict[int, Cell]:
    """Cut the land of regions into plots.

    Parameters
    ----------
    mesh, regions
        The mesh and the numbers of the regions.
    rules
        What is asked of parcels.
    turning
        Radius of turning circles at blind ends, metres.
    templates
        The templates that the regions of the mesh are labelled with.
    seed
        Of whatever is random.
    refine
        Whether parcels are improved by least squares, which takes most of the time.
    progress
        Told of the work.
    """
    by_region = region_blocks(mesh, turning, regions)
    names = {r: mesh.labels[r] for r in by_region if r in mesh.labels}
    drawn = matched(names, by_region, templates, rules) if templates and names else {}
    blocks = [block for r, many in by_region.items() for block in many if r not in drawn]
    filled = fill_blocks(blocks, rules, seed=seed, refine=refine, progress=progress)
    problems: dict[int, list[FillProblem]] = {}
    for problem in filled.problems:
        problems.setdefault(problem.block_id, []).append(problem)
    rows = iter(filled.plots)
    by_template = _of_templates(drawn, by_region, rules, refine=refine)
    found = {}
    for region, own in by_region.items():
        inner: Sequence[LineString] = ()
        if region in drawn:
            plots, inner = [by_template[region]], drawn[region].streets
        else:
            plots = [next(rows) for _ in own]
        told = [problem for block in own for problem in problems.get(block.block_id, [])]
        cost = cost_of(float(mesh.polygon(region).area), plots, rules)
        found[region] = Cell(own, plots, told, cost, inner)
    return found


def _of_templates(
    drawn: Mapping[int, Match],
    by_region: Mapping[int, Sequence[Block]],
    rules: ParcelRules,
    *,
    refine: bool,
) -> dict[int, list[Plot]]:
    """Give the plots of the templates by region, improved like those of rows."""
    regions = sorted(drawn)
    plots: list[list[Plot]] = [list(drawn[region].plots) for region in regions]
    if refine and regions:
        plots = refine_blocks([by_region[r][0] for r in regions], plots, rules)
    return dict(zip(regions, plots))


def cost_of(area: float, plots: Sequence[Sequence[Plot]], rules: ParcelRules) -> float:
    """Cost of a region: what its plots lack, in degrees of p_angle summed over parcels.

    Costs of regions that are parts of another add up, so that one way to split it can be held
    against another.

    Parameters
    ----------
    area
        Of the region, square metres; what is no plot is street.
    plots
        By block.
    rules
        How large a parcel is.
    """
    every = [plot for many in plots for plot in many]
    parcels = np.array([p.polygon for p in every if p.use == "parcel"], dtype=object)
    land = sum(p.polygon.area for p in every if p.use in ("parcel", "green", "court"))
    green = sum(p.polygon.area for p in every if p.use in ("green", "court"))
    cost = (GREEN * green + STREET * (area - land)) / rules.area
    if len(parcels):
        angle, ratio = corner_deviation(parcels), rectangle_ratio(parcels)
        cost += float((ANGLE * angle + AREA * (ratio - 1)).sum())
        cost += BAD * float(undesirable(angle, ratio).sum())
    return float(cost)
